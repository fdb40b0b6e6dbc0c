"""Posterior mode of the camera parameters, given readings of a target and priors."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.calibration.camera import Calibration, Prediction, Reading, disc_radius
from focalgradient.errors import InputError, check_fields, check_number
from focalgradient.optics import Lens

__all__ = ["EDGE_K", "Priors", "calibrate", "cross_validate", "improbability"]


EDGE_K = 0.546
"""Ratio sigma / radius of the Gaussian that best fits an edge blurred by a uniform disc (radius of 3 pixels and more).
"""

MIN_SIDE_CHI_SQUARE = 6.0
"""Minimum difference of chi-square between the two sides of focus; below it, the target does not determine the side."""


COMPARISON_TOLERANCE = 1e-4
"""Relative tolerance of fits used for comparison only."""

SIDE_TOLERANCE = 0.1
"""Relative difference of vergence below which a target may lie on either side of a marked focus."""


MARK_DF = 4.0
"""Degrees of freedom of the prior of focus marks, Student's t: a mark that the target confirms is known to its standard
deviation, and one that the target contradicts hardly counts. Chosen by hand."""


@dataclass(frozen=True, slots=True)
class Priors:
    """Prior knowledge of a camera: means and standard deviations of priors, normal but for focus marks.

    Parameters
    ----------
    k, k_sd
        Ratio of edge sigma to disc radius, and its relative standard deviation.
    own_sd
        Standard deviation (around 0) of the residual blur variance, in square pixels.
    offset, offset_sd
        Distance from the user's reference plane to the entrance pupil of the lens, in metres.
    focus_offset
        The same from the reference plane of marked focus distances; None: the user's reference plane.
    f_number_sd
        Relative standard deviation of effective f-numbers around the marked ones.
    focus_sd
        Relative scale of the true focus vergence around a marked one, with the tails of Student's t.
    telecentric
        True for lenses telecentric on the image side.
    distance_sd
        Standard deviation of each measured distance, in metres.
    model_error, model_weight
        Expected relative error of a real lens's widths from the law, and its weight as a number of residuals.
    """

    k: float = EDGE_K
    k_sd: float = 0.05
    own_sd: float = 1.0
    offset: float = 0.0
    offset_sd: float = 0.1
    f_number_sd: float = 0.07
    focus_sd: float = 0.1
    distance_sd: float = 0.005
    model_error: float = 0.015
    model_weight: float = 4.0
    focus_offset: float | None = None
    telecentric: bool = False


def calibrate(
    readings: Sequence[Reading], focal_length: float, pixel_pitch: float, priors: Priors | None = None
) -> Calibration:
    """Estimate the camera from `readings` of its target and priors, as the posterior mode.

    Readings of one distance and setting are combined by their median.

    Parameters
    ----------
    readings
        One reading per view of the target.
    focal_length, pixel_pitch
        Values in metres.
    priors
        Priors; default: those of `Priors`.

    Raises
    ------
    InputError
        If there is no reading, a length is out of range, no lens fits the readings, or both sides of focus fit.

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
    camera = _Fit.of(readings, focal_length, pixel_pitch, priors).best(pixel_pitch)
    return replace(camera, edge_scatter=float(np.sqrt(np.mean([reading.scatter**2 for reading in readings]))))


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """Least-squares problem: parameters as in `Calibration.parameters`, then the error of each distance."""

    focal_length: float
    priors: Priors
    stops: list[float]
    marks: list[float | None]
    distances: FloatArray
    place: NDArray[np.intp]  # indices of distance, f-number and focus of each cell
    width: FloatArray  # um
    width_sd: FloatArray  # um
    own_sd: float  # um^2
    tolerance: float = 1e-8  # relative tolerance of the fit

    @classmethod
    def of(cls, readings: Sequence[Reading], focal_length: float, pixel_pitch: float, priors: Priors) -> _Fit:
        """Group the readings, after validation, into cells of equal distance and setting."""
        for r in readings:
            Lens(focal_length, r.f_number, math.inf if r.focus_distance is None else r.focus_distance)  # validates them
            check_fields(r)
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
            # scatter between exposures, or the stated standard errors; the median is slightly less precise than the
            # mean
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
        """Return the deviations of cells from the law, and of parameters from the priors, in standard deviations."""
        priors, first = self.priors, 3 + len(self.stops)
        distance, stop, focus = self.place
        vergence_focus, slip = theta[first : first + len(self.marks)], theta[first + len(self.marks) :]
        optical = np.maximum(self.distances + theta[2] + slip, 1e-3)
        radius = disc_radius(
            self.focal_length, np.exp(theta[3 + stop]), vergence_focus[focus], 1 / optical[distance], priors.telecentric
        )
        square = (1e6 * np.exp(theta[0]) * radius) ** 2 + theta[1]
        # edges in focus may have width 0, for which the SD of the squared width is that of its SD squared
        error = 2 * np.maximum(self.width, self.width_sd) * np.hypot(self.width_sd, model_error * self.width)
        offset = theta[2] if priors.focus_offset is None else priors.focus_offset
        known = [(v, mark) for v, mark in zip(vergence_focus, self.marks, strict=True) if mark and math.isfinite(mark)]
        marked = np.array([(v * (mark + offset) - 1) / priors.focus_sd for v, mark in known])
        marked = np.sign(marked) * np.sqrt((MARK_DF + 1) * np.log1p(marked**2 / MARK_DF))
        expected, sd = (math.log(priors.k), 0.0, priors.offset), (priors.k_sd, self.own_sd, priors.offset_sd)
        stops = (theta[3:first] - np.log(self.stops)) / priors.f_number_sd
        cells = (square - self.width**2) / error
        return np.concatenate([cells, (theta[:3] - expected) / sd, stops, marked, slip / priors.distance_sd])

    def best(self, pixel_pitch: float) -> Calibration:
        """Return the posterior mode; raise `InputError` if a camera on the other side of focus fits as well."""
        priors, first = self.priors, 3 + len(self.stops)
        found = sorted(self.minima(priors.model_error), key=lambda minimum: minimum[0])
        marked_sides = self.marked_sides()
        if marked_sides is not None:  # the marks resolve what the views leave undetermined
            agreeing = [one for one in found if (self.sides(one[1]) == marked_sides).all()]
            if agreeing and agreeing[0][0] < found[0][0] + MIN_SIDE_CHI_SQUARE:
                found = agreeing
        chi_square, theta = found[0]
        for other_chi_square, other in found[1:]:
            if other_chi_square - chi_square < MIN_SIDE_CHI_SQUARE and (self.sides(other) != self.sides(theta)).any():
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
        """Refine the minimum at `theta`; return parameters, relative model error of the widths, and covariance."""
        priors, error, known = self.priors, self.priors.model_error, self.width > self.width_sd
        for _ in range(8):
            _, theta, jacobian = self.converge(theta, error)
            covariance: FloatArray = np.linalg.inv(jacobian.T @ jacobian).astype(float)
            fitted = jacobian[: len(self.width)]
            residual_df = len(self.width) - float(np.trace(fitted @ covariance @ fitted.T))
            # widths not distinguishable from 0 carry no information on relative errors
            relative = np.divide(self.width_sd, self.width, out=np.zeros(len(known)), where=known)
            left = self.residuals(theta, error)[: len(self.width)] * np.hypot(relative, error) * known
            error = math.sqrt(
                (priors.model_weight * priors.model_error**2 + float((left**2).sum()))
                / (priors.model_weight + max(residual_df, 0.0))
            )
        return theta, error, covariance

    def sides(self, theta: FloatArray) -> NDArray[np.bool_]:
        """Return whether each cell lies beyond focus."""
        distance, _, focus = self.place
        return theta[3 + len(self.stops) + focus] > 1 / (self.distances[distance] + theta[2])

    def marked_sides(self) -> NDArray[np.bool_] | None:
        """Return whether each cell lies beyond the marked focus; None if a mark is missing or too close to a target."""
        if any(mark is None for mark in self.marks):
            return None
        distance, _, focus = self.place
        offset = self.priors.offset if self.priors.focus_offset is None else self.priors.focus_offset
        marked = np.array([1 / (mark + offset) for mark in self.marks if mark is not None])[focus]
        target = 1 / (self.distances[distance] + self.priors.offset)
        return None if (np.abs(target - marked) < SIDE_TOLERANCE * marked).any() else marked > target

    def minima(self, model_error: float) -> list[tuple[float, FloatArray]]:
        """Return chi-square and parameters at the minima reached from start values on all sides of the target."""
        count = len(self.marks)
        groups: list[list[float]] = []
        for group in range(count):
            vergence = 1 / (self.distances[self.place[0, self.place[2] == group]] + self.priors.offset)
            low, high = float(vergence.min()), float(vergence.max())
            # start values of the focus: beyond all distances, between them, and nearer than all
            starts = [0.5 * low, *(low + (high - low) * np.array([0.25, 0.5, 0.75])), 1.3 * high, 2 * high]
            if count > 1:  # each focus separately first
                kept = self.place[2] == group
                place = self.place[:, kept] * np.array([[1], [1], [0]])
                alone = replace(
                    self, marks=[self.marks[group]], place=place, width=self.width[kept], width_sd=self.width_sd[kept]
                )
                converged = alone.minima(model_error)
                least = min(chi_square for chi_square, _ in converged)
                starts = sorted({round(t[3 + len(self.stops)], 2) for c, t in converged if c < least + 30})
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
        """Return chi-square, parameters and Jacobian at the minimum reached from `start`."""
        from scipy.optimize import least_squares

        focus = slice(3 + len(self.stops), 3 + len(self.stops) + len(self.marks))
        lower, upper = np.full(start.size, -np.inf), np.full(start.size, np.inf)
        lower[focus], upper[focus] = 1e-4, 0.5 / self.focal_length
        start = np.clip(start, lower, upper)
        how: dict[str, Any] = {"x_scale": "jac", "ftol": self.tolerance, "xtol": self.tolerance}
        fit = least_squares(self.residuals, start, bounds=(lower, upper), args=(model_error,), **how)
        return 2 * float(fit.cost), fit.x, np.asarray(fit.jac)


def improbability(readings: Sequence[Reading], focal_length: float, pixel_pitch: float, priors: Priors) -> float:
    """Return minus twice the log posterior density of the best camera, relative to that of a perfect fit.

    Among readings of the same photographs, lower values indicate more plausible statements about them. The density is
    that of widths relative to the measured ones, so that readings in other units are comparable. The model error is
    included with its prior (scaled inverse chi-square).
    """
    fit = replace(_Fit.of(readings, focal_length, pixel_pitch, priors), tolerance=COMPARISON_TOLERANCE)
    expected, weight = priors.model_error, priors.model_weight
    best = min(fit.minima(expected), key=lambda minimum: minimum[0])
    theta, error, _ = fit.refined(best[1])
    known = fit.width_sd / np.maximum(fit.width, fit.width_sd)
    more = 2 * np.log(np.hypot(known, error) / np.hypot(known, expected)).sum()
    more += weight * (2 * math.log(error / expected) + (expected / error) ** 2 - 1)
    return float((fit.residuals(theta, error) ** 2).sum()) + float(more)


def cross_validate(
    readings: Sequence[Reading],
    focal_length: float,
    pixel_pitch: float,
    priors: Priors | None = None,
    *,
    leave: Literal["distance", "view"] = "distance",
    fit: Callable[..., Calibration] = calibrate,
) -> list[Prediction | None]:
    """Predict the target of each reading from the other readings, excluding those of its distance, or only itself.

    `fit` takes readings, lengths and priors, as `calibrate`. None if the other readings lack its setting, or leave the
    side of focus undetermined.

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
    kinds = [reading.distance if leave == "distance" else number for number, reading in enumerate(readings)]

    @cache
    def camera(left_out: float) -> Calibration:
        others = [reading for reading, kind in zip(readings, kinds, strict=True) if kind != left_out]
        return fit(others, focal_length, pixel_pitch, priors)

    predictions: list[Prediction | None] = []
    for reading, kind in zip(readings, kinds, strict=True):
        try:
            predictions.append(camera(kind).predict(reading))
        except InputError:
            predictions.append(None)
    return predictions
