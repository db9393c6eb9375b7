# SPDX-License-Identifier: BSD-3-Clause
"""Takes the pictures of docs/operator-guide.md from the running programs.

Run it in the environment of the workspace, with the folder for the pictures:
`./hive shell -c "python3 -m hive_lab.windows.pictures docs/images"`. It needs no screen: it
starts an X server, a hive in the lab with a scenario, RViz and the windows.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

from python_qt_binding.QtCore import QEventLoop, QSettings
from python_qt_binding.QtWidgets import QApplication, QWidget

from blackboard.domain.task import TaskState, TaskType
from fleet_manager.demo.local_hive import local_hive
from fleet_manager.gui.desk import Desk
from fleet_manager.gui.fleet_window import FleetWindow
from fleet_manager.gui.look import Appearance
from fleet_manager.gui.task_details import TaskDetails
from fleet_manager.ros.desk_link import RosDeskLink
from hive_common.resources import package_folder

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from python_qt_binding.QtGui import QPixmap

Window = TypeVar("Window", bound=QWidget)

SIZE = (1366, 768)
PATIENCE = 300.0  # [s] for the hive to start, and for robots to be at work
SCENARIO = "demo"
RVIZ = 25.0  # [s] until RViz shows everything


class Studio(Generic[Window]):
    """A window at work, and a camera whose pictures go to a folder."""

    def __init__(self, application: QApplication, window: Window, folder: Path) -> None:
        self._application = application
        self._folder = folder
        self.window = window

    def wait_until(self, seen: Callable[[], object]) -> None:
        """Let the windows work until a condition holds."""
        end = time.monotonic() + PATIENCE
        while not seen():
            if time.monotonic() > end:
                sys.exit("it did not get as far as the pictures need; see the log")
            self._application.processEvents(QEventLoop.AllEvents, 50)

    def wait(self, seconds: float) -> None:
        """Let the windows work for a while."""
        end = time.monotonic() + seconds
        self.wait_until(lambda: time.monotonic() > end)

    def take(self, widget: QWidget, name: str) -> None:
        """Take a picture of a window."""
        self.wait(0.5)
        self._save(widget.grab(), name)

    def take_screen(self, name: str) -> None:
        """Take a picture of the whole screen."""
        self._save(self._application.primaryScreen().grabWindow(0), name)

    def _save(self, picture: QPixmap, name: str) -> None:
        path = self._folder / f"{name}.png"
        if not picture.save(str(path)):
            sys.exit(f"{path} cannot be written")
        sys.stdout.write(f"{path}\n")


@contextmanager
def _running(command: list[str], **options: object) -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen(command, **options)  # type: ignore[call-overload]  # noqa: S603  (named here)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


@contextmanager
def own_screen() -> Iterator[None]:
    """Give this program a screen of its own."""
    read, write = os.pipe()
    width, height = SIZE
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{width}x{height}x24"]
    with _running(command, pass_fds=[write], stderr=subprocess.DEVNULL):
        os.close(write)
        with os.fdopen(read) as number:
            os.environ["DISPLAY"] = f":{number.readline().strip()}"
        yield


def main() -> None:
    """Take all pictures."""
    if len(sys.argv) != 2:  # noqa: PLR2004  (the program and its argument)
        sys.exit("usage: python3 -m hive_lab.windows.pictures FOLDER")
    images = Path(sys.argv[1])
    images.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        stack.enter_context(own_screen())
        hive = stack.enter_context(local_hive(folder))
        hive.start_master()
        hive.launch({"fleet": "lab", "world": "lab", "rviz": "false", "gui": "false", "rtf": "1"})
        application = QApplication(["take_pictures"])
        desk = Desk(RosDeskLink("take_pictures", ["take_pictures"]))
        settings = QSettings(str(folder / "settings"), QSettings.IniFormat)
        studio = Studio(application, FleetWindow(desk, settings), images)
        desk.start()
        studio.window.resize(*SIZE)
        studio.window.show()
        studio.wait_until(lambda: len(desk.hive.robots) == 4)  # noqa: PLR2004  (the lab's fleet)
        stack.enter_context(_running(["hive", "run", SCENARIO], stdout=subprocess.DEVNULL))
        stack.enter_context(_running(["rosrun", "fleet_manager", "task_markers"]))
        studio.wait_until(lambda: _at_work(desk))
        _picture_windows(studio, desk)
        _picture_rviz(studio, stack)
        os.kill(hive.process_of("/blackboard"), signal.SIGKILL)
        _picture_takeover(studio, desk)
        desk.stop()


def _at_work(desk: Desk) -> bool:
    """Return whether tasks in several states and moving robots can be seen."""
    states = [row.record.state for row in desk.hive.tasks.values()]
    return states.count(TaskState.DONE) > 1 and states.count(TaskState.STARTED) > 2  # noqa: PLR2004


def _picture_windows(studio: Studio[FleetWindow], desk: Desk) -> None:
    window = studio.window
    assert window.entry  # noqa: S101  (it was made with one)
    entry = window.entry
    entry.id_edit.setText("visit-1")  # none that the scenario has
    entry.goal_editors["A"].x_edit.setText("3.5")
    entry.goal_editors["A"].y_edit.setText("4.2")
    entry.send()
    studio.take(window, "fleet_manager")
    assert window.map  # noqa: S101  (it comes with the entry)
    assert window.view  # noqa: S101  (it was made with one)
    window.map.parentWidget().raise_()
    studio.take(window, "map")
    window.view.parentWidget().raise_()
    entry.type_box.setCurrentIndex(entry.type_box.findData(TaskType.GAB))
    entry.payload_edit.setText("heavy")
    entry.goal_editors["A"].x_edit.setText("4.5")
    entry.goal_editors["A"].y_edit.setText("300")
    entry.send()
    studio.take(window.entry, "task_entry_mistakes")
    entry.clear()
    window.appear(Appearance.DARK)
    studio.take(window, "fleet_manager_dark")
    window.appear(Appearance.LIGHT)
    # What the leader has planned together is not heard, but read from the files of the members.
    open_tasks = [name for name, row in desk.hive.tasks.items() if row.is_open]
    shown = max(open_tasks, key=lambda name: len(desk.hive.bid_book.bids(name)))
    details = TaskDetails(desk, shown, window)
    details.show()
    studio.take(details, "task_details")
    details.close()
    window.hide()


def _picture_rviz(studio: Studio[FleetWindow], stack: ExitStack) -> None:
    software = os.environ | {"LIBGL_ALWAYS_SOFTWARE": "1"}
    config = package_folder("simenv") / "rviz" / "hive.rviz"
    command = ["rosrun", "simenv", "rviz", f"_config:={config}"]
    quiet = subprocess.DEVNULL
    stack.enter_context(_running(command, env=software, stdout=quiet, stderr=quiet))
    studio.wait(RVIZ)
    studio.take_screen("rviz")


def _picture_takeover(studio: Studio[FleetWindow], desk: Desk) -> None:
    """Show who carries the blackboard after the leader was killed."""
    window = studio.window
    window.show()
    studio.wait_until(lambda: desk.hive.leadership.epoch > 1)
    studio.wait(5.0)
    studio.take(window.view, "takeover")
    window.hide()


if __name__ == "__main__":
    main()
