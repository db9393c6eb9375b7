# SPDX-License-Identifier: BSD-3-Clause
"""Lets pytest collect and run `*.test` files, the launch files with `<test>` tags of rostest.

Each file is one test item. It runs under `rostest`, which starts a master on a free port of its
own, the nodes of the file, and then its test nodes one after the other. The test nodes are
`nodes/pytest_node`, so what they check is written as pytest functions too (folder `cases/`).

When it fails, the report shows the failed cases, the end of what rostest printed and the end of
every node's log. Programs that outlive their file are ended, and count as a failure.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import TYPE_CHECKING

import psutil
import pytest

from hive_lab.runner import limits
from hive_lab.runner.turns import turn

if TYPE_CHECKING:
    from collections.abc import Iterator

HERE = Path(__file__).resolve().parent
collect_ignore = ["cases"]
"""They run under rostest only, and share modules of that folder."""
PACKAGE = "hive_tests"
"""What package.xml calls this folder."""
BUSY = (
    *("traffic", "plan_failover", "plan_tasks", "plan_robots", "interfaces", "plan_start"),
    *("your_site", "sockets", "mapping", "unknown_agv", "shared_processes", "without_simulator"),
)
"""Files in which a whole fleet drives or starts, those that take longest first."""
ALONE = ("launched_machines",)
"""Files that need all processors; they begin, and no other file runs beside them."""
START_AND_STOP = 45.0
"""Time that roslaunch may take around a test node [s]."""
TIME_TO_STOP = 60.0
"""roslaunch gives its nodes 15 s after SIGINT and 2 s after SIGTERM [s]."""
TIME_TO_END = 20.0
"""What is just ending when rostest has ended may take that long on a busy machine [s]."""


class RosTestError(Exception):
    """A `.test` file did not pass; the text is the whole report."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let the results be kept."""
    parser.addoption(
        "--results",
        metavar="FOLDER",
        type=Path,
        help="keep the JUnit results of the cases of `.test` files in this folder",
    )


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Take `*.test` files as tests."""
    if file_path.suffix == ".test":
        return RosTestFile.from_parent(parent, path=file_path)
    return None


@pytest.hookimpl(tryfirst=True)  # before pytest-xdist hands tests out in this order
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with files on real ROS, and let those that work and those that wait take turns."""
    files = [item for item in items if isinstance(item, RosTestItem)]
    order = {item.name: place for place, item in enumerate(_in_turns(files))}
    items.sort(key=lambda item: order.get(item.name, len(order)))


def _in_turns(files: list[RosTestItem]) -> Iterator[RosTestItem]:
    """Yield those that run alone, then in turns a busy file and two that mostly wait."""
    yield from (f for f in files if f.name in ALONE)
    busy = sorted((f for f in files if f.name in BUSY), key=lambda f: BUSY.index(f.name))
    waiting = [f for f in files if f.name not in (*BUSY, *ALONE)]
    for number, file in enumerate(busy):
        yield file
        yield from waiting[2 * number : 2 * number + 2]
    yield from waiting[2 * len(busy) :]


class RosTestFile(pytest.File):
    """A `.test` file."""

    def collect(self) -> Iterator[pytest.Item]:
        """Yield the one item that the file is."""
        yield RosTestItem.from_parent(self, name=self.path.stem)


class RosTestItem(pytest.Item):
    """The run of one `.test` file."""

    def __init__(self, **kwargs: object) -> None:
        super().__init__(**kwargs)
        tests = list(_xml(self.path).iter("test"))
        self.names = [test.get("test-name", "") for test in tests]
        """The test nodes, as the file calls them."""
        self.time_limit = limits.FILE + START_AND_STOP
        """How long rostest may take in all [s]."""
        longest = self.time_limit + TIME_TO_STOP + 15
        self.add_marker(pytest.mark.timeout(3 * longest))  # it may wait for two others, see `turn`

    def runtest(self) -> None:
        """Run the file under rostest and look at what it says and leaves.

        Raises:
            RosTestError: A case failed, the time was up, or a program was left running.
        """
        if not shutil.which("rostest") or "devel" not in os.environ.get("CMAKE_PREFIX_PATH", ""):
            pytest.fail(
                "needs the environment of the workspace: ./hive test rostest", pytrace=False
            )
        with turn(Path(tempfile.gettempdir()), alone=self.name in ALONE):
            self._run()

    def _run(self) -> None:
        ros_home = Path(tempfile.mkdtemp(prefix=f"rostest-{self.name}-"))
        output = ros_home / "rostest.log"
        complaints = []
        with output.open("w") as log:
            rostest = subprocess.Popen(
                ["rostest", "--pkgdir", str(HERE), "--package", PACKAGE, str(self.path)],
                env=_environment(ros_home),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            try:
                if rostest.wait(self.time_limit) != 0:
                    complaints += _failed_cases(ros_home) or ["rostest failed, though no case did"]
                complaints += [
                    f"{name}: ran no case" for name in self.names if not _ran(ros_home, name)
                ]
            except subprocess.TimeoutExpired:
                complaints.append(f"still running after {self.time_limit:g} s")
            finally:
                _stop(rostest)
                complaints += [f"left running: {name}" for name in _end_leftovers(ros_home)]
                self._keep_results(ros_home)
        if complaints:
            raise RosTestError("\n\n".join([*complaints, *_logs(ros_home)]))
        shutil.rmtree(ros_home)

    def _keep_results(self, ros_home: Path) -> None:
        folder = self.config.getoption("--results", default=None)
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            for name in self.names:
                for file in (ros_home / "results").rglob(f"rosunit-{name}.xml"):
                    shutil.copy(file, folder / f"{name}.xml")

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException]) -> object:
        """Show the report alone; where in this file it was raised helps nobody."""
        if isinstance(excinfo.value, RosTestError):
            return str(excinfo.value)
        return super().repr_failure(excinfo)

    def reportinfo(self) -> tuple[Path, int, str]:
        """Say which file it is."""
        return self.path, 0, f"rostest {self.name}"


def _environment(ros_home: Path) -> dict[str, str]:
    """Return this process's environment with logs and results in `ros_home`, and no master."""
    environment = {key: value for key, value in os.environ.items() if key != "ROS_MASTER_URI"}
    packages = f"{HERE}:{environment.get('ROS_PACKAGE_PATH', '')}"
    breaks = environment.pop("HIVE_BREAKS_PATH", "")  # see try_breaks.py
    return environment | {
        "PYTHONPATH": ":".join(filter(None, [breaks, environment.get("PYTHONPATH", "")])),
        "ROS_HOME": str(ros_home),
        "ROS_LOG_DIR": str(ros_home / "log"),
        "ROS_TEST_RESULTS_DIR": str(ros_home / "results"),
        "ROS_PACKAGE_PATH": packages,  # where rostest finds the test nodes
        "ROS_IP": "127.0.0.1",
        "HIVE_TIME_LIMIT": f"{limits.FILE:g}",  # of a test node
    }


def _xml(path: Path) -> ET.Element:
    return ET.parse(path).getroot()  # noqa: S314  (our own launch files and results)


def _ran(ros_home: Path, name: str) -> bool:
    """Say whether the test node left at least one case; rostest itself is content with none."""
    files = (ros_home / "results").rglob(f"rosunit-{name}.xml")
    return any(True for file in files for _ in _xml(file).iter("testcase"))


def _failed_cases(ros_home: Path) -> list[str]:
    """Return name and text of each case that the JUnit files call failed."""
    failed = []
    for file in sorted((ros_home / "results").rglob("*.xml")):
        for case in _xml(file).iter("testcase"):
            for problem in [*case.findall("failure"), *case.findall("error")]:
                text = (problem.text or problem.get("message") or "").strip()
                failed.append(f"{case.get('name')}:\n{text}")
    return failed


def _stop(rostest: subprocess.Popen[bytes]) -> None:
    """End rostest as Ctrl-C would, so that it ends its nodes; by force when it does not."""
    if rostest.poll() is None:
        rostest.send_signal(signal.SIGINT)
        try:
            rostest.wait(TIME_TO_STOP)
        except subprocess.TimeoutExpired:
            rostest.kill()
            rostest.wait()


def _end_leftovers(ros_home: Path) -> list[str]:
    """Kill every process that was started for this run and does not end; return their commands."""
    own = [
        process
        for process in psutil.process_iter(["environ", "cmdline"])
        if (process.info["environ"] or {}).get("ROS_HOME") == str(ros_home)
    ]
    ended = []
    for process in psutil.wait_procs(own, timeout=TIME_TO_END)[1]:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.kill()
            ended.append(" ".join(process.info["cmdline"]))
    return ended


def _logs(ros_home: Path) -> list[str]:
    """Return the last lines of what rostest printed and of every node's log, under their names."""
    nodes = (ros_home / "log").rglob("*.log")
    files = [file for file in nodes if not file.name.startswith(("master", "ros"))]
    return [
        f"--- {file}\n" + "\n".join(file.read_text(errors="replace").splitlines()[-25:])
        for file in [ros_home / "rostest.log", *sorted(files)]
        if file.stat().st_size
    ]
