"""Input and result of every depth method, and the range searched: candidate vergences, each view's blur at them."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.filters import ROUND, Frequencies, disc_pass, plane
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.settings import OPTICS, BlurSource, RecoverySettings
from focalgradient.errors import InputError
from focalgradient.optics import Capabilities, Optics, OwnBlur, blur_of, capabilities, own_blur
from focalgradient.plausibility import check_range
from focalgradient.psf import Disc, Geometric, Psf
from focalgradient.view import View

__all__ = ["Blurs", "Estimate", "Problem", "Search", "view_blur"]

LARGEST_BLUR = 16.0
"""Maximum blur radius in pixels of the widest view if the user sets no limit; limits the time. Chosen by hand."""

MOST_BLUR = 64.0
"""Maximum blur radius with any limits: on textured walls the default method is as accurate as with narrower limits up
to this, and wrong from 140 on, as such blur passes almost nothing."""

LEVEL_STEP = 0.125
"""Spacing of the candidate levels, in pixels of blur radius in the widest view. Chosen by hand."""

OWN_STEP = 0.32
"""`LEVEL_STEP` for optics with their own transfer function, which is smoother than that of a disc (polychromatic,
diffracted). Chosen by hand."""

PLANE_STEP = 0.2
"""`LEVEL_STEP` for blur without circular symmetry, whose phase distinguishes levels with equal contrast. Chosen by
hand."""

BANDS_STEP = 0.25
"""`LEVEL_STEP` for views in different wavebands, one of which may be sharp where another is strongly blurred: with 0.32
the fitted gains are 1 to 2 % too low, and such walls are estimated nearer by a third of a standard deviation
(`benchmarks/coverage_of_walls.py`: 3 mm, 1.5 D, 1000 cd/m^2); 0.2 gives the same in twice the time."""

LEAST_LEVELS, MOST_LEVELS = 8, 400
"""Minimum and maximum number of steps between candidate levels; limit the time. Chosen by hand."""

ONE_FOCUS = 1e-9
"""Maximum relative difference of equal focus vergences: rounding."""


@dataclass(frozen=True, eq=False)
class Blurs:
    """Each view's blur at each candidate level."""

    radius: FloatArray  # n x L: of the geometric disc, in pixels
    transfer: NDArray[Any]  # n x L x F; complex where blur is not round
    edged: bool  # whether blur ends sharply, as a disc does
    frequencies: Frequencies = ROUND  # F
    limited: tuple[bool, bool] = (False, False)  # whether depth may lie beyond the first, and the last level
    even: bool = True  # whether a little blur acts by its square, alike on both sides of focus
    parts: tuple[Blurs, ...] = ()  # those of which the blur at each pixel is a mixture, if it varies over the field
    contrast: FloatArray | None = None  # n x L: of the texture in each view over that of the mixture; None: 1

    @cached_property
    def pass_band(self) -> NDArray[Any]:
        """Return each view's weight (amplitude) at each frequency: for a disc, a pass band up to its second zero.

        Beyond it the phase of the disc's transfer depends on more than real lenses' blur is known to. Where a view's
        transfer is exactly 0 its weight is 0.
        """
        if not self.edged:
            return np.ones(self.transfer.shape, self.transfer.real.dtype)
        band = disc_pass(self.radius[:, :, None], limit=8.0, power=8, frequencies=self.frequencies)
        return (band * (self.transfer != 0)).astype(self.transfer.real.dtype)

    @property
    def reach(self) -> int:
        """Width in pixels of the mirrored surround with which views are filtered: as far as their blurs reach."""
        return int(np.clip(2 * self.radius.max(), 16, 64))

    def averaged(self, shares: NDArray[np.floating] | None) -> Blurs:
        """Average the blurs' transfer and contrast over their parts, weighted by `shares` (C x H x W) of the frame.

        The parts' transfers are multiplied by their contrast over that mean: the same at all levels on average.
        """
        if shares is None or not self.parts:
            return self
        weights = shares.mean(axis=(1, 2))
        contrasts = np.stack([np.ones(self.radius.shape) if p.contrast is None else p.contrast for p in self.parts])
        mean = np.einsum("c,cnl->nl", weights, contrasts)
        kind = self.transfer.real.dtype
        parts = tuple(
            replace(part, transfer=part.transfer * (own / mean)[:, :, None].astype(kind))
            for part, own in zip(self.parts, contrasts, strict=True)
        )
        transfer = sum(kind.type(weight) * part.transfer for weight, part in zip(weights, parts, strict=True))
        return replace(self, transfer=np.asarray(transfer, self.transfer.dtype), parts=parts, contrast=mean)

    def every(self, count: int) -> Blurs:
        """Return the blurs at every `count`-th level."""
        parts = tuple(part.every(count) for part in self.parts)
        contrast = None if self.contrast is None else self.contrast[:, ::count]
        some = self.radius[:, ::count], self.transfer[:, ::count]
        return replace(self, radius=some[0], transfer=some[1], parts=parts, contrast=contrast)


@dataclass(frozen=True, slots=True)
class Search:
    """The candidate levels of vergence, and each view's blur at them."""

    lowest: float
    highest: float
    levels: int
    focus: FloatArray  # each view's focus vergence, D
    pixels: FloatArray  # each view's blur radius in pixels per dioptre of defocus
    optics: tuple[Optics, ...]
    pixel_angle: float  # of the first view, in whose pixels all is counted
    side_known: bool
    side_text: str

    @classmethod
    def over(
        cls,
        optics: Sequence[Optics],
        pixel_angle: float,
        near: float | None,
        far: float | None,
        psf: BlurSource | None = None,
    ) -> Search:
        """Make the search for views through `optics`, over the limits given (m), or up to the largest blur searched.

        `psf` is the views' blur, where it may tell the side of focus of views that share one. Refused where the limits
        leave nothing to search.
        """
        focus = np.array([one.focus_vergence for one in optics])
        # Blur is an angle, so that all views count it in the first view's pixels.
        pixels = np.array([one.aperture_diameter / 2 for one in optics]) / pixel_angle
        span = LARGEST_BLUR / pixels.max()
        most = MOST_BLUR / pixels.max()
        lowest = max(0.0, focus.min() - span) if far is None else max(1 / far, focus.min() - most)
        highest = focus.max() + span if near is None else min(1 / near, focus.max() + most)
        if lowest >= highest:
            one = near is None or far is None
            raise InputError(
                f"between near and far all blur is larger than {LARGEST_BLUR if one else MOST_BLUR:g} pixels, up to "
                f"which it is searched{' where one limit is given' * one}: "
                f"{'give both limits' if one else 'focus nearer to the search, or reduce the pictures'}."
            )
        stated = [capabilities(one) for one in optics]
        tells_side = _tells_side(stated, psf)
        side_known, side_text = True, "estimated from the views"
        if one_focus(focus):
            shared = float(focus[0])
            slack = 1e-3 * (highest - lowest)
            if highest <= shared + slack:
                highest, side_text = min(highest, shared), "beyond focus, by the limits of the search"
            elif lowest >= shared - slack:
                lowest, side_text = max(lowest, shared), "nearer than focus, by the limits of the search"
            elif not tells_side:
                highest, side_known = shared, False
                side_text = (
                    "the views share one plane of focus, so that their blur leaves the side of it open: everything is "
                    "taken to lie beyond it; limit the search (near, far) or focus one view elsewhere"
                )
        lens = [(getattr(one, "focal_length", None), getattr(one, "f_number", None)) for one in optics]
        foci = [(one.focus_vergence, *pair) for one, pair in zip(optics, lens, strict=True)]
        check_range(foci, float(pixels.max()), (lowest, highest), near, far)
        step = OWN_STEP if all(one.forms_views for one in stated) else LEVEL_STEP
        if not all(one.isotropic for one in stated if one.forms_views):
            step = PLANE_STEP
        if len({one.waveband for one in stated} - {""}) > 1:
            step = min(step, BANDS_STEP)
        levels = int(np.clip(np.ceil((highest - lowest) * pixels.max() / step), LEAST_LEVELS, MOST_LEVELS)) + 1
        return cls(lowest, highest, levels, focus, pixels, tuple(optics), pixel_angle, side_known, side_text)

    @property
    def vergences(self) -> FloatArray:
        """Vergence of each level, D."""
        return np.linspace(self.lowest, self.highest, self.levels)

    @property
    def spacing(self) -> float:
        """Dioptres from level to level."""
        return (self.highest - self.lowest) / (self.levels - 1)

    @property
    def slope(self) -> float:
        """Pixels of blur radius per dioptre in the widest view."""
        return float(self.pixels.max())

    @property
    def levels_per_pixel(self) -> float:
        """Number of levels per pixel of blur radius in the widest view."""
        return 1 / (self.slope * self.spacing)

    def radius(self, vergence: FloatArray) -> FloatArray:
        """Blur radius in pixels in the most blurred view, at `vergence`."""
        return np.max([p * np.abs(f - vergence) for p, f in zip(self.pixels, self.focus, strict=True)], axis=0)

    @property
    def wavebands(self) -> list[str]:
        """Name of the waveband of each view; one for all whose optics name none."""
        return [one.waveband for one in self.stated]

    @property
    def stated(self) -> list[Capabilities]:
        """Capabilities that each view's optics declare."""
        return [capabilities(one) for one in self.optics]

    @property
    def isotropic(self) -> bool:
        """Whether the blur of all views is alike in all directions."""
        return all(one.isotropic for one in self.stated)

    @property
    def limited(self) -> tuple[bool, bool]:
        """Whether depth may lie beyond the first, and the last level: not beyond infinity or a shared focus."""
        shared = float(self.focus[0]) if one_focus(self.focus) else None
        return self.lowest not in (0, shared), self.highest != shared

    def blurred_alike(self, psf: BlurSource | None) -> tuple[float, float] | None:
        """Lowest and highest vergence (D) on the other side of the focus that views share, blurred as those searched.

        None: the views, blurred by `psf`, tell the sides, or nothing lies there.
        """
        if not one_focus(self.focus) or _tells_side(self.stated, psf):
            return None
        lowest, highest = (max(0.0, 2 * float(self.focus[0]) - end) for end in (self.highest, self.lowest))
        return (lowest, highest) if highest > lowest else None

    def blurs(self, psf: BlurSource) -> Blurs:
        """Return each view's blur at every level, of the shape `psf` or by the views' own optics.

        Optics without a blur model are treated as geometric: they blur by a disc. Raises `InputError` if none of the
        views' optics have one.
        """
        radius = self.pixels[:, None] * np.abs(self.focus[:, None] - self.vergences)
        if isinstance(psf, str) and not any(one.blur for one in self.stated):
            names = ", ".join(sorted({type(one).__name__ for one in self.optics}))
            raise InputError(
                f"psf is 'optics', but the views' optics ({names}) offer no blur of their own: give 'disc'."
            )
        formed = [view_blur(optics, psf, self.pixel_angle) for optics in self.optics]
        at = ROUND if all(blur.isotropic for blur, _ in formed) else plane(_finest(formed))
        transfer = np.stack([self._transfer(*one, at) for one in formed])
        if isinstance(psf, Psf):
            return Blurs(radius, transfer, psf.ends_sharply, at, self.limited)
        contrast = [np.ones(self.levels) if c is None else c(self.vergences) for c in (s.contrast for s in self.stated)]
        even = not any(one.tells_side for one in self.stated)
        parts = tuple(replace(self, optics=one).blurs(psf) for one in self._mixed())
        return Blurs(radius, transfer, True, at, self.limited, even, parts, np.stack(contrast))

    def _mixed(self) -> list[tuple[Optics, ...]]:
        """The views' optics in each part of the mixture that their blur is; none where blur is alike everywhere."""
        mixtures = [one.mixture for one in self.stated]
        given = [one for one in mixtures if one is not None]
        if not given:
            return []
        if len({len(one.optics) for one in given}) > 1 or len(given) < len(mixtures):
            raise InputError(
                "the blur of some views only, or of different numbers of optics, is a mixture, but all views must "
                "share one: give all views optics of one mixture."
            )
        return list(zip(*(one.optics for one in given), strict=True))

    def _transfer(self, blur: OwnBlur, pixel: float, at: Frequencies) -> NDArray[Any]:
        """Return the transfer of a view at every level: L x F."""
        for vergence in (self.lowest, self.highest):
            blur.check(vergence, 0.5 / pixel)
        if blur.isotropic:
            return blur.transfer(at.radius / pixel, self.vergences[:, None])
        return _kept(_through_focus, blur)(pixel, self.lowest, self.highest, self.levels, at)


def view_blur(optics: Optics, psf: BlurSource, pixel_angle: float) -> tuple[OwnBlur, float]:
    """Return the blur of a view: of the shape `psf`, or the optics' own; by default a disc's. With it a pixel's angle.

    The angle is 1 for blur by a shape, which is counted in pixels. By ``"auto"`` optics that form views by rays blur by
    a disc, too.
    """
    own = own_blur(optics) if isinstance(psf, str) else None
    if own is not None and (own.forms_views or psf == OPTICS):
        return own, pixel_angle
    shape = Disc() if isinstance(psf, str) else psf
    return blur_of(Geometric(shape, optics.aperture_diameter / pixel_angle, optics.focus_vergence)), 1.0


def _finest(formed: Sequence[tuple[OwnBlur, float]]) -> float:
    """Return the frequency in cycles per pixel beyond which no two views pass detail that could be compared."""
    if any(isinstance(blur.optics, Geometric) for blur, _ in formed):
        return 0.5
    return float(sorted(_kept(_end, blur)(pixel) for blur, pixel in formed)[-2])


def _kept(function: Any, blur: OwnBlur) -> Callable[..., Any]:
    """Return a cached function of `blur`; not cached where the optics have no hash."""
    return partial(function if isinstance(blur.optics, Hashable) else function.__wrapped__, blur)


@lru_cache(maxsize=64)
def _end(own: OwnBlur, pixel_angle: float) -> float:
    """The plane's frequency (cycles per pixel) from which on its optics pass nothing to the right; 0.5 at most."""
    along = plane().axes[1]
    passed = own.through_focus(np.zeros((1, 1)), along[None] / pixel_angle, own.optics.focus_vergence)
    return float(along[min(int(np.flatnonzero(passed)[-1]) + 1, len(along) - 1)])


@lru_cache(maxsize=8)
def _through_focus(
    own: OwnBlur, pixel_angle: float, lowest: float, highest: float, levels: int, at: Frequencies
) -> NDArray[np.complex64]:
    """Return the transfer (L x F) at `levels` vergences over the plane; kept, as many views are of the same eye."""
    down, right = at.axes
    found = own.through_focus(down[:, None] / pixel_angle, right / pixel_angle, np.linspace(lowest, highest, levels))
    table = np.asarray(found, np.complex64).reshape(levels, -1)
    table.setflags(write=False)
    return table


def _tells_side(stated: Sequence[Capabilities], psf: BlurSource | None) -> bool:
    """Return whether blur by `psf`, or by optics of these capabilities, differs between the sides of focus."""
    return not psf.symmetric if isinstance(psf, Psf) else any(one.tells_side for one in stated)


def one_focus(focus: FloatArray) -> bool:
    """Return whether views of these focus vergences share one plane of focus."""
    return bool(np.ptp(focus) <= ONE_FOCUS * max(1.0, np.abs(focus).max()))


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Input of a method: checked and registered views, search range, blur and settings."""

    views: Sequence[View]
    registered: RegisteredViews
    search: Search
    settings: RecoverySettings


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """Depth estimated by one method.

    Parameters
    ----------
    vergence, vergence_sd
        H x W, in dioptres, on the first view's pixels.
    valid
        H x W.
    noise
        Standard deviation of each view's noise, in the view's own unit.
    side_known
        H x W: whether the views decide the side of focus, beyond what the search decides.
    details
        What this method alone has to state, as plain JSON values.
    warnings
        Warnings to issue, each a sentence.
    searched
        Vergence that was searched, in dioptres, where the method restricts the search.
    beyond
        H x W integers, of methods that see it: 1 at or nearer than the nearest depth searched, -1 at or beyond the
        farthest, 0 elsewhere.
    """

    vergence: NDArray[np.float32]
    vergence_sd: NDArray[np.float32]
    valid: Mask
    noise: Sequence[float]
    side_known: Mask | bool = True
    details: Mapping[str, Any] = field(default_factory=dict)
    warnings: Sequence[str] = ()
    searched: tuple[float, float] | None = None
    beyond: NDArray[np.int8] | None = None
