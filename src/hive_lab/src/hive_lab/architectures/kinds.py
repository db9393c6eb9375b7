# SPDX-License-Identifier: BSD-3-Clause
"""The architectures by name."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from blackboard.domain.settings import BlackboardSettings
from hive_lab.architectures.central import CentralFleet
from hive_lab.architectures.contract_net import ContractNet
from hive_lab.architectures.hive import AppendingRobot, Hive

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from hive_lab.architectures.trial import Architecture, Trial


class Kind(NamedTuple):
    """An architecture.

    Attributes:
        title: What people call it.
        put_into: Builds one with the fleet of a trial.
        is_hive: Whether it is the hive, with some settings.
    """

    title: str
    put_into: Callable[[Trial], Architecture]
    is_hive: bool = False


def _report(trial: Trial) -> Hive:
    # One task at a time, so each is bid for once and goes to the lowest bid.
    return Hive(trial, BlackboardSettings(most_bids=1), "report", AppendingRobot)


def _auctions(trial: Trial) -> Hive:
    return Hive(trial, BlackboardSettings(), "latency")


def _planned(trial: Trial) -> Hive:
    return Hive(trial, BlackboardSettings(decision="planned"), "latency")


ARCHITECTURES: Mapping[str, Kind] = MappingProxyType(
    {
        "report": Kind("the report's blackboard", _report, is_hive=True),
        "auctions": Kind("sequential auctions", _auctions, is_hive=True),
        "planned": Kind("planned", _planned, is_hive=True),
        "central": Kind("central dispatcher", CentralFleet),
        "contract_net": Kind("contract net", ContractNet),
    }
)
"""The architectures by name."""
