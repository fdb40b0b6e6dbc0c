"""Where depth is sought: candidate vergences, and each view's blur at them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from focalgradient.optics import HasTransfer, HasWaveband, Optics
from focalgradient.psf import PsfName, transfer
from focalgradient.view import View

if TYPE_CHECKING:
    from focalgradient.depth.equalise.likelihood import Blurs

__all__ = ["Search"]

LARGEST_BLUR = 16.0
"""Radius in pixels, in the widest view, up to which blur is sought where the user sets no limit."""

LEVEL_STEP = 0.125
"""Spacing of the candidate levels, in pixels of blur radius in the widest view."""

OWN_STEP = 0.32
"""The same for optics that tell their own blur: with waves and many colours it is nowhere as sharp as a small disc."""


@dataclass(frozen=True, slots=True)
class Search:
    """The candidate levels of vergence, and each view's blur at them."""

    lowest: float
    highest: float
    levels: int
    focus: NDArray[np.float64]  # each view's focus vergence, D
    pixels: NDArray[np.float64]  # each view's blur radius in pixels per dioptre of defocus
    optics: tuple[Optics, ...]
    pixel_angle: float  # of the first view, in whose pixels all is counted
    side_known: bool
    side_text: str

    @classmethod
    def over(cls, views: Sequence[View], near: float | None, far: float | None) -> Search:
        """The search over the limits given, or else as far as blur is sought."""
        focus = np.array([view.optics.focus_vergence for view in views])
        # Blur is an angle, so that all views count it in the first view's pixels.
        pixels = np.array([view.optics.aperture_diameter / 2 for view in views]) / views[0].pixel_angle
        span = LARGEST_BLUR / pixels.max()
        lowest = 1 / far if far is not None else max(0.0, focus.min() - span)
        highest = 1 / near if near is not None else focus.max() + span
        side_known, side_text = True, "told by the views"
        if np.ptp(focus) <= 1e-9 * max(1.0, np.abs(focus).max()):
            shared = float(focus[0])
            slack = 1e-3 * (highest - lowest)
            if highest <= shared + slack:
                highest, side_text = min(highest, shared), "beyond focus, by the limits of the search"
            elif lowest >= shared - slack:
                lowest, side_text = max(lowest, shared), "nearer than focus, by the limits of the search"
            else:
                highest, side_known = shared, False
                side_text = (
                    "the views share one plane of focus, so that their blur leaves the side of it open: everything is "
                    "taken to lie beyond it; limit the search (near, far; --near, --far) or focus one view elsewhere"
                )
        optics = tuple(view.optics for view in views)
        step = OWN_STEP if all(isinstance(one, HasTransfer) for one in optics) else LEVEL_STEP
        levels = int(np.clip(np.ceil((highest - lowest) * pixels.max() / step), 8, 400)) + 1
        return cls(lowest, highest, levels, focus, pixels, optics, views[0].pixel_angle, side_known, side_text)

    @property
    def vergences(self) -> NDArray[np.float64]:
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

    def radius(self, vergence: NDArray[np.float64]) -> NDArray[np.float64]:
        """Blur radius in pixels in the most blurred view, at `vergence`."""
        return np.max([p * np.abs(f - vergence) for p, f in zip(self.pixels, self.focus, strict=True)], axis=0)

    @property
    def lights(self) -> list[str]:
        """Name of the light that each view was seen in; one for all that do not say."""
        return [one.light if isinstance(one, HasWaveband) else "" for one in self.optics]

    def blurs(self, psf: PsfName, k: float) -> Blurs:
        """Each view's blur at every level, by the model named `psf` (see `focalgradient.recover_depth`)."""
        from focalgradient.depth.equalise.likelihood import RADII, Blurs

        radius = self.pixels[:, None] * np.abs(self.focus[:, None] - self.vergences)
        if psf != "optics":
            return Blurs(radius, transfer(RADII, radius[:, :, None], psf, k), psf != "gaussian")
        of_each = [
            one.transfer(RADII / self.pixel_angle, self.vergences[:, None])
            if isinstance(one, HasTransfer)
            else transfer(RADII, own[:, None], "disc")
            for one, own in zip(self.optics, radius, strict=True)
        ]
        return Blurs(radius, np.stack(of_each), True)
