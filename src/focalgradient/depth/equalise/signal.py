"""Whether depth rests on signal: where, whether anything is claimed, and if not, why."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from focalgradient.arrays import Mask
from focalgradient.depth import numerics
from focalgradient.depth.equalise.likelihood import Equalised, Nodes, ResidualStatistics
from focalgradient.depth.equalise.wavebands import BandGains
from focalgradient.depth.filters import Image, smoothed
from focalgradient.depth.read import CHANGING
from focalgradient.depth.search import Problem, Search, one_focus
from focalgradient.depth.validity import LEAST_BLUR_SD, MIN_SUPPORT, NEARLY_NOTHING, OUTSIDE

__all__ = [
    "AROUND",
    "BY_CHANCE",
    "EXPLAINED",
    "JPEG_BLOCK",
    "UNEXPLAINED",
    "Signal",
    "among_outside",
    "are_compressed",
    "beyond_ends",
    "beyond_infinity",
    "indicating_nodes",
    "informative_nodes",
    "left_on_blank",
    "outside_range",
    "own_texture",
    "rests_on_texture",
    "steps_at_blocks",
]

NARROW = 0.5
"""Size of the window for nearby texture relative to the window of depth. Chosen by hand, with `NEAR`."""

NEAR = 0.02
"""Minimum proportion of the information in the wide window that the narrow one must contain: a quarter for uniform
texture, less than this for an isolated edge more than 1.6 standard deviations of the wide window away."""

OWN_SD, OWN = 2.0, 0.1
"""Standard deviation in pixels of a pixel's own window; and minimum information per pixel there, relative to that in
the window of depth, for depth to be based on texture at the pixel: 1 on uniform texture, 0.4 at 2 pixels beyond the end
of texture, 0.07 at 4."""

MAX_GAP = 8
"""Maximum width in pixels of a gap in texture that still counts as textured, as texture is uneven: about the default
window. Chosen by hand."""

SEEN_LACK = 0.6
"""Expected information, relative to the contribution of noise to the derivative's power, above which its absence is
detectable: two standard deviations of the mean over a pixel's own window (0.28)."""

LACKING = 0.3
"""Information at a pixel, relative to the contribution of noise to the derivative's power, below which it has none: the
error of its mean over a pixel's own window (0.28)."""

LACK_SD, EVEN_CHANCE = 4.0, 0.1
"""Standard deviation in pixels of the window in which untextured pixels are counted; and proportion of these at which
the pixel is equally likely to belong to the untextured and to the textured surface. Blur and windows carry texture
about 5 pixels beyond its end, so that the proportion is 0.1 at the end itself."""

MOST_CURVATURE = 5.0
"""Ratio of the curvature of the cost to that implied by the residual's derivative above which the minimum is not a
depth: 0.5 to 3.2 at the true depth, 8 to thousands if the truth lies outside the search range (walls through eyes and
lenses, 5th to 95th percentile)."""


def rests_on_texture(equalised: Equalised, nodes: Nodes, local: ResidualStatistics, weight: Image) -> tuple[Mask, Mask]:
    """Test whether each node's depth rests on texture near it, and whether depth curves its cost.

    A blank surface beside a strong edge would take the edge's depth, with all that compression, the model and the
    linearised fit err there: its texture is in the window's tail. And a minimum must be a depth: the cost's curvature,
    from which `nodes` have their texture, must be the power of the residual's derivative beyond noise (White 1982).

    Parameters
    ----------
    equalised, nodes
        The views, compared at every level, and their depth.
    local
        Residual statistics of each pixel at that depth.
    weight
        H x W, 0 or 1: the pixels that are used.

    Returns
    -------
    near, curved_by_depth
        Both h x w.
    """
    by_noise = numerics.at_levels(equalised.noise_derivative, local.level)
    unit = numerics.at_levels(equalised.scale * equalised.noise_slope, local.level)
    power, unit = (
        numerics.block_sum(weight * image, equalised.step).astype(np.float32)[None]
        for image in (local.slope - by_noise, unit)
    )
    window = equalised.window / equalised.step
    wide, narrow = (numerics.gather(power, size)[0] for size in (window, NARROW * window))
    curvature = nodes.texture * numerics.gather(unit, window)[0]
    by_depth = curvature <= MOST_CURVATURE * np.maximum(wide, 0)
    # At a focus that all views share, the derivative vanishes, and the cost goes by the fourth power of blur.
    return np.asarray(narrow >= NEAR * wide), by_depth | (equalised.even.rate_at(nodes.level) < CHANGING)


def own_texture(equalised: Equalised, local: ResidualStatistics, weight: Image) -> tuple[Mask, Image]:
    """Test whether information about depth lies at each pixel, and not only beside it in its window (H x W).

    Also returns the probability that a pixel belongs to a surface without texture, beside that which is seen.

    A blank surface beside a textured one is given the other's depth by every window that reaches over both. Where that
    with texture ends, blur leaves open to a few pixels. In compressed views small gaps in texture count as such, too:
    compression removes weak texture, and leaves lone edges. The other arguments are those of `rests_on_texture`.
    """
    by_noise = numerics.at_levels(equalised.noise_derivative, local.level)
    power = weight * (local.slope - by_noise)
    count, own_count = (smoothed(weight, sd) + 1e-6 for sd in (equalised.window, OWN_SD))
    around = smoothed(power, equalised.window) / count
    own = smoothed(power, OWN_SD) / own_count
    at_focus = equalised.even.rate_at_pixels(local.level) < CHANGING
    has = (own >= OWN * around) | (OWN * around < SEEN_LACK * by_noise) | at_focus
    shows = (own >= np.maximum(OWN * around, LACKING * by_noise)) | at_focus
    lacks = weight * ~(shows if equalised.compressed else _without_gaps(shows))
    share = smoothed(lacks, LACK_SD) / (smoothed(weight, LACK_SD) + 1e-6)
    return _without_gaps(has), (share / (share + EVEN_CHANCE)).astype(np.float32)


def _without_gaps(textured: Mask) -> Mask:
    """Close gaps up to `MAX_GAP` pixels wide."""
    reach = MAX_GAP // 2
    disc = np.hypot(*np.mgrid[-reach : reach + 1, -reach : reach + 1]) <= MAX_GAP / 2
    wide = np.pad(textured, MAX_GAP, mode="edge").view(np.uint8)
    closed = cv2.morphologyEx(wide, cv2.MORPH_CLOSE, disc.view(np.uint8), borderValue=0)
    return closed[MAX_GAP:-MAX_GAP, MAX_GAP:-MAX_GAP].astype(np.bool_)


MISFIT = 4.0
"""Maximum ratio of the residual to the noise power in the wide window for valid depth: an amplitude of twice the noise.
Chosen by hand."""

EXPLAINED = 0.5
"""Minimum proportion of textured places at which the views must agree for any valid depth (our choice). Places are
counted instead of power, because in nearly noiseless views the strongest contrasts contradict every model, first of all
at occlusion boundaries."""

EXPLAINED_COLOURED = 0.65
"""`EXPLAINED` for textures in several colours, whose wavebands differ: 0.52 to 0.60 for photographs and random colours
on walls whose depth is in error by 0.7 D and more, or by 1.5 sd (`benchmarks/coloured_walls.py`)."""

AROUND = 4.0
"""Size in windows of the neighbourhood in which it is tested whether depth lies outside the search range (our choice).
"""

BARE = 0.3
"""Proportion of the frame with texture below which it may consist of edges on blank surfaces (our choice; printed
squares: 0.07 to 0.16)."""

UNEVEN = 8.0
"""Maximum factor by which a non-uniform residual increases the texture required (our choice)."""

LESS_THAN_NOISE = 0.5
"""Median misfit at places with apparent signal below which they contain none: 0.05 to 0.45 on blank paper in JPEG of
quality 60 to 80, whose compression leaves some blocks flat; 0.9 and more on texture."""

JPEG_BLOCK, STEP_AT_BLOCKS = 8, 1.5
"""Side in pixels of a JPEG block (its standard); and ratio of the step between blocks to that within them above which
blocks are visible: 2.05 and more on blank paper in JPEG of quality 50 to 95, below 1.12 in losslessly stored scenes."""

FAINT_STEP_AT_BLOCKS = 1.15
"""`STEP_AT_BLOCKS` above which views are taken for compressed: 1.18 and more in 20 rooms of quality 75 and on sheets of
quality 75 to 95, at most 1.12 in losslessly stored scenes."""

LINES = 256
"""Maximum number of rows or columns in which JPEG blocks are searched in large frames: sufficient for their mean."""

BLANK, MORE = 0.25, 2.0
"""Proportion of grid points with signal below which a frame is mostly blank, and median misfit of all grid points above
which the residual is not noise. Blank paper in JPEG of quality 90 and 95 has 0 to 0.04 and 2.1 to 4.6, printed squares
0.19 to 0.37 and 0.8 to 1.8."""

BY_CHANCE = 1.5
"""Ratio of the residual to the noise power above which the model is considered wrong: includes chance, and noise missed
by the estimate. Chosen by hand."""

OVER_ERROR = 20.0
"""Ratio of texture to the residual of the model error above which depth is based on texture; model error is
proportional to contrast. The residual is 1/100 to 1/300 of that power on a photographed flat sheet and on rendered
squares, and 1/6 to 1/25 on photographs of printed squares whose optics are misstated."""

BEYOND_INFINITY, UNEXPLAINED = 0.1, 0.8
"""Proportion of the frame beyond infinity above which, and of its texture explained below which, more blur than
infinity has is named. With foci in feet they are 0.36 and 0.46, with a scene at infinity 0 and 1."""


@dataclass(frozen=True, slots=True, eq=False)
class Signal:
    """Grid points of a frame whose depth is based on signal, and whether any of it is valid."""

    one_waveband: bool  # whether all views are in one
    is_informative: Mask  # h x w: depth rests on signal
    explained: float  # share of the places with texture that are informative
    blank: float | None  # misfit of views without signal (`left_on_blank`)
    is_trusted: bool  # whether depth is claimed anywhere

    @classmethod
    def of(cls, problem: Problem, nodes: Nodes, gains: BandGains | None, step: int) -> Signal:
        """Judge a frame by its `nodes`, `step` pixels apart, and by what wavebands share (None: all are in one)."""
        one_waveband, settings = gains is None, problem.settings
        is_informative = informative_nodes(nodes, one_waveband)
        if one_waveband:
            is_informative &= ~among_outside(nodes, AROUND * settings.window / step)
        textured = is_informative[nodes.has_texture]
        explained = float(textured.mean()) if textured.size else 0.0
        # Where most of the texture, or depth from most of its detail, contradicts the model, weak texture proves
        # nothing. Views in different wavebands have texture of their own, which is modelled: coarse and fine detail may
        # differ.
        least = EXPLAINED if gains is None or not gains.coloured else EXPLAINED_COLOURED
        is_explained = gains is None or (gains.comparable and explained >= least)
        # What a user gives as noise may be more than there is.
        images = [view.image for view in problem.views]
        blank = left_on_blank(nodes, is_informative, images) if one_waveband and settings.noise is None else None
        return cls(one_waveband, is_informative, explained, blank, is_explained and blank is None)

    def misfit(self, nodes: Nodes) -> float:
        """Return the median misfit where there is texture, if anywhere."""
        textured = nodes.misfit[nodes.has_texture]
        return float(np.median(textured if textured.size else nodes.misfit))

    def rejection(self, nodes: Nodes, tau: float, searched: tuple[float, float], is_valid: Mask) -> dict[str, Any]:
        """Return why almost no pixel is valid (H x W) although the views show texture; else an empty dictionary."""
        textured = nodes.has_texture
        if is_valid.mean() >= NEARLY_NOTHING or not (textured.any() or self.blank is not None):
            return {}
        outside = float(outside_range(nodes)[textured].mean()) if textured.any() else 0.0
        return {"rejected": self._reason(nodes, tau, searched, outside), "share_outside_range": outside}

    def _reason(self, nodes: Nodes, tau: float, searched: tuple[float, float], outside: float) -> str:
        """Return the reason why no depth is valid although the views contain texture.

        `searched` are the lowest and the highest candidate vergence (D), `outside` the share of the texture outside.
        """
        if self.blank is not None:
            return (
                "the views contain little but noise, which is not uniform, as after compression: store the views "
                "without loss, or crop them to the textured part"
            )
        textured, explained = nodes.has_texture, self.explained
        if outside > OUTSIDE:
            remedy = (
                "change near and far, focus nearer to them, or correct the focus distance (focus_distance)"
                if self.one_waveband
                else "focus the eye nearer to them, correct its refraction, or close its pupil"
            )
            return (
                f"no depth between {searched[0]:.3g} and {searched[1]:.3g} D explains {outside:.0%} "
                "of the places with texture: they most likely lie outside the range searched, or are more blurred than "
                f"leaves detail: {remedy}"
            )
        if not self.one_waveband and explained >= EXPLAINED:
            return (
                "what the wavebands show cannot be compared, as where most of the frame is much blurred in one of "
                "them, or their textures differ: focus nearer to the scene, or close the pupil"
            )
        remedy = (
            "check their optics, order and alignment; where these are right, the noise is more than its estimate, or "
            "the blur is of another shape: give noise, or psf"
        )
        if explained >= EXPLAINED:
            why = f"depth from coarse detail and depth from fine detail differ by {tau:.0%} of the blur"
            return f"the views contradict each other, as {why}: {remedy}"
        clear, weak = textured & ~_contradicts(nodes), textured & ~_clear_of_noise(nodes)
        if np.sum(clear & weak) > np.sum(textured & ~clear):
            return (
                f"at {np.sum(clear & weak) / textured.sum():.0%} of the places with texture it is not clear of noise, "
                f"which is {_unevenness(nodes):.2g} times as strong in some places as in others, as compression or a "
                "rendering with few rays makes it: store the views without loss, or with less noise"
            )
        if textured.mean() < BARE:
            remedy += "; hard edges on a blank surface, such as printed squares, are for method edges"
        return (
            f"the views contradict each other, as at {1 - explained:.0%} of the places with texture more is left of "
            f"them than noise explains (median: {self.misfit(nodes):.2g} times its power): {remedy}"
        )


def beyond_infinity(share: float, explained: float) -> list[str]:
    """Return the warning for a frame of which a `share` has more blur than infinity, where depth is searched to it.

    >>> beyond_infinity(0.36, 0.46)[0][:55]
    '36% of the frame has more blur than infinity would have'
    """
    if share < BEYOND_INFINITY or explained > UNEXPLAINED:
        return []
    return [
        f"{share:.0%} of the frame has more blur than infinity would have: it lies nearer than the plane of focus "
        "(limit the search: near, far), or this plane is nearer than stated: check focus_distance, and that it is in "
        "metres."
    ]


def informative_nodes(nodes: Nodes, one_waveband: bool = True) -> Mask:
    """Return the grid points whose depth is based on signal, and not on noise or on contradictions of the model.

    Where the residual is uneven (uneven light, compression, an imperfect model), as much of it as the factor between
    its strongest and its weakest places can look like texture: blank paper. Where the model errs, texture
    must be clear of what the error leaves. In different wavebands texture of their own, which is modelled, is uneven by
    nature.
    """
    informative = indicating_nodes(nodes, one_waveband)
    return informative & _clear_of_noise(nodes) if one_waveband else informative


def indicating_nodes(nodes: Nodes, one_waveband: bool = True) -> Mask:
    """Return grid points with more texture than noise, which may still be non-uniform noise: weak evidence of depth."""
    textured = nodes.texture >= np.maximum(1, nodes.misfit)
    if one_waveband:
        textured &= ~_contradicts(nodes)
    located = nodes.unambiguous & nodes.inside & nodes.curved_by_depth
    return located & textured & (nodes.support >= MIN_SUPPORT) & (nodes.misfit < MISFIT)


def beyond_ends(nodes: Nodes, search: Search) -> NDArray[np.int8]:
    """Return (h x w) 1 where a surface lies nearer than the search, as the likelihood still rises there; -1: farther.

    Of `nodes` over all pixels: where no depth searched explains the views, all are rejected later. Less blur than at an
    end where there is hardly any is not evidence.
    """
    ends = search.radius(search.vergences[[0, -1]])
    is_sign = (ends >= LEAST_BLUR_SD) | (not one_focus(search.focus))
    last = nodes.level > (search.levels - 1) / 2
    is_outside = ~nodes.inside & (nodes.support >= MIN_SUPPORT) & is_sign[last.astype(int)]
    return (is_outside * np.where(last, 1, -1)).astype(np.int8)


def outside_range(nodes: Nodes) -> Mask:
    """Return the nodes that no candidate explains: the fit leaves the range, or the cost's minimum is not a depth."""
    return ~nodes.inside | ~nodes.curved_by_depth


def among_outside(nodes: Nodes, width: float) -> Mask:
    """Grid points (h x w) with much texture outside the search range around them, whose own depth is in it by chance.

    Parameters
    ----------
    nodes
        Depth at nodes.
    width
        Standard deviation in nodes of the window about each.
    """
    textured = nodes.has_texture.astype(float)
    outside, all_of_them = (
        ndimage.gaussian_filter(some, width, mode="constant") for some in (textured * outside_range(nodes), textured)
    )
    return np.asarray(outside > OUTSIDE * np.maximum(all_of_them, 1e-6))


def steps_at_blocks(image: NDArray[np.floating], order: int = 1) -> list[float]:
    """Return the step between JPEG blocks over that within them, down and across an image (H x W): 1 without blocks.

    Steps are differences of an `order`. A place of a block stands out if it does so in the mean over all blocks and in
    the lower quartile: a pattern of a multiple of their side has steps at some of them only.

    >>> paper = np.random.default_rng(0).standard_normal((96, 96))
    >>> blocks, squares = (np.kron(paper[: 96 // n, : 96 // n], np.ones((n, n))) for n in (8, 24))
    >>> [max(steps_at_blocks(paper / 4 + pattern)) > STEP_AT_BLOCKS for pattern in (0, blocks, squares)]
    [False, True, False]
    """
    found = []
    for lines in (image, image.T):
        some = lines[:, :: max(1, lines.shape[1] // LINES)]
        step = np.abs(np.diff(some, order, axis=0)).mean(axis=1)
        blocks = step[: len(step) // JPEG_BLOCK * JPEG_BLOCK].reshape(-1, JPEG_BLOCK)
        if not blocks.any():
            found.append(1.0)
            continue
        some = blocks[blocks.any(axis=1)]
        places = np.sort([some.mean(axis=0), np.quantile(some, 0.25, axis=0)])
        found.append(float((places[:, -1] / np.maximum(np.median(places[:, :-1], axis=1), 1e-30)).min()))
    return found


def are_compressed(images: Sequence[Image]) -> bool:
    """Return whether any of the views (H x W each) shows blocks of JPEG, be they faint."""
    return max(max(steps_at_blocks(image)) for image in images) > FAINT_STEP_AT_BLOCKS


def left_on_blank(nodes: Nodes, informative: Mask, images: Sequence[Image]) -> float | None:
    """Return the median misfit if the views contain no signal but non-uniform noise; else None.

    A residual below the noise indicates blank paper only in views (`images`, H x W each) with visible JPEG blocks;
    otherwise the noise may be overestimated, as where bars before a wall contradict every depth.
    """
    seen = nodes.is_supported
    if not (seen & informative).any():
        return None
    there, all_over = (float(np.median(nodes.misfit[some])) for some in (seen & informative, seen))
    if there < LESS_THAN_NOISE and max(max(steps_at_blocks(image)) for image in images) > STEP_AT_BLOCKS:
        return there
    return all_over if informative[seen].mean() < BLANK and all_over > MORE else None


def _unevenness(nodes: Nodes) -> float:
    """Ratio of the strongest to the weakest residual over the frame: about 1.2 for uniform noise.

    Places whose views contradict each other do not count, as outlines do.
    """
    residual = nodes.misfit[nodes.is_supported & (nodes.misfit < MISFIT)]
    if not residual.size:
        return 1.0
    weak, strong = np.quantile(residual, [0.05, 0.95])
    return float(np.clip(strong / max(weak, 1e-6), 1.0, UNEVEN))


def _clear_of_noise(nodes: Nodes) -> Mask:
    """Return the grid points whose texture exceeds the noise and its non-uniformity."""
    return np.asarray(nodes.texture >= _unevenness(nodes) * np.maximum(1, nodes.misfit))


def _contradicts(nodes: Nodes) -> Mask:
    """Return the grid points whose texture does not exceed the residual of the model error."""
    return np.asarray((nodes.texture < OVER_ERROR * (nodes.misfit - BY_CHANCE)) | (nodes.misfit >= MISFIT))
