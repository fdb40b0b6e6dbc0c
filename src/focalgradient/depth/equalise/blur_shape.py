"""Which shape of blur explains the views best: for a warning, never to switch by itself.

Shapes are compared by likelihood: the same views, with the same noise, are equalised by each, and what is left is
compared at the same places. The shape with least left is the likelier; on 18 rendered pairs it was the true one in
17, but on one of two photographed sheets it was not, so that depth stays with the shape that was set, and a shape whose
coarse and fine detail disagree more is not recommended.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from focalgradient.depth.equalise.likelihood import Nodes, equalise
from focalgradient.depth.equalise.split_band import DetailHalves, SplitBand
from focalgradient.depth.estimate import Problem
from focalgradient.depth.model_error import DOUBTFUL
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Search
from focalgradient.psf import Blend, Disc, Gaussian, Psf

__all__ = ["Fit", "fit_models", "judge_shape", "misfits", "others_than"]

SIDE = 384
"""Side in pixels of the part of the views in which shapes are compared; limits the time. Chosen by hand."""

LIKELIER_SHAPE = 0.99
"""Ratio of the residual with the likeliest shape to that with the requested one below which the former is named: wrong
shapes leave 1.07 to 1.18 times the noise, correct ones 0.99 to 1.01."""


CANDIDATES: tuple[Psf, ...] = (Disc(), Gaussian(), Blend())
"""Shapes compared with the requested one: a lens without aberrations, the paper's, and an intermediate one."""


def others_than(shape: Psf) -> list[Psf]:
    """Return the `CANDIDATES` of other kinds than `shape`."""
    return [one for one in CANDIDATES if type(one) is not type(shape)]


@dataclass(frozen=True, slots=True)
class Fit:
    """Goodness of fit of a blur shape to the views."""

    misfit: float  # mean squared residual over what noise explains: the median over the places compared
    tau: float  # model error by the split-band test


def misfits(
    models: Sequence[tuple[Search, Psf]], views: RegisteredViews, noise_sd: Sequence[float], window: float
) -> list[float]:
    """Return the misfit of each model (a search and a shape of blur) to `views`, at the same places."""
    weight = views.usable.astype(np.float32)
    equalised = (equalise(views.images, search.blurs(shape), noise_sd, window=window) for search, shape in models)
    return _misfits([one.read(weight) for one in equalised])


def _misfits(read: Sequence[Nodes]) -> list[float]:
    use = np.all([nodes.has_texture for nodes in read], axis=0)
    return [float(np.median(nodes.misfit[use])) if use.any() else 1.0 for nodes in read]


def fit_models(
    models: Sequence[tuple[Search, Psf]], views: RegisteredViews, noise_sd: Sequence[float], window: float
) -> list[Fit]:
    """Return how well each model (a search and a shape of blur) explains `views`, at the same places."""
    weight = views.usable.astype(np.float32)
    read, taus = [], []
    for search, shape in models:
        equalised = equalise(views.images, search.blurs(shape), noise_sd, window=window)
        nodes = equalised.read(weight)
        beside = equalised.evaluate_to_refine(nodes, equalised.evaluate(nodes))
        nodes = equalised.refine(nodes, beside, weight)
        images = equalised.evaluate_images(nodes)[1]
        split = DetailHalves.of(equalised, nodes, images, weight, search, 1.0, nodes.is_textured).test()
        read.append(nodes)
        taus.append(split.tau)
    return [Fit(misfit, tau) for misfit, tau in zip(_misfits(read), taus, strict=True)]


def judge_shape(
    split: SplitBand, problem: Problem, shape: Psf, noise_sd: Sequence[float]
) -> tuple[dict[str, dict[str, float]], list[str], bool]:
    """Compare shapes of blur where coarse and fine detail disagree by `shape`; return the fits and the warnings.

    Also return whether another shape is likelier.
    """
    if split.tau < DOUBTFUL:
        return {}, [], False
    shapes = [shape, *others_than(shape)]
    models, part = [(problem.search, one) for one in shapes], problem.registered.most_textured_crop(SIDE)
    fits = fit_models(models, part, noise_sd, problem.settings.window)
    best = min(range(len(shapes)), key=lambda number: fits[number].misfit)
    # The shape that leaves least may yet err more in depth: then neither is right.
    is_better = fits[best].misfit < LIKELIER_SHAPE * fits[0].misfit and fits[best].tau < fits[0].tau
    if is_better:
        better = shapes[best]
        more = "".join(f", {name}={value:g}" for name, value in better.stated().items())
        advice = (
            f"{better} is likelier (its residual is {fits[best].misfit:.2f} times the noise's, {shape}'s "
            f"{fits[0].misfit:.2f}): compare psf={better.name!r}{more}, or calibrate the camera"
        )
    else:
        advice = "no other shape explains the views better: calibrate the camera, and check its focus and apertures"
    text = (
        f"the blur is not quite {shape}: depth from coarse detail and depth from fine detail differ by {split.tau:.0%} "
        f"of the blur, which is part of the standard deviations; {advice}."
    )
    stated = {str(one): {"misfit": fit.misfit, "tau": fit.tau} for one, fit in zip(shapes, fits, strict=True)}
    return stated, [text], is_better
