"""Errors that a whole depth map shares: focus, its course over the field, and apertures, known to a tolerance only.

An error of the focus or of the apertures moves every pixel together, so that the order of depth stays sharp where
distance does not; an error of the focus over the field (curvature, tilt) moves distant places apart. Blur gives the
difference of the views' squared blur radii, (A/2)^2 (V_f - V)^2; to first order an error of a V_f or of A moves the
vergence V by what keeps that difference. The result is a set of independent modes, each the change of vergence at one
standard deviation of something unknown, z ~ N(0, 1). A point of measured distance observes their sum at its place, with
the error of the pixels there and of the tape; the conditional mean of z corrects the map, and its covariance is what
remains uncertain. One point takes away the focus' error, two the scale's as well.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import FocalGradientWarning, InputError, described, is_number
from focalgradient.optics import Optics, capabilities
from focalgradient.view import from_centre

if TYPE_CHECKING:
    from focalgradient.depth.depth_map import DepthMap

__all__ = [
    "CORNERS",
    "KnownPoint",
    "checked_points",
    "common_modes",
    "field_modes",
    "modes_of_optics",
    "spread_over",
    "stated_parts",
    "with_known_points",
]


CORNERS = "field_at_the_corners"
"""Name of the part of the errors that is largest at the corners of the frame, where it is stated."""

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
    share them, however many foci: only flat sheets (`calibrate`) distinguish them from a curved or slanted scene.

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
    return parts | ({CORNERS: corner} if corner else {})


def _column(values: FloatArray, dimensions: int) -> FloatArray:
    return values.reshape(-1, *[1] * dimensions)


def _compared(squares: FloatArray) -> FloatArray:
    """Return the squared blur radii as measured: of one view itself, or of views less the first."""
    return squares if len(squares) == 1 else squares[1:] - squares[:1]


KnownPoint = tuple[float, float, float]
"""Column and row (pixels, from the centre of the first), and distance (m)."""

POINT_REACH = 8.0
"""Radius in pixels around a point within which its depth is averaged with Gaussian weights, whose standard deviation is
half of it. Chosen by hand: the default window."""

FARTHEST_READ = 4.0
"""Maximum distance of a point from the nearest valid depth, in `POINT_REACH`: farther away hardly any surface goes on
unchanged (our choice)."""

CONTAINS_SDS = 3.0
"""Maximum difference between a point's vergence and that of the nearest surface with depth, in standard deviations with
all errors, for this surface to contain the point: a test at 0.3 %."""

TAPE = 0.005
"""Standard deviation of a distance measured by tape: this many metres, or this proportion of the distance, whichever is
larger (our choice)."""

CONTRADICTION = 0.001
"""Probability below which points contradict the stated optics: as for `false_alarm`."""


def checked_points(
    points: Iterable[KnownPoint], near: float | None = None, far: float | None = None
) -> list[KnownPoint]:
    """Return points as a list; raise `InputError` unless each is a column, a row and a distance in the range searched.

    >>> checked_points([(320, 200, 2.31)])
    [(320.0, 200.0, 2.31)]
    """
    found = []
    if not isinstance(points, Iterable):
        raise InputError(f"known_points is {described(points)}, but must be a list of (column, row, distance).")
    for point in points:
        one = tuple(point) if isinstance(point, Sequence | np.ndarray) and not isinstance(point, str) else ()
        if len(one) != 3 or not all(is_number(value) for value in one):
            raise InputError(f"known point {point!r} must be a column and a row in pixels and a distance in metres.")
        if not one[2] > 0:
            raise InputError(f"known point {point!r} has a distance of {one[2]:g} m, but it must be positive.")
        if not (near or 0) <= one[2] <= (far or math.inf):
            raise InputError(
                f"known point {point!r} is {one[2]:g} m away, but depth is searched from {near or 0:g} to "
                f"{far or math.inf:g} m: give its distance in metres, or change near and far."
            )
        found.append((float(one[0]), float(one[1]), float(one[2])))
    return found


def with_known_points(depth: DepthMap, points: Iterable[KnownPoint]) -> DepthMap:
    """Return a map that agrees with measured points, as far as what all pixels share in error lets it.

    Parameters
    ----------
    depth
        Its ``common_errors`` are the priors: a map without them cannot be moved.
    points
        Each a column and a row (pixels) and a distance (m) from the plane that the map's distances count from.

    Returns
    -------
    DepthMap
        ``details["known_points"]`` gives for each point its distance as recovered before and after.

    Raises
    ------
    InputError
        If a point lies outside of the map, or no surface with valid depth near it may contain it, or the map states no
        common error.

    Warns
    -----
    FocalGradientWarning
        If the points contradict the stated optics beyond their tolerance.

    Examples
    --------
    A wall read at 2 D, its focus known to 0.1 D, is measured to be 0.48 m away:

    >>> from focalgradient import DepthMap
    >>> flat = np.full((32, 32), 2.0)
    >>> wall = DepthMap(flat, 0.001 * flat, flat > 0, flat > 0, common_errors=0.1 * np.ones((1, 32, 32)))
    >>> tied = with_known_points(wall, [(16, 16, 0.48)])
    >>> round(float(tied.distance[0, 0]), 3), round(float(tied.common_sd[0, 0]), 3)
    (0.481, 0.021)
    """
    chosen = checked_points(points)
    if not chosen:
        return depth
    modes = np.asarray(depth.common_errors, float)
    if depth.details.get("order_only"):
        raise InputError("known points need the focus distances, but only the order of depth is known: state them.")
    if not len(modes):
        raise InputError(
            "known points correct what all pixels share in error, but the optics are stated to be exact: give the "
            "tolerance of focus and aperture (focus_tolerance, aperture_tolerance)."
        )
    from scipy.special import chdtrc  # not needed to import the package

    read, sd, effect, away = zip(*(_read(depth, modes, point) for point in chosen), strict=True)
    optical = np.array([distance + depth.offset for _, _, distance in chosen])
    if not (optical > 0).all():
        raise InputError("a known point lies behind the entrance pupil: check its distance and its plane.")
    tape = np.maximum(TAPE, TAPE * optical) / optical**2
    design = np.array(effect)  # points x modes
    error = np.diag(np.array(sd) ** 2 + tape**2)
    off = 1 / optical - np.array(read)
    total = design @ design.T + error
    gain = design.T @ np.linalg.inv(total)
    moved = gain @ off
    remains = np.eye(len(modes)) - gain @ design
    if chdtrc(len(chosen), float(off @ np.linalg.solve(total, off))) < CONTRADICTION:
        warnings.warn(
            "the known points contradict the stated optics: they differ from the depth recovered by "
            f"{', '.join(f'{value:+.2g} D' for value in off)}, beyond the tolerance of focus and aperture and the "
            "noise; check distances, pixels, focus distance and f-numbers.",
            FocalGradientWarning,
            stacklevel=3,
        )
    values, vectors = np.linalg.eigh(remains)
    root = vectors * np.sqrt(np.maximum(values, 0))
    vergence = depth.vergence + np.tensordot(moved, modes, 1)
    left = np.tensordot(root.T, modes, 1)
    details: dict[str, Any] = {
        "known_points": [
            {
                "column": x,
                "row": y,
                "distance_m": m,
                "recovered_vergence_D": value,
                "measured_vergence_D": 1 / at,
                "recovered_sd_D": error,
                "read_px_away": pixels,
            }
            for (x, y, m), value, at, error, pixels in zip(chosen, read, optical.tolist(), sd, away, strict=True)
        ]
    }
    common = np.sqrt((left**2).sum(axis=0))
    if depth.valid.any():
        details["common_sd_D"] = {"left_by_the_known_points": float(np.median(common[depth.valid]))}
    return replace(
        depth,
        vergence=vergence.astype(depth.vergence.dtype),
        common_errors=left.astype(np.float32),
        details=depth.details | details,
    )


def _read(depth: DepthMap, modes: Any, point: KnownPoint) -> tuple[float, float, Any, float]:
    """Return vergence recovered about a point, its standard deviation, each mode's change of it, and its distance (px).

    Where nothing is valid at the point, the nearest valid depth stands for it, with the scatter of depth about there as
    far as the point is away.
    """
    x, y, metres = point
    height, width = depth.shape
    if not (-0.5 <= x <= width - 0.5 and -0.5 <= y <= height - 0.5):
        raise InputError(
            f"known point ({x:g}, {y:g}) lies outside of the picture of {width} x {height} pixels: give its column and "
            "row, counted from the upper left."
        )
    where = f"known point ({x:g}, {y:g}) lies where no pixel has a valid depth"
    rows, columns = np.nonzero(depth.valid)
    away = np.hypot(rows - y, columns - x)
    if not away.size:
        raise InputError(f"{where}, as nowhere in the map: {_POINT_AT}.")
    nearest = int(np.argmin(away))
    gap, place = float(away[nearest]), f"({columns[nearest]}, {rows[nearest]})"
    is_beside = gap > POINT_REACH
    if is_beside:
        away = np.hypot(rows - rows[nearest], columns - columns[nearest])
    vergence, own_sd = depth.vergence[rows, columns].astype(float), depth.vergence_sd[rows, columns].astype(float)
    near = away <= POINT_REACH
    weight = np.where(near, np.exp(-((away / POINT_REACH * 2) ** 2) / 2) / np.maximum(own_sd, 1e-9) ** 2, 0.0)
    weight /= weight.sum()
    read = float(weight @ vergence)
    # Pixels within a window err alike, so their mean has the standard deviation of one of them.
    sd = float(np.sqrt(weight @ own_sd**2))
    effect = np.array([float(weight @ mode[rows, columns]) for mode in modes])
    if not is_beside:
        return read, sd, effect, 0.0
    # A surface goes on as it varies about its end, over the distance to the point.
    varies = float(np.sqrt(np.mean((vergence[away <= gap] - read) ** 2)))
    shared = float(np.linalg.norm(effect))
    if gap > FARTHEST_READ * POINT_REACH or varies > shared:
        raise InputError(
            f"{where}; the nearest that has is {place}, {gap:.0f} pixels away, where depth varies by {varies:.2g} D "
            f"over that distance, too much to correct an error of {shared:.2g} D: {_POINT_AT}."
        )
    sd = float(np.hypot(sd, varies))
    optical = metres + depth.offset
    tape = max(TAPE, TAPE * optical) / optical**2
    off = 1 / optical - read
    if abs(off) > CONTAINS_SDS * np.sqrt(sd**2 + shared**2 + tape**2):
        raise InputError(
            f"{where}, and the nearest surface that has, at {place}, lies at "
            f"{1 / max(read, 1e-6) - depth.offset:.3g} m, which is not where the point was measured: {_POINT_AT}."
        )
    return read, sd, effect, gap


_POINT_AT = "point at a textured surface that the map shows as valid, and measure its distance"
