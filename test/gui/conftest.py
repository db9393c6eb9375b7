# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the windows need: a screen, a running hive, and a person's hands.

The screen is an X server of the tests' own, so that nothing opens on the developer's desktop. The
hive is the real one: a ROS master, the simulator, the blackboard and the robots of the lab.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
import time
from itertools import product
from pathlib import Path

import pytest
import rospy
import yaml
from blackboard.msg import RobotStatus
from python_qt_binding.QtCore import QEvent, QEventLoop, QSettings, Qt
from python_qt_binding.QtTest import QTest
from python_qt_binding.QtWidgets import QApplication
from std_msgs.msg import Float64

from blackboard.consensus.messages import Heartbeat
from fleet_manager.client.reports import HiveMessage
from fleet_manager.demo.local_hive import local_hive
from fleet_manager.gui.desk import Desk
from fleet_manager.gui.fleet_window import FleetWindow
from fleet_manager.ros.desk_link import RosDeskLink
from hive_common.resources import package_folder
from hive_lab.live.connections import is_heard
from hive_lab.runner.limits import PATIENCE

HERE = Path(__file__).parent
SCREEN = "1366x768x24"
BIDS_WITHIN = 60.0
"""Longest auction [s]: nobody who is slow on a busy machine is left out."""

LAB_ROBOTS = tuple(f"/robot{number}/robot" for number in range(1, 5))
"""The nodes of the lab's robots."""

FAST, SLOW = 3.0, 0.1
"""Simulated time per real time, and where robots must not get far."""

_RUNNING = contextlib.ExitStack()
"""The hive, and the window on it."""


@pytest.hookimpl(trylast=True)  # after the windows of the last test are closed
def pytest_runtest_teardown(nextitem):
    """End the hive after the last of these tests: its robots would slow down those that follow."""
    if nextitem is None or nextitem.path.parent != HERE:
        _RUNNING.close()


@pytest.hookimpl(tryfirst=True)  # before pytest-xdist looks for the groups
def pytest_collection_modifyitems(items):
    """Keep these tests in one process: they share a screen and a hive."""
    for item in items:
        if item.path.parent == HERE:
            item.add_marker(pytest.mark.xdist_group("gui"))


@pytest.fixture(scope="session")
def screen():
    """Run an X server, and return its display."""
    read, write = os.pipe()
    command = ["Xvfb", "-displayfd", str(write), "-screen", "0", SCREEN, "-nolisten", "tcp"]
    server = subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as number:
        display = f":{number.readline().strip()}"
    assert display != ":", "Xvfb did not come up; install the package xvfb"
    os.environ["DISPLAY"] = display
    yield display
    server.terminate()
    server.wait()


@pytest.fixture(scope="session")
def application(screen):  # noqa: ARG001  (it must be there first)
    os.environ.pop("QT_QPA_PLATFORM", None)
    return QApplication(["test_gui"])


@pytest.fixture(scope="session")
def hive(tmp_path_factory):
    """Run the lab's fleet, without windows, at three times the real time."""
    folder = tmp_path_factory.mktemp("hive")
    lab = package_folder("fleet_manager") / "fleets" / "lab.yaml"
    content = yaml.safe_load(lab.read_text(encoding="utf-8")) | {"bid_timeout": BIDS_WITHIN}
    fleet = folder / "lab.yaml"
    fleet.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    hive = _RUNNING.enter_context(local_hive(folder))
    hive.start_master()
    shown = {"rviz": "false", "gui": "false"}
    # Tests freeze and kill nodes by name.
    what = {"fleet": str(fleet), "world": "lab", "rtf": f"{FAST:g}", "processes": "each"}
    hive.launch(what | shown)
    return hive


@pytest.fixture(scope="session")
def hive_window(application, hive, tmp_path_factory):
    """Open the fleet window on the running hive, and wait until its robots are there."""
    desk = Desk(RosDeskLink("test_gui", ["test_gui"]))
    settings = QSettings(str(tmp_path_factory.mktemp("gui") / "settings"), QSettings.IniFormat)
    window = FleetWindow(desk, settings)
    desk.start()
    window.show()
    person = Person(application)
    person.wait_until(lambda: window.isActiveWindow() or window.activateWindow())

    def all_here():
        hive.check()
        return window.view.robot_rows.rowCount() == 4

    person.wait_until(all_here)
    # What is said before a connection stands is lost, a robot that has not joined the hive yet
    # answers no call, and an auction would wait for either.
    hives = {}
    statuses = rospy.Subscriber(
        "/robot_status", RobotStatus, lambda told: hives.update({told.robot_id: told.hive})
    )
    person.wait_until(lambda: len(hives) == len(LAB_ROBOTS) and all(hives.values()))
    statuses.unregister()
    members = ("/blackboard", *LAB_ROBOTS)
    links = (
        *product(members, ("/task_bc", "/task_assign"), LAB_ROBOTS),
        *product(LAB_ROBOTS, ("/task_cost", "/robot_status", "/task_state"), members),
        *product(members, ("/task_state", "/bb_sync"), [rospy.get_name()]),
        *product(LAB_ROBOTS, ["/task_cost"], [rospy.get_name()]),
    )
    for link in links:
        person.wait_until(lambda link=link: is_heard(*link))
    window.view.show_box.setCurrentText("all tasks")
    _RUNNING.callback(window.deleteLater)
    _RUNNING.callback(desk.stop)
    return window


@pytest.fixture
def person(application):
    return Person(application)


@pytest.fixture
def slowly(person):
    """Return a context in which simulated time passes slowly, for what is done to a robot at work.

    It needs `hive_window`, which makes this process a node.
    """

    @contextlib.contextmanager
    def slowed():
        factor = rospy.Publisher("/simenv/rtf", Float64, queue_size=1)
        person.wait_until(factor.get_num_connections)
        factor.publish(SLOW)
        try:
            yield
        finally:
            factor.publish(FAST)

    return slowed


class FakeLink:
    """A hive that says what the test has it say, and keeps what it is sent."""

    def __init__(self):
        self.said = []
        self.sent = []
        self.time = 0.0
        self.beats = 0

    def start(self):
        pass

    def stop(self):
        pass

    def now(self):
        return self.time

    def drain(self, limit):
        """Give what was said, and a heartbeat, as from a hive that is there all the time."""
        self.beats += 1
        self.say(Heartbeat(1, "blackboard", "robot1", ("blackboard",), self.beats))
        facts, self.said = self.said[:limit], self.said[limit:]
        return facts

    def send(self, command):
        self.sent.append(command)

    def say(self, report):
        self.said.append(HiveMessage(report, self.time))


@pytest.fixture
def link():
    return FakeLink()


@pytest.fixture
def window(person, link, tmp_path):
    desk = Desk(link)
    window = FleetWindow(desk, QSettings(str(tmp_path / "settings"), QSettings.IniFormat))
    desk.start()
    window.show()
    # activateWindow returns None: it is asked for again until the screen has done it.
    person.wait_until(lambda: window.isActiveWindow() or window.activateWindow())
    person.wait_until(lambda: "Leader: blackboard" in window.view.authority_label.text())
    yield window
    desk.stop()
    window.hide()
    window.deleteLater()
    person.look()


class Person:
    """Keys, mouse and eyes; nothing else touches the windows.

    Args:
        application: Whose windows are used.

    Attributes:
        looks: Whether the windows do what is due now.
        connections: What the event loop has connected to: it may have to wait for that.
    """

    looks = False
    connections = ()

    def __init__(self, application):
        self._application = application

    def look(self):
        """Let the windows do what is due."""
        Person.looks = True
        try:
            self._application.processEvents(QEventLoop.AllEvents, 20)
            self._application.sendPostedEvents(None, QEvent.DeferredDelete)
        finally:
            Person.looks = False

    def wait_until(self, seen, within=PATIENCE, telling=lambda: ""):
        """Look until something is seen.

        Args:
            seen: Whether it is.
            within: How long it may take [s].
            telling: What a failure says besides.
        """
        end = time.monotonic() + within
        while not seen():
            assert time.monotonic() < end, f"not seen within {within} s {telling()}"
            self.look()

    def click(self, widget, position=None):
        if position is None:
            QTest.mouseClick(widget, Qt.LeftButton)
        else:
            QTest.mouseClick(widget, Qt.LeftButton, Qt.NoModifier, position)
        self.look()

    def press(self, key, widget=None):
        widget = widget or self._application.focusWidget()
        assert widget is not None, "no window has the focus; activate one first"  # Qt would abort
        QTest.keyClick(widget, key)
        self.look()

    def answer(self, text):
        """Press the button of the question that is asked, by a part of its text.

        Returns:
            What the question says the answer brings with it.
        """
        self.wait_until(self._application.activeModalWidget)
        box = self._application.activeModalWidget()
        (button,) = (each for each in box.buttons() if text in each.text())
        told, window = box.informativeText(), box.parentWidget().window()
        self.click(button)
        self.wait_until(lambda: not self._application.activeModalWidget())
        # A window manager gives the focus back; this screen has none.
        self.wait_until(lambda: window.isActiveWindow() or window.activateWindow())
        return told

    def reach(self, widget):
        """Go to a field with the tab key alone."""
        for _stop in range(60):
            if self._application.focusWidget() is widget:
                return
            self.press(Qt.Key_Tab)
        raise AssertionError(f"{widget.objectName()} is not reached with the tab key")

    def write(self, edit, text):
        """Put a text into a field, as a person does: go there, select all, type."""
        self.reach(edit)
        QTest.keyClick(edit, Qt.Key_A, Qt.ControlModifier)
        QTest.keyClick(edit, Qt.Key_Delete)
        if text.isascii():
            QTest.keyClicks(edit, text)
        else:  # no key of a keyboard; a person pastes it
            self._application.clipboard().setText(text)
            QTest.keyClick(edit, Qt.Key_V, Qt.ControlModifier)
        self.look()

    def choose(self, box, number):
        """Choose an entry by the arrow keys."""
        self.reach(box)
        self.press(Qt.Key_Home)
        for _step in range(number):
            self.press(Qt.Key_Down)

    def select_row(self, table, text):
        """Click on the row of a table whose first cell has this text."""
        model = table.model()
        rows = range(model.rowCount())
        row = next(row for row in rows if model.index(row, 0).data().strip() == text)
        table.scrollTo(model.index(row, 0))
        self.look()
        self.click(table.viewport(), table.visualRect(model.index(row, 0)).center())

    def give_task(self, entry, kind, *goals, payload="0", priority="0"):
        """Fill the form in, send it with Enter, and return the task's id.

        Args:
            entry: The task entry.
            kind: Of the task.
            *goals: x and y of each goal, as typed.
            payload: As typed [kg].
            priority: As typed.
        """
        entry.id_edit.setFocus()
        self.press(Qt.Key_Escape)
        task_id = entry.id_edit.text()
        self.choose(entry.type_box, int(kind))
        self.write(entry.priority_edit, priority)
        self.write(entry.payload_edit, payload)
        for editor, (x, y) in zip(entry.goal_editors.values(), goals, strict=False):
            self.write(editor.x_edit, x)
            self.write(editor.y_edit, y)
        self.press(Qt.Key_Return)
        return task_id

    def state_of(self, view, task_id):
        """Return the state that the table shows for a task; None where it does not."""
        model = view.shown_tasks
        for row in range(model.rowCount()):
            if model.index(row, 0).data().strip() == task_id:
                return model.index(row, 1).data().split(" ", 1)[1]
        return None


def _note_connection(event, arguments):
    """Note what is connected to in the event loop."""
    main = threading.current_thread() is threading.main_thread()
    if event == "socket.connect" and Person.looks and main:
        Person.connections = (*Person.connections, arguments[1])


sys.addaudithook(_note_connection)
