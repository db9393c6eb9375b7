# SPDX-License-Identifier: BSD-3-Clause
import io
import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex
from PIL import Image

from blackboard.consensus.messages import Heartbeat
from blackboard.consensus.task_list import TaskList
from blackboard.domain.characteristics import RobotState, RobotStatus
from blackboard.domain.record import TaskRecord, TaskUpdate
from blackboard.domain.task import TaskState
from fleet_manager.client.client import HiveClient
from fleet_manager.client.hive_state import HiveState
from fleet_manager.client.reports import BatteryReading, Collisions, TruePlace
from fleet_manager.client.traffic import RobotWait, TrafficState
from fleet_manager.client.words import update_event
from fleet_manager.config.fleet_file import read_fleet
from fleet_manager.config.scenario import read_scenario
from fleet_manager.demo.history import History, Span
from fleet_manager.demo.local_hive import wait_for_everyone
from fleet_manager.demo.page import write_page
from fleet_manager.demo.picture import congestion, draw_run, figure_of_run, figures
from fleet_manager.demo.progress import Progress
from fleet_manager.demo.report import Clocks, make_report, not_done
from fleet_manager.demo.runner import DemoPlan, DemoRun
from fleet_manager.errors import StartError
from fleet_manager.testing import FakeHive, FakeLink
from hive_common.grid_map import GridMap
from hive_common.pose import Pose

ROBOTS = ["robot1", "robot2", "robot3", "robot4"]


class FakeLocalHive:
    """Processes that run, or have ended."""

    def __init__(self, ended=""):
        self.ended = ended
        self.processes = self
        self.folder = "logs"

    def check(self):
        if self.ended:
            raise StartError(self.ended)

    def why_missing(self):
        return "robot3/move_base died"


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def link():
    return FakeLink()


@pytest.fixture
def plan():
    return DemoPlan(read_scenario("smoke"), read_fleet("lab"), rtf=1.0, windows=False)


def status(name, task_id=""):
    state = RobotState.BUSY if task_id else RobotState.IDLE
    return RobotStatus(name, state, Pose(1.0, 2.0), 0.9, 0.0, task_id, tasks=(task_id,))


def work_off(link, robot="robot1", seconds=5.0):
    """Have each task that is posted begun and ended by a robot."""
    take_in = link.on_post

    def answer(task):
        take_in(task)
        link.say(TaskUpdate(task.id, TaskState.STARTED, robot, 0, 2), after=1.0)
        link.say(TaskUpdate(task.id, TaskState.DONE, robot, 2, 2), after=seconds)

    link.on_post = answer


def test_the_demo_begins_when_the_blackboard_has_heard_every_robot(link):
    client = HiveClient(link)
    link.say(Heartbeat(1, "/blackboard"), after=3)
    link.say(Heartbeat(1, "/blackboard", heard=dict.fromkeys(ROBOTS[:3], 0.0)), after=7)
    link.say(Heartbeat(1, "/blackboard", heard=dict.fromkeys(ROBOTS, 0.0)), after=8)
    for number, name in enumerate(ROBOTS):
        link.say(status(name), after=2.0 * number)

    wait_for_everyone(client, ROBOTS, FakeLocalHive())

    assert link.now() == pytest.approx(8.0)


def test_a_line_says_whom_the_demo_waits_for_whenever_that_changes(link):
    robots = [f"robot{number}" for number in range(1, 10)]
    link.say(Heartbeat(1, "/blackboard"), after=3)
    link.say(Heartbeat(1, "/blackboard", heard=dict.fromkeys(robots, 0.0)), after=7)
    for name in robots:
        link.say(status(name), after=5.0)
    lines = []

    wait_for_everyone(HiveClient(link), robots, FakeLocalHive(), tell=lines.append)

    assert lines[0] == (
        "waiting for the blackboard, robot1, robot2, robot3, robot4, robot5 and 4 more\n"
    )
    assert lines[1].startswith("waiting for robot1, ")
    assert len(lines) == len(set(lines)) == 2


def test_who_was_not_heard_is_named_with_what_died(link):
    link.say(status("robot1"))

    with pytest.raises(StartError) as caught:
        wait_for_everyone(HiveClient(link), ROBOTS, FakeLocalHive(), within=20)

    said = str(caught.value)
    assert "within 20 s: the blackboard, robot2, robot3, robot4" in said
    assert "robot3/move_base died" in said


def test_a_process_that_ends_while_all_are_waited_for_ends_the_wait(link):
    with pytest.raises(StartError, match="fleet_manager ended unexpectedly"):
        wait_for_everyone(
            HiveClient(link), ROBOTS, FakeLocalHive("fleet_manager ended unexpectedly")
        )

    assert link.now() < 2


def test_a_run_ends_when_every_task_is_done(link, plan):
    FakeHive(link)
    work_off(link)

    result = DemoRun(plan, FakeLocalHive(), link, io.StringIO()).run()

    assert result.report["all_done"]
    assert (result.report["done"], result.remarks) == (4, [])
    assert link.now() < 10


def test_a_run_ends_at_its_time_limit_and_says_so(link, plan):
    FakeHive(link)

    result = DemoRun(plan, FakeLocalHive(), link, io.StringIO()).run()

    assert not result.report["all_done"]
    assert link.now() == pytest.approx(plan.scenario.time_limit, abs=2)
    assert "time limit of 120 s" in result.remarks[0]
    assert not_done(result.report)[0] == "S1 WAITING"


def test_what_nobody_reports_is_in_the_log_of_a_run_too(link, plan):
    FakeHive(link)
    link.say(Heartbeat(1, "/blackboard"), after=1.0)

    result = DemoRun(plan, FakeLocalHive(), link, io.StringIO()).run()

    assert result.log[-1] == (3.75, "no leader: blackboard is silent")


def test_a_run_without_a_blackboard_reports_what_was_never_taken_in(link, plan):
    result = DemoRun(plan, FakeLocalHive(), link, io.StringIO()).run()

    assert result.report["done"] == 0
    assert "no blackboard answers" in result.remarks[0]
    assert len(not_done(result.report)) == 4


def test_a_rejected_task_is_not_done_with_its_reason(link, plan):
    FakeHive(link)
    work_off(link)
    answer = link.on_post
    rejected = TaskUpdate("S1", TaskState.REJECTED, reason="goal A is inside a wall")
    link.on_post = lambda task: link.say(rejected) if task.id == "S1" else answer(task)

    result = DemoRun(plan, FakeLocalHive(), link, io.StringIO()).run()

    assert not_done(result.report) == ["S1 REJECTED: goal A is inside a wall"]


@pytest.mark.parametrize("wanted", ["", "local", "planned"])
def test_a_demo_starts_the_hive_with_the_traffic_that_is_wanted(plan, wanted):
    assert replace(plan, traffic=wanted).arguments["traffic"] == wanted


def test_a_clock_slower_than_asked_is_said(link):
    plan = DemoPlan(read_scenario("smoke"), read_fleet("lab"), rtf=2.0, windows=False)
    FakeHive(link)
    work_off(link)

    result = DemoRun(plan, FakeLocalHive(), link, io.StringIO()).run()

    assert result.remarks == ["the real-time factor was 1.00, not 2: the machine is too busy"]


def test_distance_counts_every_metre_though_the_path_is_thinned():
    history = History(0.0)

    for step in range(101):
        history.add(step * 0.05, TruePlace("robot1", step * 0.02, 0.0))

    track = history.tracks["robot1"]
    assert track.distance == pytest.approx(2.0)
    assert len(track.path) < 40


def test_energy_is_charge_times_voltage_and_charging_gives_none_back():
    history = History(0.0)

    for charge, voltage in ((10.0, 26.0), (9.0, 24.0), (9.5, 24.0), (9.4, 24.0)):
        history.add(0.0, BatteryReading("robot1", voltage, charge))

    assert history.tracks["robot1"].energy == pytest.approx(3600 * (1.0 * 25.0 + 0.1 * 24.0))


def test_a_task_that_changes_robots_has_a_span_for_each():
    history = History(100.0)
    for time, state, robot in (
        (100, TaskState.WAITING, ""),
        (101, TaskState.ASSIGNED, "robot1"),
        (102, TaskState.STARTED, "robot1"),
        (103, TaskState.STARTED, "robot1"),
        (105, TaskState.WAITING, "robot1"),
        (107, TaskState.STARTED, "robot2"),
        (109, TaskState.DONE, "robot2"),
        (110, TaskState.STARTED, "robot1"),
    ):
        history.add(time, TaskUpdate("T1", state, robot))

    times = history.tasks["T1"]
    assert history.spans == [Span("robot1", "T1", 2, 5), Span("robot2", "T1", 7, 9)]
    assert (times.posted, times.assigned, times.started, times.ended) == (0, 1, 2, 9)


def test_a_list_alone_tells_the_history_too():
    history = History(0.0)
    task = read_scenario("smoke").tasks[0].task

    history.add(4.0, TaskList(1, 1, (TaskRecord(task, TaskState.STARTED, "robot1"),)))
    history.close(6.0)

    assert history.spans == [Span("robot1", task.id, 4.0, 6.0)]


def made_report(plan, hits=0):
    history = History(0.0)
    state = HiveState()
    tasks = [planned.task for planned in plan.scenario.tasks]
    records = [
        TaskRecord(task, TaskState.DONE, robot) for task, robot in zip(tasks, ROBOTS, strict=True)
    ]
    state.take_in(TaskList(1, 1, tuple(records)))
    for number, planned in enumerate(plan.scenario.tasks):
        history.add(number, TaskUpdate(planned.task.id, TaskState.WAITING))
        history.add(number + 2, TaskUpdate(planned.task.id, TaskState.STARTED, ROBOTS[number]))
        history.add(number + 9, TaskUpdate(planned.task.id, TaskState.DONE, ROBOTS[number]))
    for step in range(60):
        history.add(step / 5, TruePlace("robot1", 2.6 + step / 10, 2.0))
        history.add(step / 5, replace(status("robot1"), charge=0.9 - step / 1000))
    history.add(9.0, Collisions(hits))
    history.close(20.0)
    clocks = Clocks("2026-01-02T03:04:05+00:00", 1.0, 20.0, 21.0)
    return make_report(plan.scenario, plan.fleet, state, history, clocks), history


def test_the_report_has_times_of_tasks_and_figures_of_robots(plan):
    report, _ = made_report(plan)

    first = report["tasks"][0]
    assert (first["posted"], first["started"], first["ended"]) == (0, 2, 9)
    assert (first["waiting"], first["duration"]) == (2, 7)
    assert report["robots"][0]["distance"] == pytest.approx(5.9)
    assert report["robots"][0]["busy_share"] == pytest.approx(0.35)
    assert report["collisions"] == 0
    assert json.loads(json.dumps(report)) == report


def test_the_picture_is_drawn_even_where_some_robots_never_moved(plan, tmp_path):
    report, history = made_report(plan, hits=2)
    chart = GridMap.of_blocked(np.zeros((240, 400), dtype=bool), 0.05)

    draw_run(tmp_path / "picture.png", report, history, chart)

    with Image.open(tmp_path / "picture.png") as picture:
        assert min(picture.size) > 900


def drawn(report, history, places=None):
    """Return the axes of a run's picture: the map, the timeline, the batteries."""
    chart = GridMap.of_blocked(np.zeros((240, 400), dtype=bool), 0.05)
    return figure_of_run(report, history, chart, places or {}).axes


def words_in(axes):
    """Return what is written at points of axes, by text."""
    return {text.get_text(): text for text in axes.texts}


def legend_of(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_the_picture_names_the_places_that_are_on_the_map_where_they_are(plan):
    places = {"dock": Pose(3.0, 4.0), "shelf": Pose(7.5, 1.0), "far": Pose(99.0, 4.0)}

    on_map = drawn(*made_report(plan), places)[0]

    at = {name: text.xy for name, text in words_in(on_map).items() if name in places}
    assert at == {"dock": (3.0, 4.0), "shelf": (7.5, 1.0)}


def test_the_urgent_task_alone_stands_out_on_the_map_and_in_the_timeline(plan):
    report, history = made_report(plan)
    report["tasks"][1]["priority"] = 10

    on_map, timeline, _ = drawn(report, history)

    goals = words_in(on_map)
    bold = {label for label, text in goals.items() if text.get_fontweight() == "bold"}
    assert bold == {"S2.A", "S2.B"}
    assert len(goals) > len(bold)
    (red,) = {goals[label].get_color() for label in bold}
    assert red not in {text.get_color() for label, text in goals.items() if label not in bold}
    crosses = [tuple(line.get_xydata()[0]) for line in on_map.lines if line.get_color() == red]
    assert crosses == [(5.0, 4.2), (7.0, 4.2)]
    edges = [to_hex(bar.get_edgecolor()) == red.lower() for bar in timeline.patches]
    assert edges == [False, True, False, False]
    assert "S2 p10" in words_in(timeline)
    assert "urgent (p10)" in legend_of(timeline)


def test_nothing_stands_out_in_the_picture_of_a_run_without_an_urgent_task(plan):
    on_map, timeline, _ = drawn(*made_report(plan))

    assert {text.get_fontweight() for text in on_map.texts} == {"normal"}
    assert {to_hex(bar.get_edgecolor()) for bar in timeline.patches} == {"#ffffff"}
    assert legend_of(timeline) == ["with arm (GPA, GPAB)"]


def test_batteries_are_drawn_from_empty_to_full_with_the_share_that_was_used(plan):
    batteries = drawn(*made_report(plan))[2]

    low, high = batteries.get_ylim()
    (line,) = batteries.lines
    assert low == 0
    assert 100 < high < 110
    assert line.get_ydata() == pytest.approx(np.linspace(90.0, 84.1, 60))
    assert legend_of(batteries) == ["robot1: 5.9 % used"]


def test_the_report_sums_up_throughput_waiting_and_utilization(plan):
    report, _ = made_report(plan)

    assert report["summary"] == {
        "tasks_per_hour": 720.0,
        "mean_waiting": 2.0,
        "longest_waiting": 2.0,
        "utilization": 0.35,
    }
    assert figures(report) == (
        "720 tasks per hour, mean waiting 2 s, longest 2 s, robots at work 35% of the time"
    )


def test_a_run_in_which_nothing_was_begun_has_no_figures_but_its_throughput(plan):
    state, history = HiveState(), History(0.0)
    clocks = Clocks("2026-01-02T03:04:05+00:00", 1.0, 20.0, 21.0)
    report = make_report(plan.scenario, plan.fleet, state, history, clocks)

    assert figures(report) == "0 tasks per hour, robots at work 0% of the time"


def test_the_page_of_a_run_has_all_in_one_file_with_the_urgent_task_first_and_marked(
    plan, tmp_path
):
    report, history = made_report(plan)
    report["tasks"][-1] |= {"priority": 10, "reason": "it had to be <quick>"}
    chart = GridMap.of_blocked(np.zeros((240, 400), dtype=bool), 0.05)
    picture = tmp_path / "picture.png"
    draw_run(picture, report, history, chart, {"dock": Pose(3.0, 4.0), "far": Pose(99.0, 4.0)})

    write_page(tmp_path / "report.html", report, picture, [(1.5, "task T1 is done")])

    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    first = text.index('<tr class="marked"><td>' + report["tasks"][-1]["id"])
    assert first < text.index(f"<tr><td>{report['tasks'][0]['id']}")
    assert "it had to be &lt;quick&gt;" in text
    assert "    1.5 s  task T1 is done" in text
    assert 'src="data:image/png;base64,' in text
    assert "http" not in text


def waiting(time, *places):
    waits = tuple(RobotWait("robot1", "robot2", *place, 0.0, "") for place in places)
    return TrafficState(1, time, waits=waits)


def test_the_time_that_robots_wait_is_counted_where_they_stand():
    history = History(0.0)
    history.add(0.0, waiting(10.0, (1.2, 2.6)))
    history.add(0.0, waiting(11.0, (1.3, 2.9), (7.0, 2.0)))
    history.add(0.0, waiting(12.5, (1.3, 2.9)))
    history.add(0.0, waiting(50.0, (1.3, 2.9)))

    assert history.waited == {(2, 5): 2.5, (14, 4): 1.0}


def test_congestion_is_drawn_where_robots_waited_and_adds_up_to_the_time():
    history = History(0.0)
    history.waited[16, 4] = 90.0
    chart = GridMap.of_blocked(np.zeros((240, 400), dtype=bool), 0.05)
    heat = congestion(history, chart)

    assert np.unravel_index(heat.argmax(), heat.shape) == (4, 16)
    assert heat.sum() * 0.5**2 == pytest.approx(90.0, rel=1e-3)
    assert congestion(History(0.0), chart) is None


def test_a_picture_of_a_run_with_waits_has_warm_colours_where_robots_waited(plan, tmp_path):
    chart = GridMap.of_blocked(np.zeros((240, 400), dtype=bool), 0.05)
    reds = []
    for name, seconds in (("cold", 0.0), ("warm", 90.0)):
        report, history = made_report(plan)
        history.waited[20, 18] = seconds
        draw_run(tmp_path / f"{name}.png", report, history, chart)
        with Image.open(tmp_path / f"{name}.png") as picture:
            red, _, blue = (np.asarray(each, dtype=int) for each in picture.convert("RGB").split())
        reds.append(int(np.sum(red - blue > 100)))

    assert reds[1] > reds[0] + 1000


def test_progress_in_a_terminal_is_drawn_over_itself_with_a_line_per_robot_and_a_bar():
    screen, state = Terminal(), HiveState()
    progress = Progress(screen, ROBOTS, ["T1", "T2"])
    state.take_in(status("robot1", "T1"))
    state.take_in(TaskUpdate("T1", TaskState.DONE, "robot1"))

    progress.show(state, 1.0, 1.0)
    progress.show(state, 1.1, 1.1)
    progress.show(state, 2.0, 2.0)

    pictures = screen.getvalue().split("\x1b[5A\x1b[J")
    assert len(pictures) == 2
    assert pictures[0].count("\n") == 5
    assert "robot1     BUSY     T1" in pictures[0]
    assert "robot4     not heard yet" in pictures[0]
    assert "[###############...............] 1/2 tasks done" in pictures[0]


def test_progress_in_a_file_is_plain_lines():
    log, state = io.StringIO(), HiveState()
    progress = Progress(log, ROBOTS, ["T1"])

    progress.tell([update_event(TaskUpdate("T1", TaskState.STARTED, "robot1", 0, 2))], 12.34)
    progress.show(state, 1.0, 1.0)
    progress.show(state, 2.0, 2.0)

    assert log.getvalue().splitlines() == [
        "  12.3 s  task T1 is under way by robot1, 0 of 2 steps done",
        "  [..............................] 0/1 tasks done, 0 under way, 1 s (x1.00)",
    ]
