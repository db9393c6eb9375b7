# SPDX-License-Identifier: BSD-3-Clause
"""Every number and name that a user may set; `config/*.yaml` is the manual to them."""

from __future__ import annotations

from dataclasses import dataclass, fields

from blackboard.errors import SettingsError

COST_MODEL_NAMES = ("report", "energy", "time", "makespan", "latency")
"""The cost models that fleet files may name; `costing.cost.COST_MODELS` holds them."""

MEASURE_NAMES = ("way", "makespan", "waiting")
"""What reallocation may make smaller; `costing.cost.MEASURES` computes them."""

ON_ROBOT_LOST = ("reassign", "wait", "operator")
"""What becomes of a task whose robot is lost: another robot, the same one, or a person decides."""

MAX_DRIFT = 0.01
"""How far the speed of a member's clock may be from the truth, as a share."""

_MIN_SILENCE = 2.0
"""Under 30 % packet loss a heartbeat at 10 Hz paused for up to 1.8 s (docs/benchmarks.md) [s]."""

STANDING_BY = 12
"""Robots that stand by to carry the blackboard where nobody says how many: with the blackboard
node these are the seven that have a vote and six to follow them."""

DECISIONS = ("distributed", "centralized")
"""Who works bids out: every robot its own, or the active blackboard those of all."""

DISTANCES = ("path", "euclidean")
"""How the length of a way is measured: on the map, or as the crow flies."""


def longest_lease(robot_lease: float) -> float:
    """Return how long a lease [s] by the slowest clock may last by the fastest one [s]."""
    return robot_lease * (1 + 2 * MAX_DRIFT)


@dataclass(frozen=True)
class Settings:
    """Checks what all settings have in common: numbers are above 0, names are known ones.

    Raises:
        SettingsError: A value is not allowed; the text names it and what is.
    """

    def __post_init__(self) -> None:
        names = {
            "cost_model": COST_MODEL_NAMES,
            "decision": DECISIONS,
            "improve_by": MEASURE_NAMES,
            "distance": DISTANCES,
            "on_robot_lost": ON_ROBOT_LOST,
        }
        for each in fields(self):
            value = getattr(self, each.name)
            if each.name in names:
                if value not in names[each.name]:
                    allowed = ", ".join(names[each.name])
                    raise SettingsError(f"{each.name} is {value!r}; allowed: {allowed}")
            elif not 0 < value < float("inf"):
                raise SettingsError(f"{each.name} is {value!r}; allowed: above 0")


@dataclass(frozen=True)
class RaftSettings(Settings):
    """How often the active blackboard speaks, and how long the hive waits for it.

    Attributes:
        heartbeat: Time between two heartbeats [s].
        self_demotion: An active blackboard that no majority has followed for longer steps down
            [s]; at least five heartbeats.
        election: The active blackboard has to be silent for this long before another is elected
            [s]; longer than `self_demotion`, and at least 2 s, which lost messages alone do not
            reach.
        stagger: By how much members stand after each other [s].
        member_timeout: A member that is silent for longer is taken off the list [s].
        most_members: More members than this hold the list but have no vote.
        kept_changes: Changes that are kept for members that missed some; who missed more gets
            the whole list.
        sync_period: Least time between two copies of the task list [s]; changes within it are
            sent together.
    """

    heartbeat: float = 0.2
    self_demotion: float = 1.8
    election: float = 2.2
    stagger: float = 0.25
    member_timeout: float = 10.0
    most_members: int = 7
    kept_changes: int = 128
    sync_period: float = 0.2

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.self_demotion < 5 * self.heartbeat:
            raise SettingsError(
                f"self_demotion is {self.self_demotion:g} s; allowed: at least 5 heartbeats, "
                f"which are {5 * self.heartbeat:g} s"
            )
        if self.election < _MIN_SILENCE:
            raise SettingsError(
                f"election is {self.election:g} s; allowed: at least {_MIN_SILENCE:g} s"
            )
        slow_demotion = self.self_demotion * (1 + MAX_DRIFT) / (1 - MAX_DRIFT)
        if self.election <= slow_demotion:
            raise SettingsError(
                f"election is {self.election:g} s; allowed: above {slow_demotion:.3g} s, which a "
                f"self_demotion of {self.self_demotion:g} s may last on a slow clock"
            )


@dataclass(frozen=True)
class BlackboardSettings(Settings):
    """How patient the blackboard is.

    Attributes:
        decision: A name of `DECISIONS`.
        bid_timeout: Longest time that an auction stays open [s].
        robot_lease: How long a robot works on without hearing that it was heard [s].
        lease_margin: Time that a robot takes to come to a stop, and a little more [s].
        reassign: A robot that is silent for longer is lost [s]. It has to have stopped by then, so
            this is more than its lease and the margin; clocks may differ by 2 %.
        on_robot_lost: A name of `ON_ROBOT_LOST`.
        overdue_factor: A robot that takes so many times as long as it has promised ...
        overdue_grace: ... and this much longer [s] has to hand the task back.
        order_timeout: An order that a robot's status does not show by then is given again [s].
        retry_period: What nobody could take is auctioned again after this time, even if nothing
            seems to have changed [s].
        most_hand_backs: A task that robots have tried in vain this often is given up.
        improve_period: Time between two steps in which tasks that have not begun are offered to
            other robots [s].
        improve_by: What is made less by that: a name of `cost.MEASURES`.
        improve_threshold: They change hands only where it becomes less by more than this share of
            what they take; at 1 or more nothing changes hands.
        most_asked: Of more robots than this those that are likely to win are asked for bids first,
            the others only for what none of these can take.
        offers_each: One call for bids offers at most so many tasks for each robot that it asks,
            the most urgent first.
        most_bids: One call for bids asks for at most so many bids.
        keep_ended: What has ended stays on the list for that long [s].
        most_ended: Of more tasks that have ended than this the oldest go earlier, though not
            within 10 s.
    """

    decision: str = "distributed"
    bid_timeout: float = 2.0
    robot_lease: float = 3.5
    lease_margin: float = 0.5
    reassign: float = 5.0
    on_robot_lost: str = "reassign"
    overdue_factor: float = 2.0
    overdue_grace: float = 60.0
    order_timeout: float = 2.0
    retry_period: float = 30.0
    most_hand_backs: int = 5
    improve_period: float = 2.0
    improve_by: str = "waiting"
    improve_threshold: float = 0.05
    most_asked: int = 50
    offers_each: int = 4
    most_bids: int = 2_000
    keep_ended: float = 3600.0
    most_ended: int = 500

    def __post_init__(self) -> None:
        super().__post_init__()
        stopped = longest_lease(self.robot_lease) + self.lease_margin
        if not stopped < self.reassign:
            raise SettingsError(
                f"reassign is {self.reassign!r}; allowed: above robot_lease "
                f"{self.robot_lease!r} x 1.02 + lease_margin {self.lease_margin!r} = {stopped:g}, "
                "because a robot has to have stopped before its task is given to another"
            )


@dataclass(frozen=True)
class RobotSettings(Settings):
    """How a robot bids and speaks.

    Attributes:
        cost_model: A name of `COST_MODELS`.
        aging: A task that has waited this long [s] counts twice as much under `latency` as a new
            one, after twice that time four times, and so on.
        status_period: Time between two statuses, and before a report is repeated [s].
    """

    cost_model: str = "report"
    aging: float = 120.0
    status_period: float = 1.0


@dataclass(frozen=True)
class ChargingSettings(Settings):
    """When a robot charges: levels of its battery from 0 to 1, each above the one before.

    Attributes:
        critical: Below it goes at once, after putting down what its arm has taken on board.
        low: Below it goes when it is idle.
        enough: While it charges, it takes tasks again from here on.
        full: From here on it makes room for others.
    """

    critical: float = 0.15
    low: float = 0.3
    enough: float = 0.6
    full: float = 0.95

    def __post_init__(self) -> None:
        super().__post_init__()
        levels = (self.critical, self.low, self.enough, self.full)
        if not (levels == tuple(sorted(set(levels))) and self.full <= 1.0):
            raise SettingsError(
                f"critical, low, enough, full are {', '.join(f'{level:g}' for level in levels)}; "
                "allowed: each above the one before, full at most 1"
            )


@dataclass(frozen=True)
class ControllerSettings(Settings):
    """How patient a controller is.

    Attributes:
        attempts: How often a step is tried before the task is given up.
        retry_delay: Pause before it is tried again [s].
        server_timeout: An action server that is silent for longer counts as lost [s].
    """

    attempts: int = 3
    retry_delay: float = 3.0
    server_timeout: float = 5.0


@dataclass(frozen=True)
class PathSettings(Settings):
    """How the length of a way is measured.

    Attributes:
        distance: A name of `DISTANCES`.
    """

    distance: str = "path"
