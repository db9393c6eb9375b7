# SPDX-License-Identifier: BSD-3-Clause
"""One AGV as the body of a robot: where it is, how it is, and how it drives, picks and drops."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from blackboard.robot.contact import Contact
from blackboard.robot.executor import CommandResult, CommandState
from hive_common.pose import Pose, Velocity, compose, inverse
from robot_description.scan import Scan
from vda5050.agent.handling import Handling
from vda5050.agent.order_follower import OrderFollower, Tolerance
from vda5050.agent.order_keeper import OrderKeeper, Phase
from vda5050.agent.presence import Presence, why_unfit
from vda5050.protocol.actions import (
    INIT_POSITION,
    START_PAUSE,
    STATE_REQUEST,
    STOP_PAUSE,
    Action,
    ActionParameter,
    BlockingType,
    InstantActions,
)
from vda5050.protocol.state import Connection, State, Visualization

if TYPE_CHECKING:
    from collections.abc import Callable

    from blackboard.domain.task import TaskStep
    from hive_navigation.control.navigator import Navigator
    from hive_navigation.planning.clearance import ClearanceField
    from hive_navigation.traffic.neighbourhood import Neighbourhood
    from hive_navigation.traffic.right_of_way import Announcement
    from robot_description.models import RobotModel
    from vda5050.agent.maker import Maker
    from vda5050.protocol.codec import Body
    from vda5050.protocol.state import Position, Speed

NOTHING_SEEN = Scan(0.0, math.tau, np.empty(0), math.inf)
"""The scan of an AGV, which keeps what its own scanners see to itself and stops by them."""

UNPLUGGING = 5.0  # time that an AGV gets to end charging before it is to drive [s]
ASK_AGAIN = 10.0  # time between two requests to begin charging, or to tell its state [s]

Done = "Callable[[CommandResult], None]"


class Agv:
    """One AGV.

    Args:
        name: The robot's name.
        model: What it is.
        maker: What its maker calls things.
        send: Sends a message to the AGV; returns whether there was a broker.
        process: Begins the ids of orders; no other process has the same.
        clock: Returns the time of what robots do [s].
        say: Tells a person.
        tolerance: How near it has to come to the end of its path.
        field: Clearances of the hive's map.

    Attributes:
        state: What it told last; None before.
        pose: Where it is, frame map of the hive; None before it told.
    """

    def __init__(
        self,
        name: str,
        model: RobotModel,
        maker: Maker,
        send: Callable[[Body], bool],
        process: str,
        clock: Callable[[], float],
        say: Callable[[str], None],
        tolerance: Tolerance,
        field: ClearanceField,
    ) -> None:
        self.name = name
        self.state: State | None = None
        self.pose: Pose | None = None
        self.keeper = OrderKeeper(send, process)
        self.presence = Presence(model.base.max_speed)
        self.follower = OrderFollower(
            model.base, self.keeper, self.to_agv, clock, tolerance, field
        )
        self._maker = maker
        self._maps = {each.id: each.pose for each in maker.maps}
        self._map_id = maker.map_id
        self._send = send
        self._clock = clock
        self._say = say
        self._navigator: Navigator | None = None
        self._done: Callable[[CommandResult], None] | None = None
        self._handling: Handling | None = None
        self._last: Announcement | None = None  # it claims all that the AGV may drive
        self._base_left = 0.0  # how far that is [m]
        self._trouble = ""
        self._errors: frozenset[tuple[str, str]] = frozenset()
        self._unplug_at = self._plug_at = self._asked_at = -math.inf

    def use(self, navigator: Navigator, field: ClearanceField) -> None:
        """Let a navigator, which drives by this AGV's follower, decide where it goes.

        One that takes the place of another goes on to its goal. `field` has the clearances of the
        map on which it plans.
        """
        self.follower.field = field
        goal = None if self._navigator is None else self._navigator.goal
        self._navigator = navigator
        if goal is not None:
            navigator.set_goal(goal, self._clock())

    # What the AGV tells.

    def hear(self, body: Body) -> None:
        """Take in a message of the AGV."""
        now = self._clock()
        if isinstance(body, Connection):
            self.presence.note_connection(body.connection_state, now)
        elif isinstance(body, Visualization):
            self._note_place(body.mobile_robot_position, body.velocity)
        elif isinstance(body, State):
            first, self.state = self.state is None, body
            self.presence.note_state(now)
            self._note_place(body.mobile_robot_position, body.velocity)
            self._note_errors(body)
            self.follower.wants_more = bool(body.new_base_request)
            self.keeper.hear(body, now)
            if first and self.keeper.foreign and not _acts(body):
                self.keeper.cancel(now)  # what an earlier process of the agent has left

    def _note_place(self, position: Position | None, speed: Speed | None) -> None:
        if position is not None and position.localized:
            frame = self._maps.get(position.map_id)
            if frame is None and self._maps:
                return
            self._map_id = position.map_id
            place = Pose(position.x, position.y, position.theta)
            self.pose = place if frame is None else compose(frame, place)
        if speed is not None:
            told = (speed.vx or 0.0, speed.vy or 0.0, speed.omega or 0.0)
            self.follower.velocity = Velocity(*told)

    def _note_errors(self, state: State) -> None:
        """Say each error once, when it comes."""
        errors = {(each.error_type, each.error_description or ""): each for each in state.errors}
        for key in errors.keys() - self._errors:
            error = errors[key]
            text = f"{self.name}: {error.error_level.name} {': '.join(filter(None, key))}"
            self._say(f"{text} ({error.error_hint})" if error.error_hint else text)
        self._errors = frozenset(errors)

    @property
    def charge(self) -> float | None:
        """How full the battery is, 0..1; None before the AGV told."""
        return None if self.state is None else self.state.power_supply.state_of_charge / 100.0

    def trouble(self, now: float) -> str:
        """Return why the AGV takes no tasks; empty if it does.

        One that is only disconnected does, unless there was a reason before: see `contact`.
        """
        if self.presence.hibernates:
            self._trouble = self.presence.word(now) or "the AGV hibernates; wake it up"
        elif self.state is not None and self.presence.is_connected(now):
            self._trouble = why_unfit(self.state, frozenset(self._maps) or None)
        return self._trouble

    def contact(self, now: float) -> Contact:
        """Return whether the AGV can be reached; a lost one has come to the end of its base."""
        if self.presence.is_connected(now):
            return Contact.KEPT
        lost = self.presence.is_lost(now, self._base_left)
        return Contact.LOST if lost else Contact.BROKEN

    def to_agv(self, pose: Pose) -> tuple[Pose, str]:
        """Return a pose of the hive's map in the map of the AGV, and the id of that map."""
        frame = self._maps.get(self._map_id)
        return (pose if frame is None else compose(inverse(frame), pose)), self._map_id

    # What the AGV is to do.

    def drive(self, goal: Pose, done: Callable[[CommandResult], None]) -> None:
        """Drive to a pose, frame map; `done` is called once, unless it is stopped."""
        assert self._navigator is not None  # noqa: S101  (`use` comes before any task)
        self.stop()
        now = self._clock()
        if self.state is not None and self.state.power_supply.charging:
            self._unplug(now)
        self._done = done
        self._navigator.set_goal(goal, now)

    def handle(self, step: TaskStep, done: Callable[[CommandResult], None]) -> None:
        """Pick or drop where it stands; `done` is called once, unless it is stopped."""
        self.stop()
        self._done = done
        self._handling = Handling(step, self._maker.actions, self.keeper)

    def stop(self) -> None:
        """Stop; harmless when nothing runs."""
        self._done = None
        if self._navigator is not None and self._navigator.goal is not None:
            self._navigator.cancel()
            self.follower.halt(0.0)
        if self._handling is not None:
            self._handling = None
            self.keeper.cancel(self._clock())

    def tick(self, now: float, heard: Neighbourhood) -> Announcement | None:
        """Do one round; return what to tell the other robots, if there is something."""
        navigator, pose = self._navigator, self.pose
        if navigator is None or pose is None or self.state is None:
            return None
        if not self.presence.is_connected(now):
            return self._stand(now, pose)
        self.keeper.pass_time(now)
        navigator.stationary = self._handling is not None or bool(self.trouble(now))
        self.follower.may_release = not self._is_unplugging(now)
        tick = navigator.tick(now, pose, NOTHING_SEEN, heard)
        if self.follower.is_off:
            self.follower.is_off = False
            navigator.plan_again()
        if self.keeper.phase is not Phase.CANCELLING or self._last is None:
            # Until it shows that it has dropped its order it may drive all of its base.
            self._last, self._base_left = tick.announcement, self.follower.committed
        if self._handling is not None:
            self._finish(self._handling.pass_time(now, self.state, self.follower.stop_at(pose)))
        elif self.keeper.failure:
            failure, self.keeper.failure = self.keeper.failure, ""
            navigator.cancel()
            self._finish(CommandResult(CommandState.ABORTED, failure))
        elif tick.outcome is not None:
            end = CommandState.SUCCEEDED if tick.outcome.reached else CommandState.ABORTED
            self._finish(CommandResult(end, tick.outcome.text))
        return tick.announcement

    def _stand(self, now: float, pose: Pose) -> Announcement | None:
        """Return what is known of an AGV that is out of reach: it claims the rest of its base."""
        if self.presence.hears and now - self._asked_at >= ASK_AGAIN:
            self._asked_at = now
            self.ask(STATE_REQUEST)
        if self._last is None:
            return None
        self._last = replace(self._last, time=now, stationary=True, x=pose.x, y=pose.y)
        return self._last

    def _finish(self, result: CommandResult | None) -> None:
        if result is None:
            return
        done, self._done, self._handling = self._done, None, None
        if done is not None:
            done(result)

    # Instant actions.

    def charge_if(self, wanted: bool, now: float) -> None:
        """Begin to charge at a charger, unless the AGV has a drive to do."""
        idle = self.keeper.phase is Phase.IDLE and self._done is None
        if self.state is None or not wanted or not idle or now - self._plug_at < ASK_AGAIN:
            return
        if not self.state.power_supply.charging and not self.state.driving:
            self._plug_at = now
            self.ask(self._maker.actions.start_charging)

    def _unplug(self, now: float) -> None:
        self._unplug_at = now
        self.ask(self._maker.actions.stop_charging)

    def _is_unplugging(self, now: float) -> bool:
        charging = self.state is not None and self.state.power_supply.charging
        return charging and now - self._unplug_at < UNPLUGGING

    def pause(self, on: bool) -> None:
        """Have the AGV stop where it is, or go on."""
        self.ask(START_PAUSE if on else STOP_PAUSE)

    def init_position(self, pose: Pose) -> None:
        """Tell the AGV where it is, frame map of the hive."""
        place, map_id = self.to_agv(pose)
        last = "" if self.state is None else self.state.last_node_id
        given = {"x": place.x, "y": place.y, "theta": place.yaw, "mapId": map_id}
        self.ask(INIT_POSITION, **given, lastNodeId=last)

    def ask(self, action: str, **parameters: object) -> None:
        """Send an instant action."""
        given = tuple(ActionParameter(key, value) for key, value in parameters.items())
        wanted = Action(action, self.keeper.instant_id, BlockingType.NONE, given or None)
        self._send(InstantActions((wanted,)))


def _acts(state: State) -> bool:
    """Return whether an AGV is about an action, which must not be stopped half-way."""
    return any(not each.action_status.ended for each in state.action_states)
