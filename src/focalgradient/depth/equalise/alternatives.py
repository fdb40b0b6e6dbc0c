"""Alternative models of the views: another shape of blur, or one view softer than its optics make it.

A mirror lens blurs by an annulus; denoising, enlarging or a little motion soften one view, and sharpening the other
does about the same. Each changes depth, and little is left of the views that the disc's noise estimate would
not absorb. So the views are compared by these alternative models, too, for the same noise at the same places. Where one
explains the views clearly better than the model asked for (Vuong 1989), it is named, and what depth would change by is
added to the model error. Depth stays that of the model asked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from focalgradient.depth.equalise.likelihood import Equalised, Nodes, equalise
from focalgradient.depth.estimate import Problem
from focalgradient.depth.filters import RADII, FloatArray
from focalgradient.depth.model_error import LEAST_BLUR
from focalgradient.depth.noise import NOISE_SIDE
from focalgradient.depth.search import Blurs
from focalgradient.psf import Annulus

__all__ = ["Alternative", "judge_alternatives"]

OBSTRUCTED = (0.35, 0.5)
"""Diameters of an annulus's hole, over that of its rim: mirror lenses have about these."""

SOFTER = (0.25, 0.4, 0.6, 0.9)
"""Standard deviations in pixels of the Gaussian by which a view is softer than its optics make it."""

CLEARLY = 3.5
"""Mean difference of the log likelihoods, over its standard error, from which an alternative is taken: 60 right models
(walls and slants, two and three views, noise of .004 to .03, equal and not) gave at most 2.5, rings for discs 4 to
37."""

WORTHWHILE = 5.0
"""Mean difference of the log likelihoods of a window from which an alternative is taken: where models hardly differ, as
on a wall that two foci blur alike, even 3.4 is clear by its standard error; views that were changed gave 8 to 250."""

SHARE = 0.75
"""Quantile, over the frame, of what depth would change by as a share of the blur, that is added to the model error."""

TRIMMED = 0.05
"""Share of the nodes, those that differ most either way, that is left out: occlusion boundaries."""

LEAST_NODES = 30
"""Nodes below which nothing can be said."""


@dataclass(frozen=True, slots=True)
class Alternative:
    """A model that explains the views better than the one asked for."""

    cause: str  # what makes such views, in words
    clarity: float  # mean difference of the log likelihoods, over its standard error
    change: float  # of depth, as a share of the blur radius

    @property
    def text(self) -> str:
        """What to warn of."""
        return (
            f"the views contradict their optics: {self.cause}. It would change depth by about {self.change:.0%} of the "
            "blur radius, which is part of the standard deviations."
        )


def judge_alternatives(problem: Problem, blurs: Blurs, noise_sd: Sequence[float], discs: bool) -> Alternative | None:
    """The alternative that explains the views clearly better than `blurs` do, if one does.

    `discs` is whether the blur asked for is a disc, so that a ring is an alternative.
    """
    part = problem.registered.most_textured_crop(NOISE_SIDE)
    rim = min(NOISE_SIDE, *part.shape) // 12
    inner = ndimage.binary_erosion(np.ones(part.shape, np.bool_), iterations=rim)
    weight = (part.usable & inner).astype(np.float32)

    def costs(model: Blurs) -> tuple[FloatArray, Nodes, Equalised]:
        equalised = equalise(part.images, model, noise_sd, window=problem.settings.window)
        mean, support = equalised.averages(equalised.energy(weight), weight)
        nodes = equalised.minima(mean, support)
        # Noise is not known well where the model is wrong: each window's likelihood is that with its own.
        return np.log(np.maximum(nodes.misfit, 0.01)) * equalised.window_size() * support / 2, nodes, equalised

    stated, nodes, equalised = costs(blurs)
    use = (nodes.support > 0.5) & (nodes.texture >= 1) & nodes.inside
    if use.sum() < LEAST_NODES:
        return None
    radius = np.interp(nodes.level, np.arange(equalised.levels), blurs.radius.max(axis=0))
    pixels = np.abs(np.gradient(blurs.radius, axis=1)).max()  # of blur to a level
    windows = use.sum() * equalised.step**2 / equalised.window_size()
    best = None
    for cause, models in _alternatives(blurs, discs):
        before = 0.0
        for model in models:  # ever stronger, while that explains more
            cost, other, _ = costs(model)
            gained = (stated - cost)[use]
            low, high = np.quantile(gained, [TRIMMED, 1 - TRIMMED])
            kept = gained[(gained >= low) & (gained <= high)]
            mean = float(kept.mean())
            clarity = mean / float(kept.std() + 1e-9) * math.sqrt((1 - 2 * TRIMMED) * windows)
            if clarity < CLEARLY or mean <= max(before, WORTHWHILE):
                break
            before = mean
            change = np.abs(other.level - nodes.level)[use] * pixels / np.maximum(LEAST_BLUR, radius[use])
            found = Alternative(cause, clarity, float(np.quantile(change, SHARE)))
            surely = mean * (1 - CLEARLY / clarity)  # the lower bound of what is gained
            if best is None or surely > best[0]:
                best = surely, found
    return None if best is None else best[1]


def _alternatives(own: Blurs, discs: bool) -> list[tuple[str, list[Blurs]]]:
    """Causes, with what each makes of the views' blur from weak to strong."""
    found = []
    if discs:
        rings = [_annulus(own, hole) for hole in OBSTRUCTED]
        found.append(("the blur is likelier a ring than a disc, as that of a mirror lens is", rings))
    for number in range(len(own.transfer)):
        softer = [_changed(own, number, np.exp(-2 * (np.pi * sd * own.frequencies.radius) ** 2)) for sd in SOFTER]
        found.append(
            (
                f"view {number + 1} is softer, beside the rest, than its optics make it, as where it was denoised, "
                "enlarged or compressed, the camera moved, or another view was sharpened",
                softer,
            )
        )
    return found


def _changed(own: Blurs, number: int, gain: FloatArray) -> Blurs:
    """The blurs with one view's transfer multiplied by a `gain` (F)."""
    changed = own.transfer.copy()
    changed[number] *= gain.astype(changed.real.dtype)
    return replace(own, transfer=changed)


def _annulus(own: Blurs, hole: float) -> Blurs:
    """Annuli in place of discs, whose holes have `hole` times their diameter."""
    ring = Annulus(hole).transfer(RADII, own.radius[:, :, None])
    return replace(own, transfer=ring.astype(own.transfer.dtype))
