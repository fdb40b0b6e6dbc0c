"""Depth by the real-time form, for still views: the same as for video, on the pixels of the first view."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from focalgradient.depth.noise import noise_floor
from focalgradient.depth.ratio.disparity import on_grid, read_depth, table_for
from focalgradient.depth.ratio.energies import BLOCK
from focalgradient.depth.ratio.table import two_apertures
from focalgradient.depth.search import Estimate, Problem
from focalgradient.view import View

__all__ = ["check", "estimate"]


def check(views: Sequence[View]) -> None:
    """Refuse views that are not two apertures at one focus."""
    two_apertures([view.optics for view in views])


def estimate(problem: Problem) -> Estimate:
    """Depth by the ratio of two views' detail, for `focalgradient.recover_depth`."""
    search, registered, settings = problem.search, problem.registered, problem.settings
    settings.progress(0.1, "computing the table")
    table = table_for(search, settings.shape)
    # Which view is the sharper follows from the optics.
    order = np.argsort([one.aperture_diameter for one in search.optics])
    small, large = (registered.images[i] for i in order)
    settings.progress(0.5, "estimating noise")
    noise = settings.given_noise(2)
    if noise is None:
        views = zip(registered.images, registered.gains, strict=True)
        noise = np.full(2, min(noise_floor(image, usable=registered.usable) * gain for image, gain in views))
    sds = noise / registered.gains
    settings.progress(0.6, "estimating depth")
    vergence, sd, valid = read_depth(
        *(small, large, table, search),
        noise=[float(sds[i]) for i in order],
        window=settings.window,
        usable=registered.usable,
    )
    shape = registered.shape
    return Estimate(
        on_grid(vergence, shape, BLOCK),
        on_grid(sd, shape, BLOCK),
        on_grid(valid, shape, BLOCK) & registered.usable,
        noise=noise.tolist(),
        details={"bands_px": list(table.bands)},
    )
