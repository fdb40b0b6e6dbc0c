"""Thresholds of blur and defocus: detection, discrimination, and the dipper function."""

from __future__ import annotations

import math
from functools import partial
from math import inf

import numpy as np

from focalgradient.observers import Observer, blur_threshold
from focalgradient.observers.perception import SD_PER_RADIUS
from focalgradient.published.record import Finding, Prediction, Published
from focalgradient.stimuli import PAPERS

__all__ = ["OWN_WEBER", "RECORDS", "detection", "dip", "discrimination", "weber_fraction"]

PEDESTALS = np.linspace(0.0, 4.0, 161)
"""Pedestals of blur (arcmin) searched for the minimum of the dipper (our choice)."""

STEPS = 4
"""Number of successive just noticeable increments of defocus (our choice)."""

OWN_WEBER = "the Weber fraction of blur"
OWN_BLUR = "the intrinsic blur"
DIPPER = "Pedestals of 0 to 4 arcmin."


def weber_fraction(observer: Observer, pedestal: float) -> Prediction:
    """Return the Weber fraction: just noticeable increment of blur divided by the pedestal (arcmin)."""
    return Prediction(blur_threshold(pedestal, observer) / pedestal)


def dip(observer: Observer) -> Prediction:
    """Return the ratio of the smallest blur threshold to the threshold without a pedestal."""
    return Prediction(min(blur_threshold(float(one), observer) for one in PEDESTALS) / blur_threshold(0.0, observer))


def _arcmin(dioptres: float, observer: Observer) -> float:
    """Return the blur (SD, arcmin) of a defocus (D) for the observer's pupil."""
    return math.degrees(dioptres * observer.pupil / 2 * SD_PER_RADIUS) * 60


def detection(observer: Observer) -> Prediction:
    """Return the just noticeable defocus (D) of a sharp target, for the observer's pupil."""
    return discrimination(observer, 0.0)


def discrimination(observer: Observer, pedestal: float) -> Prediction:
    """Return the just noticeable increment of defocus (D) for a defocus pedestal (D), for the observer's pupil."""
    return Prediction(blur_threshold(_arcmin(pedestal, observer), observer) / _arcmin(1.0, observer))


def successive_discrimination(observer: Observer) -> Prediction:
    """Return the mean of the successive just noticeable increments of defocus (D) after the first."""
    reached, steps = detection(observer).value, []
    for _ in range(STEPS):
        steps.append(discrimination(observer, reached).value)
        reached += steps[-1]
    return Prediction(float(np.mean(steps)))


def threshold_ratio(observer: Observer, pedestal: float, other: float) -> Prediction:
    """Return the ratio of the just noticeable increments for two defocus pedestals (D)."""
    return Prediction(discrimination(observer, pedestal).value / discrimination(observer, other).value)


RECORDS = (
    Published(
        key="watson2011",
        citation="Watson and Ahumada 2011, J. Vision 11(5)",
        doi="",
        design="Review of thresholds for an increment of blur of an edge as a function of the reference blur.",
        conditions=tuple(PAPERS["watson2011"].conditions),
        settings={"task": "published", "experiment": "watson2011"},
        findings=(),
    ),
    Published(
        key="wang2005",
        citation="Wang and Ciuffreda 2005, foveal blur discrimination of the human eye",
        doi="",
        design="Defocus grew by the ascending method of limits, accommodation paralysed, until blur was first noticed "
        "and then until each further change was.",
        conditions=("detection", "discrimination"),
        needs="lenses before an eye whose accommodation is paralysed",
        findings=(
            Finding(
                quantity="detection threshold of defocus",
                units="D",
                printed="0.87 +- 0.18 (SEM)",
                low=0.51,
                high=1.23,
                source="abstract",
                ask=detection,
                remark="The pupil is the observer's.",
            ),
            Finding(
                quantity="mean of subsequent discrimination thresholds",
                units="D",
                printed="0.48 +- 0.006 (SEM)",
                low=0.468,
                high=0.492,
                source="abstract",
                ask=successive_discrimination,
                remark="Four steps; the pupil is the observer's.",
            ),
        ),
    ),
    Published(
        key="jacobs1989",
        citation="Jacobs, Smith and Chan 1989, Optom. Vis. Sci. 66, 545-553",
        doi="",
        design="People adjusted defocus, in the picture or by lenses, to the first perceptible blur of targets of "
        "several sizes, and to the least change of blur of a blurred target.",
        conditions=("blur threshold", "threshold of perceived change in blur"),
        settings={"task": "blurthreshold"},
        findings=(
            Finding(
                quantity="least noticeable defocus",
                units="D",
                printed="0.10 (targets near acuity) to about 0.18 (larger targets)",
                low=0.10,
                high=0.18,
                source="abstract",
                ask=detection,
                remark="The pupil is the observer's; it does not depend on the target's size.",
            ),
            Finding(
                quantity="least perceived change upon 1 D",
                units="D",
                printed="0.05 to 0.07",
                low=0.05,
                high=0.07,
                source="abstract",
                ask=partial(discrimination, pedestal=1.0),
                remark="The initial defocus of 1 D is our choice.",
            ),
            Finding(
                quantity="least perceived change upon 2 D over that upon 0.5 D",
                units="1",
                printed="independent of the initial defocus level",
                low=0.8,
                high=1.25,
                source="abstract",
                ask=partial(threshold_ratio, pedestal=2.0, other=0.5),
                remark="Both levels and the range, of which none is printed, are our choice.",
            ),
        ),
    ),
    Published(
        key="maiello2017",
        citation="Maiello, Walker, Bex and Vera-Diaz 2017, J. Vision 17(5), 3",
        doi="10.1167/17.5.3",
        design="39 people said which quadrant of an annulus of dead leaves at 0, 4, 8 or 12 degrees is more blurred, "
        "upon pedestals of blur.",
        conditions=tuple(PAPERS["maiello2017"].conditions),
        settings={"task": "published", "experiment": "maiello2017"},
        findings=(
            Finding(
                quantity="smallest threshold over that without a pedestal, fovea",
                units="1",
                printed="dipper shaped blur discrimination threshold function",
                low=-inf,
                high=1.0,
                source="abstract",
                taken=OWN_BLUR,
                ask=dip,
                remark=DIPPER,
            ),
            Finding(
                quantity="intrinsic blur at 12 degrees over that at 0",
                units="1",
                printed="intrinsic blur increased for retinal eccentricities beyond 4 degrees",
                low=1.0,
                high=inf,
                source="abstract",
                remark="This observer has one intrinsic blur for all eccentricities.",
            ),
        ),
    ),
)
