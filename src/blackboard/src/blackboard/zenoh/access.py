# SPDX-License-Identifier: BSD-3-Clause
"""Who may say what in a hive over Zenoh, as access control that Zenoh itself enforces.

Every message has the key `hive/HIVE/TOPIC/SENDER`, or `hive/HIVE/TOPIC/SENDER/MEMBER` if it is for
one member only. SENDER is who speaks, and Zenoh passes a message on only if the certificate of the
connection belongs to that one. So the sender of a message can be read from its key, and nothing in
the message has to be believed.

Everything that no rule allows is denied. A certificate that is not on the list gets nothing and
says nothing, even if the site's own authority has issued it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any

from blackboard.domain import talker as topics

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

ANY = "**"
"""Zenoh's wildcard for any number of parts of a key."""

PART = re.compile(r"[A-Za-z0-9_-]{1,64}")
"""What a name may be that is one part of a key."""

_ANYBODY = "*"
"""Zenoh's wildcard for one part of a key: the name of anybody."""

PROGRAMS = "+"
"""Stands in a key for all who are no members, such as the gateway."""

ALIVE, LISTENS = "alive", "listens"
"""Parts of the keys of liveliness tokens, before the member's name: it lives, and it listens to a
topic of which newcomers get what was said last."""

_TRAFFIC = "traffic"
_ROUTES, _TRAFFIC_STATE = "routes", "traffic_state"
_ZONE_COMMAND = "zone_command"


_LIVELINESS = "liveliness_token"
_LISTENING = ["declare_subscriber", "declare_liveliness_subscriber", "liveliness_query"]


class Role(Enum):
    """What a certificate is for."""

    BLACKBOARD = "blackboard"  # the node that bootstraps the hive; no robot
    ROBOT = "robot"  # may lead the hive
    LEARNER = "learner"  # a robot that may not lead (`stands_by: false`)
    OPERATOR = "operator"  # posts and cancels tasks, sets the state of robots, closes zones
    VIEWER = "viewer"  # listens
    ROUTER = "router"  # passes on what others say


_LEADS = (*topics.VOTER_TOPICS, _ROUTES, _TRAFFIC_STATE)

_ROBOT = (*topics.ROBOT_TOPICS, _TRAFFIC)

_SAYS = {
    Role.BLACKBOARD: _LEADS,
    Role.ROBOT: (*_LEADS, *_ROBOT),
    Role.LEARNER: (*topics.LEARNER_TOPICS, *_ROBOT),
    Role.OPERATOR: (
        topics.NEW_TASK,
        topics.TASK_CANCEL,
        _ZONE_COMMAND,
        f"{_ANYBODY}/{topics.SET_STATE}",
    ),
    Role.VIEWER: (),
    Role.ROUTER: (),
}
"""The topics of the hive on which each role may speak. The leader runs the traffic planner, so who
may lead may speak for it."""


@dataclass(frozen=True)
class Identity:
    """A member, a program or a router that may take part.

    Attributes:
        name: The last part of the keys on which it speaks.
        role: What it may do.
        common_name: That of its certificate; one that was revoked had another.
    """

    name: str
    role: Role
    common_name: str


def key_of(hive: str, topic: str, sender: str) -> str:
    """Return the key on which a sender speaks on a topic of a hive."""
    return f"hive/{hive}/{topic}/{sender}"


def keys_to(hive: str, topic: str, sender: str, members: Iterable[str]) -> Iterator[str]:
    """Return the keys on which a sender speaks to some members, and to all who are none.

    Names that cannot be a part of a key belong to no member.
    """
    named = (name for name in members if PART.fullmatch(name))
    return (f"{key_of(hive, topic, sender)}/{name}" for name in (*named, PROGRAMS))


def keys_for(hive: str, topic: str, member: str) -> tuple[str, ...]:
    """Return the key expressions on which a process hears what concerns it.

    Args:
        hive: The hive's name.
        topic: The topic's name below the hive.
        member: The name of its process; empty for a program that is no member, which hears
            everything.
    """
    everybody = key_of(hive, topic, _ANYBODY)
    return everybody, f"{everybody}/{member or PROGRAMS}"


def speaks_on(hive: str, identity: Identity) -> tuple[str, ...]:
    """Return the key expressions on which an identity may speak.

    A robot also speaks on topics in a namespace of its own, such as that of its pose.
    """
    if identity.role is Role.ROUTER:
        return (f"hive/{hive}/{ANY}",)
    said = list(_SAYS[identity.role])
    if identity.role in {Role.ROBOT, Role.LEARNER}:
        said.append(f"{identity.name}/*")
    return tuple(key_of(hive, topic, f"{identity.name}/{ANY}") for topic in said)


def tokens_of(hive: str, name: str) -> tuple[str, ...]:
    """Return the key expressions of the tokens that a member may declare."""
    heads = (ALIVE, f"{LISTENS}/*")
    return tuple(f"hive/{hive}/{head}/{name}/{ANY}" for head in heads)


def access_control(hive: str, identities: Iterable[Identity]) -> dict[str, Any]:
    """Return the section `access_control` of a Zenoh configuration.

    Every machine of a hive uses the same one, because each checks what comes in itself.

    Args:
        hive: The hive's name, one part of a key.
        identities: All that may take part.
    """
    listed = list(identities)
    everything = [f"hive/{hive}/{ANY}"]
    rules = [
        _rule("listen", ["ingress", "egress"], _LISTENING, everything),
        _rule("hear", ["egress"], ["put", _LIVELINESS], everything),
    ]
    policies = []
    if listed:
        policies.append(_policy(["listen", "hear"], [each.name for each in listed]))
    for each in listed:
        own = {
            f"{each.name} lives": (_LIVELINESS, _tokens_of(hive, each)),
            f"{each.name} speaks": ("put", speaks_on(hive, each)),
        }
        allowed = {rule: (message, keys) for rule, (message, keys) in own.items() if keys}
        rules += [
            _rule(rule, ["ingress"], [message], list(keys))
            for rule, (message, keys) in allowed.items()
        ]
        policies.append(_policy(list(allowed), [each.name]))
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [
            {"id": each.name, "cert_common_names": [each.common_name]} for each in listed
        ],
        "policies": policies,
    }


def _tokens_of(hive: str, identity: Identity) -> tuple[str, ...]:
    """Return whose tokens an identity may bring: its own, a router those of all."""
    return tokens_of(hive, "*" if identity.role is Role.ROUTER else identity.name)


def _rule(name: str, flows: list[str], messages: list[str], keys: list[str]) -> dict[str, Any]:
    return {
        "id": name,
        "permission": "allow",
        "flows": flows,
        "messages": messages,
        "key_exprs": keys,
    }


def _policy(rules: list[str], subjects: list[str]) -> dict[str, Any]:
    return {"rules": rules, "subjects": subjects}
