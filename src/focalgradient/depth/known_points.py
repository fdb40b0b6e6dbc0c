"""Points of measured distance, which correct the error that all pixels of a depth map share.

The errors that all pixels share are independent modes z ~ N(0, 1), each a change of vergence over the map
(`DepthMap.common_errors`). A measured point observes their sum at its place, with the error of the pixels there and of
the tape; the conditional mean of z corrects the map, and its covariance is what remains uncertain. One point takes
away the focus' error, two the scale's as well.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from focalgradient.errors import FocalGradientWarning, InputError, described, is_number

if TYPE_CHECKING:
    from focalgradient.depth.depth_map import DepthMap

__all__ = ["KnownPoint", "checked_points", "with_known_points"]

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


def checked_points(points: Iterable[KnownPoint]) -> list[KnownPoint]:
    """Return points as a list; raise `InputError` unless each is a column, a row and a positive distance.

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
    # Pixels within a window err alike, so their mean is no more accurate than each.
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
