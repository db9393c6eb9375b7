# SPDX-License-Identifier: BSD-3-Clause
"""A network of hosts on one machine, which a test can cut, deafen and make lossy.

Each host is a network namespace with one network card, and a bridge joins them. The program that
makes the network is a host of its own, the office. Needs root, and the programs of `NEEDS`.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import shutil
import subprocess
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

NEEDS = ("ip", "nft", "nsenter", "unshare")
"""Programs of the Debian packages iproute2, nftables and util-linux."""

OFFICE = "10.77.0.1"
"""Address of the program that makes the network."""

_CLONE_NEWNET = 0x40000000  # linux/sched.h
_WITHIN = 120.0
_LOOK_EVERY = 0.01


class NoNetworkError(Exception):
    """No network can be created here; the text says why."""


class LiveNetwork:
    """Some hosts on a network of their own; call `end` when it is not needed any more.

    The calling process leaves the machine's own network for good, so that nothing of it is touched
    and addresses cannot clash. Make it before anything that talks, such as a ROS node.

    Args:
        names: Of the hosts.

    Raises:
        NoNetworkError: The machine, or who runs this, cannot make it.
    """

    def __init__(self, names: Sequence[str]) -> None:
        _leave_the_machines_network()
        self._hosts: dict[str, subprocess.Popen[bytes]] = {}
        self._addresses = {name: f"10.77.0.{i}" for i, name in enumerate(names, 2)}
        _run("ip", "link", "set", "lo", "up")
        _run("ip", "link", "add", "office", "type", "bridge")
        _run("ip", "address", "add", f"{OFFICE}/24", "dev", "office")
        _run("ip", "link", "set", "office", "up")
        for name in names:
            self._plug_in(name)

    def prefix(self, host: str) -> list[str]:
        """Return the command that runs another one on a host."""
        return ["nsenter", f"--net={_namespace(self._hosts[host].pid)}"]

    def address(self, host: str) -> str:
        """Return a host's address."""
        return self._addresses[host]

    def open_on(self, host: str) -> set[str]:
        """Return the addresses at which others reach a host, as `ADDRESS:PORT`."""
        words = (*self.prefix(host), "ss", "--no-header", "-l", "-n", "-t", "-u")
        lines = subprocess.run(words, capture_output=True, text=True, check=True).stdout
        addresses = {line.split()[4] for line in lines.splitlines()}
        return {each for each in addresses if not each.startswith(("127.", "[::1]"))}

    def split(self, *groups: Collection[str]) -> None:
        """Split the network into groups that do not hear each other; the office hears all."""
        for group in groups:
            others = [self._addresses[name] for name in self._hosts if name not in group]
            for name in group:
                self._filter(name, f"iifname eth0 ip saddr {{ {', '.join(others)} }} drop")

    def unplug(self, host: str) -> None:
        """Make a host vanish for all others and the office."""
        self._filter(host, "iifname eth0 drop", "oifname eth0 drop")

    def deafen(self, host: str) -> None:
        """Make a host deaf, though it can speak."""
        others = [a for name, a in self._addresses.items() if name != host]
        self._filter(host, f"iifname eth0 ip saddr {{ {', '.join(others)} }} drop")

    def lose_office(self) -> None:
        """Make all hosts deaf for the office alone."""
        for name in self._hosts:
            self._filter(name, f"iifname eth0 ip saddr {OFFICE} drop")

    def lose(self, percent: int) -> None:
        """Lose a share of the packets that reach each host."""
        for name in self._hosts:
            self._filter(name, f"iifname eth0 numgen random mod 100 < {percent} drop")

    def limit(self, host: str, kilobytes: int) -> None:
        """Let a host hear only so many kilobytes a second."""
        self._filter(host, f"iifname eth0 limit rate over {kilobytes} kbytes/second drop")

    def heal(self, *hosts: str) -> None:
        """Restore the links of some hosts, by default of all."""
        for name in hosts or self._hosts:
            self._filter(name)

    def end(self) -> None:
        """Remove the hosts; processes that still run there have no network any more."""
        for holder in self._hosts.values():
            holder.kill()
            holder.wait()

    def _plug_in(self, name: str) -> None:
        """Create a host, which lives as long as the process that holds it."""
        number = len(self._hosts)
        own = Path("/proc/self/ns/net").readlink()
        holder = subprocess.Popen(["unshare", "--net", "sleep", "infinity"])
        self._hosts[name] = holder
        end = time.monotonic() + _WITHIN
        while Path(_namespace(holder.pid)).readlink() == own:
            if time.monotonic() > end:
                raise NoNetworkError(f"unshare made no network within {_WITHIN:g} s")
            time.sleep(_LOOK_EVERY)
        cable = f"host{number}"
        card = ("eth0", "netns", str(holder.pid))
        _run("ip", "link", "add", cable, "type", "veth", "peer", "name", *card)
        _run("ip", "link", "set", cable, "master", "office", "up")
        on_host = self.prefix(name)
        _run(*on_host, "ip", "address", "add", f"{self._addresses[name]}/24", "dev", "eth0")
        _run(*on_host, "ip", "link", "set", "lo", "up")
        _run(*on_host, "ip", "link", "set", "eth0", "up")

    def _filter(self, host: str, *rules: str) -> None:
        """Replace a host's packet filter at once."""
        chains = ""
        for hook, card in (("input", "iifname"), ("output", "oifname")):
            chosen = "".join(f"{rule}\n" for rule in rules if rule.startswith(card))
            chains += f"chain {hook} {{\ntype filter hook {hook} priority 0\n{chosen}}}\n"
        table = f"add table inet hive\ndelete table inet hive\ntable inet hive {{\n{chains}}}\n"
        _run(*self.prefix(host), "nft", "-f", "-", text=table)


@contextlib.contextmanager
def network_of(names: Sequence[str]) -> Iterator[LiveNetwork]:
    """Run hosts on a network of their own; skip the test where none can be created."""
    try:
        network = LiveNetwork(names)
    except NoNetworkError as error:
        pytest.skip(f"{error}")
    try:
        yield network
    finally:
        network.end()


def _leave_the_machines_network() -> None:
    missing = [program for program in NEEDS if not shutil.which(program)]
    if missing:
        raise NoNetworkError(f"needs {', '.join(missing)}")
    if ctypes.CDLL(None, use_errno=True).unshare(_CLONE_NEWNET):  # os.unshare is Python 3.12's
        raise NoNetworkError(
            f"no network namespace: {os.strerror(ctypes.get_errno())}; needs root"
        )


def _namespace(pid: int) -> str:
    return f"/proc/{pid}/ns/net"


def _run(*command: str, text: str = "") -> None:
    """Run a command of the system.

    Raises:
        NoNetworkError: It failed; the text is what it said.
    """
    done = subprocess.run(command, input=text, text=True, capture_output=True, check=False)
    if done.returncode:
        raise NoNetworkError(f"{' '.join(command)}: {done.stderr.strip()}")
