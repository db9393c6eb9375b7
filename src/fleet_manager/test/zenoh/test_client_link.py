# SPDX-License-Identifier: BSD-3-Clause
"""The command line's link to a hive over Zenoh."""

import pytest

from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.talker import BACKUP, NEW_TASK, ROBOT_STATUS, SET_STATE, TASK_CANCEL
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.zenoh.access import Role
from blackboard.zenoh.settings import ZenohSettings
from fleet_manager.certs.site import Site
from fleet_manager.client.client import HiveClient
from fleet_manager.client.traffic import ZoneCommand
from fleet_manager.config.zenoh_operator import OperatorSite, operator_site
from fleet_manager.errors import InputError, NoHiveError
from fleet_manager.zenoh.client_link import ZenohClientLink, connect
from hive_common.pose import Pose

WITHIN = 20.0
TASK = Task("T1", TaskType.GA, (Pose(1.0, 2.0),))


def status(robot):
    return RobotStatus(robot, RobotState.IDLE, Pose(1.0, 2.0), 0.5)


@pytest.fixture
def link(site, leader, until_followed):
    """A link that has heard who leads."""
    with connect(site) as link:
        until_followed(BACKUP)
        leader.beat()
        link.receive(WITHIN)
        yield link


def test_a_task_is_posted_and_answered(link, leader):
    leader.answers = True

    answer = HiveClient(link).submit(TASK)

    assert answer.state is TaskState.WAITING
    topic, task = leader.asked.get(timeout=WITHIN)
    assert (topic, task.asks_the_same_as(TASK)) == (NEW_TASK, True)
    assert task.posted == 7.0


def test_what_a_person_asks_for_reaches_the_hive(link, leader):
    link.cancel("T1")
    link.set_state("robot1", "defect")
    link.switch(ZoneCommand("aisle", closed=True))

    asked = [leader.asked.get(timeout=WITHIN) for _ in range(3)]
    assert asked[:2] == [(TASK_CANCEL, "T1"), (SET_STATE, "defect")]
    assert asked[2][1].zone == "aisle"


def test_all_robots_are_heard_when_each_that_the_leader_hears_has_told_its_status(
    link, leader, until_followed
):
    link.listen(ROBOT_STATUS, BACKUP)
    until_followed(ROBOT_STATUS)
    for _ in range(2):  # when the second is there, the first has been noted
        leader.beat(heard={"robot1": 1, "robot2": 1})
        link.receive(WITHIN)
    assert not link.has_heard_robots()
    leader.say(ROBOT_STATUS, status("robot1"), by="robot1")
    link.receive(WITHIN)
    assert not link.has_heard_robots()

    leader.say(ROBOT_STATUS, status("robot2"), by="robot2")
    while not link.has_heard_robots():
        link.receive(0.05)


def test_the_hives_time_is_unknown_before_the_first_heartbeat(site, leader, until_followed):
    with connect(site) as link:
        until_followed(BACKUP)
        assert link.hive_time() == 0.0

        leader.beat()
        assert link.hive_time(WITHIN) == 7.0


def test_a_link_that_nothing_answers_says_where_it_looked(link):
    nowhere = operator_site(["tcp/127.0.0.1:9"])
    with connect(nowhere) as alone:
        (trouble,) = alone.troubles()

    assert "nothing is connected at tcp/127.0.0.1:9" in trouble
    assert link.troubles() == ()


@pytest.mark.usefixtures("leader")
def test_a_link_to_members_that_do_not_lead_says_that_all_have_to_be_named(site):
    with connect(site) as link:
        (trouble,) = link.troubles()

    assert "no leader is heard there" in trouble


def test_without_a_router_there_is_no_hive():
    site = OperatorSite(settings=ZenohSettings(connect=("tcp/127.0.0.1:9",), mode="client"))

    with pytest.raises(NoHiveError, match=r"no router answers at tcp/127.0.0.1:9"), connect(site):
        pass


def test_what_only_the_robots_machines_know_is_asked_for_there(link, tmp_path):
    with pytest.raises(NoHiveError, match="robot1 has learned is known on its machine"):
        link.learned_of("robot1")
    with pytest.raises(NoHiveError, match=r"load new\.yaml there"):
        link.change_map(tmp_path / "new.yaml")

    assert link.radius_of("robot1") is None
    assert link.places() == {}


def test_nobody_is_recorded_over_zenoh(site):
    with pytest.raises(InputError, match="omit --connect"), connect(site, ["robot1"]):
        pass


def test_only_an_operator_may_ask_for_anything(session, tmp_path):
    certificates = Site.new(tmp_path / "lab")
    for name, role in (("anna", Role.OPERATOR), ("eve", Role.VIEWER)):
        certificates.add(name, role)
    anna, eve = (
        ZenohClientLink(
            operator_site(["tls/127.0.0.1:9"], str(certificates.folder_of(name))), session
        )
        for name in ("anna", "eve")
    )

    anna.cancel("T1")
    with pytest.raises(InputError, match="eve has a viewer's certificate"):
        eve.cancel("T1")
