# SPDX-License-Identifier: BSD-3-Clause
"""The window in which ways to decide are compared.

Another process makes the runs (`hive compare`); this one shows its progress and its results.
"""

from __future__ import annotations

import contextlib
import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import yaml
from python_qt_binding.QtCore import Qt, QTimer
from python_qt_binding.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QProgressBar,
    QPushButton,
    QScrollArea,
    QSplitter,
    QTableWidget,
    QTableWidgetItem,
    QTabWidget,
    QVBoxLayout,
    QWidget,
)

from fleet_manager.client.comparison import PAGE, SHOWN, TABLE
from fleet_manager.client.formats import duration
from fleet_manager.desk.experiment import ShownExperiment
from fleet_manager.gui.benchmarks.background import Background
from fleet_manager.gui.benchmarks.child_process import ChildProcess
from fleet_manager.gui.benchmarks.form import ExperimentForm
from fleet_manager.gui.benchmarks.picture import Picture
from hive_common.checked_yaml import read_checked
from hive_common.errors import HiveError
from hive_common.resources import beside, names_in, package_folder

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from concurrent.futures import Future

    from python_qt_binding.QtCore import QSettings

FILES = ("fleet", "scenario", "world", "map")
"""What an experiment names files by; a path is relative to the experiment's folder."""


class Benchmarks(QWidget):
    """Choose what is compared, run it, and look at the results.

    Args:
        results: The folder of the results.
        settings: Keeps what a person typed.
        command: The program that compares, with its first words.
        poster: The program that posts random tasks to a live hive, with its first words.
    """

    def __init__(
        self,
        results: Path,
        settings: QSettings,
        command: Sequence[str] = ("rosrun", "hive_lab", "compare"),
        poster: Sequence[str] = ("rosrun", "fleet_manager", "hive", "load"),
    ) -> None:
        super().__init__()
        self.setWindowTitle("Benchmarks")
        self._results, self._settings = results, settings
        self._command, self._poster = list(command), list(poster)
        self._child = ChildProcess(self)
        self._posts = False
        self._last_words = ""
        self._background = Background(self)
        self._shown: Path | None = None
        self.form = ExperimentForm()
        self._scroll = QScrollArea(
            widgetResizable=True, horizontalScrollBarPolicy=Qt.ScrollBarAlwaysOff
        )
        self.examples = QComboBox()
        self.examples.addItem("Fill in an example…")
        self.examples.addItems(names_in("fleet_manager", "experiments"))
        self.run_button = QPushButton("&Run")
        self.stop_button = QPushButton("S&top", enabled=False)
        self.post_button = QPushButton("Post to the live &hive")
        self.post_button.setToolTip(
            "Post the tasks of the load generator to the hive at ROS_MASTER_URI.\n"
            "Of several seeds the first one draws them."
        )
        self.bar = QProgressBar(maximum=1000, textVisible=True)
        self.remaining = QLabel("")
        self.message = QLabel("", wordWrap=True, textInteractionFlags=Qt.TextSelectableByMouse)
        self.table = QTableWidget(editTriggers=QAbstractItemView.NoEditTriggers)
        self.table.verticalHeader().hide()
        self.pictures = QComboBox()
        self.picture = Picture()
        self.saved = QListWidget(selectionMode=QAbstractItemView.ExtendedSelection)
        self.compare_button = QPushButton("&Compare the chosen ones")
        self.repeat_button = QPushButton("Fill in the e&xperiment")
        self.page_button = QPushButton("Export &page…", enabled=False)
        self.csv_button = QPushButton("Export CS&V…", enabled=False)
        self._lay_out()
        self._connect()
        self._restore()
        self._enable()
        self.list_saved()

    # What a person does

    def run(self) -> None:
        """Run what the form says."""
        try:
            content = self.form.content()
            content |= _found_from(Path("here.yaml"), content)
            self._results.mkdir(parents=True, exist_ok=True)
            file = self._results / "benchmark.yaml"
            file.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
        except (ValueError, RuntimeError) as error:  # the latter: see `_found_from`
            self._say(str(error))
        except OSError as error:
            self._say(f"{self._results} cannot be written: {error.strerror}; start elsewhere")
        else:
            self._start_comparing([str(file)])

    def post(self) -> None:
        """Post the tasks of the load generator to the live hive."""
        try:
            content = self.form.content()
        except ValueError as error:
            self._say(str(error))
            return
        load = content["load"]
        options = {
            "at-once": load["at_once"],
            "per-hour": f"{load['per_hour']:.10g}",
            "minutes": f"{load['minutes']:.10g}",
            "mix": ",".join(f"{name}={weight:.10g}" for name, weight in load["mix"].items()),
            "map": content.get("map") or content["world"],
            "seed": content["seeds"][0],
        }
        words = [f"--{key}={value}" for key, value in options.items()]
        self._start([*self._poster, *words], posts=True)

    def compare(self) -> None:
        """Show the chosen saved results side by side."""
        chosen = [item.data(Qt.UserRole) for item in self.saved.selectedItems()]
        if not chosen:
            self._say("Choose saved results in the list: one to look at it, several to compare.")
        elif len(chosen) == 1:
            self.show_results(Path(chosen[0]))
        else:
            self._start_comparing(chosen)

    def stop(self) -> None:
        """End the runs, of which what is not finished is lost, or the posting."""
        if self._child.is_running:
            self._say("stopping …")
            self._child.stop()

    def export(self, name: str, words: str) -> None:
        """Copy a file of the shown results to where a person wants it."""
        if self._shown is None:
            return
        path, _ = QFileDialog.getSaveFileName(self, words, str(Path.home() / name))
        if path:
            self.export_to(name, Path(path))

    def export_to(self, name: str, path: Path) -> None:
        """Copy a file of the shown results to a path."""
        if self._shown is None:
            return
        source = self._shown / name

        def tell(copied: Future[object]) -> None:
            error = copied.exception()
            if error is None:
                self._say(f"written: {path}")
            else:
                because = getattr(error, "strerror", None) or error
                self._say(f"{path} cannot be written: {because}; choose another place")

        # Another disk, or a network, may take long.
        self._background.do(lambda: shutil.copyfile(source, path), tell)

    def closeEvent(self, event: Any) -> None:  # noqa: ANN401, N802  (Qt's name and type)
        """Keep what was typed, and end the runs."""
        self.end()
        super().closeEvent(event)

    def end(self) -> None:
        """Keep what was typed; stop the runs and wait until their processes have ended."""
        self._keep()
        self._child.end()

    # What is shown

    def list_saved(self) -> None:
        """List the saved results, the newest first."""
        self.saved.clear()
        files = self._results.glob(f"*/{SHOWN}")
        for file in sorted(files, key=lambda file: file.stat().st_mtime, reverse=True):
            item = QListWidgetItem(f"{file.parent.name}  {_description(file)}".rstrip())
            item.setData(Qt.UserRole, str(file.parent))
            self.saved.addItem(item)

    def show_results(self, folder: Path) -> None:
        """Show the results in a folder that `hive compare` has written."""
        try:
            (head, *rows), pictures = _saved(folder / SHOWN)
        except (OSError, ValueError) as error:
            self._say(f"{folder} cannot be shown: {error}; run the experiment again")
            return
        self._shown = folder
        self.table.setColumnCount(len(head))
        self.table.setHorizontalHeaderLabels(head)
        self.table.setRowCount(len(rows))
        for number, row in enumerate(rows):
            for column, text in enumerate(row):
                self.table.setItem(number, column, QTableWidgetItem(text))
        self.table.resizeColumnsToContents()
        self.pictures.clear()
        for title, file in pictures.items():
            self.pictures.addItem(title, str(folder / file))
        self.page_button.setEnabled(True)
        self.csv_button.setEnabled(True)
        self._say(f"shown: {folder.parent.name}/{folder.name}")

    def _say(self, text: str) -> None:
        self.message.setText(text)

    # The process

    def _start_comparing(self, sources: Sequence[str]) -> None:
        self._start([*self._command, "--progress", "--results", str(self._results), *sources])

    def _start(self, command: Sequence[str], *, posts: bool = False) -> None:
        if self._child.is_running:
            return
        self._keep()
        self._posts, self._last_words = posts, ""
        self.bar.setValue(0)
        self.remaining.setText("")
        self._say("starting …")
        self._child.start(command)
        self._enable()

    def _hear(self, line: str) -> None:
        """Take in a line of the output: progress in JSON, or what became of a task."""
        if self._posts:
            self._hear_remark(line)
            return
        # Libraries print other lines, and an exception here would end the window.
        with contextlib.suppress(ValueError, KeyError, TypeError, OverflowError):
            self._show(json.loads(line))

    def _hear_remark(self, line: str) -> None:
        """Take in a line for people."""
        if line:
            self._last_words = line
        if self._posts:
            self._say(self._last_words)

    def _show(self, told: dict[str, Any]) -> None:
        """Show a line of the process: the folder of the results, or how far the runs are."""
        if "folder" in told:
            self.show_results(Path(told["folder"]))
            return
        share, left = round(1000 * told["share"]), told["remaining"]
        words = f"run {told['number']} of {told['runs']}: {told['run']}"
        remaining = "remaining time not known yet"
        if left is not None:
            remaining = f"about {duration(left)} left"
        self.bar.setValue(share)
        self.remaining.setText(remaining)
        self._say(words)

    def _finish(self, code: int, stopped: bool) -> None:
        self.remaining.setText("")
        what = "posting" if self._posts else "the comparison"
        if stopped and self._posts:
            self._say("stopped; tasks that were posted stay on the list")
        elif stopped:
            self._say("stopped; runs that had not finished are lost")
        elif code:
            self._say(self._last_words or f"{what} ended with {code}")
        elif self._posts:
            last = f"; last: {self._last_words}" if self._last_words else ""
            self._say(f"posted: every task is on the list{last}")
        else:
            self.bar.setValue(self.bar.maximum())
            self.list_saved()
        self._enable()

    def _miss(self, program: str) -> None:
        self._say(f"{program} was not found; start this window in ./hive shell")
        self._enable()

    # Set-up

    def _enable(self) -> None:
        runs = self._child.is_running
        self.run_button.setEnabled(not runs)
        self.compare_button.setEnabled(not runs)
        self.post_button.setEnabled(not runs and self.form.by_load.isChecked())
        self.stop_button.setEnabled(runs)

    def _reveal_last_fault(self) -> None:
        if self.form.faults.rows:
            self._scroll.ensureWidgetVisible(self.form.faults.rows[-1])

    def _fill_example(self, number: int) -> None:
        if number > 0:
            folder = package_folder("fleet_manager") / "experiments"
            self._fill(folder / f"{self.examples.itemText(number)}.yaml")

    def _fill_chosen(self) -> None:
        for item in self.saved.selectedItems()[:1]:
            self._fill(Path(item.data(Qt.UserRole)) / "experiment.yaml")

    def _fill(self, file: Path) -> None:
        """Fill the form from an experiment file."""
        try:
            read = read_checked(file, ShownExperiment)
            found = _found_from(file, attrs.asdict(read, recurse=False))
        # RuntimeError: see `_found_from`; ValueError: a date that there is not.
        except (HiveError, RuntimeError, ValueError) as error:
            self._say(f"not filled in: {error}")
        else:
            self.form.display(attrs.evolve(read, **found))

    def _keep(self) -> None:
        self._settings.setValue("benchmarks/experiment", yaml.safe_dump(self.form.typed()))

    def _restore(self) -> None:
        kept = self._settings.value("benchmarks/experiment")
        # Whatever the settings hold, the window opens.
        with contextlib.suppress(yaml.YAMLError, HiveError, RecursionError, ValueError):
            if isinstance(kept, str):
                self.form.restore(yaml.safe_load(kept))

    def _connect(self) -> None:
        self.run_button.clicked.connect(self.run)
        self.stop_button.clicked.connect(self.stop)
        self.post_button.clicked.connect(self.post)
        self.form.by_load.toggled.connect(self._enable)
        # New fields have their place only after what the event loop has to do now.
        add = self.form.faults.add_button
        add.clicked.connect(lambda: QTimer.singleShot(0, self._reveal_last_fault))
        self._child.printed.connect(self._hear)
        self._child.complained.connect(self._hear_remark)
        self._child.ended.connect(self._finish)
        self._child.missing.connect(self._miss)
        self.examples.activated.connect(self._fill_example)
        self.pictures.currentIndexChanged.connect(
            lambda: self.picture.show_file(self.pictures.currentData() or "")
        )
        self.compare_button.clicked.connect(self.compare)
        self.repeat_button.clicked.connect(self._fill_chosen)
        self.saved.itemDoubleClicked.connect(
            lambda item: self.show_results(Path(item.data(Qt.UserRole)))
        )
        self.page_button.clicked.connect(lambda: self.export(PAGE, "Export the page"))
        self.csv_button.clicked.connect(lambda: self.export(TABLE, "Export the table"))

    def _lay_out(self) -> None:
        left, right = QWidget(), QTabWidget()
        fields = _column(self.examples, self.form)
        fields.layout().addStretch()
        self._scroll.setWidget(fields)
        self._scroll.setMinimumWidth(fields.sizeHint().width() + 24)
        column = QVBoxLayout(left)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self._scroll, stretch=1)
        # Below the form and not in it, so that they are in view wherever that is scrolled to.
        buttons = (self.run_button, self.stop_button, self.post_button)
        for row in (buttons, (self.bar, self.remaining)):
            line = QHBoxLayout()
            for widget in row:
                line.addWidget(widget)
            column.addLayout(line)
        column.addWidget(self.message)
        right.addTab(self.table, "Table")
        right.addTab(_column(self.pictures, self.picture), "Pictures")
        right.addTab(_column(self.saved, self.compare_button, self.repeat_button), "Saved runs")
        buttons = QHBoxLayout()
        buttons.addStretch()
        buttons.addWidget(self.page_button)
        buttons.addWidget(self.csv_button)
        shown = QWidget()
        rows = QVBoxLayout(shown)
        rows.addWidget(right)
        rows.addLayout(buttons)
        self.tabs = right
        splitter = QSplitter(childrenCollapsible=False)
        splitter.addWidget(left)
        splitter.addWidget(shown)
        splitter.setStretchFactor(1, 1)
        QVBoxLayout(self).addWidget(splitter)


def _column(*widgets: QWidget) -> QWidget:
    """Return widgets one below the other."""
    column = QWidget()
    layout = QVBoxLayout(column)
    for widget in widgets:
        layout.addWidget(widget)
    return column


def _found_from(file: Path, content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the names of files in an experiment, with paths that are good from everywhere.

    Args:
        file: That of the experiment, in whose folder relative paths begin.
        content: The experiment's content.

    Raises:
        RuntimeError: A path begins with the home folder of somebody who is not there.
    """
    return {key: beside(file, content[key]) for key in FILES if content.get(key)}


def _description(file: Path) -> str:
    """Return what results are about; empty where the file does not say."""
    try:
        return str(json.loads(file.read_text(encoding="utf-8")).get("description", ""))
    except (OSError, ValueError, AttributeError):
        return ""  # who looks at it is told what is wrong


def _saved(file: Path) -> tuple[list[list[str]], dict[str, str]]:
    """Return the table and the pictures of results, as `hive compare` has written them.

    Raises:
        OSError: It cannot be read.
        ValueError: It holds something else.
    """
    shown = json.loads(file.read_text(encoding="utf-8"))
    try:
        table = [[str(text) for text in row] for row in shown["table"]]
        pictures = {str(title): str(name) for title, name in shown["pictures"].items()}
    except (KeyError, TypeError, AttributeError):
        table, pictures = [], {}
    if not table:
        raise ValueError(f"{file.name} has no table and pictures of a comparison")
    return table, pictures
