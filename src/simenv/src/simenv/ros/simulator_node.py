# SPDX-License-Identifier: BSD-3-Clause
"""The simulator as a ROS node."""

from __future__ import annotations

import time
from dataclasses import fields, replace

import rospy
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Float64, UInt32
from std_srvs.srv import (
    Empty,
    EmptyRequest,
    EmptyResponse,
    SetBool,
    SetBoolRequest,
    SetBoolResponse,
    Trigger,
    TriggerRequest,
    TriggerResponse,
)
from tf2_msgs.msg import TFMessage

from hive_common.errors import HiveError
from hive_common.pose import Pose
from hive_common.ros.inbox import Inbox
from hive_common.ros.links import mend_links
from hive_common.ros.params import flag, number, text, whole_number
from hive_common.ros.refusal import forget_refusal, refuse_to_start
from hive_common.ros.sending import send_promptly
from hive_common.ros.signals import init_node, is_shutting_down
from robot_description.models import load_model
from simenv.errors import SimenvError
from simenv.faults import Fault, inject
from simenv.msg import Fault as FaultMsg
from simenv.noise import Noise
from simenv.pacing import Lockstep, Pacer
from simenv.ros.conversions import stamp_of
from simenv.ros.robot_topics import RobotTopics
from simenv.ros.world_markers import WorldMarkers
from simenv.simulation import STEP, Simulation
from simenv.srv import (
    InjectFault,
    InjectFaultRequest,
    InjectFaultResponse,
    Remove,
    RemoveRequest,
    RemoveResponse,
    SetDoor,
    SetDoorRequest,
    SetDoorResponse,
    Spawn,
    SpawnRequest,
    SpawnResponse,
)
from simenv.world.world_file import load_world

MIN_RTF, MAX_RTF = 0.01, 100.0  # the range of real-time factors

_BUSY = "the simulator is too busy to answer; try again"


class SimulatorNode:
    """Advances simulated time and publishes what happens.

    ROS Publishers:
        /clock (rosgraph_msgs/Clock): about 50 Hz of wall time.
        /tf (tf2_msgs/TFMessage): <robot>/odom -> <robot>/base_footprint, 20 Hz.
        simenv/collisions (std_msgs/UInt32): latched; contacts robot-wall and robot-robot so far.
    ROS Services:
        simenv/spawn (simenv/Spawn), simenv/remove (simenv/Remove)
        simenv/reset (std_srvs/Empty): returns robots, people, doors, loads, contacts to the start.
        simenv/pause (std_srvs/SetBool): true stops time, false lets it run.
        simenv/step (std_srvs/Trigger): one step while time is stopped.
        simenv/door (simenv/SetDoor): opens or shuts a door of the world.
        simenv/inject_fault (simenv/InjectFault): injects a fault, or ends it.
    ROS Subscribers:
        simenv/rtf (std_msgs/Float64): a new real-time factor, 0.01..100.
        simenv/fault (simenv/Fault): injects a fault, or ends it.
    ROS Parameters:
        ~world (lab), ~rtf (1), ~seed (0), ~noise (1), ~pick_failures (0), ~command_wait (1),
        ~start_at_date (false): see simulator.launch.

    Every robot adds its own topics: see `RobotTopics`.
    """

    def __init__(self, simulation: Simulation, rtf: float, command_wait: float) -> None:
        """Run a simulation `rtf` times as fast as wall time.

        It waits up to `command_wait` [s, see `listen_until`] for a command that is due.
        """
        self._simulation = simulation
        self._rtf = rtf
        self._inbox = Inbox()
        self._lockstep = Lockstep(command_wait)
        self._robots: dict[str, RobotTopics] = {}
        self._collisions = -1
        self._warned = False
        self._paused = False
        self._scene = WorldMarkers(simulation)

    def start(self) -> None:
        """Open topics and services."""
        self._clock = rospy.Publisher("/clock", Clock, queue_size=5, tcp_nodelay=True)
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=50, tcp_nodelay=True)
        self._count = rospy.Publisher("simenv/collisions", UInt32, queue_size=5, latch=True)
        self._services = (
            rospy.Service("simenv/spawn", Spawn, self._spawn_called),
            rospy.Service("simenv/remove", Remove, self._remove_called),
            rospy.Service("simenv/door", SetDoor, self._door_called),
            rospy.Service("simenv/inject_fault", InjectFault, self._fault_called),
            rospy.Service("simenv/reset", Empty, self._reset_called),
            rospy.Service("simenv/pause", SetBool, self._pause_called),
            rospy.Service("simenv/step", Trigger, self._step_called),
        )
        rospy.Subscriber("simenv/fault", FaultMsg, self._fault_heard, queue_size=10)
        rospy.Subscriber("simenv/rtf", Float64, self._rtf_heard, queue_size=1)
        self._scene.start()

    def run(self) -> None:
        """Run until the node is shut down."""
        self._pacer = Pacer(self._rtf, STEP, time.monotonic())
        while not rospy.is_shutdown():
            try:
                self._inbox.empty()
                steps = self._pacer.steps
                if not self._paused:
                    self._await_commands()
                    now = self._simulation.nanoseconds
                    steps = self._lockstep.steps_until_due(now, STEP, steps)
                    self._tick(steps)
            except rospy.ROSException:
                if is_shutting_down():
                    return  # the topics closed during the tick
                raise
            pause = self._pacer.tick_done(time.monotonic(), steps)
            if self._pacer.reached is not None and not self._warned:
                self._warned = True
                rospy.logwarn(
                    f"this machine reaches a real-time factor of {self._pacer.reached:.2f}, not "
                    f"{self._rtf:g}; nothing is skipped, simulated time goes slower"
                )
            time.sleep(pause)

    def _await_commands(self) -> None:
        now = self._simulation.nanoseconds
        late = self._lockstep.wait(now, self._inbox.wait, time.monotonic)
        if late:
            rospy.logwarn_throttle(10.0, f"no command came in time for {', '.join(late)}")

    def _tick(self, steps: int) -> None:
        """Take some steps, publish the time, then what happened: no stamp is ever ahead."""
        due: list[tuple[rospy.Publisher, object]] = []
        for _ in range(steps):
            self._simulation.step()
            now = self._simulation.nanoseconds
            found = [robot.transform(now) for robot in self._robots.values()]
            transforms = [transform for transform in found if transform is not None]
            if transforms:
                due.append((self._tf, TFMessage(transforms)))
            for robot in self._robots.values():
                due.extend(robot.collect(now))
        self._clock.publish(Clock(stamp_of(self._simulation.nanoseconds)))
        for publisher, message in due:
            publisher.publish(message)
        self._scene.tick(self._simulation.nanoseconds)
        for robot in self._robots.values():
            robot.report(self._simulation.nanoseconds)
        if self._simulation.collisions != self._collisions:
            for contact in self._simulation.contacts[max(self._collisions, 0) :]:
                rospy.logwarn(f"collision: {contact}")
            self._collisions = self._simulation.collisions
            self._count.publish(UInt32(self._collisions))

    def _reset_called(self, _request: EmptyRequest) -> EmptyResponse:
        self._inbox.ask(self._simulation.reset, None)
        return EmptyResponse()

    def _pause_called(self, request: SetBoolRequest) -> SetBoolResponse:
        def pause() -> SetBoolResponse:
            self._paused = request.data
            word = "stands still" if self._paused else "goes on"
            return SetBoolResponse(True, f"time {word} at {self._simulation.time:.3f} s")

        return self._inbox.ask(pause, SetBoolResponse(False, _BUSY))

    def _step_called(self, _request: TriggerRequest) -> TriggerResponse:
        def step() -> TriggerResponse:
            if not self._paused:
                return TriggerResponse(False, "time runs; stop it with simenv/pause first")
            self._tick(1)
            return TriggerResponse(True, f"it is {self._simulation.time:.3f} s now")

        return self._inbox.ask(step, TriggerResponse(False, _BUSY))

    def _rtf_heard(self, message: Float64) -> None:
        if not MIN_RTF <= message.data <= MAX_RTF:
            rospy.logwarn(f"real-time factor {message.data}; allowed: {MIN_RTF:g} to {MAX_RTF:g}")
            return
        self._inbox.put(lambda: self._set_rtf(message.data))

    def _set_rtf(self, factor: float) -> None:
        self._rtf, self._warned = factor, False
        self._pacer = Pacer(factor, STEP, time.monotonic())

    def _door_called(self, request: SetDoorRequest) -> SetDoorResponse:
        def door() -> SetDoorResponse:
            try:
                self._simulation.set_door(request.name, is_open=request.open)
            except SimenvError as error:
                return SetDoorResponse(False, str(error))
            self._scene.show()
            return SetDoorResponse(
                True, f"'{request.name}' is {'open' if request.open else 'shut'}"
            )

        return self._inbox.ask(door, SetDoorResponse(False, _BUSY))

    def _fault_called(self, request: InjectFaultRequest) -> InjectFaultResponse:
        return self._inbox.ask(
            lambda: InjectFaultResponse(*self._inject(request.fault)),
            InjectFaultResponse(False, _BUSY),
        )

    def _fault_heard(self, msg: FaultMsg) -> None:
        self._inbox.put(lambda: rospy.logwarn(self._inject(msg)[1]))

    def _inject(self, msg: FaultMsg) -> tuple[bool, str]:
        """Inject a fault; return whether it worked, and what to say."""
        try:
            said = inject(self._simulation, Fault(msg.kind, msg.target, msg.value, msg.area))
        except SimenvError as error:
            return False, str(error)
        self._scene.show()
        return True, said

    def _spawn_called(self, request: SpawnRequest) -> SpawnResponse:
        return self._inbox.ask(lambda: self._spawn(request), SpawnResponse(False, _BUSY))

    def _remove_called(self, request: RemoveRequest) -> RemoveResponse:
        return self._inbox.ask(lambda: self._remove(request), RemoveResponse(False, _BUSY))

    def _spawn(self, request: SpawnRequest) -> SpawnResponse:
        pose = Pose(request.pose.x, request.pose.y, request.pose.theta)
        try:
            self._simulation.add_robot(request.name, load_model(request.model), pose)
        except HiveError as error:
            return SpawnResponse(False, str(error))
        self._robots[request.name] = RobotTopics(
            request.name,
            self._simulation,
            self._inbox,
            self._lockstep,
            phase=len(self._robots),
        )
        return SpawnResponse(True, f"{request.name} ({request.model}) stands at {pose}")

    def _remove(self, request: RemoveRequest) -> RemoveResponse:
        try:
            self._simulation.model(request.name)
        except SimenvError as error:
            return RemoveResponse(False, str(error))
        self._robots.pop(request.name).close()
        self._simulation.remove_robot(request.name)
        self._lockstep.forget(request.name)
        return RemoveResponse(True, f"{request.name} is removed")


def main() -> int:
    """Run the node; return its exit code."""
    init_node("simulator")
    send_promptly()
    mend_links()
    forget_refusal()
    try:
        simulation = _simulation()
        rtf = number("rtf", least=MIN_RTF, most=MAX_RTF, default=1.0)
        command_wait = number("command_wait", least=0.0, most=60.0, default=1.0)
    except HiveError as error:
        refuse_to_start(str(error))
        return 1
    node = SimulatorNode(simulation, rtf, command_wait)
    node.start()
    rospy.loginfo(
        f"simulating the world '{simulation.world.name}' at a real-time factor of {rtf:g}"
    )
    node.run()
    return 0


def _simulation() -> Simulation:
    """Make the simulation of the parameters; `~noise_laser` and the like go before `~noise`."""
    noise = Noise().times(number("noise", least=0.0, most=100.0, default=1.0))
    own = {
        field.name: number(f"noise_{field.name}", least=0.0, most=10.0)
        for field in fields(Noise)
        if rospy.has_param(f"~noise_{field.name}")
    }
    return Simulation(
        load_world(text("world", default="lab")),
        seed=whole_number("seed", least=0, most=2**31, default=0),
        noise=replace(noise, **own),
        pick_failures=number("pick_failures", least=0.0, most=1.0, default=0.0),
        start=time.time_ns() if flag("start_at_date", default=False) else 0,
    )
