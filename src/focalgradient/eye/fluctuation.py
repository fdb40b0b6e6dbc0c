"""Fluctuations of accommodation: the paper's oscillation at about 2 Hz, and the irregular ones of real eyes.

Both are functions of time in dioptres, about a mean of 0; an `Eye` at a moment takes its focus from either. How much
focus changes over a delay tau follows from the power spectrum S alone:

    mean square change = integral of S(f) 4 sin(pi f tau)^2 df.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import boxcox, inv_boxcox

from focalgradient.errors import InputError, check_finite, check_number
from focalgradient.eye.quadrature import panels
from focalgradient.eye.ranges import ordered_times

__all__ = ["Microfluctuations", "Oscillation"]

LOW_END, HIGH_START, HIGH_END = 0.6, 1.0, 2.3
"""Hz: where the low band ends, and the high band begins and ends."""

WAVES = 400
"""Sinusoids that make up one time course of accommodation in each band."""


@dataclass(frozen=True, slots=True)
class Oscillation:
    """Accommodation that swings evenly, the paper's simple form: amplitude x sin(2 pi frequency time + phase).

    Parameters
    ----------
    amplitude
        Dioptres from the middle to an extreme: half of what lies between the extremes.
    frequency
        Hz.
    phase
        Radians.

    Raises
    ------
    InputError
        If a number is not finite, the amplitude is negative, or the frequency is not positive.

    Examples
    --------
    Half a period apart, at the extremes, two views differ by twice the amplitude.

    >>> Oscillation().at([0.125, 0.375]).round(6).tolist()
    [0.25, -0.25]
    """

    amplitude: float = 0.25
    frequency: float = 2.0
    phase: float = 0.0

    def __post_init__(self) -> None:
        check_number("amplitude", self.amplitude, "dioptres", least=0)
        check_number("frequency", self.frequency, "hertz")
        check_number("phase", self.phase, "radians")
        if self.frequency <= 0:
            raise InputError(f"frequency is {self.frequency!r}, but must be positive: give it in hertz.")

    def at(self, times: ArrayLike) -> NDArray[np.float64]:
        """Change of accommodation in dioptres at the moments `times` (s, in order)."""
        return self.amplitude * np.sin(2 * np.pi * self.frequency * ordered_times(times) + self.phase)

    def change_rms(self, delay: ArrayLike) -> NDArray[np.float64]:
        """Root mean square over all phases, in dioptres, of how much focus changes over a `delay` (s, any shape).

        >>> round(float(Oscillation().change_rms(0.25)), 4)  # 0.5 D x (root mean square of a sine)
        0.3536
        """
        delay = check_finite("delay", delay, "seconds")
        return np.sqrt(2) * self.amplitude * np.abs(np.sin(np.pi * self.frequency * delay))


@dataclass(frozen=True, slots=True)
class Microfluctuations:
    """Irregular accommodation, one time course for each seed: low frequencies fall as f^-beta, high ones are a hump.

    A Gaussian process: a sum of waves whose frequencies are spread evenly over the power of each band, with random
    amplitudes and phases. It is a function of time, so that any moments may be asked for, together or one by one.

    Parameters
    ----------
    rms
        Standard deviation of accommodation in dioptres: 0.1 to 0.5 in most eyes.
    high_share
        Share of the power (rms^2) in the high band, 1.0 to 2.3 Hz, which has it evenly; the rest lies below 0.6 Hz.
    beta
        Slope of the low band, power falling as f^-beta: 1.1 to 1.5 in most eyes.
    lowest
        Frequency in Hz at which the low band begins: a law of this kind cannot go down to 0. Slower changes are drift.
    seed
        The same seed is the same time course.

    Raises
    ------
    InputError
        If a number is out of its range.

    Examples
    --------
    >>> fluctuation = Microfluctuations(rms=0.2, seed=3)
    >>> course = fluctuation.at(np.arange(0, 200, 0.05))
    >>> bool(0.1 < course.std() < 0.3)
    True
    >>> round(float(fluctuation.change_rms(0.25)), 3)  # dioptres between two views a quarter of a second apart
    0.153
    """

    rms: float = 0.2
    high_share: float = 0.15
    beta: float = 1.3
    lowest: float = 0.02
    seed: int = 0

    def __post_init__(self) -> None:
        check_number("rms", self.rms, "dioptres", least=0)
        check_number("beta", self.beta, "powers of frequency", least=0)
        if not (np.ndim(self.high_share) == 0 and 0 <= self.high_share <= 1):
            raise InputError(f"high_share is {self.high_share!r}, but must be a share between 0 and 1.")
        if not (np.ndim(self.lowest) == 0 and 0 < self.lowest < LOW_END):
            raise InputError(f"lowest is {self.lowest!r}, but must be above 0 and below {LOW_END:g} Hz.")
        if not (isinstance(self.seed, int) and self.seed >= 0):
            raise InputError(f"seed is {self.seed!r}, but must be a whole number of 0 or more.")

    def spectrum(self, frequency: ArrayLike) -> NDArray[np.float64]:
        """Power per hertz, D^2/Hz, at `frequency` (Hz, any shape); over positive frequencies it sums to rms^2."""
        f = np.asarray(frequency, dtype=float)
        low, high = (f >= self.lowest) & (f <= LOW_END), (f >= HIGH_START) & (f <= HIGH_END)
        area = self.lowest * boxcox(LOW_END / self.lowest, 1 - self.beta)  # integral of (f / lowest)^-beta
        fall = np.where(low, f / self.lowest, 1.0) ** -self.beta / area
        return self.rms**2 * ((1 - self.high_share) * low * fall + self.high_share * high / (HIGH_END - HIGH_START))

    def at(self, times: ArrayLike) -> NDArray[np.float64]:
        """Change of accommodation in dioptres at the moments `times` (s, in order)."""
        moments = ordered_times(times)
        frequency, cosine, sine = self._waves()
        course = np.empty(moments.size)
        for some in np.array_split(np.arange(moments.size), 1 + moments.size // 1000):
            phase = 2 * np.pi * np.outer(moments.ravel()[some], frequency)
            course[some] = np.cos(phase) @ cosine + np.sin(phase) @ sine
        return course.reshape(moments.shape)

    def change_rms(self, delay: ArrayLike) -> NDArray[np.float64]:
        """Root mean square in dioptres of how much focus changes over a `delay` (s, any shape), over all courses."""
        delay = check_finite("delay", delay, "seconds")
        nodes, weights = panels(
            2 * np.pi * HIGH_END * float(np.abs(delay).max(initial=0)) * math.log(LOW_END / self.lowest)
        )
        low, high = self.lowest * (LOW_END / self.lowest) ** nodes, HIGH_START + (HIGH_END - HIGH_START) * nodes
        f = np.concatenate([low, high])
        df = np.concatenate([low * math.log(LOW_END / self.lowest), np.full_like(high, HIGH_END - HIGH_START)])
        power = self.spectrum(f) * df * np.tile(weights, 2)
        return np.sqrt(4 * np.sin(np.pi * delay[..., None] * f) ** 2 @ power)

    def _waves(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        return _waves(self.rms, self.high_share, self.beta, self.lowest, self.seed)


@lru_cache(maxsize=64)
def _waves(
    rms: float, high_share: float, beta: float, lowest: float, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Frequencies of the waves, and the amplitudes of their cosines and sines."""
    random = np.random.default_rng(seed)
    share = (np.arange(WAVES) + random.random((2, WAVES))) / WAVES  # of its band's power below each wave, jittered
    slope = 1 - beta
    low = lowest * inv_boxcox(share[0] * boxcox(LOW_END / lowest, slope), slope)
    high = HIGH_START + (HIGH_END - HIGH_START) * share[1]
    size = rms * np.repeat(np.sqrt([(1 - high_share) / WAVES, high_share / WAVES]), WAVES)
    cosine, sine = size * random.standard_normal((2, 2 * WAVES))
    return np.concatenate([low, high]), cosine, sine
