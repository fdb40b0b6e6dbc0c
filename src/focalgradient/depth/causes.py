"""Likely causes of a map without depth, ranked by evidence that is measured in the views.

A map is rejected where views contradict each other, or show nothing to compare. Which of the two it is, and why, is
measured without regard to the method: by registration, by how far coarse detail (which blur leaves alone) agrees, by
how texture compares with noise, by how it is spread over the frame, by the blocks of JPEG, by saturated pixels, and by
other optics that would fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from scipy import ndimage

from focalgradient.arrays import Mask
from focalgradient.depth.equalise.signal import EXPLAINED, JPEG_BLOCK, steps_at_blocks
from focalgradient.depth.filters import Image
from focalgradient.depth.hypotheses import likelier_slip
from focalgradient.depth.registration import misstated_magnification, resample
from focalgradient.depth.search import Estimate, Problem
from focalgradient.depth.validity import OUTSIDE

__all__ = ["Cause", "Evidence", "likely_causes", "measure_evidence", "rank_causes"]

FINE, COARSE = 3.0, 9.0
"""Standard deviations in pixels of the two Gaussians whose difference is coarse detail, which survives small blur."""

BAND_GAIN = (FINE**-2 + COARSE**-2 - 4 / (FINE**2 + COARSE**2)) / (4 * np.pi)
"""Power of white noise of variance 1 in the band of coarse detail (computed)."""

COARSER, WIDE_ENOUGH = 3.0, 8.0
"""Ratio of still coarser detail, which survives blur of 40 pixels, to the coarse one; and the side of a frame in the
wider Gaussian's standard deviations from which it is compared. Chosen by hand."""

# Where evidence counts as clear; each lies between the grid of frames of `tests/depth/test_causes.py` with that cause
# and those with another.
DISPLACED = 1.0
"""Displacement in pixels above which the views are considered displaced."""

ALIGNED_BETTER = 1.5
"""Ratio of decorrelation of coarse detail before to after alignment above which displacement is a likely cause."""

AGREES = 0.35
"""Absolute correlation of coarse detail below which views show different scenes: 0.08 at most for different scenes, 0.4
to 1 for one scene."""

CLEAR = 12.0
"""Ratio of the power of coarse detail to that of noise above which detail is sufficient: 2 to 7.5 where noise or weak
texture leaves nothing valid, otherwise about 900."""

SHARP = 30.0
"""Ratio of a view's power to its noise power above which it contains detail that another view lacks."""

NOISY = 0.01
"""Noise standard deviation relative to the mean light above which noise is named as the cause instead of weak texture
(our choice)."""

CONCENTRATED = 0.2
"""Proportion of blocks that contain 90 % of the gradient energy, below which texture is concentrated: 0.05 for squares
on blank paper, 0.65 to 0.8 for natural texture."""

BLOCKY = 1.6
"""Ratio of the step across block borders to that within blocks above which compression is visible: 5 and more in
JPEG of quality 50 and below, at most 1.05 without compression."""

BLURRED = 8.0
"""Blur radius in pixels of the sharpest view above which large blur is a likely cause; by default radii up to 16 pixels
are searched in the most blurred view."""

SHOWN = 0.6
"""Minimum proportion of the frame that is neither saturated nor masked."""


@dataclass(frozen=True, slots=True)
class Cause:
    """A likely cause of a map without depth.

    Parameters
    ----------
    name
        ``"displacement"``, ``"reversal"``, ``"scenes"``, ``"optics"``, ``"contradiction"``, ``"edges"``, ``"jpeg"``,
        ``"noise"``, ``"texture"``, ``"saturation"``, ``"range"``, ``"blur"`` or ``"unclear"``.
    evidence
        1 where the evidence is as strong as the cause needs; causes are ranked by it.
    text
        Measured value and remedy, a clause.
    """

    name: str
    evidence: float
    text: str


@dataclass(frozen=True, slots=True)
class Evidence:
    """Quantities measured in the views."""

    displacement: float
    """Largest displacement of a view against the first, in pixels, that is left in."""
    agreement: float
    """Correlation of the views' coarse detail, placed as registration found them: that nearest to 0 over views."""
    agreement_as_given: float
    """The same where the views are as given."""
    signal: float
    """Power of the views' coarse detail over that of their noise, in the noisier view."""
    fine_signal: float
    """The same for all detail, in the sharpest view."""
    contrast: float
    """Standard deviation of the coarse detail over the mean light."""
    noise: float
    """Standard deviation of the noise over the mean light, in the noisiest view."""
    textured: float
    """Share of the frame's blocks that hold 90 % of the gradients' energy beyond noise."""
    blocks: float
    """Step between neighbours across the borders of blocks, over that within them: 1 without JPEG."""
    usable: float
    """Share of the frame that is neither saturated nor masked in any view."""
    blur: float
    """Median blur radius in pixels, at the most probable depth, in the view that is sharpest there."""


def likely_causes(problem: Problem, estimate: Estimate, misordered: str | None = None) -> list[Cause]:
    """Return the likely causes of a map without depth, the likeliest first; at least one.

    `misordered` names views whose f-numbers seem to be in the opposite order (`misordered_apertures`).
    """
    outside = estimate.details.get("share_outside_range", 0.0) > OUTSIDE
    causes = rank_causes(
        measure_evidence(problem, estimate),
        problem.settings.method,
        likelier_slip(estimate.details.get("fit_by_optics", {})),
        str(estimate.details["rejected"]) if outside else None,
    )
    if causes[0].name == "displacement" and (text := _magnification(problem)):
        causes = [Cause("optics", causes[0].evidence, text), *causes]
    if misordered is not None:
        causes = [Cause("optics", 1.0, misordered), *causes]
    causes = [cause for cause in causes if cause.evidence > 0]
    explained = float(estimate.details.get("share_of_texture_explained", 1.0))
    if causes and causes[0].name == "edges" and explained < EXPLAINED:
        causes = [_contradiction(problem, estimate, explained), *causes]
    if causes and causes[0].evidence >= 1:
        return causes
    lacking = "no sharp edge that stands alone" if problem.settings.method == "edges" else "too little texture"
    unclear = estimate.details.get("rejected", f"the views show {lacking}, or contradict each other")
    return [Cause("unclear", 1.0, str(unclear)), *causes]


def _magnification(problem: Problem) -> str:
    """Return how the optics misstate a magnification that explains most of the largest displacement, else ""."""
    registered, views = problem.registered, problem.views
    shape, shifts = registered.shape, registered.placements
    number = max(range(1, len(views)), key=lambda at: shifts[at].displacement(shape))
    misstated = misstated_magnification(number + 1, shifts[number], views[0], views[number])
    if misstated and misstated[1].displacement(shape) < shifts[number].displacement(shape) / 2:
        return misstated[0]
    return ""


def _contradiction(problem: Problem, estimate: Estimate, explained: float) -> Cause:
    """Return the cause if the views are textured but agree at no searched depth on most of the texture."""
    lowest, highest = estimate.searched or (problem.search.lowest, problem.search.highest)
    far = "infinity" if lowest <= 0 else f"{1 / lowest:.3g} m"
    text = (
        f"the views contradict each other at {1 - explained:.0%} of the places with texture, whatever the distance "
        f"from {1 / highest:.3g} m to {far}: change near and far if things lie outside that range; else check "
        "the f-numbers and focus distances, and leave out glass, reflections and overexposed parts (crop or mask)"
    )
    return Cause("contradiction", 1.0, text)


BESIDE_EDGES = 0.99
"""Maximum evidence of compression relative to that of hard edges, so that it ranks after them."""


TEXTS = {
    "scenes": "the views do not show one scene (their coarse detail correlates at {agreement:.2f}): check the files, "
    "and that neither camera nor things moved",
    "displacement": "a view is displaced by {displacement:.1f} pixels: align the views (align=True)",
    "reversal": "the contrast of fine, regular texture is reversed in one view against another, as blur that is wider "
    "than the texture's period does, where many depths fit alike: close the aperture, focus nearer to the scene, or "
    "use texture without a period",
    "optics": "the optics seem to be stated wrongly, as the views fit better with {slip}: check the f-numbers and "
    "focus distances, and their order (f_number, focus_distance)",
    "jpeg": "the files show the blocks of JPEG compression, which removes fine detail: store the views without loss",
    "range": "a view shows next to nothing of what another shows, as where its blur exceeds the search: close the "
    "aperture, focus nearer to the scene, reduce the pictures, or give both limits of the search (near, far)",
    "noise": "noise ({noise:.1%} of the light) hides the texture: expose longer, average exposures, or reduce the "
    "pictures",
    "texture": "the scene shows too little texture (contrast {contrast:.2%} of the light): light it from the side, or "
    "project or stick a texture onto it",
    "edges": "nearly all contrast lies in {textured:.0%} of the frame, as of hard edges on blank surfaces: use the "
    "method for edges (method='edges')",
    "saturation": "{unusable:.0%} of the frame is saturated or masked: expose less",
    "blur": "even the sharpest view is blurred by about {blur:.0f} pixels, which leaves too little detail: focus "
    "nearer to the scene, close the aperture, or reduce the pictures",
}
"""What is said of each cause, with fields of `Evidence`; an earlier one also explains the symptoms of later ones."""


def rank_causes(
    found: Evidence, method: str = "equalise", slip: str | None = None, outside: str | None = None
) -> list[Cause]:
    """Rank causes by the measured quantities, for the method that is used.

    `slip` names optics with which the views fit better, `outside` states that depth lies outside the range searched.

    Examples
    --------
    >>> found = Evidence(7.8, 0.98, 0.6, 900.0, 80.0, 0.06, 0.02, 0.7, 1.0, 1.0, 0.0)
    >>> rank_causes(found)[0].name
    'displacement'
    """
    clear_of_noise = found.signal / CLEAR
    lacks = (1 - found.agreement_as_given) / max(1 - found.agreement, 1e-3)
    faint = min(1.0, 1 / max(clear_of_noise, 1e-9))
    one_is_sharp, is_noisy = found.fine_signal >= SHARP, found.noise >= NOISY
    one_scene = abs(found.agreement) >= AGREES
    edges = 0.0 if method == "edges" or clear_of_noise < 1 else min(1.0, CONCENTRATED / max(found.textured, 1e-3))
    evidence = {
        "scenes": 0.0 if one_scene or clear_of_noise < 1 else 1.0,
        "displacement": min(1.0, found.displacement / DISPLACED) if one_scene and lacks > ALIGNED_BETTER else 0.0,
        "reversal": 1.0 if found.agreement <= -AGREES else 0.0,
        "optics": 0.0 if slip is None else 1.0,
        # Beside hard edges compression leaves its blocks, too, which are then no cause by themselves.
        "jpeg": float(np.clip(np.log(found.blocks) / np.log(BLOCKY), 0, 1 if edges < 1 else BESIDE_EDGES)),
        "range": 1.0 if outside else faint * one_is_sharp,
        "noise": faint if is_noisy and not one_is_sharp else 0.0,
        "texture": 0.0 if is_noisy or one_is_sharp else faint,
        "edges": edges,
        "saturation": float(np.clip((1 - found.usable) / (1 - SHOWN), 0, 1)),
        "blur": min(1.0, found.blur / BLURRED),
    }
    values = asdict(found) | {"slip": slip, "unusable": 1 - found.usable}
    texts = {name: text.format(**values) for name, text in TEXTS.items()} | ({"range": outside} if outside else {})
    return sorted((Cause(name, evidence[name], text) for name, text in texts.items()), key=lambda one: -one.evidence)


def measure_evidence(problem: Problem, estimate: Estimate) -> Evidence:
    """Measure what may explain a map without depth."""
    registered = problem.registered
    images, usable = registered.images, registered.usable
    noise = [sd / gain for sd, gain in zip(estimate.noise, registered.gains, strict=True)]
    mean = max(float(images[0][usable].mean()), 1e-12)
    agreement = agreement_as_given = _agreement(images, usable)
    if not problem.settings.align:
        placed = [resample(i, p)[0] for i, p in zip(images, registered.placements, strict=True)]
        agreement = _agreement(placed, usable)
    as_given = [_band(image) for image in images]
    energy = BAND_GAIN * np.square(noise)
    power = np.array([float(band[usable].var()) for band in as_given])
    displacement = max(p.displacement(registered.shape) for p in registered.placements)
    search, vergence = problem.search, estimate.vergence[usable].astype(float)
    blur = np.min([p * np.abs(f - vergence) for p, f in zip(search.pixels, search.focus, strict=True)], axis=0)
    return Evidence(
        displacement=0.0 if problem.settings.align else displacement,
        agreement=agreement,
        agreement_as_given=agreement_as_given,
        signal=float(np.min(power / np.maximum(energy, 1e-30))),
        fine_signal=max(float(i[usable].var()) / max(sd, 1e-15) ** 2 for i, sd in zip(images, noise, strict=True)),
        contrast=float(np.sqrt(max(power.min() - energy.min(), 0.0))) / mean,
        noise=max(noise) / mean,
        textured=min(_textured(image, sd) for image, sd in zip(images, noise, strict=True)),
        blocks=max(min(steps_at_blocks(view.image, 3)) for view in problem.views),
        usable=float(usable.mean()),
        blur=float(np.median(blur)),
    )


def _band(image: Image, scale: float = 1.0) -> Image:
    """Return the coarse detail of an image, or that of `scale` times its size."""
    fine, coarse = (ndimage.gaussian_filter(image, scale * sd) for sd in (FINE, COARSE))
    return np.asarray(fine - coarse, np.float32)


def _agreement(images: Sequence[Image], usable: Mask) -> float:
    """Return the correlation of coarse detail of the view that agrees least with the first, at the scale of most."""
    scales = [1.0, *([COARSER] if min(usable.shape) >= WIDE_ENOUGH * COARSER * COARSE else [])]
    found = []
    for scale in scales:
        first, *others = (_band(image, scale)[usable] for image in images)
        found.append(min((float(np.corrcoef(first, other)[0, 1]) for other in others), key=abs, default=1.0))
    return max(found, key=abs)


def _textured(image: Image, noise: float) -> float:
    """Return the share of the blocks that hold 90 % of the gradients' energy, less that of the noise."""
    down, right = np.gradient(ndimage.gaussian_filter(image, 1.0))
    rows, columns = (n // JPEG_BLOCK for n in image.shape)
    energy = (down**2 + right**2)[: rows * JPEG_BLOCK, : columns * JPEG_BLOCK]
    energy = energy.reshape(rows, JPEG_BLOCK, columns, JPEG_BLOCK).mean(axis=(1, 3)).ravel()
    energy = np.sort(np.maximum(energy - noise**2 / (8 * np.pi) * 2, 0))[::-1]
    total = energy.sum()
    return float(np.searchsorted(np.cumsum(energy), 0.9 * total) / energy.size) if total > 0 else 1.0
