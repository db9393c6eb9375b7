# SPDX-License-Identifier: BSD-3-Clause
"""A node ends on Ctrl-C, whatever its main thread does at that moment."""

import ast
import contextlib
import os
import subprocess
import sys
import xmlrpc.client
from pathlib import Path

import pytest

pytest.importorskip("rospy", reason="nodes need ROS")

SOURCES = Path(__file__).resolve().parents[4] / "src"

PROGRAM = """
import os, signal, threading
import rospy
from hive_common.ros.signals import init_node

lock, is_shut_down = threading.Lock(), threading.Event()

def shut_down(_reason):
    with lock:  # as rospy's connection to the master has one
        is_shut_down.set()

rospy.signal_shutdown = shut_down
rospy.init_node = lambda name, **how: print(name, how)
rospy.get_param_cached = lambda *_: None
init_node("robot")
with lock:
    os.kill(os.getpid(), signal.{signal})
is_shut_down.wait()
print("shut down")
"""


@pytest.mark.parametrize("signal", ["SIGINT", "SIGTERM"])
def test_a_node_whose_main_thread_talks_to_the_master_is_shut_down_all_the_same(signal):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(signal=signal)],
        capture_output=True,
        text=True,
        check=True,
    )

    assert done.stdout.splitlines() == [
        "robot {'anonymous': False, 'disable_signals': True}",
        "shut down",
    ]


ENDS = """
import rospy
from hive_common.ros.signals import init_node

rospy.init_node = lambda *_, **__: None
rospy.get_param_cached = lambda *_: None
init_node("robot")
rospy.is_shutdown = lambda: {state!r} == "shut down"
rospy.core.is_shutdown_requested = lambda: {state!r} == "asked to"
def work():
    raise rospy.ROSException("publish() to a closed topic")
{how}
"""

HOW = {
    "the main thread": "work()",
    "another thread": "import threading; threading.Thread(target=work).start()",
}


@pytest.mark.parametrize("state", ["works", "asked to", "shut down"])
@pytest.mark.parametrize("thread", HOW)
def test_what_a_thread_meets_in_the_shutdown_shows_no_traceback(thread, state):
    done = subprocess.run(
        [sys.executable, "-c", ENDS.format(state=state, how=HOW[thread])],
        capture_output=True,
        text=True,
        check=False,
    )

    assert ("closed topic" in done.stderr) is (state == "works")


MASTER = """
import signal
from rosmaster.master import Master

master = Master(0)
master.start()
print(master.uri, flush=True)
signal.pause()
"""

LOGS_LATE = """
import sys
import rospy
from hive_common.ros.signals import init_node

init_node("robot")
for line in ("ready", "logged"):
    print(line, flush=True)
    sys.stdin.readline()
    rospy.logwarn("late")
"""


@contextlib.contextmanager
def running(program, **environment):
    """Run a program and talk to it; kill it afterwards."""
    pipe = subprocess.PIPE
    words, environment = [sys.executable, "-c", program], os.environ | environment
    with subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True, env=environment) as process:
        try:
            yield process
        finally:
            process.kill()


def test_a_node_that_first_logs_when_another_has_its_name_does_not_take_it_back(tmp_path):
    successor = "http://127.0.0.1:1/"
    with running(MASTER) as master:
        uri = master.stdout.readline().strip()
        environment = {"ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1", "ROS_HOME": str(tmp_path)}
        with running(LOGS_LATE, **environment) as node:
            assert node.stdout.readline() == "ready\n"
            with xmlrpc.client.ServerProxy(uri) as asked:
                asked.registerPublisher("/robot", "/x", "std_msgs/String", successor)
                print(file=node.stdin, flush=True)
                assert node.stdout.readline() == "logged\n"

                assert asked.lookupNode("/test", "/robot")[2] == successor


def test_no_node_leaves_signals_to_rospy():
    calls = [
        (path, call)
        for path in SOURCES.glob("*/src/**/*.py")
        for call in ast.walk(ast.parse(path.read_text()))
        if isinstance(call, ast.Call) and ast.unparse(call.func) == "rospy.init_node"
    ]
    left = [
        f"{path.relative_to(SOURCES)}:{call.lineno}"
        for path, call in calls
        if not any(each.arg == "disable_signals" for each in call.keywords)
    ]

    assert calls
    assert left == []
