"""The real-time form: detail of the large-aperture view over detail of the small (Pentland 1987, III.B-C, Fig. 5).

The Laplacian of each view is averaged over 4 x 4 pixels and divided by the local brightness; the two views' ratio is
the *focal disparity*, 1 in the plane of focus and falling with blur. Depth follows by a table
(`focalgradient.depth.ratio.table`).

Four things differ from the paper, all on purpose. The average is of the *square* of the Laplacian, and the disparity
is the root of the ratio: noise then adds a known amount, which is subtracted, where it cannot be taken out of an
average of sizes (``absolute=True`` gives the paper's). The Gaussian that gives the local brightness runs over the means
of 4 x 4 pixels, not over pixels: a box and a Gaussian are a Gaussian wider by 1.25 square pixels. And the second
difference may be taken between means over 2 x 2, 4 x 4 or 8 x 8 pixels: the finest detail is the first that blur takes,
and a band is best where the larger aperture has taken part of it and not all. And depth comes from all bands at once,
whose energies scatter together (`focalgradient.depth.ratio.likelihood`), so that the others account
for much of the chance in one ratio.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import minimum_filter
from scipy.special import gammaincinv

from focalgradient.arrays import Mask
from focalgradient.depth.filters import Image
from focalgradient.depth.ratio import energies
from focalgradient.depth.ratio.energies import BLOCK, StoredImage
from focalgradient.depth.ratio.likelihood import energy_covariance, likeliest_defocus
from focalgradient.depth.ratio.table import BANDS, DisparityTable
from focalgradient.depth.search import Search
from focalgradient.depth.settings import WINDOW
from focalgradient.depth.validity import blur_is_known
from focalgradient.errors import InputError
from focalgradient.psf import Psf

__all__ = ["detail", "focal_disparity", "on_grid", "read_depth", "table_for"]

BRIGHTNESS = 8.0
"""Standard deviation in pixels of the Gaussian that measures local brightness: the default window."""

LEAST_DETAIL = 0.01
"""Minimum root mean square Laplacian of the sharper view, relative to brightness, for an estimate. Chosen by hand."""

INEXPLICABLE = 33.0
"""Squared distance of the energies from their expectation, relative to their variance, above which no defocus explains
them: probability 1e-5 by chance."""

USUAL = 0.5
"""Usual median of the squared distance over a frame, relative to that of chi-square: 0.27 to 0.48 for 1/f textures with
correct optics, up to 1.1 for one twice as coarse, 5 for a photographed sheet. The excess is attributed to the model."""

KNOWN = 0.2
"""Maximum relative standard deviation of a blur radius: a fifth is sufficient for video; other methods require a tenth.
"""

COARSE_WINDOW = 8.0
"""Window in pixels above which depth is computed for squares of 8 x 8 pixels and repeated; limits the time. Chosen by
hand."""

NOISE_STEPS = 1024
"""Number of brightness levels at which the noise of stored values is computed: four per 8-bit step."""


def focal_disparity(
    small: StoredImage,
    large: StoredImage,
    *,
    noise: float | Sequence[float] = 0.0,
    band: int = 1,
    window: float = 0.0,
    levels: ArrayLike | None = None,
    absolute: bool = False,
    least: float = LEAST_DETAIL,
    usable: Mask | None = None,
) -> tuple[Image, Mask]:
    """Return the focal disparity of two views that differ in aperture alone, on a grid of 4 x 4 pixels (Fig. 5c).

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
    disparity, valid
        floor(H/4) x floor(W/4), float32 and bool. The disparity is 0 where it is not valid: where the small-aperture
        view has less detail than `least`, or less than three times the noise, or hardly a usable pixel.

    Raises
    ------
    InputError
        If the views differ in size or type, or a setting is out of range.

    Examples
    --------
    A checkerboard whose contrast blur halves has a focal disparity of a half.

    >>> board = (np.indices((64, 64)).sum(axis=0) % 2).astype(np.float32)
    >>> disparity, valid = focal_disparity(1 + 0.5 * board, 1.125 + 0.25 * board)
    >>> disparity.shape, round(float(disparity[8, 8]), 3), bool(valid.all())
    ((16, 16), 0.5, True)
    """
    images = [small, large]
    table = _checked(images, levels)
    if band not in BANDS:
        raise InputError(f"band is {band!r}, but must be one of {', '.join(map(str, BANDS))} pixels.")
    if window:
        WINDOW.check("window", window)
    energy, brightness = _content(images, table, (band,), BLOCK, window, absolute, usable)
    # Second differences of means over band x band pixels; the mean size of a normal value is sqrt(2 / pi) of its sd.
    unit = 20.0 / band**2 * (2 / math.pi if absolute else 1.0)
    variance, span = _noise_by_brightness(noise, table)
    disparity, valid = energies.compared(energy[0], brightness, np.float32(unit) * variance, span, least)
    if usable is not None and not usable.all():
        valid &= _squares(usable, BLOCK)
        disparity[~valid] = 0
    return disparity, valid


def read_depth(
    small: StoredImage,
    large: StoredImage,
    table: DisparityTable,
    search: Search,
    *,
    noise: float | Sequence[float] = 0.0,
    window: float = 8.0,
    levels: ArrayLike | None = None,
    least: float = LEAST_DETAIL,
    usable: Mask | None = None,
) -> tuple[Image, Image, Mask]:
    """Depth on the grid of 4 x 4 pixels, from all of a table's bands, each weighted by its information there.

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
    grid = 2 * BLOCK if window >= COARSE_WINDOW else BLOCK
    energy, brightness = _content(images, decode, table.bands, grid, window, usable=usable)
    variance, span = _noise_by_brightness(noise, decode)
    covariance = energy_covariance(table, window)
    size, sd, misfit = likeliest_defocus(energy, brightness, variance, span, table.defocus, covariance, least)
    focus = float(search.focus[0])
    vergence = np.float32(focus) + (size if search.lowest >= focus else -size)
    inside = np.clip(vergence, np.float32(search.lowest), np.float32(search.highest))
    within = np.abs(vergence - inside) <= 2 * sd
    radius = search.slope * np.abs(focus - inside)
    valid = within & blur_is_known(sd * search.slope, radius, KNOWN) & (misfit < INEXPLICABLE)
    # An error of the model widens the sd, but makes no pixel invalid.
    sd *= _beyond_chance(misfit[np.isfinite(sd)], 2 * len(table.bands) - 2)
    sd = np.minimum(sd, np.float32(search.highest - search.lowest))
    shape, times = tuple(n // BLOCK for n in small.shape), grid // BLOCK
    valid = on_grid(valid, shape, times)
    if usable is not None and not usable.all():
        valid &= _squares(usable, BLOCK)
    return on_grid(inside, shape, times), on_grid(sd, shape, times), valid


def _beyond_chance(misfit: Image, freedom: int) -> np.float32:
    """Return the excess of the bands' differences over that expected of texture, over the frame: 1 if none."""
    if not misfit.size:
        return np.float32(1)
    by_chance = USUAL * 2 * gammaincinv(freedom / 2, 0.5)  # the median of chi-square
    return np.float32(max(1.0, float(np.median(misfit)) / by_chance) ** 0.5)


def table_for(search: Search, psf: Psf | str, k: float | None = None) -> DisparityTable:
    """Return the table of the optics, a quarter wider than the search, so that its limits lie within the table."""
    reach = 1.25 * max(abs(search.focus[0] - search.lowest), abs(search.focus[0] - search.highest))
    return DisparityTable.of(search.optics, search.pixel_angle, reach=reach, psf=psf, k=k)


def detail(image: StoredImage, levels: ArrayLike | None = None) -> float:
    """High-frequency content of a whole view: its root mean square Laplacian over its root mean square brightness.

    >>> board = (np.indices((64, 64)).sum(axis=0) % 2).astype(np.float32)
    >>> round(detail(1 + 0.1 * (board - 0.5)), 2)  # 4 x 0.1, and a little less at the frame's edges
    0.39
    """
    energy, brightness = energies.energies([image], _checked([image, image], levels), BLOCK, False)
    light = float(np.mean(brightness**2))
    return math.sqrt(float(energy.mean()) / light) if light > 0 else 0.0


def _content(
    images: Sequence[StoredImage],
    levels: Image | None,
    bands: Sequence[int],
    grid: int,
    window: float,
    absolute: bool = False,
    usable: Mask | None = None,
) -> tuple[Image, Image]:
    """Energy of both views in each of `bands` (b x 2 x h x w) and their brightness (2 x h x w), gathered.

    The grid is of squares of `grid` pixels, 4 or 8. The Gaussians together with these squares have the variances asked.
    """
    shape = tuple(n // BLOCK // (grid // BLOCK) for n in images[0].shape)
    weight = None if usable is None or usable.all() else _weight(usable, max(bands), grid)
    found: list[Image] = []
    brightness: Image | None = None
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


def _weight(usable: Mask, coarsest: int, grid: int) -> Image:
    """Return 1 for squares of `grid` pixels away from unusable pixels by the reach of differences; 0 for others."""
    return np.asarray(minimum_filter(_squares(usable, grid), 1 + 2 * math.ceil(2 * coarsest / grid)), np.float32)


def _squares(usable: Mask, side: int) -> Mask:
    """Return whether each square of `side` pixels has only usable pixels."""
    rows, columns = (n // BLOCK // (side // BLOCK) for n in usable.shape)
    by_rows = usable[: side * rows, : side * columns].reshape(rows, side, side * columns).all(axis=1)
    return np.asarray(by_rows.reshape(rows, columns, side).all(axis=2))


def _gathered(planes: Image, sd: float, grid: int, weight: Image | None) -> Image:
    """Return Gaussian means of `planes` (n x h x w), of `sd` pixels, with `weight` (h x w); 0 far from all weight."""
    steps = math.sqrt(sd**2 - grid**2 / 12) / grid
    if weight is None:
        return energies.smoothed(planes, steps)
    support = energies.smoothed(weight[None], steps)
    return np.where(support > 0.05, energies.smoothed(planes * weight, steps) / np.maximum(support, 0.05), 0)


def _fitted(planes: Image, shape: tuple[int, ...]) -> Image:
    """Resample `planes` to a grid of `shape` that is twice as coarse, twice as fine, or equal."""
    if planes.shape[1] > shape[0]:
        return np.stack(energies.binned(planes, None))
    return planes if planes.shape[1:] == shape else on_grid(planes, shape, 2)


def on_grid(planes: NDArray[Any], shape: tuple[int, ...], times: int) -> NDArray[Any]:
    """Repeat values over squares of `times` x `times` of a grid (... x h x w), extended to `shape` by the outermost."""
    rows, columns = (np.minimum(np.arange(n) // times, m - 1) for n, m in zip(shape, planes.shape[-2:], strict=True))
    return np.asarray(planes[..., rows, :][..., columns])


def _checked(images: Sequence[StoredImage], levels: ArrayLike | None) -> Image | None:
    """Return the table that decodes stored values, or None for linear radiance; refuse what cannot be compared."""
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


def _noise_by_brightness(noise: float | Sequence[float], levels: Image | None) -> tuple[Image, float]:
    """Variance of either view's noise in linear radiance, at even steps of brightness up to a span (2 x steps)."""
    sds = np.broadcast_to(np.asarray(noise, float), 2)
    if not np.all((sds >= 0) & np.isfinite(sds)):
        raise InputError(f"noise is {noise!r}, but must be 0 or a positive number, or one for each view.")
    if levels is None:
        return (sds[:, None] ** 2).astype(np.float32), 1.0
    span = float(levels[-1])
    steepness = np.interp(np.linspace(0, span, NOISE_STEPS), levels, np.gradient(levels))
    return ((sds[:, None] ** 2 + 1 / 12) * steepness**2).astype(np.float32), span
