# SPDX-License-Identifier: BSD-3-Clause
"""Zenoh itself, over TLS: who gets in with which certificate, and who may say what.

Each attacker connects to the blackboard's session, says what it is not allowed to, and hangs up.
When the blackboard's session has noticed that, all that was sent before has been taken in or
dropped.
"""

import contextlib
import json
import queue
import shutil
from dataclasses import dataclass
from datetime import timedelta

import pytest
import zenoh

from blackboard.zenoh.access import Role
from blackboard.zenoh.session import Endpoints, Mode, session_config
from fleet_manager.certs.issuing import today
from fleet_manager.certs.site import Site
from vda5050.mqtt.local_broker import free_port

ROLES = {
    "blackboard": Role.BLACKBOARD,
    "robot1": Role.ROBOT,
    "robot2": Role.ROBOT,
    "robot3": Role.LEARNER,
    "anna": Role.OPERATOR,
    "eve": Role.VIEWER,
    "hall1": Role.ROUTER,
}
LIMIT = 20.0  # of what has to happen [s]
HEARTBEAT, BID, TASK = "bb_backup/{}", "task_cost/{}", "new_task/{}"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    made = Site.new(tmp_path_factory.mktemp("sites") / "lab")
    for name, role in ROLES.items():
        made.add(name, role)
    return made


def opened(config):
    return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))


@dataclass
class Blackboard:
    """The session of the blackboard node."""

    endpoint: str
    session: zenoh.Session
    subscriber: zenoh.Subscriber
    connections: queue.Queue

    def hears(self, folder, *keys, payload=b"x", hive="lab"):
        """Return the keys that arrive when the owner of a folder speaks on some."""
        config = session_config(Endpoints(connect=(self.endpoint,)), folder, Mode.CLIENT)
        config["connect"] |= {"timeout_ms": 1000, "exit_on_failure": True}
        with opened(config) as speaker:
            self._wait_until(zenoh.SampleKind.PUT, speaker.info.zid())
            for key in keys:
                speaker.put(f"hive/{hive}/{key}", payload)
            zid = speaker.info.zid()
        self._wait_until(zenoh.SampleKind.DELETE, zid)
        arrived = iter(self.subscriber.try_recv, None)
        return [str(sample.key_expr).removeprefix("hive/lab/") for sample in arrived]

    def _wait_until(self, kind, zid):
        while True:
            event = self.connections.get(timeout=LIMIT)
            if (event.kind, event.transport.zid) == (kind, zid):
                return


@pytest.fixture(scope="module")
def blackboard(site):
    endpoint = f"tls/127.0.0.1:{free_port()}"
    mine = session_config(Endpoints(listen=(endpoint,)), site.folder_of("blackboard"), Mode.ROUTER)
    with contextlib.ExitStack() as stack:
        session = stack.enter_context(opened(mine))
        connections = queue.Queue()
        session.info.declare_transport_events_listener(connections.put)
        heard = session.declare_subscriber("hive/**", zenoh.handlers.FifoChannel(20_000))
        yield Blackboard(endpoint, session, heard, connections)


@pytest.fixture
def viewer(site, blackboard):
    """The configuration of a viewer's session."""
    reach = Endpoints(connect=(blackboard.endpoint,))
    return session_config(reach, site.folder_of("eve"), Mode.CLIENT)


@pytest.fixture
def revoked(tmp_path, site, blackboard):
    """That of a session whose certificate the authority issued, and which is on no list."""
    other = Site(shutil.copytree(site.folder, tmp_path / "lab"))
    other.add("mallory", Role.ROBOT)
    reach = Endpoints(connect=(blackboard.endpoint,))
    return session_config(reach, other.folder_of("mallory"), Mode.CLIENT)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("robot1", ["bb_backup/robot1", "task_cost/robot1", "robot1/pose/robot1"]),
        ("robot1", ["task_cost/robot1/blackboard", "task_cost/robot1/+", "bb_ack/robot1/robot2"]),
        ("robot3", ["task_cost/robot3", "robot_status/robot3"]),
        ("anna", ["new_task/anna", "task_cancel/anna", "robot1/set_state/anna"]),
    ],
)
def test_who_belongs_says_what_is_its_own(site, blackboard, name, said):
    assert blackboard.hears(site.folder_of(name), *said) == said


@pytest.mark.parametrize(
    ("name", "forged"),
    [
        ("robot2", [BID.format("robot1"), "robot_status/robot1", "bb_vote/robot1"]),
        ("robot2", ["task_cost/robot1/blackboard", "bb_vote/robot1/robot2", "bb_ack/robot1/+"]),
        ("robot2", ["robot1/pose/robot2", "robot1/set_state/robot2", "task_cancel/robot2"]),
        ("robot3", [HEARTBEAT.format("robot3"), "task_assign/robot3", "bb_vote/robot3"]),
        (
            "anna",
            [HEARTBEAT.format("anna"), BID.format("anna"), "bb_sync/anna", "task_state/anna"],
        ),
        ("anna", [TASK.format("robot1"), "robot1/set_state/robot1"]),
        ("eve", [TASK.format("eve"), "task_cancel/eve", "robot1/set_state/eve", "x/eve"]),
    ],
)
def test_nobody_says_what_is_not_its_own(site, blackboard, name, forged):
    assert blackboard.hears(site.folder_of(name), *forged) == []


@pytest.mark.parametrize("name", [name for name in ROLES if name != "hall1"])
def test_everyone_says_that_it_lives_and_listens_and_nobody_says_so_for_another(
    site, blackboard, name
):
    seen, mine = queue.Queue(), f"{name}/5e55/-"
    other = "anna" if name == "robot1" else "robot1"
    last = f"hive/lab/listens/bb_sync/{mine}"
    blackboard.session.liveliness().declare_subscriber("hive/lab/**", seen.put)
    reach = Endpoints(connect=(blackboard.endpoint,))
    with opened(session_config(reach, site.folder_of(name), Mode.CLIENT)) as session:
        tokens = [
            session.liveliness().declare_token(key)
            for key in (f"hive/lab/alive/{other}/5e55/-", f"hive/lab/alive/{mine}", last)
        ]
        found = [seen.get(timeout=LIMIT)]
        while str(found[-1].key_expr) != last:
            found.append(seen.get(timeout=LIMIT))
    gone = [seen.get(timeout=LIMIT) for _ in found]

    own = [f"hive/lab/alive/{mine}", last]
    assert len(tokens) == 3
    assert [(str(each.key_expr), each.kind) for each in found] == [
        (key, zenoh.SampleKind.PUT) for key in own
    ]
    assert {str(each.key_expr) for each in gone} == set(own)
    assert all(each.kind == zenoh.SampleKind.DELETE for each in gone)


def test_a_viewer_sees_who_lives_and_who_was_revoked_does_not(blackboard, viewer, revoked):
    token = blackboard.session.liveliness().declare_token("hive/lab/alive/blackboard/5e55/-")
    with opened(viewer) as eve, opened(revoked) as mallory:
        nothing, seen = queue.Queue(), queue.Queue()
        for session, found in ((mallory, nothing), (eve, seen)):
            session.liveliness().declare_subscriber("hive/lab/**", found.put, history=True)
        assert str(seen.get(timeout=LIMIT).key_expr) == "hive/lab/alive/blackboard/5e55/-"
        token.undeclare()
        assert seen.get(timeout=LIMIT).kind == zenoh.SampleKind.DELETE
        assert nothing.empty()


def test_a_router_passes_on_what_others_say(site, blackboard):
    said = ["task_cost/robot1", "new_task/anna"]

    assert blackboard.hears(site.folder_of("hall1"), *said) == said


class Hall:
    """A router with a certificate of the site, and the blackboard's session as its client."""

    def __init__(self, site, router, stack):
        self._site = site
        self.endpoint = f"tls/127.0.0.1:{free_port()}"
        here = Endpoints(listen=(self.endpoint,))
        config = session_config(here, site.folder_of(router), Mode.ROUTER)
        self.router = stack.enter_context(opened(config))
        self._blackboard = stack.enter_context(self.client("blackboard"))
        self._heard = queue.Queue()
        self._blackboard.declare_subscriber("hive/lab/**", self._heard.put)

    def client(self, name):
        reach = Endpoints(connect=(self.endpoint,))
        return opened(session_config(reach, self._site.folder_of(name), Mode.CLIENT))

    def say(self, session, *said):
        """Have a session say something on some keys, once somebody listens to the last."""
        last = session.declare_publisher(
            f"hive/lab/{said[-1]}", allowed_destination=zenoh.Locality.REMOTE
        )
        listened = queue.Queue()
        last.declare_matching_listener(listened.put)
        while not last.matching_status.matching:
            listened.get(timeout=LIMIT)
        for key in said[:-1]:
            session.put(f"hive/lab/{key}", b"x")
        last.put(b"x")

    def heard_until(self, last):
        """Return the keys that arrive at the blackboard, until a certain one does."""
        found = []
        while last not in found:
            key = self._heard.get(timeout=LIMIT).key_expr
            found.append(str(key).removeprefix("hive/lab/"))
        return found


@pytest.mark.parametrize(
    ("name", "forged", "own"),
    [
        ("robot2", ["task_cost/robot1", "bb_vote/robot1/blackboard", "x/y"], "task_cost/robot2"),
        ("anna", ["bb_backup/anna", "new_task/robot1"], "new_task/anna"),
    ],
)
def test_a_router_passes_on_nothing_that_is_not_the_speaker_s_own(site, name, forged, own):
    with contextlib.ExitStack() as stack:
        hall = Hall(site, "hall1", stack)
        hall.say(stack.enter_context(hall.client(name)), *forged, own)

        assert hall.heard_until(own) == [own]


def test_a_member_hears_by_a_router_who_is_not_on_its_own_list(tmp_path, site):
    """A new robot has to be known to the routers only."""
    newer = Site(shutil.copytree(site.folder, tmp_path / "lab"))
    newer.add("robot9", Role.ROBOT)
    shutil.rmtree(newer.folder_of("blackboard"))
    shutil.copytree(site.folder_of("blackboard"), newer.folder_of("blackboard"))
    with contextlib.ExitStack() as stack:
        hall = Hall(newer, "hall1", stack)
        hall.say(stack.enter_context(hall.client("robot9")), "task_cost/robot9")

        assert hall.heard_until("task_cost/robot9") == ["task_cost/robot9"]


def test_a_member_passes_on_nothing_as_if_it_were_a_router(site):
    """Others drop what comes from its connection and is not its own."""
    with contextlib.ExitStack() as stack:
        forger = Hall(site, "robot2", stack)
        taken_in = queue.Queue()
        forger.router.declare_subscriber("hive/lab/task_cost/robot1", taken_in.put)
        robot1 = stack.enter_context(forger.client("robot1"))
        forger.say(robot1, *["task_cost/robot1"] * 100)
        for _ in range(100):
            taken_in.get(timeout=LIMIT)
        forger.say(forger.router, "task_cost/robot2")

        assert forger.heard_until("task_cost/robot2") == ["task_cost/robot2"]


def test_nobody_speaks_in_another_hive(site, blackboard):
    assert blackboard.hears(site.folder_of("hall1"), "new_task/anna", hive="hall") == []


def test_who_was_revoked_says_nothing(tmp_path, site, blackboard):
    """The access list of the blackboard lacks a certificate, though the authority issued it."""
    other = Site(shutil.copytree(site.folder, tmp_path / "lab"))
    other.add("mallory", Role.ROBOT)

    assert blackboard.hears(other.folder_of("mallory"), BID.format("mallory")) == []


def test_a_viewer_hears_the_hive_and_who_was_revoked_does_not(blackboard, viewer, revoked):
    others = zenoh.Locality.REMOTE
    publisher = blackboard.session.declare_publisher(
        "hive/lab/bb_backup/blackboard", allowed_destination=others
    )
    listened = queue.Queue()
    publisher.declare_matching_listener(listened.put)
    with opened(viewer) as eve, opened(revoked) as mallory:
        nothing, heard = queue.Queue(), queue.Queue()
        mallory.declare_subscriber("hive/lab/**", nothing.put)
        eve.declare_subscriber("hive/lab/**", heard.put)
        assert listened.get(timeout=LIMIT).matching
        for number in range(100):
            publisher.put(str(number))
        told = [int(heard.get(timeout=LIMIT).payload.to_string()) for _ in range(100)]

        assert told == list(range(100))
        assert nothing.empty()


def refused(blackboard, folder):
    with pytest.raises(zenoh.ZError, match="Unable to connect"):
        blackboard.hears(folder, BID.format("robot1"))
    return True


def test_a_certificate_of_another_authority_is_refused(tmp_path, blackboard):
    other = Site.new(tmp_path / "lab")
    other.add("robot1", Role.ROBOT)

    assert refused(blackboard, other.folder_of("robot1"))


def test_a_certificate_that_has_ended_is_refused(tmp_path, site, blackboard):
    """The same authority issued it, to someone on the list."""
    last_year = Site(
        shutil.copytree(site.folder, tmp_path / "lab"), lambda: today() - timedelta(days=400)
    )
    last_year.renew("robot1", days=30)

    assert refused(blackboard, last_year.folder_of("robot1"))


def test_without_a_certificate_nobody_gets_in(tmp_path, site, blackboard):
    """A stranger who knows the authority's certificate, which is no secret, signs its own."""
    stranger = Site.new(tmp_path / "lab")
    stranger.add("robot1", Role.ROBOT)
    known = site.folder_of("robot1") / "authority.crt"
    shutil.copy(known, stranger.folder_of("robot1") / "authority.crt")

    assert refused(blackboard, stranger.folder_of("robot1"))


def test_random_payloads_on_every_key_arrive_only_from_who_may_say_them(site, blackboard):
    keys = [f"{topic}/{name}" for topic in ("bb_vote", "task_bc", "new_task") for name in ROLES]

    assert blackboard.hears(site.folder_of("eve"), *keys * 200, payload=bytes(range(256))) == []
    assert blackboard.hears(site.folder_of("anna"), *keys * 200) == ["new_task/anna"] * 200
