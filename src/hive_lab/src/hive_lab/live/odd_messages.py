# SPDX-License-Identifier: BSD-3-Clause
"""Publishes odd messages to a hive of real nodes: copies of what is said there, with odd fields.

What passes the border on the topics of the consensus, and lies about it, is published last, as in
`fuzz.run`; it only has to end no process.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections import Counter, defaultdict, deque
from random import Random
from typing import TYPE_CHECKING, Any

import blackboard.msg as bb_msgs
import click
import rospy
from std_msgs.msg import String

from blackboard.board.intake import why_refused
from blackboard.board.reception import FAIL_STOP
from blackboard.codec.tables import WIRES
from blackboard.domain.talker import BB_ENTRIES, NEW_TASK, SET_STATE, TASK_CANCEL
from blackboard.errors import LiveHiveError
from hive_lab.bench.registry import BenchResult
from hive_lab.fuzz.mutations import Mutations, as_bytes
from hive_lab.live.live_hive import bench_hive
from hive_lab.live.live_operator import make_task

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import genpy

    from hive_lab.live.live_hive import LiveHive
    from hive_lab.live.live_operator import LiveOperator

MESSAGES = 20_000
_BATCH = 500
"""Messages before each good task."""

_DEED_EVERY = 100  # messages; so often the operator does something
_PAUSE = 0.0025  # between two messages [s]
_SETTLE = 10.0  # until a lie about the consensus has shown what it does [s]
_NAMED = 6  # tasks whose ids are put into fields

_KEPT = 50
"""Messages of a topic of which odd ones are made: the last ones, with the present epoch."""

_CONNECTED_WITHIN = 60.0  # until the hive listens to what is published here [s]
_LOOK_EVERY = 0.05  # [s]


class OddMessages:
    """Overhears a hive, and publishes what it has heard with odd fields.

    Create it after `rospy.init_node`. It listens until `speak` is called. Then it speaks, and no
    longer listens to the entries of the log: who does both is a member to the others, and they
    leave members out of what does not concern them.

    Args:
        namespace: Of the hive, beginning and ending in a slash.
        robots: Names of its robots.
        seed: Of the choice; what is heard differs from run to run.

    Attributes:
        published: How many odd messages were published, by topic.
        refused: How many of them the border refuses.
        last: What was odd in the last ones, in words.
        names: Names that mean something in the hive, to be put into fields.
    """

    def __init__(self, namespace: str, robots: Sequence[str], seed: int) -> None:
        self.published: Counter[str] = Counter()
        self.refused = 0
        self.last: deque[str] = deque(maxlen=10)
        self.names: list[str] = [f"{namespace}blackboard", *robots]
        self._random = Random(seed)
        self._mutations = Mutations(self._random, self.names)
        self._said: dict[str, deque[tuple[str, bytes]]] = defaultdict(lambda: deque(maxlen=_KEPT))
        self._lock = threading.Lock()
        self._lies: list[tuple[str, genpy.Message, str]] = []
        own = [f"{namespace}{robot}/{SET_STATE}" for robot in robots]
        names = {topic: [f"{namespace}{topic}"] for topic in WIRES} | {SET_STATE: own}
        self._topics = {name: topic for topic, each in names.items() for name in each}
        self._publishers: dict[str, rospy.Publisher] = {}
        self._subscribers = {
            name: rospy.Subscriber(name, WIRES[topic].message, self._hearing(topic, name))
            for name, topic in self._topics.items()
        }

    def speak(self) -> None:
        """Begin to speak, and wait until the hive listens.

        Raises:
            LiveHiveError: It does not.
        """
        for name, topic in self._topics.items():
            if topic == BB_ENTRIES:
                self._subscribers.pop(name).unregister()
        self._publishers = {
            name: rospy.Publisher(name, WIRES[topic].message, queue_size=1000)
            for name, topic in self._topics.items()
        }
        end = time.monotonic() + _CONNECTED_WITHIN
        while not all(each.get_num_connections() for each in self._publishers.values()):
            if time.monotonic() > end:
                raise LiveHiveError(f"nobody listens within {_CONNECTED_WITHIN:.0f} s")
            time.sleep(_LOOK_EVERY)

    def close(self) -> None:
        """Close all topics."""
        for link in (*self._subscribers.values(), *self._publishers.values()):
            link.unregister()

    def say(self, topic: str, message: genpy.Message, own: str = "") -> None:
        """Publish a message as it is; `own` is the robot whose topic it is."""
        name = next(
            name for name in self._publishers if name.endswith(f"{own}/{topic}" if own else topic)
        )
        self._publishers[name].publish(message)

    def publish_one(self) -> None:
        """Publish an odd message, or keep it for later if it is a lie about the consensus."""
        with self._lock:
            topic = self._random.choice(sorted(self._said))
            name, data = self._random.choice(self._said[topic])
        message, what = self._mutations.mutate(data, WIRES[topic].message)
        self.published[topic] += 1
        is_refused = _is_refused(topic, message)
        self.refused += is_refused
        if topic in FAIL_STOP and not is_refused:
            self._lies.append((name, message, what))
        else:
            self._publish(name, message, what)

    def publish_lies(self) -> None:
        """Publish the lies about the consensus; afterwards the hive need not recover."""
        for lie in self._lies:
            self._publish(*lie)
        self._lies.clear()

    def _publish(self, name: str, message: genpy.Message, what: str) -> None:
        self.last.append(f"{name}: {what}")
        self._publishers[name].publish(message)

    def _hearing(self, topic: str, name: str) -> Callable[[Any], None]:
        """Return a callback that keeps valid messages, those that were published here too."""

        def hear(message: Any) -> None:  # noqa: ANN401  (of the topic)
            if not _is_refused(topic, message):
                with self._lock:
                    self._said[topic].append((name, as_bytes(message)))

        return hear


def _is_refused(topic: str, message: genpy.Message) -> bool:
    try:
        return bool(why_refused(topic, WIRES[topic].from_msg(message)))
    except Exception:  # noqa: BLE001  (the members meet it too, and count it)
        return True


class BusyHive:
    """A hive of real nodes that its operator keeps at work while odd messages arrive.

    Args:
        hive: Its processes.
        operator: Its operator; knows the names of all nodes.
        odd: What is published to it.
        deeds: Whether the operator also cancels tasks, sets robots defect and restarts nodes.

    Attributes:
        failures: What went wrong, in words; empty if nothing did.
        done: How many good tasks were done.
        posted: How many of them were posted.
    """

    def __init__(
        self, hive: LiveHive, operator: LiveOperator, odd: OddMessages, *, deeds: bool
    ) -> None:
        self._hive, self._operator, self._odd, self._deeds = hive, operator, odd, deeds
        self._ids = itertools.count(1)
        self.failures: list[str] = []
        self.done = self.posted = 0

    def stand(self, messages: int) -> None:
        """Publish odd messages, and check that no process ends and that the next task is done."""
        for number in range(messages):
            if self._deeds and number % _DEED_EVERY == 0:
                self._do(number // _DEED_EVERY)
            self._odd.publish_one()
            time.sleep(_PAUSE)
        self._all_good()
        self._does_the_next_task()
        self._look()

    def stand_lies(self) -> None:
        """Publish the lies about the consensus, and check that no process ends."""
        self._odd.publish_lies()
        time.sleep(_SETTLE)
        self._look()

    def _do(self, number: int) -> None:
        """Do the next thing that an operator of a busy hive does."""
        robots = self._hive.robots
        deeds = (
            self._post,
            lambda: self._odd.say(TASK_CANCEL, String(self._odd.names[-1])),
            lambda: self._set_state(robots[number % len(robots)], "defect"),
            self._post,
            lambda: self._restart(self._hive.node_of(robots[number % len(robots)])),
            self._all_good,
            lambda: self._restart(self._operator.last.active),
        )
        deeds[number % len(deeds)]()

    def _post(self) -> bb_msgs.TaskMsg:
        """Post a task, once; the hive may have no leader at this moment."""
        number = next(self._ids)
        task = make_task(f"fuzz{number}", (float(number % 7), 1.0), (1.0, float(number % 5)))
        self._odd.names.append(task.id)
        del self._odd.names[len(self._hive.robots) + 1 : -_NAMED]
        self._odd.say(NEW_TASK, task)
        return task

    def _restart(self, node: str) -> None:
        self._look()
        if node in self._hive.members:
            self._hive.kill(node)
            self._hive.start(node)

    def _set_state(self, robot: str, word: str) -> None:
        self._odd.say(SET_STATE, String(word), robot)

    def _all_good(self) -> None:
        for robot in self._hive.robots:
            self._set_state(robot, "idle")

    def _does_the_next_task(self) -> None:
        task = self._post()
        self.posted += 1
        try:
            self._operator.post(task)
            end = self._operator.follow(task.id)
        except LiveHiveError as error:
            self._fail(f"the next good task: {error}")
            return
        if end == bb_msgs.TaskState.DONE:
            self.done += 1
        else:
            self._fail(f"the next good task ended in state {end}")

    def _look(self) -> None:
        """Note which nodes have ended by themselves, and start them again."""
        for node in self._hive.ended():
            said = self._hive.log_of(node)[-2000:]
            self._fail(f"{node} has ended:\n{said}")
        self._hive.restart_ended()

    def _fail(self, what: str) -> None:
        last = "\n  ".join(self._odd.last)
        self.failures.append(f"{what}\nThe last odd messages:\n  {last}")


def run(messages: int = MESSAGES, seed: int = 1) -> BenchResult:
    """Publish odd messages to a blackboard node and four robot nodes on a ROS master.

    Args:
        messages: How many; rounded up to whole batches.
        seed: Of the choice.

    Returns:
        How many were published, and how many of them the border refuses; failures; how many of the
        good tasks after each batch were done; the time on the wall [s]. Aim: no failures.
    """
    began = time.perf_counter()
    with bench_hive("bench_fuzz") as (hive, operator):
        odd = OddMessages(hive.namespace, hive.robots, seed)
        operator.wait_until_whole()
        odd.speak()
        busy = BusyHive(hive, operator, odd, deeds=True)
        for _ in range(-(-messages // _BATCH)):
            known = len(busy.failures)
            busy.stand(_BATCH)
            told = (f"{odd.published.total()} messages", *busy.failures[known:])
            click.echo("\n".join(told), err=True)
        busy.stand_lies()
        odd.close()
    figures = {
        "messages": float(odd.published.total()),
        "refused": float(odd.refused),
        "accepted": float(odd.published.total() - odd.refused),
        "failures": float(len(busy.failures)),
        "tasks_posted": float(busy.posted),
        "tasks_done": float(busy.done),
        "took": time.perf_counter() - began,
    }
    return BenchResult(figures, {"failures": 0.0}, bool(busy.failures))
