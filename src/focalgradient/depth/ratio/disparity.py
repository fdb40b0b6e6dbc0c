"""The real-time form: detail of the large-aperture view over detail of the small (Pentland 1987, III.B-C, Fig. 5).

The Laplacian of each view is averaged over 4 x 4 pixels and divided by the local brightness; the two views' ratio is
the *focal disparity*, 1 in the plane of focus and falling with blur. Depth follows by a table
(`focalgradient.depth.ratio.table`).

Four things differ from the paper, all on purpose. What is averaged is the *square* of the Laplacian, and the disparity
is the root of the ratio: noise then adds a known amount, which is subtracted, where it cannot be taken out of an
average of sizes (``absolute=True`` gives the paper's). The Gaussian that gives the local brightness runs over the means
of 4 x 4 pixels, not over pixels: a box and a Gaussian are a Gaussian wider by 1.25 square pixels. And the second
difference may be taken between means over 2 x 2, 4 x 4 or 8 x 8 pixels: the finest detail is the first that blur takes,
and a band is best where the larger aperture has taken part of it and not all. And depth comes from all bands at once,
whose energies scatter together (`focalgradient.depth.ratio.covariance`), so that much of what is chance in one ratio is
told by the others.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import minimum_filter, uniform_filter

from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.ratio import energies
from focalgradient.depth.ratio.covariance import scatter_of
from focalgradient.depth.ratio.energies import BLOCK, Picture, Plane
from focalgradient.depth.ratio.likelihood import read
from focalgradient.depth.ratio.table import BANDS, DisparityTable
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Search
from focalgradient.depth.settings import RecoverySettings
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.psf import PsfName
from focalgradient.view import View

__all__ = ["detail", "fine_noise_floor", "focal_disparity", "read_depth", "recover", "table_for"]

BRIGHTNESS = 8.0
"""Standard deviation in pixels of the Gaussian that gives the local brightness."""

LEAST = 0.01
"""Root mean square Laplacian of the sharper view, as a share of the brightness, below which there is no estimate."""

CONTRADICTION = 33.0
"""Squared distance of the energies from those expected, over their variance, beyond which what is seen is no defocus:
chance alone gets there once in 100 000 times."""

COARSE = 8.0
"""Window in pixels from which depth is worked out for squares of 8 x 8 pixels, and repeated."""

NOISE_STEPS = 1024
"""Levels of brightness at which the noise of stored values is worked out."""


def focal_disparity(
    small: Picture,
    large: Picture,
    *,
    noise: float | Sequence[float] = 0.0,
    band: int = 1,
    window: float = 0.0,
    levels: ArrayLike | None = None,
    absolute: bool = False,
    least: float = LEAST,
    usable: NDArray[np.bool_] | None = None,
) -> tuple[Plane, NDArray[np.bool_]]:
    """Focal disparity of two views that differ in aperture alone, on a grid of 4 x 4 pixels (Fig. 5c).

    Parameters
    ----------
    small, large
        The view through the small aperture and the one through the large, H x W each, both uint8 or both float32. Rows
        and columns beyond a multiple of 4 are left out.
    noise
        Standard deviation of a pixel's noise, one for both views or one for each, in the units of the *stored* values.
        Rounding to whole numbers is added for uint8.
    band
        1, or the scale in pixels, 2, 4 or 8, of the second difference.
    window
        Standard deviation in pixels of a Gaussian in which energies are gathered beyond 4 x 4 pixels; 0 for the
        paper's squares alone.
    levels
        Linear radiance of each of the 256 values of uint8 views; by default the values themselves.
    absolute
        Average the size of the Laplacian, as the paper does, instead of its square. Noise is then subtracted as if
        Laplacians were normally distributed.
    least
        Least detail of the small-aperture view: root mean square Laplacian over brightness.
    usable
        H x W: False for pixels to leave out, as saturated ones.

    Returns
    -------
    disparity, told
        floor(H/4) x floor(W/4), float32 and bool. The disparity is 0 where it is not told: where the small-aperture
        view has less detail than `least`, or less than three times the noise, or hardly a usable pixel.

    Raises
    ------
    InputError
        If the views differ in size or type, or a setting is out of range.

    Examples
    --------
    A checkerboard whose contrast blur halves has a focal disparity of a half.

    >>> board = (np.indices((64, 64)).sum(axis=0) % 2).astype(np.float32)
    >>> disparity, told = focal_disparity(1 + 0.5 * board, 1.125 + 0.25 * board)
    >>> disparity.shape, round(float(disparity[8, 8]), 3), bool(told.all())
    ((16, 16), 0.5, True)
    """
    images = [small, large]
    table = _checked(images, levels)
    if band not in BANDS:
        raise InputError(f"band is {band!r}, but must be one of {', '.join(map(str, BANDS))} pixels.")
    if window and not 2 <= window <= 64:
        raise InputError(f"window is {window!r}, but must be 0, or between 2 and 64 pixels.")
    energy, brightness = _content(images, table, (band,), BLOCK, window, absolute, usable)
    # Second differences of means over band x band pixels; the mean size of a normal value is sqrt(2 / pi) of its sd.
    unit = 20.0 / band**2 * (2 / math.pi if absolute else 1.0)
    variance, span = _noise_by_brightness(noise, table)
    disparity, told = energies.compared(energy[0], brightness, np.float32(unit) * variance, span, least)
    if usable is not None and not usable.all():
        told &= _squares(usable, BLOCK)
        disparity[~told] = 0
    return disparity, told


def read_depth(
    small: Picture,
    large: Picture,
    table: DisparityTable,
    search: Search,
    *,
    noise: float | Sequence[float] = 0.0,
    window: float = 8.0,
    levels: ArrayLike | None = None,
    least: float = LEAST,
    usable: NDArray[np.bool_] | None = None,
) -> tuple[Plane, Plane, NDArray[np.bool_]]:
    """Depth on the grid of 4 x 4 pixels, from all of a table's bands, each weighed by what it tells there.

    Parameters
    ----------
    small, large, noise, window, levels, least, usable
        As for `focal_disparity`.
    table
        Disparity against defocus, of these views' optics.
    search
        The range of vergence, and so the side of focus.

    Returns
    -------
    vergence, vergence_sd, valid
        floor(H/4) x floor(W/4) each, in dioptres. Not valid where a pixel is left out, where no band has detail enough,
        where blur is not known to 0.3 pixel or to a fifth, and where no defocus makes the views as they are.
    """
    images = [small, large]
    decode = _checked(images, levels)
    grid = 2 * BLOCK if window >= COARSE else BLOCK
    energy, brightness = _content(images, decode, table.bands, grid, window, usable=usable)
    variance, span = _noise_by_brightness(noise, decode)
    size, sd, misfit = read(energy, brightness, variance, span, table.defocus, scatter_of(table, window), least)
    focus = float(search.focus[0])
    vergence = np.float32(focus) + (size if search.lowest >= focus else -size)
    inside = np.clip(vergence, np.float32(search.lowest), np.float32(search.highest))
    within = np.abs(vergence - inside) <= 2 * sd
    radius = search.slope * np.abs(focus - inside)
    valid = within & (sd * search.slope <= np.maximum(0.3, 0.2 * radius)) & (misfit < CONTRADICTION)
    sd = np.minimum(sd, np.float32(search.highest - search.lowest))
    shape, times = tuple(n // BLOCK for n in small.shape), grid // BLOCK
    valid = _spread(valid, shape, times)
    if usable is not None and not usable.all():
        valid &= _squares(usable, BLOCK)
    return _spread(inside, shape, times), _spread(sd, shape, times), valid


def table_for(search: Search, views: Sequence[View], psf: PsfName, k: float) -> DisparityTable:
    """The optics' table, a quarter farther than the search goes, so that its limits are no end of the table."""
    reach = 1.25 * max(abs(search.focus[0] - search.lowest), abs(search.focus[0] - search.highest))
    return DisparityTable.of([view.optics for view in views], views[0].pixel_angle, reach=reach, psf=psf, k=k)


def recover(views: Sequence[View], asked: RecoverySettings) -> DepthMap:
    """Depth of `views` as `focalgradient.recover_depth` returns it, for checked views and settings."""
    search = Search.over(views, asked.near, asked.far)
    asked.say("working out the table")
    table = table_for(search, views, asked.psf, asked.k)
    asked.say("placing the views")
    placed = RegisteredViews.of(views, asked.align)
    # The optics say which view is the sharper.
    order = np.argsort([view.optics.aperture_diameter for view in views])
    small, large = (placed.images[i] for i in order)
    asked.say("measuring noise")
    if asked.noise is None:
        floor = min(fine_noise_floor(image) * gain for image, gain in zip(placed.images, placed.gains, strict=True))
        noise = np.full(2, floor)
    else:
        noise = np.broadcast_to(np.asarray(asked.noise, float), 2)
    sds = noise / placed.gains
    asked.say("reading depth")
    vergence, sd, valid = read_depth(
        small, large, table, search, noise=[float(sds[i]) for i in order], window=asked.window, usable=placed.usable
    )
    if not search.side_known:
        warnings.warn(FocalGradientWarning(search.side_text), stacklevel=3)
    shape = placed.shape
    details = {
        **asked.stated(),
        "searched_vergence_D": [search.lowest, search.highest],
        "side": search.side_text,
        "noise": [float(sd) for sd in noise],
        "noise_estimated": asked.noise is None,
        "gain": placed.gains,
        "shift_px": [[p.down, p.right] for p in placed.found],
        "scale": [p.scale for p in placed.found],
        "bands_px": list(table.bands),
        "share_valid": float(valid.mean()),
    }
    return DepthMap(
        _spread(vergence, shape, BLOCK),
        _spread(sd, shape, BLOCK),
        _spread(valid, shape, BLOCK) & placed.usable,
        np.full(shape, search.side_known),
        details,
    )


def detail(image: Picture, levels: ArrayLike | None = None) -> float:
    """High-frequency content of a whole view: its root mean square Laplacian over its root mean square brightness.

    >>> board = (np.indices((64, 64)).sum(axis=0) % 2).astype(np.float32)
    >>> round(detail(1 + 0.1 * (board - 0.5)), 2)  # 4 x 0.1, and a little less at the frame's edges
    0.39
    """
    energy, brightness = energies.energies([image], _checked([image, image], levels), BLOCK, False)
    light = float(np.mean(brightness**2))
    return math.sqrt(float(energy.mean()) / light) if light > 0 else 0.0


def fine_noise_floor(image: NDArray[np.floating], side: int = 32) -> float:
    """Upper bound of a pixel's noise (standard deviation): the finest detail of the emptiest squares of an image.

    The difference of differences along and across sees least of any texture and all of the noise; blur and plain
    surfaces leave it nothing else. The fifth percentile over squares of `side` pixels is taken, without the few per
    cent by which it lies below the mean.

    >>> noise = np.random.default_rng(0).standard_normal((256, 256))
    >>> round(fine_noise_floor(100 + 0.5 * noise), 2)
    0.5
    """
    values = np.asarray(image, np.float32)
    fine = values[:-2] - 2 * values[1:-1] + values[2:]
    fine = fine[:, :-2] - 2 * fine[:, 1:-1] + fine[:, 2:]
    side = min(side, *fine.shape)
    squares = uniform_filter(fine**2, side)[side // 2 :: side, side // 2 :: side]
    # (1, -2, 1) by (1, -2, 1) has 36 times the variance of white noise; the sum over a square has the relative variance
    # 2 x (35/18)^4 / side^2 / 1, as the squared covariance (1, -4, 6, -4, 1)^2 / 36 sums to 35/18 in each direction.
    below = 1 - 1.645 * math.sqrt(2) * (35 / 18) / side if squares.size > 20 else 1.0
    return float(np.sqrt(np.percentile(squares, 5) / 36 / below))


def _content(
    images: Sequence[Picture],
    levels: Plane | None,
    bands: Sequence[int],
    grid: int,
    window: float,
    absolute: bool = False,
    usable: NDArray[np.bool_] | None = None,
) -> tuple[Plane, Plane]:
    """Energy of both views in each of `bands` (b x 2 x h x w) and their brightness (2 x h x w), gathered.

    The grid is of squares of `grid` pixels, 4 or 8. The Gaussians together with these squares have the variances asked.
    """
    shape = tuple(n // BLOCK // (grid // BLOCK) for n in images[0].shape)
    weight = None if usable is None or usable.all() else _weight(usable, max(bands), grid)
    found: list[Plane] = []
    brightness: Plane | None = None
    scale = 1
    while True:
        side = max(1, min(BLOCK, grid // scale))
        if scale in bands or brightness is None:
            energy, mean = energies.energies(images, levels, side, absolute)
            if scale in bands:
                found.append(_fitted(energy, shape))
            if brightness is None:
                brightness = _fitted(mean, shape)
        if scale == max(bands):
            break
        images, levels, scale = energies.binned(images, levels), None, 2 * scale
    content = np.concatenate(found) if len(found) > 1 else found[0]
    if window:
        content = _gathered(content, window, grid, weight)
    return content.reshape(len(bands), 2, *shape), _gathered(brightness, BRIGHTNESS, grid, weight)


def _weight(usable: NDArray[np.bool_], coarsest: int, grid: int) -> Plane:
    """1 for squares of `grid` pixels that are clear of unusable ones, by as far as differences reach; 0 for others."""
    return np.asarray(minimum_filter(_squares(usable, grid), 1 + 2 * math.ceil(2 * coarsest / grid)), np.float32)


def _squares(usable: NDArray[np.bool_], side: int) -> NDArray[np.bool_]:
    """Which squares of `side` pixels hold usable pixels only."""
    rows, columns = (n // BLOCK // (side // BLOCK) for n in usable.shape)
    by_rows = usable[: side * rows, : side * columns].reshape(rows, side, side * columns).all(axis=1)
    return np.asarray(by_rows.reshape(rows, columns, side).all(axis=2))


def _gathered(planes: Plane, sd: float, grid: int, weight: Plane | None) -> Plane:
    """Gaussian means of `planes` (n x h x w), of `sd` pixels, with `weight` (h x w); 0 far from all weight."""
    steps = math.sqrt(sd**2 - grid**2 / 12) / grid
    if weight is None:
        return energies.smoothed(planes, steps)
    support = energies.smoothed(weight[None], steps)
    return np.where(support > 0.05, energies.smoothed(planes * weight, steps) / np.maximum(support, 0.05), 0)


def _fitted(planes: Plane, shape: tuple[int, ...]) -> Plane:
    """`planes` on a grid of `shape` from one twice as fine, or twice as coarse, or of that shape."""
    if planes.shape[1] > shape[0]:
        return np.stack(energies.binned(planes, None))
    return planes if planes.shape[1:] == shape else _spread(planes, shape, 2)


def _spread(planes: NDArray[Any], shape: tuple[int, ...], times: int) -> NDArray[Any]:
    """Each value for squares of `times` x `times` of a grid (... x h x w), made `shape`: the outermost go on beyond."""
    rows, columns = (np.minimum(np.arange(n) // times, m - 1) for n, m in zip(shape, planes.shape[-2:], strict=True))
    return np.asarray(planes[..., rows, :][..., columns])


def _checked(images: Sequence[Picture], levels: ArrayLike | None) -> Plane | None:
    """The table that decodes stored values, or None for linear radiance; refuse what cannot be compared."""
    one, other = images
    for image in images:
        if not isinstance(image, np.ndarray) or image.ndim != 2 or image.dtype not in (np.uint8, np.float32):
            kind = f"{image.dtype} of shape {image.shape}" if isinstance(image, np.ndarray) else type(image).__name__
            raise InputError(f"a view is {kind}, but must be H x W of uint8 or float32: convert it first.")
    if one.shape != other.shape or one.dtype != other.dtype or min(one.shape) < 32:
        raise InputError(
            f"the views are {one.shape} {one.dtype} and {other.shape} {other.dtype}, but must be alike, and 32 x 32 "
            "pixels or more."
        )
    if one.dtype == np.float32:
        if levels is not None:
            raise InputError(
                "levels decode uint8 views, but these are float32, taken as linear radiance: leave it out."
            )
        return None
    table = np.arange(256, dtype=np.float32) if levels is None else np.asarray(levels, np.float32)
    if table.shape != (256,) or not np.all(np.diff(table) > 0) or table[0] < 0:
        raise InputError("levels must hold the linear radiance of the 256 stored values, rising from 0 or more.")
    return table


def _noise_by_brightness(noise: float | Sequence[float], levels: Plane | None) -> tuple[Plane, float]:
    """Variance of either view's noise in linear radiance, at even steps of brightness up to a span (2 x steps)."""
    sds = np.broadcast_to(np.asarray(noise, float), 2)
    if not np.all((sds >= 0) & np.isfinite(sds)):
        raise InputError(f"noise is {noise!r}, but must be 0 or a positive number, or one for each view.")
    if levels is None:
        return (sds[:, None] ** 2).astype(np.float32), 1.0
    span = float(levels[-1])
    steepness = np.interp(np.linspace(0, span, NOISE_STEPS), levels, np.gradient(levels))
    return ((sds[:, None] ** 2 + 1 / 12) * steepness**2).astype(np.float32), span
