# SPDX-License-Identifier: BSD-3-Clause
import contextlib

import pytest

from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import run
from fleet_manager.testing import FakeHive, FakeLink


@pytest.fixture
def terminal(capsys):
    link = FakeLink()
    hive = FakeHive(link)

    def enter(*words):
        hive.start()
        code = run(CliContext(lambda _record: contextlib.nullcontext(link)), list(words))
        return code, *capsys.readouterr()

    enter.link = link
    return enter


def test_load_posts_as_many_random_tasks_of_the_wanted_types_as_it_is_told(terminal):
    code, out, _ = terminal("load", "--at-once", "5", "--minutes", "0", "--mix", "ga=1")

    assert code == 0
    assert [task.type.name for task in terminal.link.posted] == ["GA"] * 5
    assert len(out.splitlines()) == 5


def test_the_same_seed_posts_the_same_goals_under_new_ids(terminal):
    for _ in range(2):
        terminal("load", "--at-once", "3", "--minutes", "0", "--seed", "4")
    posted = terminal.link.posted

    assert [task.goals for task in posted[:3]] == [task.goals for task in posted[3:]]
    assert len({task.id for task in posted}) == 6


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "no task would arrive; set at_once, or per_hour and minutes"),
        (["--at-once", "1", "--mix", "GA"], "'GA' is not TYPE=WEIGHT"),
        (["--at-once", "1", "--mix", "FLY=1"], "a weight from 0 by type"),
        (["--at-once", "1", "--map", "moon"], "'moon': not known; allowed: lab, warehouse"),
    ],
)
def test_a_mistake_is_one_line_and_exit_2(terminal, words, said):
    code, _, err = terminal("load", *words)

    assert code == 2
    assert said in err
    assert err.count("\n") == 1
    assert terminal.link.posted == []
