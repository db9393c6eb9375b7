# SPDX-License-Identifier: BSD-3-Clause
"""The menu in which a person closes and opens zones, on a hive that says what the test says."""

import pytest

from fleet_manager.client.traffic import TrafficState, ZoneCommand


@pytest.fixture
def opened(person, window):
    """Open the menu with the mouse; return its entries."""

    def open_menu():
        bar = window.menuBar()
        person.click(bar, bar.actionGeometry(window.zones_menu.menuAction()).center())
        person.wait_until(window.zones_menu.isVisible)
        return window.zones_menu.actions()

    yield open_menu
    window.zones_menu.close()


def test_without_a_traffic_planner_the_menu_says_so(opened):
    (entry,) = opened()

    assert entry.text() == "No traffic planner is heard"
    assert not entry.isEnabled()


def test_a_zone_is_closed_by_its_entry_and_shown_as_the_planner_tells(
    person, window, link, opened
):
    link.say(TrafficState(1, 0.0, zones=("door", "hall"), closed=("hall",)))
    person.wait_until(
        lambda: "zone hall is closed" in window.view.log.data(window.view.log.index(0))
    )
    door, hall = opened()
    assert [(each.text(), each.isChecked()) for each in (door, hall)] == [
        ("door", False),
        ("hall", True),
    ]

    person.click(window.zones_menu, window.zones_menu.actionGeometry(door).center())
    person.wait_until(lambda: link.sent)
    assert link.sent == [ZoneCommand("door", closed=True)]

    link.say(TrafficState(1, 1.0, zones=("door", "hall"), closed=("door", "hall")))
    person.wait_until(
        lambda: "zone door was closed" in window.view.log.data(window.view.log.index(0))
    )
    assert all(each.isChecked() for each in opened())
