# SPDX-License-Identifier: BSD-3-Clause
"""The architectures by name."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from hive_lab.architectures.central import CentralFleet
from hive_lab.architectures.contract_net import ContractNet
from hive_lab.architectures.hive import AppendingRobot, Hive
from hive_lab.architectures.trial import Choices

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from hive_lab.architectures.trial import Architecture, Trial


def report(trial: Trial) -> Hive:
    """Put the report's blackboard into a trial.

    Robots bid for one task at a time, so each is bid for once and goes to the lowest bid.
    """
    return Hive(trial, AppendingRobot, decision="distributed", most_bids=1)


BUILDERS: Mapping[str, Callable[[Trial], Architecture]] = MappingProxyType(
    {"hive": Hive, "report": report, "central": CentralFleet, "contract_net": ContractNet}
)
"""What puts an architecture into a trial, by the names of `client.comparison.ARCHITECTURES`."""


class Kind(NamedTuple):
    """An architecture with choices.

    Attributes:
        title: What people call it.
        builder: A name in `BUILDERS`.
        choices: How it decides.
    """

    title: str
    builder: str
    choices: Choices = Choices()

    @property
    def is_hive(self) -> bool:
        """Whether it is the hive, with some settings."""
        return self.builder in {"hive", "report"}

    def put_into(self, trial: Trial) -> Architecture:
        """Build one with the fleet of a trial."""
        return BUILDERS[self.builder](trial)


ARCHITECTURES: Mapping[str, Kind] = MappingProxyType(
    {
        "report": Kind("the report's blackboard", "report", Choices(cost_model="report")),
        "auctions": Kind("sequential auctions", "hive", Choices(decision="distributed")),
        "planned": Kind("planned", "hive"),
        "central": Kind("central dispatcher", "central"),
        "contract_net": Kind("contract net", "contract_net"),
    }
)
"""What `bench architectures` measures, by name."""
