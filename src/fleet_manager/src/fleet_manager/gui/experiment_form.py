# SPDX-License-Identifier: BSD-3-Clause
"""The form in which a person says what is compared."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from python_qt_binding.QtCore import Qt
from python_qt_binding.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
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
from fleet_manager.config.load import TYPES
from hive_common.resources import names_in

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

RUN_ON = {"virtual": "virtual time", "simulator": "simulator, on ROS"}
_FAULT = re.compile(r"\s*([0-9.]+)\s*s?\s+(\S+)\s*")


class ExperimentForm(QWidget):
    """Fields for everything that an experiment file may hold; see docs/comparing.md."""

    def __init__(self) -> None:
        super().__init__()
        self.fleet = _files("fleet_manager", "fleets")
        self.by_scenario = QRadioButton("&Scenario")
        self.by_load = QRadioButton("&Load generator")
        self.scenario = _files("fleet_manager", "scenarios")
        self.world = _files("simenv", "worlds")
        self.chart = _files("simenv", "maps", empty="that of the world")
        self.at_once = QSpinBox(maximum=1000, suffix=" tasks")
        self.per_hour = QDoubleSpinBox(maximum=3600, suffix=" per hour", decimals=0)
        self.minutes = QDoubleSpinBox(maximum=1440, suffix=" min", decimals=1)
        self.mix = {
            name: QDoubleSpinBox(maximum=100, decimals=1, prefix=f"{name} ") for name in TYPES
        }
        self.decisions = {name: QCheckBox(name) for name in DECISIONS}
        self.cost_models = {name: QCheckBox(name) for name in COST_MODEL_NAMES}
        self.seeds = QLineEdit(placeholderText="1, 2, 3")
        self.run_on = QComboBox()
        for name, words in RUN_ON.items():
            self.run_on.addItem(words, name)
        self.rtf = QDoubleSpinBox(minimum=0.1, maximum=20, prefix="x ", decimals=1)
        self.faults = QLineEdit(placeholderText="none; or 60 s robot2; 90 s blackboard")
        self.limit = QDoubleSpinBox(minimum=1, maximum=86400, suffix=" s", decimals=0)
        self._lay_out()
        self.by_load.toggled.connect(self._enable)
        self.run_on.currentIndexChanged.connect(self._enable)
        self.fill({"fleet": "lab", "world": "lab", "load": {"at_once": 12}, "seeds": [1]})

    def fill(self, content: Mapping[str, Any]) -> None:
        """Show the content of an experiment file; what it leaves out gets its default."""
        load = content.get("load")
        self.by_load.setChecked(load is not None)
        self.by_scenario.setChecked(load is None)
        self.fleet.setCurrentText(content.get("fleet", ""))
        self.scenario.setCurrentText(content.get("scenario") or "demo")
        self.world.setCurrentText(content.get("world") or "lab")
        self.chart.setCurrentText(content.get("map") or "")
        load = load or {}
        self.at_once.setValue(load.get("at_once", 0))
        self.per_hour.setValue(load.get("per_hour", 0.0))
        self.minutes.setValue(load.get("minutes", 10.0))
        mix = load.get("mix", dict.fromkeys(TYPES, 1.0))
        for name, box in self.mix.items():
            box.setValue(mix.get(name, 0.0))
        for boxes, key in ((self.decisions, "decisions"), (self.cost_models, "cost_models")):
            for name, check in boxes.items():
                check.setChecked(name in content.get(key, ()))
        self.seeds.setText(", ".join(map(str, content.get("seeds", [1]))))
        self.run_on.setCurrentIndex(self.run_on.findData(content.get("run_on", "virtual")))
        self.rtf.setValue(content.get("rtf", 3.0))
        faults = (f"{fault['after']:g} s {fault['kill']}" for fault in content.get("faults", ()))
        self.faults.setText("; ".join(faults))
        self.limit.setValue(content.get("time_limit", 3600.0))
        self._enable()

    def content(self) -> dict[str, Any]:
        """Return the content of an experiment file.

        Raises:
            ValueError: A field cannot be used; the text names it, what it holds, and what is
                allowed.
        """
        content: dict[str, Any] = {"fleet": self.fleet.currentText().strip()}
        if self.by_load.isChecked():
            content["load"] = {
                "at_once": self.at_once.value(),
                "per_hour": self.per_hour.value(),
                "minutes": self.minutes.value(),
                "mix": {name: box.value() for name, box in self.mix.items()},
            }
            content["world"] = self.world.currentText().strip()
        else:
            content["scenario"] = self.scenario.currentText().strip()
        if self.chart.currentText().strip():
            content["map"] = self.chart.currentText().strip()
        content["decisions"] = [name for name, box in self.decisions.items() if box.isChecked()]
        content["cost_models"] = [
            name for name, box in self.cost_models.items() if box.isChecked()
        ]
        content["seeds"] = self._seeds()
        content["run_on"] = self.run_on.currentData()
        content["rtf"] = self.rtf.value()
        content["faults"] = self._faults()
        content["time_limit"] = self.limit.value()
        return content

    def _seeds(self) -> list[int]:
        text = self.seeds.text()
        words = [word for word in re.split(r"[\s,]+", text) if word]
        if not words or not all(word.isdecimal() for word in words):
            raise ValueError(f"Seeds: {text!r}; allowed: whole numbers from 0 on, such as 1, 2, 3")
        return [int(word) for word in words]

    def _faults(self) -> list[dict[str, Any]]:
        faults = []
        for part in filter(str.strip, self.faults.text().split(";")):
            match = _FAULT.fullmatch(part)
            if match is None:
                raise ValueError(
                    f"Kill: {part.strip()!r}; allowed: seconds and a name, such as 60 s robot2"
                )
            faults.append({"after": float(match[1]), "kill": match[2]})
        return faults

    def _enable(self) -> None:
        """Enable what counts with the present choices."""
        by_load = self.by_load.isChecked()
        self.scenario.setEnabled(not by_load)
        for field in (self.world, self.at_once, self.per_hour, self.minutes, *self.mix.values()):
            field.setEnabled(by_load)
        self.rtf.setEnabled(self.run_on.currentData() == "simulator")

    def _lay_out(self) -> None:
        where, tasks, ways, run = (
            QGroupBox(title) for title in ("Fleet", "Tasks", "Ways to decide", "Runs")
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
        form.addRow("Decision", _row(list(self.decisions.values())))
        form.addRow("Cost model", _row(list(self.cost_models.values())))
        form = QFormLayout(run)
        form.addRow("See&ds", self.seeds)
        form.addRow("Run &on", _row([self.run_on, self.rtf]))
        form.addRow("&Kill", self.faults)
        form.addRow("&Time limit", self.limit)
        layout = QFormLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        for group in (where, tasks, ways, run):
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
