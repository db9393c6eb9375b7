# SPDX-License-Identifier: BSD-3-Clause
"""`hive router`, as an operator types it."""

import contextlib
import queue
import threading
import time

import pytest

from blackboard.zenoh.access import Role
from blackboard.zenoh.opening import open_session
from blackboard.zenoh.session import Endpoints, Mode, session_config
from fleet_manager.certs.site import Site
from fleet_manager.cli import router as router_module
from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import run
from vda5050.mqtt.local_broker import free_port

WITHIN = 20.0  # a busy machine needs no longer [s]


class Hall:
    """A fleet file with a router, and what `hive router` does with it."""

    def __init__(self, folder, monkeypatch, capsys):
        self.folder, self.file, self.port = folder, folder / "fleet.yaml", free_port()
        self.while_it_runs = lambda: None
        self._capsys = capsys
        self.lines = []
        monkeypatch.setattr(router_module, "wait_for_signal", self._wait)
        self.write()

    def write(self, more=""):
        self.file.write_text(
            f"zenoh:\n  routers: [{{name: north, address: '127.0.0.1:{self.port}'}}]\n{more}"
            "robots: [{name: amy, model: mir100, pose: [1, 2, 0]}]\n",
            encoding="utf-8",
        )

    def run(self, *words):
        words = words or ("router", "north", "--fleet", str(self.file))
        code = run(CliContext(lambda _: contextlib.nullcontext(), lambda: self.folder), words)
        captured = self._capsys.readouterr()
        return code, "".join(self.lines) + captured.out, captured.err

    def client(self, certificates=None):
        """Open a session that connects to the router."""
        protocol = "tls" if certificates else "tcp"
        ends = Endpoints(connect=(f"{protocol}/127.0.0.1:{self.port}",))
        return open_session(session_config(ends, certificates, Mode.CLIENT))

    def until_it_says(self, text):
        """Wait until the router has printed a text."""
        end = time.monotonic() + WITHIN
        while text not in "".join(self.lines):
            assert time.monotonic() < end, self.lines
            self.lines.append(self._capsys.readouterr().out)

    def _wait(self):
        # A session that is opened in the thread of the router would wait for it.
        failed = queue.Queue()

        def use():
            try:
                self.while_it_runs()
                failed.put(None)
            except BaseException as error:
                failed.put(error)
                raise

        threading.Thread(target=use).start()
        if error := failed.get(timeout=2 * WITHIN):
            raise error


@pytest.fixture
def hall(tmp_path, monkeypatch, capsys):
    return Hall(tmp_path, monkeypatch, capsys)


def test_two_clients_of_a_router_hear_each_other_and_it_says_where_it_listens(hall):
    heard = queue.Queue()

    def talk():
        with hall.client() as amy, hall.client() as bob:
            bob.declare_subscriber("hive/hive/**", heard.put)
            heard_by = amy.declare_publisher("hive/hive/robot_status/amy")
            changed = queue.Queue()
            heard_by.declare_matching_listener(changed.put)
            while not heard_by.matching_status.matching:
                changed.get(timeout=WITHIN)
            heard_by.put(b"hello")
            assert heard.get(timeout=WITHIN).payload.to_string() == "hello"

    hall.while_it_runs = talk
    code, out, err = hall.run()

    assert (code, err) == (0, "")
    assert f"north is a router and listens at tcp/127.0.0.1:{hall.port}\n" in out


def test_a_router_says_who_comes_and_goes_by_the_name_of_the_certificate(hall, tmp_path):
    site = Site.new(tmp_path / "certs")
    site.add("north", Role.ROUTER)
    site.add("amy", Role.ROBOT)
    hall.write(f"  certificates: {site.folder}/members\n")

    def come_and_go():
        with hall.client(site.folder_of("amy")):
            hall.until_it_says("amy is connected\n")
        hall.until_it_says("amy is gone\n")

    hall.while_it_runs = come_and_go
    code, _, err = hall.run()

    assert (code, err) == (0, "")


def test_a_router_s_machine_needs_no_model_of_a_robot(hall):
    text = hall.file.read_text(encoding="utf-8")
    hall.file.write_text(text.replace("mir100", "/nowhere/own.yaml"), encoding="utf-8")
    code, out, err = hall.run()

    assert (code, err) == (0, "")
    assert "listens at" in out


def test_a_mistake_in_the_connections_is_named_in_its_line(hall):
    hall.write("  operators: [north]\n")
    code, _, err = hall.run()

    assert code == 2
    assert "fleet.yaml:2: zenoh.routers[0].name: 'north' is the name of another one" in err


def test_a_router_stops_listening_when_it_ends(hall):
    hall.run()
    code, out, err = hall.run()

    assert (code, err) == (0, "")
    assert "listens at" in out


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["router", "west", "--fleet", "FILE"], "fleet.yaml has no router 'west'; allowed: north"),
        (["router", "north", "--fleet", "mixed"], "no router 'north'; allowed: none; name it at"),
        (["router", "north"], "Missing option '--fleet'"),
        (["router", "north", "--fleet", "nowhere"], "nowhere"),
    ],
)
def test_a_mistake_is_one_line_that_says_what_is_allowed(hall, words, told):
    code, _, err = hall.run(*[str(hall.file) if word == "FILE" else word for word in words])

    assert code == 2
    assert told in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "role", "told"),
    [
        ("north", Role.ROBOT, "has the certificate of a robot; allowed: that of a router"),
        ("south", Role.ROUTER, "own.json cannot be used"),
    ],
)
def test_only_the_certificate_of_a_router_is_taken(hall, tmp_path, name, role, told):
    site = Site.new(tmp_path / "certs")
    site.add(name, role)
    hall.write(f"  certificates: {site.folder}/members\n")

    code, out, err = hall.run()

    assert (code, out) == (2, "")
    assert told in err


def test_a_port_that_is_taken_is_named(hall):
    codes = []
    hall.while_it_runs = lambda: codes.append(
        run(
            CliContext(lambda _: contextlib.nullcontext(), lambda: hall.folder),
            ["router", "north", "--fleet", str(hall.file)],
        )
    )
    _, _, err = hall.run()

    assert codes == [2]
    assert f"Zenoh cannot start (it is to listen at: tcp/127.0.0.1:{hall.port})" in err
