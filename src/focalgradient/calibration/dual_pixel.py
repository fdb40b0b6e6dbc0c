"""Calibration of the asymmetry of a dual-pixel sensor from one photograph of a flat sheet at a known distance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from focalgradient.calibration.camera import Field
from focalgradient.calibration.robust import fit_terms
from focalgradient.depth.dual_pixel.estimate import half_asymmetry
from focalgradient.depth.settings import halves_of
from focalgradient.errors import InputError, check_number
from focalgradient.optics import DualPixel
from focalgradient.view import View

__all__ = ["DualPixelFit", "calibrate_dual_pixel"]

CANDIDATES = np.arange(0.02, 0.9, 0.02)
"""Candidate asymmetries."""

WINDOW = 16.0
"""Window in pixels, large as the asymmetry of a sheet varies slowly."""

LEAST_RADIUS = 1.5
"""Minimum blur radius of the sheet in pixels: with less blur, the asymmetry is hardly measurable."""

LEAST_SHARE = 0.25
"""Minimum fraction of the sheet with a measurable asymmetry."""

LEFT_ERROR = 0.05
"""Relative standard deviation of asymmetry times aperture at other distances than that of the sheet: a prior, as real
blur is not exactly a disc.
"""


@dataclass(frozen=True, slots=True)
class DualPixelFit:
    """Result of the calibration of a dual-pixel sensor.

    Parameters
    ----------
    left, right
        Optics of the two halves, with the fitted asymmetry and field.
    scatter
        Robust relative scatter of the sheet's asymmetry around the field.
    radius
        Signed blur radius of the sheet in pixels: positive nearer than focus.
    """

    left: DualPixel
    right: DualPixel
    scatter: float
    radius: float


def calibrate_dual_pixel(views: Sequence[View], distance: float) -> DualPixelFit:
    """Calibrate the dual-pixel halves from the left and right view of a flat sheet that faces the camera.

    Parameters
    ----------
    views
        Left and right view, with `DualPixel` optics whose lens is correct; the asymmetry is a starting value.
    distance
        Distance from the entrance pupil to the sheet, in metres. Errors of the lens's focus affect the asymmetry:
        measure at about the distance of later scenes.

    Raises
    ------
    InputError
        If the views are not a pair of halves, or the sheet is in focus or lacks texture.

    Examples
    --------
    >>> from focalgradient.optics import Lens
    >>> import numpy as np
    >>> left, right = DualPixel.pair(Lens(0.05, 4, 1.0), 0.25)
    >>> rng = np.random.default_rng(0)
    >>> down, across = np.fft.fftfreq(160)[:, None], np.fft.rfftfreq(160)
    >>> texture = np.fft.rfft2(rng.standard_normal((160, 160))) / np.maximum(np.hypot(down, across), 1 / 160)
    >>> pixel = 1e-3
    >>> blurs = [one.optical_transfer(down / pixel, across / pixel, 1.6) for one in (left, right)]
    >>> blurred = [np.fft.irfft2(texture * blur) for blur in blurs]
    >>> views = [View(60 + image, one, pixel) for image, one in zip(blurred, DualPixel.pair(Lens(0.05, 4, 1.0)))]
    >>> round(calibrate_dual_pixel(views, 1 / 1.6).left.asymmetry, 2)
    0.25
    """
    check_number("distance", distance, "metres", positive=True)
    pair = halves_of(views)
    if pair is None:
        raise InputError(
            "dual pixels are calibrated from a left and a right view: give DualPixel.pair(lens) as optics."
        )
    left, right = (views[place] for place in pair)
    optics = left.optics
    assert isinstance(optics, DualPixel)
    radius = (1 / distance - optics.focus_vergence) * optics.aperture_diameter / 2 / left.pixel_angle
    if not abs(radius) >= LEAST_RADIUS:
        raise InputError(
            f"the sheet's blur has a radius of {abs(radius):.2g} pixels, but {LEAST_RADIUS:g} are needed to measure "
            "the halves' asymmetry: photograph it farther from the plane of focus."
        )
    found, sd, clear = half_asymmetry(left.image, right.image, radius, CANDIDATES, WINDOW)
    if clear.mean() < LEAST_SHARE:
        raise InputError(
            f"only {clear.mean():.0%} of the sheet shows the halves' asymmetry: check that left and right are not "
            "exchanged, the distances of the sheet and of the focus, and that the sheet has texture all over."
        )
    curved = Field.terms(*Field.coordinates(found.shape))
    terms = np.concatenate([np.ones((1, *found.shape)), curved])[:, clear].T
    fitted, scale = fit_terms(terms, found[clear], 1 / np.hypot(sd[clear], 0.02), rounds=8)
    field = tuple(float(value) for value in fitted[1:] / fitted[0])
    lens = replace(optics.lens, aperture_tolerance=max(optics.lens.aperture_tolerance, LEFT_ERROR))
    pair_optics = DualPixel.pair(lens, float(fitted[0]), field)
    return DualPixelFit(*pair_optics, scale / float(fitted[0]), float(radius))
