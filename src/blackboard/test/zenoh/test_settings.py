# SPDX-License-Identifier: BSD-3-Clause
"""The parameter `zenoh`: what may stand there, where a process is reached, and who it is."""

import json
from pathlib import Path

import pytest

from blackboard.errors import SettingsError
from blackboard.zenoh.session import Endpoints, Own, read_own
from blackboard.zenoh.settings import ZenohSettings
from hive_common.structuring import NotAllowedError, structure

LAN, LOOPBACK, EVERYWHERE = "tls/192.168.1.12:7447", "tcp/127.0.0.1:7447", "tls/0.0.0.0:7447"


@pytest.fixture
def folder(tmp_path):
    """The folder of robot1's certificate at the site `lab`, as far as it says whose it is."""
    (tmp_path / "own.json").write_text(json.dumps({"hive": "lab", "name": "robot1"}))
    return tmp_path


def test_all_that_may_be_set_is_read():
    given = {
        "listen": [LAN],
        "connect": [LOOPBACK, EVERYWHERE],
        "certificates": "/etc/robot1",
        "hive": "hall_2-b",
        "mode": "client",
        "own_master": False,
    }

    found = structure(given, ZenohSettings)

    assert found.endpoints == Endpoints((LAN,), (LOOPBACK, EVERYWHERE))
    assert found.folder == Path("/etc/robot1")
    assert (found.hive, found.mode, found.own_master) == ("hall_2-b", "client", False)


def test_without_any_value_a_process_is_a_peer_that_nobody_reaches():
    found = structure({}, ZenohSettings)

    assert found.endpoints == Endpoints()
    assert found.folder is None
    assert (found.hive, found.mode, found.address) == ("hive", "peer", "")
    assert found.own_master


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"mode": "router"}, r"mode: 'router'; allowed: peer \| client"),
        ({"mode": True}, r"mode: True; allowed: peer \| client"),
        ({"listen": LAN}, f"listen: '{LAN}'; allowed: a list"),
        ({"connect": [LAN, 7447]}, r"connect\[1\]: 7447; allowed: a text"),
        ({"own_master": "no"}, "own_master: 'no'; allowed: true or false"),
        ({"certificates": 7}, "certificates: 7; allowed: a text"),
        ({"lisen": []}, "lisen: unknown; allowed: the keys listen, connect, certificates, hive"),
        ("peer", "'peer'; allowed: the keys listen, connect"),
    ],
)
def test_a_wrong_value_is_named_with_what_is_allowed(given, said):
    with pytest.raises(NotAllowedError, match=said):
        structure(given, ZenohSettings)


@pytest.mark.parametrize("hive", ["", "lab/hall", "lab *", "h" * 65, "lab\n", "$*", "Länge", 3])
def test_a_hive_whose_name_fits_into_no_key_is_refused(hive):
    with pytest.raises(NotAllowedError, match=r"hive: .*; allowed: a name of letters, digits"):
        structure({"hive": hive}, ZenohSettings)


@pytest.mark.parametrize(
    ("listen", "address"),
    [
        ((LAN,), "192.168.1.12:7447"),
        ((LOOPBACK, LAN), "127.0.0.1:7447"),
        ((EVERYWHERE, LAN), "192.168.1.12:7447"),
        (("tls/[::]:7447", "tls/[fe80::1]:7447"), "[fe80::1]:7447"),
        (("tls/lab:7447", "tls/192.168.1.12:0", "tls/192.168.1.12", "tls", ""), ""),
        (("tls/192.168.1.12:7447#iface=eth0",), ""),
    ],
)
def test_a_process_is_reached_at_the_first_endpoint_that_is_one_address(listen, address):
    assert ZenohSettings(listen=listen).address == address


def test_what_a_process_connects_to_is_not_its_own_address():
    assert ZenohSettings(connect=(LAN,)).address == ""


def test_a_folder_may_begin_with_the_home_of_the_user(monkeypatch):
    monkeypatch.setenv("HOME", "/anna")

    assert ZenohSettings(certificates="~/certs").folder == Path("/anna/certs")


@pytest.mark.parametrize(("name", "speaks_as"), [("robot1", "robot1"), ("", "operator")])
def test_without_certificates_a_process_is_who_it_says_and_else_an_operator(name, speaks_as):
    assert ZenohSettings(hive="hall").own(name) == Own("hall", speaks_as)


@pytest.mark.parametrize("name", ["robot1", ""])
def test_with_certificates_a_process_is_whose_certificate_it_has(folder, name):
    settings = ZenohSettings(hive="hall", certificates=str(folder))

    assert settings.own(name) == Own("lab", "robot1")


def test_a_process_with_the_certificate_of_another_does_not_start(folder):
    with pytest.raises(SettingsError) as refused:
        ZenohSettings(certificates=str(folder)).own("robot2")

    assert str(refused.value) == (
        f"zenoh/certificates: {folder} is the folder of robot1; allowed: that of robot2, "
        "which `hive certs add robot2` makes"
    )


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    settings = ZenohSettings(certificates=str(tmp_path / "gone"))

    with pytest.raises(SettingsError, match=r"gone/own\.json cannot be used .*copy the whole"):
        settings.own("robot1")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "Expecting value"),
        ("{", "Expecting property name"),
        ("[]", "list indices"),
        ("7", "not subscriptable"),
        ('{"name": "robot1"}', "'hive'"),
        ('{"hive": "lab"}', "'name'"),
        ("\udcff", "can't decode"),
        ('{"hive": "lab", "name": null}', "expected string"),
        ('{"hive": "lab/x", "name": "robot1"}', "'lab/x' is no name"),
        ('{"hive": "lab", "name": "*"}', "is no name"),
    ],
)
def test_a_folder_that_does_not_say_whose_it_is_cannot_be_used(folder, text, why):
    (folder / "own.json").write_bytes(text.encode(errors="surrogateescape"))

    with pytest.raises(
        SettingsError, match=rf"own\.json cannot be used \(.*{why}.*copy the whole"
    ):
        read_own(folder)


def test_a_folder_whose_file_is_missing_cannot_be_used(folder):
    (folder / "own.json").unlink()

    with pytest.raises(SettingsError, match=r"own\.json cannot be used \(.*No such file"):
        read_own(folder)
