# SPDX-License-Identifier: BSD-3-Clause
"""For tests: one AGV in a hall of the simulator, on virtual time, and a master that hears it."""

from __future__ import annotations

import itertools
from collections import deque
from typing import TYPE_CHECKING, Any

from hive_common.pose import STOP, Pose, Velocity
from robot_description.models import load_model
from simenv.noise import Noise
from simenv.simulation import STEP, Simulation
from simenv.testing import hall
from vda5050.protocol.actions import Action, ActionParameter, BlockingType, InstantActions
from vda5050.protocol.codec import decode, encode
from vda5050.protocol.header import Header, timestamp_of
from vda5050.protocol.order import Deviation, Edge, Node, NodePosition, Order
from vda5050.protocol.topics import Address, Topic, parse_topic
from vda5050.simulated.agv import AgvSettings, SimulatedAgv

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from simenv.world.world import World
    from vda5050.protocol.codec import Body
    from vda5050.protocol.state import State
    from vda5050.protocol.versions import Version

MAP = "hall"
START = Pose(2.0, 2.0, 0.0)
_CONTROL = 4  # steps of the simulation between two of the AGV: 0.1 s


class SimenvBase:
    """A robot of a simulation in this process, as the base of an AGV.

    Args:
        simulation: Where the robot is.
        name: Of the robot.
        late: So many commands later each reaches the robot.
    """

    def __init__(self, simulation: Simulation, name: str, late: int = 0) -> None:
        self._simulation, self._name = simulation, name
        self._commands = deque([STOP] * late)

    @property
    def pose(self) -> Pose:
        """Where it is, frame map."""
        return self._simulation.poses[self._name]

    @property
    def velocity(self) -> Velocity:
        """How it moves, in its own frame."""
        return Velocity(*self._simulation.velocity(self._name))

    def command(self, velocity: Velocity) -> None:
        """Move like this until the next command."""
        self._commands.append(velocity)
        self._simulation.set_command(self._name, *self._commands.popleft())


class Rig:
    """A world, or a hall of 10 m x 10 m, with one AGV.

    The AGV's base gets commands so many rounds late.
    """

    def __init__(
        self, version: Version, model: str = "mir100", late: int = 0, world: World | None = None
    ) -> None:
        self.version = version
        self.simulation = Simulation(world or hall(), noise=Noise().times(0.0))
        self.simulation.add_robot("agv", load_model(model), START)
        self.address = Address.of(version, "Acme", "7")
        self.heard: list[tuple[Topic, Body, bool]] = []  # topic, message, whether retained
        self.agv = SimulatedAgv(
            AgvSettings(address=self.address, version=version, map_id=MAP),
            load_model(model),
            SimenvBase(self.simulation, "agv", late),
            self._receive,
            lambda: self.simulation.time,
        )
        self.agv.endpoint.report.connected()
        self.run(0.2)

    def _receive(self, name: str, payload: bytes, _qos: int, retain: bool) -> None:
        found = parse_topic(name)
        if found is None or found[0] != self.address:
            raise ValueError(f"the AGV published on {name}")
        self.heard.append((found[1], decode(payload, found[1], self.version).body, retain))

    def run(self, seconds: float) -> None:
        """Let time pass [s]."""
        for _ in range(round(seconds / STEP / _CONTROL)):
            self.agv.step(self.simulation.time)
            for _ in range(_CONTROL):
                self.simulation.step()

    def run_until(self, holds: Callable[[], object], within: float = 60.0) -> float:
        """Let time pass until something holds, at least a step; return how long that took [s].

        Raises:
            TimeoutError: It did not within this time [s].
        """
        begin = self.simulation.time
        self.run(0.1)
        while not holds():
            if self.simulation.time > begin + within:
                raise TimeoutError(f"after {within:g} s the state is {self.state}")
            self.run(0.1)
        return self.simulation.time - begin

    def send(self, body: Order | InstantActions) -> None:
        """Send a message to the AGV."""
        topic = Topic.ORDER if isinstance(body, Order) else Topic.INSTANT_ACTIONS
        header = Header(0, timestamp_of(0.0), self.version.text, "Acme", "7")
        self.send_bytes(topic, encode(header, body, self.version))

    def send_bytes(self, topic: Topic, payload: bytes) -> None:
        """Send the AGV whatever these bytes are."""
        self.agv.hear(self.address.topic(topic), payload)

    def instantly(self, kind: str, action_id: str = "i1", **parameters: object) -> None:
        """Send one instant action."""
        self.send(InstantActions((action(kind, action_id, BlockingType.NONE, **parameters),)))

    def all(self, topic: Topic) -> list[Any]:
        """Return what was heard on a topic."""
        return [body for kind, body, _ in self.heard if kind is topic]

    @property
    def state(self) -> State:
        """The last state that was heard."""
        state: State = self.all(Topic.STATE)[-1]
        return state

    @property
    def pose(self) -> Pose:
        """Where the AGV truly is, frame map."""
        return self.simulation.poses["agv"]

    @property
    def speed(self) -> float:
        """How fast the AGV truly drives [m/s]."""
        return self.simulation.velocity("agv")[0]

    @property
    def errors(self) -> list[str]:
        """The types of the errors in the last state."""
        return [error.error_type for error in self.state.errors]

    def status(self, action_id: str) -> str | None:
        """Return how far an action is by the last state."""
        found = self.state.action(action_id)
        return found.action_status.value if found else None

    @property
    def is_idle(self) -> bool:
        """Whether nothing of the order is left by the last state."""
        actions = self.state.action_states
        return not self.state.node_states and all(each.action_status.ended for each in actions)


def action(
    kind: str,
    action_id: str = "a1",
    blocking: BlockingType = BlockingType.HARD,
    **parameters: object,
) -> Action:
    """Return an action with parameters."""
    given = tuple(ActionParameter(key, value) for key, value in parameters.items())
    return Action(kind, action_id, blocking, given)


def node(
    index: int,
    x: float,
    y: float,
    *,
    released: bool = True,
    actions: Iterable[Action] = (),
    theta: float | None = None,
    name: str = "",
    map_id: str = MAP,
) -> Node:
    """Return the node with an index on its way, frame map [m, m, rad]."""
    position = NodePosition(x, y, map_id, theta, Deviation(0.5, 0.5))
    return Node(name or f"n{index}", 2 * index, released, tuple(actions), position)


def order(
    nodes: Sequence[Node],
    order_id: str = "o1",
    update: int = 0,
    on_edges: Mapping[int, Sequence[Action]] | None = None,
    speed: float | None = None,
) -> Order:
    """Return an order over nodes; `on_edges` has actions by the sequence ids of edges."""
    edges = tuple(
        Edge(
            f"e{end.sequence_id - 1}",
            end.sequence_id - 1,
            end.released,
            start.node_id,
            end.node_id,
            tuple((on_edges or {}).get(end.sequence_id - 1, ())),
            maximum_speed=speed,
        )
        for start, end in itertools.pairwise(nodes)
    )
    return Order(order_id, update, tuple(nodes), edges)
