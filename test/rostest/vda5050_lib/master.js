// SPDX-License-Identifier: BSD-3-Clause
// A master of vda-5050-lib. It does what the lines of its input say, and writes what it hears as lines
// of JSON: {"order": {...}} assigns an order, {"instant": {...}} starts one instant action.
"use strict";
const readline = require("readline");
const { MasterController } = require("vda-5050-lib");

const [port, interfaceName, manufacturer, serialNumber] = process.argv.slice(2);
const agv = { manufacturer, serialNumber };
const say = event => process.stdout.write(JSON.stringify(event) + "\n");

const master = new MasterController(
    { interfaceName, transport: { brokerUrl: `mqtt://127.0.0.1:${port}` }, vdaVersion: "2.0.0" },
    { targetAgvs: agv });

const orderEvents = {
    onOrderProcessed: (error, byCancelation, active, context) =>
        say({ event: "processed", order: context.order.orderId, error: error && error.errorType, byCancelation, active }),
    onNodeTraversed: node => say({ event: "node", node: node.nodeId }),
    onEdgeTraversed: edge => say({ event: "edge", edge: edge.edgeId }),
    onActionStateChanged: state =>
        say({ event: "action", action: state.actionId, status: state.actionStatus }),
};
const instantEvents = {
    onActionStateChanged: (state, error, action) =>
        say({ event: "instant", action: action.actionId, status: state.actionStatus, error: error && error.errorType }),
    onActionError: (error, action) =>
        say({ event: "instant", action: action.actionId, status: "ERROR", error: error.errorType }),
};

async function act(line) {
    const wanted = JSON.parse(line);
    if (wanted.order) {
        await master.assignOrder(agv, wanted.order, orderEvents);
    } else {
        await master.initiateInstantActions(agv, { instantActions: [wanted.instant] }, instantEvents);
    }
}

async function main() {
    await master.start();
    master.trackAgvs((id, state) => say({ event: "connection", agv: id.serialNumber, state }));
    for await (const line of readline.createInterface({ input: process.stdin })) {
        await act(line);
    }
    await master.stop();
}

main().catch(error => {
    say({ event: "failed", error: String(error) });
    process.exit(1);
});
