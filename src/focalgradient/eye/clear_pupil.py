"""Transfer of a clear pupil by waves, in one wavelength: interpolated by frequency and defocus."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.ndimage import map_coordinates

from focalgradient.arrays import FloatArray
from focalgradient.eye.diffraction import cutoff_cpd
from focalgradient.eye.quadrature import panels

__all__ = ["wave_transfer"]

SHIFTS = np.linspace(0, 1, 65)[:-1]
"""Frequencies of the table's rows, over the cut-off."""

PHASE_STEP = 0.05
"""Spacing of the table's columns, in radians of phase."""


def wave_transfer(
    frequency: FloatArray, defocus: FloatArray, pupil_diameter: float, wavelength_nm: float
) -> FloatArray:
    """Return the transfer of a clear pupil by frequency (cycles per radian) and defocus (D, 0 or more); broadcasts.

    Interpolated from a table, right to about 1e-4 of `optical_transfer`.

    >>> float(wave_transfer(np.degrees([5.0]), np.array([0.5]), 0.004, 580.0)[0].round(3))
    0.637
    """
    s = np.radians(frequency) / cutoff_cpd(pupil_diameter, wavelength_nm)
    phase = np.pi * pupil_diameter * defocus * frequency * np.clip(1 - s, 0, None)
    table = _table(float(2 ** np.ceil(np.log2(phase.max(initial=16.0)))))
    places = np.stack(np.broadcast_arrays(np.minimum(s * len(SHIFTS), len(SHIFTS) - 1), phase / PHASE_STEP))
    read = map_coordinates(table, places.reshape(2, -1), order=1, mode="nearest")  # which takes no scalars
    return np.asarray(read.reshape(places.shape[1:]) * _in_focus(s))


def _in_focus(s: FloatArray) -> FloatArray:
    """Return the transfer of a pupil in focus at the share `s` of its cut-off."""
    s = np.minimum(s, 1)
    return np.asarray(2 / np.pi * (np.arccos(s) - s * np.sqrt(1 - s**2)))


@lru_cache(maxsize=4)
def _table(largest: float) -> FloatArray:
    """Return the transfer over that in focus, by frequency (SHIFTS) and phase at the pupil's rim (to `largest`)."""
    nodes, weights = panels(largest)
    span = np.arccos(SHIFTS)[:, None]
    angle = span * nodes
    # Phases at the nodes over that at the rim; cosines of their multiples by the recurrence of Chebyshev.
    turn = (np.cos(angle) - SHIFTS[:, None]) / (1 - SHIFTS[:, None]) * PHASE_STEP
    twice, before, now = 2 * np.cos(turn), np.cos(turn), np.ones_like(turn)
    light = 4 / np.pi * span * np.sin(angle) ** 2 * weights / _in_focus(SHIFTS)[:, None]
    table = np.empty((len(SHIFTS), int(largest / PHASE_STEP) + 2))
    for column in table.T:
        column[:] = (now * light).sum(axis=1)
        now, before = twice * now - before, now
    return table
