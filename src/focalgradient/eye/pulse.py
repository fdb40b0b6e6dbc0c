"""Pulse-step model of disaccommodation: after a sudden decrease of demand, velocity depends on the start.

Accommodation is faster the farther it goes, wherever it starts, as in a linear system; disaccommodation is faster the
nearer it starts, however far it goes (Schor & Bharadwaj 2006; Kasthurirangan & Glasser 2005). In the model of Schor &
Bharadwaj a pulse of acceleration, whose height grows with the starting position, drives the lens towards its far point,
and a step of position ends the movement at its destination: here as soon as the lens would relax to it by itself.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.errors import check_fields
from focalgradient.eye.plant import Plant
from focalgradient.quantities import Range

__all__ = ["Pulse", "PulsedPlant"]

TICK = 0.001
"""Maximum time step within a pulse, in seconds."""

LANDED = 0.02
"""Distance from its destination, in dioptres, at which a pulse ends and the controller continues: a choice."""


@dataclass(frozen=True, slots=True)
class Pulse:
    """Velocity of disaccommodation as a function of the accommodation at its start.

    The four constants by default are the regressions that Bharadwaj & Schor state of six adults, steps of 1 to 4 D from
    2, 3 and 4 D (abstract, Invest. Ophthalmol. Vis. Sci. 45, E-Abstract, 2004; the full text was not read).

    Parameters
    ----------
    velocity, velocity_per_dioptre
        Peak velocity in D/s from infinity, and its increase per dioptre of starting position: 1.12 and 1.39.
    acceleration, acceleration_per_dioptre
        The same for the acceleration in D/s^2: 22.5 and 8.84.
    least
        Minimum fall of the demand between moments, in dioptres; slower or smaller changes are followed as by
        a linear system. A choice: an estimate's noise and sines of 1 Hz stay below it.

    Raises
    ------
    InputError
        If a number is out of its range.

    Examples
    --------
    >>> round(Pulse().peak(3.0), 2)
    5.29
    """

    velocity: Annotated[float, Range("dioptres per second", positive=True)] = 1.12
    velocity_per_dioptre: Annotated[float, Range("1/s", 0)] = 1.39
    acceleration: Annotated[float, Range("dioptres per second squared", positive=True)] = 22.5
    acceleration_per_dioptre: Annotated[float, Range("1/s^2", 0)] = 8.84
    least: Annotated[float, Range("dioptres", positive=True)] = 0.4

    def __post_init__(self) -> None:
        check_fields(self)

    def peak(self, start: float) -> float:
        """Return the peak velocity (D/s) of disaccommodation from `start` (D)."""
        return self.velocity + self.velocity_per_dioptre * max(start, 0.0)

    def push(self, start: float) -> float:
        """Return the acceleration (D/s^2) of disaccommodation from `start` (D)."""
        return self.acceleration + self.acceleration_per_dioptre * max(start, 0.0)


@dataclass(slots=True)
class PulsedPlant:
    """Simulates a plant over time, from rest at a constant `demand` (D); latency is outside, as in `Plant.advance`.

    Examples
    --------
    A step from 4 to 2 D: after 0.2 s focus is half way, and it comes to rest where the plant alone would.

    >>> one = PulsedPlant(Plant(), Pulse(), 4.0)
    >>> round(one.advance(2.0, 0.2), 1), round(one.advance(2.0, 5.0), 2)
    (2.8, 1.93)
    """

    plant: Plant
    pulse: Pulse | None
    demand: float
    _state: FloatArray = field(init=False)  # controller and lens
    _speed: float | None = field(init=False, default=None)  # of the lens to farther (D/s), within a pulse
    _start: float = field(init=False, default=0.0)  # of the pulse
    _landing: bool = field(init=False, default=False)

    def __post_init__(self) -> None:
        self._state = np.full(2, self.plant.steady(self.demand))

    @property
    def accommodation(self) -> float:
        """Present accommodation of the lens, in dioptres."""
        return float(self._state[1])

    def advance(self, demand: float, step: float) -> float:
        """Return the accommodation (D) after `step` seconds of a constant `demand` (D)."""
        fell, self.demand = self.demand - demand, demand
        if self.pulse is not None and self._speed is None and fell >= self.pulse.least:
            moving = (self._state[1] - self._state[0]) / self.plant.time_constant
            self._speed, self._start, self._landing = max(float(moving), 0.0), self.accommodation, False
        left = step
        if self.pulse is not None and self._speed is not None:
            left = self._driven(self.pulse, step)
        if left > 0:
            self._state = self.plant.advance(self._state, demand, left)
        return self.accommodation

    def _driven(self, pulse: Pulse, step: float) -> float:
        """Move the lens by the pulse, then by the step of position; return the seconds left after both."""
        goal = min(max(self.plant.steady(self.demand), 0.0), self.plant.nearest)
        count = max(1, math.ceil(step / TICK - 1e-9))
        tick, tau = step / count, self.plant.time_constant
        lens, speed = self.accommodation, self._speed or 0.0
        for done in range(count):
            ahead = lens - goal
            if ahead <= LANDED:
                self._state, self._speed = np.array([lens - tau * speed, lens]), None
                return step - done * tick
            if self._landing or ahead <= tau * speed:
                self._landing = True
                lens = goal + ahead * math.exp(-tick / tau)
                speed = (lens - goal) / tau
            else:
                before, speed = speed, min(speed + pulse.push(self._start) * tick, pulse.peak(self._start))
                lens -= (before + speed) / 2 * tick
        self._state, self._speed = np.array([lens - tau * speed, lens]), speed
        return 0.0
