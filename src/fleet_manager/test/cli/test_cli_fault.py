# SPDX-License-Identifier: BSD-3-Clause
"""The command `fault`, as far as it goes without ROS."""

from types import SimpleNamespace

import pytest

from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import run
from fleet_manager.testing import FakeLink
from simenv.faults import Fault


class Hive:
    """A context whose faults are written down in `calls`."""

    def __init__(self):
        self.calls = []
        link = SimpleNamespace(
            inject=lambda what: self.calls.append(what) or "done",
            drop_charge=lambda *words: self.calls.append(words) or "done",
            vanish=lambda robot, *, back: self.calls.append((robot, back)) or "done",
            kill_leader=lambda: self.calls.append("leader") or "done",
        )
        self.context = CliContext(lambda _record: FakeLink(), faults=lambda: link)


@pytest.fixture
def asked():
    return Hive()


@pytest.mark.parametrize(
    ("words", "call"),
    [
        ("freeze robot1", Fault("freeze", "robot1", 1.0)),
        ("freeze robot1 --off", Fault("freeze", "robot1", 0.0)),
        ("slip robot1 0.3", Fault("slip", "robot1", 0.3)),
        ("blind robot1", Fault("blind", "robot1", 1.0)),
        ("pick robot3 2", Fault("pick", "robot3", 2.0)),
        ("kill-leader", "leader"),
        ("block crate --area 1,2,3,4", Fault("block", "crate", 1.0, (1.0, 2.0, 3.0, 4.0))),
        ("block crate --off", Fault("block", "crate", 0.0)),
        ("battery robot1 0.1", ("robot1", 0.1)),
        ("vanish robot1", ("robot1", False)),
        ("vanish robot1 --off", ("robot1", True)),
    ],
)
def test_each_fault_is_asked_for_as_it_was_written(asked, words, call):
    assert run(asked.context, ["fault", *words.split()]) == 0
    assert asked.calls == [call]


@pytest.mark.parametrize(
    "words",
    ["slip robot1 2", "block crate", "block crate --area a,b,c,d", "battery robot1 -1", "x"],
)
def test_words_that_cannot_be_used_are_refused_in_one_line(asked, words, capsys):
    assert run(asked.context, ["fault", *words.split()]) == 2
    assert asked.calls == []
    assert capsys.readouterr().err.count("\n") == 1
