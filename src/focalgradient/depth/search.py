"""Where depth is sought: candidate vergences, and each view's blur at them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from focalgradient.psf import PsfName
from focalgradient.view import View

if TYPE_CHECKING:
    from focalgradient.depth.equalise import Equalised

__all__ = ["Search"]

LARGEST_BLUR = 16.0
"""Radius in pixels, in the widest view, up to which blur is sought where the user sets no limit."""

LEVEL_STEP = 0.125
"""Spacing of the candidate levels, in pixels of blur radius in the widest view."""


@dataclass(frozen=True, slots=True)
class Search:
    """The candidate levels of vergence, and each view's blur at them."""

    lowest: float
    highest: float
    levels: int
    focus: NDArray[np.float64]  # each view's focus vergence, D
    pixels: NDArray[np.float64]  # each view's blur radius in pixels per dioptre of defocus
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
        levels = int(np.clip(np.ceil((highest - lowest) * pixels.max() / LEVEL_STEP), 8, 400)) + 1
        return cls(lowest, highest, levels, focus, pixels, side_known, side_text)

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

    def equalise(
        self,
        images: Sequence[NDArray[np.float32]],
        noise_sd: Sequence[float],
        psf: PsfName,
        k: float,
        window: float,
    ) -> Equalised:
        """Compare `images` at every level."""
        from focalgradient.depth.equalise import equalise

        radius = self.pixels[:, None] * np.abs(self.focus[:, None] - self.vergences)
        reach = int(np.clip(2 * radius.max(), 16, 64))
        return equalise(images, radius, noise_sd, psf, k, reach=reach, window=window)
