# SPDX-License-Identifier: BSD-3-Clause
"""Watches over the robots: who is there, who may go on, who is lost, who is overdue.

A status renews its robot's lease, unless the robot has a task in its schedule that is not its own
or has not handed back what it was told to. So whatever the blackboard no longer wants done stops
in the end, even on a robot that cannot hear it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from blackboard.board.charger_grants import ChargerGrants
from blackboard.board.deadlines import Deadlines
from blackboard.board.recovery import after_loss
from blackboard.consensus.lease import Leases
from blackboard.domain.characteristics import RobotState
from blackboard.domain.record import OrderKind
from blackboard.domain.talker import ROBOT_STATUS
from blackboard.domain.task import TaskState
from hive_common.last_heard import FORGOTTEN_AFTER

if TYPE_CHECKING:
    from collections.abc import Collection

    from blackboard.board.orders import Orders
    from blackboard.consensus.node import RaftNode
    from blackboard.domain.characteristics import RobotStatus
    from blackboard.domain.record import TaskRecord
    from blackboard.domain.settings import BlackboardSettings
    from blackboard.domain.talker import Talker


_CHARGE_STEP = 0.05
"""A robot that has charged by this much may now take what it refused before."""


@dataclass(frozen=True, slots=True)
class _Seen:
    status: RobotStatus
    heard: float
    charge: float
    is_lost: bool

    @property
    def in_service(self) -> bool:
        return self.status.state.in_service and not self.is_lost


class Presence:
    """Keeps the last status of every robot.

    Args:
        timeout: A robot that is silent for longer counts as offline [s].
    """

    def __init__(self, timeout: float) -> None:
        self._timeout = timeout
        self._seen: dict[str, _Seen] = {}
        self._in_service: frozenset[str] = frozenset()

    def hear(self, status: RobotStatus, now: float, *, is_lost: bool = False) -> bool:
        """Note a status; return whether the robot may now bid better than before.

        A robot whose lease is lost takes no tasks, whatever its status says.
        """
        before = self._seen.get(status.robot_id)
        known_charge = status.charge if before is None else before.charge
        charged = status.charge - known_charge >= _CHARGE_STEP
        charge = status.charge if charged else min(status.charge, known_charge)
        seen = _Seen(status, now, charge, is_lost)
        self._note(seen)
        if before is None:
            return seen.in_service
        returned = seen.in_service and not before.in_service
        relieved = not set(before.status.tasks) <= set(status.tasks)
        moved = status.map != before.status.map  # other places can be reached now
        return returned or relieved or charged or moved

    def knows(self, robot_id: str) -> bool:
        """Return whether a robot was ever heard."""
        return robot_id in self._seen

    def known(self) -> frozenset[str]:
        """Return the names of all robots that were heard and are not forgotten."""
        return frozenset(self._seen)

    def in_service(self) -> frozenset[str]:
        """Return the names of the robots that take tasks."""
        return self._in_service

    def fleet(self) -> tuple[RobotStatus, ...]:
        """Return the last statuses of all robots that were heard and are not forgotten."""
        return tuple(seen.status for seen in self._seen.values())

    def last(self, robot_id: str) -> RobotStatus | None:
        """Return the last status of a robot; None if it was never heard."""
        seen = self._seen.get(robot_id)
        return None if seen is None else seen.status

    def silent(self, now: float) -> tuple[RobotStatus, ...]:
        """Mark robots as offline that are silent for too long; return the last status of each."""
        offline = tuple(
            replace(
                seen.status,
                state=RobotState.OFFLINE,
                reason=f"not heard for {now - seen.heard:.0f} s",
            )
            for seen in self._seen.values()
            if now - seen.heard > self._timeout
        )
        for status in offline:
            self._note(replace(self._seen[status.robot_id], status=status))
        return offline

    def forget(self, now: float, holders: Collection[str]) -> tuple[str, ...]:
        """Forget robots that have left and hold no task; return their names."""
        gone = tuple(
            name
            for name, seen in self._seen.items()
            if now - seen.heard >= FORGOTTEN_AFTER and name not in holders
        )
        for name in gone:
            del self._seen[name]
        self._in_service = self._in_service.difference(gone)
        return gone

    def _note(self, seen: _Seen) -> None:
        name = seen.status.robot_id
        self._seen[name] = seen
        if seen.in_service != (name in self._in_service):
            self._in_service ^= {name}


class Watch:
    """Grants leases and finds the tasks that have to be taken from their robots."""

    def __init__(
        self,
        talker: Talker,
        node: RaftNode,
        orders: Orders,
        presence: Presence,
        settings: BlackboardSettings,
    ) -> None:
        self._talker = talker
        self._node = node
        self._orders = orders
        self._presence = presence
        self._settings = settings
        self._chargers = ChargerGrants(node)
        self.begin()

    def begin(self) -> None:
        """Count leases and deadlines from now on; those before were another blackboard's."""
        settings = self._settings
        self._leases = Leases(settings.reassign, self._talker.now())
        self._deadlines = Deadlines(settings.overdue_factor, settings.overdue_grace)
        self._late: dict[tuple[str, int], str] = {}
        self._kept: set[str] = set()

    def hear(self, status: RobotStatus) -> bool:
        """Take in a robot's status; return whether it may now bid better than before."""
        if status.state is RobotState.OFFLINE:
            return False
        now, robot_id = self._talker.now(), status.robot_id
        if not self._node.may_act():
            return self._presence.hear(status, now)
        in_accord = self._orders.compare(status, is_lost=self._leases.is_lost(robot_id, now))
        if in_accord and not self._has_to_hand_back(robot_id):
            self._leases.grant(robot_id, now)
            self._node.grant(robot_id, status.sent, self._settings.robot_lease)
            self._chargers.hear(status)
        return self._presence.hear(status, now, is_lost=self._leases.is_lost(robot_id, now))

    def look(self) -> list[TaskRecord]:
        """Return the records that change because a robot is lost or has come back.

        Also speaks for robots that are silent, and recalls overdue tasks.
        """
        now = self._talker.now()
        held = self._orders.held()
        self._tell_of_silent(held, now)
        for name in self._presence.forget(now, {record.robot for record in held}):
            self._leases.forget(name)
            self._orders.forget_robot(name)
        self._recall(held, self._talker.world.now())
        self._chargers.ask_for_room(self._presence.fleet())
        self._chargers.look(
            is_lost=lambda name: self._leases.is_lost(name, now),
            is_gone=lambda name: self._leases.unheard_for(name, now) >= FORGOTTEN_AFTER,
        )
        looked = ((record, self._after_look(record, now)) for record in held)
        return [after for record, after in looked if after != record]

    def _tell_of_silent(self, held: list[TaskRecord], now: float) -> None:
        """Tell everyone of robots that are silent; again at every look, for who comes later."""
        silent = self._presence.silent(now)
        for status in silent:
            tasks = [record for record in held if record.robot == status.robot_id]
            begun = (each.task.id for each in tasks if each.state is TaskState.STARTED)
            told = replace(
                status, task_id=next(begun, ""), tasks=tuple(each.task.id for each in tasks)
            )
            self._talker.publish(ROBOT_STATUS, told, to=())
        self._node.tell_offline(tuple(status.robot_id for status in silent))

    def lateness(self, record: TaskRecord) -> str:
        """Say why a task was recalled; empty if it was not overdue."""
        return self._late.get((record.task.id, record.assignment), "")

    def _recall(self, held: list[TaskRecord], now: float) -> None:
        """Recall what is overdue, again at every look until it is handed back."""
        self._late.clear()
        for record, allowed in self._deadlines.overdue(held, now):
            reason = f"{record.robot} made no progress within {allowed:.0f} s"
            self._late[record.task.id, record.assignment] = reason
            self._orders.send(record, OrderKind.HAND_BACK)

    def _has_to_hand_back(self, robot_id: str) -> bool:
        late = (self._node.get(task_id) for task_id, _ in self._late)
        return any(
            record.is_held and record.robot == robot_id and self.lateness(record)
            for record in late
            if record is not None
        )

    def _after_look(self, record: TaskRecord, now: float) -> TaskRecord:
        if not self._leases.is_lost(record.robot, now):
            back = record.task.id in self._kept
            self._kept.discard(record.task.id)
            return replace(record, reason=f"{record.robot} is back") if back else record
        last = self._presence.last(record.robot)
        seen = self.lateness(record) or "not heard of any more"
        if last is not None:
            seen += f", last seen at {last.pose}"
        policy, max_tries = self._settings.on_robot_lost, self._settings.most_hand_backs
        after = after_loss(record, policy, seen, max_tries) or record
        if after.is_held:
            self._kept.add(record.task.id)
        return after
