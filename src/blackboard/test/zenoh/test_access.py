# SPDX-License-Identifier: BSD-3-Clause
"""Who may say what, by the keys that the access list names."""

import pytest

from blackboard.domain import talker as topics
from blackboard.zenoh.access import Identity, Role, access_control, key_of, speaks_on

HIVE_TOPICS = {each for each in vars(topics).values() if isinstance(each, topics.Topic)} - {
    topics.SET_STATE
}
OF_LEADERS = {
    topics.TASK_BROADCAST,
    topics.TASK_ASSIGN,
    topics.BACKUP,
    topics.SYNC,
    topics.BB_ENTRIES,
    topics.BB_VOTE,
}
OF_MEMBERS = {topics.TASK_STATE, topics.ROBOT_STATUS, topics.BB_ACK}
OF_ROBOTS = {topics.TASK_COST}
OF_OPERATORS = {topics.NEW_TASK, topics.TASK_CANCEL}


def may_say(role):
    """Return the topics of the hive on which someone of a role may speak, as itself."""
    keys = speaks_on("lab", Identity("anna", role, "anna.1"))
    assert all(key.endswith("/anna/**") for key in keys)
    return {topic for topic in HIVE_TOPICS if f"{key_of('lab', topic, 'anna')}/**" in keys}


@pytest.mark.parametrize(
    ("role", "said"),
    [
        (Role.BLACKBOARD, OF_LEADERS | OF_MEMBERS | {topics.NEW_TASK}),
        (Role.ROBOT, OF_LEADERS | OF_MEMBERS | {topics.NEW_TASK} | OF_ROBOTS),
        (Role.LEARNER, OF_MEMBERS | OF_ROBOTS),
        (Role.OPERATOR, OF_OPERATORS),
        (Role.VIEWER, set()),
    ],
)
def test_each_role_says_only_what_is_its_own(role, said):
    assert may_say(role) == said


def test_each_topic_of_the_hive_is_said_by_some_role():
    assert set().union(*map(may_say, set(Role) - {Role.ROUTER})) == HIVE_TOPICS


@pytest.mark.parametrize("role", [Role.ROBOT, Role.LEARNER])
def test_a_robot_speaks_in_its_own_namespace_and_in_no_other(role):
    keys = speaks_on("lab", Identity("robot2", role, "robot2.1"))

    assert [key for key in keys if key.count("/") > 4] == ["hive/lab/robot2/*/robot2/**"]


def test_an_operator_sets_the_state_of_any_robot():
    assert "hive/lab/*/set_state/anna/**" in speaks_on(
        "lab", Identity("anna", Role.OPERATOR, "a.1")
    )


def test_only_a_router_speaks_for_others():
    keys = {role: speaks_on("lab", Identity("anna", role, "anna.1")) for role in Role}

    assert [role for role, said in keys.items() if "hive/lab/**" in said] == [Role.ROUTER]


def test_what_no_rule_allows_is_denied_and_who_is_not_listed_gets_nothing():
    nobody = access_control("lab", [])
    one = access_control("lab", [Identity("anna", Role.VIEWER, "anna.1")])

    assert (nobody["default_permission"], nobody["policies"]) == ("deny", [])
    assert one["subjects"] == [{"id": "anna", "cert_common_names": ["anna.1"]}]
    assert one["policies"] == [
        {"rules": ["listen", "hear"], "subjects": ["anna"]},
        {"rules": ["anna lives"], "subjects": ["anna"]},
    ]
