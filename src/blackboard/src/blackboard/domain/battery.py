# SPDX-License-Identifier: BSD-3-Clause
"""A battery whose voltage drops as it empties (the report's Battery)."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass

from blackboard.errors import CharacteristicsError

SECONDS_PER_HOUR = 3600.0

# The voltage at a charge, as a share of its range: steep near full, flat in the middle, a knee
# near empty. Makers of lithium-ion cells publish discharge curves of this shape for 0.2 C; the end
# points are the robot's own.
_CHARGE_POINTS = (0.0, 0.05, 0.10, 0.20, 0.50, 0.80, 0.95, 1.0)
_VOLTAGE_SHARES = (0.0, 0.30, 0.42, 0.52, 0.65, 0.80, 0.93, 1.0)
_LAST = len(_CHARGE_POINTS) - 2


@dataclass(frozen=True, slots=True)
class BatteryModel:
    """What kind of battery it is.

    Raises:
        CharacteristicsError: A value is outside its range.
    """

    capacity: float  # [Ah], above 0
    voltage_full: float  # [V] when charged
    voltage_empty: float  # [V] when empty, above 0 and at most `voltage_full`
    charging_time: float  # from empty to full [s], above 0

    def __post_init__(self) -> None:
        for name in ("capacity", "voltage_empty", "charging_time"):
            if not 0 < getattr(self, name) < math.inf:
                raise CharacteristicsError(
                    f"battery: {name} is {getattr(self, name)!r}; allowed: above 0"
                )
        if not self.voltage_empty <= self.voltage_full < math.inf:
            raise CharacteristicsError(
                f"battery: voltage_full is {self.voltage_full!r}; "
                f"allowed: at least voltage_empty, which is {self.voltage_empty!r} V"
            )


class Battery:
    """One battery and how full it is, from 0 to 1.

    Raises:
        CharacteristicsError: The charge is outside its range.
    """

    IS_MEASURED = False
    """Whether the robot tells how full it is; otherwise that is reckoned by the formula."""

    def __init__(self, model: BatteryModel, charge: float = 1.0) -> None:
        if not 0.0 <= charge <= 1.0:
            raise CharacteristicsError(f"battery: charge is {charge!r}; allowed: from 0 to 1")
        self._model = model
        self._charge = charge

    @property
    def level(self) -> float:
        """How full it is, from 0 to 1 (as in sensor_msgs/BatteryState)."""
        return self._charge

    @property
    def charge_left(self) -> float:
        """The charge that is left [Ah]."""
        return self._charge * self._model.capacity

    @property
    def capacity(self) -> float:
        """The charge when it is full [Ah]."""
        return self._model.capacity

    def get_volts(self, level: float | None = None) -> float:
        """Return the voltage [V] at a level from 0 to 1; by default at the present one."""
        level = min(max(self._charge if level is None else level, 0.0), 1.0)
        i = min(bisect_right(_CHARGE_POINTS, level) - 1, _LAST)
        start, low = _CHARGE_POINTS[i], _VOLTAGE_SHARES[i]
        slope = (_VOLTAGE_SHARES[i + 1] - low) / (_CHARGE_POINTS[i + 1] - start)
        share = slope * (level - start) + low
        model = self._model
        return model.voltage_empty + share * (model.voltage_full - model.voltage_empty)

    def get_amps(self, power: float) -> float:
        """Return the current [A] that a power [W] draws now."""
        return power / self.get_volts()

    def charge_for(self, energy: float) -> float:
        """Return the charge [Ah] that an energy [J] takes at the present voltage."""
        return energy / (SECONDS_PER_HOUR * self.get_volts())

    def update_level(self, energy: float) -> None:
        """Draw an energy [J], at least 0; an empty battery stays empty."""
        self._charge = max(0.0, self._charge - self.charge_for(energy) / self._model.capacity)

    def drop_to(self, level: float) -> None:
        """Lower the charge to a level from 0 to 1; a lower charge stays as it is.

        Raises:
            CharacteristicsError: The level is outside its range.
        """
        if not 0.0 <= level <= 1.0:
            raise CharacteristicsError(f"battery: charge is {level!r}; allowed: from 0 to 1")
        self._charge = min(self._charge, level)

    def charge(self, duration: float) -> None:
        """Charge for a time [s], at the constant rate that fills it in `charging_time`."""
        self._charge = min(1.0, self._charge + duration / self._model.charging_time)


class MeasuredBattery(Battery):
    """A battery whose robot tells how full it is, so nothing has to be worked out."""

    IS_MEASURED = True

    def measure(self, level: float) -> None:
        """Take over a level from 0 to 1."""
        self._charge = min(max(level, 0.0), 1.0)

    def update_level(self, energy: float) -> None:
        """Leave it to the robot to tell what an energy [J] took."""

    def charge(self, duration: float) -> None:
        """Leave it to the robot to tell what charging for a time [s] gave."""
