"""Fluctuations of accommodation: the paper's oscillation at about 2 Hz, and irregular ones as in real eyes.

Both are functions of time in dioptres, with a mean of 0; an `Eye` at a moment takes its focus from either. The change
of focus over a delay tau follows from the power spectrum S alone:

    mean square change = integral of S(f) 4 sin(pi f tau)^2 df.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import boxcox, inv_boxcox

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_fields, check_finite, checked
from focalgradient.eye.quadrature import panels
from focalgradient.eye.ranges import Pupil, ordered_times
from focalgradient.quantities import Range, Seed

__all__ = ["Microfluctuations", "Oscillation", "growth"]

LOW_END, HIGH_START, HIGH_END = 1.0, 1.0, 2.3
"""End of the low band, start and end of the high band, in hertz. The low band was described below 0.6 Hz (Charman &
Heron 1988); its law continues to the high band, as measured spectra are not empty in between."""

SLOWEST = 1 / 300
"""Lowest frequency of drift in hertz, a choice."""

RESTING, PER_DIOPTRE = 0.1, 0.05
"""RMS fluctuation in dioptres at zero accommodation, and its increase per dioptre: within the 0.1 to 0.5 D that Charman
& Heron (1988) review; the line is our choice."""

HIGH_SHARE = 0.15
"""Share of the power in the high band with a large pupil in bright light: our choice."""

SMALL_PUPIL, DIM = 1e-3, 0.002
"""Pupil (m) and luminance (cd/m^2) at which the low-frequency power is doubled: where Gray et al. (1993a, b) and Day et
al. (2009) find it increased."""

WAVES = 400
"""Number of sinusoids in each band of one time course."""


RESPONSE = 2.0
"""Accommodative response in dioptres at which `Microfluctuations.of` gives the default RMS of 0.2 D."""


def growth(response: ArrayLike) -> FloatArray:
    """Return the RMS of fluctuations at an accommodative `response` (D) relative to 2 D, by the law of `of`.

    >>> growth([0.0, 2.0, 6.0]).tolist()
    [0.5, 1.0, 2.0]
    """
    expected = RESTING + PER_DIOPTRE * np.maximum(np.asarray(response, dtype=float), 0)
    return np.asarray(expected / (RESTING + PER_DIOPTRE * RESPONSE))


@dataclass(frozen=True, slots=True)
class Oscillation:
    """Sinusoidal accommodation, the paper's simple form: amplitude x sin(2 pi frequency time + phase).

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

    amplitude: Annotated[float, Range("dioptres", 0)] = 0.25
    frequency: Annotated[float, Range("hertz", positive=True)] = 2.0
    phase: Annotated[float, Range("radians")] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)

    def at(self, times: ArrayLike) -> FloatArray:
        """Return the change of accommodation in dioptres at `times` (s, in order)."""
        return self.amplitude * np.sin(2 * np.pi * self.frequency * ordered_times(times) + self.phase)

    def change_rms(self, delay: ArrayLike) -> FloatArray:
        """Return the RMS change of focus over a `delay` (s, any shape) in dioptres, over all phases.

        >>> round(float(Oscillation().change_rms(0.25)), 4)  # 0.5 D x (root mean square of a sine)
        0.3536
        """
        delay = check_finite("delay", delay, "seconds")
        return np.sqrt(2) * self.amplitude * np.abs(np.sin(np.pi * self.frequency * delay))


@dataclass(frozen=True, slots=True)
class Microfluctuations:
    """Irregular accommodation, one time course for each seed: f^-beta at low frequencies, flat at high ones.

    A Gaussian process: a sum of waves whose frequencies are spread evenly over the power of each band, with random
    amplitudes and phases. It is a function of time, so that any moments may be asked for, together or one by one.

    Parameters
    ----------
    rms
        Standard deviation of accommodation in dioptres: 0.1 to 0.5 in most eyes.
    high_share
        Share of the power (rms^2) in the high band, 1.0 to 2.3 Hz, which has it evenly; the rest lies below.
    beta
        Slope of the low band, power falling as f^-beta: 1.1 to 1.5 in most eyes.
    lowest
        Frequency in Hz at which the low band begins: a law of this kind cannot go down to 0. Slower changes are drift.
    drift
        Standard deviation in dioptres of the drift: changes from 1/300 Hz up to `lowest`, power falling as f^-2, as a
        random walk's does.
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
    0.163
    """

    rms: Annotated[float, Range("dioptres", 0)] = 0.2
    high_share: Annotated[float, Range("shares of the variance", 0, 1)] = 0.15
    beta: Annotated[float, Range("powers of frequency", 0)] = 1.3
    lowest: Annotated[float, Range("hertz", positive=True)] = 0.02
    seed: Seed = 0
    drift: Annotated[float, Range("dioptres", 0)] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        if self.lowest >= LOW_END:
            raise InputError(f"lowest is {self.lowest!r}, but must be above 0 and below {LOW_END:g} Hz.")
        if self.drift and self.lowest <= SLOWEST:
            raise InputError(
                f"lowest is {self.lowest!r}, but drift goes from {SLOWEST:.2g} Hz up to it: give more, or no drift."
            )

    @classmethod
    @checked
    def of(
        cls,
        pupil_diameter: Pupil,
        luminance: Annotated[float, Range("cd/m^2", positive=True)] = 100.0,
        response: Annotated[float, Range("dioptres", 0)] = 1.0,
        *,
        drift: float = 0.1,
        seed: int = 0,
    ) -> Microfluctuations:
        """Return the expected fluctuations for a pupil (m), `luminance` (cd/m^2) and accommodative `response` (D).

        They grow with the response (Kotulak & Schor 1986): 0.1 D + 0.05 x response. Low frequencies grow
        where depth of focus is large: below pupils of about 2 mm and at about 0.002 cd/m^2, while high ones do not
        (Gray, Winn & Gilmartin 1993a, b; Day et al. 2009). Its power is multiplied by 1 + (1 mm / pupil)^2 and by
        1 + 0.002 / luminance. The sources say where fluctuations grow; the form of the laws, fitted to nobody, is ours,
        and so is the `drift` (D).

        Raises
        ------
        InputError
            If a number is out of its range.

        Examples
        --------
        >>> wide, pinhole = (Microfluctuations.of(pupil, 100.0, 2.0) for pupil in (0.005, 0.0005))
        >>> round(wide.rms, 3), round(pinhole.rms, 3)
        (0.203, 0.42)
        """
        power = (RESTING + PER_DIOPTRE * response) ** 2
        low = (1 - HIGH_SHARE) * power
        low *= (1 + (SMALL_PUPIL / pupil_diameter) ** 2) * (1 + DIM / luminance)
        high = HIGH_SHARE * power
        return cls(math.sqrt(low + high), high / (low + high), drift=drift, seed=seed)

    def spectrum(self, frequency: ArrayLike) -> FloatArray:
        """Return the one-sided power spectral density (D^2/Hz) at `frequency` (Hz, any shape).

        That is rms^2 + drift^2.
        """
        f = np.asarray(frequency, dtype=float)
        total = np.zeros(f.shape)
        for start, end, slope, variance in self._bands():
            within = (f >= start) & ((f < end) | (end == HIGH_END) & (f == end))
            area = start * boxcox(end / start, 1 - slope)  # integral of (f / start)^-slope
            total += variance * within * np.where(within, f / start, 1.0) ** -slope / area
        return total

    def _bands(self) -> list[tuple[float, float, float, float]]:
        """Return start and end (Hz), spectral slope and variance of each band."""
        bands = [
            (self.lowest, LOW_END, self.beta, (1 - self.high_share) * self.rms**2),
            (HIGH_START, HIGH_END, 0.0, self.high_share * self.rms**2),
        ]
        return [*bands, (SLOWEST, self.lowest, 2.0, self.drift**2)] if self.drift else bands

    def at(self, times: ArrayLike) -> FloatArray:
        """Return the change of accommodation in dioptres at `times` (s, in order)."""
        moments = ordered_times(times)
        frequency, cosine, sine = self._waves()
        course = np.empty(moments.size)
        for some in np.array_split(np.arange(moments.size), 1 + moments.size // 1000):
            phase = 2 * np.pi * np.outer(moments.ravel()[some], frequency)
            course[some] = np.cos(phase) @ cosine + np.sin(phase) @ sine
        return course.reshape(moments.shape)

    def change_rms(self, delay: ArrayLike) -> FloatArray:
        """Return the RMS change of focus over a `delay` (s, any shape) in dioptres, over all courses."""
        delay = check_finite("delay", delay, "seconds")
        longest = float(np.abs(delay).max(initial=0))
        changed = np.zeros(delay.shape)
        for start, end, slope, variance in self._bands():
            nodes, weights = panels(2 * np.pi * end * longest * math.log(end / start))
            f = start * (end / start) ** nodes
            power = variance * (f / start) ** -slope / (start * boxcox(end / start, 1 - slope))
            changed += 4 * np.sin(np.pi * delay[..., None] * f) ** 2 @ (power * f * math.log(end / start) * weights)
        return np.asarray(np.sqrt(changed))

    def _waves(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        return _waves(tuple(self._bands()), self.seed)


@lru_cache(maxsize=64)
def _waves(
    bands: tuple[tuple[float, float, float, float], ...], seed: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the sinusoids' frequencies, and the amplitudes of their cosines and sines."""
    made = []
    for number in (slice(0, 2), slice(2, 3)):  # drift comes last, for the others to be the same without it
        some = bands[number]
        random = np.random.default_rng([seed, 1] if number.start else seed)
        share = (np.arange(WAVES) + random.random((len(some), WAVES))) / WAVES  # of its band's power below each wave
        frequency = [
            start * inv_boxcox(part * boxcox(end / start, 1 - slope), 1 - slope)
            for part, (start, end, slope, _) in zip(share, some, strict=True)
        ]
        size = np.repeat([math.sqrt(variance / WAVES) for _, _, _, variance in some], WAVES)
        cosine, sine = size * random.standard_normal((2, size.size))
        made.append((np.ravel(frequency), cosine, sine))
    frequency, cosine, sine = (np.concatenate(parts) for parts in zip(*made, strict=True))
    return frequency, cosine, sine
