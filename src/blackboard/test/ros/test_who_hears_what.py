# SPDX-License-Identifier: BSD-3-Clause
"""Which members get a message: docs/decisions/070."""

from dataclasses import replace
from random import Random

import pytest

from blackboard.board.blackboard import Blackboard
from blackboard.consensus.journal import HardState, MemoryJournal
from blackboard.consensus.log import Log, Position, Snapshot
from blackboard.consensus.messages import AppendEntries, AppendReply, Heartbeat
from blackboard.consensus.node import RaftNode
from blackboard.costing.bid_basis import Bids
from blackboard.costing.euclidean_lengths import EuclideanLengths
from blackboard.domain.battery import Battery
from blackboard.domain.bid import Bid
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import Broadcast, Order
from blackboard.domain.settings import (
    BlackboardSettings,
    ControllerSettings,
    RaftSettings,
    RobotSettings,
)
from blackboard.domain.talker import (
    BACKUP,
    BB_ACK,
    BB_ENTRIES,
    BB_VOTE,
    NEW_TASK,
    ROBOT_STATUS,
    TASK_ASSIGN,
    TASK_BROADCAST,
    TASK_COST,
    TASK_STATE,
)
from blackboard.domain.task import StepKind, Task, TaskState, TaskType
from blackboard.robot.executor import Controller
from blackboard.robot.robot import Robot
from hive_common.map_id import NO_MAP
from hive_common.pose import Pose
from hive_lab.fault_schedules.faulty_network import FaultyNetwork, HostTalker
from hive_lab.virtual.hive import SMALL_ROBOT, TimedCommand, lone_node
from hive_lab.virtual.network import Network, NetworkTalker

GO = Task("T1", TaskType.GA, (Pose(6.0, 0.0),))
LEADER, CARRIERS = ("blackboard",), ("blackboard", "robot2")
SOON = 0.01  # longer than any message takes [s]


class Recorder(NetworkTalker):
    """A talker that records whom every message concerns."""

    def __init__(self, network, member):
        super().__init__(network, member)
        self.concerned = {}

    def publish(self, topic, message, to=None):
        self.concerned.setdefault(topic, []).append(None if to is None else tuple(to))
        super().publish(topic, message, to)


class Beside:
    """A HiveFilter that follows `blackboard`, whose backup is robot2."""

    hive, leader, carriers, leaders_map = "", LEADER, CARRIERS, NO_MAP

    def obeys(self, _hive, _epoch):
        return True

    def follow(self, hear):
        pass

    def show(self):
        pass


def robot():
    """Return a robot's talker after it has bid on, begun and done a task; and its network."""
    network = Network()
    talker = Recorder(network, "robot1")
    controller = Controller(
        dict.fromkeys(StepKind, TimedCommand(network, lambda _: 1.0)),
        talker,
        ControllerSettings(),
    )
    battery = Battery(SMALL_ROBOT.battery, 1.0)
    args = (SMALL_ROBOT, battery, EuclideanLengths(), controller, Pose(0.0, 0.0), RobotSettings())
    Robot(talker, "robot1", *args, MemoryJournal(), Beside()).start()
    network.send(TASK_BROADCAST, Broadcast(1, 1, ((GO, 0),)))
    network.send(BACKUP, Heartbeat(1, "blackboard", heard={"robot1": 0.0}, robot_lease=3.5))
    network.run(SOON)
    network.send(TASK_ASSIGN, Order(GO, "robot1", epoch=1, assignment=1))
    network.run(3.0)
    return talker, network


def test_bids_and_reports_concern_the_leader_only():
    talker, network = robot()

    said = {message.state for topic, message in network.heard if topic == TASK_STATE}
    assert said == {TaskState.STARTED, TaskState.DONE}
    assert set(talker.concerned[TASK_COST] + talker.concerned[TASK_STATE]) == {LEADER}


def test_a_status_also_concerns_the_backup_which_may_need_to_know_all_robots_at_once():
    talker, _ = robot()

    assert set(talker.concerned[ROBOT_STATUS]) == {CARRIERS}


def test_a_robot_sends_its_status_at_once_when_another_member_becomes_leader():
    talker, network = robot()
    before = len(talker.concerned[ROBOT_STATUS])
    network.send(BACKUP, Heartbeat(2, "robot2", heard={"robot1": network.now}))

    network.run(SOON)

    assert len(talker.concerned[ROBOT_STATUS]) == before + 1


class Desk:
    """A blackboard, and whom its messages concern."""

    def __init__(self):
        self.network = Network()
        self.talker = Recorder(self.network, "blackboard")
        backup = lone_node(self.talker)
        Blackboard(self.talker, backup, EuclideanLengths(), BlackboardSettings()).start()
        backup.start()
        for name in ("robot1", "robot2"):
            status = RobotStatus(name, RobotState.IDLE, Pose(0.0, 0.0), charge=0.8)
            self.say(ROBOT_STATUS, status)

    def say(self, topic, message):
        self.network.send(topic, message)
        self.network.run(SOON)

    def bid(self, robot, **costs):
        asked = next(m for topic, m in reversed(self.network.heard) if topic == TASK_BROADCAST)
        bids = tuple(Bid(robot, name, cost, eta=9.0) for name, cost in costs.items())
        self.say(TASK_COST, Bids(robot, 1, asked.auction, bids, asked.round))


def test_the_state_of_a_task_concerns_no_member_and_its_rejection_concerns_all():
    desk = Desk()
    desk.say(NEW_TASK, GO)
    desk.network.run(1.0)
    desk.say(NEW_TASK, replace(GO, priority=3))

    assert desk.talker.concerned[TASK_STATE] == [(), None]


def test_an_order_concerns_its_robot_and_a_round_the_robots_that_have_to_bid():
    desk = Desk()
    for name in ("T1", "T2", "T3"):
        desk.say(NEW_TASK, replace(GO, id=name))
    desk.bid("robot1", T1=1.0)
    desk.bid("robot2", T1=2.0)
    desk.bid("robot1", T2=3.0, T3=4.0)
    desk.bid("robot2", T2=8.0, T3=9.0)

    assert desk.talker.concerned[TASK_ASSIGN] == [("robot1",), ("robot1",)]
    both = ("robot1", "robot2")
    assert desk.talker.concerned[TASK_BROADCAST] == [None, both, ("robot1",)]


def follower():
    """Return the talker of a member that has heard epoch 4 of hive1, and the network."""
    network = Network()
    talker = Recorder(network, "robot9")
    RaftNode(talker, "robot9", RaftSettings(), MemoryJournal(), Random(1)).start()
    network.send(BACKUP, Heartbeat(4, "robot1", hive="hive1"))
    network.run(SOON)
    return talker, network


def test_an_acknowledgement_concerns_the_member_it_answers():
    talker, network = follower()
    network.send(BB_ENTRIES, AppendEntries(4, "robot1#1", Position(), (), 0, 0.0, hive="hive1"))
    network.run(SOON)

    assert talker.concerned[BB_ACK] == [("robot1",), ("robot1",)]


def test_a_leader_of_an_earlier_epoch_gets_an_answer():
    talker, network = follower()
    network.send(BACKUP, Heartbeat(3, "blackboard", hive="hive1"))
    network.run(SOON)

    assert talker.concerned[BB_ACK][-1] == ("blackboard",)


def test_every_member_answers_a_node_that_bootstraps_and_asks_who_is_there():
    talker, network = follower()
    network.send(BB_ACK, AppendReply("blackboard#2", 0, 0, 0.0))
    network.run(SOON)

    answer = network.heard[-1][1]
    assert talker.concerned[BB_ACK][-1] == ("blackboard",)
    assert (answer.epoch, answer.hive, answer.version) == (4, "hive1", 0)


def test_a_founder_beside_a_hive_that_nobody_carries_waits_for_it():
    network = Network()
    talker = NetworkTalker(network, "blackboard")
    disk = MemoryJournal()
    backup = RaftNode(talker, "blackboard", RaftSettings(), disk, Random(1), bootstrap=True)
    log = Log.of(Snapshot(Position(1, 1), members=("robot1#1", "gone#1")))
    held = MemoryJournal(HardState("robot1#1", 1, "", log, "hive1"))
    member = NetworkTalker(network, "robot1")
    RaftNode(member, "robot1", RaftSettings(), held, Random(2)).start()
    backup.start()
    network.run(10.0)

    assert backup.hive == ""
    assert "waits for that hive and does not bootstrap another" in talker.warnings[0]


@pytest.fixture
def ears():
    """What was heard on a topic by two members and by an operator, by name."""
    return {"robot1": [], "robot2": [], "operator": []}


def test_the_network_delivers_a_message_to_the_members_it_concerns_and_to_operators(ears):
    network = Network()
    for name in ("robot1", "robot2"):
        NetworkTalker(network, name).subscribe("topic", ears[name].append)
    network.listen("topic", ears["operator"].append)

    NetworkTalker(network, "blackboard").publish("topic", "news", to=("robot1",))
    network.run(1.0)

    assert ears == {"robot1": ["news"], "robot2": [], "operator": ["news"]}


def test_the_network_of_fault_schedules_does_so_too(ears):
    network = FaultyNetwork(Random(1))
    talkers = {name: HostTalker(network.add_host(name)) for name in ears}
    for name, talker in talkers.items():
        network.hosts[name].boot()
        talker.subscribe("topic", ears[name].append)
        if name != "operator":
            talker.subscribe(BB_VOTE, lambda _: None)

    talkers["robot1"].publish("topic", "news", to=("robot2",))
    network.run(1.0)

    assert ears == {"robot1": [], "robot2": ["news"], "operator": ["news"]}
