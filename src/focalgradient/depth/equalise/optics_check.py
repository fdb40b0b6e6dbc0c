"""Whether another shape of blur, or optics other than those stated, explain the views better: for a warning only.

Shapes are compared by likelihood: the same views, with the same noise, are equalised by each. The shape with least left
is the likelier; on 18 rendered pairs it was the true one in 17, but on one of two photographed sheets it was not, so
that depth stays with the shape that was set, and a shape whose coarse and fine detail disagree more is not recommended.

Apertures or foci of the wrong views leave a larger residual than noise does, wherever views are blurred. Wrong optics
inflate the noise estimate, so that noise is estimated for each slip that leaves less than the stated optics, and the
least serves all, on the same part of the views. A slip that leaves clearly less is named in a warning, unless another
shape of blur explains the views as well; depth stays that of the stated optics. A common factor of all apertures leaves
nothing more with one focus, and a common shift of all foci never does: only a calibration finds those. Nor does the
order of two foci, whose depths are each other's mirror image; their magnification may
(`focalgradient.depth.registration`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress

import numpy as np

from focalgradient.depth.equalise.likelihood import Nodes, equalise
from focalgradient.depth.equalise.split_band import DetailHalves, SplitBand
from focalgradient.depth.noise import NOISE_SIDE, noise_from_residuals
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Problem, Search
from focalgradient.depth.validity import DOUBTFUL
from focalgradient.errors import InputError
from focalgradient.optics import Aperture, Optics
from focalgradient.psf import Blend, Disc, Gaussian, Psf

__all__ = ["fit_models", "judge_optics", "judge_shape", "likelier_slip", "misfits", "others_than"]

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
) -> list[dict[str, float]]:
    """Return how well each model (a search and a shape of blur) explains `views`, at the same places.

    "misfit" is the median of the mean squared residual over what noise explains, "tau" the model error by the
    split-band test.
    """
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
    return [{"misfit": misfit, "tau": tau} for misfit, tau in zip(_misfits(read), taus, strict=True)]


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
    best = min(range(len(shapes)), key=lambda number: fits[number]["misfit"])
    # The shape that leaves least may yet err more in depth: then neither is right.
    asked, other = fits[0], fits[best]
    is_better = other["misfit"] < LIKELIER_SHAPE * asked["misfit"] and other["tau"] < asked["tau"]
    if is_better:
        better = shapes[best]
        more = "".join(f", {name}={value:g}" for name, value in better.stated().items())
        advice = (
            f"{better} is likelier (its residual is {other['misfit']:.2f} times the noise's, {shape}'s "
            f"{asked['misfit']:.2f}): compare psf={better.name!r}{more}, or calibrate the camera"
        )
    else:
        advice = "no other shape explains the views better: calibrate the camera, and check its focus and apertures"
    text = (
        f"the blur is not quite {shape}: depth from coarse detail and depth from fine detail differ by {split.tau:.0%} "
        f"of the blur, which is part of the standard deviations; {advice}."
    )
    return dict(zip(map(str, shapes), fits, strict=True)), [text], is_better


LIKELIER = 0.85
"""Ratio of the residual power with the likeliest optics to that with the stated optics and the likeliest blur shape,
below which the former are named. Chosen by hand; `benchmarks/depth_slips.py` counts hits and false alarms."""

PROMISING = 0.95
"""`LIKELIER` for the noise that the stated optics leave, above which noise is not estimated by other optics: 0.03 to
0.77 for exchanged foci and f-numbers, and views in another order (`benchmarks/depth_slips.py`), 0.99 and more for
right optics."""

EXPLAINS = (0.9, 2.0)
"""Range of the ratio of residual to noise power in which optics explain the views. It is higher if nothing fits
(displaced views, printed squares), and lower if the blur of a wrong candidate is so large that little is compared."""

STATED = "as stated"
"""Name of the stated optics with their best-fitting blur shape, as used in messages."""

FACTORS = (0.5, math.sqrt(0.5), math.sqrt(2), 2.0)
"""Candidate factors of a wrong f-number: one and two stops in either direction."""

COMMON = "all f-numbers"
"""End of the names of candidates that multiply all f-numbers by one factor, which only views of several foci show."""

LIKELIER_COMMON, EXPLAINS_COMMON = 0.95, 1.15
"""`LIKELIER`, and the upper end of `EXPLAINS`, for a common factor, which changes the views as little as another blur
shape. Without an error of one stop, 0.91 and 0.70 of the residual are left, or 1.06 to 1.09 times the noise; with coma
0.88, or 1.25 times the noise (`benchmarks/depth_slips.py`, three seeds)."""

COMPARED = 2
"""Number of candidates, those with the smallest residuals, for which noise is estimated again; limits the time. Chosen
by hand."""

SUSPECT = 1.06
"""Median misfit above which the optics are checked: correct optics with the correct blur shape leave 0.99 to 1.04."""


def judge_optics(
    problem: Problem, shape: Psf, noise_sd: Sequence[float], misfit: float, explained: float, tau: float
) -> tuple[dict[str, float], list[str]]:
    """Compare the stated optics with likely slips: the residual power of each over noise, and the warning.

    `noise_sd` is the noise that the stated optics leave; `misfit`, `explained` and `tau` are the frame's median misfit,
    its share of texture that the stated optics explain, and the model error by the split-band test.
    """
    if misfit < SUSPECT and explained > 0.8 and tau < DOUBTFUL:
        return {}, []
    search, settings = problem.search, problem.settings
    stated = [(search, one) for one in (shape, *others_than(shape))]
    slips: dict[str, tuple[Search, Psf]] = {}
    for name, optics in _slips([view.optics for view in problem.views]):
        with suppress(InputError):  # the limits leave these nothing to search
            slips[name] = Search.over(optics, search.pixel_angle, settings.near, settings.far, shape), shape
    given, part = settings.given_noise(len(problem.views)), problem.registered.most_textured_crop(NOISE_SIDE)

    def noise_of(model: tuple[Search, Psf]) -> list[float]:
        blurs = model[0].blurs(model[1])
        return noise_from_residuals(problem.registered, blurs, settings.window, given)[0]

    names, count = list(slips), len(stated)
    first = misfits([*stated, *slips.values()], part, noise_sd, settings.window)
    left = {STATED: min(first[:count])} | dict(
        sorted(zip(names, first[count:], strict=True), key=lambda one: one[1])[:COMPARED]
    )
    ranked = [name for name in left if name != STATED]
    # Noise that wrong optics inflate hides what they leave, but not that a slip leaves less: seldom worth estimating.
    if not ranked or left[ranked[0]] >= PROMISING * left[STATED]:
        return left, []
    models = [*stated, *(slips[name] for name in ranked)]
    noises = [noise_sd, *map(noise_of, models[1:])]
    least = min(noises, key=lambda noise_sd: float(np.sum(np.log(noise_sd))))
    found = misfits(models, part, least, settings.window)
    left = {STATED: min(found[:count])} | dict(zip(ranked, found[count:], strict=True))
    best = likelier_slip(left)
    if best is None:
        return left, []
    return left, [
        f"the views contradict the optics stated: they fit better with {best} (the residual is {left[best]:.2f} times "
        f"the noise, {left[STATED]:.2f} as stated): check the f-numbers and focus "
        "distances, and their order (f_number, focus_distance), and that all is of this lens."
    ]


def likelier_slip(left: Mapping[str, float]) -> str | None:
    """Return the slip that explains the views clearly better than the stated optics, by `judge_optics`; else None.

    >>> likelier_slip({"the foci in reverse order": 1.02, "as stated": 3.0})
    'the foci in reverse order'
    >>> likelier_slip({"the foci in reverse order": 4.0, "as stated": 9.0}) is None
    True
    """
    best = min(left, key=lambda name: left[name])
    most, ratio = (EXPLAINS_COMMON, LIKELIER_COMMON) if best.endswith(COMMON) else (EXPLAINS[1], LIKELIER)
    fits = EXPLAINS[0] <= left[best] <= min(most, ratio * left[STATED])
    return best if fits and best != STATED else None


def _slips(optics: Sequence[Optics]) -> list[tuple[str, list[Optics]]]:
    """Return likely slips, and the intended optics of each."""
    apertures, foci = [o.aperture_diameter for o in optics], [o.focus_vergence for o in optics]
    found: list[tuple[str, list[Optics]]] = []

    def add(name: str, diameters: Sequence[float], vergences: Sequence[float]) -> None:
        meant: list[Optics] = [Aperture(*one) for one in zip(diameters, vergences, strict=True)]
        if (list(diameters), list(vergences)) != (apertures, foci):
            found.append((name, meant))

    add("the apertures in reverse order", apertures[::-1], foci)
    if len(set(apertures)) > 1:
        add("the foci in reverse order", apertures, foci[::-1])
        add("apertures and foci in reverse order", apertures[::-1], foci[::-1])
    if len(set(foci)) > 1:  # of one focus, a common factor leaves the same
        for factor in FACTORS:
            add(f"{factor:.2g} times {COMMON}", [a / factor for a in apertures], foci)
    # Of two views the other's factor leaves the same, but for a common factor.
    widest = apertures.index(max(apertures))
    for number in range(len(apertures)) if len(apertures) > 2 else [widest]:
        for factor in FACTORS:
            meant = [a / factor if n == number else a for n, a in enumerate(apertures)]
            if len(set(zip(meant, foci, strict=True))) > 1:
                add(f"{factor:.2g} times the f-number of view {number + 1}", meant, foci)
    if len(optics) > 2 and len(set(foci)) > 2:
        add("the foci in reverse order", apertures, foci[::-1])
        for n in range(len(foci) - 1):
            add(f"the foci of views {n + 1} and {n + 2} exchanged", apertures, _exchanged(foci, n))
    return found


def _exchanged(values: Sequence[float], n: int) -> list[float]:
    """Return `values` with the n-th and the next exchanged."""
    return [*values[:n], values[n + 1], values[n], *values[n + 2 :]]
