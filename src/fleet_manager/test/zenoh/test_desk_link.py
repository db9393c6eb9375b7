# SPDX-License-Identifier: BSD-3-Clause
"""The windows' link to a hive over Zenoh."""

import threading
from types import SimpleNamespace

import pytest
from attrs import evolve
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Path

from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskUpdate
from blackboard.domain.talker import NEW_TASK, ROBOT_STATUS, TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.zenoh.access import Role
from blackboard.zenoh.opening import open_session
from blackboard.zenoh.session import Endpoints, Mode, session_config
from fleet_manager.certs.site import Site
from fleet_manager.client.reports import HiveMessage
from fleet_manager.config.zenoh_operator import operator_site
from fleet_manager.desk.facts import (
    LinkChange,
    LinkState,
    MapKnown,
    PlacesKnown,
    PlannedPath,
    PostTask,
    ReadDecisions,
    RobotPose,
    TroublesRead,
)
from fleet_manager.desk.places import Place
from fleet_manager.zenoh.desk_link import ZenohDeskLink
from fleet_manager.zenoh.drives import Drives
from hive_common.pose import Pose

WITHIN = 20.0
_PAUSE = 0.01
TASK = Task("T1", TaskType.GA, (Pose(1.0, 2.0),))
STATUS = RobotStatus("robot1", RobotState.IDLE, Pose(1.0, 2.0), 0.5)


class Window:
    """A link, and the facts that it has brought."""

    def __init__(self, site, chart=""):
        self.link = ZenohDeskLink(site, chart)
        self.facts = []
        self._pause = threading.Event()

    def until(self, kind, holds=lambda _fact: True):
        """Return the next fact of a kind for which a condition holds."""
        for _ in range(int(WITHIN / _PAUSE)):
            while drained := self.link.drain(1):
                self.facts += drained
                if isinstance(drained[0], kind) and holds(drained[0]):
                    return drained[0]
            self._pause.wait(_PAUSE)
        raise AssertionError(f"no {kind.__name__}: {self.facts}")


@pytest.fixture
def show():
    """Start the links of windows; all stop with the test."""
    windows = []

    def show(site, chart=""):
        windows.append(Window(site, chart))
        windows[-1].link.start()
        return windows[-1]

    yield show
    for each in windows:
        each.link.stop()


def path_to(x, y):
    path = Path()
    end = PoseStamped()
    end.pose.position.x, end.pose.position.y = x, y
    path.poses = [PoseStamped(), end]
    return path


def pose_at(x, turned=1.0):
    msg = PoseWithCovarianceStamped()
    msg.pose.pose.position.x, msg.pose.pose.orientation.w = x, turned
    return msg


def test_a_window_is_told_where_it_looks_what_the_building_has_and_that_it_is_connected(
    show, site
):
    window = show(evolve(site, places={"dock": Pose(1.0, 2.0)}), "lab")

    assert window.until(LinkChange) == LinkChange(LinkState.SEARCHING, site.address, "hive")
    assert window.until(PlacesKnown).places == (Place("dock", Pose(1.0, 2.0)),)
    assert window.until(MapKnown).bounds.x_max > 0
    assert window.until(LinkChange).state is LinkState.UP


def test_a_window_is_told_when_the_hive_is_gone(show, site, leader):
    window = show(site)
    window.until(LinkChange, lambda change: change.state is LinkState.UP)

    leader.session.close()

    assert window.until(LinkChange).state is LinkState.LOST


def test_reports_poses_and_paths_of_robots_reach_the_window(
    show, site, leader, until_heard, until_followed
):
    window = show(site)
    until_followed()
    leader.beat()
    leader.say(ROBOT_STATUS, STATUS, by="robot1")
    window.until(HiveMessage, lambda fact: fact.report == STATUS)
    for topic in ("amcl_pose", "plan"):
        until_heard(leader.session, f"hive/hive/robot1/{topic}/robot1")
    leader.show("robot1", "amcl_pose", pose_at(3.0))
    leader.show("robot1", "plan", path_to(3.0, 4.0))

    assert window.until(RobotPose) == RobotPose("robot1", Pose(3.0, 0.0))
    assert window.until(PlannedPath) == PlannedPath("robot1", ((0.0, 0.0), (3.0, 4.0)))
    assert window.link.now() == 7.0


def test_what_is_no_pose_is_refused_with_one_line(session, site, leader, until_heard):
    facts, warnings = [], []
    heard = threading.Event()

    def put(fact, _supersedes):
        facts.append(fact)
        heard.set()

    Drives(session, site.settings.own(""), put, warnings.append).follow("robot1")
    until_heard(leader.session, "hive/hive/robot1/amcl_pose/robot1")
    for _ in range(3):
        leader.show("robot1", "amcl_pose", pose_at(3.0, turned=0.0))
    leader.session.put("hive/hive/robot1/amcl_pose/robot1", b"\x01")
    leader.show("robot1", "amcl_pose", pose_at(4.0))
    assert heard.wait(WITHIN)

    assert facts == [RobotPose("robot1", Pose(4.0, 0.0))]
    assert len(warnings) == 2


@pytest.mark.parametrize(
    ("name", "followed"),
    [
        ("robot1", ["hive/hive/robot1/amcl_pose/robot1", "hive/hive/robot1/plan/robot1"]),
        ("", []),
        ("*", []),
        ("a/b", []),
    ],
)
def test_a_robot_is_followed_unless_no_key_can_name_it(site, name, followed):
    keys = []
    session = SimpleNamespace(declare_subscriber=lambda key, _hear: keys.append(key))
    Drives(session, site.settings.own(""), [].append, [].append).follow(name)

    assert keys == followed


def test_what_a_person_sends_is_published_once_it_can_be(show, site, leader):
    window = show(site)
    window.link.send(ReadDecisions("T1"))
    window.link.send(PostTask(TASK))

    topic, task = leader.asked.get(timeout=WITHIN)

    assert (topic, task.asks_the_same_as(TASK)) == (NEW_TASK, True)


def test_a_list_is_shown_and_changes_of_tasks_at_once(show, site, leader, until_followed):
    window = show(site)
    until_followed()
    leader.beat()
    leader.answers = True
    window.link.send(PostTask(TASK))
    update = TaskUpdate("T1", TaskState.WAITING, "", 0, 1, epoch=1)

    window.until(HiveMessage, lambda fact: getattr(fact.report, "records", ()) != ())
    leader.say(TASK_STATE, update)
    window.until(HiveMessage, lambda fact: fact.report == update)


def test_a_map_that_cannot_be_read_is_a_trouble_and_the_rest_works(show, site):
    window = show(site, "/no/such/map.yaml")

    assert "/no/such/map.yaml" in window.until(TroublesRead).texts[0]
    assert window.until(LinkChange, lambda change: change.state is LinkState.UP)


def test_a_viewers_window_says_that_it_only_listens(show, tmp_path):
    certificates = Site.new(tmp_path / "lab")
    certificates.add("eve", Role.VIEWER)
    site = operator_site(["tls/127.0.0.1:9"], str(certificates.folder_of("eve")))

    assert "eve has a viewer's certificate" in show(site).until(TroublesRead).texts[0]


def test_a_window_waits_for_its_router_and_connects_once_it_is_there(show, site, leader):
    alone = evolve(site, settings=evolve(site.settings, mode="client"))
    leader.session.close()
    window = show(alone)
    assert window.until(LinkChange).state is LinkState.SEARCHING

    router = open_session(session_config(Endpoints((leader.endpoint,)), mode=Mode.ROUTER))
    try:
        assert window.until(LinkChange).state is LinkState.UP
    finally:
        router.close()
