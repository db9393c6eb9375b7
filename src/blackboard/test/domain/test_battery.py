# SPDX-License-Identifier: BSD-3-Clause
"""The battery: its curve, its figures by hand, and that no energy gets lost in it."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blackboard.domain.battery import Battery, BatteryModel, MeasuredBattery
from blackboard.errors import CharacteristicsError

MODEL = BatteryModel(capacity=20.0, voltage_full=28.0, voltage_empty=22.0, charging_time=3600.0)
LEVELS = st.floats(0.0, 1.0)


def test_the_voltage_at_both_ends_is_the_robot_s_own():
    battery = Battery(MODEL)

    assert battery.get_volts(1.0) == 28.0
    assert battery.get_volts(0.0) == 22.0


def test_the_voltage_in_the_middle_is_that_of_the_curve():
    # Half full is 65 % of the voltage range: 22 V + 0.65 * 6 V.
    assert Battery(MODEL, 0.5).get_volts() == pytest.approx(25.9)


@given(LEVELS, LEVELS)
def test_a_fuller_battery_never_has_the_lower_voltage(one, other):
    low, high = sorted((one, other))

    assert Battery(MODEL, low).get_volts() <= Battery(MODEL, high).get_volts()


def test_the_voltage_drops_steeply_near_full_and_near_empty_and_slowly_between():
    def slope(low, high):
        return (Battery(MODEL, high).get_volts() - Battery(MODEL, low).get_volts()) / (high - low)

    assert slope(0.95, 1.0) > 2 * slope(0.4, 0.6)
    assert slope(0.0, 0.05) > 2 * slope(0.4, 0.6)


def test_the_current_is_power_over_voltage():
    # 56 W at 28 V.
    assert Battery(MODEL).get_amps(56.0) == 2.0


def test_the_charge_for_an_energy_is_in_ampere_hours():
    # 28 V * 1 A * 3600 s = 100 800 J make one Ah.
    assert Battery(MODEL).charge_for(100_800.0) == pytest.approx(1.0)


def test_drawing_an_energy_lowers_the_level_by_its_share_of_the_capacity():
    battery = Battery(MODEL)

    battery.update_level(100_800.0)

    assert battery.charge_left == pytest.approx(19.0)
    assert battery.level == pytest.approx(0.95)


@given(st.floats(0.3, 1.0), st.floats(1.0, 200_000.0))
def test_the_energy_drawn_is_the_charge_taken_times_the_voltage_summed_up(level, energy):
    battery = Battery(MODEL, level)
    parts = 200
    taken = 0.0
    for _ in range(parts):
        before, volts = battery.charge_left, battery.get_volts()
        battery.update_level(energy / parts)
        taken += (before - battery.charge_left) * 3600.0 * volts

    assert taken == pytest.approx(energy, rel=1e-6)


def test_drawing_in_small_parts_agrees_with_the_area_under_the_voltage_curve():
    battery = Battery(MODEL, 0.8)
    energy = 3600.0 * 100.0
    for _ in range(10_000):
        battery.update_level(energy / 10_000)

    # From 0.8 down to the level x the curve is a straight line between (0.5, 25.9 V) and
    # (0.8, 26.8 V), so the area under it over the capacity is the energy.
    mean = (26.8 + battery.get_volts()) / 2
    assert (0.8 - battery.level) * 20.0 * 3600.0 * mean == pytest.approx(energy, rel=1e-4)


def test_an_empty_battery_stays_empty():
    battery = Battery(MODEL, 0.01)

    battery.update_level(1e9)

    assert battery.level == 0.0
    assert battery.get_volts() == 22.0


def test_half_the_charging_time_gives_half_the_charge():
    battery = Battery(MODEL, 0.2)

    battery.charge(1800.0)

    assert battery.level == pytest.approx(0.7)


def test_a_full_battery_stays_full():
    battery = Battery(MODEL, 0.9)

    battery.charge(7200.0)

    assert battery.level == 1.0


@pytest.mark.parametrize("charge", [-0.01, 1.01, math.nan])
def test_no_battery_is_fuller_than_full_or_emptier_than_empty(charge):
    with pytest.raises(CharacteristicsError, match=rf"charge is {charge!r}.*from 0 to 1"):
        Battery(MODEL, charge)


@pytest.mark.parametrize("name", ["capacity", "voltage_empty", "charging_time"])
@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_a_battery_that_cannot_be_is_refused_by_the_name_of_the_value(name, bad):
    values = {
        "capacity": 20.0,
        "voltage_full": 28.0,
        "voltage_empty": 22.0,
        "charging_time": 3600.0,
    }

    with pytest.raises(CharacteristicsError, match=rf"{name} is {bad!r}; allowed: above 0"):
        BatteryModel(**{**values, name: bad})


@pytest.mark.parametrize("bad", [21.9, math.nan, math.inf])
def test_a_full_battery_does_not_have_less_voltage_than_an_empty_one(bad):
    with pytest.raises(CharacteristicsError, match=r"at least voltage_empty, which is 22\.0 V"):
        BatteryModel(20.0, bad, 22.0, 3600.0)


def test_a_battery_that_is_measured_is_as_full_as_its_robot_says():
    battery = MeasuredBattery(BatteryModel(40.0, 27.0, 22.0, 3600.0), 0.5)
    battery.update_level(1e9)
    battery.charge(1e9)
    assert battery.level == 0.5

    battery.measure(0.8)
    assert battery.level == 0.8
    battery.measure(1.7)
    assert battery.level == 1.0
