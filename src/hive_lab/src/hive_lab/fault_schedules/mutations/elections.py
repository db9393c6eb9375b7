# SPDX-License-Identifier: BSD-3-Clause
"""Rules of elections, of the leader and of the list of members."""

from dataclasses import replace
from types import MappingProxyType

import pytest

from blackboard.consensus import election, leader, node, step
from blackboard.consensus.hive_filter import MemberFilter
from blackboard.consensus.member import name_of, patience_of
from blackboard.consensus.messages import AppendReply, BallotKind
from blackboard.consensus.node import RaftNode
from hive_lab.fault_schedules.mutations.mutation import Mutation
from hive_lab.fault_schedules.simulated_member import Disk

BEFORE = dict.fromkeys(("heard", "loyal_until", "quiet_until"), float("-inf"))
"""Of a member that owes nobody any patience."""


def vote_for_any_list(patch):
    patch.setattr(election, "is_up_to_date", lambda *_: True)


def compare_lists_by_length_alone(patch):
    def longer(member, position):
        return position.version >= member.log.position.version

    patch.setattr(election, "is_up_to_date", longer)


def vote_although_the_active_one_is_heard(patch):
    patch.setattr(election, "misses_leader", lambda *_: True)


def vote_twice_in_an_epoch(patch):
    patch.setattr(election, "has_vote_for", lambda *_: True)


def do_not_take_a_vote_for_a_promise(patch):
    handle_vote_request = election.handle_vote_request

    def loose(member, ballot, now):
        after, messages = handle_vote_request(member, ballot, now)
        if after.vote != member.vote and after.vote:
            before = {name: getattr(member, name) for name in ("leader", "loyal_until", "heard")}
            after = after.evolve(**before)
        return after, messages

    patch.setattr(election, "handle_vote_request", loose)


def forget_the_vote_over_a_restart(patch):
    load = Disk.load

    def forgetful(self):
        hard_state = load(self)
        return hard_state and replace(hard_state, vote="", epoch=hard_state.log.position.epoch)

    patch.setattr(Disk, "load", forgetful)


def write_the_vote_with_the_next_change(patch):
    save = RaftNode._save

    def lazy(self, before, after):
        same_log = after.log.base is before.log.base and after.log.entries is before.log.entries
        return same_log or save(self, before, after)

    patch.setattr(RaftNode, "_save", lazy)


def vote_at_once_after_a_restart(patch):
    restore = node.restore

    def hasty(*what, **how):
        return restore(*what, **how).evolve(**BEFORE)

    patch.setattr(node, "restore", hasty)


def sit_out_half_the_time_after_a_restart(patch):
    restore = node.restore

    def hasty(hard_state, settings, now, **how):
        member = restore(hard_state, settings, now, **how)
        half = settings.election / 2
        sooner = {name: getattr(member, name) - half for name in BEFORE}
        return member.evolve(**sooner)

    patch.setattr(node, "restore", hasty)


def let_one_of_two_vote_at_once_after_a_restart(patch):
    restore = node.restore

    def hasty(*what, **how):
        member = restore(*what, **how)
        if len(member.members) > 2:
            return member
        return member.evolve(**BEFORE)

    patch.setattr(node, "restore", hasty)


def grant_every_pre_vote(patch):
    handle_vote_request = election.handle_vote_request

    def generous(member, ballot, now):
        after, messages = handle_vote_request(member, ballot, now)
        if ballot.kind is BallotKind.PRE_VOTE:
            messages = [replace(each, granted=True) for each in messages]
        return after, messages

    patch.setattr(election, "handle_vote_request", generous)


def elect_with_half_of_the_members(patch):
    def half(voters, members):
        return sum(voter in members for voter in voters) >= max(1, len(members) // 2)

    patch.setattr(election, "is_majority", half)


def count_a_vote_however_late(patch):
    patch.setattr(election, "is_vote_in_time", lambda *_: True)


def obey_an_active_one_of_any_epoch(patch):
    follow = step._follow

    def meek(member, epoch, name, hive):
        return follow(member, max(epoch, member.epoch), name, hive)

    patch.setattr(step, "_follow", meek)


def count_answers_of_any_epoch(patch):
    append_reply, vote_reply = leader.handle_append_reply, election.handle_vote_reply

    def count_reply(member, reply, now):
        return append_reply(member, replace(reply, epoch=member.epoch), now)

    def count_vote(member, ballot, now):
        if ballot.kind is BallotKind.VOTE_REPLY:
            ballot = replace(ballot, epoch=member.epoch)
        return vote_reply(member, ballot, now)

    patch.setattr(leader, "handle_append_reply", count_reply)
    patch.setattr(election, "handle_vote_reply", count_vote)


def ignore_epochs(patch):
    obey_an_active_one_of_any_epoch(patch)
    count_answers_of_any_epoch(patch)
    patch.setattr(MemberFilter, "obeys", lambda *_: True)


def lead_on_although_an_answer_names_a_higher_epoch(patch):
    receive = step._receive

    def stubborn(member, message, now):
        if isinstance(message, AppendReply) and message.epoch > member.epoch:
            return member, []
        return receive(member, message, now)

    patch.setattr(step, "_receive", stubborn)


def count_when_an_answer_came(patch):
    handle_append_reply = leader.handle_append_reply

    def generous(member, reply, now):
        return handle_append_reply(member, replace(reply, echo=now), now)

    patch.setattr(leader, "handle_append_reply", generous)


def act_for_longer_than_was_promised(patch):
    patch.setattr(leader, "lease_of", lambda settings, _: settings.self_demotion)


def count_a_late_promise_from_the_last_answer(patch):
    handle_append_reply = leader.handle_append_reply

    def hasty(member, reply, now):
        known = member.peers.get(reply.member)
        if known is not None and known.echo > reply.echo:
            reply = replace(reply, echo=known.echo)
        return handle_append_reply(member, reply, now)

    patch.setattr(leader, "handle_append_reply", hasty)


def take_a_promise_back_with_the_next(patch):
    def fickle(member, now):
        return member.evolve(heard=now, died=None, loyal_until=now + patience_of(member))

    patch.setattr(election, "be_loyal", fickle)
    patch.setattr(step, "be_loyal", fickle)


def go_on_without_a_majority(patch):
    for module in (leader, step, node):
        patch.setattr(module, "has_lease", lambda *_: True)


def change_members_without_waiting(patch):
    patch.setattr(leader, "may_change_members", lambda *_: True)


def change_members_before_an_own_change(patch):
    may_change_members = leader.may_change_members

    def early(log, _):
        return may_change_members(log, log.at(log.committed).epoch)

    patch.setattr(leader, "may_change_members", early)


def add_members_that_lack_the_list(patch):
    next_members = leader.next_members

    def hasty(member, now):
        holds = member.log.committed
        peers = {each: replace(peer, version=holds) for each, peer in member.peers.items()}
        return next_members(member.evolve(peers=MappingProxyType(peers)), now)

    patch.setattr(leader, "next_members", hasty)


def keep_the_id_when_the_disk_is_lost(patch):
    restore = node.restore

    def same(hard_state, *what, **how):
        return restore(replace(hard_state, member=name_of(hard_state.member)), *what, **how)

    patch.setattr(node, "restore", same)


def act_on_what_an_old_answer_commits(patch):
    react = RaftNode._react

    def hasty(self, before, after):
        with pytest.MonkeyPatch.context() as meanwhile:
            meanwhile.setattr(node, "has_lease", lambda *_: True)
            react(self, before, after)

    patch.setattr(RaftNode, "_react", hasty)


def rely_on_what_a_member_had_before_it_restarted(patch):
    handle_append_reply = leader.handle_append_reply

    def trusting(member, reply, now):
        known = member.peers.get(reply.member)
        if known is not None and reply.epoch == member.epoch:
            reply = replace(reply, version=max(reply.version, known.version))
        return handle_append_reply(member, reply, now)

    patch.setattr(leader, "handle_append_reply", trusting)


STORM, LATE, RESTARTS = "election storm", "late messages", "quick restarts"
CHURN, DISKS = "members come and go", "lost disks"

MUTATIONS = (
    Mutation(vote_for_any_list, (16, STORM), over_zenoh=1),
    Mutation(compare_lists_by_length_alone, "a longer list"),
    Mutation(vote_although_the_active_one_is_heard, (8, STORM), over_zenoh=8),
    Mutation(vote_twice_in_an_epoch, "rivals"),
    Mutation(do_not_take_a_vote_for_a_promise, (71, STORM), over_zenoh=11),
    Mutation(forget_the_vote_over_a_restart, "forgetful rivals"),
    Mutation(write_the_vote_with_the_next_change, "a restarted voter"),
    Mutation(vote_at_once_after_a_restart, (3, RESTARTS), over_zenoh=14),
    Mutation(sit_out_half_the_time_after_a_restart, "a short silence"),
    Mutation(let_one_of_two_vote_at_once_after_a_restart, "an old list"),
    Mutation(grant_every_pre_vote, "a needless election"),
    Mutation(elect_with_half_of_the_members, (1, STORM)),
    Mutation(count_a_vote_however_late, "late vote", bug="late vote"),
    Mutation(obey_an_active_one_of_any_epoch, (36, LATE), over_zenoh=75),
    Mutation(ignore_epochs, (60, LATE), over_zenoh=6),
    Mutation(lead_on_although_an_answer_names_a_higher_epoch, "an epoch ahead", over_zenoh=None),
    Mutation(count_when_an_answer_came, (19, LATE), over_zenoh=8),
    Mutation(act_for_longer_than_was_promised, (0, STORM), over_zenoh=2),
    Mutation(
        count_a_late_promise_from_the_last_answer,
        (326, LATE),
        bug="326 late messages",
        over_zenoh=873,
    ),
    Mutation(take_a_promise_back_with_the_next, (18, STORM), over_zenoh=3),
    Mutation(go_on_without_a_majority, (0, STORM)),
    Mutation(act_on_what_an_old_answer_commits, "an old answer", bug="26734"),
    Mutation(rely_on_what_a_member_had_before_it_restarted, "nothing else happens", bug="54852"),
    Mutation(change_members_without_waiting, (39, CHURN), over_zenoh=39),
    Mutation(change_members_before_an_own_change, "two new members"),
    Mutation(add_members_that_lack_the_list, "gone at once"),
    Mutation(keep_the_id_when_the_disk_is_lost, (46, DISKS), over_zenoh=43),
)
