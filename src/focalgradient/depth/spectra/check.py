"""The internal check (Pentland 1987, Eq. 11): every pair of views measures depth, and all must agree."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import Mask
from focalgradient.depth.noise import noise_from_residuals
from focalgradient.depth.recover import problem_of
from focalgradient.depth.settings import RecoverySettings, blur_source, checked_views
from focalgradient.depth.spectra.pairs import Differences, Pair
from focalgradient.errors import FocalGradientWarning
from focalgradient.progress import silent
from focalgradient.psf import Psf
from focalgradient.view import View

__all__ = ["Check", "Pair", "check_views"]


@dataclass(frozen=True, slots=True, eq=False)
class Check:
    """Every pair's estimate, their joint estimate, and whether they agree; arrays are H x W."""

    pairs: tuple[Pair, ...]
    """Depth as each two of the views give it."""

    joint: NDArray[np.floating]
    """Vergence in dioptres from all views together."""

    joint_sd: NDArray[np.floating]
    """Its standard deviation in dioptres, by noise alone: views that disagree show what else errs."""

    statistic: NDArray[np.floating]
    """Chi-square of the pairs' disagreement: 0 for two views, which cannot disagree."""

    freedom: int
    """Its degrees of freedom, n - 2."""

    agrees: Mask
    """False where views that do agree would disagree as much with less than the probability chosen, and at the rim."""


def check_views(
    views: Sequence[View],
    *,
    near: float | None = None,
    far: float | None = None,
    psf: Psf | str = "disc",
    k: float | None = None,
    window: float = 8.0,
    noise: float | Sequence[float] | None = None,
    align: bool = False,
    false_alarm: float = 1e-3,
) -> Check:
    """Estimate depth from every pair of `views` and from all of them, and test whether they agree (Eq. 11).

    Parameters
    ----------
    views
        Two or more views, as for `focalgradient.recover_depth`; from three on they can disagree.
    near, far, psf, k, window, noise, align, false_alarm
        As for `focalgradient.recover_depth`.

    Raises
    ------
    InputError
        If the views cannot be compared, or a setting is out of range.

    Warns
    -----
    FocalGradientWarning
        If the views are shifted by more than 0.25 pixel, or leave the side of focus open.

    Examples
    --------
    A wall 1.25 m away through three apertures focused at 1 m: each pair gives its depth.

    >>> from focalgradient import Lens
    >>> from focalgradient.render import cast, noisy
    >>> from focalgradient.scenes import plane
    >>> lenses = [Lens(0.025, number, 1.0) for number in (16, 8, 5)]
    >>> cast_views = [cast(plane(1.25), lens, (96, 96), 3.2e-4).view for lens in lenses]
    >>> check = check_views([noisy(view, 0.003, seed) for seed, view in enumerate(cast_views)], near=1.0, noise=0.003)
    >>> [pair.views for pair in check.pairs], check.freedom
    ([(1, 2), (1, 3), (2, 3)], 1)
    >>> [round(float(np.median(pair.vergence)), 1) for pair in check.pairs]
    [0.8, 0.8, 0.8]
    """
    views = checked_views(views)
    settings = RecoverySettings("spectra", near, far, blur_source(psf, k), window, noise, align, false_alarm, silent)
    problem = problem_of(views, settings)
    registered, search, shape = problem.registered, problem.search, problem.settings.shape
    for text in (*registered.warnings, *([] if search.side_known else [search.side_text])):
        warnings.warn(FocalGradientWarning(text), stacklevel=2)
    noise_sd, _ = noise_from_residuals(registered, search.blurs(shape), window, settings.given_noise(len(views)))
    joint = Differences.of(registered, search, noise_sd, shape, window).estimate()

    def pixels(values: NDArray[np.floating]) -> NDArray[np.float32]:
        return joint.to_pixels(values, search.spacing, registered.shape)

    return Check(
        tuple(Pair(pair.views, pixels(pair.vergence), pixels(pair.vergence_sd)) for pair in joint.pairs),
        pixels(joint.vergence),
        pixels(joint.noise_sd),
        joint.to_blocks(joint.statistic, registered.shape),
        joint.freedom,
        joint.to_blocks(joint.agrees(false_alarm), registered.shape),
    )
