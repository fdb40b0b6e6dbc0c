"""Depth at the edges of one view or more: each view's edges measured, drawn, and combined by precision."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.edges.measure import Edges, average_segments, measure_edges
from focalgradient.depth.noise import noise_from_differences
from focalgradient.depth.registration import Placement
from focalgradient.depth.search import Estimate, Problem, Search, one_focus
from focalgradient.depth.validity import BLUR_ERROR, SECONDARY_MINIMUM
from focalgradient.optics import capabilities

__all__ = ["estimate"]


def estimate(problem: Problem) -> Estimate:
    """Estimate depth along edges, for `focalgradient.recover_depth`.

    Each view is measured by itself, in bands twice the window long. Its segments, averaged, are drawn three pixels
    wide, and only there is the map valid. Where several views show an edge, they are combined by precision. Views of
    one plane of focus leave the side of it open, and the one stated is taken; views of several decide it where they
    agree on one side only.
    """
    views, search, settings = problem.views, problem.search, problem.settings
    given = settings.given_noise(len(views))
    sides = _sides(search)
    drawn, points, valid_points = [], 0, 0
    for number, view in enumerate(views):
        if view.optics.aperture_diameter == 0:
            continue  # a pinhole's edges are sharp at every distance
        settings.progress(0.2 + 0.7 * number / len(views), f"measuring the edges of view {number + 1}")
        edges = measure_edges(
            view.image,
            psf=settings.shape,
            noise=None if given is None else float(given[number]),
            length=2 * settings.window,
            false_alarm=settings.false_alarm,
            mask=view.mask,
        )
        points, valid_points = points + len(edges.valid), valid_points + int(edges.valid.sum())
        drawn.append(_measured(problem, number, edges, sides))

    pixels = np.unique(np.concatenate([at for at, *_ in drawn]))
    measured = np.zeros((len(drawn), len(sides), len(pixels)))
    sd, error = np.full((len(drawn), len(pixels)), np.inf), np.zeros((len(drawn), len(pixels)))
    for number, (pixel, *values) in enumerate(drawn):
        at = np.searchsorted(pixels, pixel)
        measured[number][:, at], sd[number, at], error[number, at] = values
    found, found_sd, unambiguous, agree = _combine(measured, sd, error, search, settings.false_alarm)

    shape = problem.registered.shape
    vergence = np.full(shape, (search.lowest + search.highest) / 2, np.float32)
    vergence_sd = np.full(shape, search.highest - search.lowest, np.float32)
    valid, side_known = np.zeros(shape, np.bool_), np.full(shape, search.side_known)
    vergence.flat[pixels], vergence_sd.flat[pixels] = found, found_sd
    valid.flat[pixels] = unambiguous & agree & problem.registered.usable.flat[pixels]
    side_known.flat[pixels] &= unambiguous
    return Estimate(
        vergence,
        vergence_sd,
        valid,
        noise=[noise_from_differences(view.image, view.mask) for view in views] if given is None else given.tolist(),
        side_known=side_known,
        details={"edge_points": points, "share_of_edge_points_valid": valid_points / max(points, 1)},
    )


OWN_BLUR, CALIBRATED = 1.0, 0.5
"""Edge width (sigma, pixels) up to which a camera's own blur, which varies over the frame, cannot be distinguished from
defocus, so that depth is invalid: if that blur is known to one squared pixel (`calibration.Priors`), and with a
calibration. With the latter, cards with a blur of 0.6 pixels are accurate to 5 % (`tests/test_cli_demo.py`)."""


def _measured(
    problem: Problem, number: int, edges: Edges, sides: FloatArray
) -> tuple[NDArray[np.intp], FloatArray, FloatArray, FloatArray]:
    """Measure the vergences that edges of one view may have, on either of the `sides` of focus.

    Returns the flat indices of P pixels of the first view, the vergences (sides x P, D), their sd, and the error of the
    blur's model.
    """
    view, settings = problem.views[number], problem.settings
    placement = Placement(problem.views[0].pixel_angle / view.pixel_angle)
    if settings.align:
        placement = placement.then(problem.registered.placements[number])
    averaged = average_segments(edges, 2 * settings.window)
    pixel, point = _drawn(averaged, placement, view.shape)
    whole, whole_sd = averaged.radius[point], averaged.radius_sd[point]
    per_pixel = 2 * view.pixel_angle / view.optics.aperture_diameter  # dioptres per pixel of radius
    per_sigma = settings.shape.sd_per_radius
    # The residual blur variance of a calibrated camera (negative where it sharpens); of an eye none is known.
    residual = capabilities(view.optics).residual_blur_variance / (view.pixel_angle * per_sigma) ** 2
    radius = np.sqrt(np.maximum(whole**2 - residual, 0.0))
    stated = capabilities(view.optics)
    if stated.focus_tolerance or stated.aperture_tolerance or residual:  # a camera, whose own blur is not known exactly
        seen = radius * per_sigma > (CALIBRATED if residual else OWN_BLUR)
        pixel, whole, whole_sd, radius = (values[seen] for values in (pixel, whole, whole_sd, radius))
    steeper = whole / np.maximum(radius, 0.1 * whole + 1e-9) if residual else 1.0
    defocus, sd = per_pixel * radius, per_pixel * whole_sd * steeper
    return pixel, view.optics.focus_vergence + sides[:, None] * defocus, sd, BLUR_ERROR * defocus


def _sides(search: Search) -> FloatArray:
    """Return the signs that defocus may have in vergence: -1 beyond focus, +1 nearer."""
    if not one_focus(search.focus):
        return np.array([-1.0, 1.0])
    nearer = search.lowest >= search.focus[0] and search.highest > search.focus[0]
    return np.array([1.0 if nearer else -1.0])


def _drawn(edges: Edges, placement: Placement, shape: tuple[int, int]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return flat indices of the first view's pixels within one pixel of a valid point, and the point of each."""
    middle_row, middle_column = (shape[0] - 1) / 2, (shape[1] - 1) / 2
    row = np.rint(middle_row + (edges.row - middle_row - placement.down) / placement.scale).astype(np.intp)
    column = np.rint(middle_column + (edges.column - middle_column - placement.right) / placement.scale).astype(np.intp)
    owner = np.full(shape, -1, np.intp)
    # The nearest last, so that a pixel goes to the contour that runs through it.
    for away in (2, 1, 0):
        for down, right in ((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if abs(i) + abs(j) == away):
            i, j = row + down, column + right
            inside = np.flatnonzero(edges.valid & (i >= 0) & (j >= 0) & (i < shape[0]) & (j < shape[1]))
            owner[i[inside], j[inside]] = inside
    pixel = np.flatnonzero(owner >= 0)
    return pixel, owner.ravel()[pixel]


def _combine(
    measured: FloatArray, sd: FloatArray, error: FloatArray, search: Search, false_alarm: float
) -> tuple[FloatArray, FloatArray, Mask, Mask]:
    """Combine n views' measurements to a vergence at P pixels (`measured`, n x sides of focus x P, in dioptres).

    `sd` is their standard deviation from noise (n x P), infinite where a view shows no edge, and `error` that of
    the model. Returns vergence, its standard deviation, whether it is unambiguous, and whether the views
    agree on it.
    """
    total_sd = np.hypot(sd, error)
    slack = 3 * sd[:, None]
    possible = (measured >= search.lowest - slack) & (measured <= search.highest + slack) & np.isfinite(slack)
    # Every measurement is a candidate; each view supports it by that side of its own that comes nearest.
    views, sides, count = measured.shape
    candidates, own = measured.reshape(views * sides, count), np.repeat(total_sd, sides, axis=0)
    away = np.abs(measured[:, :, None] - candidates)
    cost = ((away.min(axis=1) / total_sd[:, None]) ** 2).sum(axis=0)
    cost = np.where(possible.reshape(candidates.shape), cost, np.inf)
    best = np.argmin(cost, axis=0)
    at = (best, np.arange(len(best)))
    apart = np.abs(candidates - candidates[at]) > 3 * np.hypot(own, own[at])
    unambiguous = np.isfinite(cost[at]) & ~(apart & (cost < cost[at] + SECONDARY_MINIMUM)).any(axis=0)
    chosen = np.take_along_axis(measured, away[:, :, at[0], at[1]].argmin(axis=1)[:, None], axis=1)[:, 0]
    weight = sd**-2.0
    vergence = (weight * chosen).sum(axis=0) / weight.sum(axis=0)
    others = np.maximum(np.isfinite(sd).sum(axis=0) - 1.0, 1.0)
    agree = chdtrc(others, (((chosen - vergence) / total_sd) ** 2).sum(axis=0)) >= false_alarm
    return np.clip(vergence, search.lowest, search.highest), weight.sum(axis=0) ** -0.5, unambiguous, agree
