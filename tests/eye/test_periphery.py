"""Sampling away from the fovea, against the values that Watson (2014) states."""

from __future__ import annotations

import numpy as np
import pytest

from focalgradient.eye import Cones, Eye, midget_density, resolved_cpd

MERIDIANS = ("temporal", "superior", "nasal", "inferior")


def test_the_centre_has_two_midget_cells_a_cone_and_resolves_what_cones_do() -> None:
    """Watson's Table 2: 29,609.2 midget fields in a square degree, and a Nyquist frequency of 65.37 cycles a degree."""
    for meridian in MERIDIANS:
        assert midget_density(0, meridian) == pytest.approx(29609.2, rel=1e-3)
        assert resolved_cpd(0, meridian) == pytest.approx(65.37, rel=1e-3)


def test_sampling_falls_outwards_and_least_towards_the_temporal_field() -> None:
    far = np.linspace(0, 60, 61)
    every = np.stack([resolved_cpd(far, meridian) for meridian in MERIDIANS])
    assert np.all(np.diff(every) < 0)
    assert np.all(every[0, 15:] >= every[:, 15:])


def test_cones_away_from_the_fovea_lose_fine_detail() -> None:
    there = Cones.of(Eye(0.004, 1.0), "L+M", finest_cpd=float(resolved_cpd(20.0)))
    passed = there.transfer(np.degrees([2.0, 8.0]), 1.0)
    assert passed[0] > 0.5
    assert passed[1] == 0
