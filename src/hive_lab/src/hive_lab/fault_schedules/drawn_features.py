# SPDX-License-Identifier: BSD-3-Clause
"""Draws what a fleet file can set: the blackboard's settings, robots, chargers, heavy tasks.

The chances are independent of those of the faults, so that a feature that is added here leaves the
faults of a seed as they are.
"""

from __future__ import annotations

from dataclasses import replace
from random import Random
from typing import TYPE_CHECKING

from attrs import evolve

from blackboard.domain.battery import BatteryModel
from blackboard.domain.settings import (
    COST_MODEL_NAMES,
    DECISIONS,
    MEASURE_NAMES,
    ON_ROBOT_LOST,
    RobotSettings,
)
from blackboard.domain.task import MAX_PRIORITY, TaskType
from blackboard.robot.charging import ChargingPlan
from hive_common.pose import Pose
from hive_lab.fault_schedules.features.kit import RobotKit
from hive_lab.fault_schedules.schedule import Post
from hive_lab.virtual.hive import SMALL_ROBOT

if TYPE_CHECKING:
    from blackboard.domain.settings import BlackboardSettings
    from blackboard.domain.task import Task
    from hive_lab.fault_schedules.schedule import FaultSchedule

_PLAIN = 0.2  # share of the schedules with equal robots and default settings
_URGENT = 0.25  # share of the tasks that interrupt others
_HEAVY = 0.2  # share of the tasks without a pick that no robot can carry alone
_WITH_LEARNERS = 0.4  # share of the schedules with robots that have no vote
_WITH_CHARGERS = 0.5
_STRONG = 90.0  # what a strong robot carries [kg]
_FEWEST_VOTING = 2  # robots; with the blackboard node they survive the loss of one

_CHARGERS = {"dock1": Pose(-2.0, 0.0), "dock2": Pose(-2.0, 4.0), "dock3": Pose(-2.0, 8.0)}

_SMALL_BATTERY = BatteryModel(
    capacity=0.2, voltage_full=28.0, voltage_empty=22.0, charging_time=30.0
)
"""Lasts for some minutes, so that robots charge within a schedule."""


def with_features(schedule: FaultSchedule) -> FaultSchedule:
    """Return a schedule whose fleet, settings and tasks use what a fleet file can set."""
    random = Random(f"features {schedule.seed}")
    if random.random() < _PLAIN:
        return schedule
    return replace(
        schedule,
        board=_board(random, schedule.board),
        kits=_kits(random, schedule.robots),
        aside=_aside(random, schedule.robots),
        happenings=tuple(
            replace(each, task=_task(random, each.task)) if isinstance(each, Post) else each
            for each in schedule.happenings
        ),
    )


def with_strong_robot(schedule: FaultSchedule) -> FaultSchedule:
    """Return a schedule whose last robot carries what no other robot does."""
    kits = list(schedule.kits or [RobotKit()] * schedule.robots)
    kits[-1] = replace(kits[-1], characteristics=replace(SMALL_ROBOT, payload=_STRONG))
    return replace(schedule, kits=tuple(kits))


def with_one_charger(schedule: FaultSchedule) -> FaultSchedule:
    """Return a schedule whose robots charge at the same charger, soon and in little time."""
    random = Random(f"charger {schedule.seed}")
    name = next(iter(_CHARGERS))
    plan = ChargingPlan({name: _CHARGERS[name]})
    battery = replace(_SMALL_BATTERY, charging_time=random.choice([4.0, 12.0]))
    return replace(
        schedule,
        kits=tuple(
            replace(
                kit,
                characteristics=replace(kit.characteristics, battery=battery),
                charge=random.choice([0.25, 0.5, 1.0]),
                charging=plan,
            )
            for kit in schedule.kits or [RobotKit()] * schedule.robots
        ),
    )


def _board(random: Random, board: BlackboardSettings) -> BlackboardSettings:
    return evolve(
        board,
        decision=random.choice(DECISIONS),
        on_robot_lost=random.choice(ON_ROBOT_LOST),
        bid_timeout=random.choice([0.5, 2.0]),
        overdue_grace=random.choice([1.0, 60.0]),
        order_timeout=random.choice([0.7, 2.0]),
        retry_period=random.choice([3.0, 10.0]),
        most_hand_backs=random.choice([2, 5]),
        improve_period=random.choice([0.7, 2.0]),
        improve_by=random.choice(MEASURE_NAMES),
        most_asked=random.choice([1, 50]),
        offers_each=random.choice([1, 4]),
    )


def _kits(random: Random, robots: int) -> tuple[RobotKit, ...]:
    alike, stalls = random.choice([True, False]), random.choice([0.0, 0.2])
    chargers = _chargers(random)
    cost_model, aging = random.choice(COST_MODEL_NAMES), random.choice([20.0, 120.0])
    kits = [_kit(random, chargers, stalls) for _ in range(robots)]
    if alike:
        kits = [replace(kits[0], charge=kit.charge) for kit in kits]
    return tuple(replace(kit, settings=RobotSettings(cost_model, aging)) for kit in kits)


def _chargers(random: Random) -> ChargingPlan:
    if random.random() >= _WITH_CHARGERS:
        return ChargingPlan()
    count = random.randint(1, len(_CHARGERS))
    return ChargingPlan(dict(list(_CHARGERS.items())[:count]))


def _kit(random: Random, charging: ChargingPlan, stalls: float) -> RobotKit:
    arm = random.random() < 0.7  # noqa: PLR2004  (a share: most robots have an arm)
    body = replace(
        SMALL_ROBOT,
        payload=random.choice([5.0, 12.0, 20.0]),
        max_speed=random.choice([0.5, 1.0, 2.0]),
        arm_payload=5.0 if arm else 0.0,
    )
    if not charging.chargers:
        return RobotKit(body, stalls=stalls)
    body = replace(body, battery=_SMALL_BATTERY)
    return RobotKit(body, charge=random.choice([0.25, 0.5, 1.0]), charging=charging, stalls=stalls)


def _aside(random: Random, robots: int) -> tuple[str, ...]:
    names = [f"robot{number + 1}" for number in range(_FEWEST_VOTING, robots)]
    if not names or random.random() >= _WITH_LEARNERS:
        return ()
    return tuple(sorted(random.sample(names, random.randint(1, len(names)))))


def _task(random: Random, task: Task) -> Task:
    """Return a task that may be urgent, and may be too heavy for any robot."""
    if random.random() < _URGENT:
        task = replace(task, priority=MAX_PRIORITY)
    if not TaskType(task.type).picks and random.random() < _HEAVY:
        task = replace(task, payload=random.choice([15.0, 30.0, 60.0]))
    return task
