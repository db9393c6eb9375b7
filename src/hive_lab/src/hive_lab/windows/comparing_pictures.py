# SPDX-License-Identifier: BSD-3-Clause
"""Takes the pictures of docs/comparing.md from the benchmarks' window, which runs an experiment.

Run it in the environment of the workspace, with the folder for the pictures:
`./hive shell -c "python3 -m hive_lab.windows.comparing_pictures docs/images"`. It needs no screen
and starts no hive: the runs are on virtual time.
"""

from __future__ import annotations

import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path

from python_qt_binding.QtCore import QSettings
from python_qt_binding.QtWidgets import QApplication

from fleet_manager.gui.benchmarks.window import Benchmarks
from hive_lab.windows.pictures import Studio, own_screen

SIZE = (1440, 880)
EXPERIMENT = {
    "description": "Whoever coordinates is killed after 10 s.",
    "fleet": "lab",
    "load": {"at_once": 8, "mix": {"GA": 1.0, "GAB": 2.0, "GPA": 0.5, "GPAB": 0.5}},
    "world": "lab",
    "architectures": ["hive", "report", "central"],
    "decisions": ["planned"],
    "cost_models": ["latency"],
    "seeds": [1, 2],
    "faults": [{"after": 10.0, "kill": "blackboard"}],
    "time_limit": 300.0,
}
PICTURE = "planned, latency, seed 1"
"""The run whose picture is shown."""


def main() -> None:
    """Take both pictures."""
    if len(sys.argv) != 2:  # noqa: PLR2004  (the program and its argument)
        sys.exit("usage: python3 -m hive_lab.windows.comparing_pictures FOLDER")
    images = Path(sys.argv[1])
    images.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        stack.enter_context(own_screen())
        application = QApplication(["comparing_pictures"])
        settings = QSettings(str(folder / "settings"), QSettings.IniFormat)
        window = Benchmarks(folder / "results", settings)
        studio = Studio(application, window, images)
        window.resize(*SIZE)
        window.form.fill(EXPERIMENT)
        window.show()
        window.run()
        studio.wait_until(window.run_button.isEnabled)
        if not window.message.text().startswith("shown: "):
            sys.exit(window.message.text())
        studio.take(window, "benchmarks")
        window.tabs.setCurrentIndex(1)
        studio.wait(0.5)  # until the tab has its size, to which the picture is scaled
        window.pictures.setCurrentText(PICTURE)
        studio.take(window, "benchmarks_pictures")
        window.end()


if __name__ == "__main__":
    main()
