# SPDX-License-Identifier: BSD-3-Clause
"""When the process behind a session is proved dead."""

import pytest

from blackboard.process.death import Answer
from blackboard.zenoh.presence import Presence, Token

ROBOT2 = Token("robot2", "5e55", "10.0.0.2:7447")


class Machines:
    """To which hosts there are connections, what they answer, and whose death was told.

    Attributes:
        connected: The hosts, by the ids of sessions.
        answer: What a port answers.
        asked: The addresses that were asked.
        open: How many are being asked.
        died: Whose death was told.
    """

    def __init__(self, connected=None, answer=Answer.REFUSES):
        self.connected = {"5e55": "10.0.0.2"} if connected is None else connected
        self.answer = answer
        self.asked, self.open, self.died = [], 0, []
        self.put_off = []
        self.presence = Presence(
            lambda: self.connected,
            lambda _delay, look: self.put_off.append(look),
            lambda *address: Probe(self, address),
        )
        self.watch("robot2")
        self.pass_time()

    def watch(self, sender):
        """Watch a process in place of any other."""
        self.presence.watch("/robot1/robot", sender, lambda: self.died.append(sender))

    def lose(self, token=ROBOT2):
        """Let a process be there when it is looked at, and then vanish."""
        self.presence.appear(token)
        self.pass_time()
        self.presence.vanish(token)
        self.pass_time()

    def pass_time(self):
        """Let what was put off happen; return how much that was."""
        looks, self.put_off = self.put_off, []
        for look in looks:
            look()
        return len(looks)


class Probe:
    """Asks one of the machines."""

    def __init__(self, machines, address):
        self._machines, self._address = machines, address
        machines.open += 1

    def look(self):
        self._machines.asked.append(self._address)
        return self._machines.answer

    def close(self):
        self._machines.open -= 1


def test_a_process_has_died_whose_token_is_gone_and_whose_address_refuses():
    machines = Machines()
    machines.lose()

    assert machines.died == ["robot2"]
    assert (machines.asked, machines.open) == ([("10.0.0.2", 7447)], 0)


def test_a_death_is_told_once():
    machines = Machines()
    machines.lose()
    machines.pass_time()

    assert machines.died == ["robot2"]


@pytest.mark.parametrize("answer", [Answer.NONE, Answer.ACCEPTS])
def test_a_machine_that_does_not_refuse_proves_nothing_until_it_does(answer):
    machines = Machines(answer=answer)
    machines.lose()
    assert machines.died == []

    machines.answer = Answer.REFUSES
    machines.pass_time()
    assert machines.died == ["robot2"]


@pytest.mark.parametrize(
    ("connected", "token"),
    [
        ({}, ROBOT2),
        ({"5e55": "203.0.113.9"}, ROBOT2),
        ({"another": "10.0.0.2"}, ROBOT2),
        ({"5e55": "10.0.0.2"}, Token("robot2", "5e55")),
        ({"5e55": "10.0.0.2"}, Token("robot2", "5e55", "10.0.0.2:port")),
        ({"5e55": "10.0.0.2"}, Token("robot2", "5e55", "10.0.0.2:70000")),
        ({"5e55": ""}, Token("robot2", "5e55", ":7447")),
    ],
    ids=["router", "translated", "another one", "no address", "no port", "too high", "no host"],
)
def test_an_address_that_may_be_that_of_another_machine_proves_nothing(connected, token):
    machines = Machines(connected)
    machines.lose(token)

    assert (machines.died, machines.asked) == ([], [])


def test_a_process_that_is_back_is_alive_and_the_token_of_its_last_life_may_go():
    machines = Machines({"5e55": "10.0.0.2", "5e56": "10.0.0.2"})
    again = Token("robot2", "5e56", "10.0.0.2:7447")
    machines.presence.appear(ROBOT2)
    machines.pass_time()
    machines.presence.appear(again)
    machines.presence.vanish(ROBOT2)
    machines.pass_time()
    assert machines.died == []

    machines.lose(again)
    assert machines.died == ["robot2"]


def test_nobody_is_looked_at_again_unless_its_token_is_gone_and_it_may_have_died():
    machines = Machines(answer=Answer.NONE)
    machines.presence.appear(ROBOT2)
    assert [machines.pass_time() for _ in range(2)] == [1, 0]

    machines.presence.vanish(ROBOT2)
    assert [machines.pass_time() for _ in range(3)] == [1, 1, 1]
    machines.answer = Answer.REFUSES
    assert [machines.pass_time() for _ in range(2)] == [1, 0]


def test_a_process_that_was_there_before_it_is_watched_is_looked_at():
    machines = Machines()
    machines.watch("robot3")
    machines.presence.appear(ROBOT2)
    machines.pass_time()
    machines.watch("robot2")
    machines.pass_time()
    machines.presence.vanish(ROBOT2)
    machines.pass_time()

    assert machines.died == ["robot2"]


def test_several_changes_at_once_are_one_look():
    machines = Machines()
    machines.presence.appear(ROBOT2)
    machines.presence.appear(Token("robot3", "5e57", "10.0.0.3:7447"))

    assert machines.pass_time() == 1


def test_only_the_process_that_a_watcher_named_last_is_watched():
    machines = Machines()
    machines.presence.watch("/robot1/robot", "robot3", lambda: machines.died.append("robot3"))
    machines.lose()

    assert machines.died == []


def test_nobody_is_asked_whose_token_is_back_or_who_is_watched_no_more():
    machines = Machines(answer=Answer.NONE)
    machines.lose()
    assert machines.open == 1

    machines.presence.appear(ROBOT2)
    machines.pass_time()
    assert machines.open == 0

    machines.presence.vanish(ROBOT2)
    machines.pass_time()
    machines.watch("robot3")
    machines.pass_time()
    assert (machines.open, machines.died) == (0, [])


def test_an_address_of_version_6_is_asked_without_its_brackets():
    machines = Machines({"5e55": "[fd00::2]"})
    machines.lose(Token("robot2", "5e55", "[fd00::2]:7447"))

    assert machines.asked == [("fd00::2", 7447)]


def test_a_token_is_read_from_the_key_that_it_has():
    assert Token.read(ROBOT2.key("hive/lab/alive")) == ROBOT2
    with pytest.raises(ValueError, match="not enough values"):
        Token.read("hive/lab")
