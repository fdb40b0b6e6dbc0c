"""Hypotheses on what may be wrong with the views: what each changes, the margin by which it must win, its sentence.

Another shape of blur, other optics, or one view softer than its optics make it. A mirror lens blurs by an annulus;
denoising, enlarging or a little motion soften one view. Each changes depth, and leaves little that the disc's noise
estimate would not absorb. So a crop of the views is fitted again (`refit`) by each hypothesis, at the same places.

- *Shapes* are compared by what they leave, for the same noise: on 18 rendered pairs the likelier one was the true one
  in 17, but on one of two photographed sheets it was not, so that a shape whose coarse and fine detail disagree more is
  not recommended.
- *Optics*: apertures or foci of the wrong views leave a larger residual than noise does, and inflate its estimate:
  noise is estimated for each slip that leaves less than the stated optics, and the least serves all. A slip that leaves
  clearly less is named, unless another shape of blur explains the views as well. Only a calibration finds a common
  factor of all apertures at one focus, and a common shift of all foci. Nor do residuals show the order of two foci;
  their magnification may (`focalgradient.depth.registration`).
- *Blur*: a changed blur that is clearly more likely (Vuong 1989), each window with its own noise, is named, and the
  change of depth is added to the model error. Depth stays that of the model asked for.
- *Order of apertures*, without a fit: of two views with one focus, the larger aperture never shows finer detail.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.special import j0

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.equalise.likelihood import Equalised, Nodes, equalise, scene_power
from focalgradient.depth.equalise.signal import UNEXPLAINED
from focalgradient.depth.equalise.split_band import DetailHalves, SplitBand
from focalgradient.depth.filters import RADII, Image, smoothed
from focalgradient.depth.noise import NOISE_SIDE, noise_from_residuals
from focalgradient.depth.registration import RegisteredViews, measure_placement, resample
from focalgradient.depth.search import Blurs, Problem, Search, one_focus
from focalgradient.depth.settings import RecoverySettings
from focalgradient.depth.validity import DOUBTFUL, LEAST_BLUR, LEAST_NODES, TRIMMED
from focalgradient.errors import InputError
from focalgradient.optics import Aperture, Optics
from focalgradient.psf import Annulus, Blend, Disc, Gaussian, Psf
from focalgradient.psf.shapes import disc_transfer

__all__ = ["Alternative", "check_model", "judge_blur", "likelier_slip", "misordered_apertures"]


def refit(
    models: Iterable[Blurs],
    part: RegisteredViews,
    weight: Image,
    noise_sd: Sequence[float],
    window: float,
    power: FloatArray | None = None,
) -> Iterator[tuple[Equalised, Nodes]]:
    """Fit a part of the views, over the pixels of `weight` (H x W, 0 or 1), by each of the `models` in turn.

    Yield the views compared by each, and the depth. `power` is that of the sharp scene, where it is known.
    """
    for blurs in models:
        equalised = equalise(part.spectra(blurs.reach), blurs, noise_sd, window=window, power=power)
        yield equalised, equalised.read(weight)


def misfits(fits: Sequence[Nodes]) -> list[float]:
    """Return the median misfit of each fit, at the nodes that all show with texture."""
    use = np.all([nodes.has_texture for nodes in fits], axis=0)
    return [float(np.median(nodes.misfit[use])) if use.any() else 1.0 for nodes in fits]


SHAPE_SIDE = 384
"""Side in pixels of the part of the views in which shapes are compared; limits the time. Chosen by hand."""

LIKELIER_SHAPE = 0.99
"""Ratio of the residual with the likeliest shape to that with the requested one below which the former is named: wrong
shapes leave 1.07 to 1.18 times the noise, correct ones 0.99 to 1.01."""

CANDIDATES: tuple[Psf, ...] = (Disc(), Gaussian(), Blend())
"""Shapes compared with the requested one: a lens without aberrations, the paper's, and an intermediate one."""


def _with_others(shape: Psf) -> list[Psf]:
    """Return a shape, and the `CANDIDATES` of other kinds."""
    return [shape, *(other for other in CANDIDATES if type(other) is not type(shape))]


def judge_shape(
    split: SplitBand, problem: Problem, shape: Psf, noise_sd: Sequence[float]
) -> tuple[dict[str, dict[str, float]], list[str], bool]:
    """Compare shapes of blur where coarse and fine detail disagree by `shape`; return the fits and the warnings.

    A fit is the median "misfit" over what noise explains, and "tau", the model error by the split-band test. Also
    return whether another shape is likelier.
    """
    if split.tau < DOUBTFUL:
        return {}, [], False
    search, part = problem.search, problem.registered.most_textured_crop(SHAPE_SIDE)
    weight, shapes = part.usable.astype(np.float32), _with_others(shape)
    refined, taus = [], []
    for equalised, nodes in refit(map(search.blurs, shapes), part, weight, noise_sd, problem.settings.window):
        nodes = equalised.refine(nodes, equalised.evaluate_to_refine(nodes, equalised.evaluate(nodes)), weight)
        images = equalised.evaluate_images(nodes)[1]
        halves = DetailHalves.of(equalised, nodes, images, weight, nodes.is_textured)
        refined.append(nodes)
        taus.append(halves.test().tau)
    left = misfits(refined)
    best = left.index(min(left))
    # The shape that leaves least may yet err more in depth: then neither is right.
    is_better = left[best] < LIKELIER_SHAPE * left[0] and taus[best] < taus[0]
    advice = "no other shape explains the views better: calibrate the camera, and check its focus and apertures"
    if is_better:
        better = shapes[best]
        more = "".join(f", {name}={value:g}" for name, value in better.stated().items())
        advice = (
            f"{better} is likelier (its residual is {left[best]:.2f} times the noise's, {shape}'s {left[0]:.2f}): "
            f"compare psf={better.name!r}{more}, or calibrate the camera"
        )
    text = (
        f"the blur is not quite {shape}: depth from coarse detail and depth from fine detail differ by {split.tau:.0%} "
        f"of the blur, which is part of the standard deviations; {advice}."
    )
    fits = zip(shapes, left, taus, strict=True)
    return {str(one): {"misfit": misfit, "tau": tau} for one, misfit, tau in fits}, [text], is_better


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

COMPARED = 3
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
    if misfit < SUSPECT and explained > UNEXPLAINED and tau < DOUBTFUL:
        return {}, []
    search, settings, registered = problem.search, problem.settings, problem.registered
    given, part = settings.given_noise(len(problem.views)), registered.most_textured_crop(NOISE_SIDE)
    sample = part.most_textured_crop(SAMPLE_SIDE)
    models = {STATED: [search.blurs(one) for one in _with_others(shape)]}
    for name, optics in _slips([view.optics for view in problem.views]):
        with suppress(InputError):  # the limits leave these nothing to search
            other = Search.over(optics, search.pixel_angle, settings.near, settings.far, shape)
            models[name] = [other.blurs(shape)]

    def compared(
        part: RegisteredViews, names: Iterable[str], noise_sd: Sequence[float], stride: int = 1
    ) -> dict[str, float]:
        """Return what each hypothesis leaves in a part of the views, by the best of its models."""
        whose = [name for name in names for _ in models[name]]
        every = (blurs.every(stride) for name in names for blurs in models[name])
        weight = part.usable.astype(np.float32)
        left = misfits([nodes for _, nodes in refit(every, part, weight, noise_sd, settings.window)])
        return {name: min(m for m, owner in zip(left, whose, strict=True) if owner == name) for name in names}

    left = compared(sample, models, noise_sd, SAMPLE_LEVELS)
    ranked = sorted((name for name in left if name != STATED), key=lambda name: left[name])[:COMPARED]
    left = {name: left[name] for name in (STATED, *ranked)}
    # Noise that wrong optics inflate hides what they leave, but not that a slip leaves less: seldom worth estimating.
    if not ranked or left[ranked[0]] >= PROMISING * left[STATED]:
        return left, []
    every = [blurs for name in left for blurs in models[name]]
    noises = [noise_from_residuals(registered, blurs, settings.window, given)[0] for blurs in every[1:]]
    left = compared(part, left, min([noise_sd, *noises], key=lambda noise_sd: float(np.sum(np.log(noise_sd)))))
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
    best = min(left, key=lambda name: left[name], default=STATED)
    most, ratio = (EXPLAINS_COMMON, LIKELIER_COMMON) if best.endswith(COMMON) else (EXPLAINS[1], LIKELIER)
    is_likelier = best != STATED and EXPLAINS[0] <= left[best] <= min(most, ratio * left[STATED])
    return best if is_likelier else None


def _slips(optics: Sequence[Optics]) -> Iterator[tuple[str, list[Optics]]]:
    """Yield likely slips, and the intended optics of each."""
    apertures, foci = [o.aperture_diameter for o in optics], [o.focus_vergence for o in optics]
    slips = [("the apertures in reverse order", apertures[::-1], foci)]
    if len(set(apertures)) > 1 or len(set(foci)) > 2:
        slips.append(("the foci in reverse order", apertures, foci[::-1]))
    if len(set(apertures)) > 1:
        slips.append(("apertures and foci in reverse order", apertures[::-1], foci[::-1]))
    if len(set(foci)) > 1:  # of one focus, a common factor leaves the same
        slips += [(f"{factor:.2g} times {COMMON}", [a / factor for a in apertures], foci) for factor in FACTORS]
    # Of two views the other's factor leaves the same, but for a common factor.
    widest = apertures.index(max(apertures))
    for number in range(len(apertures)) if len(apertures) > 2 else [widest]:
        for factor in FACTORS:
            meant = [a / factor if n == number else a for n, a in enumerate(apertures)]
            if len(set(zip(meant, foci, strict=True))) > 1:
                slips.append((f"{factor:.2g} times the f-number of view {number + 1}", meant, foci))
    for n in range(len(foci) - 1) if len(set(foci)) > 2 else ():
        exchanged = [*foci[:n], foci[n + 1], foci[n], *foci[n + 2 :]]
        slips.append((f"the foci of views {n + 1} and {n + 2} exchanged", apertures, exchanged))
    for name, diameters, vergences in slips:
        if (diameters, vergences) != (apertures, foci):
            yield name, [Aperture(*one) for one in zip(diameters, vergences, strict=True)]


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


@dataclass(frozen=True, slots=True)
class Alternative:
    """A blur that explains the views better than the one asked for."""

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


SAMPLE_SIDE, SAMPLE_LEVELS = 128, 2
"""Side in pixels of the sample of the views in which slips and blurs are compared first, and stride of its levels."""


def judge_blur(problem: Problem, blurs: Blurs, noise_sd: Sequence[float], is_consistent: Mask) -> Alternative | None:
    """Return the changed blur that explains views in one waveband clearly better than `blurs`, or None.

    Only pixels whose views agree count (H x W): no blur explains what occlusion leaves. A change whose gain in a sample
    of the views lies `CLEARLY_SDS` below `WORTHWHILE` is not looked at further.
    """
    # A displacement, which the user is warned about, looks like other blur.
    if problem.registered.warnings or not blurs.frequencies.is_radial or blurs.parts:
        return None
    part = replace(problem.registered, usable=problem.registered.usable & is_consistent).most_textured_crop(NOISE_SIDE)
    power = scene_power(part.spectra(blurs.reach).over(noise_sd), noise_sd, blurs.frequencies)
    gains = partial(_gains, noise_sd=noise_sd, settings=problem.settings, power=power)
    sample = gains(part.most_textured_crop(SAMPLE_SIDE), blurs.every(SAMPLE_LEVELS))
    first = ((cause, *next(models)) for cause, models in sample)
    promising = {cause: mean + CLEARLY_SDS * error > WORTHWHILE for cause, mean, error, _ in first}
    if promising and not any(promising.values()):
        return None
    likelier: list[tuple[float, Alternative]] = []  # with the lower bound of the gain
    for cause, models in gains(part, blurs):
        before, accepted = WORTHWHILE, []
        for mean, error, change in models if promising.get(cause, True) else ():  # while stronger ones explain more
            if mean < CLEARLY_SDS * error or mean <= before:
                break
            before = mean
            accepted.append((mean - CLEARLY_SDS * error, Alternative(cause, mean / error, change)))
        likelier += sorted(accepted, key=lambda pair: -pair[0])[:1]
    # Of models that the views hardly tell apart, that which would change depth most.
    surest = max((surely for surely, _ in likelier), default=0.0)
    some = (found for surely, found in likelier if surely >= AS_LIKELY * surest)
    return max(some, key=lambda found: found.change, default=None)


def _gains(
    part: RegisteredViews, blurs: Blurs, *, noise_sd: Sequence[float], settings: RecoverySettings, power: FloatArray
) -> Iterator[tuple[str, Iterator[tuple[float, float, float]]]]:
    """Yield causes of changed blur, and what its models gain over `blurs`, from weak to strong.

    The mean difference of a window's log likelihoods, its standard error, and the change of depth as a share of the
    blur radius. Nothing where too little texture is left.
    """
    inner = ndimage.binary_erosion(np.ones(part.shape, np.bool_), iterations=min(part.shape) // 12)
    weight = (part.usable & inner).astype(np.float32)
    again = partial(refit, part=part, weight=weight, noise_sd=noise_sd, window=settings.window, power=power)
    equalised, nodes = next(again([blurs]))
    use = nodes.has_texture & nodes.inside
    if use.sum() < LEAST_NODES:
        return
    windows = use.sum() * equalised.step**2 / equalised.window_size()
    pixels = equalised.levels_per_pixel * np.maximum(LEAST_BLUR, equalised.blur(nodes.level)[use])

    def gain(other: Nodes) -> tuple[float, float, float]:
        # Noise is not known well where the model is wrong: each window's likelihood is that with its own.
        ratio = np.maximum(nodes.misfit, 0.01) / np.maximum(other.misfit, 0.01)
        gained = (np.log(ratio) * nodes.support * equalised.window_size() / 2)[use]
        low, high = np.quantile(gained, [TRIMMED, 1 - TRIMMED])
        kept = gained[(gained >= low) & (gained <= high)]
        error = float(kept.std() + 1e-9) / math.sqrt((1 - 2 * TRIMMED) * windows)
        change = np.abs(other.level - nodes.level)[use] / pixels
        return float(kept.mean()), error, float(np.quantile(change, SHARE))

    for cause, models in _changed(blurs, isinstance(settings.psf, Disc)):
        yield cause, (gain(other) for _, other in again(models))


def _changed(own: Blurs, discs: bool) -> Iterator[tuple[str, Iterable[Blurs]]]:
    """Yield causes, and the blur of the views under each, from weak to strong."""
    for form, lens, transfers in _SHAPES if discs else ():
        shaped = (transfer(RADII, own.radius[:, :, None]) for transfer in transfers)
        cause = f"the blur is likelier {form} than a uniform disc, as that of a {lens} is"
        yield cause, (replace(own, transfer=one.astype(own.transfer.dtype)) for one in shaped)
    for number in range(len(own.transfer)):
        softer = (np.exp(-2 * (np.pi * sd * own.frequencies.radius) ** 2) for sd in SOFTER)
        is_softer = (np.arange(len(own.transfer)) == number)[:, None, None]
        gains = (np.where(is_softer, gain, 1.0).astype(own.transfer.real.dtype) for gain in softer)
        yield (
            f"view {number + 1} is softer, beside the rest, than its optics make it, as where it was denoised, "
            "enlarged or compressed, the camera moved, or another view was sharpened",
            (replace(own, transfer=own.transfer * gain) for gain in gains),
        )


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
    likelier = {} if alternative is None else asdict(alternative)
    details = {"fit_by_shape": shapes, "fit_by_optics": slips, "likelier": likelier}
    return {name: found for name, found in details.items() if found}, texts


DETAIL_SIDE = 1024
"""Side in pixels of the most textured part, in which detail is compared; limits the time. Chosen by hand."""

SCALES = (1.0, 1.5, 2.0)
"""Standard deviations in pixels of the narrower of two Gaussians, whose difference is the detail compared."""

FREQUENCY = 0.14
"""Middle frequency (cycles per pixel) of the detail at the finest scale, for the effect of diffraction."""

MARGIN = 8
"""Distance in pixels from saturated and masked pixels within which detail is left out. Chosen by hand."""

SHARPER, SOFTER_BY = 1.05, 0.95
"""The order is contradicted if the larger aperture has more than `SHARPER` times the smaller one's detail, and this
less than `SOFTER_BY` times that of the larger one. Of 29 pairs of photographs (20 rooms) none was contradicted as
stated, and 24 were (15 rooms) when reversed (`benchmarks/aperture_order.py`)."""

GREEN = 550e-9
"""Wavelength in metres of the diffraction that softens the smaller aperture in focus."""


def misordered_apertures(registered: RegisteredViews, search: Search) -> str | None:
    """Return a clause about two views whose f-numbers seem to be in the opposite order; None if there are none.

    Each view's detail is predicted from the other's by least squares: noise and displacement can only reduce it.
    """
    apertures = [optics.aperture_diameter for optics in search.optics]
    comparable = one_focus(search.focus) and len(set(search.wavebands)) == 1 and search.isotropic
    if not comparable or len(set(apertures)) == 1:
        return None
    part = registered.most_textured_crop(DETAIL_SIDE)
    inside = ndimage.minimum_filter(part.usable, 2 * MARGIN + 1, mode="constant", cval=False)

    def details(image: Image) -> list[NDArray[np.float32]]:
        smooth = {scale: smoothed(image, scale) for scale in {*SCALES, *(2 * scale for scale in SCALES)}}
        return [(smooth[scale] - smooth[2 * scale])[inside] for scale in SCALES]

    contrasts = [[float(np.linalg.norm(detail)) for detail in details(image)] for image in part.images]
    placed: list[list[NDArray[np.float32]]] = []
    for pair in combinations(range(len(apertures)), 2):
        small, large = sorted(pair, key=lambda number: apertures[number])
        cut_off = (np.inf if apertures[n] == 0 else apertures[n] / GREEN for n in (small, large))
        in_focus = [max(0.0, 1 - 1.27 * FREQUENCY / search.pixel_angle / limit) for limit in cut_off]
        if apertures[small] == apertures[large] or in_focus[0] == 0:
            continue
        # Less contrast contradicts nothing however the views are placed, which takes most of the time.
        if not any(less < more for less, more in zip(contrasts[small], contrasts[large], strict=True)):
            continue
        if not placed:
            shifts = (measure_placement(part.images[0], image, part.usable)[0] for image in part.images[1:])
            moved = (resample(image, shift)[0] for image, shift in zip(part.images[1:], shifts, strict=True))
            placed = [details(image) for image in (part.images[0], *moved)]
        softened = in_focus[0] / in_focus[1]
        for one, other in zip(placed[small], placed[large], strict=True):
            shared = float(one @ other)
            less, more = (shared / max(float(detail @ detail), 1e-30) for detail in (other, one))
            if more > SHARPER / softened and less < SOFTER_BY * softened:
                return (
                    f"view {large + 1} shows finer detail than view {small + 1} ({more:.2f} times its contrast), but "
                    "is stated to have the larger aperture: their f-numbers are probably in the opposite order "
                    f"(f_number); if not, view {small + 1} was moved, denoised or focused elsewhere"
                )
    return None
