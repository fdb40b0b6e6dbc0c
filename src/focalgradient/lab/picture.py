"""Picture stimulus that records which pixels were drawn."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from psychopy import visual

__all__ = ["ShownPicture"]

ALTERING = ("contrast", "opacity", "size", "pos", "ori")
"""Properties of a picture that change how its pixels are displayed."""


class ShownPicture(visual.ImageStim):  # type: ignore[misc]  # PsychoPy has no types
    """Picture in a window, shown pixel for pixel.

    Parameters
    ----------
    window
        PsychoPy window.
    pixels
        8-bit values, H x W (grey) or H x W x 3.
    pos
        Centre of the picture, in pixels from the window's centre.
    drawn
        Receives an entry for each picture drawn, in order: the SHA-256 of its pixels (row by row), and properties that
        were changed since it was made, such as ``contrast=0.5``; None: draws are not recorded.
    """

    def __init__(
        self, window: Any, pixels: NDArray[np.uint8], pos: tuple[float, float], drawn: dict[str, None] | None
    ) -> None:
        pixels = np.ascontiguousarray(pixels)
        self._sha256 = "" if drawn is None else hashlib.sha256(pixels.tobytes()).hexdigest()
        self._drawn = drawn
        height, width = pixels.shape[:2]
        image = Image.fromarray(pixels)
        super().__init__(window, image, size=(width, height), pos=pos, units="pix", interpolate=False, autoLog=False)
        self._made = self._settings()

    def _settings(self) -> dict[str, str]:
        return {name: f"{np.round(getattr(self, name), 6).tolist()}".replace(" ", "") for name in ALTERING}

    def draw(self, win: Any = None) -> None:
        """Draw the picture, and record it."""
        if self._drawn is not None:
            changed = [f"{name}={now}" for name, now in self._settings().items() if now != self._made[name]]
            self._drawn.setdefault(",".join([self._sha256, *changed]))
        super().draw(win)
