"""An estimator of depth that has learned its own eye's blur from its own views, and is given no optics.

It is trained on walls of natural texture at known distances, many at each, and keeps how its two views are
correlated: their correlation functions, over the power that natural textures have. What equalising needs follows from
them: how two views of one place differ, at each frequency and vergence, in contrast and in phase. What is assumed: that
textures are natural (their power falls as 1 / frequency squared), that the noise is known, and that so are the walls'
distances while it learns, as touch or another cue would give them. The walls that it learns from are wallpapers of
64 x 64 pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.eye import Cones

SIDE = 64
"""Pixels of a wall: wider than blur of 16 pixels' radius and its mirror image."""

STEP = 0.1
"""Dioptres from one learned distance to the next."""

LOOKS = 64
"""Walls at each distance."""

SKIRT = 6.0
"""Pixels beyond twice the blur's radius, to which correlations are kept: farther away there is noise alone."""

CONTRAST = 0.2


class Experience:
    """Correlations of two views of walls: vergences T, lags T x 3 x SIDE x SIDE (of the first, both, the second)."""

    def __init__(self, vergences: NDArray[np.float64], lags: NDArray[np.float64], pixel_angle: float) -> None:
        self.vergences, self.lags, self.pixel_angle = vergences, lags, pixel_angle

    @classmethod
    def of(
        cls, cones: Sequence[Cones], pixel_angle: float, nearest: float, *, noise: float, correlation: float, seed: int
    ) -> Experience:
        """Look at walls from infinity to `nearest` (D) through two `cones`."""
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
            # The second over the first: what the first has, turned by the conjugate.
            pairs = ((0, 0), (1, 0), (1, 1))
            power = np.stack([(seen[a] * seen[b].conj()).mean(axis=0) for a, b in pairs])
            power[[0, 2]] -= (noise * SIDE) ** 2
            over = power / np.maximum((amplitude * SIDE) ** 2, 1e-30) * (amplitude > 0)
            # Noise makes fine detail unsure: it counts by what there is of it.
            sure = np.maximum((amplitude * SIDE) ** 2 * np.abs(over[0::2]).max(axis=0), 0) / (noise * SIDE) ** 2
            over *= sure / (sure + 1 / np.sqrt(LOOKS))
            radii = [abs(one.focus_vergence - vergence) * one.aperture_diameter / 2 / pixel_angle for one in cones]
            lags[number] = np.fft.irfft2(over, (SIDE, SIDE)) * (lag < 2 * max(radii) + SKIRT)
        return cls(vergences, lags, pixel_angle)

    def transfers(self, down: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Transfer of either view at each vergence learned, at a column and a row of frequencies (cycles per radian).

        T x 2 x rows x columns, up to a factor that both views have in common: it changes slowly from one vergence to
        the next, and is positive for the first view where blur is least.
        """
        place = (np.arange(SIDE) + SIDE // 2) % SIDE - SIDE // 2
        turn_down = np.exp(-2j * np.pi * self.pixel_angle * down[:, None] * place)
        turn_right = np.exp(-2j * np.pi * self.pixel_angle * place[:, None] * right)
        first, both, second = np.moveaxis(turn_down @ self.lags @ turn_right, 1, 0)
        a, d = np.maximum(first.real, 0), np.maximum(second.real, 0)
        # The leading eigenvector of [[a, both*], [both, d]] by its length.
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
    """What a view is taken to have been formed by: one of the two of an experience."""

    experience: Experience
    number: int
    light: str
    aperture_diameter: float
    focus_vergence: float
    isotropic = False

    def through_focus(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike
    ) -> NDArray[np.complex128]:
        """Transfer at a column and a row of frequencies, between learned vergences by linear interpolation."""
        down, right = np.asarray(frequency_y, float), np.asarray(frequency_x, float)
        levels, known = np.atleast_1d(np.asarray(vergences, float)), self.experience.vergences
        table = self.experience.transfers(down.ravel(), right.ravel())[:, self.number]
        place = np.clip(np.searchsorted(known, levels) - 1, 0, len(known) - 2)
        part = ((levels - known[place]) / (known[place + 1] - known[place]))[:, None, None]
        return np.asarray((1 - part) * table[place] + part * table[place + 1])

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> NDArray[np.float64]:
        """Refuse: blur is not taken to be round."""
        raise NotImplementedError("this blur is not known to be round")

    def optical_transfer(
        self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergence: float
    ) -> NDArray[np.complex128]:
        """The same at one vergence."""
        return np.asarray(self.through_focus(frequency_y, frequency_x, [vergence])[0])


def learned_optics(experience: Experience, cones: Sequence[Cones]) -> list[LearnedOptics]:
    """What was learned, in place of either of the `cones`."""
    return [
        LearnedOptics(experience, number, one.light, one.aperture_diameter, one.focus_vergence)
        for number, one in enumerate(cones)
    ]
