"""Errors that a whole depth map shares: focus, its course over the field, and apertures, known to a tolerance only.

An error of the focus or of the apertures moves every pixel together, so that the order of depth stays sharp where
distance does not; an error of the focus over the field (curvature, tilt) moves distant places apart. Blur gives the
difference of the views' squared blur radii, (A/2)^2 (V_f - V)^2; to first order an error of a V_f or of A moves the
vergence V by what keeps that difference. The result is a set of independent modes, each the change of vergence at one
standard deviation of something unknown.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.optics import Optics, capabilities
from focalgradient.view import from_centre

__all__ = ["common_modes", "field_modes", "modes_of_optics", "spread_over", "stated_parts"]

FloatArray = NDArray[np.float64]

LEVELS = 64
"""Number of vergences at which the modes are computed; they vary smoothly between these. Chosen by hand."""

NEGLIGIBLE = 1e-4
"""Proportion of the total variance below which a mode is omitted: 1 % of a standard deviation. Chosen by hand."""

FOCUS_DISTANCE = 1e-3
"""Distance in dioptres from exact focus at which the sensitivity of vergence is evaluated where blur is stationary to
first order. Chosen by hand: far below any depth of focus."""


def modes_of_optics(vergence: ArrayLike, optics: Sequence[Optics], by_blur: bool = True) -> dict[str, FloatArray]:
    """Return how errors of the views' optics move a vergence, one entry for each uncertain quantity.

    Parameters
    ----------
    vergence
        As recovered, D; any shape.
    optics
        Of each view: `focus_tolerance` and `aperture_tolerance`, relative standard deviations of focus vergence and
        aperture. Views of one focus share its error; all apertures share one. One view: its blur was measured by
        itself; more: they were compared.
    by_blur
        Whether depth follows from blur; if not, from the sharpest focus alone.

    Returns
    -------
    dict
        For each uncertain quantity the change of vergence (D) at one standard deviation, K x the shape of `vergence`.

    Examples
    --------
    >>> from focalgradient.optics import Lens
    >>> pair = [Lens(0.05, n, 1.0, focus_tolerance=0.1, aperture_tolerance=0.05) for n in (16, 4)]
    >>> {name: modes.round(3).tolist() for name, modes in modes_of_optics([0.5, 1.2], pair).items()}
    {'focus': [[0.1, 0.1]], 'apertures': [[0.025, -0.01]]}
    """
    at = np.asarray(vergence, float)
    stated = [capabilities(one) for one in optics]
    focus = np.array([one.focus_vergence for one in optics], float)
    found: dict[str, FloatArray] = {}
    if not by_blur:
        tolerance = max(one.focus_tolerance for one in stated)
        return {"focus": tolerance * at[None]} if tolerance > 0 else {}
    aperture = np.array([one.aperture_diameter for one in optics], float)
    if len(set(zip(focus.tolist(), aperture.tolist(), strict=True))) == 1:  # halves of one pupil: displacement is blur
        focus, aperture, stated = focus[:1], aperture[:1], stated[:1]
    square = _column(aperture**2, at.ndim)
    defocus = _column(focus, at.ndim) - at
    if len(set(focus)) == 1:  # where blur does not change to first order, what follows beside it is taken
        defocus = np.where(np.abs(defocus) < FOCUS_DISTANCE, FOCUS_DISTANCE, defocus)
    rate = square * defocus  # of a squared diameter by its focus, halved
    slope = _compared(rate)
    least = (FOCUS_DISTANCE * _compared(square + 0 * defocus) ** 2).sum(axis=0) * FOCUS_DISTANCE
    gain = slope / np.maximum((slope**2).sum(axis=0), np.maximum(least, 1e-300))
    modes = []
    for value in dict.fromkeys(focus.tolist()):
        tolerance = max(one.focus_tolerance for one, own in zip(stated, focus, strict=True) if own == value)
        if tolerance * value > 0:
            moved = _compared(_column((focus == value).astype(float), at.ndim) * rate)
            modes.append(tolerance * value * (gain * moved).sum(axis=0))
    if modes:
        found["focus"] = np.stack(modes)
    tolerance = max(one.aperture_tolerance for one in stated)
    if tolerance > 0 and aperture.any():
        found["apertures"] = (tolerance * (gain * _compared(rate * defocus)).sum(axis=0))[None]
    return found


def common_modes(vergence: NDArray[np.floating], optics: Sequence[Optics], by_blur: bool = True) -> NDArray[np.float32]:
    """Return the independent modes of a map (H x W, D), K x H x W: those of `modes_of_optics`, and of the field."""
    low, high = float(vergence.min()), float(vergence.max())
    levels = np.linspace(low, high + 1e-3, LEVELS)
    parts = list(modes_of_optics(levels, optics, by_blur).values())
    spread = spread_over(vergence, levels, np.concatenate(parts) if parts else np.zeros((0, LEVELS)))
    height, width = vergence.shape
    return np.concatenate([spread, field_modes((height, width), optics)])


def field_modes(shape: tuple[int, int], optics: Sequence[Optics]) -> NDArray[np.float32]:
    """Return the change of a map (D) by curvature and tilts of the surface in focus, 3 x H x W; 0 x H x W if flat.

    Curvature and tilt are independent normal errors with the standard deviation ``field_sd`` at the corners: the
    curvature increases with the square of the distance from the centre, the tilts with x and y. The views of one lens
    share them, however many foci: they cannot be told from a curved or slanted scene, but by flat sheets (`calibrate`).

    Examples
    --------
    >>> from focalgradient.optics import Lens
    >>> curvature, tilt_x, tilt_y = field_modes((3, 3), [Lens(0.05, 2, 1.0, field_tolerance=0.0125)])
    >>> [round(float(sd), 3) for sd in (*curvature[0], tilt_x[0, 0], tilt_y[1, 0])]
    [0.25, 0.125, 0.25, -0.177, 0.0]
    """
    sd = max(capabilities(lens).field_sd for lens in optics)
    if sd == 0:
        return np.zeros((0, *shape), np.float32)
    half = math.hypot(*(n - 1 for n in shape)) / 2
    x, y = ((way / max(half, 0.5)).astype(np.float32) for way in from_centre(shape))
    modes = np.empty((3, *shape), np.float32)
    modes[0] = sd * (x**2 + y**2)
    modes[1], modes[2] = sd * x, sd * y
    return modes


def spread_over(vergence: NDArray[np.floating], levels: FloatArray, modes: FloatArray) -> NDArray[np.float32]:
    """Return modes that depend on vergence alone, given at `levels` (K x L), at every pixel of a map.

    The modes are rotated into principal ones, of which the few that count are kept: their joint distribution stays.
    """
    if modes.shape[0] > 1:
        _, sizes, principal = np.linalg.svd(modes, full_matrices=False)
        modes = (sizes[:, None] * principal)[sizes**2 > NEGLIGIBLE * (sizes**2).sum()]
    spread = [np.interp(vergence, levels, mode) for mode in modes]
    return np.array(spread, np.float32).reshape(-1, *vergence.shape)


def stated_parts(vergence: float, optics: Sequence[Optics], by_blur: bool = True) -> dict[str, float]:
    """Return the standard deviation (D) that each uncertain quantity gives to one `vergence`, by its name."""
    parts = {
        name: float(np.sqrt((modes**2).sum())) for name, modes in modes_of_optics(vergence, optics, by_blur).items()
    }
    corner = float(np.hypot.reduce(field_modes((2, 2), optics)[:, 0, 0]))
    return parts | ({"field_at_the_corners": corner} if corner else {})


def _column(values: FloatArray, dimensions: int) -> FloatArray:
    return values.reshape(-1, *[1] * dimensions)


def _compared(squares: FloatArray) -> FloatArray:
    """Return the squared blur radii as measured: of one view itself, or of views less the first."""
    return squares if len(squares) == 1 else squares[1:] - squares[:1]
