"""Depth from the blur of sharp edges, in one view (Pentland 1987, section II.A, Eqs. 2-6).

A sharp edge in the world is as blurred in the image as its point is out of focus. What tells sharp edges from lines,
shading and crowded edges is whether a blurred step explains the pixels: that is tested, at a stated false-alarm rate.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, fdtrc

from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.edges.contours import find_contours, image_noise
from focalgradient.depth.edges.regression import regress_edges
from focalgradient.depth.edges.steps import Profile, fit_steps
from focalgradient.depth.registration import Placement, RegisteredViews
from focalgradient.depth.search import Search
from focalgradient.depth.settings import RecoverySettings
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.psf import DISC_K, MODELS, PsfName
from focalgradient.view import View

__all__ = ["Edges", "Fit", "average_segments", "measure_edges", "recover"]

Fit = Literal["likelihood", "regression", "unweighted"]

FloatArray = NDArray[np.float64]

BLUR_ERROR = 0.03
"""Error of real lenses' blur against the model, as a share of its radius, that is not yet a contradiction of views."""

RIVAL = 9.0
"""A second reading whose cost comes within this (three sd) of the least leaves the side of focus undecided."""


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Points about one pixel apart along the edges of an image, with the blur there; arrays of one entry a point.

    Neighbouring points are read from one band of pixels, or from bands that overlap, so that their errors go together:
    only points a band's length apart are independent.

    Parameters
    ----------
    row, column
        Position in pixels; the centre of the first pixel is (0, 0).
    angle
        Direction of the normal, from dark to bright, in radians from +column towards +row (right, then down).
    low, high
        Levels of the image on the dark and on the bright side. These and what follows, up to `misfit`, are NaN where
        no step could be fitted.
    radius
        Radius of the blur disc in pixels, with the pixel's own width removed.
    radius_sd
        Standard deviation of `radius` in pixels: from the noise, and larger where the step fits less well.
    misfit
        Chi-square per degree of freedom of what the step leaves unexplained; about 1 where noise is all that is left.
    good
        False where that is beyond chance, or no step could be fitted: no edge, or not a sharp one that stands alone.
    segment
        Number, from 0 on, of the smooth piece of contour that the point lies on; its points follow one another.
    """

    row: FloatArray
    column: FloatArray
    angle: FloatArray
    low: FloatArray
    high: FloatArray
    radius: FloatArray
    radius_sd: FloatArray
    misfit: FloatArray
    good: NDArray[np.bool_]
    segment: NDArray[np.intp]


def measure_edges(
    image: NDArray[np.floating],
    *,
    psf: PsfName = "gaussian",
    k: float = 1.0,
    noise: float | None = None,
    length: float = 16.0,
    fit: Fit = "likelihood",
    false_alarm: float = 1e-3,
) -> Edges:
    """Find the edges of an image, and measure how blurred each is all along.

    Parameters
    ----------
    image
        Linear radiance, H x W.
    psf, k
        Model of the blur: ``"gaussian"`` of sigma = `k` x radius (with k = 1 the radius *is* sigma), or ``"disc"``,
        uniform and of that radius.
    noise
        Standard deviation of the pixels' independent noise in the image's unit. Where it is not given it is estimated
        from the finest detail of the image, and from what each band itself leaves unexplained.
    length
        Length in pixels, along the edge, of the band from which a point is read.
    fit
        ``"likelihood"``: a blurred step fitted to the pixels. ``"regression"``: the paper's line through ln|C/x|
        over x^2, weighted; ``"unweighted"``: the same with all points alike, as in the paper. These two know a
        Gaussian only: a disc's radius is twice their sigma. They differ in `radius` and `radius_sd` alone.
    false_alarm
        Probability with which a sharp edge that stands alone is refused. It is less where a misfit of 1 % of the
        edge's contrast, which is granted to real lenses, exceeds the noise.

    Returns
    -------
    Edges
        Good points and others.

    Raises
    ------
    InputError
        If the image is not H x W and finite, or a setting is out of range.

    Notes
    -----
    Two like edges within about two sigma of each other, and a shading ramp whose ends are as rounded as a blurred
    edge's, are blurred steps as far as pixels can tell, and are read as such.

    Examples
    --------
    An edge of sigma 2 px and contrast 0.5 in noise of 0.01: a band of 16 rows knows sigma to 1 %.

    >>> from scipy.special import ndtr
    >>> rng = np.random.default_rng(0)
    >>> blurred = 0.2 + 0.5 * ndtr((np.arange(64) - 30.3) / np.hypot(2.0, np.sqrt(1 / 12)))
    >>> edges = measure_edges(blurred + 0.01 * rng.standard_normal((48, 64)))
    >>> bool(edges.good.all()), round(float(np.median(edges.radius)), 1), round(float(np.median(edges.radius_sd)), 2)
    (True, 2.0, 0.02)
    """
    pixels = _checked(image, psf, k, noise, length, fit, false_alarm)
    sd = image_noise(pixels) if noise is None else float(noise)
    half = int(length / 2)
    contours = find_contours(pixels, sd, half)
    # Bands lie a quarter of their length apart, none reaching beyond its contour's ends; each point takes the nearest.
    segment = contours.segment
    counts = np.bincount(segment)
    margin = np.minimum(half, (counts - 1) // 2)
    hop = max(1, int(length / 4))
    first, last = (np.cumsum(counts) - counts + margin)[segment], (np.cumsum(counts) - 1 - margin)[segment]
    middle = np.clip(first + hop * np.rint((np.arange(len(segment)) - first) / hop).astype(np.intp), first, last)
    where, back = np.unique(middle, return_inverse=True)
    row, column, angle = contours.row[where], contours.column[where], contours.angle[where]
    steps = fit_steps(
        *(pixels, row, column, angle, contours.blur[where]),
        profile=Profile.of(psf),
        length=length,
        noise=sd,
        noise_known=noise is not None,
    )
    freedom = np.where(np.isfinite(steps["freedom"]), steps["freedom"], 1.0)
    # Patnaik's approximation to the noncentral chi-square, and to F where the noise is estimated from the band.
    expected = freedom + steps["allowed"]
    equal = expected**2 / (expected + steps["allowed"])
    excess = steps["misfit"] / expected
    chance = (
        chdtrc(equal, equal * excess) if noise is not None else fdtrc(equal, np.maximum(steps["pixels"], 1), excess)
    )
    good = np.isfinite(steps["square"]) & (chance >= false_alarm)
    square, square_sd = steps["square"], steps["square_sd"]
    if fit != "likelihood":
        to_edge = steps["offset"]
        square, square_sd = regress_edges(
            pixels,
            row + to_edge * np.sin(steps["angle"]),
            column + to_edge * np.cos(steps["angle"]),
            steps["angle"],
            steps["bend"],
            contours.blur[where],
            length=length,
            noise=sd,
            weighted=fit == "regression",
        )
        good &= np.isfinite(square)
    sigma_per_radius = k if psf == "gaussian" else DISC_K if fit != "likelihood" else 1.0
    square, square_sd = square / sigma_per_radius**2, square_sd / sigma_per_radius**2
    radius = np.sqrt(np.maximum(square, 0.0))
    # First order in the square; near zero, where the root is steep, the root of the square's own.
    radius_sd = square_sd / (2 * np.sqrt(np.maximum(square, 0.0) + square_sd / 4))
    return Edges(
        row=contours.row,
        column=contours.column,
        angle=np.where(np.isfinite(steps["angle"]), steps["angle"], angle)[back],
        low=steps["low"][back],
        high=steps["high"][back],
        radius=radius[back],
        radius_sd=radius_sd[back],
        misfit=(steps["misfit"] / freedom)[back],
        good=good[back],
        segment=segment,
    )


def average_segments(edges: Edges, length: float) -> Edges:
    """The same edges, each segment read as a whole: `radius` and `radius_sd` averaged over its good points by weight.

    Where a straight line along the segment is told from a constant by three standard deviations, it is taken instead:
    the vergence of a straight edge that recedes is linear along its image. A segment is good if half its points are,
    and the radius is then known to 0.3 pixel or to a tenth.

    Parameters
    ----------
    edges
        As from `measure_edges`.
    length
        Of the bands that they were read from: only so far apart are points independent.

    Examples
    --------
    Points that scatter by their standard deviation of 0.1 px along 64 px: four independent ones leave 0.05.

    >>> line, one = np.arange(64.0), np.ones(64)
    >>> radius = 2 + 0.1 * np.repeat([1.0, -1, -1, 1], 16)
    >>> points = Edges(line, 0 * one, 0 * one, 0 * one, one, radius, 0.1 * one, one, one > 0, np.zeros(64, int))
    >>> whole = average_segments(points, 16)
    >>> whole.radius[:2].round(6).tolist(), whole.radius_sd[:2].round(6).tolist()
    ([2.0, 2.0], [0.05, 0.05])
    """
    segment = edges.segment
    points = np.bincount(segment)
    place = np.arange(len(segment)) - (np.cumsum(points) - points)[segment]
    found = np.where(edges.good, edges.radius, 0.0)
    weight = np.where(edges.good, np.where(edges.good, edges.radius_sd, 1.0) ** -2.0, 0.0)

    def total(values: FloatArray) -> FloatArray:
        return np.bincount(segment, weight * values).astype(float)

    used = np.bincount(segment, edges.good)
    weights = np.maximum(total(np.ones(len(segment))), 1e-30)
    along = place - (total(place) / weights)[segment]
    spread = np.maximum(total(along**2), 1e-30)
    overlap = np.minimum(used, length)  # points that share what they were read from
    slope = total(along * found) / spread
    slope = np.where(slope**2 * spread > 9 * overlap, slope, 0.0)
    line = (total(found) / weights)[segment] + slope[segment] * along
    inflation = overlap * np.maximum(1.0, total((found - line) ** 2) / np.maximum(used, 1))
    variance = (inflation / weights)[segment] + (slope != 0)[segment] * along**2 * (inflation / spread)[segment]
    radius, sd = np.maximum(line, 0.0), np.sqrt(variance)
    good = ((used > 0) & (2 * used >= points))[segment] & (sd <= np.maximum(0.3, 0.1 * radius))
    return replace(edges, radius=radius, radius_sd=sd, good=good)


def recover(views: Sequence[View], asked: RecoverySettings) -> DepthMap:
    """Depth of `views` as `focalgradient.recover_depth` returns it, for checked views and settings.

    Each view is read by itself, from bands twice the window long. Its segments, averaged, are drawn three pixels wide,
    and only there is the map valid. Where several views show an edge, their readings are combined by precision. Views
    of one plane of focus leave the side of it open, and the stated one is taken; views of several tell it where their
    readings agree on one side only.
    """
    search = Search.over(views, asked.near, asked.far)
    asked.say("placing the views")
    placed = RegisteredViews.of(views, asked.align)
    length = 2 * asked.window
    given = None if asked.noise is None else np.broadcast_to(np.asarray(asked.noise, float), len(views)).tolist()
    sides = _sides(search)
    per_sigma = asked.k if asked.psf == "gaussian" else DISC_K  # sigma per radius
    drawn: list[tuple[NDArray[np.intp], FloatArray, FloatArray, FloatArray]] = []
    points = good = 0
    for number, (view, shift) in enumerate(zip(views, placed.found, strict=True)):
        if view.optics.aperture_diameter == 0:
            continue  # a pinhole's edges are sharp at every distance
        asked.say(f"measuring the edges of view {number + 1}")
        edges = measure_edges(
            view.image,
            psf=asked.psf,
            k=asked.k,
            noise=None if given is None else given[number],
            length=length,
            false_alarm=asked.false_alarm,
        )
        points, good = points + len(edges.good), good + int(edges.good.sum())
        placement = Placement(views[0].pixel_angle / view.pixel_angle)
        pixel, whole = _draw(
            average_segments(edges, length), placement.then(shift) if asked.align else placement, view.shape
        )
        per_pixel = 2 * view.pixel_angle / view.optics.aperture_diameter  # dioptres per pixel of radius
        # What a calibrated camera blurs (or, negative, sharpens) even in focus; an eye has none that is known.
        own = getattr(view.optics, "own_variance", 0.0) / (view.pixel_angle * per_sigma) ** 2
        radius = np.sqrt(np.maximum(whole.radius**2 - own, 0.0))
        steeper = whole.radius / np.maximum(radius, 0.1 * whole.radius + 1e-9) if own else 1.0
        defocus, sd = per_pixel * radius, per_pixel * whole.radius_sd * steeper
        drawn.append((pixel, view.optics.focus_vergence + sides[:, None] * defocus, sd, BLUR_ERROR * defocus))

    pixels = np.unique(np.concatenate([pixel for pixel, *_ in drawn]))
    readings = np.zeros((len(drawn), len(sides), len(pixels)))
    sd, error = np.full((len(drawn), len(pixels)), np.inf), np.zeros((len(drawn), len(pixels)))
    for number, (pixel, *told) in enumerate(drawn):
        at = np.searchsorted(pixels, pixel)
        readings[number][:, at], sd[number, at], error[number, at] = told
    told_vergence, told_sd, alone, agree = _combine(readings, sd, error, search, asked.false_alarm)

    vergence = np.full(placed.shape, (search.lowest + search.highest) / 2, np.float32)
    vergence_sd = np.full(placed.shape, search.highest - search.lowest, np.float32)
    valid, side_known = np.zeros(placed.shape, np.bool_), np.full(placed.shape, search.side_known)
    vergence.flat[pixels], vergence_sd.flat[pixels] = told_vergence, told_sd
    valid.flat[pixels] = alone & agree & placed.usable.flat[pixels]
    side_known.flat[pixels] &= alone
    if not search.side_known:
        warnings.warn(FocalGradientWarning(search.side_text), stacklevel=3)
    details = {
        **asked.stated(),
        "searched_vergence_D": [search.lowest, search.highest],
        "side": search.side_text,
        "noise": given or [image_noise(view.image) for view in views],
        "noise_estimated": given is None,
        "gain": placed.gains,
        "shift_px": [[p.down, p.right] for p in placed.found],
        "scale": [p.scale for p in placed.found],
        "edge_points": points,
        "share_of_edge_points_good": good / max(points, 1),
        "share_valid": float(valid.mean()),
    }
    return DepthMap(vergence, vergence_sd, valid, side_known, details)


def _sides(search: Search) -> FloatArray:
    """The signs that defocus may have in vergence: -1 beyond focus, +1 nearer."""
    if np.ptp(search.focus) > 1e-9 * max(1.0, np.abs(search.focus).max()):
        return np.array([-1.0, 1.0])
    nearer = search.lowest >= search.focus[0] and search.highest > search.focus[0]
    return np.array([1.0 if nearer else -1.0])


def _draw(edges: Edges, placement: Placement, shape: tuple[int, int]) -> tuple[NDArray[np.intp], Edges]:
    """Flat indices of the pixels within one of a good point, on the first view's grid, and the edges at them."""
    middle_row, middle_column = (shape[0] - 1) / 2, (shape[1] - 1) / 2
    row = np.rint(middle_row + (edges.row - middle_row - placement.down) / placement.scale).astype(np.intp)
    column = np.rint(middle_column + (edges.column - middle_column - placement.right) / placement.scale).astype(np.intp)
    owner = np.full(shape, -1, np.intp)
    # The nearest last, so that a pixel goes to the contour that runs through it.
    for away in (2, 1, 0):
        for down, right in ((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if abs(i) + abs(j) == away):
            i, j = row + down, column + right
            inside = np.flatnonzero(edges.good & (i >= 0) & (j >= 0) & (i < shape[0]) & (j < shape[1]))
            owner[i[inside], j[inside]] = inside
    pixel = np.flatnonzero(owner >= 0)
    point = owner.ravel()[pixel]
    return pixel, Edges(*(getattr(edges, field.name)[point] for field in fields(Edges)))


def _combine(
    readings: FloatArray, sd: FloatArray, error: FloatArray, search: Search, false_alarm: float
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], NDArray[np.bool_]]:
    """Vergence at P pixels from what n views say of it (`readings`, n x sides of focus x P, in dioptres).

    `sd` is their standard deviation from noise (n x P), infinite where a view shows no edge, and `error` what is
    allowed to the model. Returns vergence, its standard deviation, whether no other reading does as well, and whether
    the views agree on it.
    """
    doubt = np.hypot(sd, error)
    slack = 3 * sd[:, None]
    possible = (readings >= search.lowest - slack) & (readings <= search.highest + slack) & np.isfinite(slack)
    # Every reading is a candidate; each view is for it by that reading of its own that comes nearest.
    views, sides, count = readings.shape
    candidates, own = readings.reshape(views * sides, count), np.repeat(doubt, sides, axis=0)
    away = np.abs(readings[:, :, None] - candidates)
    cost = ((away.min(axis=1) / doubt[:, None]) ** 2).sum(axis=0)
    cost = np.where(possible.reshape(candidates.shape), cost, np.inf)
    best = np.argmin(cost, axis=0)
    at = (best, np.arange(len(best)))
    apart = np.abs(candidates - candidates[at]) > 3 * np.hypot(own, own[at])
    alone = np.isfinite(cost[at]) & ~(apart & (cost < cost[at] + RIVAL)).any(axis=0)
    chosen = np.take_along_axis(readings, away[:, :, at[0], at[1]].argmin(axis=1)[:, None], axis=1)[:, 0]
    weight = sd**-2.0
    vergence = (weight * chosen).sum(axis=0) / weight.sum(axis=0)
    others = np.maximum(np.isfinite(sd).sum(axis=0) - 1.0, 1.0)
    agree = chdtrc(others, (((chosen - vergence) / doubt) ** 2).sum(axis=0)) >= false_alarm
    return np.clip(vergence, search.lowest, search.highest), weight.sum(axis=0) ** -0.5, alone, agree


def _checked(
    image: NDArray[np.floating], psf: str, k: float, noise: float | None, length: float, fit: str, false_alarm: float
) -> NDArray[np.float32]:
    """The image as it is worked on, refused where it or a setting cannot be used."""
    if psf not in MODELS:
        raise InputError(f"psf is {psf!r}, but must be one of {', '.join(MODELS)}.")
    if fit not in ("likelihood", "regression", "unweighted"):
        raise InputError(f"fit is {fit!r}, but must be 'likelihood', 'regression' or 'unweighted'.")
    if not (k > 0 and math.isfinite(k)):
        raise InputError(f"k is {k!r}, but must be a positive number, sigma / disc radius.")
    if noise is not None and not (noise > 0 and math.isfinite(noise)):
        raise InputError(f"noise is {noise!r}, but must be a positive number in the image's unit: or leave it out.")
    if not 4 <= length <= 128:
        raise InputError(f"length is {length!r}, but must be between 4 and 128 pixels.")
    if not 0 < false_alarm < 1:
        raise InputError(f"false_alarm is {false_alarm!r}, but must be a probability between 0 and 1.")
    pixels = np.ascontiguousarray(image, np.float32)
    if pixels.ndim != 2 or min(pixels.shape) < 8:
        raise InputError(f"image has shape {pixels.shape}, but must be H x W, of 8 pixels or more each way.")
    if not np.isfinite(pixels).all():
        raise InputError("image holds NaN or infinite pixels, but every pixel must be finite: repair or crop it.")
    return pixels
