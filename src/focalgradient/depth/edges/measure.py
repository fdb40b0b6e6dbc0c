"""Depth from the blur of sharp edges, in one view (Pentland 1987, section II.A, Eqs. 2-6).

A sharp edge in the world is as blurred in the image as its point is out of focus. Sharp edges differ from
lines, shading and crowded edges in that a blurred step explains their pixels: that is tested, at a stated false-alarm
rate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, fdtrc

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.edges.contours import find_contours
from focalgradient.depth.edges.regression import regress_edges
from focalgradient.depth.edges.steps import Profile, fit_steps
from focalgradient.depth.noise import noise_from_differences
from focalgradient.depth.registration import filled
from focalgradient.depth.validity import blur_is_known
from focalgradient.errors import InputError, check_one_of
from focalgradient.psf import Psf, psf_of
from focalgradient.quantities import Range
from focalgradient.view import check_mask

__all__ = ["Edges", "Fit", "average_segments", "measure_edges"]

Fit = Literal["likelihood", "paper"]


_PAPER_K = 1.0
"""The paper's sigma / radius: unless another k is given, edges are described by their sigma."""


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Points about one pixel apart along the edges of an image, with the blur there; arrays of one entry a point.

    Neighbouring points are measured in one band of pixels, or in bands that overlap, so that their errors are
    correlated: only points a band's length apart are independent.

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
    valid
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
    valid: Mask
    segment: NDArray[np.intp]


def measure_edges(
    image: NDArray[np.floating],
    *,
    psf: Psf | str = "gaussian",
    k: float | None = None,
    noise: float | None = None,
    length: float = 16.0,
    fit: Fit = "likelihood",
    false_alarm: float = 1e-3,
    mask: Mask | None = None,
) -> Edges:
    """Find the edges of an image, and measure the blur at each of their points.

    Parameters
    ----------
    image
        Linear radiance, H x W.
    psf, k
        Shape of the blur, or its name: ``"gaussian"`` of sigma = `k` x radius (here 1 by default: the radius *is*
        sigma), ``"disc"``, uniform and of that radius, or any other that gives its edge response.
    noise
        Standard deviation of the pixels' independent noise in the image's unit. Where it is not given it is estimated
        from the finest detail of the image, and from what each band itself leaves unexplained.
    length
        Length in pixels, along the edge, of the band in which a point is measured.
    fit
        ``"likelihood"``: a blurred step fitted to the pixels. ``"paper"``: the paper's line through ln|C/x| over x^2,
        which models a Gaussian only: another shape's radius is its sigma over `sd_per_radius` (a disc's: twice). They
        differ in `radius` and `radius_sd` alone.
    false_alarm
        Probability with which a sharp edge that stands alone is rejected. It is less where a misfit of 1 % of the
        edge's contrast, which is granted to real lenses, exceeds the noise.
    mask
        H x W, True where a pixel can be used; others are left out of the fits. None: all can be used.

    Returns
    -------
    Edges
        Valid points and others.

    Raises
    ------
    InputError
        If the image is not H x W and finite, the mask does not fit it, or a setting is out of range.

    Notes
    -----
    Two like edges within about two sigma of each other, and a shading ramp whose ends are as rounded as a blurred
    edge's, cannot be distinguished from blurred steps, and are measured as such.

    Examples
    --------
    An edge of sigma 2 px and contrast 0.5 in noise of 0.01: a band of 16 rows gives sigma to 1 %.

    >>> from scipy.special import ndtr
    >>> rng = np.random.default_rng(0)
    >>> blurred = 0.2 + 0.5 * ndtr((np.arange(64) - 30.3) / np.hypot(2.0, np.sqrt(1 / 12)))
    >>> edges = measure_edges(blurred + 0.01 * rng.standard_normal((48, 64)))
    >>> bool(edges.valid.all()), round(float(np.median(edges.radius)), 1), round(float(np.median(edges.radius_sd)), 2)
    (True, 2.0, 0.02)
    """
    shape = psf_of(psf, _PAPER_K if k is None and isinstance(psf, str) else k)
    if not shape.gives_edge_response:
        raise InputError(f"edges need the edge response, which {shape.name} does not give: use another psf.")
    check_one_of("fit", fit, get_args(Fit))
    if noise is not None and not (noise > 0 and math.isfinite(noise)):
        raise InputError(f"noise is {noise!r}, but must be a positive number in the image's unit: or leave it out.")
    Range("pixels", 4, 128).check("length", length)
    if not 0 < false_alarm < 1:
        raise InputError(f"false_alarm is {false_alarm!r}, but must be a probability between 0 and 1.")
    pixels = _checked(image, mask)
    whole = filled(pixels, mask)
    profile = Profile.of(shape)
    sd = noise_from_differences(whole, mask) if noise is None else float(noise)
    half = int(length / 2)
    *contour, segment = find_contours(whole, sd, half)
    where, back = np.unique(_band_middles(segment, half, max(1, int(length / 4))), return_inverse=True)
    row, column, angle, blur = (values[where] for values in contour)
    steps = fit_steps(
        *(pixels if mask is None else np.where(mask, pixels, np.float32(np.nan)), row, column, angle, blur),
        profile=profile,
        length=length,
        noise=sd,
        noise_known=noise is not None,
    )
    freedom = np.where(np.isfinite(steps["freedom"]), steps["freedom"], 1.0)
    valid = np.isfinite(steps["square"]) & (_p_value(steps, freedom, noise is not None) >= false_alarm)
    square, square_sd = steps["square"], steps["square_sd"]
    if fit != "likelihood":
        to_edge, normal = steps["offset"], steps["angle"]
        place = row + to_edge * np.sin(normal), column + to_edge * np.cos(normal)
        square, square_sd = regress_edges(whole, *place, normal, steps["bend"], blur, length=length, noise=sd)
        valid &= np.isfinite(square)
    per_radius = profile.per_radius if fit == "likelihood" else shape.sd_per_radius
    square, square_sd = square / per_radius**2, square_sd / per_radius**2
    radius = np.sqrt(np.maximum(square, 0.0))
    # First order in the square; near zero, where the root is steep, the root of the square's own.
    radius_sd = square_sd / (2 * np.sqrt(np.maximum(square, 0.0) + square_sd / 4))
    return Edges(
        row=contour[0],
        column=contour[1],
        angle=np.where(np.isfinite(steps["angle"]), steps["angle"], angle)[back],
        low=steps["low"][back],
        high=steps["high"][back],
        radius=radius[back],
        radius_sd=radius_sd[back],
        misfit=(steps["misfit"] / freedom)[back],
        valid=valid[back],
        segment=segment,
    )


def _band_middles(segment: NDArray[np.intp], half: int, hop: int) -> NDArray[np.intp]:
    """For each point along the contours, the point in the middle of the band in which it is measured.

    Bands lie `hop` points apart, none reaching `half` points beyond its contour's ends; each point takes the nearest.
    """
    counts = np.bincount(segment)
    margin = np.minimum(half, (counts - 1) // 2)
    first, last = (np.cumsum(counts) - counts + margin)[segment], (np.cumsum(counts) - 1 - margin)[segment]
    return np.clip(first + hop * np.rint((np.arange(len(segment)) - first) / hop).astype(np.intp), first, last)


def _p_value(steps: Mapping[str, FloatArray], freedom: FloatArray, noise_known: bool) -> FloatArray:
    """Return the probability of a misfit as large as each step's, if it is a blurred step.

    Patnaik's approximation to the noncentral chi-square, and to F where the noise is estimated from the band.
    """
    expected = freedom + steps["allowed"]
    equal = expected**2 / (expected + steps["allowed"])
    excess = steps["misfit"] / expected
    if noise_known:
        return np.asarray(chdtrc(equal, equal * excess), float)
    return np.asarray(fdtrc(equal, np.maximum(steps["pixels"], 1), excess), float)


def average_segments(edges: Edges, length: float) -> Edges:
    """Average `radius` and `radius_sd` over the valid points of each segment, by weight.

    Where a straight line along the segment differs from a constant by three standard deviations, it is taken instead:
    the vergence of a straight edge that recedes is linear along its image. A segment is valid if half its points are,
    and the radius is then known to 0.3 pixel or to a tenth.

    Parameters
    ----------
    edges
        As from `measure_edges`.
    length
        Of the bands in which they were measured: only so far apart are points independent.

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
    found = np.where(edges.valid, edges.radius, 0.0)
    weight = np.where(edges.valid, np.where(edges.valid, edges.radius_sd, 1.0) ** -2.0, 0.0)

    def total(values: FloatArray) -> FloatArray:
        return np.bincount(segment, weight * values).astype(float)

    used = np.bincount(segment, edges.valid)
    weights = np.maximum(total(np.ones(len(segment))), 1e-30)
    along = place - (total(place) / weights)[segment]
    lever = np.maximum(total(along**2), 1e-30)
    overlap = np.minimum(used, length)  # points that share pixels
    slope = total(along * found) / lever
    slope = np.where(slope**2 * lever > 9 * overlap, slope, 0.0)
    line = (total(found) / weights)[segment] + slope[segment] * along
    inflation = overlap * np.maximum(1.0, total((found - line) ** 2) / np.maximum(used, 1))
    variance = (inflation / weights)[segment] + (slope != 0)[segment] * along**2 * (inflation / lever)[segment]
    radius, sd = np.maximum(line, 0.0), np.sqrt(variance)
    valid = ((used > 0) & (2 * used >= points))[segment] & blur_is_known(sd, radius)
    return replace(edges, radius=radius, radius_sd=sd, valid=valid)


def _checked(image: NDArray[np.floating], mask: Mask | None) -> NDArray[np.float32]:
    """Validate an image and its mask; return it as 32-bit numbers."""
    pixels = np.ascontiguousarray(image, np.float32)
    if pixels.ndim != 2 or min(pixels.shape) < 8:
        raise InputError(f"image has shape {pixels.shape}, but must be H x W, of 8 pixels or more each way.")
    if not np.isfinite(pixels).all():
        raise InputError("image holds NaN or infinite pixels, but every pixel must be finite: repair or crop it.")
    check_mask(mask, pixels.shape)
    return pixels
