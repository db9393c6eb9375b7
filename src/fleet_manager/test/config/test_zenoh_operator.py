# SPDX-License-Identifier: BSD-3-Clause
"""How an operator's program reaches a hive over Zenoh."""

import pytest

from blackboard.errors import SettingsError
from blackboard.zenoh.access import Role
from fleet_manager.certs.site import Site
from fleet_manager.config.zenoh_operator import operator_site
from fleet_manager.errors import InputError
from hive_common.errors import FileError
from hive_common.pose import Pose

LOOPBACK = "tcp/127.0.0.1:7447"
NOBODY = "transport: zenoh\nzenoh: {operators: []}\n"
ROBOTS = """\
chargers: [{name: dock, pose: [1, 2, 0]}]
zones: [{name: aisle, kind: keep-out, corners: [[0, 0], [1, 0], [1, 1]]}]
robots:
  - {name: amy, model: mir100, pose: [1, 2, 0]}
"""


@pytest.fixture
def certificates(tmp_path):
    """A site with the certificates of two operators and a robot."""
    site = Site.new(tmp_path / "lab")
    site.add("anna", Role.OPERATOR)
    site.add("bea", Role.OPERATOR)
    site.add("amy", Role.ROBOT)
    return site.folder / "members"


@pytest.fixture
def write(tmp_path):
    """Write a fleet file; return its path."""

    def write(head):
        path = tmp_path / "mine.yaml"
        path.write_text(f"{head}{ROBOTS}", encoding="utf-8")
        return str(path)

    return write


def with_members(certificates, operators="anna, bea"):
    return (
        f"transport: zenoh\nzenoh:\n  certificates: {certificates}\n  operators: [{operators}]\n"
        '  members: [{name: blackboard, address: "10.0.0.1:7447"},'
        ' {name: amy, address: "10.0.0.2:7447"}]\n'
    )


def test_a_fleet_file_says_where_the_hive_is_and_what_its_building_has(write, certificates):
    site = operator_site([write(with_members(certificates))])

    assert site.settings.connect == ("tls/10.0.0.1:7447", "tls/10.0.0.2:7447")
    assert site.settings.mode == "peer"
    assert site.settings.own("").name == "anna"
    assert site.places == {"dock": Pose(1.0, 2.0, 0.0)}
    assert [zone.name for zone in site.zones] == ["aisle"]
    assert site.address == "tls/10.0.0.1:7447, tls/10.0.0.2:7447"


def test_a_program_is_the_first_operator_whose_certificate_is_on_its_machine(write, certificates):
    for file in (certificates / "anna").iterdir():
        file.unlink()
    (certificates / "anna").rmdir()

    assert operator_site([write(with_members(certificates))]).settings.own("").name == "bea"


def test_the_folder_of_the_certificate_can_be_anywhere(write, certificates):
    fleet = write(with_members("/not/here"))

    site = operator_site([fleet], str(certificates / "bea"))

    assert site.settings.folder == certificates / "bea"
    assert site.settings.own("").name == "bea"


def test_a_client_connects_first_to_the_router_that_serves_it(write, certificates):
    fleet = write(
        f"transport: zenoh\nzenoh:\n  certificates: {certificates}\n  operators: [anna, bea]\n"
        '  routers: [{name: hall_a, address: "10.0.1.1:7447"},'
        ' {name: hall_b, address: "10.0.2.1:7447", serves: [bea]}]\n'
    )

    site = operator_site([fleet], str(certificates / "bea"))

    assert site.settings.mode == "client"
    assert site.settings.connect == ("tls/10.0.2.1:7447", "tls/10.0.1.1:7447")


def test_a_hive_on_this_machine_needs_no_certificate(write):
    by_file = operator_site([write("transport: zenoh\n")])
    by_endpoints = operator_site(["tcp/127.0.0.1:7447", "tcp/127.0.0.1:7448"])

    assert by_file.settings == by_endpoints.settings
    assert by_file.settings.own("").name == "operator"


@pytest.mark.parametrize(
    ("ends", "head", "error", "said"),
    [
        pytest.param(["lab"], "", InputError, "transport: ros; allowed: zenoh", id="on ROS"),
        pytest.param(["nowhere"], "", FileError, "nowhere", id="no fleet"),
        pytest.param([LOOPBACK, "lab"], "", InputError, "allowed: one fleet", id="both"),
        pytest.param(["tls/10.0.0.1:1"], "", SettingsError, "without certificates", id="bare"),
        pytest.param([], with_members("/not/here"), InputError, "of anna or bea", id="not here"),
        pytest.param([], NOBODY, InputError, "names no operator", id="nobody"),
        pytest.param([], with_members("/x", "amy"), FileError, "'amy' is a", id="a member"),
    ],
)
def test_what_cannot_be_used_is_named_with_what_is_allowed(write, ends, head, error, said):
    with pytest.raises(error, match=said):
        operator_site(ends or [write(head)])


@pytest.mark.parametrize(
    ("role", "said"), [(Role.OPERATOR, ""), (Role.VIEWER, "eve has a viewer's certificate, and")]
)
def test_only_an_operators_certificate_may_ask_for_anything(tmp_path, role, said):
    certificates = Site.new(tmp_path / "hall")
    certificates.add("eve", role)
    site = operator_site(["tls/10.0.0.1:7447"], str(certificates.folder_of("eve")))

    assert site.why_silent.startswith(said)
    assert bool(site.why_silent) is bool(said)


def test_nobody_connects_as_a_member_which_has_a_process_of_its_own(certificates):
    with pytest.raises(InputError, match="certificate of a robot; allowed: that of an operator"):
        operator_site(["tls/10.0.0.1:7447"], str(certificates / "amy"))


@pytest.mark.parametrize("name", ["carl", ""])
def test_a_folder_without_a_certificate_is_named(write, certificates, name):
    fleet = write(with_members(certificates))

    with pytest.raises(SettingsError, match="copy the whole folder"):
        operator_site([fleet], str(certificates / name))
