# SPDX-License-Identifier: BSD-3-Clause
"""Rules about chargers."""

import math
from dataclasses import replace

from blackboard.board.charger_grants import ChargerGrants
from blackboard.consensus import node
from blackboard.consensus.lease import Leases
from blackboard.consensus.task_list import committed_list
from blackboard.domain.charger import Grant
from blackboard.robot import drive_guard
from blackboard.robot.charging import Charging, Phase
from hive_lab.fault_schedules.mutations.mutation import Mutation
from hive_lab.fault_schedules.scenarios import ONE_CHARGER


def drive_to_a_charger_that_was_not_given(patch):
    patch.setattr(Charging, "_is_given", property(lambda self: bool(self.charger)))


def take_an_old_grant_for_a_new_one(patch):
    def rash(self):
        given = self._grants.get(self.charger)
        return given is not None and given.robot == self._id

    patch.setattr(Charging, "_is_given", property(rash))


def keep_a_request_without_a_lease(patch):
    def rash(self, charger, *, is_there=False):
        waits = self._phase is Phase.AWAY and self.charger and not self._lease.holds()
        if charger or is_there or not waits:
            say(self, charger, is_there=is_there)

    say = Charging._say
    patch.setattr(Charging, "_say", rash)


def give_a_charger_to_a_second_robot(patch):
    def rash(self, status):
        given = self._node.grants.get(status.charger)
        if given is not None and given.robot != status.robot_id:
            asked = Grant(status.charger, status.robot_id, status.charger_since)
            self._node.give_chargers((asked,))
        else:
            hear(self, status)

    hear = ChargerGrants.hear
    patch.setattr(ChargerGrants, "hear", rash)


def believe_a_late_status_about_a_charger(patch):
    def trusting(self, status):
        known = [each.since for each in self._node.grants.values()]
        hear(self, replace(status, charger_since=max([status.charger_since, *known])))

    hear = ChargerGrants.hear
    patch.setattr(ChargerGrants, "hear", trusting)


def take_the_charger_at_which_a_lost_robot_stands(patch):
    def rash(self, is_lost, is_gone):
        del is_gone
        look(self, is_lost, is_lost)

    look = ChargerGrants.look
    patch.setattr(ChargerGrants, "look", rash)


def take_a_charger_before_the_lease_has_ended(patch):
    def rash(self, is_lost, is_gone):
        del is_lost
        look(self, is_lost=lambda name: silence["of"](name) > 1.5, is_gone=is_gone)

    def noted(self, robot_id, now):
        silence["of"] = lambda name: self.unheard_for(name, now)
        return is_lost(self, robot_id, now)

    silence = {"of": lambda _: 0.0}
    look, is_lost = ChargerGrants.look, Leases.is_lost
    patch.setattr(Leases, "is_lost", noted)
    patch.setattr(ChargerGrants, "look", rash)


def give_a_charger_before_a_majority_knows(patch):
    def rash(member):
        grants = tuple(member.log.latest.grants.values())
        return replace(committed_list(member), grants=grants)

    patch.setattr(node, "committed_list", rash)


def drive_to_a_charger_without_a_lease(patch):
    class Held:
        def __init__(self, lease):
            self.makes_room = lease.makes_room

        def holds(self):
            return True

    def rash(self, **kw):
        lease, self._lease = self._lease, Held(self._lease)
        consider(self, **kw)
        self._lease = lease

    consider = Charging.consider
    patch.setattr(drive_guard, "GRACE", math.inf)
    patch.setattr(Charging, "consider", rash)


def stay_at_the_charger_for_which_another_waits(patch):
    patch.setattr(ChargerGrants, "ask_for_room", lambda *_: None)


MUTATIONS = (
    Mutation(drive_to_a_charger_that_was_not_given, (5, ONE_CHARGER)),
    Mutation(
        take_an_old_grant_for_a_new_one,
        (51, ONE_CHARGER),
        bug="51 robots share a charger",
        over_zenoh=201,
    ),
    Mutation(keep_a_request_without_a_lease, (51, ONE_CHARGER), over_zenoh=17),
    Mutation(give_a_charger_to_a_second_robot, (5, ONE_CHARGER), over_zenoh=37),
    Mutation(give_a_charger_before_a_majority_knows, "given by a minority"),
    Mutation(believe_a_late_status_about_a_charger, (778, ONE_CHARGER), over_zenoh=None),
    Mutation(take_the_charger_at_which_a_lost_robot_stands, (140, ONE_CHARGER), over_zenoh=140),
    Mutation(take_a_charger_before_the_lease_has_ended, (228, ONE_CHARGER), over_zenoh=118),
    Mutation(drive_to_a_charger_without_a_lease, (51, ONE_CHARGER), over_zenoh=51),
    Mutation(stay_at_the_charger_for_which_another_waits, "a lost home", bug="7012"),
)
