# SPDX-License-Identifier: BSD-3-Clause
"""A simulated network that counts what each of its nodes hears and computes."""

from __future__ import annotations

import io
import time
from collections import Counter, OrderedDict, defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from blackboard.codec.tables import WIRES
from hive_lab.fault_schedules.faulty_network import FaultyNetwork, Host, HostTalker, Quality
from hive_lab.virtual.network import LATENCY

if TYPE_CHECKING:
    from collections.abc import Callable, Collection
    from random import Random

    from hive_lab.virtual.network import Subscription

_IN_FLIGHT = 20_000
"""So many of the last messages are known; all that are under way are among them."""


@dataclass
class Account:
    """What one node has taken so far.

    Attributes:
        messages: What it has heard from other nodes.
        size: Their size as serialized for ROS [byte].
        sizes: The same by topic.
        spent: Processor time, encoding and decoding included [s].
    """

    messages: int = 0
    size: int = 0
    sizes: Counter[str] = field(default_factory=Counter)
    spent: float = 0.0


class _Sent(NamedTuple):
    message: object  # kept, so that its id is not used again while it is under way
    sender: str
    size: int  # [byte]
    decoding: float  # processor time for each node that reads it [s]


class MeteredNetwork(FaultyNetwork):
    """A network that keeps an account of each node; each message takes 1 ms.

    Every message is encoded once, at its sender's expense, and decoded once; each node that reads
    it is charged what that took. Sockets and threads are not part of it.

    Args:
        random: The source of every chance.
        loss: Share of the messages between two nodes that are lost.

    Attributes:
        accounts: By the name of the node.
    """

    def __init__(self, random: Random, loss: float = 0.0) -> None:
        super().__init__(random, proofs=1.0)
        # All messages take the same time: on ROS, those of one topic do not overtake each other.
        self.quality = Quality(loss=loss, delay=LATENCY)
        self.accounts: defaultdict[str, Account] = defaultdict(Account)
        self._sent: OrderedDict[int, _Sent] = OrderedDict()
        self._charged = 0.0
        self._was_read = False

    def charge(self, seconds: float) -> None:
        """Charge the node whose event is being handled with processor time [s]; may be below 0."""
        self._charged += seconds

    def note_read(self) -> None:
        """Note that the message that is being delivered is not dropped unread."""
        self._was_read = True

    def act(self, host: Host, action: Callable[[Any], None], argument: object) -> None:
        """Run one event on a node, and charge it."""
        self._charged, self._was_read = 0.0, False
        begun = time.thread_time()
        super().act(host, action, argument)
        account = self.accounts[host.name]
        account.spent += time.thread_time() - begun + self._charged
        if getattr(action, "__func__", None) is not Host.deliver:
            return
        topic, message = cast("tuple[str, object]", argument)
        sent = self._sent[id(message)]
        if sent.sender != host.name:
            account.messages += 1
            account.size += sent.size
            account.sizes[topic] += sent.size
            account.spent += sent.decoding * self._was_read

    def send(
        self, sender: Host, topic: str, message: object, to: Collection[str] | None = None
    ) -> None:
        """Send a message; see `FaultyNetwork.send`."""
        wire, buffer = WIRES[topic], io.BytesIO()
        wire.to_msg(message, self.now).serialize(buffer)
        begun = time.thread_time()
        wire.from_msg(wire.message().deserialize(buffer.getvalue()))
        decoding = time.thread_time() - begun
        self.charge(-decoding)  # it is done here only to be measured
        self._sent[id(message)] = _Sent(message, sender.name, buffer.tell(), decoding)
        self._sent.move_to_end(id(message))  # it may have been sent before
        if len(self._sent) > _IN_FLIGHT:
            self._sent.popitem(last=False)
        super().send(sender, topic, message, to)


class MeteredTalker(HostTalker):
    """The talker of a node of a `MeteredNetwork`."""

    def __init__(self, network: MeteredNetwork, name: str) -> None:
        super().__init__(network.hosts[name], name)
        self._network = network

    def subscribe(
        self, topic: str, handler: Callable[[Any], None], when: Callable[[], bool] | None = None
    ) -> Subscription:
        """Subscribe to a topic."""

        def read(message: object) -> None:
            self._network.note_read()
            handler(message)

        return super().subscribe(topic, read, when)
