# SPDX-License-Identifier: BSD-3-Clause
"""Rules of the log, of reports, loads and leases."""

import math
from dataclasses import replace

import pytest

from blackboard.auction import step as auction_step
from blackboard.auction.auctioneer import Auctioneer
from blackboard.board import recovery
from blackboard.board.blackboard import Blackboard
from blackboard.board.orders import Orders
from blackboard.board.watch import Watch
from blackboard.consensus import leader, step
from blackboard.consensus.lease import Lease, Leases
from blackboard.consensus.node import RaftNode
from blackboard.consensus.step import Propose
from blackboard.domain.record import ANY_ASSIGNMENT, Broadcast, Load, OrderKind, TaskRecord
from blackboard.domain.settings import BlackboardSettings
from blackboard.domain.task import TaskState, TaskStep
from blackboard.robot import drive_guard
from blackboard.robot.executor import Controller, State
from blackboard.robot.lease_keeper import LeaseKeeper
from blackboard.robot.loads import Loads
from blackboard.robot.reports import Reports
from blackboard.robot.robot import Robot
from hive_lab.fault_schedules.faulty_network import Host, HostTalker
from hive_lab.fault_schedules.mutations.mutation import Mutation
from hive_lab.fault_schedules.simulated_arm import SimulatedArm
from hive_lab.fault_schedules.simulated_member import Disk


def commit_with_half_of_the_members(patch):
    half = lambda members: max(1, len(members) // 2)  # noqa: E731  (one rule in one line)
    patch.setattr(leader, "majority_of", half)


def commit_by_count_what_an_earlier_epoch_left(patch):
    def count(log, _, held, majority):
        return max(log.committed, sorted(held, reverse=True)[majority - 1])

    patch.setattr(leader, "committed_version", count)


def send_one_change_a_message(patch):
    """Without it the changes of two epochs come together, and figure 8 does not occur."""
    patch.setattr(leader, "MAX_ENTRIES", 1)


def announce_before_a_majority_holds_it(patch):
    def hasty(self, records, then, forgotten=()):
        if self.may_act():
            if records:
                self._step(Propose(records, forgotten))
            then()

    patch.setattr(RaftNode, "commit", hasty)


def answer_before_writing_to_disk(patch):
    def hasty(self, event):
        before = self._member
        after, messages = step.step(before, event, self._talker.now())
        for message in messages:
            self._send(replace(message, to=None))
        if self._save(before, after):
            self._member = after
            self._react(before, after)

    patch.setattr(RaftNode, "_step", hasty)


def drop_the_journal(patch):
    patch.setattr(Disk, "load", lambda _: None)


def acknowledge_what_is_missing(patch):
    extend = step.extend

    def blind(log, message):
        return extend(log, message) or log

    patch.setattr(step, "extend", blind)


def keep_what_the_new_active_one_lacks(patch):
    extend = step.extend

    def stubborn(log, message):
        longer = extend(log, message)
        return log if longer and longer.position.version <= log.position.version else longer

    patch.setattr(step, "extend", stubborn)


def forget_reports_over_a_restart(patch):
    patch.setattr(Disk, "load_reports", lambda _: ())


def forget_who_has_reported(patch):
    patch.setattr(Reports, "add", lambda self, report: self._talker.publish("task_state", report))


def do_not_write_hand_backs_down(patch):
    save_reports = Disk.save_reports

    def forgetful(self, reports):
        save_reports(self, [each for each in reports if each.state is not TaskState.WAITING])

    patch.setattr(Disk, "save_reports", forgetful)


def count_reports_of_any_assignment(patch):
    hear = Blackboard._hear_update

    def credulous(self, update):
        record = self._node.get(update.task_id)
        if record is not None and record.robot == update.robot_id:
            update = replace(update, assignment=record.assignment)
        hear(self, update)

    patch.setattr(Blackboard, "_hear_update", credulous)


def believe_a_start_that_goes_back(patch):
    patch.setattr(TaskRecord, "gets_on", lambda *_: True)


def carry_out_an_order_again(patch):
    patch.setattr(Reports, "answer", lambda *_: False)


def obey_orders_of_any_age(patch):
    patch.setattr(Lease, "covers", lambda *_: True)


def forget_reports_of_any_assignment(patch):
    disown = Orders.disown

    def sweeping(self, task_id, robot_id, _):
        disown(self, task_id, robot_id, ANY_ASSIGNMENT)

    patch.setattr(Orders, "disown", sweeping)


def send_no_order_to_drop_what_is_cancelled(patch):
    tell = Orders._tell

    def silent(self, task, robot_id, kind, *what):
        record = self._node.get(task.id)
        is_cancelled = record is not None and record.state is TaskState.CANCELLED
        if kind is not OrderKind.TAKE_BACK or not is_cancelled:
            tell(self, task, robot_id, kind, *what)

    patch.setattr(Orders, "_tell", silent)


def pick_under_another_id_after_a_restart(patch):
    knows = SimulatedArm.knows

    def forgetful(self, step):
        return knows(self, replace(step, action="", look=False))

    patch.setattr(SimulatedArm, "knows", forgetful)


def do_not_learn_from_an_order_that_a_pick_had_begun(patch):
    patch.setattr(Loads, "expect", lambda *_: None)


def ignore_the_load_of_a_lost_robot(patch):
    patch.setattr(recovery, "may_be_on_board", lambda _: False)


def work_on_without_a_lease(patch):
    let_a_robot_that_hangs_drive_on(patch)
    patch.setattr(LeaseKeeper, "holds", lambda _: True)


def let_a_robot_that_hangs_drive_on(patch):
    patch.setattr(drive_guard, "GRACE", math.inf)


def drive_on_when_the_lease_ends(patch):
    let_a_robot_that_hangs_drive_on(patch)
    go_on = Controller.go_on

    def heedless(self):
        # It begins no other step: for that, it asks whether it may.
        if self.state not in {State.DRIVING, State.RETURNING}:
            go_on(self)

    patch.setattr(Controller, "go_on", heedless)


def renew_a_lease_after_its_end(patch):
    def generous(self, beat, now):
        if self._robot_id not in beat.heard:
            return False
        self._length = beat.robot_lease
        before, self._end = self._end, now + beat.robot_lease
        return self._end > before

    patch.setattr(Lease, "renew", generous)


def reassign_before_the_lease_has_ended(patch):
    patch.setattr(Leases, "is_lost", lambda self, robot, now: self.unheard_for(robot, now) > 1.5)


def leave_no_margin_after_a_lease(patch):
    lease = BlackboardSettings().robot_lease
    patch.setattr(Leases, "is_lost", lambda self, robot, now: self.unheard_for(robot, now) > lease)


def count_leases_from_before_the_takeover(patch):
    begin = Watch.begin

    def hasty(self):
        begin(self)
        self._leases = Leases(self._settings.reassign, since=float("-inf"))

    patch.setattr(Watch, "begin", hasty)


def decide_without_asking_for_the_leader_lease(patch):
    handle = Auctioneer.handle

    class Leads:
        def __init__(self, node):
            self._node = node

        def __getattr__(self, name):
            return getattr(self._node, name)

        def may_act(self):
            return True

    def hasty(self, event):
        with pytest.MonkeyPatch.context() as meanwhile:
            meanwhile.setattr(self, "_node", Leads(self._node))
            handle(self, event)

    patch.setattr(Auctioneer, "handle", hasty)


def call_nobody_who_was_too_slow(patch):
    ask = auction_step._ask

    def silent(*what, **how):
        state, effects = ask(*what, **how)
        is_closed = bool(effects) and isinstance(effects[0], Broadcast)
        return state, effects[1:] if is_closed else effects

    patch.setattr(auction_step, "_ask", silent)


def carry_out_orders_for_forgotten_tasks(patch):
    answer = Reports.answer

    def forgetful(self, order):
        is_known = order.task.id in self._known or order.task.id in self._open
        return is_known and answer(self, order)

    patch.setattr(Reports, "answer", forgetful)


def let_the_arm_go_on_with_a_load_that_nobody_wants(patch):
    patch.setattr(Controller, "stop_arm", lambda _: None)


def let_the_arm_go_on_when_a_task_is_dropped(patch):
    drop = Robot._drop

    def careless(self, entry):
        with pytest.MonkeyPatch.context() as meanwhile:
            meanwhile.setattr(Controller, "stop_arm", lambda _: None)
            return drop(self, entry)

    patch.setattr(Robot, "_drop", careless)


def let_the_base_drive_on_when_a_task_is_dropped(patch):
    patch.setattr(Controller, "stop_base", lambda _: None)


def know_loads_by_the_ids_of_tasks_alone(patch):
    patch.setattr(Load, "is_of", lambda self, task: self.task_id == task.id)


def let_arms_know_loads_by_the_ids_of_tasks_alone(patch):
    by_id = lambda self, other: self.task_id == other.task_id  # noqa: E731  (one rule in one line)
    patch.setattr(TaskStep, "handles_the_load_of", by_id)


def begin_a_last_step_with_a_full_disk(patch):
    patch.setattr(Loads, "check_writable", lambda _: None)


def try_again_without_a_lease(patch):
    next_event = Controller._next_event

    def hasty(self, run):
        return next_event(self, replace(run, may_go=lambda: True) if run.attempts else run)

    patch.setattr(Controller, "_next_event", hasty)


def stop_the_clock_while_a_machine_sleeps(patch):
    now = HostTalker.now

    def note(host, name, value):
        asleep = getattr(host, name, False)
        object.__setattr__(host, name, value)
        if name == "frozen" and value != asleep:
            since = host.network.now - getattr(host, "slept", 0.0)
            object.__setattr__(host, "slept", since)

    def stopped(self):
        host = self._host
        slept = host.network.now - host.slept if host.frozen else getattr(host, "slept", 0.0)
        return now(self) - slept * host.rate

    patch.setattr(Host, "__setattr__", note)
    patch.setattr(HostTalker, "now", stopped)


STORM, LATE, DISKS, ANY = "election storm", "late messages", "lost disks", ""
ASLEEP = "sleeping machines"

MUTATIONS = (
    Mutation(commit_with_half_of_the_members, (0, STORM)),
    Mutation(
        commit_by_count_what_an_earlier_epoch_left, "figure 8", given=send_one_change_a_message
    ),
    Mutation(announce_before_a_majority_holds_it, (0, STORM)),
    Mutation(answer_before_writing_to_disk, (375, STORM)),
    Mutation(decide_without_asking_for_the_leader_lease, (24, LATE), bug="11520", over_zenoh=200),
    Mutation(drop_the_journal, (2, STORM), over_zenoh=1),
    Mutation(acknowledge_what_is_missing, (0, STORM)),
    Mutation(keep_what_the_new_active_one_lacks, (6, STORM), over_zenoh=5),
    Mutation(forget_reports_over_a_restart, (21, ANY), over_zenoh=3),
    Mutation(forget_who_has_reported, (1, STORM), over_zenoh=1),
    Mutation(do_not_write_hand_backs_down, "a late handback"),
    Mutation(count_reports_of_any_assignment, (158, LATE), over_zenoh=526),
    Mutation(believe_a_start_that_goes_back, "a late start"),
    Mutation(carry_out_an_order_again, (8, ANY), over_zenoh=17),
    Mutation(
        carry_out_orders_for_forgotten_tasks,
        "a forgotten order",
        bug="3563 lost disks",
        over_zenoh=None,
    ),
    Mutation(
        call_nobody_who_was_too_slow, "too slow once", bug="3171 lost disks", over_zenoh=None
    ),
    Mutation(obey_orders_of_any_age, "a late order", over_zenoh=None),
    Mutation(forget_reports_of_any_assignment, "a late word", bug="a late word", over_zenoh=None),
    Mutation(send_no_order_to_drop_what_is_cancelled, "another hive"),
    Mutation(pick_under_another_id_after_a_restart, (8400404, ANY), bug="8400404", over_zenoh=9),
    Mutation(
        do_not_learn_from_an_order_that_a_pick_had_begun,
        (47, DISKS),
        bug="47 lost disks",
        over_zenoh=48,
    ),
    Mutation(let_the_arm_go_on_with_a_load_that_nobody_wants, "a late pick", bug="479 lost disks"),
    Mutation(let_the_arm_go_on_when_a_task_is_dropped, "a dropped pick", bug="5106"),
    Mutation(let_the_base_drive_on_when_a_task_is_dropped, "a restarted drive", bug="37535"),
    Mutation(
        know_loads_by_the_ids_of_tasks_alone,
        "a later load",
        bug="5428",
        given=let_arms_know_loads_by_the_ids_of_tasks_alone,
    ),
    Mutation(let_arms_know_loads_by_the_ids_of_tasks_alone, "an unknown load", bug="40853"),
    Mutation(begin_a_last_step_with_a_full_disk, "a full disk", bug="8100220"),
    Mutation(ignore_the_load_of_a_lost_robot, "a lost load"),
    Mutation(work_on_without_a_lease, (370, STORM), over_zenoh=611),
    Mutation(try_again_without_a_lease, "a frozen pause", bug="35345"),
    Mutation(let_a_robot_that_hangs_drive_on, (34, ANY), bug="34", over_zenoh=295),
    Mutation(drive_on_when_the_lease_ends, (34, ANY), over_zenoh=295),
    Mutation(renew_a_lease_after_its_end, (187, ANY), over_zenoh=353),
    Mutation(reassign_before_the_lease_has_ended, (34, ANY), over_zenoh=31),
    Mutation(leave_no_margin_after_a_lease, "end of a lease"),
    Mutation(count_leases_from_before_the_takeover, (3, STORM), over_zenoh=13),
    Mutation(stop_the_clock_while_a_machine_sleeps, (0, ASLEEP), bug="0 sleeping machines"),
)
