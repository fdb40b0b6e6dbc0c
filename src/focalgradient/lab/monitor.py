"""Calibrations in PsychoPy's Monitor Center: read them, and store photometer measurements with them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from psychopy import monitors

from focalgradient.errors import InputError
from focalgradient.luminance import Luminance

__all__ = ["Calibration", "calibration_of", "store_luminance"]


class Calibration(NamedTuple):
    """Calibration of a monitor in PsychoPy's Monitor Center: lengths in m, None where unknown."""

    width: float | None = None
    distance: float | None = None
    size_px: tuple[int, int] | None = None
    gamma: float | None = None
    """Gamma of grey, or the mean of the channels' gammas."""
    channels: tuple[float, float, float] | None = None
    """Gammas of red, green and blue, if they were measured separately."""
    white: float | None = None
    """Luminance of white in cd/m2, if photometer measurements were stored."""


def calibration_of(name: str | None) -> Calibration:
    """Read a monitor's calibration; None: nothing is known.

    Raises
    ------
    InputError
        If PsychoPy has no monitor of that name.
    """
    if name is None:
        return Calibration()
    known = monitors.getAllMonitors()
    if name not in known:
        listed = ", ".join(sorted(known))
        raise InputError(
            f"the monitor {name!r} is unknown to PsychoPy, which knows {listed}: create it in the Monitor Center."
        )
    monitor = monitors.Monitor(name, autoLog=False)
    width, distance, size = monitor.getWidth(), monitor.getDistance(), monitor.getSizePix()
    gamma, channels, white = _light_of(monitor)
    return Calibration(
        width / 100 if width else None,
        distance / 100 if distance else None,
        (int(size[0]), int(size[1])) if size and all(size) else None,
        gamma,
        channels,
        white,
    )


def _light_of(monitor: Any) -> tuple[float | None, tuple[float, float, float] | None, float | None]:
    """Return gamma, the gamma of each channel, and white; an unmeasured gamma of 1 is PsychoPy's default, not data."""
    lums = monitor.getLumsPre()
    measured = lums is not None and len(lums) > 0
    if monitor.gammaIsDefault() and not measured:
        return None, None, None
    grid = monitor.getGammaGrid()
    if grid is None or (not measured and np.all(np.asarray(grid)[1:, 2] == 1)):
        return float(np.mean(np.asarray(monitor.getGamma(), float))), None, None
    rows = np.asarray(grid, float)
    red, green, blue = (float(value) for value in rows[1:4, 2])
    gamma = float(rows[0, 2]) if measured else (red + green + blue) / 3
    return gamma, (red, green, blue), float(rows[0, 1]) if measured else None


def store_luminance(name: str, found: Luminance) -> None:
    """Store photometer measurements and the fitted curves with a monitor in PsychoPy's Monitor Center.

    Raises
    ------
    InputError
        If PsychoPy has no monitor of that name.
    """
    calibration_of(name)
    monitor = monitors.Monitor(name, autoLog=False)
    rows = [found.curves.get(gun, found.grey) for gun in ("grey", "red", "green", "blue")]
    grid = np.full((4, 6), np.nan)
    grid[:, :3] = [[curve.black, curve.white, curve.gamma] for curve in rows]
    monitor.setGammaGrid(grid.tolist())
    measured = [
        found.measured.get(gun, np.full(found.shares.shape, np.nan)) for gun in ("grey", "red", "green", "blue")
    ]
    monitor.setLumsPre(np.array(measured).tolist())
    monitor.setLevelsPre((255 * found.shares).tolist())
    monitor.setLineariseMethod(1)
    monitor.save()
