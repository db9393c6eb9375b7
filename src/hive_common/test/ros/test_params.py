# SPDX-License-Identifier: BSD-3-Clause
"""Parameters that are missing, of the wrong type, not allowed, or unknown."""

from dataclasses import dataclass

import pytest

pytest.importorskip("rospy", reason="needs ROS")

import rospy

from hive_common.errors import HiveError, ParameterError
from hive_common.ros import params


@dataclass(frozen=True)
class Drive:
    """Settings of every type."""

    speed: float = 1.5
    attempts: int = 3
    planner: str = "path"
    careful: bool = True

    def __post_init__(self):
        if self.speed <= 0:
            raise HiveError(f"speed is {self.speed:g}; allowed: above 0")


@pytest.fixture
def server(monkeypatch):
    """The parameters of the node /base, by their full names."""
    known = {}

    def get_param(name, default):
        full_name = name.replace("~", "/base/")
        below = f"{full_name}/"
        tree = {k.removeprefix(below): v for k, v in known.items() if k.startswith(below)}
        return tree or known.get(full_name, default)

    monkeypatch.setattr(rospy, "get_param", get_param)
    monkeypatch.setattr(rospy, "get_name", lambda: "/base")
    monkeypatch.setattr(rospy, "resolve_name", lambda name: name.replace("~", "/base/"))
    return known


@pytest.mark.usefixtures("server")
def test_settings_have_their_defaults_where_no_parameter_is_set():
    assert params.read(Drive) == Drive()


def test_settings_are_read_from_the_parameters_and_whole_numbers_become_numbers(server):
    server |= {"/base/speed": 2, "/base/attempts": 5, "/base/careful": False}

    settings = params.read(Drive)
    assert settings == Drive(2.0, 5, "path", careful=False)
    assert type(settings.speed) is float


def test_settings_of_another_node_are_read_from_its_namespace(server):
    server |= {"/base/speed": 2.0, "/other/speed": 3.0}

    assert params.read(Drive, "/other").speed == 3.0


def test_a_text_that_is_left_open_is_the_shared_one(server):
    server |= {"/base/planner": "", "/fleet/planner": "straight", "/fleet/speed": 9.0}

    assert params.read(Drive, shared="/fleet") == Drive(planner="straight")


def test_a_text_that_is_left_open_is_the_default_where_none_is_shared(server):
    server |= {"/base/planner": ""}

    assert params.read(Drive, shared="/fleet") == Drive()
    assert params.read(Drive) == Drive()


def test_a_text_that_is_given_goes_before_the_shared_one(server):
    server |= {"/base/planner": "own", "/fleet/planner": "straight"}

    assert params.read(Drive, shared="/fleet").planner == "own"


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("speed", "fast", "'fast'; allowed: a number"),
        ("speed", True, "True; allowed: a number"),
        ("attempts", 2.5, "2.5; allowed: a whole number"),
        ("attempts", True, "True; allowed: a whole number"),
        ("planner", 3, "3; allowed: a text"),
        ("careful", "yes", "'yes'; allowed: true or false"),
        ("speed", -1.0, "-1; allowed: above 0"),
    ],
)
def test_a_wrong_value_is_refused_with_its_full_name_and_what_is_allowed(
    server, name, value, allowed
):
    server[f"/base/{name}"] = value

    with pytest.raises(ParameterError, match=f"^/base/{name} is {allowed}$"):
        params.read(Drive)


def test_a_parameter_that_nothing_reads_is_refused_with_those_that_exist(server):
    server["/base/spede"] = 2.0

    with pytest.raises(ParameterError) as caught:
        params.refuse_unknown([Drive], ["journal"])

    allowed = "attempts, careful, journal, planner, speed"
    assert str(caught.value) == f"/base/spede is unknown; allowed: {allowed}"


def test_known_parameters_are_not_refused(server):
    server |= {"/base/speed": 2.0, "/base/journal": "folder"}

    params.refuse_unknown([Drive], ["journal"])


def test_a_flag_is_true_or_false_and_nothing_else(server):
    assert params.flag("careful", default=True)
    server["/base/careful"] = False
    assert not params.flag("careful", default=True)
    server["/base/careful"] = 1
    with pytest.raises(ParameterError, match="/base/careful is 1; allowed: true or false"):
        params.flag("careful", default=True)


@pytest.mark.parametrize("value", [None, "2", True, float("nan"), 0.05, 11])
def test_a_number_has_to_be_there_and_within_its_limits(server, value):
    server["/base/rate"] = value

    with pytest.raises(ParameterError, match="parameter ~rate"):
        params.number("rate", least=0.1, most=10.0)


def test_a_whole_number_has_no_fraction(server):
    server["/base/seed"] = 2.5

    with pytest.raises(ParameterError, match=r"parameter ~seed: 2.5; allowed: a whole number"):
        params.whole_number("seed", least=0, most=9, default=0)
