# SPDX-License-Identifier: BSD-3-Clause
"""A round of an auction without an auction: rospy's own time for the same messages.

    python3 -m hive_lab.live.bare_round ask 10
    python3 -m hive_lab.live.bare_round answer

One node takes tasks from `bare/new_task`, broadcasts them, and reports on `bare/task_state` when
all other nodes have answered. Nothing is computed or written to disk.
"""

from __future__ import annotations

import blackboard.msg as bb_msgs
import rospy

from hive_common.ros.signals import init_node

_QUEUE = 1000


class Asker:
    """Broadcasts every task and waits for the answers. Create it after `rospy.init_node`."""

    def __init__(self, answers: int) -> None:
        self._answers = answers
        self._heard: dict[int, int] = {}
        self._asked: list[str] = []
        self._ask = rospy.Publisher("bare/task_bc", bb_msgs.TaskMsgArray, queue_size=_QUEUE)
        self._tell = rospy.Publisher("bare/task_state", bb_msgs.TaskState, queue_size=_QUEUE)
        rospy.Subscriber("bare/task_cost", bb_msgs.TaskCostArray, self._count, tcp_nodelay=True)
        rospy.Subscriber("bare/new_task", bb_msgs.TaskMsg, self._hear, tcp_nodelay=True)

    def _hear(self, task: bb_msgs.TaskMsg) -> None:
        self._asked.append(task.id)
        self._ask.publish(bb_msgs.TaskMsgArray(auction=len(self._asked), tasks=[task]))

    def _count(self, answer: bb_msgs.TaskCostArray) -> None:
        number = answer.auction
        self._heard[number] = self._heard.get(number, 0) + 1
        if self._heard[number] == self._answers:
            state = bb_msgs.TaskState.ASSIGNED
            self._tell.publish(bb_msgs.TaskState(task_id=self._asked[number - 1], state=state))


class Answerer:
    """Answers every broadcast at once. Create it after `rospy.init_node`."""

    def __init__(self) -> None:
        self._answer = rospy.Publisher("bare/task_cost", bb_msgs.TaskCostArray, queue_size=_QUEUE)
        rospy.Subscriber("bare/task_bc", bb_msgs.TaskMsgArray, self._hear, tcp_nodelay=True)

    def _hear(self, asked: bb_msgs.TaskMsgArray) -> None:
        costs = [bb_msgs.TaskCost(task_id=task.id) for task in asked.tasks]
        self._answer.publish(bb_msgs.TaskCostArray(auction=asked.auction, costs=costs))


def main() -> None:
    """Ask or answer until the node is shut down."""
    init_node("bare", anonymous=True)
    role, *answers = rospy.myargv()[1:]
    node = Asker(int(answers[0])) if role == "ask" else Answerer()
    rospy.spin()
    del node


if __name__ == "__main__":
    main()
