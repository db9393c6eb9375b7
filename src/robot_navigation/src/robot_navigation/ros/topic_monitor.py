# SPDX-License-Identifier: BSD-3-Clause
"""Notices what a node waits for in vain, so that it can be said once and not with every round."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable


class Overdue:
    """Keeps an eye on what should come in again and again."""

    def __init__(self, names: Iterable[str], patience: float, now: float) -> None:
        """Expect something of each name.

        Args:
            names: Of what is expected.
            patience: How long nothing may come in [s].
            now: On a clock that never jumps [s].
        """
        self._patience = patience
        self._since = dict.fromkeys(names, now)
        self._told: set[str] = set()

    def came(self, name: str, now: float) -> None:
        """Note that something came in at a time [s]."""
        self._since[name] = now
        self._told.discard(name)

    def news(self, now: float) -> list[str]:
        """Return what is overdue at a time [s] and has not been returned since it last came."""
        late = [
            name
            for name, since in self._since.items()
            if now - since >= self._patience and name not in self._told
        ]
        self._told.update(late)
        return late
