"""A picture on the screen that keeps a record of the pixels that were drawn."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from psychopy import visual

__all__ = ["ShownPicture"]

ALTERING = ("contrast", "opacity", "size", "pos", "ori")
"""Settings of a picture that change what is shown of its pixels."""


class ShownPicture(visual.ImageStim):  # type: ignore[misc]  # PsychoPy has no types
    """A picture in the middle of a window, one pixel on one of the window's.

    Parameters
    ----------
    window
        Of PsychoPy.
    pixels
        H x W (grey) or H x W x 3, 8-bit.
    pos
        Of its middle, in pixels from the middle of the window.
    drawn
        Takes a line for each picture that is drawn, in order: the SHA-256 of its pixels (row by row), and what was
        changed of the picture since, as ``contrast=0.5``; None: it is not recorded.
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
        """Draw it, and record that."""
        if self._drawn is not None:
            changed = [f"{name}={now}" for name, now in self._settings().items() if now != self._made[name]]
            self._drawn.setdefault(",".join([self._sha256, *changed]))
        super().draw(win)
