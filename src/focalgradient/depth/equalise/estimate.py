"""The default method: maximum likelihood by equalisation over the whole image (Pentland 1987, Eqs. 7-11, any optics).

Registered views are equalised at every candidate depth (`focalgradient.depth.equalise.likelihood`), and the depth that
fits best is taken; pixels whose views contradict each other at every depth are left out and masked.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient.depth.equalise.alternatives import judge_alternatives
from focalgradient.depth.equalise.blur_shape import judge_shape
from focalgradient.depth.equalise.curves import curves
from focalgradient.depth.equalise.likelihood import (
    Equalised,
    Nodes,
    SharedPower,
    equalise,
    scene_power,
)
from focalgradient.depth.equalise.optics_check import judge_optics
from focalgradient.depth.equalise.outline_jumps import between_surfaces
from focalgradient.depth.equalise.outline_places import zone_reach
from focalgradient.depth.equalise.outlines import Outlines, curvature_variance, find_outlines, may_jump, overlap
from focalgradient.depth.equalise.robust import Part, Robust, read_again, robust_depth
from focalgradient.depth.equalise.signal import (
    EXPLAINED,
    NEARLY_NOTHING,
    among_outside,
    informative_nodes,
    left_on_blank,
    outside_range,
    why_rejected,
)
from focalgradient.depth.equalise.split_band import SplitBand, split_band_test
from focalgradient.depth.equalise.texture import OwnTexture
from focalgradient.depth.equalise.tiles import join_nodes, join_splits, tiles, tiles_about
from focalgradient.depth.equalise.uneven_noise import brightness_of_noise, even_out, uneven_noise
from focalgradient.depth.equalise.wavebands import BandGains, common_error, estimate_band_gains
from focalgradient.depth.estimate import Estimate, Problem
from focalgradient.depth.filters import FloatArray
from focalgradient.depth.model_error import DOUBTFUL, LARGEST_TAU, LEAST_BLUR
from focalgradient.depth.noise import LENIENCE, NoiseLaw, noise_from_residuals
from focalgradient.depth.numerics import HELD_APART, NODES, block_sum
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Blurs, Search
from focalgradient.depth.validity import blur_is_known
from focalgradient.optics import capabilities
from focalgradient.psf import Disc, Psf

__all__ = ["estimate"]

LEFT = 1.03
"""Median of what is left of the views, over the noise's power, from which the model errs: right models leave 0.99 to
1.01."""

COHERENT = 0.1
"""Amplitude of that part of the model's error which looks like a difference of depth, alike over a window, over that of
the part which is left: with it 94 to 99 % of depth on natural texture in JPEG of quality 90 and 95 lies within two sd;
quality 75, with 73 %, would need 0.2 (`benchmarks/stored_photographs.py`)."""

COMPRESSED = 0.3
"""The same for noise that rises with contrast: in five rooms in JPEG of quality 75, 92 % of depth lies within two sd
with it, 79 % with 0.1; and 89 % in ten that were left out of the choice (`benchmarks/rooms.py`)."""

FARTHER = 2.0
"""How far filters carry one surface over another in different wavebands, in radii of blur."""

EXPLAINED_COLOURED = 0.75
"""Share of the places with texture whose views must agree for anything to be claimed of textures in several colours,
whose wavebands differ: walls whose depth is wrong by a dioptre, or by 1.5 sd, have 0.57 and 0.60 of a photograph and of
random colours, those that are right mostly more than 0.85 (`benchmarks/coloured_walls.py`)."""

FINER, LEAST_WINDOW = 0.625, 2.0
"""Size of the windows in which depth about outlines is estimated, over that of the settings, and the least of them in
pixels. Near outlines of eight scenes of spheres (seeds 5, 6, 8, 11 and 12) 12.1 % of what is claimed is off by more
than 10 % with windows of the settings' size, 10.0 % with 0.75 of it, 8.7 % with this, and 9.0 % with 0.5."""

AROUND = 4.0
"""Windows about a place over which it is judged whether depth there lies outside the range searched: a choice."""

TENTH, BLUR_BESIDE = 0.1, 0.15
"""Share of its distance, or blur radius in pixels, to which a surface must be known about an outline for depth to be
claimed: the greater holds. Between outlines closer together than windows are wide, surfaces are less known."""

OTHER_SURFACE = 0.25
"""Standard deviation of the vergence of a surface without texture about that of the textured one beside it, over the
frame's median vergence: in rooms, depth where texture ends errs by 0.18 of itself in the root mean square, and by 0.12
where it does not; on rendered layers by 0.4 on the blank surface (`benchmarks/rooms.py`)."""

BAND = 4_000_000
"""Pixels that are worked out at a time."""

COMMON = 1024
"""Side in pixels of the part of a large frame from which is estimated what all its tiles have in common."""


def estimate(problem: Problem) -> Estimate:
    """Depth by equalisation, for `focalgradient.recover_depth`."""
    search, registered, settings = problem.search, problem.registered, problem.settings
    settings.progress(0.15, "estimating noise")
    blurs = search.blurs(settings.psf).averaged(registered.shares)
    noise_sd, raisable, gains = _noise_and_gains(problem, blurs)
    settings.progress(0.4, "equalising blur")
    shared = None if gains is None else gains.shared
    frame = _by_tiles(problem, blurs, noise_sd, raisable, shared)
    settings.progress(0.9, "estimating depth")
    equalised, nodes, agrees, split, noise_sd = frame.equalised, frame.nodes, frame.agrees, frame.split, frame.noise_sd
    shape = settings.psf if isinstance(settings.psf, Psf) else None
    alternative = None
    # A displacement, which the user is warned about, looks like other blur.
    if gains is None and not registered.warnings and blurs.frequencies.down is None and not blurs.parts:
        alternative = judge_alternatives(problem, blurs, noise_sd, isinstance(shape, Disc))
    tau = split.tau if alternative is None else max(split.tau, min(alternative.change, LARGEST_TAU))
    if gains is not None:
        moved = np.interp(nodes.level, np.arange(search.levels), common_error(gains, blurs))
        nodes = replace(nodes, sd=np.hypot(nodes.sd, moved))

    informative = informative_nodes(nodes, gains is None)
    left = np.zeros(nodes.level.shape)
    if gains is None:
        informative &= ~among_outside(nodes, AROUND * settings.window / equalised.step)
        left = _coherent_error(equalised, nodes, informative, _by_contrast(frame.law, registered, equalised.step))
    one_waveband = gains is None
    vergence, vergence_sd, known = _to_pixels(
        equalised, nodes, frame.curved, left, search, tau, registered.shape, one_waveband
    )
    textured = (nodes.texture >= 1) & (nodes.support > 0.5)
    explained = float(informative[textured].mean()) if textured.any() else 0.0
    # Where most of the texture, or depth from most of its detail, contradicts the model, weak texture proves nothing.
    # Views in different wavebands have texture of their own, which is modelled: coarse and fine detail may differ.
    least = EXPLAINED if gains is None or not gains.coloured else EXPLAINED_COLOURED
    sound = gains is None or (gains.comparable and explained >= least)
    # What a user gives as noise may be more than there is.
    images = [view.image for view in problem.views]
    blank = left_on_blank(nodes, informative, images) if gains is None and settings.noise is None else None
    trusted = sound and blank is None
    valid = trusted & known & agrees & equalised.to_blocks(informative, registered.shape)
    ends = frame.outlines if trusted else None
    if ends is not None:
        at = ends.replaced
        vergence[at], vergence_sd[at], known_there = _about_outlines(ends, left, equalised.step, search, tau)
        # Both sides of an outline are continued from places about it: some must rest on signal.
        reach = 2 * math.ceil(AROUND * settings.window / equalised.step) + 1
        about = equalised.to_blocks(ndimage.maximum_filter(informative & textured, reach), registered.shape)
        valid[at] = (known_there & registered.usable & about)[at]
    if gains is None:
        valid &= frame.textured.present
        if valid.any():
            apart = OTHER_SURFACE * np.float32(np.median(np.abs(vergence[valid])))
            vergence_sd = np.hypot(vergence_sd, apart * np.sqrt(frame.textured.other_surface))
    mixture = capabilities(problem.views[0].optics).mixture
    if mixture is not None:
        vergence_sd = np.hypot(vergence_sd, mixture.focus_sd.astype(np.float32))
    shapes: dict[str, dict[str, float]] = {}
    texts: list[str] = []
    misfit = float(np.median(nodes.misfit[textured] if textured.any() else nodes.misfit))
    slips: dict[str, float] = {}
    if gains is None and shape is not None:
        slips, texts = judge_optics(problem, shape, misfit, explained, split.tau)
    # A displacement, which the user is warned about, looks like blur of another shape.
    if gains is None and not registered.warnings and valid.any():
        named, is_better = texts, False
        if shape is not None and not named:
            shapes, texts, is_better = judge_shape(split, problem, shape, noise_sd, 1.0)
        larger = [alternative.text] if alternative is not None and alternative.change >= DOUBTFUL else []
        if named:
            texts = [*named, *larger]
        elif not is_better:
            texts = split.warnings() or larger or texts
    untrusted = valid.mean() < NEARLY_NOTHING and (bool(textured.any()) or blank is not None)
    searched = search.lowest, search.highest
    why = why_rejected(nodes, explained, split.tau, gains is not None, blank, searched) if untrusted else ""
    outside = float(outside_range(nodes)[textured].mean()) if textured.any() else 0.0
    reason = {"rejected": why, "share_outside_range": outside} if untrusted else {}
    return Estimate(
        vergence,
        vergence_sd,
        valid=valid,
        noise=[sd * gain for sd, gain in zip(noise_sd, registered.gains, strict=True)],
        details={
            **({} if gains is None else gains.stated(search.wavebands)),
            "noise_by_brightness": None if frame.law is None else asdict(frame.law),
            "misfit": float(np.median(nodes.misfit)),
            "split_band": split.stated(),
            **({"fit_by_shape": shapes} if shapes else {}),
            **({"fit_by_optics": slips} if slips else {}),
            **({} if alternative is None else {"likelier": asdict(alternative)}),
            "share_of_texture_explained": explained,
            **({"outlines": [] if ends is None else curves(ends.side)} if settings.outlines else {}),
            "share_disagreeing": float(1 - agrees.mean()),
            **reason,
        },
        warnings=texts,
    )


def _by_contrast(law: NoiseLaw | None, registered: RegisteredViews, step: int) -> FloatArray:
    """Share of the noise's variance that rises with contrast, at nodes of `step` pixels (h x w)."""
    if law is None:
        return np.zeros([-(-n // step) for n in registered.shape])
    image = 1 - (uneven_noise(replace(law, by_contrast=0.0), registered) / uneven_noise(law, registered)) ** 2
    return block_sum(image, step) / block_sum(np.ones_like(image), step)


def _coherent_error(
    equalised: Equalised, nodes: Nodes, informative: NDArray[np.bool_], by_contrast: FloatArray
) -> FloatArray:
    """Standard deviation of depth from what the model's error leaves of the views beyond noise, in levels (h x w).

    Compression, for one, takes away weak fine detail, alike over whole windows. Of that only what does not look like a
    difference of depth is left of the views, as more than noise or as noise `by_contrast` (share of the variance, h x
    w); the rest is held to be a share of it. Where nodes are not `informative` the nearest that are stand for them.
    """
    none = np.zeros(nodes.level.shape)
    if not informative.any() or (np.median(nodes.misfit[informative]) < LEFT and not by_contrast.any()):
        return none
    place = np.arange(equalised.levels)
    noise, slope = (sum(getattr(r, name) for r in equalised.residuals) for name in ("noise", "noise_slope"))
    # The derivative's power is the texture times what noise adds to the variance of the score.
    power = np.maximum(nodes.texture, 1) * np.interp(nodes.level, place, slope)
    beyond = COHERENT**2 * np.maximum(nodes.misfit - 1, 0) + COMPRESSED**2 * by_contrast
    error = np.sqrt(beyond * np.interp(nodes.level, place, noise) / power)
    nearest = ndimage.distance_transform_edt(~informative, return_distances=False, return_indices=True)
    return np.asarray(error[tuple(nearest)], float)


def _model_sd(left: FloatArray, radius: FloatArray, search: Search, tau: float) -> FloatArray:
    """Standard deviation of vergence from the model's error: `tau` of the blur, or by what is `left` (in levels).

    Both measure one error, and the larger counts.
    """
    return np.maximum(left * search.spacing, tau * np.maximum(LEAST_BLUR, radius) / search.slope)


def _model_holds(radius: FloatArray, tau: float) -> NDArray[np.bool_]:
    """Where a model that errs by `tau` of the blur leaves its `radius` (pixels) known."""
    return blur_is_known(tau * np.maximum(LEAST_BLUR, radius), radius, LARGEST_TAU)


def _to_pixels(
    equalised: Equalised,
    nodes: Nodes,
    curved: FloatArray,
    left: FloatArray,
    search: Search,
    tau: float,
    shape: tuple[int, int],
    one_waveband: bool,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
    """Vergence, its sd, and whether noise leaves the blur known, at each pixel of a frame of `shape`.

    The model's error (`left`: h x w, levels), and what is not plane (`curved`: h x w, levels squared), are part of the
    sd, but make no pixel invalid.
    """
    height, width = shape
    step = equalised.step
    vergence, vergence_sd = np.empty(shape, np.float32), np.empty(shape, np.float32)
    known = np.empty(shape, np.bool_)
    rows = step * max(1, BAND // (step * width))
    for top in range(0, height, rows):  # by bands, for large frames
        first, last = max(0, top // step - 1), -(-min(height, top + rows) // step) + 1
        part = slice(first, last)
        size = (min(height, last * step) - first * step, width)
        cut = slice(top - first * step, min(height, top + rows) - first * step)
        level, sd, more, error = (
            equalised.to_pixels(v[part], nodes.sd[part], size)[cut] for v in (nodes.level, nodes.sd, curved, left)
        )
        band = slice(top, top + rows)
        vergence[band] = search.lowest + level * search.spacing
        radius = search.radius(vergence[band].astype(float))
        known[band] = blur_is_known(sd * search.spacing * search.slope, radius)
        if one_waveband:  # of others coarse and fine detail may differ
            known[band] &= _model_holds(radius, tau)
        sd = np.sqrt(sd**2 + more)
        vergence_sd[band] = np.hypot(sd * search.spacing, _model_sd(error, radius, search, tau))
    return vergence, vergence_sd, known


def _about_outlines(
    ends: Outlines, left: FloatArray, step: int, search: Search, tau: float
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
    """Vergence and its sd where outlines replace what windows give, and (H x W) whether it is valid.

    A pixel's side of the outline is part of the sd, but makes no pixel invalid.
    """
    at = ends.replaced
    vergence = search.lowest + np.clip(ends.level[at], 0, search.levels - 1) * search.spacing
    radius = search.radius(vergence.astype(float))
    sd = np.hypot(ends.sd[at], ends.side_sd[at]) * search.spacing
    valid = ends.valid.copy()
    own_sd = ends.sd[at] * search.spacing
    valid[at] &= blur_is_known(own_sd * search.slope, radius) & _model_holds(radius, tau)
    valid[at] &= own_sd <= np.maximum(TENTH * vergence, BLUR_BESIDE / search.slope)
    y, x = np.nonzero(at)
    return vergence, np.hypot(sd, _model_sd(left[y // step, x // step], radius, search, tau)), valid


def _noise_and_gains(problem: Problem, blurs: Blurs) -> tuple[list[float], float | None, BandGains | None]:
    """Noise of each registered view, by how much its variance may be raised, and what different wavebands share."""
    settings, registered, wavebands = problem.settings, problem.registered, problem.search.wavebands
    given = settings.given_noise(len(problem.views))
    if len(set(wavebands)) == 1:
        noise_sd, raisable = noise_from_residuals(registered, blurs, settings.window, given)
        return noise_sd, raisable, None
    known = None if given is None else noise_from_residuals(registered, blurs, settings.window, given)[0]
    part = registered.most_textured_crop(256)
    mixtures = [one.mixture for one in problem.search.stated]
    expected = None
    if mixtures[0] is not None:  # then all are
        stated = np.array([(one.gain / mixtures[0].gain, one.gain_sd) for one in mixtures if one is not None])
        expected = stated[:, 0], stated[:, 1]
    gains = estimate_band_gains(wavebands, part, blurs, settings.window, known, expected)
    return gains.noise_sd, LENIENCE**2, gains


@dataclass(frozen=True, slots=True, eq=False)
class _Frame:
    """Depth of the whole frame at nodes, with what it was estimated from."""

    equalised: Equalised  # of the last tile, without images: its step and window are all tiles'
    nodes: Nodes
    curved: FloatArray  # h x w: variance of depth where it is not plane, or near jumps, in levels squared
    agrees: NDArray[np.bool_]  # H x W
    textured: OwnTexture
    split: SplitBand
    noise_sd: list[float]  # of each view
    law: NoiseLaw | None  # where noise rises with brightness
    outlines: Outlines | None


def _by_tiles(
    problem: Problem, blurs: Blurs, noise_sd: list[float], raisable: float | None, shared: SharedPower | None
) -> _Frame:
    """Depth of registered views, a large frame's by tiles."""
    search, registered, settings = problem.search, problem.registered, problem.settings
    blur, levels_per_pixel = search.radius(search.vergences), 1 / (search.slope * search.spacing)
    step = max(1, round(settings.window / NODES))
    parts = list(tiles(registered.shape, step))
    # What is common to all tiles: noise, its law and the scene's spectrum.
    crop, inward = registered, parts[0].inward(registered.shape)
    if len(parts) > 1:
        crop = registered.most_textured_crop(COMMON)
        inward = np.full(crop.shape, max(registered.shape))
    ready: Equalised | None = None
    whole = Part(crop, inward, settings.false_alarm, blur, levels_per_pixel)
    at = None if raisable is None else brightness_of_noise(registered)
    for again in (False, True):
        power = scene_power(crop.images, noise_sd, blurs.frequencies) if len(parts) > 1 else None
        first = equalise(
            crop.images, blurs, noise_sd, window=settings.window, shared=shared, power=power, shares=crop.shares
        )
        law, some = _even_out(first, whole, at, shared is None)
        if again or raisable is None or law is None or not law.by_contrast or len(set(noise_sd)) == 1:
            break
        # Compression's errors have the spectrum of neither view's noise, by which these were distinguished: all are
        # treated alike.
        noise_sd = [math.sqrt(float(np.mean(np.square(noise_sd))))] * len(noise_sd)
    scale = 1.0 if raisable is None else min(raisable, first.noise_found(some))
    if len(parts) > 1:
        parts = list(tiles(registered.shape, step, sum(len(one.images) for one in first.residuals)))
        noise_sd, scale = [math.sqrt(scale) * sd for sd in noise_sd], 1.0
    else:
        ready = first
    del first
    agrees, present = (np.empty(registered.shape, np.bool_) for _ in range(2))
    textured = OwnTexture(present, np.empty(registered.shape, np.float32))
    found, splits, ends = [], [], None
    for number, tile in enumerate(parts):
        if len(parts) > 1:
            settings.progress(0.4 + 0.5 * number / len(parts), f"equalising blur, tile {number + 1} of {len(parts)}")
        views = tile.of(registered) if len(parts) > 1 else registered
        if ready is not None:
            equalised, ready = ready, None
        else:
            equalised = equalise(
                views.images, blurs, noise_sd, window=settings.window, shared=shared, power=power, shares=views.shares
            )
            if law is not None:
                equalised.divide(uneven_noise(law, views))
        compressed = law is not None and law.by_contrast > 0
        part = Part(views, tile.inward(registered.shape), settings.false_alarm, blur, levels_per_pixel, compressed)
        robust, split = _robustly(equalised, part, scale)
        agrees[tile.core] = robust.agrees[tile.within]
        textured.present[tile.core] = robust.textured.present[tile.within]
        textured.other_surface[tile.core] = robust.textured.other_surface[tile.within]
        found.append((tile, robust.nodes))
        splits.append(split)
        # Wavebands have textures of their own, whose residuals are no contradiction.
        if settings.outlines and shared is None:
            outlines = _outlines(equalised, robust, part, blurs, split.tau)
            if outlines is not None:
                ends = ends or Outlines.none(registered.shape)
                ends.fill(tile, outlines)
            del outlines
        if number + 1 < len(parts):
            del equalised, robust, part  # before the next tile's are made
    nodes = join_nodes(found, registered.shape, step)
    curved, split = np.zeros(nodes.level.shape), join_splits(splits)
    if settings.outlines and shared is None:
        curved = curvature_variance(nodes, informative_nodes(nodes), blurs.radius, equalised, levels_per_pixel)
        # An error of the model bends depth, too, and is part of the sd already.
        radius = np.interp(nodes.level, np.arange(search.levels), blur)
        curved = np.maximum(curved - (split.tau * np.maximum(LEAST_BLUR, radius) * levels_per_pixel) ** 2, 0)
    if shared is not None:  # no outline is looked for, and filters carry one side over the other as far as blur reaches
        reach = FARTHER * float(np.median(np.interp(nodes.level, np.arange(search.levels), blur)))
        curved = equalised.farther_from_jumps(nodes, reach)
    nodes = equalised.beside_jumps(nodes)
    if shared is not None:
        good = informative_nodes(nodes, one_waveband=False)
        between, variance = between_surfaces(equalised, nodes, good, blurs.radius, levels_per_pixel)
        agrees &= ~equalised.to_blocks(between, registered.shape)
        curved += variance
    noise_sd = [math.sqrt(robust.scale) * sd for sd in noise_sd]  # of one tile; of more, scaled above
    return _Frame(equalised.part(slice(0), slice(0)), nodes, curved, agrees, textured, split, noise_sd, law, ends)


def _even_out(
    equalised: Equalised, part: Part, brightness: float | None, one_waveband: bool
) -> tuple[NoiseLaw | None, Nodes]:
    """Make noise even where it rises with brightness or contrast (`even_out`): its law, and the nodes.

    Photons of different wavebands, with textures of their own, are not compared.
    """
    weight = part.usable(equalised).astype(np.float32)

    def read(_: bool) -> Nodes:
        mean, support = equalised.averages(equalised.energy(weight), weight)
        return equalised.minima(mean[:, ::2, ::2], support[::2, ::2])

    # Only once: where contradiction is wide, what is left of it after each round would pass for ever less noise.
    return even_out(equalised, read, part.views, brightness, 2) if one_waveband else (None, read(False))


def _robustly(equalised: Equalised, part: Part, scale: float) -> tuple[Robust, SplitBand]:
    """Depth without contradicting pixels, and the model's error; `scale` is the noise variance over the one assumed."""
    used = part.usable(equalised)
    robust = robust_depth(equalised, part, used, equalised.energy(used.astype(np.float32)), scale)
    # The test's filters would carry what is saturated, or comes from beyond the frame, over the rest. Where both are
    # left out, a residual that is a multiple of its derivative stays so, and with it the depth that it gives.
    kept, weight = robust.within.astype(np.float32), (robust.agrees & robust.within).astype(np.float32)
    images = [(kept * value, kept * derivative) for value, derivative in robust.images]
    informative = informative_nodes(robust.nodes)
    args = (equalised, robust.nodes, images, weight, part.blur, part.levels_per_pixel, scale, informative)
    return robust, split_band_test(*args)


def _outlines(equalised: Equalised, robust: Robust, part: Part, blurs: Blurs, tau: float) -> Outlines | None:
    """Outlines of a part of the frame, and depth about them, from narrower windows; None where there are none."""
    levels_per_pixel, found = part.levels_per_pixel, None
    narrow = equalised.in_windows(max(LEAST_WINDOW, FINER * equalised.window))
    informative, agrees = informative_nodes(robust.nodes), robust.agrees
    some = may_jump(equalised, robust.nodes, informative, agrees, blurs.radius, levels_per_pixel, tau)
    reach, shape = zone_reach(blurs.radius, equalised.window), robust.agrees.shape
    some = block_sum(equalised.to_blocks(some, shape).astype(np.float32), narrow.step) > 0
    for tile in tiles_about(some, narrow.step, shape, reach, overlap(narrow)):
        finer, here = narrow.part(*tile.outer), part.of(tile)
        used = here.usable(finer) & robust.used[tile.outer]
        energy = finer.energy(used.astype(np.float32))
        fine = robust_depth(finer, here, used, energy, robust.scale, HELD_APART)
        outlines = find_outlines(
            finer,
            fine.nodes,
            partial(read_again, fine),
            informative_nodes(fine.nodes),
            fine.agrees,
            blurs.radius,
            levels_per_pixel,
            robust.scale,
            here.views.images,
            tau,
            equalised.window,
        )
        if outlines is not None:
            found = found or Outlines.none(shape)
            found.fill(tile, outlines)
    return found
