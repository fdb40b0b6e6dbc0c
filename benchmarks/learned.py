"""Depth estimator without given optics, which has learned the blur of its own eye from its own views.

It is trained on many walls of natural texture at known distances, and stores the correlation functions of its two
views, normalised by the power of natural textures. From these follows how two views of one place differ in contrast and
phase at each frequency and vergence, which is what equalisation needs. Assumptions: textures are natural (power
proportional to 1 / frequency squared), the noise is known, and so are the walls' distances during training, as touch or
another cue would provide them. The training walls are periodic textures of 64 x 64 pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.eye import Cones

SIDE = 64
"""Width of a wall in pixels: wider than a blur of 16 pixels' radius and its mirror image."""

STEP = 0.1
"""Step of the learned distances, in dioptres."""

LOOKS = 64
"""Number of walls at each distance."""

SKIRT = 6.0
"""Margin in pixels, beyond twice the blur radius, within which correlations are stored; beyond it is only noise."""

CONTRAST = 0.2


class Experience:
    """Correlations of two views of walls: vergences T, lags T x 3 x SIDE x SIDE (of the first, cross, the second)."""

    def __init__(self, vergences: NDArray[np.float64], lags: NDArray[np.float64], pixel_angle: float) -> None:
        self.vergences, self.lags, self.pixel_angle = vergences, lags, pixel_angle

    @classmethod
    def of(
        cls, cones: Sequence[Cones], pixel_angle: float, nearest: float, *, noise: float, correlation: float, seed: int
    ) -> Experience:
        """Learn from walls from infinity to `nearest` (D) seen through two `cones`."""
        random = np.random.default_rng([seed, 77])
        down, right = np.fft.fftfreq(SIDE)[:, None], np.fft.rfftfreq(SIDE)
        radius = np.hypot(down, right)
        radius[0, 0] = np.inf
        amplitude = np.where(radius < 0.5, 1 / radius, 0)
        amplitude *= CONTRAST / np.fft.irfft2(amplitude * np.fft.rfft2(random.standard_normal((SIDE, SIDE)))).std()
        vergences = np.linspace(0, nearest, 1 + round(nearest / STEP))
        passed = [one.through_focus(down / pixel_angle, right / pixel_angle, vergences) for one in cones]
        mix = correlation if cones[0].light != cones[1].light else 1.0
        place = np.minimum(np.arange(SIDE), SIDE - np.arange(SIDE))
        lag = np.hypot(place[:, None], place)
        lags = np.empty((len(vergences), 3, SIDE, SIDE))
        for number, vergence in enumerate(vergences):
            white = np.fft.rfft2(random.standard_normal((2, LOOKS, SIDE, SIDE)))
            textures = amplitude * np.stack([white[0], mix * white[0] + np.sqrt(1 - mix**2) * white[1]])
            seen = textures * np.stack([one[number] for one in passed])[:, None]
            seen += noise * np.fft.rfft2(random.standard_normal((*seen.shape[:2], SIDE, SIDE)))
            # transfer of the second relative to the first: multiply by the conjugate of the first
            pairs = ((0, 0), (1, 0), (1, 1))
            power = np.stack([(seen[a] * seen[b].conj()).mean(axis=0) for a, b in pairs])
            power[[0, 2]] -= (noise * SIDE) ** 2
            over = power / np.maximum((amplitude * SIDE) ** 2, 1e-30) * (amplitude > 0)
            # noise limits fine detail: weight it by its power
            sure = np.maximum((amplitude * SIDE) ** 2 * np.abs(over[0::2]).max(axis=0), 0) / (noise * SIDE) ** 2
            over *= sure / (sure + 1 / np.sqrt(LOOKS))
            radii = [abs(one.focus_vergence - vergence) * one.aperture_diameter / 2 / pixel_angle for one in cones]
            lags[number] = np.fft.irfft2(over, (SIDE, SIDE)) * (lag < 2 * max(radii) + SKIRT)
        return cls(vergences, lags, pixel_angle)

    def transfers(self, down: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Return the transfer of both views at each learned vergence, on a frequency grid (cycles per radian).

        T x 2 x rows x columns, up to a common factor of both views: it varies smoothly with vergence, and is positive
        for the first view where blur is least.
        """
        place = (np.arange(SIDE) + SIDE // 2) % SIDE - SIDE // 2
        turn_down = np.exp(-2j * np.pi * self.pixel_angle * down[:, None] * place)
        turn_right = np.exp(-2j * np.pi * self.pixel_angle * place[:, None] * right)
        first, both, second = np.moveaxis(turn_down @ self.lags @ turn_right, 1, 0)
        a, d = np.maximum(first.real, 0), np.maximum(second.real, 0)
        # leading eigenvector of [[a, both*], [both, d]], normalised
        half = (a - d) / 2
        leading = (a + d) / 2 + np.sqrt(half**2 + np.abs(both) ** 2)
        found = np.where((half >= 0)[None], [leading - d, both], [both.conj(), leading - a])
        length = np.sqrt((np.abs(found) ** 2).sum(axis=0))
        found = np.moveaxis(found * (np.sqrt(leading) / np.maximum(length, 1e-30)), 0, 1)
        middle = int(np.argmax(np.abs(found[:, 0]).sum(axis=(1, 2))))
        found[middle] *= np.exp(-1j * np.angle(found[middle, 0]))
        for order in (range(middle + 1, len(found)), range(middle - 1, -1, -1)):
            for number in order:
                before = found[number - 1 if number > middle else number + 1]
                found[number] *= np.exp(1j * np.angle((found[number].conj() * before).sum(axis=0)))
        return found


@dataclass(frozen=True, eq=False)
class LearnedOptics:
    """Learned optics of one of the two views of an experience."""

    experience: Experience
    number: int
    light: str
    aperture_diameter: float
    focus_vergence: float
    isotropic = False

    def through_focus(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike
    ) -> NDArray[np.complex128]:
        """Return the transfer on a grid of frequencies, linearly interpolated between learned vergences."""
        down, right = np.asarray(frequency_y, float), np.asarray(frequency_x, float)
        levels, known = np.atleast_1d(np.asarray(vergences, float)), self.experience.vergences
        table = self.experience.transfers(down.ravel(), right.ravel())[:, self.number]
        place = np.clip(np.searchsorted(known, levels) - 1, 0, len(known) - 2)
        part = ((levels - known[place]) / (known[place + 1] - known[place]))[:, None, None]
        return np.asarray((1 - part) * table[place] + part * table[place + 1])

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> NDArray[np.float64]:
        """Raise an error, as blur is not assumed to be circularly symmetric."""
        raise NotImplementedError("learned blur is not circularly symmetric: use through_focus.")

    def optical_transfer(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergence: float
    ) -> NDArray[np.complex128]:
        """Return the transfer at one vergence."""
        return np.asarray(self.through_focus(frequency_y, frequency_x, [vergence])[0])


def learned_optics(experience: Experience, cones: Sequence[Cones]) -> list[LearnedOptics]:
    """Return the learned optics that replace each of the `cones`."""
    return [
        LearnedOptics(experience, number, one.light, one.aperture_diameter, one.focus_vergence)
        for number, one in enumerate(cones)
    ]
