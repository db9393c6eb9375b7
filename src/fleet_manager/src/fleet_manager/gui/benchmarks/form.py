# SPDX-License-Identifier: BSD-3-Clause
"""The form in which a person says what is compared."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from python_qt_binding.QtCore import Qt
from python_qt_binding.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFileDialog,
    QFormLayout,
    QGroupBox,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QRadioButton,
    QSpinBox,
    QWidget,
)

from blackboard.domain.settings import COST_MODEL_NAMES, DECISIONS
from fleet_manager.client.comparison import ARCHITECTURES, HIVE, MOST_LOSS
from fleet_manager.config.load import TYPES
from fleet_manager.desk.experiment import (
    LIMIT,
    WEIGHT,
    ShownExperiment,
    ShownLoad,
    TypedExperiment,
    robot_names,
)
from fleet_manager.gui.benchmarks.background import Background
from fleet_manager.gui.benchmarks.fault_editor import FaultEditor
from fleet_manager.gui.benchmarks.number import Number
from hive_common.resources import names_in
from hive_common.structuring import structure

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

RUN_ON_WORDS = {"virtual": "virtual time", "simulator": "simulator, on ROS"}


class ExperimentForm(QWidget):
    """Fields for everything that an experiment file may hold; see docs/comparing.md."""

    def __init__(self) -> None:
        super().__init__()
        self.description = QLineEdit(placeholderText="what it is for, in a sentence")
        self.fleet = _files("fleet_manager", "fleets")
        self.by_scenario = QRadioButton("&Scenario")
        self.by_load = QRadioButton("&Load generator")
        self.scenario = _files("fleet_manager", "scenarios")
        self.world = _files("simenv", "worlds")
        self.chart = _files("simenv", "maps", empty="that of the world")
        self.at_once = QSpinBox(maximum=1000, suffix=" tasks")
        self.per_hour = Number(maximum=3600, suffix=" per hour")
        self.minutes = Number(maximum=1440, suffix=" min")
        self.mix = {name: Number(maximum=WEIGHT, prefix=f"{name} ") for name in TYPES}
        self.architectures = {name: QCheckBox(words) for name, words in ARCHITECTURES.items()}
        self.decisions = {name: QCheckBox(name) for name in DECISIONS}
        self.cost_models = {name: QCheckBox(name) for name in COST_MODEL_NAMES}
        self.seeds = QLineEdit(placeholderText="1, 2, 3")
        self.run_on = QComboBox()
        for name, words in RUN_ON_WORDS.items():
            self.run_on.addItem(words, name)
        self.rtf = Number(minimum=0.1, maximum=20, prefix="x ")
        self.limit = Number(minimum=0.1, maximum=LIMIT, suffix=" s")
        self.faults = FaultEditor()
        self.loss = Number(maximum=100 * MOST_LOSS, suffix=" %")
        self.loss.setToolTip("Share of the messages between two processes that are lost")
        self._background = Background(self)
        self._lay_out()
        self.fleet.currentTextChanged.connect(self._look_for_robots)
        self.by_load.toggled.connect(self._enable)
        self.run_on.currentIndexChanged.connect(self._enable)
        for box in self.architectures.values():
            box.toggled.connect(self._enable)
        self.display(ShownExperiment(fleet="lab", load=ShownLoad(at_once=12)))
        self._look_for_robots(self.fleet.currentText())

    def fill(self, content: Mapping[str, Any]) -> None:
        """Show the content of an experiment file; what it leaves out gets its default.

        Raises:
            hive_common.structuring.NotAllowedError: It holds what the fields cannot show.
        """
        self.display(structure(dict(content), ShownExperiment))

    def display(self, shown: ShownExperiment) -> None:
        """Show an experiment."""
        self.by_load.setChecked(shown.load is not None)
        self.by_scenario.setChecked(shown.load is None)
        self.description.setText(shown.description)
        self.fleet.setCurrentText(shown.fleet)
        self.scenario.setCurrentText("demo" if shown.scenario is None else shown.scenario)
        self.world.setCurrentText(shown.world)
        self.chart.setCurrentText(shown.map)
        load = shown.load or ShownLoad()
        self.at_once.setValue(load.at_once)
        self.per_hour.setValue(load.per_hour)
        self.minutes.setValue(load.minutes)
        for name, box in self.mix.items():
            box.setValue(load.mix.get(name, 0.0))
        for boxes, names in (
            (self.architectures, shown.architectures or (HIVE,)),
            (self.decisions, shown.decisions),
            (self.cost_models, shown.cost_models),
        ):
            for name, check in boxes.items():
                check.setChecked(name in names)
        self.seeds.setText(", ".join(map(str, shown.seeds)))
        self.run_on.setCurrentIndex(self.run_on.findData(shown.run_on))
        self.rtf.setValue(shown.rtf)
        self.faults.fill(shown.faults)
        self.loss.setValue(100 * shown.loss)
        self.limit.setValue(shown.time_limit)
        self._enable()

    def restore(self, typed: object) -> None:
        """Show what `typed` returned, or an earlier version of the form kept.

        Raises:
            hive_common.structuring.NotAllowedError: It is something else.
        """
        read = structure(typed, TypedExperiment)
        self.display(read)
        if read.by_load is not None:
            self.by_load.setChecked(read.by_load)
            self.by_scenario.setChecked(not read.by_load)
        if read.seeds_text is not None:
            self.seeds.setText(read.seeds_text)

    def typed(self) -> dict[str, Any]:
        """Return everything that was typed, whether it counts or not, and right or wrong."""
        return {
            "description": self.description.text().strip(),
            "fleet": self.fleet.currentText().strip(),
            "by_load": self.by_load.isChecked(),
            "scenario": self.scenario.currentText().strip(),
            "load": {
                "at_once": self.at_once.value(),
                "per_hour": self.per_hour.value(),
                "minutes": self.minutes.value(),
                "mix": {name: box.value() for name, box in self.mix.items()},
            },
            "world": self.world.currentText().strip(),
            "map": self.chart.currentText().strip(),
            "architectures": _ticked(self.architectures),
            "decisions": _ticked(self.decisions),
            "cost_models": _ticked(self.cost_models),
            "seeds_text": self.seeds.text(),
            "run_on": self.run_on.currentData(),
            "rtf": self.rtf.value(),
            "faults": self.faults.typed(),
            "loss": round(self.loss.value() / 100, 8),
            "time_limit": self.limit.value(),
        }

    def content(self) -> dict[str, Any]:
        """Return the content of an experiment file, without what has its default.

        Raises:
            ValueError: A field cannot be used; the text names it, what it holds, and what is
                allowed.
        """
        typed = self.typed()
        tasks = ("load", "world") if typed["by_load"] else ("scenario",)
        content = {key: typed[key] for key in ("fleet", *tasks)}
        content |= {key: typed[key] for key in ("description", "map") if typed[key]}
        is_virtual = typed["run_on"] == "virtual"
        if is_virtual and typed["architectures"] not in ([], [HIVE]):
            content["architectures"] = typed["architectures"]
        content["decisions"] = typed["decisions"] if self._has_hive() else []
        content["cost_models"] = typed["cost_models"]
        content["seeds"] = self.seeds_content()
        content |= {key: typed[key] for key in ("run_on", "rtf")}
        if faults := self.faults.content():
            content["faults"] = faults
        if is_virtual and typed["loss"]:
            content["loss"] = typed["loss"]
        content["time_limit"] = typed["time_limit"]
        return content

    def seeds_content(self) -> list[int]:
        """Return the seeds.

        Raises:
            ValueError: They are something else; the text says what is allowed.
        """
        text = self.seeds.text()
        words = [word for word in re.split(r"[\s,]+", text) if word]
        if not words or not all(word.isdecimal() for word in words):
            raise ValueError(f"Seeds: {text!r}; allowed: whole numbers from 0 on, such as 1, 2, 3")
        return [int(word) for word in words]

    def _has_hive(self) -> bool:
        """Return whether the hive is among the architectures that are compared."""
        is_virtual = self.run_on.currentData() == "virtual"
        ticked = _ticked(self.architectures) if is_virtual else []
        return not ticked or HIVE in ticked

    def _enable(self) -> None:
        """Enable what counts with the present choices."""
        by_load = self.by_load.isChecked()
        self.scenario.setEnabled(not by_load)
        for field in (self.world, self.at_once, self.per_hour, self.minutes, *self.mix.values()):
            field.setEnabled(by_load)
        is_virtual = self.run_on.currentData() == "virtual"
        self.rtf.setEnabled(not is_virtual)
        self.loss.setEnabled(is_virtual)
        for name, box in self.architectures.items():
            box.setEnabled(is_virtual or name == HIVE)
        for box in self.decisions.values():
            box.setEnabled(self._has_hive())

    def _look_for_robots(self, fleet: str) -> None:
        """Offer the robots of a fleet as those that faults may be about."""
        self._background.forget()
        self._background.do(
            lambda: robot_names(fleet.strip()), lambda names: self.faults.offer(names.result())
        )

    def _lay_out(self) -> None:
        where, tasks, ways, run, faults = (
            QGroupBox(title) for title in ("Fleet", "Tasks", "Ways to decide", "Runs", "Faults")
        )
        form = QFormLayout(where)
        form.addRow("&Fleet", self._with_button(self.fleet))
        form.addRow("&Map", self._with_button(self.chart))
        form = QFormLayout(tasks)
        form.addRow(self.by_scenario, self._with_button(self.scenario))
        form.addRow(self.by_load, _row([self.at_once, self.per_hour, self.minutes]))
        form.addRow("Types", _row(list(self.mix.values())))
        form.addRow("&World", self._with_button(self.world))
        form = QFormLayout(ways)
        form.addRow("Architecture", _row(list(self.architectures.values())))
        form.addRow("Decision", _row(list(self.decisions.values())))
        form.addRow("Cost model", _row(list(self.cost_models.values())))
        form = QFormLayout(run)
        form.addRow("See&ds", self.seeds)
        form.addRow("Run &on", _row([self.run_on, self.rtf]))
        form.addRow("&Time limit", self.limit)
        form = QFormLayout(faults)
        form.addRow("Messa&ge loss", self.loss)
        form.addRow(self.faults)
        layout = QFormLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addRow("&Description", self.description)
        for group in (where, tasks, ways, run, faults):
            layout.addRow(group)

    def _with_button(self, box: QComboBox) -> QWidget:
        """Return a list of names with a button that looks for another file."""
        button = QPushButton("…", toolTip="Choose another file")
        button.setFixedWidth(3 * self.fontMetrics().averageCharWidth() + 12)

        def choose() -> None:
            path, _ = QFileDialog.getOpenFileName(self, "Choose a file", "", "YAML files (*.yaml)")
            if path:
                box.setCurrentText(path)

        button.clicked.connect(choose)
        return _row([box, button])


def _ticked(boxes: Mapping[str, QCheckBox]) -> list[str]:
    return [name for name, box in boxes.items() if box.isChecked()]


def _files(package: str, folder: str, empty: str = "") -> QComboBox:
    """Return a list of the files that come with a package; others can be typed."""
    box = QComboBox(editable=True)
    box.addItems(([""] if empty else []) + names_in(package, folder))
    box.lineEdit().setPlaceholderText(empty)
    box.setMinimumContentsLength(14)
    return box


def _row(widgets: Sequence[QWidget]) -> QWidget:
    """Return widgets side by side."""
    row = QWidget()
    layout = QHBoxLayout(row)
    layout.setContentsMargins(0, 0, 0, 0)
    for widget in widgets:
        layout.addWidget(widget, stretch=int(isinstance(widget, QComboBox)))
    if not any(isinstance(widget, QComboBox) for widget in widgets):
        layout.addStretch()
    layout.setAlignment(Qt.AlignLeft)
    return row
