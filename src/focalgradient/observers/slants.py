"""Surface slant from gradients of blur, and with two eyes of disparity.

At the visual angle t along the tilt, a plane through the fixated point at D metres lies tan(slant) tan(t) / D dioptres
beyond it: linear in the picture. Blur gives the magnitude of slant only, as it is symmetric about fixation; disparity
also gives its direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri
from scipy.stats import theilslopes

from focalgradient.arrays import FloatArray
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.observers.disparities import disparity_at_places
from focalgradient.observers.distances import INDEPENDENT
from focalgradient.observers.front_end import SPACING, blur_of, check_fixation, fixated_blur, seen_by
from focalgradient.observers.observer import Observer
from focalgradient.observers.perception import defocus

__all__ = ["PerceivedSlant", "Slant"]


SLANTS = np.radians(np.arange(-88.0, 88.1, 1.0))
"""Candidate slants, in radians; negative if the far side is opposite to the tilt."""

SCALES = np.linspace(-2, 2, 9)
"""Nodes of the integral over the common scale error of all blurs, in standard deviations."""

GRADIENT = 0.1
"""Relative error of a disparity gradient (our choice)."""


@dataclass(frozen=True, slots=True)
class PerceivedSlant:
    """Perceived slant.

    Parameters
    ----------
    median_deg, sd_deg
        Median and SD of the magnitude of slant, 0 to 90 degrees.
    along
        Probability that the surface recedes along the tilt of the question rather than opposite to it.

    Examples
    --------
    >>> round(PerceivedSlant(30.0, 1.0, 1.0).simulate(np.random.default_rng(1)), 1)
    30.3
    """

    median_deg: float
    sd_deg: float
    along: float

    def simulate(self, random: np.random.Generator) -> float:
        """Draw one answer in degrees; negative if the surface seems to recede opposite to the tilt."""
        amount = min(max(self.median_deg + self.sd_deg * random.standard_normal(), 0.0), 90.0)
        return amount if random.random() < self.along else -amount


@dataclass(frozen=True, slots=True, eq=False)
class Slant:
    """Question for the slant of a plane whose tilt is known except for its direction.

    Parameters
    ----------
    tilt_deg
        Direction in which the plane may recede: 0 to the right, 90 upwards.
    distance_m
        Distance of the fixated point; None: that of the display.
    fixation
        Fixated point in pixels from the upper left corner, right and down; None: the centre.
    right
        Picture of the right eye; the picture that is looked at is then that of the left eye.

    Examples
    --------
    Planes slanted by 70 and by 0 degrees, from blur.

    >>> from focalgradient.observers import OBSERVERS
    >>> from focalgradient.stimuli import slanted_plane
    >>> display = Display()
    >>> size = {"width_deg": 10, "height_deg": 10, "pixels_per_degree": display.pixels_per_degree}
    >>> planes = [slanted_plane(slant_deg=slant, distance_m=0.3, **size).picture for slant in (0, 70)]
    >>> flat, slanted = (OBSERVERS["default"].look(one, display, Slant(distance_m=0.3)) for one in planes)
    >>> bool(flat.median_deg < 20 < slanted.median_deg), round(slanted.along, 1)
    (True, 0.5)
    """

    tilt_deg: float = 90.0
    distance_m: float | None = None
    fixation: tuple[float, float] | None = None
    right: FloatArray | None = None

    def answer(self, light: FloatArray, display: Display, observer: Observer) -> PerceivedSlant:
        """Answer by the product of the likelihoods of each slant from flatness of the display, blur and disparity.

        Raises
        ------
        InputError
            If the distance is not positive, the fixation lies outside, or the pictures of the eyes differ in shape.
        """
        metres = display.distance if self.distance_m is None else self.distance_m
        if not (metres > 0 and math.isfinite(metres)):
            raise InputError(f"distance_m is {metres!r}, but must be a positive finite number of metres.")
        (seen,), slope = seen_by([light], display, observer.pupil)
        fixation = self.fixation or (seen.shape[1] / 2, seen.shape[0] / 2)
        check_fixation(fixation, seen.shape)
        estimated = blur_of(seen, slope, display, observer.pupil)
        down, right = SPACING * (np.indices(estimated.log_sd.shape) + 0.5)
        tilt = math.radians(self.tilt_deg)
        pixels = (right - fixation[0]) * math.cos(tilt) - (down - fixation[1]) * math.sin(tilt)
        away = np.tan(np.radians(pixels / display.pixels_per_degree))  # tan(t) along the tilt
        gradient = np.tan(SLANTS) / metres  # dioptres beyond the fixated point, per unit of `away`
        cost = (np.abs(gradient) * float(away.std()) / observer.flatness) ** 2
        without = np.exp(-cost / 2)

        known = np.isfinite(estimated.log_sd)
        minute = display.arcmin(1.0)
        focused = math.hypot(minute * fixated_blur(estimated, fixation, display.pixels_per_degree), observer.intrinsic)
        blur = np.log(np.hypot(minute * np.exp(estimated.log_blur[known]), observer.intrinsic))
        arcmin = np.abs(gradient)[:, None] * np.abs(away[known]) / float(defocus(np.array(1.0), observer))
        each = np.hypot(estimated.log_sd[known], observer.weber)
        weight = each**-2.0 / (each**-2.0).sum()
        likelihood = np.zeros(SLANTS.size)
        for error in SCALES:
            expected = np.log(np.hypot(arcmin * math.exp(observer.weber * error), focused))
            misfit = observer.weber**2 + (blur - expected) ** 2 @ weight
            likelihood += math.exp(-(error**2) / 2) * misfit ** (-min(INDEPENDENT, each.size) / 2)
        # by the prior, blurred places are farther: the implied direction depends on the position of fixation
        beyond = float(np.abs(away[away > 0]).sum() / max(np.abs(away).sum(), 1e-12))
        sign = np.where(SLANTS > 0, 1, -1) * observer.prior * (2 * beyond - 1)
        by_blur = without * likelihood * (1 + sign)
        posterior = observer.defocus * by_blur / by_blur.sum() + (1 - observer.defocus) * without / without.sum()
        if self.right is not None:
            posterior = posterior * self._by_disparity(light, display, observer, away, gradient)
        posterior /= posterior.sum()

        amount = np.degrees(np.abs(SLANTS))
        order = np.argsort(amount, kind="stable")
        median = float(np.interp(0.5, np.cumsum(posterior[order]), amount[order]))
        along = float(posterior[SLANTS > 0].sum() + posterior[SLANTS == 0].sum() / 2)
        return PerceivedSlant(median, math.sqrt(float(posterior @ (amount - median) ** 2)), along)

    def _by_disparity(
        self, light: FloatArray, display: Display, observer: Observer, away: FloatArray, gradient: FloatArray
    ) -> FloatArray:
        """Return the likelihood of each slant from the disparity gradient, the interocular distance times dioptres."""
        assert self.right is not None
        disparity = disparity_at_places(np.asarray(light, float), self.right, display)
        known = np.isfinite(disparity)
        place = away[known]
        if known.sum() < 3 or float(place.std()) < 1e-9:
            return np.ones(gradient.size)
        beyond = -np.radians(disparity[known] / 60) / observer.interocular
        slope = float(theilslopes(beyond, place).slope)
        places = math.sqrt(min(INDEPENDENT, place.size))
        error = math.radians(observer.stereo / 60) / float(ndtri(0.75)) / observer.interocular
        sd = math.hypot(error / float(place.std()) / places, GRADIENT * slope)
        return np.asarray(np.exp(-((np.clip((gradient - slope) / sd, -30, 30)) ** 2) / 2))
