# SPDX-License-Identifier: BSD-3-Clause
import os
import signal
import socket
import sys

import pytest

from fleet_manager.client.client import DEFAULT_URI
from fleet_manager.demo.local_hive import local_hive
from fleet_manager.demo.machine import reserved_port, screen_is_usable
from fleet_manager.demo.processes import ProcessGroup
from fleet_manager.errors import InputError, StartError
from hive_lab.bench.registry import BENCHES, BenchResult, as_json
from hive_lab.bench.usage import Usage, shares, usage_of

DEAF_PARENT = """
import signal, subprocess, sys, time
signal.signal(signal.SIGINT, signal.SIG_IGN)
child = "import sys, time; open(sys.argv[1], 'w').write('up'); time.sleep(60)"
subprocess.Popen([sys.executable, "-c", child, sys.argv[1]], start_new_session=True).wait()
"""


@pytest.fixture(autouse=True)
def environment(monkeypatch, tmp_path):
    """Put back what `local_hive` changes in the environment; keep locks in the test's folder."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    for name in ("ROS_IP", "ROS_LOG_DIR", "ROS_HOSTNAME", "ROS_NAMESPACE"):
        monkeypatch.setenv(name, "before")
    monkeypatch.setenv("ROS_MASTER_URI", DEFAULT_URI)
    return monkeypatch


def test_two_reservations_at_a_time_never_share_a_port():
    ports = range(14310, 14330)

    with reserved_port(ports) as first, reserved_port(ports) as second:
        assert first != second


def test_a_port_that_somebody_listens_on_is_passed_over():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = other.getsockname()[1]

        with reserved_port(range(taken, taken + 10)) as port:
            assert port != taken


def test_it_is_said_when_every_port_is_taken():
    with (
        reserved_port(range(14340, 14341)),
        pytest.raises(StartError, match="no free port"),
        reserved_port(range(14340, 14341)),
    ):
        pass


def test_a_port_is_free_again_after_its_context():
    with reserved_port(range(14350, 14351)) as first:
        pass
    with reserved_port(range(14350, 14351)) as second:
        assert first == second


def test_the_end_reaches_grandchildren_in_sessions_of_their_own(tmp_path, monkeypatch):
    monkeypatch.setattr("fleet_manager.demo.processes._PATIENCE", 0.05)
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    group = ProcessGroup(tmp_path, os.environ)
    group.start("deaf", [sys.executable, "-c", DEAF_PARENT, str(fifo)])
    try:
        assert fifo.read_text(encoding="utf-8") == "up"
        assert len(group.members()) == 2
    finally:
        group.stop()

    assert group.members() == []


def test_ctrl_c_works_again_after_the_end(tmp_path):
    def handler(_number, _frame):
        pass

    before = signal.signal(signal.SIGINT, handler)
    try:
        ProcessGroup(tmp_path, os.environ).stop()

        assert signal.getsignal(signal.SIGINT) is handler
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_process_that_ends_by_itself_is_named_and_its_output_is_kept(tmp_path):
    group = ProcessGroup(tmp_path, os.environ)
    group.start("short", [sys.executable, "-c", "print('last words')"])
    while group.ended() is None:
        os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOWAIT)

    assert group.ended() == "short"
    assert group.log("short").read_text(encoding="utf-8") == "last words\n"
    group.stop()


def test_a_hive_gets_a_master_of_its_own_where_the_user_named_none(tmp_path):
    with local_hive(tmp_path) as hive:
        assert hive.uri.startswith("http://127.0.0.1:113")
        assert os.environ["ROS_MASTER_URI"] == hive.uri
        assert "ROS_HOSTNAME" not in os.environ


def test_a_hive_takes_the_master_that_the_user_named(tmp_path, environment):
    environment.setenv("ROS_MASTER_URI", "http://127.0.0.1:14360")

    with local_hive(tmp_path) as hive:
        assert hive.uri == "http://127.0.0.1:14360"


@pytest.mark.parametrize("uri", ["http://10.1.2.3:11311", "nonsense", "http://localhost:port"])
def test_a_master_elsewhere_or_nonsense_is_refused(tmp_path, environment, uri):
    environment.setenv("ROS_MASTER_URI", uri)

    with pytest.raises(InputError, match="ROS_MASTER_URI is"), local_hive(tmp_path):
        pass


@pytest.mark.parametrize("display", ["", ":4711", "nowhere.invalid:0"])
def test_a_display_that_leads_nowhere_is_not_usable(environment, display):
    environment.setenv("DISPLAY", display)

    assert not screen_is_usable()


def test_what_a_process_takes_is_read_from_proc():
    usage = usage_of([os.getpid(), 2**22 + 1])

    assert list(usage) == [os.getpid()]
    assert usage[os.getpid()].memory > 5e6
    assert usage[os.getpid()].cpu > 0


def test_a_node_is_called_by_its_ros_name_and_its_namespace(tmp_path):
    folder = tmp_path / "7"
    folder.mkdir()
    words = ["/usr/bin/python3", "/a/move_base", "__name:=move_base", "__log:=x", ""]
    (folder / "cmdline").write_text("\0".join(words), encoding="utf-8")
    (folder / "environ").write_text("A=1\0ROS_NAMESPACE=/robot1\0", encoding="utf-8")
    ticks = " ".join(["S", *["0"] * 10, "150", "50", *["0"] * 30])
    (folder / "stat").write_text(f"7 (a b) c) {ticks}", encoding="utf-8")
    (folder / "smaps_rollup").write_text("x [rollup]\nPss:   2000 kB\n", encoding="utf-8")

    usage = usage_of([7], proc=tmp_path)[7]

    assert usage.name == "robot1/move_base"
    assert usage.cpu == pytest.approx(200 / os.sysconf("SC_CLK_TCK"))
    assert usage.memory == 2000 * 1024


def test_shares_are_per_second_and_processes_of_one_name_are_added_up():
    before = {1: Usage("a", 10.0, 5), 2: Usage("b", 0.0, 5)}
    after = {1: Usage("a", 12.0, 7), 2: Usage("b", 5.0, 5), 3: Usage("a", 1.0, 3)}

    assert shares(before, after, 10.0) == {"b": (0.5, 5), "a": (pytest.approx(0.3), 10)}


def test_a_result_is_written_in_the_agreed_form():
    result = BenchResult({"cpu": 0.8, "memory": 1.6, "seconds": 60.0}, {"cpu": 1.0, "memory": 1.5})

    assert as_json("system", result, "a machine", "2026-01-02") == {
        "bench": "system",
        "machine": "a machine",
        "date": "2026-01-02",
        "figures": {"cpu": 0.8, "memory": 1.6, "seconds": 60.0},
        "aims": {"cpu": 1.0, "memory": 1.5},
        "met": {"cpu": True, "memory": False},
    }
    assert set(BENCHES) >= {
        "allocation",
        "faults",
        "flake",
        "gui",
        "localization",
        "plan",
        "system",
    }
