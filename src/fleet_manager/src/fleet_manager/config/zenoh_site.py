# SPDX-License-Identifier: BSD-3-Clause
"""The part of a fleet file that says how members reach each other over Zenoh."""

import re
from collections.abc import Iterator, Sequence
from typing import Annotated

import attrs

from blackboard.zenoh.session import is_address, is_loopback
from hive_common.structuring import Allowed

BLACKBOARD = "blackboard"
"""The name of the member that is no robot."""

FIRST_PORT = 7447
"""Where the first member is reached on this machine, if the fleet file does not say; the others
are reached at the ports that follow."""

ROS_NAME = Allowed(
    "a name for ROS: a letter, then letters, digits and underscores, at most 40 in all",
    lambda value: re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,39}", value) is not None,
)
"""What a robot or a router may be called."""

Mistake = tuple[tuple[str | int, ...], str]
"""Where a mistake is in the fleet file, and what is wrong."""

_ADDRESS = Allowed("HOST:PORT, such as 192.168.1.11:7447", is_address)


@attrs.frozen(kw_only=True)
class ZenohMember:
    """Where a member is reached over Zenoh."""

    name: Annotated[str, Allowed(f"the name of a robot, or {BLACKBOARD}")]
    address: Annotated[str, _ADDRESS]


@attrs.frozen(kw_only=True)
class ZenohRouter:
    """Where a router is reached, and for whom it is the first."""

    name: Annotated[str, ROS_NAME]
    address: Annotated[str, _ADDRESS]
    listen: Annotated[str, _ADDRESS] | None = None
    """Where it listens, if that is not its address, as behind address translation."""
    serves: tuple[str, ...] = ()
    """Members and operators that connect to it, and to another router while it is gone."""


@attrs.frozen(kw_only=True)
class ZenohSite:
    """How the members of the hive reach each other over Zenoh, and who its operators are."""

    members: tuple[ZenohMember, ...] = ()
    """Where each is reached by all others. None: ports of this machine, which no other one
    reaches; or all connect to routers."""
    routers: tuple[ZenohRouter, ...] = ()
    """Those to which everyone connects, instead of to each other."""
    certificates: str = ""
    """The folder that has, by its name, the folder of whoever runs on this machine."""
    operators: tuple[str, ...] = ("operator",)
    """Names of the certificates of operators and viewers."""

    def routers_of(self, name: str) -> tuple[ZenohRouter, ...]:
        """Return the routers of a member or an operator, in the order in which it tries them."""
        return tuple(sorted(self.routers, key=lambda router: name not in router.serves))


def mistakes_in_site(site: ZenohSite, members: Sequence[str]) -> Iterator[Mistake]:
    """Yield what is wrong with how members reach each other.

    Args:
        site: As it was read.
        members: The names of all members of the hive.
    """
    if site.routers and site.members:
        problem = "not allowed together with `routers`, to which all members connect; remove one"
        yield ("zenoh", "members"), problem
    yield from _members(site, members)
    yield from _routers(site, members)
    yield from _addresses(site)
    for index, name in enumerate(site.operators):
        if name in members:
            problem = f"'{name}' is a member; an operator needs a name and certificate of its own"
            yield ("zenoh", "operators", index), problem


def _members(site: ZenohSite, expected: Sequence[str]) -> Iterator[Mistake]:
    """Yield the members that are not the hive's, that are there twice, or that are missing."""
    seen: set[str] = set()
    for index, member in enumerate(site.members):
        if member.name not in expected or member.name in seen:
            what = "is there twice" if member.name in seen else "is no member"
            problem = f"'{member.name}' {what}; allowed: {', '.join(expected)}, each once"
            yield ("zenoh", "members", index, "name"), problem
        seen.add(member.name)
    if seen and (missing := [name for name in expected if name not in seen]):
        problem = f"{', '.join(missing)} missing; say where each member is reached, or no member"
        yield ("zenoh", "members"), problem


def _routers(site: ZenohSite, members: Sequence[str]) -> Iterator[Mistake]:
    """Yield routers with the name of another one, and whom they cannot serve."""
    known = [*members, *site.operators]
    names = set(known)
    served: dict[str, str] = {}
    for index, router in enumerate(site.routers):
        here = ("zenoh", "routers", index)
        if router.name in names:
            problem = f"'{router.name}' is the name of another one; a router needs one of its own"
            yield (*here, "name"), problem
        names.add(router.name)
        for place, name in enumerate(router.serves):
            if name not in known:
                problem = f"'{name}' is unknown; allowed: {', '.join(known)}"
                yield (*here, "serves", place), problem
            elif name in served:
                problem = f"'{name}' is served by {served[name]} already; remove it here or there"
                yield (*here, "serves", place), problem
            served.setdefault(name, router.name)


def _addresses(site: ZenohSite) -> Iterator[Mistake]:
    """Yield the addresses that other machines reach, though there are no certificates."""
    if site.certificates:
        return
    for key, value in _all_addresses(site):
        if not is_loopback(value.rpartition(":")[0]):
            problem = (
                f"'{value}' is reached from other machines; allowed without `certificates`: "
                "127.0.0.1:PORT. Make certificates with `hive certs`"
            )
            yield key, problem


def _all_addresses(site: ZenohSite) -> Iterator[tuple[tuple[str | int, ...], str]]:
    for index, member in enumerate(site.members):
        yield ("zenoh", "members", index, "address"), member.address
    for index, router in enumerate(site.routers):
        yield ("zenoh", "routers", index, "address"), router.address
        if router.listen is not None:
            yield ("zenoh", "routers", index, "listen"), router.listen
