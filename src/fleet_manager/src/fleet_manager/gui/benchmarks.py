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

import yaml
from python_qt_binding.QtCore import QProcess, QProcessEnvironment, Qt
from python_qt_binding.QtGui import QPixmap
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
from fleet_manager.gui.experiment_form import ExperimentForm
from hive_common.resources import names_in, package_folder

if TYPE_CHECKING:
    from collections.abc import Sequence

    from python_qt_binding.QtCore import QSettings

END_WITHIN = 40_000
"""Time that a stopped comparison has to end the processes of its hive [ms]."""


class Benchmarks(QWidget):
    """Choose what is compared, run it, and look at the results.

    Args:
        results: The folder of the results.
        settings: Keeps what a person typed.
        command: The program that compares, with its first words.
    """

    def __init__(
        self,
        results: Path,
        settings: QSettings,
        command: Sequence[str] = ("rosrun", "hive_lab", "compare"),
    ) -> None:
        super().__init__()
        self.setWindowTitle("Benchmarks")
        self._results, self._settings, self._command = results, settings, list(command)
        self._process: QProcess | None = None
        self._stopped = False
        self._shown: Path | None = None
        self.form = ExperimentForm()
        self.examples = QComboBox()
        self.examples.addItem("Fill in an example…")
        self.examples.addItems(names_in("fleet_manager", "experiments"))
        self.run_button = QPushButton("&Run")
        self.stop_button = QPushButton("S&top", enabled=False)
        self.bar = QProgressBar(maximum=1000, textVisible=True)
        self.remaining = QLabel("")
        self.message = QLabel("", wordWrap=True, textInteractionFlags=Qt.TextSelectableByMouse)
        self.table = QTableWidget(editTriggers=QAbstractItemView.NoEditTriggers)
        self.table.verticalHeader().hide()
        self.pictures = QComboBox()
        self.picture = QLabel(alignment=Qt.AlignTop | Qt.AlignLeft)
        self.saved = QListWidget(selectionMode=QAbstractItemView.ExtendedSelection)
        self.compare_button = QPushButton("&Compare the chosen ones")
        self.repeat_button = QPushButton("Fill in the e&xperiment")
        self.page_button = QPushButton("Export &page…", enabled=False)
        self.csv_button = QPushButton("Export CS&V…", enabled=False)
        self._lay_out()
        self._connect()
        self._restore()
        self.list_saved()

    # What a person does

    def run(self) -> None:
        """Run what the form says."""
        try:
            content = self.form.content()
        except ValueError as error:
            self._say(str(error))
            return
        self._keep()
        self._results.mkdir(parents=True, exist_ok=True)
        file = self._results / "benchmark.yaml"
        file.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
        self._start([str(file)])

    def compare(self) -> None:
        """Show the chosen saved results side by side."""
        chosen = [item.data(Qt.UserRole) for item in self.saved.selectedItems()]
        if not chosen:
            self._say("Choose saved results in the list: one to look at it, several to compare.")
        elif len(chosen) == 1:
            self.show_results(Path(chosen[0]))
        else:
            self._start(chosen)

    def stop(self) -> None:
        """End the runs; what is not finished is lost."""
        if self._process is not None:
            self._stopped = True
            self.message.setText("stopping …")
            self._process.terminate()

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
        try:
            shutil.copyfile(self._shown / name, path)
        except OSError as error:
            self._say(f"{path} cannot be written: {error.strerror}; choose another place")
        else:
            self._say(f"written: {path}")

    def closeEvent(self, event: Any) -> None:  # noqa: ANN401, N802  (Qt's name and type)
        """Keep what was typed, and end the runs."""
        self.end()
        super().closeEvent(event)

    def end(self) -> None:
        """Keep what was typed; stop the runs and wait until their processes have ended."""
        self._keep()
        if self._process is not None:
            self.stop()
            self._process.waitForFinished(END_WITHIN)

    # What is shown

    def list_saved(self) -> None:
        """List the saved results, the newest first."""
        self.saved.clear()
        files = self._results.glob(f"*/{SHOWN}")
        for file in sorted(files, key=lambda file: file.stat().st_mtime, reverse=True):
            item = QListWidgetItem(file.parent.name)
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

    def _show_picture(self) -> None:
        path = self.pictures.currentData()
        if not path:
            return
        pixmap = QPixmap(path)
        width = max(self.picture.parentWidget().width() - 8, 320)
        self.picture.setPixmap(
            pixmap.scaledToWidth(min(width, pixmap.width()), Qt.SmoothTransformation)
        )
        self.picture.adjustSize()

    def _say(self, text: str) -> None:
        self.message.setText(text)

    # The process

    def _start(self, sources: list[str]) -> None:
        if self._process is not None:
            return
        program, *words = self._command
        process = self._process = QProcess(self)
        environment = QProcessEnvironment.systemEnvironment()
        environment.insert("PYTHONUNBUFFERED", "1")
        process.setProcessEnvironment(environment)
        process.readyReadStandardOutput.connect(self._read)
        process.finished.connect(self._finish)
        process.errorOccurred.connect(self._fail)
        self._stopped = False
        self.bar.setValue(0)
        self.remaining.setText("")
        self._say("starting …")
        self._enable()
        results = ["--progress", "--results", str(self._results)]
        process.start(program, [*words, *results, *sources])

    def _read(self) -> None:
        """Show what the process tells."""
        process = self._process
        while process is not None and process.canReadLine():
            line = bytes(process.readLine())
            # Libraries print other lines, and an exception here would end the window.
            with contextlib.suppress(ValueError, KeyError, TypeError, OverflowError):
                self._show(json.loads(line.decode()))

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

    def _finish(self, code: int) -> None:
        self._read()
        process, self._process = self._process, None
        if process is None:
            return
        self.remaining.setText("")
        if self._stopped:
            self._say("stopped; runs that had not finished are lost")
        elif code == 0:
            self.bar.setValue(self.bar.maximum())
            self.list_saved()
        else:
            lines = bytes(process.readAllStandardError()).decode(errors="replace").splitlines()
            self._say(lines[-1] if lines else f"the comparison ended with {code}")
        process.deleteLater()
        self._enable()

    def _fail(self, error: QProcess.ProcessError) -> None:
        if error == QProcess.FailedToStart:
            self._process = None
            self._say(f"{self._command[0]} was not found; start this window in ./hive shell")
            self._enable()

    # Set-up

    def _enable(self) -> None:
        runs = self._process is not None
        self.run_button.setEnabled(not runs)
        self.compare_button.setEnabled(not runs)
        self.stop_button.setEnabled(runs)

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
            content = yaml.safe_load(file.read_text(encoding="utf-8"))
        except (OSError, yaml.YAMLError):
            self._say(f"{file.parent.name} holds no experiment; choose the results of a run")
            return
        if content["fleet"].startswith("./"):
            content["fleet"] = str(file.parent / content["fleet"])
        self.form.fill(content)

    def _keep(self) -> None:
        try:
            content = self.form.content()
        except ValueError:
            return
        self._settings.setValue("benchmarks/experiment", yaml.safe_dump(content))

    def _restore(self) -> None:
        kept = self._settings.value("benchmarks/experiment")
        if kept:
            self.form.fill(yaml.safe_load(kept))

    def _connect(self) -> None:
        self.run_button.clicked.connect(self.run)
        self.stop_button.clicked.connect(self.stop)
        self.examples.activated.connect(self._fill_example)
        self.pictures.currentIndexChanged.connect(self._show_picture)
        self.compare_button.clicked.connect(self.compare)
        self.repeat_button.clicked.connect(self._fill_chosen)
        self.saved.itemDoubleClicked.connect(
            lambda item: self.show_results(Path(item.data(Qt.UserRole)))
        )
        self.page_button.clicked.connect(lambda: self.export(PAGE, "Export the page"))
        self.csv_button.clicked.connect(lambda: self.export(TABLE, "Export the table"))

    def _lay_out(self) -> None:
        left, right = QWidget(), QTabWidget()
        column = QVBoxLayout(left)
        column.addWidget(self.examples)
        column.addWidget(self.form)
        for row in ((self.run_button, self.stop_button), (self.bar, self.remaining)):
            line = QHBoxLayout()
            for widget in row:
                line.addWidget(widget)
            column.addLayout(line)
        column.addWidget(self.message)
        column.addStretch()
        scrolled = QScrollArea(widgetResizable=True)
        scrolled.setWidget(self.picture)
        right.addTab(self.table, "Table")
        right.addTab(_column(self.pictures, scrolled), "Pictures")
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
        form = QScrollArea(widgetResizable=True, horizontalScrollBarPolicy=Qt.ScrollBarAlwaysOff)
        form.setWidget(left)
        form.setMinimumWidth(left.sizeHint().width() + 24)
        splitter = QSplitter()
        splitter.addWidget(form)
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
