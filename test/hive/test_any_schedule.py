# SPDX-License-Identifier: BSD-3-Clause
"""Whole hives with any fault at any time, whose properties are checked after every event."""

import random
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blackboard.domain.talker import NEW_TASK, SET_STATE, TASK_CANCEL, TASK_STATE
from blackboard.domain.task import Task, TaskState, TaskType
from blackboard.robot.executor import CommandResult, CommandState
from hive_common.pose import Pose
from hive_lab.virtual.hive import SMALL_ROBOT, Hive
from hive_lab.virtual.network import Network
from hive_lab.virtual.task_checker import TaskChecker

OPERATORS = (NEW_TASK, TASK_CANCEL, SET_STATE)
STRONG = "robot2"
FAILURE = CommandResult(CommandState.ABORTED, "somebody stood in the way")


class Story:
    """A hive to which things happen; the network delays messages, and loses some on request.

    Args:
        robots: Number of robots.
        loss: Share of lost messages.
        seed: Of delays and losses.
    """

    def __init__(self, robots, loss=0.0, seed=0):
        generator = random.Random(seed)

        def lose(topic, _):
            from_operator = topic.endswith(OPERATORS)
            return self.stormy and not from_operator and generator.random() < loss

        self.stormy = True
        network = Network(delay=lambda: generator.uniform(0.001, 0.1), lose=lose)
        self.hive = Hive(network=network)
        self.properties = TaskChecker(self.hive)
        self.names = [f"robot{number}" for number in range(1, robots + 1)]
        for name in self.names:
            self._add(name, Pose(0.0, 0.0))

    def _add(self, name, pose):
        """Start a robot; the second carries several times as much as the others."""
        kind = replace(SMALL_ROBOT, payload=60.0) if name == STRONG else SMALL_ROBOT
        self.hive.add_robot(name, pose, kind)

    def happen(self, what, robot, seconds, task):
        """Let one thing happen, and some time pass."""
        name = self.names[robot % len(self.names)]
        talker = self.hive.talkers[name]
        match what:
            case "post":
                self.hive.post(task)
            case "cancel":
                self.hive.cancel(task.id)
            case "defect" | "charging" | "idle":
                self.hive.set_state(name, what)
            case "unplug" | "plug in":
                talker.connected = what == "plug in"
            case "restart":
                self._add(name, self.hive.robots[name].status.pose)
            case "fail":
                self.hive.commands[name].results += [FAILURE] * 3
        self.hive.network.run(seconds)

    def comes_to_rest(self):
        """Repair everything; return whether the hive finishes within 20 minutes."""
        self.stormy = False
        for name in self.names:
            self.hive.talkers[name].connected = True
            self.hive.commands[name].results.clear()
        for _ in range(30):
            for name in self.names:  # with a load on board they leave service
                self.hive.set_state(name, "idle")
            if self._is_quiet_for(40.0):
                return True
        return False

    def _is_quiet_for(self, seconds):
        """Return whether nobody speaks of tasks for a time [s], and no robot has one."""
        said = len(self.hive.network.heard)
        self.hive.network.run(seconds)
        topics = {topic for topic, _ in self.hive.network.heard[said:]}
        lists = [robot.status.tasks for robot in self.hive.robots.values()]
        return TASK_STATE not in topics and not any(lists)

    def unexplained(self):
        """Return the unfinished tasks that do not say why."""
        good = ("given up after", "cancelled by", "nobody can take it", "its part", "robot")
        return {
            name: reason
            for name, reason in self.properties.unfinished().items()
            if not reason.startswith(good)
        }


POSES = st.builds(Pose, st.floats(-20.0, 20.0), st.floats(-20.0, 20.0))
TASKS = st.builds(
    Task,
    id=st.sampled_from([f"T{number}" for number in range(8)]),
    type=st.sampled_from(TaskType),
    goals=st.tuples(POSES, POSES),
    priority=st.integers(0, 10),
    payload=st.sampled_from([0.0, 3.0, 15.0, 45.0, 7000.0]),
)
EVENTS = st.tuples(
    st.sampled_from(
        [
            *["post"] * 6,
            *["cancel", "defect", "charging", "idle", "idle"],
            *["unplug", "plug in", "plug in", "restart", "fail"],
        ]
    ),
    st.integers(0, 3),
    st.sampled_from([0.0, 0.02, 0.2, 1.0, 7.0, 15.0]),
    TASKS,
)


@pytest.mark.slow
@pytest.mark.timeout(600)  # hundreds of hives, on a machine that may be busy
@given(st.integers(1, 4), st.lists(EVENTS, max_size=25), st.sampled_from([0.0, 0.0, 0.1, 0.3]))
def test_whatever_happens_the_properties_hold_and_the_hive_ends_in_order(robots, events, loss):
    story = Story(robots, loss)
    for event in events:
        story.happen(*event)

    assert story.comes_to_rest()
    assert story.unexplained() == {}


def random_task(generator, number):
    """Return a task that a SMALL_ROBOT can do."""
    goals = tuple(Pose(generator.uniform(0, 20), generator.uniform(0, 12)) for _ in range(2))
    kind = generator.choice(list(TaskType))
    payload = generator.uniform(0, 5)
    return Task(f"T{number}", kind, goals, generator.randint(0, 10), payload)


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("seed", range(10))
def test_with_healthy_robots_all_tasks_are_done_whatever_the_network_delays_and_loses(seed, loss):
    generator = random.Random(seed)
    story = Story(generator.randint(2, 5), loss, seed)
    tasks = [random_task(generator, number) for number in range(15)]
    for task in tasks:
        story.happen("post", 0, generator.choice([0.0, 0.5, 20.0]), task)
        if generator.random() < 0.3:
            story.hive.post(replace(task, posted=1.0))

    assert story.comes_to_rest()
    assert {task.id: story.hive.record(task.id).state for task in tasks} == {
        task.id: TaskState.DONE for task in tasks
    }


@pytest.mark.parametrize("seed", range(10))
def test_robots_that_keep_handing_tasks_back_never_meet_at_one(seed):
    generator = random.Random(seed)
    story = Story(3, loss=0.4, seed=seed)
    for number in range(10):
        task = replace(random_task(generator, number), type=TaskType.GAB)
        story.happen("post", 0, 0.0, task)
    for _ in range(150):
        robot = generator.randrange(3)
        what = generator.choice(["defect", "idle", "idle", "idle"])
        story.happen(what, robot, generator.choice([0.1, 0.3, 1.0, 3.0]), None)

    assert story.comes_to_rest()
    assert story.unexplained() == {}


@pytest.mark.parametrize("seed", range(20))
def test_heavy_tasks_end_however_often_a_strong_robot_comes_and_goes(seed):
    generator = random.Random(seed)
    story = Story(3, loss=generator.choice([0.0, 0.2]), seed=seed)
    tasks = [replace(random_task(generator, number), type=TaskType.GA) for number in range(6)]
    tasks += [
        replace(task, id=f"H{task.id}", type=TaskType.GAB, payload=generator.uniform(25.0, 60.0))
        for task in tasks
    ]
    story.happen("defect", 1, 0.1, None)
    for task in tasks:
        story.happen("post", 0, generator.choice([0.0, 0.5]), task)
    for _ in range(20):
        what = generator.choice(["defect", "idle"])
        story.happen(what, 1, generator.choice([0.3, 2.0, 7.0, 15.0]), None)

    assert story.comes_to_rest()
    assert story.unexplained() == {}
    ended = {story.hive.record(task.id).state for task in tasks}
    assert ended <= {TaskState.DONE, TaskState.FAILED}
