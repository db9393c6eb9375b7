# SPDX-License-Identifier: BSD-3-Clause
"""Command lines with odd words end with an exit code and a line, never with a traceback."""

from __future__ import annotations

import contextlib
from random import Random

import pytest

from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import run
from fleet_manager.testing import FakeHive, FakeLink

LINES = (
    "add GAB --goal 3,4 --goal 8,2,0.5 --priority 5 --payload 20 --id T1",
    "add GA --goal 1,2 --wait --timeout 3",
    "cancel T1",
    "why T1 --all --json",
    "replay T1 --journals journals",
    "recover --drop T1 --journals journals",
    "tasks --all --json",
    "robots --json",
    "traffic --json",
    "zone close aisle",
    "zone open aisle",
    "learned robot1 --json",
    "learned robot1 --forget --yes",
    "run smoke --wait --timeout 3",
    "load --at-once 2 --per-hour 60 --minutes 1 --mix GA=1,GPA=2 --seed 3",
    "world check lab",
    "world draw lab out --resolution 0.1 --format png",
    "fault freeze robot1 --off",
    "fault slip robot1 0.5",
    "fault pick robot1 2",
    "fault block box --area 1,1,2,2",
    "fault battery robot1 0.2",
)

ODD = (
    *("", " ", "-", "--", "---", "=", ",", ",,", "1,", "1,2,3,4", "nan,nan", "inf,0", "1e308,1"),
    *("nan", "inf", "-inf", "1e400", "1e308", "-1", "0", "1e-320", "9" * 400, "0x10", "1_000"),
    *("x" * 65, "x" * 5000, "a b", "..", "/", "/dev/null", "/proc/self/mem", "Zürich", "\x1b[31m"),
    *("--id", "--goal", "--help", "-h", "--id=", "--json=1", "GA=nan", "GA=1e308,GAB=1e308", "=1"),
    *("T\x00", "\ud800", "%s", "{}", "*", "$HOME", "~", "GPAB", "robot99"),
)

CODES = range(7)
WORDS = 1500


@pytest.mark.parametrize("seed", range(2))
def test_odd_words_never_show_a_traceback(seed, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    random = Random(seed)
    refused = 0
    for _ in range(WORDS):
        words = random.choice(LINES).split()
        for _ in range(random.choice((1, 1, 2))):
            at = random.randrange(len(words))
            words[at : at + random.choice((0, 1))] = [random.choice(ODD)]
        link = FakeLink()
        FakeHive(link)
        try:
            code = run(CliContext(lambda _record, link=link: contextlib.nullcontext(link)), words)
        except Exception as error:
            raise AssertionError(f"hive {words}") from error
        _, err = capsys.readouterr()
        refused += code == 2
        assert code in CODES, words
        assert code == 0 or err.count("\n") <= 12, words
    assert refused > WORDS / 2
