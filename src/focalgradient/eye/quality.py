"""Image quality of an eye through focus: modulation transfer and visual Strehl ratio.

The visual Strehl ratio is the real part of the optical transfer function weighted by contrast sensitivity, relative to
that of a clear pupil in focus in one light (VSOTF; Thibos, Hong, Bradley & Applegate 2004, "Accuracy and precision of
objective refraction from wavefront aberrations", J. Vis. 4, 329).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, check_finite
from focalgradient.eye.chromatic import REFERENCE_NM
from focalgradient.eye.diffraction import optical_transfer
from focalgradient.eye.ranges import check_kind
from focalgradient.eye.retina import Cones

__all__ = ["ThroughFocus", "contrast_sensitivity", "image_quality"]

FloatArray = NDArray[np.float64]

HIGHEST_CPD = 60.0
"""Highest frequency in cycles per degree that people see."""

RADII, ANGLES = 40, 12
"""Number of frequencies along a radius and of directions over half a circle (of isotropic blur one suffices) in the sum
of the visual Strehl ratio: twice as many change it by less than 1e-6, and the modulation by 1e-3 (an eye with coma and
astigmatism)."""


def contrast_sensitivity(frequency_cpd: ArrayLike) -> FloatArray:
    """Return contrast sensitivity at each frequency (cycles per degree): 75 f^0.8 exp(-0.2 f).

    The double exponential of Movshon & Kiorpes (1988) with the numbers that are usual for people by day (these from
    memory). It only weights frequencies, so that its height does not matter.

    >>> contrast_sensitivity([1, 4, 20]).round(1).tolist()
    [61.4, 102.2, 15.1]
    """
    f = check_finite("frequency_cpd", frequency_cpd, "cycles per degree")
    return np.asarray(75 * np.abs(f) ** 0.8 * np.exp(-0.2 * np.abs(f)))


@dataclass(frozen=True, slots=True, eq=False)
class ThroughFocus:
    """Image quality of points at each of L `vergences` (D).

    ``mtf`` is the mean over all directions of the modulation at each of F ``frequency_cpd``, L x F; ``visual_strehl``
    the visual Strehl ratio.
    """

    vergences: FloatArray
    frequency_cpd: FloatArray
    mtf: FloatArray
    visual_strehl: FloatArray

    @property
    def best(self) -> float:
        """Vergence in dioptres at which the visual Strehl ratio is greatest."""
        return float(self.vergences[int(np.argmax(self.visual_strehl))])

    def depth_of_focus(self, share: float = 0.8) -> float:
        """Return the total range (D) in which the visual Strehl ratio is at least this `share` of its maximum.

        It counts `vergences` only: where it is cut off at an end of them (`is_cut_off`), it is a lower bound.
        """
        if not 0 < share < 1:
            raise InputError(f"share is {share!r}, but must be a share between 0 and 1.")
        fine = np.linspace(self.vergences[0], self.vergences[-1], 2001)
        kept = np.interp(fine, self.vergences, self.visual_strehl) >= share * self.visual_strehl.max()
        return float(np.mean(kept) * np.ptp(self.vergences))

    def is_cut_off(self, share: float = 0.8) -> bool:
        """Return whether the range of `depth_of_focus` reaches an end of `vergences`, and may continue beyond it."""
        ends = max(self.visual_strehl[0], self.visual_strehl[-1])
        return bool(ends >= share * self.visual_strehl.max())


def image_quality(cones: Cones, vergences: ArrayLike, frequency_cpd: ArrayLike = (4.0, 8.0, 16.0)) -> ThroughFocus:
    """Compute the image quality of points at each of `vergences` (D), as seen by `cones`.

    Parameters
    ----------
    cones
        An eye in the light of a band; "luminance" for what people see of white.
    vergences
        L values, in order.
    frequency_cpd
        F frequencies in cycles per degree at which the modulation is given.

    Raises
    ------
    InputError
        If vergences are not two or more numbers in order.

    Examples
    --------
    >>> from focalgradient.eye.model_eye import Eye
    >>> cones = Cones(Eye(0.004, 1.0), "luminance", (580.0,))
    >>> found = image_quality(cones, np.arange(0, 2.01, 0.25))
    >>> found.best, found.visual_strehl[4].round(2).item(), found.mtf[4].round(2).tolist()
    (1.0, 1.0, [0.96, 0.92, 0.83])
    """
    check_kind("cones", cones, Cones, 'give Cones.of(eye, "luminance")')
    levels = check_finite("vergences", vergences, "dioptres")
    if levels.ndim != 1 or levels.size < 2 or np.any(np.diff(levels) <= 0):
        raise InputError("vergences must be two or more numbers, each above the one before: sort them.")
    shown = np.atleast_1d(check_finite("frequency_cpd", frequency_cpd, "cycles per degree"))
    if np.any(shown < 0):
        raise InputError(f"frequency_cpd goes down to {shown.min():g}, but must be 0 or more: give cycles per degree.")
    nodes, weights = np.polynomial.legendre.leggauss(RADII)
    radius, width = HIGHEST_CPD / 2 * (nodes + 1), HIGHEST_CPD / 2 * weights
    directions = 1 if cones.isotropic else ANGLES
    turn = np.pi * (np.arange(directions) + 0.5) / directions
    every = np.degrees(np.concatenate([shown, radius]))
    seen = cones.through_focus(every * np.sin(turn)[:, None], every * np.cos(turn)[:, None], levels)
    weight = contrast_sensitivity(radius) * radius * width
    clear = optical_transfer(radius, pupil_diameter=cones.aperture_diameter, wavelength_nm=REFERENCE_NM, defocus=0.0)
    real = seen[:, :, shown.size :].real.mean(axis=1)
    strehl = real @ weight / float(np.asarray(clear).real @ weight)
    return ThroughFocus(levels, shown, np.abs(seen[:, :, : shown.size]).mean(axis=1), np.asarray(strehl))
