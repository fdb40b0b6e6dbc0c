"""The most probable camera, given what its target showed and the priors."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from focalgradient.calibration.camera import Calibration, Prediction, Reading, disc_radius
from focalgradient.errors import InputError, check_number
from focalgradient.optics import Lens

__all__ = ["EDGE_K", "Priors", "calibrate", "cross_validate", "improbability"]

FloatArray = NDArray[np.float64]

EDGE_K = 0.546
"""sigma / radius of the Gaussian that fits the edge of a step blurred by a uniform disc best (3 pixels and more)."""

UNDECIDED = 6.0
"""Difference of chi-square between one side of focus and the other below which the target leaves the side open."""


ROUGH = 1e-4
"""Relative tolerance of fits that are only compared."""

SAME = 0.1
"""Difference of vergence, as a share, up to which a target may lie on either side of a marked focus."""


@dataclass(frozen=True, slots=True)
class Priors:
    """What is known of a camera before its target is measured: means, and standard deviations of normal priors.

    Parameters
    ----------
    k, k_sd
        sigma / disc radius along edges, and its relative standard deviation.
    own_sd
        Standard deviation of the variance of the camera's own blur about 0, in square pixels.
    offset, offset_sd
        From the user's reference plane to the entrance pupil of the lens, in metres.
    focus_offset
        The same for the plane that marked focus distances count from; None: the user's reference plane.
    f_number_sd
        Of an effective f-number about the marked one, relative.
    focus_sd
        Of the true focus vergence about a marked one, relative.
    telecentric
        Whether the lens is telecentric on the image side.
    distance_sd
        Of each distance that was measured, in metres.
    model_error, model_weight
        Relative error of a real lens's widths about the law: as expected, and how many residuals that is worth.
    """

    k: float = EDGE_K
    k_sd: float = 0.05
    own_sd: float = 1.0
    offset: float = 0.0
    offset_sd: float = 0.1
    f_number_sd: float = 0.07
    focus_sd: float = 0.3
    distance_sd: float = 0.005
    model_error: float = 0.015
    model_weight: float = 4.0
    focus_offset: float | None = None
    telecentric: bool = False


def calibrate(
    readings: Sequence[Reading], focal_length: float, pixel_pitch: float, priors: Priors | None = None
) -> Calibration:
    """The most probable camera, given `readings` of its target, and the priors.

    Readings of one distance and setting count as one: their median.

    Parameters
    ----------
    readings
        One for each view of the target.
    focal_length, pixel_pitch
        In metres.
    priors
        By default those of `Priors`.

    Raises
    ------
    InputError
        If there is no reading, a length is out of range, or the readings fit no lens, or fit both sides of focus.

    Examples
    --------
    >>> from focalgradient import Lens
    >>> lens = Lens(0.05, 4.2, 1.0)  # marked f/4
    >>> width = lambda d: 0.5 * float(lens.blur_radius(d)) * lens.sensor_distance
    >>> seen = [Reading(d, 4.0, None, width(d), 1e-8) for d in (1.4, 2.0, 3.0, 5.0)]
    >>> camera = calibrate(seen, 0.05, 5e-6, Priors(k=0.5, offset_sd=0.001, k_sd=0.01, distance_sd=0.001))
    >>> round(camera.f_numbers[4.0], 1), round(1 / camera.focus[None], 2)
    (4.2, 1.0)
    """
    priors = priors or Priors()
    if not readings:
        raise InputError("there is no view of a target, but calibration needs one or more: add views.")
    check_number("pixel_pitch", pixel_pitch, "metres", positive=True)
    for reading in readings:
        _check(reading, focal_length)
    camera = _Fit.of(readings, focal_length, pixel_pitch, priors).best(pixel_pitch)
    return replace(camera, edge_scatter=float(np.sqrt(np.mean([reading.scatter**2 for reading in readings]))))


def _check(reading: Reading, focal_length: float) -> None:
    """Refuse what no lens of this focal length can have shown."""
    mark = reading.focus_distance
    Lens(focal_length, reading.f_number, math.inf if mark is None else mark)  # refuses what is none
    check_number("f_number", reading.f_number, "f-stops", positive=True)
    check_number("distance", reading.distance, "metres", positive=True)
    check_number("width", reading.width, "metres", least=0)
    check_number("width_sd", reading.width_sd, "metres", positive=True)
    check_number("scatter", reading.scatter, "metres", least=0)


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """The least-squares problem: parameters as in `Calibration.parameters`, then the error of each distance."""

    focal_length: float
    priors: Priors
    stops: list[float]
    marks: list[float | None]
    distances: FloatArray
    place: NDArray[np.intp]  # of each cell: which distance, f-number, focus
    width: FloatArray  # um
    width_sd: FloatArray  # um
    own_sd: float  # um^2
    tolerance: float = 1e-8  # relative, at which the fit stops

    @classmethod
    def of(cls, readings: Sequence[Reading], focal_length: float, pixel_pitch: float, priors: Priors) -> _Fit:
        """Gather the readings into cells, one for each distance and setting."""
        stops = sorted({r.f_number for r in readings})
        marks = sorted({r.focus_distance for r in readings}, key=lambda mark: math.inf if mark is None else mark)
        distances = sorted({r.distance for r in readings})
        cells: dict[tuple[int, int, int], list[Reading]] = {}
        for r in readings:
            key = (distances.index(r.distance), stops.index(r.f_number), marks.index(r.focus_distance))
            cells.setdefault(key, []).append(r)
        width, width_sd = [], []
        for members in cells.values():
            widths = np.array([r.width for r in members])
            middle = np.median(widths)
            # What exposures differ by, or what is known of each; the median is a little less precise than the mean.
            each = max(
                float(np.median([r.width_sd for r in members])), 1.48 * float(np.median(np.abs(widths - middle)))
            )
            width.append(1e6 * middle)
            width_sd.append(1e6 * each * (1.0 if len(members) < 3 else 1.25) / math.sqrt(len(members)))
        place = np.array(list(cells), np.intp).T
        own_sd = priors.own_sd * (1e6 * pixel_pitch) ** 2
        return cls(
            *(focal_length, priors, stops, marks, np.array(distances), place, np.array(width), np.array(width_sd)),
            own_sd,
        )

    def residuals(self, theta: FloatArray, model_error: float) -> FloatArray:
        """How far the law lies from the cells, and the parameters from the priors, in standard deviations."""
        priors, first = self.priors, 3 + len(self.stops)
        distance, stop, focus = self.place
        vergence_focus, slip = theta[first : first + len(self.marks)], theta[first + len(self.marks) :]
        optical = np.maximum(self.distances + theta[2] + slip, 1e-3)
        radius = disc_radius(
            self.focal_length, np.exp(theta[3 + stop]), vergence_focus[focus], 1 / optical[distance], priors.telecentric
        )
        square = (1e6 * np.exp(theta[0]) * radius) ** 2 + theta[1]
        # Of edges in focus the width may be 0: its square is then known to that of its sd.
        error = 2 * np.maximum(self.width, self.width_sd) * np.hypot(self.width_sd, model_error * self.width)
        marked = [
            (v * (mark + (theta[2] if priors.focus_offset is None else priors.focus_offset)) - 1) / priors.focus_sd
            for v, mark in zip(vergence_focus, self.marks, strict=True)
            if mark is not None and math.isfinite(mark)
        ]
        return np.concatenate(
            [
                (square - self.width**2) / error,
                [
                    (theta[0] - math.log(priors.k)) / priors.k_sd,
                    theta[1] / self.own_sd,
                    (theta[2] - priors.offset) / priors.offset_sd,
                ],
                (theta[3:first] - np.log(self.stops)) / priors.f_number_sd,
                marked,
                slip / priors.distance_sd,
            ]
        )

    def best(self, pixel_pitch: float) -> Calibration:
        """The most probable camera; refused where one on the other side of focus explains the readings as well."""
        priors, first = self.priors, 3 + len(self.stops)
        found = sorted(self.minima(priors.model_error), key=lambda minimum: minimum[0])
        marked_sides = self.marked_sides()
        if marked_sides is not None:  # the mark decides what the views leave open
            agreeing = [one for one in found if (self.sides(one[1]) == marked_sides).all()]
            if agreeing and agreeing[0][0] < found[0][0] + UNDECIDED:
                found = agreeing
        chi_square, theta = found[0]
        for other_chi_square, other in found[1:]:
            if other_chi_square - chi_square < UNDECIDED and (self.sides(other) != self.sides(theta)).any():
                raise InputError(
                    "the views fit a target beyond the plane of focus as well as one nearer than it: add a view at "
                    "another distance, or give focus_distance_m as marked on the lens."
                )
        theta, error, covariance = self.refined(theta)
        marked = [
            math.inf if mark is None or math.isinf(mark) else priors.focus_sd * v
            for mark, v in zip(self.marks, theta[first:], strict=False)
        ]
        prior_sd = np.array(
            [priors.k_sd, self.own_sd, priors.offset_sd, *[priors.f_number_sd] * len(self.stops), *marked]
        )
        covariance = covariance[: len(prior_sd), : len(prior_sd)]
        return Calibration(
            focal_length=self.focal_length,
            pixel_pitch=pixel_pitch,
            k=math.exp(theta[0]),
            own=float(theta[1]) * 1e-12,
            offset=float(theta[2]),
            f_numbers={mark: math.exp(log) for mark, log in zip(self.stops, theta[3:], strict=False)},
            focus={mark: float(v) for mark, v in zip(self.marks, theta[first:], strict=False)},
            model_error=error,
            covariance=covariance,
            informed=np.clip(1 - np.diag(covariance) / prior_sd**2, 0, 1),
            telecentric=priors.telecentric,
        )

    def refined(self, theta: FloatArray) -> tuple[FloatArray, float, FloatArray]:
        """Parameters from the minimum at `theta`, the relative model error of the widths, and the covariance."""
        priors, error, known = self.priors, self.priors.model_error, self.width > self.width_sd
        for _ in range(8):
            _, theta, jacobian = self.converge(theta, error)
            covariance: FloatArray = np.linalg.inv(jacobian.T @ jacobian).astype(float)
            fitted = jacobian[: len(self.width)]
            residual_df = len(self.width) - float(np.trace(fitted @ covariance @ fitted.T))
            # A width that is not known from 0 says nothing of relative errors.
            relative = np.divide(self.width_sd, self.width, out=np.zeros(len(known)), where=known)
            left = self.residuals(theta, error)[: len(self.width)] * np.hypot(relative, error) * known
            error = math.sqrt(
                (priors.model_weight * priors.model_error**2 + float((left**2).sum()))
                / (priors.model_weight + max(residual_df, 0.0))
            )
        return theta, error, covariance

    def improbability(self) -> float:
        """Return minus twice the log posterior density of the most probable camera, over that of a perfect fit.

        The density is that of the widths relative to those measured, so that readings of other units compare. The
        model error has its prior (scaled inverse chi-square) and counts.
        """
        found = min(self.minima(self.priors.model_error), key=lambda minimum: minimum[0])
        theta, error, _ = self.refined(found[1])
        expected, weight = self.priors.model_error, self.priors.model_weight
        known = self.width_sd / np.maximum(self.width, self.width_sd)
        more = 2 * np.log(np.hypot(known, error) / np.hypot(known, expected)).sum()
        more += weight * (2 * math.log(error / expected) + (expected / error) ** 2 - 1)
        return float((self.residuals(theta, error) ** 2).sum()) + float(more)

    def sides(self, theta: FloatArray) -> NDArray[np.bool_]:
        """Whether each cell lies beyond focus."""
        distance, _, focus = self.place
        return theta[3 + len(self.stops) + focus] > 1 / (self.distances[distance] + theta[2])

    def marked_sides(self) -> NDArray[np.bool_] | None:
        """Whether each cell lies beyond focus by the marks; None where one is missing, or too near a target to say."""
        if any(mark is None for mark in self.marks):
            return None
        distance, _, focus = self.place
        offset = self.priors.offset if self.priors.focus_offset is None else self.priors.focus_offset
        marked = np.array([1 / (mark + offset) for mark in self.marks if mark is not None])[focus]
        target = 1 / (self.distances[distance] + self.priors.offset)
        return None if (np.abs(target - marked) < SAME * marked).any() else marked > target

    def minima(self, model_error: float) -> list[tuple[float, FloatArray]]:
        """Chi-square and parameters at the minima that starts on all sides of the target lead to."""
        count = len(self.marks)
        groups: list[list[float]] = []
        for group in range(count):
            vergence = 1 / (self.distances[self.place[0, self.place[2] == group]] + self.priors.offset)
            low, high = float(vergence.min()), float(vergence.max())
            # Focus beyond all of the target's distances, between them, nearer than all.
            starts = [0.5 * low, *(low + (high - low) * np.array([0.25, 0.5, 0.75])), 1.3 * high, 2 * high]
            if count > 1:  # each focus by itself first
                kept = self.place[2] == group
                place = self.place[:, kept] * np.array([[1], [1], [0]])
                alone = replace(
                    self, marks=[self.marks[group]], place=place, width=self.width[kept], width_sd=self.width_sd[kept]
                )
                converged = alone.minima(model_error)
                least = min(chi_square for chi_square, _ in converged)
                ends = sorted({round(t[3 + len(self.stops)], 2) for c, t in converged if c < least + 30})
                starts = ends
            groups.append(starts)
        found = []
        for focus in product(*groups):
            start = np.array(
                [math.log(self.priors.k), 0.0, self.priors.offset, *np.log(self.stops), *focus]
                + [0.0] * len(self.distances)
            )
            chi_square, theta, _ = self.converge(start, model_error)
            found.append((chi_square, theta))
        return found

    def converge(self, start: FloatArray, model_error: float) -> tuple[float, FloatArray, FloatArray]:
        """Chi-square, parameters and Jacobian at the minimum that `start` leads to."""
        from scipy.optimize import least_squares

        focus = slice(3 + len(self.stops), 3 + len(self.stops) + len(self.marks))
        lower, upper = np.full(start.size, -np.inf), np.full(start.size, np.inf)
        lower[focus], upper[focus] = 1e-4, 0.5 / self.focal_length
        start = np.clip(start, lower, upper)
        fit = least_squares(
            self.residuals,
            start,
            bounds=(lower, upper),
            args=(model_error,),
            x_scale="jac",
            ftol=self.tolerance,
            xtol=self.tolerance,
        )
        return 2 * float(fit.cost), fit.x, np.asarray(fit.jac)


def improbability(readings: Sequence[Reading], focal_length: float, pixel_pitch: float, priors: Priors) -> float:
    """Return minus twice the log posterior density of the most probable camera, over that of a perfect fit.

    For readings of the same photographs: the lower, the likelier is what was stated of them.
    """
    for reading in readings:
        _check(reading, focal_length)
    fit = _Fit.of(readings, focal_length, pixel_pitch, priors)
    return replace(fit, tolerance=ROUGH).improbability()


def cross_validate(
    readings: Sequence[Reading],
    focal_length: float,
    pixel_pitch: float,
    priors: Priors | None = None,
    *,
    leave: Literal["distance", "view"] = "distance",
    fit: Callable[..., Calibration] = calibrate,
) -> list[Prediction | None]:
    """Predict each reading's target from the others: without its distance, or only without itself.

    `fit` takes the readings, the lengths and the priors, as `calibrate` does.
    None where the others do not hold its setting, or leave the side of focus open.

    Examples
    --------
    >>> from focalgradient import Lens
    >>> lens = Lens(0.05, 4.2, 1.0)  # marked f/4
    >>> width = lambda d: 0.5 * float(lens.blur_radius(d)) * lens.sensor_distance
    >>> seen = [Reading(d, 4.0, None, width(d), 1e-8) for d in (1.4, 2.0, 3.0, 5.0)]
    >>> priors = Priors(k=0.5, offset_sd=0.001, k_sd=0.01, distance_sd=0.001)
    >>> [round(found.distance, 2) for found in cross_validate(seen, 0.05, 5e-6, priors)]
    [1.41, 2.0, 2.99, 4.95]
    """
    predictions: list[Prediction | None] = []
    for number, reading in enumerate(readings):
        others = [
            other
            for n, other in enumerate(readings)
            if (other.distance != reading.distance if leave == "distance" else n != number)
        ]
        try:
            camera = fit(others, focal_length, pixel_pitch, priors)
            predictions.append(camera.predict(reading))
        except InputError:
            predictions.append(None)
    return predictions
