# SPDX-License-Identifier: BSD-3-Clause
"""The benchmarks' window, from choosing to the exported page, with real runs on virtual time."""

import sys

import pytest
from python_qt_binding.QtCore import QSettings

from fleet_manager.client.comparison import PAGE, SHOWN, TABLE
from fleet_manager.gui.benchmarks import Benchmarks
from hive_lab.runner.limits import CASE

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

    def open_window(*command):
        more = {"command": command} if command else {}
        window = Benchmarks(tmp_path / "results", settings, **more)
        windows.append(window)
        window.resize(1200, 700)
        window.show()
        person.look()
        return window

    yield open_window
    for window in windows:
        window.end()
        window.hide()
        window.deleteLater()
    person.look()


@pytest.fixture
def short(tmp_path):
    """Fill in a form with a short experiment."""
    (tmp_path / "fleet.yaml").write_text(FLEET, encoding="utf-8")
    (tmp_path / "scenario.yaml").write_text(SCENARIO, encoding="utf-8")

    def fill(window):
        window.form.fill({
            "fleet": str(tmp_path / "fleet.yaml"),
            "scenario": str(tmp_path / "scenario.yaml"),
            "decisions": ["distributed"],
        })  # fmt: skip

    return fill


@pytest.mark.timeout(CASE)
def test_from_choosing_to_the_exported_page(person, opened, short, tmp_path):
    window = opened()
    short(window)

    person.click(window.run_button)
    assert not window.run_button.isEnabled()
    person.wait_until(window.run_button.isEnabled, telling=window.message.text)

    assert window.message.text().startswith("shown: ")
    assert window.bar.value() == window.bar.maximum()
    assert window.table.item(0, 0).text() == "tasks done"
    assert window.table.item(0, 1).text() == "1"
    assert [window.pictures.itemText(row) for row in range(window.pictures.count())] == [
        "side by side",
        "distributed, report, seed 1",
    ]
    assert not window.picture.pixmap().isNull()

    window.export_to(PAGE, tmp_path / "mine.html")
    window.export_to(TABLE, tmp_path / "mine.csv")
    assert "data:image/png" in (tmp_path / "mine.html").read_text(encoding="utf-8")
    assert "distributed, report" in (tmp_path / "mine.csv").read_text(encoding="utf-8")

    # The saved run is listed, fills in the form again, and can be compared with itself.
    assert window.saved.count() == 1
    window.form.fill({"fleet": "warehouse", "scenario": "warehouse"})
    window.saved.item(0).setSelected(True)
    person.click(window.repeat_button)
    assert window.form.fleet.currentText().endswith("fleet.yaml")


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


def test_what_was_typed_is_there_at_the_next_start(opened):
    window = opened()
    window.form.seeds.setText("3, 5")
    window.form.faults.setText("20 s robot2")
    window.end()

    again = opened()

    assert again.form.seeds.text() == "3, 5"
    assert again.form.faults.text() == "20 s robot2"


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
