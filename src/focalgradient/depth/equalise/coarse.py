"""Depth of compressed views from coarse detail: from views of half the size, joined with that of fine detail.

JPEG leaves less of fine detail, and less still of the blurred: depth of compressed views is estimated again at half
their size, where most of what compression took away is averaged out, in a window twice as wide in the scene. It is used
where fine detail gives no depth, and joined with that of fine detail where both are valid; where fine detail leaves
more than noise, and coarse detail does not, it is used alone.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.filters import smoothed
from focalgradient.depth.numerics import interpolate_nodes
from focalgradient.depth.registration import RegisteredViews, shrunk
from focalgradient.depth.search import LEAST_LEVELS, Estimate, Problem
from focalgradient.depth.settings import LEAST_SIDE, WINDOWS
from focalgradient.depth.validity import NEARLY_NOTHING
from focalgradient.progress import silent

__all__ = ["halved", "joined"]

FACTOR = 2
"""Reduction of the views. Where fine detail gives no depth, the mean relative error by half-sized views is 0.13 in 20
rooms in JPEG of quality 75 (by fine detail 0.12), and 0.35 where only views reduced by 4 give any."""

AROUND, KNOWN = 2.0, 0.1
"""Standard deviation in windows of the neighbourhood of a pixel in which both must give depth; and minimum proportion
of the pixels in it at which they do. Chosen with `CONTINUED`."""

CONTINUED = 0.12
"""Maximum difference of coarse detail's depth from the mean of fine detail's around it, relative to the frame's median
vergence. Without this limit 50 % of the pixels of 20 rooms are valid instead of 40 %, with a mean relative error of
0.12 instead of 0.11, and a completed map is worse than one from fine detail alone (`benchmarks/rooms.py`)."""

ALIKE = 0.7
"""Correlation of the errors of fine and of coarse detail, which come of the same texture: 0.65 in 18 rooms (median; 0.3
to 0.9), 0.8 on rendered layers, each error over its standard deviation (`benchmarks/rooms.py`)."""


def halved(problem: Problem) -> Problem | None:
    """Return the problem with views of half the size; None where they are too small, or blur is a mixture of several.

    The range searched is the same.
    """
    registered, search, settings = problem.registered, problem.search, problem.settings
    least = max(LEAST_SIDE, WINDOWS * settings.window)
    if registered.shares is not None or min(registered.shape) // FACTOR < least:
        return None
    reduced = RegisteredViews(
        [shrunk(image, FACTOR) for image in registered.images],
        shrunk(registered.usable.astype(np.float32), FACTOR) == 1,
        registered.gains,
        registered.placements,
        registered.warnings,
    )
    views = [
        replace(view, image=shrunk(view.image, FACTOR), pixel_angle=FACTOR * view.pixel_angle, mask=None)
        for view in problem.views
    ]
    levels = max(LEAST_LEVELS, math.ceil((search.levels - 1) / FACTOR)) + 1
    noise = settings.given_noise(len(views))
    given = None if noise is None else (noise / FACTOR).tolist()  # white noise, of which the mean of a block has less
    return Problem(
        views,
        reduced,
        replace(search, pixels=search.pixels / FACTOR, pixel_angle=FACTOR * search.pixel_angle, levels=levels),
        replace(settings, noise=given, progress=silent),
    )


def joined(fine: Estimate, coarse: Estimate, least_sd: NDArray[np.float32] | None, window: float) -> Estimate:
    """Join estimates from fine detail, in a `window` (pixels), and from the `halved` problem.

    Where both are valid each has the weight of its precision, and their errors are correlated (`ALIKE`). Coarse detail
    alone is valid where it continues the depth around it at which both are. The standard deviation includes what the
    two differ by, or what differs from that around, and is `least_sd` (H x W, in dioptres) at least wherever coarse
    detail contributes: it says less of where a surface ends. None: coarse detail is used alone, unless it gives depth
    at fewer pixels.
    """
    shape = fine.valid.shape
    vergence, sd, known = (
        interpolate_nodes(values.astype(float), None, FACTOR, shape).astype(np.float32)
        for values in (coarse.vergence, coarse.vergence_sd, coarse.valid)
    )
    is_coarse = known > 0.5
    if least_sd is None and is_coarse.mean() < fine.valid.mean():
        return fine
    is_both = fine.valid & is_coarse & (least_sd is not None)
    near = smoothed(is_both.astype(np.float32), AROUND * window)
    around = smoothed(is_both * fine.vergence, AROUND * window) / np.maximum(near, 1e-6)
    apart = CONTINUED * abs(float(np.median(fine.vergence[fine.valid])))
    is_added = is_coarse & ~fine.valid & (near > KNOWN) & (np.abs(vergence - around) < apart)
    valid = fine.valid | is_added
    if least_sd is None:
        is_added, valid, around, least_sd = is_coarse, is_coarse, vergence, np.zeros_like(sd)
    share = np.where(is_both, 1 / (1 + (fine.vergence_sd / sd) ** 2), ~is_added).astype(np.float32)  # of fine detail
    outdated = set() if valid.mean() < NEARLY_NOTHING else {"rejected", "share_outside_range"}
    details = {
        **{name: value for name, value in fine.details.items() if name not in outdated},
        "coarse_detail": {
            "share_joined": float(is_both.mean()),
            "share_added": float(is_added.mean()),
            "tau": coarse.details["split_band"]["tau"],
        },
    }
    differ = np.where(is_added, vergence - around, np.sqrt(share * (1 - share)) * (vergence - fine.vergence))
    one, other = share * fine.vergence_sd, (1 - share) * sd
    joint_sd = np.sqrt(one**2 + other**2 + 2 * ALIKE * one * other + differ**2)
    return replace(
        fine,
        vergence=share * fine.vergence + (1 - share) * vergence,
        vergence_sd=np.where(share < 1, np.maximum(joint_sd, least_sd), joint_sd).astype(np.float32),
        valid=valid,
        details=details,
        beyond=None if fine.beyond is None else fine.beyond * ~valid,
    )
