# SPDX-License-Identifier: BSD-3-Clause
"""Simulated links over Zenoh do what was measured of real ones."""

from random import Random

import pytest

from blackboard.consensus.messages import Heartbeat
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.talker import (
    BACKUP,
    BB_VOTE,
    NEW_TASK,
    ROBOT_STATUS,
    SYNC,
    TASK_ASSIGN,
    TASK_STATE,
)
from blackboard.domain.task import TaskState
from hive_common.pose import Pose
from hive_lab.fault_schedules.faulty_network import HostTalker, Load, Quality
from hive_lab.fault_schedules.schedule import Site
from hive_lab.fault_schedules.zenoh_network import ZenohNetwork

CUT = {("robot1", "robot2"), ("robot2", "robot1")}


class Place:
    """Three processes whose links are over Zenoh; what each hears is in `heard`."""

    def __init__(self, site=Site(), topics=(NEW_TASK, TASK_ASSIGN, SYNC)):  # noqa: B008  (frozen)
        self.network = ZenohNetwork(Random(1), 1.0, site)
        names = ("robot1", "robot2", "robot3")
        self.heard = {name: [] for name in names}
        self.topics = topics
        self.talkers = {name: HostTalker(self.network.add_host(name), name) for name in names}
        for name in names:
            self.start(name)
        self.run(1.0)

    def start(self, name):
        """Start a process, which listens."""
        self.network.hosts[name].boot()
        for topic in self.topics:
            self.talkers[name].subscribe(topic, self.heard[name].append)

    def run(self, duration):
        """Let time pass [s]."""
        self.network.run(self.network.now + duration)

    def say(self, *words, topic=NEW_TASK, who="robot1"):
        """Say something to all others."""
        for word in words:
            self.talkers[who].publish(topic, word)

    def cut(self, pairs):
        """Let no packet pass between these pairs from now on."""
        self.network.cut.clear()
        self.network.cut |= pairs
        self.network.release()


@pytest.fixture
def place():
    """Return three processes that are connected."""
    return Place()


def test_messages_of_a_priority_keep_their_order(place):
    place.network.quality = Quality(loss=0.3, delay=0.5)
    words = list(range(100))

    place.say(*words)
    place.run(60.0)

    assert place.heard["robot2"] == words


def test_what_is_said_while_a_cable_is_out_for_a_moment_arrives_later(place):
    place.cut(CUT)
    place.say("held")
    place.run(3.0)
    assert "held" not in place.heard["robot2"]

    place.cut(set())
    place.run(3.1)

    assert place.heard["robot2"] == ["held"]
    assert place.network.counts["connections lost"] == 0


def test_of_what_has_waited_urgent_messages_may_come_first():
    orders = set()
    for seed in range(20):
        place = Place()
        place.network.random.seed(seed)
        place.cut(CUT)
        place.say("task")
        place.say("order", topic=TASK_ASSIGN)
        place.run(1.0)
        place.cut(set())
        place.run(2.0)
        orders.add(tuple(place.heard["robot2"]))

    assert {("task", "order"), ("order", "task")} <= orders


def test_a_connection_is_lost_with_all_it_holds_when_the_cable_is_out_for_longer(place):
    place.cut(CUT)
    place.say("lost")
    place.run(8.0)
    place.cut(set())
    place.run(1.0)
    place.say("later")
    place.run(1.0)

    assert place.heard["robot2"] == ["later"]
    assert place.heard["robot3"] == ["lost", "later"]


def test_where_only_one_direction_is_cut_the_other_passes_until_acknowledgements_are_missed(place):
    place.cut({("robot2", "robot1")})
    place.say(*range(30))
    place.run(0.2)

    assert place.heard["robot2"] == list(range(10))


def test_the_list_and_the_own_status_are_repeated_for_a_process_that_connects():
    place = Place(topics=(SYNC, ROBOT_STATUS, NEW_TASK))
    own = RobotStatus("robot1", RobotState.IDLE, Pose(0.0, 0.0), 1.0)
    of_another = RobotStatus("robot3", RobotState.OFFLINE, Pose(0.0, 0.0), 1.0)
    place.say("list", topic=SYNC)
    place.say(own, of_another, topic=ROBOT_STATUS)
    place.say("task")
    place.run(1.0)
    place.network.hosts["robot2"].crash()
    place.heard["robot2"].clear()

    place.start("robot2")
    place.run(1.0)

    assert sorted(place.heard["robot2"], key=str) == [own, "list"]


def test_the_list_is_repeated_once_for_a_process_that_begins_to_listen_to_it():
    place = Place(topics=())
    place.say("list", topic=SYNC)
    lists = []
    for _ in range(2):
        place.talkers["robot2"].subscribe(SYNC, lists.append).cancel()
        place.talkers["robot2"].subscribe(SYNC, lists.append)
        place.run(1.0)
        place.network.hosts["robot2"].handlers[SYNC].clear()

    assert lists == ["list"]


def test_a_loss_of_routers_does_not_end_an_earlier_one_sooner():
    place = Place(Site(routers=True))
    place.network.lose_routers(5.0)
    place.network.lose_routers(0.0)
    place.run(2.0)
    place.say("lost")
    place.run(5.0)

    assert place.heard["robot2"] == []


def test_what_is_said_before_a_process_is_connected_is_lost(place):
    place.network.hosts["robot2"].crash()
    place.start("robot2")
    place.say("too early")
    place.run(1.0)

    assert place.heard["robot2"] == []


def test_where_more_is_said_than_a_link_carries_ordinary_messages_are_lost_and_urgent_ones_late(
    place,
):
    place.network.quality = Quality(load=Load(takes=1.0, buffered=0.5, room=3.0))
    place.say(*range(10))
    place.say("order", topic=TASK_ASSIGN)
    place.run(0.4)
    assert place.heard["robot2"] == []

    place.run(0.2)
    assert place.heard["robot2"] == ["order"]

    place.run(20.0)
    assert place.heard["robot2"] == ["order", 0, 1, 2, 3]


def test_a_suspended_process_may_get_what_was_said_in_the_first_ten_seconds():
    heard = set()
    for seed in range(20):
        place = Place()
        place.network.random.seed(seed)
        host = place.network.hosts["robot2"]
        host.frozen = True
        for second in range(14):
            place.say(second)
            place.run(1.0)
        host.thaw()
        place.run(1.0)
        place.say("connected again")
        place.run(1.0)
        heard.add(tuple(place.heard["robot2"]))

    assert heard == {(*range(11), "connected again"), ("connected again",)}


class Watch:
    """Watches robot2 from robot1."""

    def __init__(self, place):
        self.deaths = []
        self.place = place
        place.talkers["robot1"].watch("robot2", lambda: self.deaths.append(place.network.now))

    def crash(self):
        """End robot2's process; return when."""
        self.place.network.hosts["robot2"].crash()
        return self.place.network.now


def test_a_death_is_proved_within_a_tenth_of_a_second(place):
    watch = Watch(place)
    crashed = watch.crash()
    place.run(1.0)

    assert watch.deaths == [pytest.approx(crashed, abs=0.1)]


def test_no_death_is_proved_of_a_process_that_cannot_be_asked_until_it_can(place):
    watch = Watch(place)
    place.cut(CUT)
    watch.crash()
    place.run(20.0)
    assert watch.deaths == []

    place.cut(set())
    place.run(1.0)
    assert len(watch.deaths) == 1


def test_no_death_is_proved_of_a_process_that_is_back_before_it_is_asked(place):
    watch = Watch(place)
    watch.crash()
    place.start("robot2")
    place.run(1.0)

    assert watch.deaths == []


def test_no_death_is_proved_through_routers():
    place = Place(Site(routers=True))
    watch = Watch(place)
    watch.crash()
    place.run(60.0)

    assert watch.deaths == []


def test_the_loss_of_the_routers_ends_all_connections_and_others_take_over():
    place = Place(Site(routers=True))
    place.network.lose_routers(2.0)
    place.say("lost")
    place.run(3.0)
    assert place.network.counts["connections lost"] == 3
    place.say("later")
    place.run(1.0)

    assert place.heard == {name: ["later"] for name in ("robot2", "robot3")} | {
        "robot1": ["lost", "later"]
    }


def test_with_two_ways_every_message_arrives_twice():
    place = Place(Site(twice=True))
    place.say("task")
    place.run(1.0)

    assert place.heard["robot2"] == ["task", "task"]


def test_a_member_refuses_what_a_process_says_for_another_robot_unless_that_leads():
    place = Place(topics=(BACKUP, TASK_STATE))
    update = TaskUpdate("T1", TaskState.DONE, "robot3", 1, 1)
    place.say(update, topic=TASK_STATE)
    place.run(1.0)
    assert place.heard["robot2"] == []
    assert place.network.counts["refused"] > 0

    beat = Heartbeat(1, "robot1", "robot2")
    place.say(beat, topic=BACKUP)
    place.run(1.0)
    place.say(update, topic=TASK_STATE)
    place.run(1.0)

    assert place.heard["robot2"] == [beat, update]


def test_a_message_to_some_members_is_not_delivered_to_the_others():
    place = Place(topics=(NEW_TASK, BB_VOTE))
    place.talkers["robot1"].publish(NEW_TASK, "task", to=("robot2",))
    place.run(1.0)

    assert (place.heard["robot2"], place.heard["robot3"]) == (["task"], [])
