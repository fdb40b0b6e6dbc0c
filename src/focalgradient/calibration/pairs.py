"""Blur of pairs of views of a flat target, by equalisation of the whole frame: any texture will do, without edges.

A flat target that faces the camera has the same blur everywhere: each view of a pair is given the hypothesised blur of
the other, and the blur at which they agree best over the frame is the estimate. The calibration is thus in terms of the
default method of `focalgradient.recover_depth`: blur common to both views, such as the camera's own, cancels, and a
wrong blur shape affects target and scene equally.

The law is that of `calibrate`: the radius of the disc of the wider view on the sensor is (F / 2N) |V_f - V| v0, and the
effective f-number N absorbs the scale of the blur shape.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from focalgradient.calibration.camera import Calibration, Reading
from focalgradient.calibration.fit import Priors, calibrate
from focalgradient.depth.equalise.likelihood import equalise
from focalgradient.depth.noise import noise_from_residuals
from focalgradient.depth.numerics import block_sum
from focalgradient.depth.read import parabola_minimum
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Search
from focalgradient.errors import InputError
from focalgradient.psf import DISC_K, Blend, Disc, Gaussian, Psf, psf_of
from focalgradient.view import View

__all__ = ["PairBlur", "calibrate_pairs", "likeliest_shape", "pair_blur", "pair_priors", "shape_k"]


CELLS = 6
"""Number of cells of the frame, in each direction, that the jackknife leaves out in turn."""

WINDOW = 8.0
"""Window in pixels, the default of `recover_depth`."""

LARGEST = 16.0
"""Maximum blur radius searched, in pixels."""

ANGLE = 1e-3
"""Pixel angle in radians of the stand-in optics; it cancels."""

RATIO = 1.15
"""Minimum ratio of the f-numbers of a pair; below it, noise dominates."""

BLENDS = (0.25, 0.35, 0.45)
"""Gaussian fractions of the candidate Gaussian-edged discs."""


@dataclass(frozen=True, slots=True)
class _Stop:
    """Stand-in aperture whose blur radius is one pixel per dioptre in the wider view of a pair."""

    aperture_diameter: float
    focus_vergence: float = LARGEST


@dataclass(frozen=True, slots=True)
class PairBlur:
    """Blur of a flat target in the wider of two views, by equalisation."""

    radius: float
    """Radius of the blur disc, in pixels."""
    radius_sd: float
    """Jackknife standard deviation of the radius, over parts of the frame."""
    cost: float
    """Minus twice the log likelihood of the best blur, for comparing blur shapes at equal noise."""
    noise: float
    """Noise standard deviation of the first view on which the result is based."""


def pair_blur(
    views: Sequence[View],
    f_numbers: Sequence[float],
    psf: Psf | str = "disc",
    k: float | None = None,
    noise: float | None = None,
) -> PairBlur:
    """Measure the blur of one flat target, facing the camera, in two views with the same focus, over the whole frame.

    Parameters
    ----------
    views
        Two views; only their images are used. They are registered first.
    f_numbers
        F-number of each view, as marked.
    psf, k
        Shape of the blur, as for `focalgradient.recover_depth`.
    noise
        Noise standard deviation of the first view; None: estimated.

    Raises
    ------
    InputError
        If the f-numbers are too similar, or the views differ in no measurable blur.
    """
    if len(views) != 2 or max(f_numbers) < RATIO * min(f_numbers):
        raise InputError(
            f"f-numbers {', '.join(f'{number:g}' for number in f_numbers)} are given, but a pair needs two that differ "
            "by half a stop or more: photograph the target at both of the f-numbers that are to be used."
        )
    shape = psf_of(psf, k)
    found = _measured(views, f_numbers, shape, noise)
    if found is not None:
        return found
    if _measured(views, f_numbers[::-1], shape, noise) is not None:
        wide, narrow = min(f_numbers), max(f_numbers)
        raise InputError(
            f"the view at f/{narrow:g} is more blurred than that at f/{wide:g}, where the more open aperture blurs "
            "more: their f-numbers seem to be exchanged, check f_number."
        )
    raise InputError(
        "the target shows no difference of blur between its two views, or blur of more than 16 pixels: photograph "
        "it farther from the plane of focus, or nearer to it, or reduce the pictures."
    )


def _measured(views: Sequence[View], f_numbers: Sequence[float], psf: Psf, noise: float | None) -> PairBlur | None:
    """Measure a pair's blur like `pair_blur`; return None at either end of the search range.

    For shapes that are inverted on the near side of focus, both sides are tried, and the more likely one is returned.
    """
    foci = (LARGEST,) if psf.symmetric else (LARGEST, 0.0)
    found = [_measured_beside(focus, views, f_numbers, psf, noise) for focus in foci]
    return min((one for one in found if one is not None), key=lambda one: one.cost, default=None)


def _measured_beside(
    focus: float, views: Sequence[View], f_numbers: Sequence[float], psf: Psf, noise: float | None
) -> PairBlur | None:
    """Measure the blur on one side of the stand-in optics' `focus` (D): beyond `LARGEST`, or nearer than 0."""
    optics = [_Stop(2 * ANGLE * min(f_numbers) / number, focus) for number in f_numbers]
    registered = RegisteredViews.of(
        [View(view.image, stop, ANGLE, mask=view.mask) for view, stop in zip(views, optics, strict=True)], True
    )
    search = Search.over(optics, ANGLE, None, None)
    blurs = search.blurs(psf)
    noise_sd = noise_from_residuals(registered, blurs, WINDOW, None)[0]
    if noise is not None:
        noise_sd = [noise * sd / noise_sd[0] for sd in noise_sd]
    equalised = equalise(registered.images, blurs, noise_sd, window=WINDOW)
    rim = min(24, min(registered.shape) // 8)
    weight = registered.usable.astype(np.float32)
    weight[:rim], weight[-rim:], weight[:, :rim], weight[:, -rim:] = 0, 0, 0, 0
    energy = sum(residual.energy(weight, equalised.step) for residual in equalised.residuals)
    count = block_sum(weight, equalised.step)
    expected = np.sum([residual.noise for residual in equalised.residuals], axis=0)
    cost = energy - expected[:, None, None] * count
    rows, columns = (np.arange(n) * CELLS // n for n in count.shape)
    cells = np.zeros((equalised.levels, CELLS * CELLS))
    for cell in range(CELLS * CELLS):
        inside = np.outer(rows == cell // CELLS, columns == cell % CELLS)
        cells[:, cell] = cost[:, inside].sum(axis=1)
    radius = search.radius(search.vergences)
    whole = cells.sum(axis=1)
    # The first cost is of all cells, each other without one.
    places, costs, _ = parabola_minimum(np.column_stack([whole, whole[:, None] - cells]))
    places = np.interp(places, np.arange(radius.size), radius)
    best, without = float(places[0]), places[1:]
    spread = math.sqrt((without.size - 1) / without.size * float(((without - without.mean()) ** 2).sum()))
    least, most = float(radius.min()), float(radius.max())
    if not least + 0.2 < best < most - 0.2:
        return None
    return PairBlur(best, spread, float(costs[0]), float(noise_sd[0]))


def likeliest_shape(pairs: Sequence[tuple[Sequence[View], Sequence[float]]]) -> Psf:
    """Return the blur shape that explains all `pairs` best: disc, Gaussian, or Gaussian-edged disc.

    Each pair consists of its views and their f-numbers.
    """
    shapes: list[Psf] = [Disc(), *(Blend(k) for k in BLENDS), Gaussian()]
    costs = np.zeros(len(shapes))
    for views, numbers in pairs:
        noise = min(pair_blur(views, numbers, shapes[end]).noise for end in (0, -1))
        costs += [pair_blur(views, numbers, shape, noise=noise).cost for shape in shapes]
    return shapes[int(np.argmin(costs))]


def shape_k(shape: Psf) -> float:
    """Return the `k` that identifies a shape in a calibration by pairs: its parameter, or SD / radius.

    >>> shape_k(Disc()), shape_k(Blend(0.25))
    (0.5, 0.25)
    """
    return shape.stated().get("k", shape.sd_per_radius)


def pair_priors(priors: Priors, k: float) -> Priors:
    """Return the priors of a fit to pairs: `k` is a common scale of all apertures, later assigned to the f-numbers."""
    spread = math.hypot(priors.f_number_sd, priors.k_sd)
    return replace(priors, k=k, k_sd=spread, own_sd=1e-3, f_number_sd=1e-4)


def calibrate_pairs(
    readings: Sequence[Reading],
    f_numbers: Sequence[float],
    focal_length: float,
    pixel_pitch: float,
    priors: Priors | None = None,
    k: float = DISC_K,
) -> Calibration:
    """Estimate the camera for the default method from the blur of pairs, as the posterior mode.

    Parameters
    ----------
    readings
        One reading per pair: `Reading.f_number` is the smaller of the two, `Reading.width` is `k` times the disc radius
        on the sensor (m).
    f_numbers
        All marked f-numbers of the pairs; all are multiplied by the common scale.
    focal_length, pixel_pitch
        Values in metres.
    priors
        Priors; default: those of `Priors`. Their `k` and `own_sd` are not used.
    k
        Ratio sigma / radius of the blur shape, which identifies it; the fitted scale is assigned to the f-numbers.

    Raises
    ------
    InputError
        As for `calibrate`.

    Examples
    --------
    >>> from focalgradient import Lens
    >>> lens = Lens(0.05, 4.4, 1.0)  # marked f/4
    >>> width = lambda d: 0.5 * float(lens.blur_radius(d)) * lens.sensor_distance
    >>> seen = [Reading(d, 4.0, None, width(d), 1e-8) for d in (1.4, 2.0, 3.0, 5.0)]
    >>> camera = calibrate_pairs(seen, [4.0, 16.0], 0.05, 5e-6, Priors(offset_sd=0.001, distance_sd=0.001))
    >>> [round(number, 1) for number in camera.f_numbers.values()], round(1 / camera.focus[None], 2)
    ([4.4, 17.5], 1.0)
    """
    fitted = calibrate(readings, focal_length, pixel_pitch, pair_priors(priors or Priors(), k))
    marks = sorted(set(f_numbers))
    # ln k and own become 0; ln k is subtracted from each ln N; offset and foci are unchanged
    source = [0, 1, 2, *[0] * len(marks), *range(3 + len(fitted.f_numbers), len(fitted.informed))]
    sign = np.array([0, 0, 1, *[-1] * len(marks), *[1] * len(fitted.focus)])
    return replace(
        fitted,
        k=k,
        own=0.0,
        f_numbers={mark: mark * k / fitted.k for mark in marks},
        covariance=np.outer(sign, sign) * fitted.covariance[np.ix_(source, source)],
        informed=abs(sign) * fitted.informed[source],
    )
