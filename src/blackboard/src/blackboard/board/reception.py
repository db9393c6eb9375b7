# SPDX-License-Identifier: BSD-3-Clause
"""What every message passes on its way to the handlers of a member, whatever brings it.

The first line of defence is `intake`: what it refuses never reaches a handler. The second line is
here. An exception that a message causes ends the handling of that message, not the process. It is
a defect of the hive, so it is counted and logged with the message.

The steps of the consensus are fail-stop: a member whose handling of them fails may have half a
state, and must not go on with it.
"""

from __future__ import annotations

import traceback
from typing import TYPE_CHECKING, Any

from blackboard.board.intake import why_refused
from blackboard.board.refusals import Refusals, is_power_of_ten
from blackboard.domain.talker import BACKUP, BB_ACK, BB_ENTRIES, BB_VOTE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

FAIL_STOP = frozenset({BACKUP, BB_ENTRIES, BB_ACK, BB_VOTE})
"""Topics of the consensus, on which an exception of a handler ends the process."""

MAX_INPUT = 1000
"""Characters of a message that are logged."""

MAX_FAILURES = 100
"""Distinct failures that are logged; further ones are only counted."""


class Failures:
    """Counts exceptions that messages caused, and has `say` log each distinct one once."""

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._by_topic: dict[str, int] = {}
        self._counts: dict[tuple[str, str], int] = {}

    @property
    def total(self) -> int:
        """Number of all failures."""
        return sum(self._by_topic.values())

    def by_topic(self) -> dict[str, int]:
        """Return the number of failures by topic."""
        return dict(self._by_topic)

    def note(self, topic: str, message: object, error: Exception) -> None:
        """Count a failure on a topic, and log it with the message the first time."""
        self._by_topic[topic] = self._by_topic.get(topic, 0) + 1
        where = "".join(traceback.format_tb(error.__traceback__))
        key = (topic, f"{type(error).__name__}{where}")
        if key not in self._counts and len(self._counts) >= MAX_FAILURES:
            return
        count = self._counts[key] = self._counts.get(key, 0) + 1
        what = f"the handling of a message on {topic} failed: {type(error).__name__}: {error}"
        if count == 1:
            self._say(
                f"{what}. This is a defect of the hive, please report it with this log; only this "
                f"message is lost. The message: {_shortened(message)}\n{where}"
            )
        elif is_power_of_ten(count):
            self._say(f"{what}, {count} times so far")


class Reception:
    """Checks what arrives at the members of a process, and hands it to their handlers.

    Args:
        say: Warns the person who runs this member.

    Attributes:
        refusals: What was refused so far.
        failures: The exceptions that messages have caused so far.
    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self.refusals = Refusals(say)
        self.failures = Failures(say)

    def read(
        self,
        topic: str,
        message: object,
        decode: Callable[[Any], Any],
        also: Callable[[Any], str] = lambda _value: "",
    ) -> Any:  # noqa: ANN401  (a topic's)
        """Return the value that a message stands for; None if it is refused or fails.

        Args:
            topic: Where it came.
            message: What came.
            decode: Makes the value of it; raises ValueError if it stands for none.
            also: Says why a value is refused that `intake` lets through; empty if it is not.
        """
        try:
            value = decode(message)
            reason = why_refused(topic, value) or also(value)
        except ValueError as error:
            reason = str(error)
        except Exception as error:  # noqa: BLE001  (a defect of the check must not end the process)
            self.failures.note(topic, message, error)
            return None
        if reason:
            self.refusals.refuse(topic, reason)
            return None
        return value

    def hand(self, topic: str, value: object, handlers: Iterable[Callable[[Any], None]]) -> None:
        """Hand a value to each handler; one that fails keeps it from no other.

        Raises:
            Exception: What a handler of a topic in `FAIL_STOP` raises.
        """
        for handler in handlers:
            try:
                handler(value)
            except Exception as error:
                if topic in FAIL_STOP:
                    raise
                self.failures.note(topic, value, error)


def _shortened(message: object) -> str:
    text = repr(message)
    left_out = len(text) - MAX_INPUT
    return f"{text[:MAX_INPUT]} ... and {left_out} more characters" if left_out > 0 else text
