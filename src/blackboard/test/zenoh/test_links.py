# SPDX-License-Identifier: BSD-3-Clause
"""Which link of a process with several robots does what."""

import pytest

pytest.importorskip("blackboard.msg", reason="links need generated messages")

from blackboard.domain.talker import BB_ACK
from blackboard.zenoh.links import ZenohLinks


class FakeLink:
    """The link of one robot, which notes what is asked of it."""

    def __init__(self, name):
        self.name = name
        self.asked = []

    def attach(self, inbox):
        self.asked.append(("attach", inbox))

    def publish(self, *said):
        self.asked.append(("publish", *said))

    def listen(self, topic, name):
        self.asked.append(("listen", topic, name))

    def why_refused(self, value, sender):
        return f"{self.name} refuses {value} of {sender}"

    def watch(self, *what):
        self.asked.append(("watch", *what))


@pytest.fixture
def both():
    return {name: FakeLink(name) for name in ("agv1", "agv2")}


@pytest.fixture
def links(both):
    return ZenohLinks(both)


def test_it_speaks_as_its_robots_each_by_its_own_link(both, links):
    links.publish("agv2", BB_ACK, "yes", ["robot1"])

    assert links.names == ("agv1", "agv2")
    assert [both["agv1"].asked, both["agv2"].asked] == [
        [],
        [("publish", "agv2", BB_ACK, "yes", ["robot1"])],
    ]


def test_all_links_deliver_and_listen(both, links):
    links.attach("the talker")
    links.listen(BB_ACK, BB_ACK)

    for link in both.values():
        assert link.asked == [("attach", "the talker"), ("listen", BB_ACK, BB_ACK)]


def test_the_first_link_hears_who_leads_so_it_judges_and_watches_others(both, links):
    links.watch("/agv2/robot", "robot1", print)

    assert links.why_refused("lies", "robot2") == "agv1 refuses lies of robot2"
    assert both["agv1"].asked == [("watch", "/agv2/robot", "robot1", print)]
    assert both["agv2"].asked == []
