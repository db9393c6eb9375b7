// SPDX-License-Identifier: BSD-3-Clause
// A virtual AGV of vda-5050-lib, which stands at (x, y) of a map until its input ends.
"use strict";
const { AgvController, VirtualAgvAdapter } = require("vda-5050-lib");

const [port, interfaceName, manufacturer, serialNumber, mapId, x, y] = process.argv.slice(2);
const say = event => process.stdout.write(JSON.stringify(event) + "\n");

const agv = new AgvController(
    { manufacturer, serialNumber },
    { interfaceName, transport: { brokerUrl: `mqtt://127.0.0.1:${port}` }, vdaVersion: "2.0.0" },
    { agvAdapterType: VirtualAgvAdapter, publishStateInterval: 1000, publishVisualizationInterval: 200 },
    {
        initialPosition: { mapId, x: Number(x), y: Number(y), theta: 0, lastNodeId: "start" },
        initialBatteryCharge: 50,
        vehicleSpeed: 2,
        tickRate: 10,
    });

async function main() {
    await agv.start();
    say({ event: "ready" });
    for await (const _ of process.stdin) {
        // whatever comes: the end of the input ends the AGV
    }
    await agv.stop();
}

main().catch(error => {
    say({ event: "failed", error: String(error) });
    process.exit(1);
});
