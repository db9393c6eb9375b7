# SPDX-License-Identifier: BSD-3-Clause
"""What a launch file has checked is started from a parameter; anything else is a mistake."""

import pytest

from fleet_manager.ros import launch_checked


@pytest.fixture
def start(monkeypatch):
    """Run the program with words where parameters are set; return what it starts."""

    def call(words, **parameters):
        started = []
        monkeypatch.setattr("sys.argv", ["launch_checked", *words])
        monkeypatch.setattr(launch_checked, "become_roslaunch", started.append)
        monkeypatch.setattr(launch_checked, "asked", lambda _, name: parameters.get(name[1:], ""))
        launch_checked.main()
        return started

    return call


def test_what_the_parameter_holds_is_started(start):
    words = ["checked", "__name:=launch_fleet"]

    assert start(words, checked="<launch/>") == ["<launch/>"]


def test_a_parameter_that_is_not_set_is_named_with_the_remedy(start):
    with pytest.raises(SystemExit, match=r"/checked holds no launch file.*launch_fleet FLEET"):
        start(["checked"])


@pytest.mark.parametrize("words", [[], ["--check"], ["one", "two"]])
def test_words_that_are_no_parameter_are_answered_with_the_usage(start, words):
    with pytest.raises(SystemExit, match="usage: launch_checked PARAMETER"):
        start(words)
