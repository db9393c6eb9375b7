# SPDX-License-Identifier: BSD-3-Clause
"""The deliberate breaks of the test plan: one for each case, which its test has to notice.

A break replaces a function of the system, in the process into which `sitecustomize` brings it.
What it replaces is imported only there.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

from attrs import evolve


@dataclass(frozen=True)
class Break:
    """One thing that is broken on purpose.

    Attributes:
        file: Name of the `.test` file with the case.
        test: The case that has to fail.
        what: What is broken, in words.
        path: Where it is: `module:name` or `module:class.name`.
        broken: Returns what stands there instead, from what stands there.
        also: Another case that has to run before it.
        only: Program that is broken; empty for all that have the module.
    """

    file: str
    test: str
    what: str
    path: str
    broken: Callable[[Any], Any]
    also: str = ""
    only: str = ""

    def place(self):
        """Return the owner of what is broken, and its name there."""
        module, _, names = self.path.partition(":")
        *owners, name = names.split(".")
        owner = import_module(module)
        for each in owners:
            owner = getattr(owner, each)
        return owner, name

    def do(self):
        """Break it in this process."""
        if not self.only or any(self.only in word for word in sys.orig_argv):
            owner, name = self.place()
            setattr(owner, name, self.broken(getattr(owner, name)))


def nothing(_original):
    """Do nothing instead."""
    return lambda *_arguments, **_options: None


def always(value):
    """Answer the same whatever is asked."""
    return lambda _original: lambda *_arguments, **_options: value


def dearest(_original):
    """Give a task to the robot with the highest cost."""
    return lambda _record, able: max(able, key=lambda bid: bid.cost, default=None)


def unless_it_carries_60_kg(original):
    """Have the robot that carries 60 kg refuse every task."""
    return lambda self, *asked: "no" if self.payload == 60.0 else original(self, *asked)


def twice(original):
    """Draw twice the energy."""
    return lambda self, energy: original(self, 2 * energy)


def backwards(original):
    """Drive to the goals in reverse."""
    return lambda task: original(replace(task, goals=task.goals[::-1]))


def without_move_base_yaml(original):
    """Leave a parameter file out, as if it were not there."""

    def load(*arguments, **options):
        words = [*arguments, *options.values()]
        if not any(isinstance(w, str) and w.endswith("move_base.yaml") for w in words):
            original(*arguments, **options)

    return load


def few_members(original):
    """Read that a hive has five members at most."""

    def read(kind, *arguments):
        settings = original(kind, *arguments)
        known = hasattr(settings, "most_members")
        return evolve(settings, most_members=5) if known else settings

    return read


def in_the_root(original):
    """Speak in the root namespace, whatever the hive's own is."""
    return lambda self, _hive, advertises: original(self, "/", advertises)


def from_the_third_second(original):
    """Play a bag back without its beginning."""
    return lambda words: original(["--start=3", *words])


def by_themselves(original):
    """Let every robot drive ahead all the time."""

    def step(self, *arguments):
        for name in self.names:
            self.set_command(name, 0.5, 0.0, 0.0)
        original(self, *arguments)

    return step


BREAKS = {
    "1a": Break(
        "plan_start",
        "test_the_system_is_up_with_every_node_and_topic",
        "the localization ends as soon as it is started",
        "hive_navigation.ros.fake_localization_node:main",
        nothing,
    ),
    "1b": Break(
        "plan_start",
        "test_every_parameter_file_is_read",
        "roslaunch leaves out move_base.yaml",
        "roslaunch.loader:Loader.load_rosparam",
        without_move_base_yaml,
        also="test_the_system_is_up_with_every_node_and_topic",
    ),
    "1c": Break(
        "plan_start",
        "test_each_launch_file_brings_up_what_it_promises",
        "the map server ends as soon as it is started",
        "hive_navigation.ros.map_server_node:main",
        nothing,
    ),
    "1d": Break(
        "plan_start",
        "test_what_was_started_by_hand_does_a_task",
        "a robot sends no goal to move_base",
        "blackboard.ros.commands:MoveBaseCommand.start",
        nothing,
        also="test_each_launch_file_brings_up_what_it_promises",
    ),
    "2": Break(
        "plan_tasks",
        "test_a_task_that_is_added_is_on_the_list_and_goes_to_the_cheapest_robot",
        "the dearest robot gets the task",
        "blackboard.auction.auction:best_bid",
        dearest,
    ),
    "3": Break(
        "plan_tasks",
        "test_the_robot_goes_to_a_and_its_battery_pays_for_it",
        "twice the energy is drawn from the battery",
        "blackboard.domain.battery:Battery.update_level",
        twice,
    ),
    "4": Break(
        "plan_tasks",
        "test_several_tasks_are_spread_over_the_robots_and_each_is_done_once",
        "one of the robots refuses every task",
        "blackboard.domain.characteristics:RobotCharacteristics.excludes",
        unless_it_carries_60_kg,
    ),
    "5": Break(
        "plan_tasks",
        "test_the_highest_priority_goes_first_and_what_it_displaced_is_done_afterwards",
        "no robot puts off what it is doing",
        "blackboard.robot.robot:may_put_off",
        always(value=False),
    ),
    "6a": Break(
        "plan_tasks",
        "test_the_goals_of_a_task_are_reached_in_their_order",
        "the goals are driven to in reverse",
        "blackboard.robot.executor:split_task",
        backwards,
    ),
    "6b": Break(
        "plan_tasks",
        "test_loads_are_picked_at_a_and_put_down_at_b_by_robots_that_can",
        "a robot never says that it has a load on board",
        "blackboard.robot.robot:load_during",
        always(0.0),
    ),
    "7": Break(
        "plan_failover",
        "test_the_backup_takes_over_and_no_task_is_lost",
        "no member stands for election",
        "blackboard.consensus.election:misses_leader",
        always(value=False),
    ),
    "8": Break(
        "plan_failover",
        "test_a_task_that_is_added_is_on_the_list_and_goes_to_the_cheapest_robot",
        "a backup that took over gives tasks to the dearest robot",
        "blackboard.auction.auction:best_bid",
        dearest,
        also="test_the_backup_takes_over_and_no_task_is_lost",
        only="robot_node",
    ),
    "bad tasks": Break(
        "plan_tasks",
        "test_a_bad_task_is_rejected_with_a_reason_that_names_what_is_wrong",
        "the blackboard takes priorities up to 99",
        "blackboard.domain.task:MAX_PRIORITY",
        lambda _original: 99,
    ),
    "filters": Break(
        "plan_tasks",
        "test_robots_that_cannot_do_a_task_refuse_it_and_say_why",
        "a robot does not look at what it can do when it bids",
        "blackboard.domain.characteristics:RobotCharacteristics.excludes",
        always(""),
    ),
    "too heavy": Break(
        "plan_tasks",
        "test_a_task_too_heavy_for_one_robot_is_done_in_parts",
        "the blackboard splits nothing",
        "blackboard.board.awarding:split",
        nothing,
    ),
    "cancel": Break(
        "plan_tasks",
        "test_a_task_is_cancelled_whatever_its_state",
        "the blackboard does not listen to cancellations",
        "blackboard.board.blackboard:Blackboard._cancel",
        nothing,
    ),
    "defect": Break(
        "plan_robots",
        "test_what_a_defect_robot_had_is_done_by_another",
        "a robot hands nothing back",
        "blackboard.robot.robot:Robot._hand_back",
        nothing,
    ),
    "rosbag": Break(
        "plan_robots",
        "test_a_recorded_run_tells_the_same_history_of_tasks",
        "the bag is played back without its first seconds",
        "rosbag.rosbag_main:play_cmd",
        from_the_third_second,
    ),
    "low battery": Break(
        "plan_robots",
        "test_a_robot_with_a_low_battery_refuses_until_it_is_charged",
        "a robot takes its battery for full when it starts",
        "blackboard.domain.battery:Battery.__init__",
        lambda original: lambda self, model, _charge: original(self, model, 1.0),
    ),
    "expanding": Break(
        "plan_robots",
        "test_an_unknown_robot_joins_works_and_leaves",
        "a hive takes no more than five members",
        "hive_common.ros.params:read",
        few_members,
    ),
    "second fleet": Break(
        "plan_robots",
        "test_two_fleets_on_one_master_do_not_mix",
        "every member speaks in the root namespace",
        "blackboard.ros.talker:RosTalker.__init__",
        in_the_root,
    ),
    "killed robot": Break(
        "plan_robots",
        "test_the_task_of_a_robot_that_was_killed_is_done_by_another",
        "nobody looks whether robots are silent",
        "blackboard.board.watch:Watch.look",
        always([]),
    ),
    "collisions": Break(
        "plan_tasks",
        "test_after_all_that_no_robot_has_touched_anything",
        "the simulator drives every robot ahead all the time",
        "simenv.simulation:Simulation.step",
        by_themselves,
    ),
}
"""By the case that each of them breaks; see docs/test-plan.md."""
