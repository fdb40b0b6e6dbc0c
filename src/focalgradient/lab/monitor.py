"""What PsychoPy's Monitor Center knows of a monitor: read, and a photometer's table stored with it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from psychopy import monitors

from focalgradient.errors import InputError
from focalgradient.luminance import Luminance

__all__ = ["Calibration", "calibration_of", "store_luminance"]


class Calibration(NamedTuple):
    """What PsychoPy's Monitor Center knows of a monitor: lengths in metres, None where it does not know."""

    width: float | None
    distance: float | None
    size_px: tuple[int, int] | None
    gamma: float | None
    """Of grey, or the mean of the guns'."""
    channels: tuple[float, float, float] | None = None
    """Of red, green and blue, where they were measured each by itself."""
    white: float | None = None
    """Luminance of white in cd/m2, where a photometer's table was stored."""


def calibration_of(name: str) -> Calibration:
    """Read a monitor's calibration.

    Raises
    ------
    InputError
        If there is no monitor of that name.
    """
    known = monitors.getAllMonitors()
    if name not in known:
        listed = ", ".join(sorted(known))
        raise InputError(
            f"the monitor {name!r} is not known to PsychoPy, which knows {listed}: make it in its Monitor Center."
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
    """Gamma, that of each gun, and white; a gamma of 1 counts where it was measured, and is PsychoPy's default else."""
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
    """Keep a photometer's table and its curves with a monitor, in PsychoPy's Monitor Center.

    Raises
    ------
    InputError
        If there is no monitor of that name.
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
