"""A window of PsychoPy as focalgradient's `Display`: its geometry, and what its pixels do with light."""

from __future__ import annotations

from typing import Any, Literal

from focalgradient.display import Display
from focalgradient.errors import InputError

__all__ = ["Gamma", "display_of"]

Gamma = float | tuple[float, float, float] | Literal["sRGB"]
"""Exponent of light over value, one or three of them, or the standard's own curve."""


def display_of(win: Any, gamma: Gamma | None) -> Display:
    """Return the display that a window is on.

    Parameters
    ----------
    win
        A ``psychopy.visual.Window`` whose monitor has a width, a distance and a size in pixels.
    gamma
        Of the display. None: linear where PsychoPy linearises it (a gamma of the window, or of its calibrated monitor,
        which goes into the graphics card's table), else sRGB.

    Raises
    ------
    InputError
        If the monitor's geometry is not known.
    """
    monitor = win.monitor
    width, distance, size = monitor.getWidth(), monitor.getDistance(), monitor.getSizePix()
    if not (width and distance and size is not None and all(size)):
        raise InputError(
            f"the window's monitor {monitor.name!r} has no width, distance or size in pixels, so that degrees are not "
            "known: enter them in PsychoPy's Monitor Center, or give the window a Monitor with setWidth, setDistance "
            "and setSizePix."
        )
    if gamma is None:
        gamma = "sRGB" if win.useNativeGamma else 1.0
    across, down = (int(side) for side in size)
    return Display((across, down), width / 100 / across, distance / 100, gamma=gamma)
