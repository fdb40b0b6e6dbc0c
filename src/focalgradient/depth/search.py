"""Where depth is searched: candidate vergences, and each view's blur at them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.filters import RADII, FloatArray, disc_pass
from focalgradient.depth.settings import BlurSource
from focalgradient.optics import HasTransfer, HasWaveband, Optics
from focalgradient.psf import transfer

__all__ = ["Blurs", "Search"]

LARGEST_BLUR = 16.0
"""Radius in pixels, in the widest view, up to which blur is searched where the user sets no limit."""

LEVEL_STEP = 0.125
"""Spacing of the candidate levels, in pixels of blur radius in the widest view."""

OWN_STEP = 0.32
"""The same for optics with a transfer of their own: polychromatic and diffracted, it is less sharp than a disc's."""

ONE_FOCUS = 1e-9
"""Relative difference of focus vergences up to which they are one: rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Blurs:
    """Each view's blur at each candidate level."""

    radius: FloatArray  # n x L: of the geometric disc, in pixels
    transfer: FloatArray  # n x L x F, at RADII
    edged: bool  # whether blur ends sharply, as a disc does

    def pass_band(self) -> FloatArray:
        """Weight (amplitude) of each view at each frequency: of a disc, what lies below its second zero.

        Beyond it the phase of the disc's transfer depends on more than real lenses' blur is known to. Where a view's
        transfer is exactly 0 its weight is 0.
        """
        if not self.edged:
            return np.ones_like(self.transfer)
        return disc_pass(self.radius[:, :, None], limit=8.0, power=8) * (self.transfer != 0)

    def every(self, count: int) -> Blurs:
        """The blurs at every so many levels only."""
        return Blurs(self.radius[:, ::count], self.transfer[:, ::count], self.edged)


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
    def over(cls, optics: Sequence[Optics], pixel_angle: float, near: float | None, far: float | None) -> Search:
        """The search for views through `optics`, over the limits given (m), or else as far as blur is searched."""
        focus = np.array([one.focus_vergence for one in optics])
        # Blur is an angle, so that all views count it in the first view's pixels.
        pixels = np.array([one.aperture_diameter / 2 for one in optics]) / pixel_angle
        span = LARGEST_BLUR / pixels.max()
        lowest = 1 / far if far is not None else max(0.0, focus.min() - span)
        highest = 1 / near if near is not None else focus.max() + span
        side_known, side_text = True, "estimated from the views"
        if one_focus(focus):
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
                    "taken to lie beyond it; limit the search (near, far) or focus one view elsewhere"
                )
        step = OWN_STEP if all(isinstance(one, HasTransfer) for one in optics) else LEVEL_STEP
        levels = int(np.clip(np.ceil((highest - lowest) * pixels.max() / step), 8, 400)) + 1
        return cls(lowest, highest, levels, focus, pixels, tuple(optics), pixel_angle, side_known, side_text)

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
    def wavebands(self) -> list[str]:
        """Name of the waveband of each view; one for all whose optics name none."""
        return [one.light if isinstance(one, HasWaveband) else "" for one in self.optics]

    def blurs(self, psf: BlurSource, k: float) -> Blurs:
        """Each view's blur at every level, from the source named `psf` (see `focalgradient.recover_depth`)."""
        radius = self.pixels[:, None] * np.abs(self.focus[:, None] - self.vergences)
        if psf == "disc" or psf == "gaussian" or psf == "blend":
            return Blurs(radius, transfer(RADII, radius[:, :, None], psf, k), psf != "gaussian")
        of_each = [
            one.transfer(RADII / self.pixel_angle, self.vergences[:, None])
            if isinstance(one, HasTransfer)
            else transfer(RADII, own[:, None], "disc")
            for one, own in zip(self.optics, radius, strict=True)
        ]
        return Blurs(radius, np.stack(of_each), True)


def one_focus(focus: NDArray[np.float64]) -> bool:
    """Whether views of these focus vergences share one plane of focus."""
    return bool(np.ptp(focus) <= ONE_FOCUS * max(1.0, np.abs(focus).max()))
