# SPDX-License-Identifier: BSD-3-Clause
"""The benchmarks' window, from choosing to the exported page, with real runs on virtual time."""

import gc
import json
import os
import sys

import attrs
import pytest
import yaml
from python_qt_binding.QtCore import QSettings, Qt
from python_qt_binding.QtGui import QColor, QImage
from python_qt_binding.QtWidgets import QFileDialog

from fleet_manager.client.comparison import PAGE, SHOWN
from fleet_manager.desk.experiment import ShownExperiment
from fleet_manager.gui.benchmarks.window import Benchmarks
from hive_lab.compare.experiment import Experiment
from hive_lab.runner.limits import CASE
from hive_lab.windows.stall_watch import StallWatch

FLEET = """\
robots:
  - {name: robot1, model: mir100, pose: [2.6, 2.0, 0.0]}
"""
SCENARIO = """\
description: A short way.
world: lab
fleet: ./fleet.yaml
tasks:
  - {id: A, type: GA, goals: [[3.6, 2.0]]}
"""
HANGS = "import sys; sys.stdin.read()"
"""Stands for runs that take long: it ends when it is stopped, or with the window."""

STALL = 0.1
"""The longest time for which a window may keep a person waiting [s]."""
LARGE = (6600, 4800)
"""Pictures that take longer than that to be read [px]."""

HUGE = '{"share": Infinity, "remaining": null, "number": 1, "runs": 2, "run": "lab"}'
ODD = (
    "a warning",
    "[]",
    "3",
    "{}",
    '{"share": null}',
    HUGE,
    '{"share": 0.5}',
    '{"folder": 4}',
    "\xff",
)
"""Lines of a program that are not about its runs."""


@pytest.fixture
def settings(tmp_path):
    return QSettings(str(tmp_path / "settings"), QSettings.IniFormat)


@pytest.fixture
def opened(person, tmp_path, settings):
    windows = []

    def open_window(*command, **more):
        if command:
            more["command"] = command
        window = Benchmarks(tmp_path / "results", settings, **more)
        windows.append(window)
        window.resize(1200, 700)
        window.show()
        # activateWindow returns None: it is asked for again until the screen has done it.
        person.wait_until(lambda: window.isActiveWindow() or window.activateWindow())
        window.examples.setFocus()
        return window

    yield open_window
    for window in windows:
        window.end()
        window.hide()
        window.deleteLater()
    person.look()


@pytest.fixture
def short(tmp_path):
    """Write the files of a short experiment, and return their folder."""
    (tmp_path / "fleet.yaml").write_text(FLEET, encoding="utf-8")
    (tmp_path / "scenario.yaml").write_text(SCENARIO, encoding="utf-8")
    return tmp_path


@pytest.fixture
def saving(monkeypatch):
    """Return what says which path a person chooses for a file that is saved."""

    def choose(path):
        monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(path), ""))

    return choose


@pytest.fixture
def _tidy():
    """Let the garbage collector leave alone what other tests have left, as the program does."""
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


def show_tab(person, window, title):
    bar = window.tabs.tabBar()
    number = next(n for n in range(bar.count()) if bar.tabText(n) == title)
    person.click(bar, bar.tabRect(number).center())


def tick(person, box, *names):
    """Tick exactly these of some check boxes."""
    for name, check in box.items():
        if check.isChecked() is not (name in names):
            person.click(check)


@pytest.mark.timeout(CASE)
def test_from_choosing_to_the_exported_page(person, opened, short, saving, tmp_path):
    window = opened()
    form = window.form
    person.write(form.description, "Short ways.")
    person.write(form.fleet, str(short / "fleet.yaml"))
    person.click(form.by_scenario)
    person.write(form.scenario, str(short / "scenario.yaml"))
    tick(person, form.architectures, "hive", "central")
    tick(person, form.decisions, "distributed")
    tick(person, form.cost_models, "report")
    person.write(form.seeds, "4")
    person.click(form.faults.add_button)
    person.write(form.faults.rows[0].after, "1")
    person.write(form.loss, "10")

    person.click(window.run_button)
    assert not window.run_button.isEnabled()
    person.wait_until(window.run_button.isEnabled, telling=window.message.text)

    assert window.message.text().startswith("shown: ")
    assert window.bar.value() == window.bar.maximum()
    assert window.table.item(0, 0).text() == "tasks done"
    assert [window.table.horizontalHeaderItem(column).text() for column in (1, 2)] == [
        "distributed, report",
        "central dispatcher, report",
    ]
    assert window.table.item(0, 1).text() == "1"
    assert [window.pictures.itemText(row) for row in range(window.pictures.count())] == [
        "side by side",
        "distributed, report, seed 4",
        "central dispatcher, report, seed 4",
    ]
    show_tab(person, window, "Pictures")
    person.wait_until(window.picture.label.pixmap)

    for button, name in ((window.page_button, "mine.html"), (window.csv_button, "mine.csv")):
        saving(tmp_path / name)
        person.click(button)
        person.wait_until(lambda name=name: window.message.text() == f"written: {tmp_path / name}")
    assert "data:image/png" in (tmp_path / "mine.html").read_text(encoding="utf-8")
    assert "distributed, report" in (tmp_path / "mine.csv").read_text(encoding="utf-8")

    # The saved run is listed, fills in the form again, and can be compared with itself.
    assert window.saved.count() == 1
    assert window.saved.item(0).text().endswith("  Short ways.")
    form.fill({"fleet": "warehouse", "scenario": "warehouse"})
    show_tab(person, window, "Saved runs")
    person.click(
        window.saved.viewport(), window.saved.visualItemRect(window.saved.item(0)).center()
    )
    person.click(window.repeat_button)
    assert form.fleet.currentText().endswith("fleet.yaml")
    assert form.seeds.text() == "4"
    assert form.decisions["distributed"].isChecked()
    assert form.architectures["central"].isChecked()
    assert [row.typed()["kill"] for row in form.faults.rows] == ["blackboard"]
    assert form.loss.value() == 10


def test_an_experiment_is_chosen_by_clicks_and_keys_alone(person, opened, tmp_path):
    window = opened(sys.executable, "-c", HANGS)
    form, faults = window.form, window.form.faults
    person.click(form.by_load)
    person.write(form.at_once, "3")
    person.write(form.mix["GAB"], "0.25")
    tick(person, form.architectures, "hive", "contract_net")
    tick(person, form.decisions, "planned")
    person.write(form.loss, "2.5")
    person.click(faults.add_button)
    person.write(faults.rows[0].after, "12.5")
    person.choose(faults.rows[0].kind, 1)
    person.write(faults.rows[0].name, "robot2")
    person.write(faults.rows[0].seconds, "4")
    person.click(faults.add_button)
    person.write(faults.rows[1].after, "90")

    person.click(window.run_button)

    file = tmp_path / "results" / "benchmark.yaml"
    assert yaml.safe_load(file.read_text(encoding="utf-8")) == {
        "fleet": "lab",
        "load": {
            "at_once": 3,
            "per_hour": 0.0,
            "minutes": 10.0,
            "mix": {"GA": 1.0, "GAB": 0.25, "GPA": 1.0, "GPAB": 1.0},
        },
        "world": "lab",
        "architectures": ["hive", "contract_net"],
        "decisions": ["planned"],
        "cost_models": [],
        "seeds": [1],
        "run_on": "virtual",
        "rtf": 3.0,
        "faults": [
            {"after": 12.5, "freeze": "robot2", "seconds": 4.0},
            {"after": 90.0, "kill": "blackboard"},
        ],
        "loss": 0.025,
        "time_limit": 3600.0,
    }


def test_what_is_filled_in_is_given_back(opened):
    form = opened().form
    content = {
        "fleet": "warehouse",
        "scenario": "warehouse",
        "map": "lab",
        "architectures": ["report", "central"],
        "decisions": [],
        "cost_models": ["latency"],
        "seeds": [3, 7],
        "run_on": "virtual",
        "rtf": 2.25,
        "faults": [
            {"after": 0.125, "kill": "r1"},
            {"after": 60.0, "freeze": "blackboard", "seconds": 2.5},
        ],
        "loss": 0.001,
        "time_limit": 86400.0,
    }

    form.fill(content)

    assert form.content() == content


def test_what_has_its_default_is_left_out(opened):
    form = opened().form

    assert set(form.content()).isdisjoint({"architectures", "faults", "loss", "map"})


def test_the_form_knows_every_key_of_an_experiment():
    keys = {field.name for field in attrs.fields(Experiment)} - {"path"}

    assert keys <= {field.name for field in attrs.fields(ShownExperiment)}


def test_decisions_only_count_while_the_hive_is_compared(person, opened):
    form = opened().form
    tick(person, form.decisions, "planned")

    tick(person, form.architectures, "central")
    assert not form.decisions["planned"].isEnabled()
    assert form.content()["decisions"] == []

    tick(person, form.architectures)
    assert form.decisions["planned"].isEnabled()
    assert form.content()["decisions"] == ["planned"]


def test_on_the_simulator_there_is_only_the_hive_without_loss(person, opened):
    form = opened().form
    form.fill({
        "fleet": "lab",
        "scenario": "demo",
        "architectures": ["central"],
        "decisions": ["planned"],
        "loss": 0.1,
        "faults": [{"after": 5.0, "kill": "blackboard"}],
    })  # fmt: skip

    person.choose(form.run_on, 1)

    enabled = [name for name, box in form.architectures.items() if box.isEnabled()]
    assert enabled == ["hive"]
    assert not form.loss.isEnabled()
    content = form.content()
    assert content["run_on"] == "simulator"
    assert content["decisions"] == ["planned"]
    assert content["faults"] == [{"after": 5.0, "kill": "blackboard"}]
    assert set(content).isdisjoint({"architectures", "loss"})

    # What was chosen is still there.
    person.choose(form.run_on, 0)
    assert form.content()["architectures"] == ["central"]
    assert form.content()["loss"] == 0.1


def offered(row):
    return [row.name.itemText(number) for number in range(row.name.count())]


def test_faults_are_offered_the_robots_of_the_fleet_and_keep_what_was_typed(person, opened, short):
    form = opened().form
    person.click(form.faults.add_button)
    (row,) = form.faults.rows
    person.wait_until(
        lambda: offered(row) == ["blackboard", "robot1", "robot2", "robot3", "robot4"]
    )
    person.write(row.name, "robot9")

    person.write(form.fleet, str(short / "fleet.yaml"))
    person.wait_until(lambda: offered(row) == ["blackboard", "robot1"])
    assert row.name.currentText() == "robot9"

    person.write(form.fleet, "nowhere")
    person.wait_until(lambda: offered(row) == ["blackboard"])
    assert row.name.currentText() == "robot9"


def test_a_fault_that_is_added_is_in_view_and_can_be_removed(person, opened):
    window = opened()
    form = window.form
    window.resize(1200, 500)
    for number in range(3):
        person.click(form.faults.add_button)
        person.wait_until(lambda: not form.faults.rows[-1].remove_button.visibleRegion().isEmpty())
        form.faults.rows[-1].after.setValue(number)
    assert not form.faults.rows[-1].seconds.isEnabled()

    person.click(form.faults.rows[1].remove_button)

    assert [fault["after"] for fault in form.content()["faults"]] == [0.0, 2.0]


def test_the_fields_of_faults_follow_each_other_on_the_keyboard(person, opened):
    faults = opened().form.faults
    for _ in range(2):
        person.click(faults.add_button)
    faults.add_button.setFocus()

    for row in faults.rows:
        for widget in (row.after, row.kind, row.name, row.remove_button):
            person.press(Qt.Key_Tab)
            assert widget.hasFocus()


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (
            {"after": 5, "freeze": ""},
            "Fault 2: no name of whom to freeze; allowed: the name of a robot, or blackboard",
        ),
        (
            {"after": 5, "freeze": "robot1", "seconds": 0},
            "Fault 2: frozen for 0 s; allowed: above 0, or kill",
        ),
    ],
)
def test_a_fault_that_cannot_be_used_is_named_and_nothing_starts(person, opened, fault, words):
    window = opened()
    faults = [{"after": 1, "kill": "robot1"}, fault]
    window.form.fill({"fleet": "lab", "scenario": "demo", "faults": faults})

    person.click(window.run_button)

    assert window.message.text() == words
    assert window.run_button.isEnabled()


def test_paths_that_were_typed_begin_in_the_folder_of_the_window(
    person, opened, short, monkeypatch
):
    window = opened(sys.executable, "-c", HANGS)
    monkeypatch.chdir(short)
    window.form.fill({"fleet": "./fleet.yaml", "scenario": "./scenario.yaml"})

    person.click(window.run_button)

    file = short / "results" / "benchmark.yaml"
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    assert content["fleet"] == str(short / "fleet.yaml")
    assert content["scenario"] == str(short / "scenario.yaml")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("[]", "the keys"),
        ("just words", "the keys"),
        ("load: [", "is not YAML"),
        ("scenario: demo", "fleet: missing"),
        ("fleet: 3", "fleet: 3; allowed"),
        ("fleet: 2026-99-99", "month must be in 1..12"),
        ("fleet: ~nobody_of_this_name/fleet.yaml", "home"),
        ("{fleet: lab, load: 12}", "load: 12; allowed"),
        ("{fleet: lab, load: {at_once: many}}", "load.at_once: 'many'; allowed"),
        ("{fleet: lab, seeds: 1}", "seeds: 1; allowed"),
        ("{fleet: lab, seeds: [a]}", "seeds[0]: 'a'; allowed"),
        ("{fleet: lab, architectures: [ours]}", "architectures[0]: 'ours'; allowed"),
        ("{fleet: lab, faults: [robot1]}", "faults[0]: 'robot1'; allowed"),
        ("{fleet: lab, faults: [{after: 1}]}", "faults[0]: give either kill or freeze"),
        ("{fleet: lab, loss: 0.9}", "loss: 0.9; allowed"),
        ("{fleet: lab, rtf: .nan}", ".nan is not a number"),
        ("{fleet: lab, run_on: paper}", "run_on: 'paper'; allowed"),
    ],
)
def test_an_experiment_that_cannot_be_filled_in_is_named_in_one_line(
    person, opened, tmp_path, text, words
):
    folder = tmp_path / "results" / "odd"
    folder.mkdir(parents=True)
    (folder / SHOWN).write_text("{}", encoding="utf-8")
    (folder / "experiment.yaml").write_text(text, encoding="utf-8")
    window = opened()
    before = window.form.typed()

    window.saved.item(0).setSelected(True)
    show_tab(person, window, "Saved runs")
    person.click(window.repeat_button)

    assert window.message.text().startswith("not filled in: ")
    assert words in window.message.text()
    assert "\n" not in window.message.text()
    assert window.form.typed() == before


def test_a_field_that_cannot_be_used_is_named_and_nothing_starts(person, opened):
    window = opened()
    window.form.seeds.setText("1, two")

    person.click(window.run_button)

    assert window.message.text() == (
        "Seeds: '1, two'; allowed: whole numbers from 0 on, such as 1, 2, 3"
    )
    assert window.run_button.isEnabled()


def test_what_the_files_say_is_wrong_is_shown_in_one_line(person, opened):
    window = opened()
    window.form.fleet.setCurrentText("nowhere")

    person.click(window.run_button)
    person.wait_until(window.run_button.isEnabled)

    assert "'nowhere': not known; allowed: lab, mixed, warehouse" in window.message.text()


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"table": [], "pictures": {}}', "null"])
def test_results_that_were_written_by_something_else_are_named(opened, tmp_path, content):
    window = opened()
    (tmp_path / SHOWN).write_text(content, encoding="utf-8")

    window.show_results(tmp_path)

    assert window.message.text().startswith(f"{tmp_path} cannot be shown: ")
    assert not window.page_button.isEnabled()


def test_lines_that_are_not_about_the_runs_are_passed_over(person, opened):
    half = '{"share": 0.5, "remaining": null, "number": 1, "runs": 2, "run": "lab"}'
    window = opened(sys.executable, "-c", f"print({chr(10).join([*ODD, half])!r}); {HANGS}")

    person.click(window.run_button)
    person.wait_until(lambda: window.bar.value() == 500)

    assert window.message.text() == "run 1 of 2: lab"
    assert window.remaining.text() == "remaining time not known yet"


def test_runs_that_take_long_can_be_stopped(person, opened):
    window = opened(sys.executable, "-c", HANGS)

    person.click(window.run_button)
    assert window.stop_button.isEnabled()
    person.click(window.stop_button)
    person.wait_until(window.run_button.isEnabled)

    assert window.message.text() == "stopped; runs that had not finished are lost"


def test_a_program_that_is_not_there_is_named(person, opened):
    window = opened("no_such_program")

    person.click(window.run_button)
    person.wait_until(window.run_button.isEnabled)

    assert window.message.text().startswith("no_such_program was not found")


def test_what_was_typed_is_there_at_the_next_start(person, opened):
    window = opened()
    form = window.form
    form.fill({
        "fleet": "lab",
        "load": {"at_once": 5, "mix": {"GA": 0.5}},
        "architectures": ["central"],
        "loss": 0.2,
        "faults": [{"after": 20, "kill": "robot2"}],
    })  # fmt: skip
    person.click(form.faults.add_button)
    # Not all of it counts, and not all of it is right.
    person.write(form.faults.rows[1].name, "")
    person.write(form.seeds, "3, five")
    person.click(form.by_scenario)
    person.write(form.scenario, "mine.yaml")
    person.choose(form.run_on, 1)
    typed = form.typed()
    window.end()

    again = opened().form

    assert again.typed() == typed
    assert again.seeds.text() == "3, five"
    assert again.by_scenario.isChecked()
    assert again.at_once.value() == 5
    assert again.architectures["central"].isChecked()
    assert again.faults.rows[0].name.currentText() == "robot2"


def test_what_an_earlier_version_has_kept_is_shown(opened, settings):
    kept = {
        "fleet": "warehouse",
        "load": {"at_once": 4, "per_hour": 0.0, "minutes": 10.0, "mix": {"GA": 1.0}},
        "world": "warehouse",
        "decisions": ["planned"],
        "cost_models": [],
        "seeds": [3, 5],
        "run_on": "simulator",
        "rtf": 3.0,
        "faults": [{"after": 20.0, "kill": "blackboard"}],
        "time_limit": 600.0,
    }
    settings.setValue("benchmarks/experiment", yaml.safe_dump(kept))

    form = opened().form

    assert form.content() == kept | {
        "load": kept["load"] | {"mix": {"GA": 1.0, "GAB": 0.0, "GPA": 0.0, "GPAB": 0.0}}
    }


@pytest.mark.parametrize(
    "kept",
    ["[", "3", "2026-99-99", "null", "[1]", "{fleet: [lab]}", "{scenario: demo}", ["a", "b"], 7],
)
def test_settings_that_something_else_has_written_are_ignored(opened, settings, kept):
    settings.setValue("benchmarks/experiment", kept)

    assert opened().form.content()["fleet"] == "lab"


@pytest.fixture
def posting(person, opened):
    """Return what opens a window and has it post with a program in Python."""

    def post(code, **load):
        window = opened(poster=(sys.executable, "-c", code))
        window.form.fill({"fleet": "lab", "world": "lab", "load": load or {"at_once": 1}})
        person.click(window.post_button)
        return window

    return post


def test_the_load_generator_posts_to_a_live_hive_what_the_form_says(person, posting):
    window = posting(
        "import sys; print(*sys.argv[1:])",
        at_once=3,
        per_hour=7.5,
        minutes=2,
        mix={"GA": 1, "GPAB": 0.25},
    )
    person.wait_until(window.post_button.isEnabled)

    words = "--at-once=3 --per-hour=7.5 --minutes=2 --mix=GA=1,GAB=0,GPA=0,GPAB=0.25"
    posted = "posted: every task is on the list; last: "
    assert window.message.text() == f"{posted}{words} --map=lab --seed=1"

    person.write(window.form.chart, "warehouse")
    person.write(window.form.seeds, "8, 9")
    person.click(window.post_button)
    person.wait_until(window.post_button.isEnabled)

    assert window.message.text() == f"{posted}{words} --map=warehouse --seed=8"


def test_only_the_load_generator_posts_and_only_while_nothing_runs(person, opened):
    window = opened(sys.executable, "-c", HANGS)
    person.click(window.form.by_scenario)
    assert not window.post_button.isEnabled()
    person.click(window.form.by_load)
    assert window.post_button.isEnabled()

    person.click(window.run_button)
    assert not window.post_button.isEnabled()
    person.click(window.stop_button)
    person.wait_until(window.run_button.isEnabled)

    assert window.post_button.isEnabled()


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_posting_shows_what_became_of_the_last_task_and_can_be_stopped(person, posting, stream):
    window = posting(f"import sys; print('T1 WAITING', file=sys.{stream}, flush=True); {HANGS}")
    person.wait_until(lambda: window.message.text() == "T1 WAITING")
    assert not window.run_button.isEnabled()

    person.click(window.stop_button)
    person.wait_until(window.post_button.isEnabled)

    assert window.message.text() == "stopped; tasks that were posted stay on the list"


def test_the_last_line_says_why_posting_has_failed(person, posting):
    window = posting("import sys; print('T1 REJECTED'); sys.exit('hive: 1 of 1 rejected: T1')")
    person.wait_until(window.post_button.isEnabled)

    assert window.message.text() == "hive: 1 of 1 rejected: T1"


def test_the_command_that_posts_says_where_there_is_no_hive(person, opened, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:9")
    window = opened()
    person.click(window.form.by_load)

    person.click(window.post_button)
    person.wait_until(window.post_button.isEnabled, telling=window.message.text)

    assert window.message.text().startswith("hive: no ROS master")


def test_a_picture_follows_the_width_of_the_window(person, opened, tmp_path):
    picture = QImage(1000, 500, QImage.Format_RGB32)
    picture.fill(Qt.white)
    assert picture.save(str(tmp_path / "a.png"))
    (tmp_path / "b.png").write_text("no picture", encoding="utf-8")
    shown = {"table": [["figure"]], "pictures": {"a": "a.png", "b": "b.png"}}
    (tmp_path / SHOWN).write_text(json.dumps(shown), encoding="utf-8")
    window = opened()
    window.show_results(tmp_path)
    show_tab(person, window, "Pictures")
    label, ways = window.picture.label, []

    def fits():
        pixmap = label.pixmap()
        room = window.picture.viewport().width()
        return pixmap and room - 8 == pixmap.width() == 2 * pixmap.height() + pixmap.width() % 2

    for width in (1200, 1100):
        window.resize(width, 700)
        person.wait_until(fits)
        ways.append(label.pixmap().width())
    assert ways[0] > ways[1]

    # It is never larger than it is, and one that cannot be read is named.
    window.resize(2200, 700)
    person.wait_until(lambda: label.pixmap() and label.pixmap().width() == 1000)
    window.pictures.setCurrentText("b")
    person.wait_until(
        lambda: label.text().endswith("b.png cannot be read; run the experiment again")
    )


def test_an_export_that_cannot_be_written_is_named(person, opened, tmp_path):
    (tmp_path / SHOWN).write_text('{"table": [["a"]], "pictures": {}}', encoding="utf-8")
    (tmp_path / PAGE).write_text("page", encoding="utf-8")
    window = opened()
    window.show_results(tmp_path)

    window.export_to(PAGE, tmp_path / "nowhere" / "mine.html")
    person.wait_until(lambda: "cannot be written" in window.message.text())

    assert window.message.text().endswith(": No such file or directory; choose another place")


def color_of(label):
    """Return the colour of the picture in a label; None without one."""
    pixmap = label.pixmap()
    return pixmap.toImage().pixelColor(0, 0) if pixmap else None


@pytest.mark.usefixtures("_tidy")
def test_nothing_stalls_from_choosing_to_the_exported_page(person, opened, saving, tmp_path):
    results = tmp_path / "results"
    for number in range(200):
        folder = results / f"run{number}"
        folder.mkdir(parents=True)
        (folder / SHOWN).write_text("{}", encoding="utf-8")
    large = QImage(*LARGE, QImage.Format_RGB32)
    for number in range(3):
        large.fill(Qt.GlobalColor(Qt.red + number))
        assert large.save(str(folder / f"{number}.png"))
    table = [["figure", *(f"way {number}" for number in range(40))], *[["12 (10–14)"] * 41] * 12]
    shown = {"table": table, "pictures": {f"picture {n}": f"{n}.png" for n in range(3)}}
    (folder / SHOWN).write_text(json.dumps(shown), encoding="utf-8")
    (folder / PAGE).write_bytes(os.urandom(1_000_000) * 20)
    progress = {"share": 0.5, "remaining": 9.0, "number": 1, "runs": 2, "run": "hive, report"}
    lines = [*[json.dumps(progress)] * 10_000, json.dumps({"folder": str(folder)})]
    script = tmp_path / "compare.py"
    script.write_text(f"print({chr(10).join(lines)!r})", encoding="utf-8")
    window = opened(sys.executable, str(script))
    watch = StallWatch()
    watch.start()

    faults = [{"after": float(number), "kill": "robot1"} for number in range(20)]
    window.form.fill({"fleet": "warehouse", "scenario": "warehouse", "faults": faults})
    person.click(window.form.faults.add_button)
    person.click(window.run_button)
    person.wait_until(window.run_button.isEnabled)
    assert window.saved.count() == 200
    show_tab(person, window, "Pictures")
    for number in range(3):
        window.pictures.setCurrentIndex(number)
        color = QColor(Qt.GlobalColor(Qt.red + number))
        person.wait_until(lambda color=color: color_of(window.picture.label) == color)
    saving(tmp_path / "mine.html")
    person.click(window.page_button)
    person.wait_until(lambda: window.message.text().startswith("written: "))

    assert (tmp_path / "mine.html").stat().st_size == 20_000_000
    assert watch.longest < STALL


def test_the_remaining_time_is_shown_as_it_is_told(person, opened):
    line = '{"run": "planned, seed 2", "number": 2, "runs": 4, "share": 0.3, "remaining": 90}'
    window = opened(sys.executable, "-c", f"print('''{line}''')" + "; " + HANGS.replace("{}", "-"))

    person.click(window.run_button)
    person.wait_until(lambda: window.bar.value() == 300)

    assert window.message.text() == "run 2 of 4: planned, seed 2"
    assert "left" in window.remaining.text()
    person.click(window.stop_button)
    person.wait_until(window.run_button.isEnabled)


def test_the_fleet_window_shows_the_benchmarks_as_a_tab(person, window):
    window.benchmarks_action.trigger()
    person.look()

    assert window.show_benchmarks().isVisible()
