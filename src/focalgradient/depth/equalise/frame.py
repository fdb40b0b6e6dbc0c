"""Depth of a whole frame: joined from its tiles at nodes, then carried to pixels, with its uncertainty and validity."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.equalise.likelihood import Equalised, Nodes
from focalgradient.depth.equalise.outline_jumps import (
    ALL_WINDOWS,
    SCATTER_WINDOWS,
    between_surfaces,
    variance_beside_jumps,
)
from focalgradient.depth.equalise.outlines import HALF, Outlines, curvature_variance
from focalgradient.depth.equalise.parts import Refined, Tile, join_nodes
from focalgradient.depth.equalise.residuals import BAND
from focalgradient.depth.equalise.signal import AROUND, Signal, informative_nodes
from focalgradient.depth.equalise.split_band import SplitBand, join_splits
from focalgradient.depth.equalise.wavebands import BandGains, common_error
from focalgradient.depth.noise import NoiseLaw, uneven_noise
from focalgradient.depth.numerics import block_mean
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Blurs, Problem, Search
from focalgradient.depth.validity import LARGEST_TAU, LEAST_BLUR, LEAST_SHARE, blur_is_known
from focalgradient.optics import capabilities

__all__ = ["Frame", "depth_at_nodes", "depth_at_pixels"]

FILTER_REACH = 2.0
"""Spatial support of the filters for different wavebands, in blur radii, over which surfaces mix. Chosen by hand."""

MODEL_ERRS = 1.03
"""Median misfit above which the blur model is considered wrong: correct models have 0.99 to 1.01."""

COHERENT = 0.1
"""Amplitude of the part of the model error that is uniform over a window and resembles a difference of depth, relative
to the other part: with it 94 to 99 % of depth on natural texture in JPEG of quality 90 and 95 lies within two sd;
quality 75, with 73 %, would need 0.2 (`benchmarks/stored_photographs.py`)."""

COMPRESSED = 0.3
"""`COHERENT` for noise that increases with contrast: in five rooms in JPEG of quality 75, 92 % of depth lies within two
sd with it, 79 % with 0.1; 89 % in ten held-out rooms (`benchmarks/rooms.py`)."""

KNOWN_IN_BANDS = 0.2
"""Maximum standard deviation of the blur radius, relative to it, for valid depth from different wavebands; most of it
comes from the wavebands' gain, an error common to the whole frame. On 60 coloured walls 57 % of the pixels are valid
with 0.2 and 52 % with 0.1; 99 % of either lie within two sd (`benchmarks/coloured_walls.py`)."""

TENTH, BLUR_BESIDE = 0.1, 0.15
"""Maximum standard deviation of a surface near an occlusion boundary for valid depth: relative to its distance, or of
its blur radius in pixels, whichever is larger. Between boundaries closer than a window, surfaces are less certain."""

OTHER_SURFACE = 0.25
"""Standard deviation of the vergence of an untextured surface about that of the textured one beside it, relative to the
frame's median vergence: in rooms the root mean square error of depth is 0.18 of vergence where texture ends and 0.12
elsewhere; on rendered layers 0.4 on the blank surface (`benchmarks/rooms.py`)."""


@dataclass(slots=True, eq=False)
class Frame:
    """Results of the tiles of a frame, H x W each."""

    is_consistent: Mask  # whether a pixel's views agree
    beyond: NDArray[np.int8]  # 1 nearer than the search, -1 farther
    is_textured: Mask  # depth rests on texture at the pixel itself
    other_surface: NDArray[np.float32]  # probability that a pixel belongs to a surface without texture
    outlines: Outlines | None = None
    tiles: list[tuple[Tile, Nodes]] = field(default_factory=list)
    splits: list[SplitBand] = field(default_factory=list)

    @classmethod
    def empty(cls, shape: tuple[int, int]) -> Frame:
        """Allocate a frame of `shape`, to be filled."""
        consistent, textured = np.empty((2, *shape), np.bool_)
        return cls(consistent, np.empty(shape, np.int8), textured, np.empty(shape, np.float32))

    def fill(
        self, tile: Tile, beyond: NDArray[np.int8], refined: Refined, split: SplitBand, outlines: Outlines | None
    ) -> None:
        """Store the results of one tile."""
        self.beyond[tile.core] = beyond[tile.within]
        for name in ("is_consistent", "is_textured", "other_surface"):
            getattr(self, name)[tile.core] = getattr(refined, name)[tile.within]
        self.tiles.append((tile, refined.nodes))
        self.splits.append(split)
        if outlines is not None:
            self.outlines = self.outlines or Outlines.none(self.is_consistent.shape)
            self.outlines.fill(tile, outlines)


def depth_at_nodes(
    frame: Frame, equalised: Equalised, blurs: Blurs, gains: BandGains | None, outlines: bool, compressed: bool
) -> tuple[Nodes, SplitBand, FloatArray]:
    """Join the tiles' depth at nodes, and raise its uncertainty near jumps of depth.

    Also return the variance of depth (h x w, levels squared) where it is not plane, or near jumps.

    Parameters
    ----------
    frame
        What the tiles give. In different wavebands, pixels between two surfaces are made inconsistent.
    equalised
        The step, the window and the levels that all tiles share.
    blurs
        The views' blur at each level.
    gains
        What views in different wavebands share; None: all are in one.
    outlines
        Whether outlines were looked for.
    compressed
        Whether the views show JPEG blocks.
    """
    shape = frame.is_consistent.shape
    nodes = join_nodes(frame.tiles, shape, equalised.step)
    split, blur = join_splits(frame.splits), equalised.blur(nodes.level)
    if gains is None:
        # Where the views contradict each other, as on dark bars, depth is not claimed, and bends none beside it; but
        # where most of them do in JPEG, as on blank paper, what agrees is chance.
        is_seen = block_mean(frame.is_consistent, equalised.step) >= HALF
        if compressed:
            is_seen |= ndimage.gaussian_filter(is_seen.astype(float), equalised.window / equalised.step) < HALF
        variance = np.zeros(nodes.level.shape)
        if outlines:
            variance = curvature_variance(equalised, nodes, informative_nodes(nodes) & is_seen)
            # An error of the model bends depth, too, and is part of the sd already.
            by_model = split.tau * np.maximum(LEAST_BLUR, blur) * equalised.levels_per_pixel
            variance = np.maximum(variance - by_model**2, 0)
        counted = replace(nodes, sd=np.where(is_seen, nodes.sd, np.inf))
        beside = variance_beside_jumps(equalised, counted, SCATTER_WINDOWS)
        return replace(nodes, sd=np.sqrt(nodes.sd**2 + beside)), split, variance
    # No outline is looked for, and filters carry one side over the other as far as blur reaches.
    reach = FILTER_REACH * float(np.median(blur))
    beside, farther = (variance_beside_jumps(equalised, nodes, ALL_WINDOWS, pixels) for pixels in (0.0, reach))
    variance, nodes = np.maximum(farther - beside, 0), replace(nodes, sd=np.sqrt(nodes.sd**2 + beside))
    is_between, added = between_surfaces(equalised, nodes, informative_nodes(nodes, one_waveband=False))
    frame.is_consistent &= ~equalised.to_blocks(is_between, shape)
    moved = np.interp(nodes.level, np.arange(equalised.levels), common_error(gains, blurs))
    return replace(nodes, sd=np.hypot(nodes.sd, moved)), split, variance + added


def depth_at_pixels(
    problem: Problem,
    equalised: Equalised,
    frame: Frame,
    nodes: Nodes,
    jump_variance: FloatArray,
    signal: Signal,
    tau: float,
    law: NoiseLaw | None,
) -> tuple[NDArray[np.float32], NDArray[np.float32], Mask, NDArray[np.float32]]:
    """Interpolate depth from nodes to pixels, replace it near outlines, and decide which pixels are valid.

    Returns vergence and its sd in dioptres, which pixels are valid, and the part of the sd that is due to a surface
    without texture, where this is the likelier one (else 0); H x W each.

    `tau` is the model error as a share of the blur radius, `law` that by which noise rises.
    """
    search, registered, step = problem.search, problem.registered, equalised.step
    shape, is_informative = registered.shape, signal.is_informative
    coherent = np.zeros(nodes.level.shape)
    if signal.one_waveband:
        coherent = _coherent_error(equalised, nodes, is_informative, _by_contrast(law, registered, step))
    vergence, sd, is_known = _interpolated(
        equalised, nodes, jump_variance, coherent, search, tau, shape, signal.one_waveband
    )
    is_valid = signal.is_trusted & is_known & frame.is_consistent & equalised.to_blocks(is_informative, shape)
    if frame.outlines is not None and signal.is_trusted:
        at = frame.outlines.is_replaced
        vergence[at], sd[at], is_near_valid = _near_outlines(frame.outlines, coherent, step, search, tau)
        # Both sides of an outline are continued from places about it: some must rest on signal.
        reach = 2 * math.ceil(AROUND * problem.settings.window / step) + 1
        is_about = ndimage.maximum_filter(is_informative & nodes.has_texture, reach)
        is_valid[at] = (is_near_valid & registered.usable & equalised.to_blocks(is_about, shape))[at]
    beside_sd = np.zeros(shape, np.float32)
    if signal.one_waveband:
        is_valid &= frame.is_textured & (tau <= LARGEST_TAU)
        if is_valid.any():
            apart = OTHER_SURFACE * np.float32(np.median(np.abs(vergence[is_valid])))
            other_sd = apart * np.sqrt(frame.other_surface)
            sd = np.hypot(sd, other_sd)
            beside_sd = np.where(frame.other_surface > 0.5, other_sd, np.float32(0))
    mixture = capabilities(problem.views[0].optics).mixture
    if mixture is not None:
        sd = np.hypot(sd, mixture.focus_sd.astype(np.float32))
    return vergence, sd, is_valid, beside_sd


def _by_contrast(law: NoiseLaw | None, registered: RegisteredViews, step: int) -> FloatArray:
    """Return the share of the noise's variance that rises with contrast, at nodes of `step` pixels (h x w)."""
    if law is None:
        return np.zeros([-(-n // step) for n in registered.shape])
    image = 1 - (uneven_noise(replace(law, by_contrast=0.0), registered) / uneven_noise(law, registered)) ** 2
    return block_mean(image, step)


def _coherent_error(equalised: Equalised, nodes: Nodes, is_informative: Mask, by_contrast: FloatArray) -> FloatArray:
    """Return the sd of depth due to the coherent part of the model error, in levels (h x w).

    Compression, for one, takes away weak fine detail, alike over whole windows. Of that only what does not look like a
    difference of depth is left of the views, as more than noise or as noise `by_contrast` (share of the variance, h x
    w); the rest is taken to be a share of it. Where nodes are not informative the nearest that are stand for them.
    """
    none = np.zeros(nodes.level.shape)
    if not is_informative.any() or (np.median(nodes.misfit[is_informative]) < MODEL_ERRS and not by_contrast.any()):
        return none
    noise = np.interp(nodes.level, np.arange(equalised.levels), equalised.noise / equalised.scale)
    slope = np.interp(nodes.level, np.arange(equalised.levels), equalised.noise_slope)
    # The derivative's power is the texture times what noise adds to the variance of the score.
    beyond = COHERENT**2 * np.maximum(nodes.misfit - 1, 0) + COMPRESSED**2 * by_contrast
    error = np.sqrt(beyond * noise / (np.maximum(nodes.texture, 1) * slope))
    nearest = ndimage.distance_transform_edt(~is_informative, return_distances=False, return_indices=True)
    return np.asarray(error[tuple(nearest)], float)


def _model_sd(coherent: FloatArray, radius: FloatArray, search: Search, tau: float) -> FloatArray:
    """Return the sd of vergence due to the model error: `tau` of the blur, or the `coherent` error (in levels).

    Both measure one error, and the larger counts.
    """
    return np.maximum(coherent * search.spacing, tau * np.maximum(LEAST_BLUR, radius) / search.slope)


def _interpolated(
    equalised: Equalised,
    nodes: Nodes,
    jump_variance: FloatArray,
    coherent: FloatArray,
    search: Search,
    tau: float,
    shape: tuple[int, int],
    one_waveband: bool,
) -> tuple[NDArray[np.float32], NDArray[np.float32], Mask]:
    """Interpolate vergence and its sd to each pixel of a frame of `shape`; also whether noise leaves the blur known.

    The model's error (`coherent`: h x w, levels), and the variance near jumps, are part of the sd, but make no pixel
    invalid.
    """
    step = equalised.step
    height, width = shape
    vergence, vergence_sd = np.empty(shape, np.float32), np.empty(shape, np.float32)
    is_known = np.empty(shape, np.bool_)
    rows = step * max(1, BAND // (step * width))
    for top in range(0, height, rows):  # by bands, for large frames
        first, last = max(0, top // step - 1), -(-min(height, top + rows) // step) + 1
        part = slice(first, last)
        size = (min(height, last * step) - first * step, width)
        cut = slice(top - first * step, min(height, top + rows) - first * step)
        level, sd, more, error = (
            equalised.to_pixels(v[part], nodes.sd[part], size)[cut]
            for v in (nodes.level, nodes.sd, jump_variance, coherent)
        )
        band = slice(top, top + rows)
        vergence[band] = search.lowest + level * search.spacing
        radius = search.radius(vergence[band].astype(float))
        share = LEAST_SHARE if one_waveband else KNOWN_IN_BANDS  # of different wavebands, coarse and fine detail differ
        is_known[band] = blur_is_known(sd * search.spacing * search.slope, radius, share)
        sd = np.sqrt(sd**2 + more)
        vergence_sd[band] = np.hypot(sd * search.spacing, _model_sd(error, radius, search, tau))
    return vergence, vergence_sd, is_known


def _near_outlines(
    ends: Outlines, coherent: FloatArray, step: int, search: Search, tau: float
) -> tuple[NDArray[np.float32], NDArray[np.float32], Mask]:
    """Return vergence and its sd where outlines replace the depth of windows, and (H x W) whether it is valid.

    A pixel's side of the outline is part of the sd, but makes no pixel invalid.
    """
    at = ends.is_replaced
    vergence = search.lowest + np.clip(ends.level[at], 0, search.levels - 1) * search.spacing
    radius = search.radius(vergence.astype(float))
    sd = np.hypot(ends.sd[at], ends.side_sd[at]) * search.spacing
    is_valid = ends.is_valid.copy()
    own_sd = ends.sd[at] * search.spacing
    is_valid[at] &= blur_is_known(own_sd * search.slope, radius)
    is_valid[at] &= own_sd <= np.maximum(TENTH * vergence, BLUR_BESIDE / search.slope)
    y, x = np.nonzero(at)
    return vergence, np.hypot(sd, _model_sd(coherent[y // step, x // step], radius, search, tau)), is_valid
