# SPDX-License-Identifier: BSD-3-Clause
"""Which commands reach a hive over Zenoh, and how a person says where it is."""

import contextlib

import click
import pytest
from click.shell_completion import ShellComplete

from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import hive, run
from fleet_manager.errors import InputError
from fleet_manager.testing import FakeHive, FakeLink

FLEET = "/etc/robo-hive/fleet.yaml"


class Terminal:
    """The command line with a fake hive on ROS, and another one over Zenoh.

    Attributes:
        asked: Where the one over Zenoh was looked for, as (ends, certificates).
    """

    def __init__(self, capsys):
        self.asked = []
        self._capsys = capsys
        self.near, self.far = FakeLink(), FakeLink()
        self._hives = [FakeHive(link) for link in (self.near, self.far)]
        self.begin()
        self.context = self._context(self.near, elsewhere=self._elsewhere)

    def begin(self):
        """Have both hives tell a new program how things stand."""
        for each in self._hives:
            each.start()

    def _context(self, link, **ports):
        return CliContext(lambda _record: contextlib.nullcontext(link), **ports)

    def _elsewhere(self, ends, certificates):
        self.asked.append((tuple(ends), certificates))
        if "bad" in ends:
            raise InputError("bad is no fleet")
        return self._context(self.far)

    def __call__(self, *words):
        """Run `hive` with words; return exit code, stdout, stderr."""
        code = run(self.context, list(words))
        out, err = self._capsys.readouterr()
        return code, out, err


@pytest.fixture
def terminal(capsys, monkeypatch):
    for name in ("HIVE_CONNECT", "HIVE_CERTIFICATES"):
        monkeypatch.delenv(name, raising=False)
    return Terminal(capsys)


def test_a_command_asks_the_hive_that_connect_names(terminal):
    code, _, _ = terminal("--connect", FLEET, "add", "GA", "--goal", "1,2", "--id", "T1")

    assert code == 0
    assert terminal.asked == [((FLEET,), "")]
    assert ([task.id for task in terminal.far.posted], terminal.near.posted) == (["T1"], [])


def test_without_connect_a_command_asks_the_hive_on_ros(terminal):
    terminal("add", "GA", "--goal", "1,2", "--id", "T1")

    assert terminal.asked == []
    assert len(terminal.near.posted) == 1


def test_several_endpoints_and_a_certificate_can_be_given(terminal):
    terminal("--connect", "tls/a:1", "--connect", "tls/b:1", "--certificates", "/c", "tasks")

    assert terminal.asked == [(("tls/a:1", "tls/b:1"), "/c")]


def test_the_environment_says_it_for_all_commands_that_it_concerns(terminal, monkeypatch):
    monkeypatch.setenv("HIVE_CONNECT", "tls/a:1 tls/b:1")
    monkeypatch.setenv("HIVE_CERTIFICATES", "/c")

    assert terminal("tasks")[0] == 0
    assert terminal("world", "--help")[0] == 0
    assert terminal.asked == [(("tls/a:1", "tls/b:1"), "/c")]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["--connect", FLEET, "demo"],
            "demo works on this machine; --connect is allowed with add",
        ),
        (["--connect", FLEET, "why", "T1"], "why works on this machine"),
        (["--connect", "bad", "tasks"], "bad is no fleet"),
        (["--certificates", "/c", "tasks"], "--certificates needs --connect"),
    ],
)
def test_what_cannot_be_is_one_line_and_exit_2(terminal, words, said):
    code, out, err = terminal(*words)

    assert (code, out, err.count("\n")) == (2, "", 1)
    assert said in err


def test_a_command_line_that_has_no_other_hive_says_so(capsys):
    code = run(CliContext(None), ["--connect", FLEET, "tasks"])

    assert code == 2
    assert "--connect is for a hive over Zenoh" in capsys.readouterr().err


def completions(terminal, *words):
    terminal.begin()
    complete = ShellComplete(hive, {"obj": terminal.context}, "hive", "_HIVE_COMPLETE")
    return [each.value for each in complete.get_completions(list(words), "")]


def test_tab_completion_asks_the_same_hive_as_the_command(terminal):
    terminal("--connect", FLEET, "add", "GA", "--goal", "1,2", "--id", "T7")

    assert completions(terminal, "--connect", FLEET, "cancel") == ["T7"]
    assert completions(terminal, "cancel") == []
    assert completions(terminal, "--connect", "bad", "cancel") == []


def test_each_command_that_may_connect_is_one(terminal):
    code, _, err = terminal("--connect", FLEET, "demo")
    allowed = err.rpartition("allowed with ")[2].partition(";")[0].split(", ")

    assert code == 2
    assert set(allowed) < set(hive.list_commands(click.Context(hive)))
