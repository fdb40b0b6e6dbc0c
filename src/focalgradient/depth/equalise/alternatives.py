"""Other models of the views: another shape of blur, other optics, or one view softer than its optics make it.

A mirror lens blurs by an annulus; denoising, enlarging or a little motion soften one view. Each changes depth, and
leaves little that the disc's noise estimate would not absorb. So the views are compared by these models for the same
noise at the same places. One that explains them clearly better (Vuong 1989) is named, and what depth would change by is
added to the model error. Depth stays that of the model asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy import ndimage
from scipy.special import j0

from focalgradient.depth.equalise.likelihood import Equalised, Nodes, equalise, view_spectra
from focalgradient.depth.equalise.optics_check import COMMON, judge_optics, judge_shape
from focalgradient.depth.equalise.split_band import SplitBand
from focalgradient.depth.filters import RADII, FloatArray
from focalgradient.depth.noise import NOISE_SIDE
from focalgradient.depth.search import Blurs, Problem
from focalgradient.depth.validity import DOUBTFUL, LARGEST_TAU, LEAST_BLUR, LEAST_NODES, TRIMMED
from focalgradient.psf import Annulus, Blend, Disc, Psf
from focalgradient.psf.disc import disc_transfer

__all__ = ["Alternative", "check_model", "error_with", "judge_alternatives"]

OBSTRUCTED = (0.35, 0.5)
"""Ratio of hole to rim diameter of an annulus, from weak to strong: typical of mirror lenses."""

IN_THE_RIM = (0.15, 0.3)
"""Share of the light in the rim of a disc, from weak to strong: overcorrected spherical aberration ("bubbles")."""

SOFT_EDGED = (0.2, 0.35, 0.5)
"""Standard deviation per blur radius of the Gaussian edge of `Blend`, from weak to strong; at 0.5 a Gaussian."""

SOFTER = (0.25, 0.4, 0.6, 0.9)
"""Standard deviations in pixels of Gaussians by which a view may be softer than its optics imply, each about 1.5 times
the previous one. Chosen by hand."""

CLEARLY_SDS = 3.5
"""Mean difference of the log likelihoods, in its standard errors, above which an alternative is accepted: at most 2.5
in 60 correct models (walls and slants, two and three views, equal and unequal noise of .004 to .03), 4 to 37 for annuli
analysed as discs."""

WORTHWHILE = 5.0
"""Mean difference of a window's log likelihoods above which an alternative is accepted: where models hardly differ, as
on a wall that is equally blurred at two foci, 3.4 is already significant; altered views gave 8 to 250."""

AS_LIKELY = 0.5
"""Ratio of what a model surely gains to what the best one does, above which it is as likely. Chosen by hand."""

SHARE = 0.75
"""Quantile over the frame of the change in depth, relative to the blur, that is added to the model error."""


@dataclass(frozen=True, slots=True)
class Alternative:
    """A model that explains the views better than the one asked for."""

    cause: str  # what makes such views, in words
    clarity: float  # mean difference of the log likelihoods, over its standard error
    change: float  # of depth, as a share of the blur radius

    @property
    def text(self) -> str:
        """Text of the warning."""
        return (
            f"the views contradict their optics: {self.cause}. It would change depth by about {self.change:.0%} of the "
            "blur radius, which is part of the standard deviations."
        )


def judge_alternatives(problem: Problem, blurs: Blurs, noise_sd: Sequence[float]) -> Alternative | None:
    """Return the alternative that explains views in one waveband clearly better than `blurs`, or None."""
    # A displacement, which the user is warned about, looks like other blur.
    if problem.registered.warnings or blurs.frequencies.down is not None or blurs.parts:
        return None
    part = problem.registered.most_textured_crop(NOISE_SIDE)
    rim = min(NOISE_SIDE, *part.shape) // 12
    inner = ndimage.binary_erosion(np.ones(part.shape, np.bool_), iterations=rim)
    weight, spectra = (part.usable & inner).astype(np.float32), view_spectra(part.images, blurs)

    def costs(model: Blurs) -> tuple[FloatArray, Nodes, Equalised]:
        equalised = equalise(spectra, model, noise_sd, window=problem.settings.window)
        mean, support = equalised.averages(equalised.energy(weight), weight)
        nodes = equalised.minima(mean, support)
        # Noise is not known well where the model is wrong: each window's likelihood is that with its own.
        return np.log(np.maximum(nodes.misfit, 0.01)) * equalised.window_size() * support / 2, nodes, equalised

    stated, nodes, equalised = costs(blurs)
    use = nodes.has_texture & nodes.inside
    if use.sum() < LEAST_NODES:
        return None
    radius = np.interp(nodes.level, np.arange(equalised.levels), blurs.radius.max(axis=0))
    pixels = np.abs(np.gradient(blurs.radius, axis=1)).max()  # of blur to a level
    windows = use.sum() * equalised.step**2 / equalised.window_size()
    likelier: list[tuple[float, Alternative]] = []
    for cause, models in _alternatives(blurs, isinstance(problem.settings.psf, Disc)):
        before, accepted = 0.0, None
        for model in models:  # ever stronger, while that explains more
            cost, other, _ = costs(model)
            gained = (stated - cost)[use]
            low, high = np.quantile(gained, [TRIMMED, 1 - TRIMMED])
            kept = gained[(gained >= low) & (gained <= high)]
            mean = float(kept.mean())
            clarity = mean / float(kept.std() + 1e-9) * math.sqrt((1 - 2 * TRIMMED) * windows)
            if clarity < CLEARLY_SDS or mean <= max(before, WORTHWHILE):
                break
            before = mean
            change = np.abs(other.level - nodes.level)[use] * pixels / np.maximum(LEAST_BLUR, radius[use])
            found = Alternative(cause, clarity, float(np.quantile(change, SHARE)))
            surely = mean * (1 - CLEARLY_SDS / clarity)  # the lower bound of what is gained
            if accepted is None or surely > accepted[0]:
                accepted = surely, found
        if accepted is not None:
            likelier.append(accepted)
    if not likelier:
        return None
    # Of models that the views hardly tell apart, that which would change depth most.
    surest = max(surely for surely, _ in likelier)
    return max((found for surely, found in likelier if surely >= AS_LIKELY * surest), key=lambda found: found.change)


def _alternatives(own: Blurs, discs: bool) -> list[tuple[str, Iterable[Blurs]]]:
    """Return causes, and the blur of the views under each, from weak to strong."""
    found: list[tuple[str, Iterable[Blurs]]] = []
    for form, lens, transfers in _SHAPES if discs else ():
        cause = f"the blur is likelier {form} than a uniform disc, as that of a {lens} is"
        found.append((cause, (_shaped(own, transfer) for transfer in transfers)))
    for number in range(len(own.transfer)):
        gains = (np.exp(-2 * (np.pi * sd * own.frequencies.radius) ** 2) for sd in SOFTER)
        found.append(
            (
                f"view {number + 1} is softer, beside the rest, than its optics make it, as where it was denoised, "
                "enlarged or compressed, the camera moved, or another view was sharpened",
                map(partial(_softer, own, number), gains),
            )
        )
    return found


def _softer(own: Blurs, number: int, gain: FloatArray) -> Blurs:
    """Return the blurs with one view's transfer multiplied by a `gain` (F)."""
    changed = own.transfer.copy()
    changed[number] *= gain.astype(changed.real.dtype)
    return replace(own, transfer=changed)


def _shaped(own: Blurs, transfer: Callable[[FloatArray, FloatArray], FloatArray]) -> Blurs:
    """Return the blurs of another shape at the same radii."""
    return replace(own, transfer=transfer(RADII, own.radius[:, :, None]).astype(own.transfer.dtype))


def _rim_transfer(frequency: FloatArray, radius: FloatArray, share: float) -> FloatArray:
    """Return the transfer of a disc with a `share` of the light in its rim, with the second moment of a disc."""
    radius = radius / math.sqrt(1 + share)
    return np.asarray((1 - share) * disc_transfer(frequency, radius) + share * j0(2 * np.pi * frequency * radius))


_SHAPES = (
    ("a ring", "mirror lens", [Annulus(hole).transfer for hole in OBSTRUCTED]),
    (
        "a disc with a bright rim",
        "lens with spherical aberration",
        [partial(_rim_transfer, share=one) for one in IN_THE_RIM],
    ),
    ("a disc with a soft rim", "lens with spherical aberration", [Blend(k).transfer for k in SOFT_EDGED]),
)
"""Shapes of blur that a disc is compared with: form, what makes it, and its transfers from weak to strong."""


def error_with(split: SplitBand, alternative: Alternative | None) -> float:
    """Return the model error over the blur radius: by the split-band test, or by an alternative's change."""
    return split.tau if alternative is None else max(split.tau, min(alternative.change, LARGEST_TAU))


def check_model(
    problem: Problem,
    first_noise: Sequence[float],
    noise_sd: Sequence[float],
    split: SplitBand,
    alternative: Alternative | None,
    misfit: float,
    explained: float,
    any_valid: bool,
) -> tuple[dict[str, Any], list[str]]:
    """Compare the stated optics, and the shape of blur, with others, for views in one waveband: details and warnings.

    `first_noise` is the noise (sd of each view) that the stated optics leave in a part of the frame, `noise_sd` that of
    the whole; `misfit` is the frame's median misfit, `explained` the share of its texture that the model explains.
    """
    shape = problem.settings.psf if isinstance(problem.settings.psf, Psf) else None
    shapes: dict[str, dict[str, float]] = {}
    slips: dict[str, float] = {}
    texts: list[str] = []
    if shape is not None:
        slips, texts = judge_optics(problem, shape, first_noise, misfit, explained, split.tau)
    # A displacement, which the user is warned about, looks like blur of another shape.
    if not problem.registered.warnings and any_valid:
        by_slip, is_better = texts, False
        if shape is not None and not by_slip:
            shapes, texts, is_better = judge_shape(split, problem, shape, noise_sd)
        larger = [alternative.text] if alternative is not None and alternative.change >= DOUBTFUL else []
        if by_slip:
            texts = by_slip if COMMON in by_slip[0] else [*by_slip, *larger]  # which looks like another shape
        elif not is_better:
            texts = split.warnings() or larger or texts
    details = {"fit_by_shape": shapes, "fit_by_optics": slips}
    if alternative is not None:
        details["likelier"] = asdict(alternative)
    return {name: found for name, found in details.items() if found}, texts
