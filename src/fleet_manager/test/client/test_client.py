# SPDX-License-Identifier: BSD-3-Clause
from dataclasses import replace

import pytest

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.task import Task, TaskState, TaskType
from fleet_manager.client.client import (
    ANSWER_WITHIN,
    LISTED_WITHIN,
    STATUS_PERIOD,
    Feeder,
    HiveClient,
    id_of,
)
from fleet_manager.client.leadership import SILENCE
from fleet_manager.config.scenario import PlannedTask
from fleet_manager.errors import InputError, NoHiveError, NotDoneError, TimeUpError
from fleet_manager.testing import FakeHive, FakeLink
from hive_common.pose import Pose

TASK = Task("T1", TaskType.GA, (Pose(1.0, 2.0),))


@pytest.fixture
def link():
    return FakeLink()


def test_a_task_is_posted_once_where_the_blackboard_answers_at_once(link):
    FakeHive(link)

    answer = HiveClient(link).submit(TASK)

    assert answer.state is TaskState.WAITING
    assert [task.asks_the_same_as(TASK) for task in link.posted] == [True]


def test_a_task_is_posted_again_unchanged_until_the_blackboard_answers(link):
    FakeHive(link, deaf=3)

    answer = HiveClient(link).submit(TASK)

    assert answer.state is TaskState.WAITING
    assert len(link.posted) == 4
    assert all(task.asks_the_same_as(TASK) for task in link.posted)


def test_a_task_says_when_it_was_posted_however_often_it_is_repeated(link):
    client = HiveClient(link)
    client.pump(lambda: False, 7.0)
    FakeHive(link, deaf=2)

    client.submit(TASK)

    assert [task.posted for task in link.posted] == [link.epoch + 7.0] * 3


def test_a_task_that_is_posted_before_the_clock_is_heard_says_no_time(link):
    link.clock_at = 3.0
    FakeHive(link)

    HiveClient(link).submit(TASK)

    assert [task.posted for task in link.posted] == [0.0]


def test_it_is_said_when_no_blackboard_answers(link):
    with pytest.raises(NoHiveError, match="none was heard") as caught:
        HiveClient(link).submit(TASK)

    assert link.now() == pytest.approx(ANSWER_WITHIN)
    assert caught.value.exit_code == 3


def test_a_blackboard_that_beats_and_does_not_answer_is_named(link):
    link.say(Heartbeat(4, "/robot2"))

    with pytest.raises(NoHiveError, match="the last one heard was robot2"):
        HiveClient(link).submit(TASK)


def test_a_rejection_is_an_answer(link):
    rejection = TaskUpdate("T1", TaskState.REJECTED, reason="goal A is inside a wall")
    link.on_post = lambda _task: link.say(rejection)

    answer = HiveClient(link).submit(TASK)

    assert (answer.state, answer.reason) == (TaskState.REJECTED, "goal A is inside a wall")


def test_an_answer_to_another_task_is_none(link):
    link.say(TaskUpdate("T2", TaskState.WAITING))

    with pytest.raises(NoHiveError):
        HiveClient(link).submit(TASK)


def test_an_id_that_another_task_has_is_refused(link):
    hive = FakeHive(link)
    client = HiveClient(link)
    client.submit(TASK)
    hive.start()
    client.fetch_tasks()

    with pytest.raises(NotDoneError, match="T1 is taken by another task"):
        client.submit(Task("T1", TaskType.GA, (Pose(9.0, 9.0),)))


def test_a_rejection_that_answers_another_program_s_task_is_no_answer(link):
    def answer(task):
        link.say(TaskUpdate("T1", TaskState.REJECTED, reason="the id is taken by another task"))
        link.say(TaskList(1, 1, (TaskRecord(task),)), after=0.2)

    link.on_post = answer

    assert HiveClient(link).submit(TASK).state is TaskState.WAITING
    assert link.now() == pytest.approx(0.2)


def test_a_task_without_an_id_gets_the_next_number(link):
    hive = FakeHive(link)
    hive.records["T8"] = TaskRecord(replace(TASK, id="T8"))
    hive.start()

    answer = HiveClient(link).submit_numbered(replace(TASK, id=""))

    assert id_of(answer) == "T9"


def numbered_by_another_program():
    """Return the task of the same content that another program posts as T1."""
    link = FakeLink()
    FakeHive(link).start()
    HiveClient(link).submit_numbered(replace(TASK, id=""))
    return link.posted[0]


def test_two_programs_that_choose_one_number_at_once_get_a_task_each(link):
    hive = FakeHive(link)
    hive.start()
    others = numbered_by_another_program()
    take_in = link.on_post

    def overtaken(task):
        hive.records.setdefault("T1", TaskRecord(others))
        take_in(task)
        link.say(TaskList(1, 9, (TaskRecord(others),)), after=0.1)

    link.on_post = overtaken
    answer = HiveClient(link).submit_numbered(replace(TASK, id=""))

    assert id_of(answer) == "T2"
    assert hive.records["T1"].task == others


def test_a_robot_that_is_commanded_is_told_until_it_obeys(link):
    client = commanded(link, [RobotState.IDLE, RobotState.IDLE, RobotState.DEFECT])

    told = client.command("robot1", "defect")

    assert told.state is RobotState.DEFECT
    assert link.told == [("robot1", "defect")] * 3


def test_a_robot_that_does_not_obey_is_said_with_its_reason(link):
    client = commanded(link, [RobotState.DEFECT] * 30)

    with pytest.raises(NotDoneError, match="robot1 is still defect: a load is on board"):
        client.command("robot1", "idle")


def test_a_robot_at_a_charger_is_out_of_service_only_when_it_says_so(link):
    client = commanded(link, [RobotState.CHARGING, RobotState.CHARGING, RobotState.DEFECT])

    assert client.command("robot1", "defect").state is RobotState.DEFECT
    assert link.told == [("robot1", "defect")] * 3


def test_a_robot_that_is_so_already_is_given_time_to_hear_it(link):
    client = commanded(link, [RobotState.IDLE] * 9)
    begin = link.now()

    assert client.command("robot1", "idle").state is RobotState.IDLE
    assert link.now() >= begin + 0.5


@pytest.mark.parametrize(("state", "payload"), [(RobotState.IDLE, 0.0), (RobotState.BUSY, 2.0)])
def test_a_robot_without_a_load_that_was_left_is_not_sent_to_put_it_down(link, state, payload):
    client = commanded(link, [], payload, first=state)

    with pytest.raises(NotDoneError, match="robot1 has no load that was left on board"):
        client.command("robot1", "put_down 1 2 0")
    assert link.told == []


def test_a_robot_that_brings_its_load_to_a_place_obeys(link):
    client = commanded(
        link, [RobotState.DEFECT] * 2, 2.0, first=RobotState.DEFECT, then="brings it"
    )

    assert client.command("robot1", "put_down 1 2 0").reason == "brings it"
    assert link.told == [("robot1", "put_down 1 2 0")] * 2


def test_a_robot_with_a_load_goes_to_charge_later_and_is_not_waited_for(link):
    client = commanded(link, [RobotState.BUSY] * 9, payload=2.0)

    assert client.command("robot1", "charge").state is RobotState.BUSY


def test_a_robot_with_a_load_that_was_left_does_not_go_to_charge_which_is_said(link):
    client = commanded(link, [RobotState.DEFECT] * 30, payload=2.0, first=RobotState.DEFECT)

    with pytest.raises(NotDoneError, match="robot1 is still defect: a load is on board"):
        client.command("robot1", "charge")


def commanded(link, states, payload=0.0, first=RobotState.BUSY, then="a load is on board"):
    """Return a client that knows robot1, which is in one state after the other when told.

    Its payload [kg] stays; its reason is another one with the last state.
    """
    answers = list(states)
    status = RobotStatus("robot1", first, Pose(0, 0), 1.0, reason="a load is on board")
    status = replace(status, payload=payload)

    def answer(_robot, _word):
        state = answers.pop(0)
        reason = status.reason if answers else then
        link.say(replace(status, state=state, reason=reason, sent=link.now()))

    link.on_set_state = answer
    link.say(status)
    link.say(heartbeat_that_names("robot1"))
    client = HiveClient(link)
    client.fetch_robot("robot1")
    return client


@pytest.mark.parametrize(
    ("name", "told"),
    [("robot9", "no robot robot9; there are: robot1, robot2"), ("robot2", "robot2 is offline")],
)
def test_a_robot_that_is_not_there_or_not_heard_cannot_be_commanded(link, name, told):
    say_status(link, "robot1")
    link.say(RobotStatus("robot2", RobotState.OFFLINE, Pose(0, 0), 1.0))
    link.say(heartbeat_that_names("robot1", offline=("robot2",)))

    with pytest.raises(NotDoneError, match=told):
        HiveClient(link).fetch_robot(name)


def test_an_acceptance_that_answers_another_program_s_task_is_no_answer(link):
    others = replace(TASK, goals=(Pose(9.0, 9.0),))
    link.on_post = lambda _task: link.say(TaskUpdate("T1", TaskState.WAITING))
    link.say(TaskList(1, 1, (TaskRecord(others),)), after=0.2)

    with pytest.raises(NotDoneError, match="T1 is taken by another task"):
        HiveClient(link).submit(TASK)


@pytest.mark.parametrize(
    ("name", "flaw"),
    [
        ("x" * 65, "has 65 characters; allowed: 1 to 64"),
        ("T 1", "has spaces"),
        ("", "0 character"),
    ],
)
def test_an_id_that_no_hive_takes_is_refused_before_it_is_posted(link, name, flaw):
    with pytest.raises(InputError, match=flaw):
        HiveClient(link).submit(replace(TASK, id=name))

    assert link.posted == []


def test_following_ends_with_the_last_task_and_says_how_each_ended(link):
    hive = FakeHive(link)
    client = HiveClient(link)
    other = Task("T2", TaskType.GA, (Pose(3.0, 4.0),))
    client.submit(TASK)
    client.submit(other)
    hive.change("T1", TaskState.DONE, "robot1", after=5)
    hive.change("T2", TaskState.FAILED, "robot2", after=9)

    states = client.follow(["T1", "T2"], timeout=60)

    assert states == {"T1": TaskState.DONE, "T2": TaskState.FAILED}
    assert link.now() == pytest.approx(9.0, abs=0.5)


def test_following_gives_up_after_its_time_and_says_where_the_tasks_stand(link):
    FakeHive(link)
    client = HiveClient(link)
    client.submit(TASK)

    with pytest.raises(TimeUpError, match="not ended after 10 s: T1 is WAITING") as caught:
        client.follow(["T1"], timeout=10)

    assert caught.value.exit_code == 4


def test_a_cancelling_is_repeated_until_it_is_heard(link):
    hive = FakeHive(link)
    client = HiveClient(link)
    client.submit(TASK)
    hive.deaf = 2

    client.cancel("T1")

    assert link.cancelled == ["T1"] * 3


def test_what_has_ended_or_never_was_cannot_be_cancelled(link):
    hive = FakeHive(link)
    client = HiveClient(link)
    client.submit(TASK)
    hive.change("T1", TaskState.DONE)
    client.follow(["T1"], timeout=1)

    with pytest.raises(NotDoneError, match="T1 is DONE already"):
        client.cancel("T1")
    with pytest.raises(NotDoneError, match="no task T7; the newest on the list: T1"):
        client.cancel("T7")


def test_a_feeder_posts_each_task_when_its_time_has_come(link):
    FakeHive(link)
    client = HiveClient(link)
    tasks = [Task(f"T{n}", TaskType.GA, (Pose(n, 0.0),)) for n in range(3)]
    feeder = Feeder(client, [PlannedTask(t, 10.0 * n) for n, t in enumerate(tasks)])
    posted = []

    while not feeder.done:
        posted += [(round(link.now()), task_id) for task_id in feeder.post_due()]
        client.pump(lambda: False, feeder.next_in(most=3.0))

    assert posted == [(0, "T0"), (10, "T1"), (20, "T2")]


def test_a_scenario_begins_when_the_clock_is_heard(link):
    link.clock_at = 2.0
    FakeHive(link)
    client = HiveClient(link)

    feeder = Feeder(
        client, [PlannedTask(replace(TASK, id=f"T{n}"), after=5.0 * n) for n in (0, 1)]
    )

    assert list(feeder.post_due()) == ["T0"]
    assert feeder.next_in(most=9.0) == pytest.approx(5.0, abs=LISTED_WITHIN)


def test_a_scenario_without_a_clock_says_what_to_do(link):
    link.clock_at = 1e9

    with pytest.raises(NoHiveError, match="/use_sim_time"):
        Feeder(HiveClient(link), [])


def test_what_falls_silent_is_told_though_no_report_comes(link):
    told = []
    client = HiveClient(link, lambda report, events: told.extend((report, e.text) for e in events))
    link.say(RobotStatus("robot1", RobotState.IDLE, Pose(1.0, 2.0), 1.0))
    link.say(Heartbeat(1, "/blackboard"))

    client.pump(lambda: False, 10.0)

    assert (None, "no leader: blackboard is silent") in told
    assert [text for _, text in told if "robot1 is offline" in text] == [
        "robot1 is offline: not heard here for 6 s"
    ]


def test_what_came_during_a_pause_is_read_before_anybody_counts_as_silent(link):
    told = []
    client = HiveClient(link, lambda _report, events: told.extend(e.text for e in events))
    say_status(link, "robot1")
    client.pump(lambda: False, 1.0)
    say_status(link, "robot2", after=8.9)
    say_status(link, "robot1", after=9.0)
    link.receive(0.0)
    link._time += 9.0  # noqa: SLF001  (the program does something else)

    client.pump(lambda: False, 2.0)

    assert not [text for text in told if "offline" in text]


def say_status(link, robot, after=0.0):
    link.say(RobotStatus(robot, RobotState.IDLE, Pose(1.0, 2.0), 1.0), after)


def test_robots_are_known_as_soon_as_all_that_are_there_have_reported(link):
    link.robots = {"robot1", "robot2"}
    say_status(link, "robot1")
    link.say(heartbeat_that_names("robot1", "robot2"))
    say_status(link, "robot2", after=0.2)
    client = HiveClient(link)

    client.fetch_robots()

    assert set(client.state.robots) == {"robot1", "robot2"}
    assert link.now() == pytest.approx(0.2)


def heartbeat_that_names(*robots, offline=()):
    heard = dict.fromkeys(robots, 1.0)
    return Heartbeat(1, "/blackboard", "", ("/blackboard",), heard=heard, offline=offline)


def test_a_robot_that_the_leader_no_longer_hears_is_waited_for_too(link):
    link.robots = {"robot1"}
    say_status(link, "robot1")
    link.say(heartbeat_that_names("robot1", offline=("robot2",)), after=0.2)
    link.say(RobotStatus("robot2", RobotState.OFFLINE, Pose(1.0, 2.0), 1.0), after=0.9)
    client = HiveClient(link)

    client.fetch_robots()

    assert client.state.robots["robot2"].state is RobotState.OFFLINE
    assert link.now() == pytest.approx(0.9)


def test_without_a_leader_the_robots_are_those_that_report(link):
    link.robots = {"robot1"}
    say_status(link, "robot1")
    client = HiveClient(link)

    client.fetch_robots()

    assert set(client.state.robots) == {"robot1"}
    assert link.now() == pytest.approx(SILENCE)


def test_a_robot_that_the_leader_hears_is_waited_for_however_slow_it_is(link):
    link.robots = {"robot1", "robot2", "crashed"}
    say_status(link, "robot1")
    link.say(heartbeat_that_names("robot1", "robot2"), after=0.1)
    say_status(link, "robot2", after=3.0)
    client = HiveClient(link)

    client.fetch_robots()

    assert set(client.state.robots) == {"robot1", "robot2"}
    assert link.now() == pytest.approx(3.0)


def test_a_robot_that_never_reports_is_left_out_in_the_end(link):
    link.robots = {"robot1", "robot2"}
    say_status(link, "robot1")
    link.say(heartbeat_that_names("robot1", "robot2"))
    client = HiveClient(link)

    client.fetch_robots()

    assert set(client.state.robots) == {"robot1"}
    assert link.now() == pytest.approx(ANSWER_WITHIN)


def test_a_node_that_the_leader_does_not_hear_is_waited_for_no_longer_than_a_status_takes(link):
    link.robots = {"robot1", "crashed"}
    say_status(link, "robot1")
    link.say(heartbeat_that_names("robot1"))
    client = HiveClient(link)

    client.fetch_robots()

    assert link.now() == pytest.approx(STATUS_PERIOD)
