"""Other models of the views: another shape of blur, other optics, or one view softer than its optics make it.

A mirror lens blurs by an annulus; denoising, enlarging or a little motion soften one view. Each changes depth, and
leaves little that the disc's noise estimate would not absorb. So the views are compared by these models for the same
noise at the same places. One that explains them clearly better (Vuong 1989) is named, and what depth would change by is
added to the model error. Depth stays that of the model asked for.

Shapes are compared by likelihood: the same views, with the same noise, are equalised by each. The shape with least left
is the likelier; on 18 rendered pairs it was the true one in 17, but on one of two photographed sheets it was not, so
that a shape whose coarse and fine detail disagree more is not recommended.

Apertures or foci of the wrong views leave a larger residual than noise does, wherever views are blurred. Wrong optics
inflate the noise estimate, so that noise is estimated for each slip that leaves less than the stated optics, and the
least serves all, on the same part of the views. A slip that leaves clearly less is named, unless another shape of blur
explains the views as well. A common factor of all apertures leaves nothing more with one focus, and a common shift of
all foci never does: only a calibration finds those. Nor does the order of two foci, whose depths are each other's
mirror image; their magnification may (`focalgradient.depth.registration`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.special import j0

from focalgradient.depth.equalise.likelihood import Equalised, Nodes, equalise, view_spectra
from focalgradient.depth.equalise.split_band import DetailHalves, SplitBand
from focalgradient.depth.filters import RADII, FloatArray
from focalgradient.depth.noise import NOISE_SIDE, noise_from_residuals
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Blurs, Problem, Search
from focalgradient.depth.validity import DOUBTFUL, LARGEST_TAU, LEAST_BLUR, LEAST_NODES, TRIMMED
from focalgradient.errors import InputError
from focalgradient.optics import Aperture, Optics
from focalgradient.psf import Annulus, Blend, Disc, Gaussian, Psf
from focalgradient.psf.shapes import disc_transfer

__all__ = [
    "Alternative",
    "check_model",
    "error_with",
    "fit_models",
    "judge_alternatives",
    "judge_optics",
    "judge_shape",
    "likelier_slip",
    "misfits",
    "others_than",
]

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


def judge_alternatives(
    problem: Problem, blurs: Blurs, noise_sd: Sequence[float], is_consistent: NDArray[np.bool_]
) -> Alternative | None:
    """Return the alternative that explains views in one waveband clearly better than `blurs`, or None.

    Only pixels whose views agree count (H x W): no blur explains what occlusion leaves.
    """
    # A displacement, which the user is warned about, looks like other blur.
    if problem.registered.warnings or blurs.frequencies.down is not None or blurs.parts:
        return None
    registered = problem.registered
    part = replace(registered, usable=registered.usable & is_consistent).most_textured_crop(NOISE_SIDE)
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
            surely = mean * (1 - CLEARLY_SDS / clarity)  # the lower bound of the gain
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
