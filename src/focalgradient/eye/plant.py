"""Motor plant of accommodation: response of focus to a demand, with a latency, a leaky integrator and a lens.

A controller compares the demand with an internal copy of the lens's response and integrates the difference, with a leak
towards the resting focus; the lens follows the integrator as a first-order system:

    integrator x u' = -u + rest + gain x (demand - a),      time_constant x a' = u - a,

the demand that of `latency` seconds before. The copy of the lens within the controller keeps the latency outside its
loop, as in the Smith predictor of Read et al. (2022): with the latency inside, this gain would oscillate.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields, check_finite
from focalgradient.quantities import Range

__all__ = ["Plant"]


@dataclass(frozen=True, slots=True)
class Plant:
    """Parameters of the response of accommodation to its demand.

    Parameters
    ----------
    latency
        Seconds from the demand to the first change of focus: 0.3, of 0.25 to 0.4 measured (Campbell & Westheimer 1960).
    time_constant
        Time constant of the lens in seconds: 0.156, after Schor & Bharadwaj (2006).
    gain
        Gain of the controller: 8, after Read et al. (2022). The steady error, the lag, is 1 / (1 + gain) of the
        demand's distance from rest.
    integrator
        Time constant of the leaky integrator in seconds: 2.5, likewise.
    rest
        Focus in dioptres without a demand: 1.4, likewise; 1.5 on average in the dark (Leibowitz & Owens 1978).
    nearest
        Maximum accommodation in dioptres; the minimum is 0, infinity. 8: a young eye's, our choice.

    Raises
    ------
    InputError
        If a number is out of its range.

    Examples
    --------
    The steady lag at 4 D, and a step from 1 to 3 D a second after it.

    >>> plant = Plant()
    >>> round(4 - plant.steady(4.0), 3)
    0.289
    >>> plant.step_response([0.3, 1.0, 5.0], 1.0, 3.0).round(3).tolist()
    [1.044, 2.825, 2.822]
    """

    latency: Annotated[float, Range("seconds", 0)] = 0.3
    time_constant: Annotated[float, Range("seconds", positive=True)] = 0.156
    gain: Annotated[float, Range("dioptres per dioptre", 0)] = 8.0
    integrator: Annotated[float, Range("seconds", positive=True)] = 2.5
    rest: Annotated[float, Range("dioptres", 0)] = 1.4
    nearest: Annotated[float, Range("dioptres", positive=True)] = 8.0

    def __post_init__(self) -> None:
        check_fields(self)
        if self.rest > self.nearest:
            raise InputError(f"rest is {self.rest!r} D, but must not lie nearer than nearest, {self.nearest!r} D.")

    def steady(self, demand: float) -> float:
        """Return the steady accommodation (D) for a constant `demand` (D): (gain x demand + rest) / (1 + gain)."""
        return (self.gain * demand + self.rest) / (1 + self.gain)

    def step_response(self, times: ArrayLike, before: float, after: float) -> FloatArray:
        """Return accommodation at `times` (s after a step of demand from `before` to `after` (D), any shape): exact.

        Of the linear plant, whose lens has no limits: two exponentials, or a damped oscillation.
        """
        since = np.maximum(check_finite("times", times, "seconds") - self.latency, 0)
        start, end = self.steady(before), self.steady(after)
        slow, fast = np.roots(
            [self.time_constant * self.integrator, self.time_constant + self.integrator, 1 + self.gain]
        ).astype(complex)
        if abs(slow - fast) < 1e-9 * abs(slow):
            return end + (start - end) * ((1 - slow.real * since) * np.exp(slow.real * since))
        # At rest before: a' = 0 at the step, as the integrator has not moved yet.
        left = (fast * np.exp(slow * since) - slow * np.exp(fast * since)) / (fast - slow)
        return end + (start - end) * left.real

    def sine_response(self, frequency: ArrayLike) -> NDArray[np.complex128]:
        """Return accommodation over demand at `frequency` (Hz, any shape): modulus is gain, angle is phase (rad).

        >>> found = Plant().sine_response(0.2)
        >>> round(float(abs(found)), 3), round(float(np.degrees(np.angle(found))), 1)
        (0.887, -43.3)
        """
        s = 2j * np.pi * check_finite("frequency", frequency, "hertz")
        loop = (1 + self.integrator * s) * (1 + self.time_constant * s) + self.gain
        return np.asarray(self.gain * np.exp(-s * self.latency) / loop)

    def advance(self, state: FloatArray, demand: float, step: float) -> FloatArray:
        """Return the `state` (integrator and accommodation, D) after `step` seconds of a constant `demand`; no latency.

        Exact, and then kept between infinity and `nearest`.

        >>> Plant().advance(np.array([1.4, 1.4]), 1.4, 0.1).tolist()
        [1.4, 1.4]
        """
        end = self.steady(demand)
        after: FloatArray = end + _decay(self.integrator, self.time_constant, self.gain, step) @ (state - end)
        return np.clip(after, 0, self.nearest)


@lru_cache(maxsize=32)
def _decay(integrator: float, time_constant: float, gain: float, step: float) -> FloatArray:
    """Return the 2 x 2 matrix by which integrator and lens approach their steady state in `step` seconds."""
    system = np.array([[-1, -gain], [1, -1]]) / np.array([[integrator], [time_constant]])
    return np.asarray(expm(system * step))
