# SPDX-License-Identifier: BSD-3-Clause
"""Every number and name that a user may set.

This is the one source of the parameters' names, defaults and meaning: `config/*.yaml` and the
tables in docs/protocol.md are written from it by `python3 setup/write_parameters.py`.
"""

from collections.abc import Sequence
from typing import Annotated, Any, TypeVar

import attrs

from blackboard.errors import SettingsError
from hive_common.structuring import Allowed

COST_MODEL_NAMES = ("report", "energy", "time", "makespan", "latency")
"""The cost models that fleet files may name; `costing.cost.COST_MODELS` holds them."""

MEASURE_NAMES = ("way", "makespan", "waiting")
"""What plans may make smaller: the energy that all ways take, the time at which the last robot is
done, or the time that tasks wait until they are done."""

ON_ROBOT_LOST = ("reassign", "wait", "operator")
"""Who does the tasks of a lost robot: another robot, the same one, or a person decides."""

MAX_DRIFT = 0.01
"""Maximum error of the speed of a member's clock, as a share."""

_MIN_SILENCE = 2.0
"""Under 30 % packet loss a heartbeat at 10 Hz paused for up to 1.8 s (docs/benchmarks.md) [s]."""

STANDING_BY = 12
"""Default number of robots that stand by to carry the blackboard: with the blackboard node, these
are the seven voters and six to follow them."""

DECISIONS = ("distributed", "centralized", "planned")
"""Who works out bids: every robot its own, or the leader those of all; or the leader plans."""

DISTANCES = ("path", "euclidean")
"""How the length of a path is measured: on the map, or as the crow flies."""

TRAFFIC = ("local", "planned")
"""Who says who goes first where robots meet: the robots among themselves, or a traffic planner."""

T = TypeVar("T")


def longest_lease(robot_lease: float) -> float:
    """Return how long a lease [s] by the slowest clock may last by the fastest one [s]."""
    return robot_lease * (1 + 2 * MAX_DRIFT)


def setting(
    default: T,
    unit: str,
    text: str,
    more: str = "",
    *,
    names: Sequence[str] = (),
    allowed: str = "above 0",
) -> T:
    """Return the attrs field of a parameter.

    Args:
        default: The default, which also says what type is allowed.
        unit: The unit; empty for none.
        text: What the parameter means, in one sentence without a full stop.
        more: Further sentences, for the parameter file only.
        names: The names that are allowed; empty for a number above 0.
        allowed: What is allowed, in words.
    """
    allowed = ", ".join(names) or allowed

    def check(_: object, attribute: Any, value: Any) -> None:  # noqa: ANN401  (attrs' attribute; what was set)
        if value not in names if names else not 0 < value < float("inf"):
            words = ", ".join(names) or "above 0"
            raise SettingsError(f"{attribute.name} is {value!r}; allowed: {words}")

    metadata = {"unit": unit, "text": text, "more": more, "allowed": allowed}
    return attrs.field(default=default, validator=check, metadata=metadata)


@attrs.frozen
class Settings:
    """The base of all settings.

    Raises:
        SettingsError: A value is not allowed; the text names it and what is.
    """


@attrs.frozen
class RaftSettings(Settings):
    """How often the leader speaks, and how long the hive waits for it.

    Every member of the hive, the robots included, reads these from the blackboard's parameters.
    """

    heartbeat: float = setting(0.2, "s", "Time between two heartbeats on bb_backup")
    self_demotion: float = setting(
        1.8,
        "s",
        "A leader that no majority of the members has answered for longer steps down",
        allowed="at least 5 heartbeats",
    )
    election: float = setting(
        2.2,
        "s",
        "Members wait at most so long for a silent leader before they elect another",
        "A process that is proved dead (its connections are gone and its port refuses new ones) "
        "is replaced at once.",
        allowed="at least 2, and longer than self_demotion lasts on a clock that is 1 % slow",
    )
    min_election: float = setting(
        0.6,
        "s",
        "Members wait at least so long for a silent leader",
        "The leader asks for three times as long as answers of a majority have taken of late. "
        "Where that is less than election, it also steps down sooner, in the same proportion.",
        allowed="at most election, which switches this off",
    )
    stagger: float = setting(
        0.25, "s", "Delay between successive candidates", "The named backup stands first."
    )
    member_timeout: float = setting(10.0, "s", "A member that is silent for longer loses its vote")
    most_members: int = setting(
        7, "", "Members beyond this number hold the task list but have no vote"
    )
    kept_changes: int = setting(
        128,
        "",
        "Number of changes kept for members that missed some",
        "A member that missed more gets the whole task list.",
    )
    sync_period: float = setting(
        0.2,
        "s",
        "Minimum time between two copies of the task list on bb_sync",
        "Changes within it are sent together, also to the robot beside each member.",
    )

    def __attrs_post_init__(self) -> None:
        """Refuse a leader that steps down too early, and elections before it has."""
        if self.self_demotion < 5 * self.heartbeat:
            raise SettingsError(
                f"self_demotion is {self.self_demotion:g} s; allowed: at least 5 heartbeats, "
                f"which are {5 * self.heartbeat:g} s"
            )
        if self.election < _MIN_SILENCE:
            raise SettingsError(
                f"election is {self.election:g} s; allowed: at least {_MIN_SILENCE:g} s"
            )
        if self.min_election > self.election:
            raise SettingsError(
                f"min_election is {self.min_election:g} s; allowed: at most election, which is "
                f"{self.election:g} s"
            )
        slow_demotion = self.self_demotion * (1 + MAX_DRIFT) / (1 - MAX_DRIFT)
        if self.election <= slow_demotion:
            raise SettingsError(
                f"election is {self.election:g} s; allowed: above {slow_demotion:.3g} s, which a "
                f"self_demotion of {self.self_demotion:g} s may last on a slow clock"
            )


@attrs.frozen
class BlackboardSettings(Settings):
    """How the blackboard decides, and how patient it is."""

    decision: str = setting(
        "distributed",
        "",
        "Who works out what a task costs each robot",
        "distributed: every robot its own bids. centralized: robots report their status, and the "
        "leader works out the same bids for all of them. planned: the leader plans all tasks "
        "together, and improves the lists while that pays; one task alone, while no robot has "
        "work, it auctions. Fleet files that do not say choose planned.",
        names=DECISIONS,
    )
    bid_timeout: float = setting(
        2.0,
        "s",
        "Maximum time that an auction stays open",
        "It ends as soon as every robot in service has answered.",
    )
    robot_lease: float = setting(
        3.5,
        "s",
        "A robot whose status goes unacknowledged for longer stops",
        "A robot sends its status once a second; every heartbeat acknowledges it.",
    )
    lease_margin: float = setting(
        0.5, "s", "Time that a robot needs to come to a stop, and a little more"
    )
    reassign: float = setting(
        5.0,
        "s",
        "A robot that is silent for longer is lost",
        "It has to have stopped by then, and two clocks may differ by 2 %.",
        allowed="above robot_lease x 1.02 + lease_margin",
    )
    on_robot_lost: str = setting(
        "reassign",
        "",
        "What happens to the tasks of a lost robot",
        "reassign: they go to other robots, so a task may be done twice. wait: they stay until "
        "the robot is back or an operator cancels them. operator: they become FAILED, for a "
        "person to look. A task whose load may be on board always becomes FAILED.",
        names=ON_ROBOT_LOST,
    )
    overdue_factor: float = setting(
        2.0,
        "",
        "A robot hands a task back when it takes longer than this many times what it promised, "
        "and overdue_grace more",
        "What it promises includes the margin that nine of ten tasks keep. From priority 8 on "
        "every single step is promised, below that the rest of the task.",
    )
    overdue_grace: float = setting(60.0, "s", "Further time before an overdue task is handed back")
    order_timeout: float = setting(
        2.0, "s", "An order that a robot's status does not show by then is sent again"
    )
    retry_period: float = setting(
        30.0,
        "s",
        "A task that no robot could take is auctioned again after this time at the latest",
        "It is auctioned earlier whenever a robot changes.",
    )
    most_hand_backs: int = setting(
        5, "", "A task that robots have handed back this often becomes FAILED"
    )
    improve_period: float = setting(
        2.0,
        "s",
        "With decision: planned, time after which tasks that have not started are planned again",
        "After two plans that gain nothing it pauses until a list, a robot or a task changes.",
    )
    improve_by: str = setting(
        "waiting",
        "",
        "What plans make smaller",
        "waiting: the mean time until tasks are done. makespan: the time until all are done. "
        "way: what all robots drive. A fleet file sets it by its cost_model.",
        names=MEASURE_NAMES,
    )
    most_asked: int = setting(
        50,
        "",
        "Number of robots that are asked for bids first, if there are more",
        "These have the shortest lists, among equals they are nearest. The others are asked only "
        "for what none of these can take.",
    )
    offers_each: int = setting(
        4,
        "",
        "Maximum number of tasks in one call for bids, for each robot asked",
        "A round gives each robot one task. If more wait, the most urgent and then the oldest "
        "are offered first.",
    )
    most_bids: int = setting(2_000, "", "Maximum number of bids that one call for bids asks for")
    keep_ended: float = setting(
        3600.0,
        "s",
        "Time that an ended task stays on the task list",
        "After that its id may be used again.",
    )
    most_ended: int = setting(
        500,
        "",
        "Ended tasks beyond this number leave the task list earlier, the oldest first, though "
        "not within 10 s after their end",
        "Every change and every copy of the list carries them all.",
    )

    def __attrs_post_init__(self) -> None:
        """Refuse to give a task to another robot before the first has stopped."""
        stopped = longest_lease(self.robot_lease) + self.lease_margin
        if not stopped < self.reassign:
            raise SettingsError(
                f"reassign is {self.reassign!r}; allowed: above robot_lease "
                f"{self.robot_lease!r} x 1.02 + lease_margin {self.lease_margin!r} = {stopped:g}, "
                "because a robot has to have stopped before its task is given to another"
            )


@attrs.frozen
class RobotSettings(Settings):
    """How a robot bids and speaks."""

    cost_model: str = setting(
        "report",
        "",
        "What the robot bids with",
        "report: charge used over charge left, times the position in its list. energy: further "
        "charge that its whole list takes, over charge left. time: soonest done. makespan: the "
        "whole list soonest done. latency: how much longer all tasks of the list wait. See "
        "docs/cost-model.md.",
        names=COST_MODEL_NAMES,
    )
    aging: float = setting(
        120.0,
        "s",
        "Under latency, a task that has waited this long counts twice as much as a new one",
        "After twice that time it counts four times as much, and so on, so that none waits "
        "forever.",
    )
    status_period: float = setting(
        1.0,
        "s",
        "Time between two messages on robot_status, and before a report is repeated",
        "A status is also sent at every change.",
    )


@attrs.frozen
class StartSettings(Settings):
    """What else `robot_node` reads, each parameter where it is needed."""

    stands_by: bool = setting(
        True,
        "",
        "Whether the robot stands by to carry the blackboard",
        "A robot that does not still holds the task list and works on through every takeover, "
        "but has no vote. In a large fleet a dozen are enough: each is connected to every other "
        "member on all topics. In a fleet file the first stand_by robots stand by.",
        allowed="true or false",
    )
    charge: float = setting(1.0, "", "How full the battery is at the start", allowed="from 0 to 1")


_LEVEL = Allowed("a level above 0 and at most 1", lambda level: 0 < level <= 1)


@attrs.frozen
class ChargingSettings(Settings):
    """When a robot charges: levels of its battery from 0 to 1, each above the one before."""

    critical: Annotated[float, _LEVEL] = setting(
        0.15, "", "Below it the robot goes at once, after putting down what its arm has taken"
    )
    low: Annotated[float, _LEVEL] = setting(0.3, "", "Below it the robot goes when it is idle")
    enough: Annotated[float, _LEVEL] = setting(
        0.6, "", "From here on a charging robot takes tasks again"
    )
    full: Annotated[float, _LEVEL] = setting(0.95, "", "From here on it makes room for others")

    def __attrs_post_init__(self) -> None:
        """Refuse levels out of order."""
        levels = attrs.astuple(self)
        if not (levels == tuple(sorted(set(levels))) and self.full <= 1.0):
            raise SettingsError(
                f"critical, low, enough, full are {', '.join(f'{level:g}' for level in levels)}; "
                "allowed: each above the one before, full at most 1"
            )


@attrs.frozen
class ControllerSettings(Settings):
    """How patient a controller is."""

    attempts: int = setting(
        3, "", "How often a step is tried before the robot hands the task back"
    )
    retry_delay: float = setting(3.0, "s", "Pause before a step is tried again")
    server_timeout: float = setting(
        2.0,
        "s",
        "An action server (move_base, pick) that is silent for longer is frozen or cut off; the "
        "robot hands its task back",
    )


@attrs.frozen
class PathSettings(Settings):
    """How the length of a path is measured."""

    distance: str = setting(
        "path",
        "",
        "How the length of a path is measured",
        "path: on the map. euclidean: as the crow flies, without a map. The blackboard needs it "
        "only to refuse goals outside the map or inside a wall.",
        names=DISTANCES,
    )


@attrs.frozen
class TrafficSettings(Settings):
    """Who says who goes first where robots meet; every member that can lead reads it."""

    traffic: str = setting(
        "local",
        "",
        "Who says who goes first where robots meet",
        "local: the robots among themselves, by right of way. planned: a traffic planner, which "
        "runs beside the blackboard and plans for all robots together.",
        names=TRAFFIC,
    )
