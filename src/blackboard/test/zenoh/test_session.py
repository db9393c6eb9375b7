# SPDX-License-Identifier: BSD-3-Clause
"""How sessions are configured, and which endpoints are refused."""

import json

import pytest
import zenoh

from blackboard.errors import SettingsError
from blackboard.zenoh.access import Identity, Role, access_control
from blackboard.zenoh.session import ACCESS_FORMAT, Endpoints, Mode, session_config

MOST_BATCHES = 16
"""As many as Zenoh allows; with fewer, a hive loses messages that it says at once."""


def write_list(folder, listed, written=ACCESS_FORMAT):
    content = {"format": written, "access_control": listed}
    (folder / "access.json").write_text(json.dumps(content))


@pytest.fixture
def folder(tmp_path):
    """The files of an identity; what is in the certificates does not matter here."""
    for name in ("authority.crt", "own.crt", "own.key"):
        (tmp_path / name).write_text("PEM")
    write_list(tmp_path, access_control("lab", [Identity("robot1", Role.ROBOT, "robot1.1")]))
    return tmp_path


@pytest.mark.parametrize(
    "endpoint", ["tcp/127.0.0.1:7447", "tcp/[::1]:7447", "tcp/127.0.0.1:7447#iface=lo"]
)
def test_without_certificates_a_session_stays_on_loopback(endpoint):
    config = session_config(Endpoints(listen=(endpoint,), connect=(endpoint,)))

    assert config["listen"]["endpoints"] == config["connect"]["endpoints"] == [endpoint]
    assert "access_control" not in config


@pytest.mark.parametrize(
    "endpoint",
    [
        *("tcp/0.0.0.0:7447", "tcp/192.168.1.2:7447", "tcp/lab:7447", "tls/127.0.0.1:7447", ""),
        *("tcp/127.0.0.1", "tcp/127.0.0.1:", "tcp/127.0.0.1:x", "tcp/127.0.0.1:65536"),
    ],
)
@pytest.mark.parametrize("way", ["listen", "connect"])
def test_without_certificates_no_other_machine_is_reached(way, endpoint):
    with pytest.raises(SettingsError, match=r"allowed without certificates: tcp/127.0.0.1:PORT"):
        session_config(Endpoints(**{way: (endpoint,)}))


@pytest.mark.parametrize("host", ["10.0.0.1", "my_host.lab", "[fe80::1%eth0]"])
def test_with_certificates_any_host_can_be_named(folder, host):
    endpoint = f"tls/{host}:7447"

    assert session_config(Endpoints(connect=(endpoint,)), folder)["connect"]["endpoints"] == [
        endpoint
    ]


def test_with_certificates_nothing_is_sent_unencrypted(folder):
    with pytest.raises(SettingsError, match="allowed with certificates: tls/HOST:PORT"):
        session_config(Endpoints(connect=("tcp/127.0.0.1:7447",)), folder)


@pytest.mark.parametrize("missing", ["authority.crt", "own.crt", "own.key", "access.json"])
def test_a_file_that_is_missing_is_named(folder, missing):
    (folder / missing).unlink()

    with pytest.raises(SettingsError, match=f"{missing}.*copy"):
        session_config(Endpoints(), folder)


@pytest.mark.parametrize("text", ["", "[]", "{", "{}", "7", "\udcff"])
def test_an_access_list_that_cannot_be_read_is_refused(folder, text):
    (folder / "access.json").write_bytes(text.encode(errors="surrogateescape"))

    with pytest.raises(SettingsError, match=r"access.json .*copy the one"):
        session_config(Endpoints(), folder)


@pytest.mark.parametrize(
    "listed",
    [
        {"enabled": True, "default_permission": "allow"},
        {"enabled": False, "default_permission": "deny"},
        {"enabled": True, "default_permission": []},
        [],
        None,
    ],
)
def test_an_access_list_that_allows_everything_is_refused(folder, listed):
    write_list(folder, listed)

    with pytest.raises(SettingsError, match=r"access.json .*copy the one"):
        session_config(Endpoints(), folder)


@pytest.mark.parametrize("written", [None, 1, "2", [2]])
def test_an_access_list_of_another_version_is_refused(folder, written):
    write_list(folder, access_control("lab", []), written)

    with pytest.raises(SettingsError, match=r"no access list of format 2; run `hive certs renew`"):
        session_config(Endpoints(), folder)


@pytest.mark.parametrize("mode", Mode)
def test_zenoh_understands_the_configuration(folder, mode):
    endpoints = Endpoints(("tls/127.0.0.1:7447",), ("tls/127.0.0.1:7448",))

    read = zenoh.Config.from_json5(json.dumps(session_config(endpoints, folder, mode)))

    assert json.loads(read.get_json("mode")) == mode.value
    lease = 2_000 if mode is Mode.ROUTER else 10_000
    assert json.loads(read.get_json("transport/link/tx/lease")) == lease
    assert json.loads(read.get_json("transport/link/tls/enable_mtls")) is True
    assert json.loads(read.get_json("access_control/default_permission")) == "deny"
    assert json.loads(read.get_json("scouting/multicast/enabled")) is False
    assert json.loads(read.get_json("transport/shared_memory/enabled")) is False
    for priority in ("control", "interactive_high", "data"):
        waiting = f"transport/link/tx/queue/size/{priority}"
        assert json.loads(read.get_json(waiting)) == MOST_BATCHES
