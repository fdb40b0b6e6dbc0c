"""Transfer of an aberrated pupil through focus: all defoci from one ambiguity function.

Between two shifted copies of the pupil, defocus changes the phase by a multiple of the position along the shift alone.
So the overlap is summed across the shift once, and along it for every defocus: the ambiguity function of the pupil
(Brenner, Lohmann & Ojeda-Castaneda 1983, "The ambiguity function as a polar display of the OTF").
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.eye.quadrature import gauss
from focalgradient.eye.wavefront import Pupil
from focalgradient.loops import reordered

__all__ = ["through_focus"]

TABLE, KINKED_TABLE = 256, 768
"""Samples per radius of the table of the wavefront, interpolated linearly: accurate to 1e-3 rad for natural eyes; and
for lenses with zones, whose wavefront has kinks."""


def through_focus(down: FloatArray, right: FloatArray, pupil: Pupil, defocus: FloatArray) -> NDArray[np.complex128]:
    """Return the transfer at frequencies in cycles per radian (one shape), for each added `defocus` (D).

    Returns an array of len(defocus) x the frequencies' shape; right to 1e-3 of `pupil_transfer_of` for natural eyes,
    strong astigmatism and lenses with zones.

    >>> pupil = Pupil(0.003, 555.0, 0.0, ((3, 1, 0.1),))
    >>> complex(through_focus(np.zeros(1), np.degrees([20.0]), pupil, np.array([0.25]))[0, 0].round(3))
    (0.14+0.133j)
    """
    shift = ((right + 1j * down) * (1e-9 * pupil.wavelength_nm / pupil.diameter)).ravel()
    steps = np.diff(defocus)
    even = bool(steps.size and np.allclose(steps, steps[0], rtol=1e-9, atol=1e-12))
    strength = math.pi * (1e3 * pupil.diameter) ** 2 * 1e3 / pupil.wavelength_nm  # radians per dioptre, s and place
    largest = float(np.abs(defocus).max(initial=0)) * strength
    found = np.empty((shift.size, defocus.size), complex)
    # Frequencies in order, so that each part of them has a rule of its own order.
    order = np.argsort(np.abs(shift), kind="stable")
    bounds = np.abs(shift)[order]
    table = _wavefront_table(pupil)
    start = 0
    while start < shift.size:
        s = max(float(bounds[start]), 0.02)
        stop = max(start + 1, int(np.searchsorted(bounds, 1.25 * s)))
        some = order[start:stop]
        ends = np.minimum([bounds[start], bounds[stop - 1]], 1.0)
        # Across the move the phase runs through four times s, its half width and the steepest slope, as astigmatism's
        # does; a rule needs a quarter as many nodes, and some. Each rule is for the worst s of its part.
        s = float(np.clip(math.sqrt(0.5), *ends))
        across = gauss(_order(max(4 + pupil.steepness * s * math.sqrt(1 - s**2), pupil.kinked_order)))
        s = float(np.clip(0.5, *ends))
        smooth = 8 + 0.3 * pupil.steepness * min(1.0, 2 * ends[1])
        along = gauss(_order(max(smooth, pupil.kinked_order) + largest * s * (1 - s) / 3))
        part = np.empty((some.size, defocus.size), complex)
        _through_focus(shift[some], table, pupil.loss, *along, *across, defocus * strength, even, part)
        found[some] = part
        start = stop
    through: NDArray[np.complex128] = np.ascontiguousarray((found / pupil.light).T)
    return through.reshape(defocus.size, *down.shape)


def _order(least: float) -> int:
    return 4 * math.ceil(least / 4)


def _wavefront_table(pupil: Pupil) -> FloatArray:
    """Return the phase in radians on a lattice over the unit disc."""
    size = TABLE if pupil.lens is None else KINKED_TABLE
    place = np.arange(-size - 1, size + 3) / size
    return pupil.phase(place + 1j * place[:, None])


@reordered
def _phase(table, x, y):  # type: ignore[no-untyped-def]
    """Interpolate the table's phase at a place in the unit disc."""
    size = (len(table) - 4) // 2
    column, row = (x + 1) * size + 1, (y + 1) * size + 1
    i, j = int(row), int(column)
    down, right = row - i, column - j
    upper = table[i, j] + right * (table[i, j + 1] - table[i, j])
    lower = table[i + 1, j] + right * (table[i + 1, j + 1] - table[i + 1, j])
    return upper + down * (lower - upper)


@reordered
def _through_focus(shifts, table, loss, nodes, weights, nodes2, weights2, phases, even, found):  # type: ignore[no-untyped-def]
    for f in range(shifts.size):
        moved = shifts[f]
        s = abs(moved)
        found[f] = 0
        if s >= 1:
            continue
        ahead = moved / s if s > 0 else 1 + 0j
        span = math.acos(s)
        for i in range(nodes.size):
            t = span * nodes[i]
            out, high = math.cos(t) - s, math.sin(t)
            for half in (-1.0, 1.0):
                light = 0j
                for j in range(nodes2.size):
                    place = ahead * complex(half * out, high * (2 * nodes2[j] - 1))
                    here, there = place - moved, place + moved
                    turn = _phase(table, here.real, here.imag) - _phase(table, there.real, there.imag)
                    kept = weights2[j]
                    if loss > 0:
                        kept *= math.exp(-loss * (place.real**2 + place.imag**2 + s * s))
                    light += kept * complex(math.cos(turn), math.sin(turn))
                light *= 2 * span * high * high * weights[i]
                # |p - m|^2 - |p + m|^2 is -4 times the product of their lengths along the move.
                rate = -half * out * s
                if even:
                    angle = rate * phases[0]
                    light *= complex(math.cos(angle), math.sin(angle))
                    angle = rate * (phases[1] - phases[0])
                    turned = complex(math.cos(angle), math.sin(angle))
                    for number in range(phases.size):
                        found[f, number] += light
                        light *= turned
                else:
                    for number in range(phases.size):
                        angle = rate * phases[number]
                        found[f, number] += light * complex(math.cos(angle), math.sin(angle))
