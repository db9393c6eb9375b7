# SPDX-License-Identifier: BSD-3-Clause
"""Delivers odd messages to hives at work, and finds out what they could not stand.

Each batch of messages has a hive of its own. Most odd messages are refused or make no difference.
Some are valid lies: a forged order, or a report that something is done. The hive gets over them,
so the next good task has to be done.

From lies about the consensus no Raft hive need recover: if a forged leader makes the followers
forget their log, or forged members get the votes, it may wait for ever. What passes the border on
those topics is therefore delivered last, and only has to end no process.
"""

from __future__ import annotations

import traceback
from collections import Counter
from dataclasses import dataclass, field
from random import Random

from blackboard.board.intake import why_refused
from blackboard.board.reception import FAIL_STOP
from blackboard.codec.tables import WIRES
from blackboard.domain.task import TaskType
from hive_lab.fuzz.hive_at_work import BLACKBOARD, ROBOTS, HiveAtWork
from hive_lab.fuzz.mutations import Mutations

BATCH = 200
"""Messages for one hive."""

DECISIONS = ("distributed", "planned")
"""How hives decide, in turn."""

_DEED_EVERY = 10  # messages; so often the operator does something
_PAUSE = 0.15  # at most, between two messages [s]
_SETTLE = 20.0  # until the hive has got over most lies [s]
_PATIENCE = 300.0  # for the next good task; leases and retries take their time [s]


@dataclass
class Found:
    """What became of the messages.

    Attributes:
        messages: How many were delivered, by topic.
        refused: How many of them no member has taken, because the border refuses them.
        done: Hives that have done the good task after their batch.
        failures: What went wrong, in words with the messages before; empty if nothing did.
    """

    messages: Counter[str] = field(default_factory=Counter)
    refused: int = 0
    done: int = 0
    failures: list[str] = field(default_factory=list)

    def add(self, other: Found) -> None:
        """Add what another run has found."""
        self.messages += other.messages
        self.refused += other.refused
        self.done += other.done
        self.failures += other.failures


class Batch:
    """One hive and its odd messages."""

    def __init__(self, seed: int, messages: int, decision: str) -> None:
        self.found = Found()
        self._name = f"seed {seed}, {decision}"
        self._messages = messages
        self._random = Random(seed)
        self._hive = HiveAtWork(seed, decision)
        self._mutations = Mutations(self._random)
        self._told: list[str] = []

    def run(self) -> Found:
        """Deliver all of them, and check what has to hold."""
        try:
            lies = self._flood()
            self._settle()
            for name, topic, message, what in lies:
                self._deliver(name, topic, message, what)
            self._hive.network.run(_SETTLE)
        except Exception:  # noqa: BLE001  (any exception that left a member is what is looked for)
            self._fail(f"a process ended:\n{traceback.format_exc()}")
        for text in (text for talker in self._hive.talkers for text in talker.warnings):
            if "defect of the hive" in text:
                self._fail(f"the border let through what the second line has caught: {text}")
        return self.found

    def _flood(self) -> list[tuple[str, str, object, str]]:
        """Deliver odd messages; return those that are lies about the consensus."""
        lies = []
        for number in range(self._messages):
            if number % _DEED_EVERY == 0:
                self._hive.go_on(number // _DEED_EVERY)
            self._hive.network.run(self._random.uniform(0.0, _PAUSE))
            name, topic, message, what = self._odd()
            self.found.messages[topic] += 1
            is_refused = _is_refused(topic, message)
            self.found.refused += is_refused
            if topic in FAIL_STOP and not is_refused:
                lies.append((name, topic, message, what))
            else:
                self._deliver(name, topic, message, what)
        return lies

    def _settle(self) -> None:
        hive = self._hive
        hive.all_good()
        hive.network.run(_SETTLE)
        hive.all_good()
        if hive.does(hive.post(TaskType.GA), _PATIENCE):
            self.found.done += 1
        else:
            self._fail("the next good task is not done")

    def _odd(self) -> tuple[str, str, object, str]:
        """Return an odd message: name of the topic, the topic, the message, what is odd."""
        said = self._hive.said
        topic = self._random.choice(sorted(said))
        name, data = self._random.choice(said[topic])
        self._mutations.names = (BLACKBOARD, *ROBOTS, *self._hive.posted[-6:])
        message, what = self._mutations.mutate(data, WIRES[topic].message)
        return name, topic, message, f"{name}: {what}"

    def _deliver(self, name: str, topic: str, message: object, what: str) -> None:
        self._told.append(what)
        self._hive.deliver(name, topic, message)
        self._hive.network.run(0.002)

    def _fail(self, what: str) -> None:
        last = "\n  ".join(self._told[-5:])
        self.found.failures.append(f"{self._name}: {what}\nThe last odd messages:\n  {last}")


def _is_refused(topic: str, message: object) -> bool:
    try:
        return bool(why_refused(topic, WIRES[topic].from_msg(message)))
    except Exception:  # noqa: BLE001  (the members meet it too, and count it)
        return True


def fuzz(seed: int, messages: int) -> Found:
    """Deliver a number of odd messages, in batches.

    Args:
        seed: The same seed gives the same run.
        messages: How many; rounded up to whole batches.
    """
    found = Found()
    for number in range(-(-messages // BATCH)):
        batch = Batch(seed * 1000 + number, BATCH, DECISIONS[number % len(DECISIONS)])
        found.add(batch.run())
    return found
