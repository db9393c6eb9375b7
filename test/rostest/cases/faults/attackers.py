# SPDX-License-Identifier: BSD-3-Clause
"""What strangers and members that lie can do to a hive over Zenoh: nothing that changes it.

Each attacker reaches the ports of all members. `docs/security.md` says what is not covered.
"""

import json
import random
import shutil
import time
from datetime import UTC, datetime, timedelta

import pytest
import rospy
import zenoh
from held_clock import PATIENT
from live_network import network_of
from live_site import doers, post, site_on

from blackboard.codec.tables import WIRES
from blackboard.consensus.log import Position
from blackboard.consensus.messages import Ballot, BallotKind, Heartbeat
from blackboard.costing.bid_basis import Bids
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.talker import (
    BACKUP,
    BB_VOTE,
    NEW_TASK,
    ROBOT_STATUS,
    SET_STATE,
    SYNC,
    TASK_COST,
    TASK_STATE,
)
from blackboard.domain.task import TaskState
from blackboard.zenoh.access import Role
from blackboard.zenoh.link import serialized
from blackboard.zenoh.session import Endpoints, session_config
from fleet_manager.certs.site import Site
from hive_common.pose import Pose
from hive_lab.live.live_operator import make_task

ROBOTS = ("robot1", "robot2")
HOSTS = ("blackboard", *ROBOTS)
STRANGERS = {"eve": Role.VIEWER, "mallory": Role.OPERATOR}
UNHURRIED = {"self_demotion": 20.0, "election": 22.0, "min_election": 22.0}
"""Parameters of a hive in which only a message can replace the leader: the attackers use the
processors of the members, and no member is deaf for so long [s]."""
RANDOM = 10_000
"""Random payloads on each key."""
FLOODS, FLOOD = 5, 2.0
"""How often, and how long each time, one identity says as much as it can [s]."""
EVIL = "evil"
"""The task that no attacker may post."""


@pytest.fixture(scope="session")
def network():
    """A host for each member."""
    with network_of(HOSTS) as network:
        yield network


@pytest.fixture(scope="session")
def site(network, tmp_path_factory):
    """A hive whose members share no ROS master."""
    with site_on(
        network,
        "attackers",
        tmp_path_factory,
        strangers=STRANGERS,
        robots=ROBOTS,
        blackboard=UNHURRIED,
        robot=PATIENT,
    ) as site:
        yield site


@pytest.fixture
def operator(site):
    """The hive's operator, once the hive is complete."""
    site.operator.wait_until_whole()
    return site.operator


@pytest.fixture
def unmoved(operator, request):
    """The attack changes nothing: the leader stays, no task is there, and the next one is done."""
    before = operator.last
    yield operator
    tasks = post(operator, f"after-{request.node.name}"[:60], 4)
    doers(operator, tasks)
    assert (operator.last.active, operator.last.epoch) == (before.active, before.epoch)
    assert operator.record_of(EVIL) is None


@pytest.fixture
def attack(site):
    """Return what opens a session with a certificate, that of a name or in a folder."""
    opened = []

    def begin(name="", folder=None):
        opened.append(Attacker(site, folder or site.certificates.folder_of(name)))
        if name:
            site.operator.demand(lambda: opened[-1].peers == len(HOSTS), f"{name} is let in")
        return opened[-1]

    yield begin
    for each in opened:
        each.session.close()


class Attacker:
    """Says what it likes to every member, with a certificate.

    Attributes:
        session: To all members, or to nobody who does not let it in.
    """

    def __init__(self, site, folder):
        config = session_config(Endpoints(connect=site.endpoints), folder)
        config["connect"] |= {"timeout_ms": 3000, "exit_on_failure": False}
        self.session = zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
        self._hive = site.certificates.name

    @property
    def peers(self):
        """To how many members it is connected."""
        return len(list(self.session.info.peers_zid()))

    def say(self, topic, speaker, payload):
        """Send bytes to all members, as a speaker."""
        self.session.put(
            f"hive/{self._hive}/{topic}/{speaker}",
            payload,
            congestion_control=zenoh.CongestionControl.BLOCK,
        )

    def tell(self, topic, speaker, value):
        """Send a value to all members, as a speaker."""
        self.say(topic, speaker, serialized(WIRES[topic].to_msg(value, rospy.get_time())))


def evil_task():
    return serialized(make_task(EVIL, (1.0, 1.0)))


def refusals(site, host, text):
    """Return the lines of a member's log that say why it has refused something."""
    lines = site.log_of(site.node_on(host)).splitlines()
    return [line for line in lines if "refused" in line and text in line]


def bad_certificate(kind, site, folder):
    """Return a folder with a certificate that lets nobody in."""
    if kind == "ended":
        copy = shutil.copytree(site.certificates.folder, folder / "lab")
        last_year = Site(copy, lambda: datetime.now(UTC) - timedelta(days=400))
        last_year.renew("robot1", days=30)
        return last_year.folder_of("robot1")
    if kind == "revoked":
        copy = Site(shutil.copytree(site.certificates.folder, folder / "lab"))
        copy.add("trudy", Role.ROBOT)  # the members' lists do not have it
        return copy.folder_of("trudy")
    stranger = Site.new(folder / site.certificates.name)
    stranger.add("robot1", Role.ROBOT)
    if kind == "signed by nobody":
        known = site.certificates.folder_of("robot1") / "authority.crt"
        shutil.copy(known, stranger.folder_of("robot1") / "authority.crt")
    return stranger.folder_of("robot1")


@pytest.mark.usefixtures("unmoved")
@pytest.mark.parametrize("kind", ["of another authority", "signed by nobody", "ended", "revoked"])
def test_who_has_no_certificate_of_the_site_posts_nothing(site, attack, tmp_path, kind):
    attacker = attack(folder=bad_certificate(kind, site, tmp_path))
    for topic, speaker in ((NEW_TASK, "laptop"), (NEW_TASK, "robot1"), (NEW_TASK, "trudy")):
        attacker.say(topic, speaker, evil_task())

    assert attacker.peers == 0 or kind == "revoked"


@pytest.mark.usefixtures("unmoved")
def test_what_a_viewer_posts_is_dropped(attack):
    eve = attack("eve")
    for speaker in ("eve", "laptop", "mallory"):
        eve.say(NEW_TASK, speaker, evil_task())


def test_an_operator_does_not_lead(unmoved, attack):
    mallory = attack("mallory")
    beat = Heartbeat(unmoved.last.epoch + 5, "/blackboard", hive=unmoved.last.hive)
    for speaker in ("mallory", "blackboard", "robot1"):
        mallory.tell(BACKUP, speaker, beat)


def test_a_robot_that_speaks_as_another_is_refused_and_one_line_says_so(site, unmoved, attack):
    robot2 = attack("robot2")
    victim = unmoved.lives["/robot1/robot"]
    hive, epoch = unmoved.last.hive, unmoved.last.epoch
    lies = {
        TASK_STATE: TaskUpdate("nothing", TaskState.DONE, "robot1", 0, 1),
        TASK_COST: Bids("robot1", epoch, 1, ()),
        BB_VOTE: Ballot(
            BallotKind.VOTE_REPLY, epoch + 1, victim, victim, Position(epoch, 9), True, hive=hive
        ),
        BACKUP: Heartbeat(epoch + 1, victim, hive=hive),
    }
    for topic, lie in lies.items():
        for _ in range(5):
            robot2.tell(topic, "robot1", lie)
            robot2.tell(topic, "robot2", lie)

    def counted():
        return all(any(refusals(site, host, f"on {topic}") for host in HOSTS) for topic in lies)

    unmoved.demand(counted, "each lie is refused by who listens")
    for host in HOSTS:
        for topic in lies:
            assert len(refusals(site, host, f"on {topic}")) <= 1


def test_random_payloads_on_every_key_change_nothing(site, unmoved, attack):
    robot2 = attack("robot2")
    draw = random.Random(1)
    for topic in sorted(WIRES):
        name = f"robot2/{topic}" if topic == SET_STATE else topic
        for _ in range(RANDOM):
            robot2.say(name, "robot2", draw.randbytes(draw.randrange(200)))

    unmoved.demand(lambda: refusals(site, "blackboard", "robot2"), "they are refused")


def test_ten_megabytes_are_refused(site, unmoved, attack):
    robot2 = attack("robot2")
    for topic in (TASK_STATE, SYNC, ROBOT_STATUS):
        robot2.say(topic, "robot2", bytes(10_000_000))

    unmoved.demand(
        lambda: refusals(site, "blackboard", "10000000 bytes"), "it is too long for the leader"
    )


def test_who_speaks_as_fast_as_it_can_holds_up_nobody_else(unmoved, attack):
    robot2 = attack("robot2")
    status = RobotStatus("robot2", RobotState.IDLE, Pose(1.0, 1.0), 0.5)
    payload = serialized(WIRES[ROBOT_STATUS].to_msg(status, rospy.get_time()))
    tasks = [make_task(f"flooded-{x}", (float(x), 1.0)) for x in range(FLOODS)]
    for task in tasks:
        unmoved.post_once(task)
        end = time.monotonic() + FLOOD
        while time.monotonic() < end:
            robot2.say(ROBOT_STATUS, "robot2", payload)

    doers(unmoved, [task.id for task in tasks])
