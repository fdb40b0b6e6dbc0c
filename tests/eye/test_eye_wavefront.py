"""Aberrated pupils against another library, a drawn pupil and the orthonormality of Zernike's polynomials."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from focalgradient.eye import Eye, optical_transfer, point_spread, pupil_transfer, zernike

PRYSM = json.loads(Path(__file__).with_name("prysm_reference.json").read_text(encoding="utf-8"))


def spread_of(angles: np.ndarray, *, pupil_diameter: float, defocus: float, **eye: Any) -> np.ndarray:
    """The point spread of an eye without chromatic aberration, so many dioptres out of focus."""
    return point_spread(angles, angles, Eye(pupil_diameter, defocus, chromatic_scale=0, **eye), 0.0)


TERMS = [(n, m) for n in range(7) for m in range(-n, n + 1, 2)]


@pytest.mark.parametrize("row", PRYSM, ids=lambda row: f"{row['pupil_diameter']}-{row['defocus']}")
def test_against_prysm(row: dict) -> None:
    """The reference itself is right to about 1e-4; what is asked for is 0.002."""
    setting = {name: row[name] for name in ("pupil_diameter", "wavelength_nm", "defocus")}
    down, right = np.array(row["frequency_y_cpd"]), np.array(row["frequency_x_cpd"])
    expected = np.array(row["real"]) + 1j * np.array(row["imaginary"])
    terms = tuple((n, m, c) for n, m, c in row["aberrations"])
    found = pupil_transfer(down, right, **setting, aberrations=terms, stiles_crawford=row["stiles_crawford"])
    assert np.abs(found - expected).max() < 2e-4
    if not terms and not row["stiles_crawford"]:
        assert np.abs(optical_transfer(np.hypot(down, right), **setting) - expected).max() < 2e-4


@pytest.mark.parametrize("defocus", [0.0, 0.3, -2.0, 5.0])
def test_a_clear_pupil_is_the_one_dimensional_integral(defocus: float) -> None:
    setting = {"pupil_diameter": 0.005, "wavelength_nm": 480, "defocus": defocus}
    frequency, angle = np.linspace(0, 185, 9), 0.7
    found = pupil_transfer(frequency * np.sin(angle), frequency * np.cos(angle), **setting)
    assert found == pytest.approx(optical_transfer(frequency, **setting), abs=1e-11)


def test_zernike_polynomials_are_orthonormal() -> None:
    """Over the unit disc, by points on rings that integrate their products exactly."""
    nodes, weights = np.polynomial.legendre.leggauss(12)
    radius, turn = np.sqrt((nodes + 1) / 2), 2 * np.pi * np.arange(32) / 32
    x, y = radius[:, None] * np.cos(turn), radius[:, None] * np.sin(turn)
    values = np.array([zernike(n, m, x, y) for n, m in TERMS])
    products = np.einsum("arp,brp,r->ab", values, values, weights / 2) / 32
    assert products == pytest.approx(np.eye(len(TERMS)), abs=1e-12)


@settings(max_examples=20, deadline=None)
@given(
    st.floats(0.5e-3, 4e-3),
    st.floats(380, 780),
    st.floats(-0.5, 0.5),
    st.lists(st.tuples(st.sampled_from(TERMS), st.floats(-0.1, 0.1)), max_size=2),
    st.floats(0, 0.2),
)
def test_light_is_light(pupil: float, nm: float, defocus: float, terms: list, rho: float) -> None:
    """The spread is never negative; the transfer is 1 at 0, no more elsewhere, and conjugate at opposite places."""
    setting = {"pupil_diameter": pupil, "wavelength_nm": nm, "defocus": defocus, "stiles_crawford": rho}
    setting["aberrations"] = tuple((*order, c) for order, c in terms)
    down, right = np.array([0.0, 3, -7, 20]), np.array([0.0, 5, 11, -4])
    transfer = pupil_transfer(down, right, **setting)
    assert transfer[0] == pytest.approx(1, abs=1e-9)
    assert np.abs(transfer).max() <= 1 + 1e-9
    assert pupil_transfer(-down, -right, **setting) == pytest.approx(transfer.conj(), abs=1e-9)
    angles = np.linspace(-2e-3, 2e-3, 9)
    assert spread_of(angles, **setting).min() >= 0


def test_the_spread_sums_to_one_and_is_the_transfers_transform() -> None:
    """Rings of Airy fall off as 1/angle^3: a few parts in a thousand of the light lie outside."""
    setting = {"pupil_diameter": 0.003, "wavelength_nm": 555, "defocus": 0.3, "stiles_crawford": 0.5}
    setting["aberrations"] = ((3, 1, 0.1), (2, -2, 0.08))
    step = 8e-5  # rad, finer than wavelength / (2 x pupil): no detail is lost between the points
    angles = np.arange(-96, 96) * step
    spread = spread_of(angles, **setting) * step**2
    assert spread.sum() == pytest.approx(1, abs=4e-3)
    frequency = np.array([-15.0, 0, 5, 30])
    waves = np.exp(-2j * np.pi * np.outer(np.degrees(frequency), angles))
    found = waves @ spread @ waves.T
    expected = pupil_transfer(frequency[:, None], frequency, **setting)
    assert np.abs(expected.imag).max() > 0.05
    assert found == pytest.approx(expected, abs=4e-3)


def test_strong_astigmatism_against_the_pupil_laid_over_itself() -> None:
    """3.9 D over 4 mm: a sum over 1500 x 1500 points of a drawn pupil, times itself moved along the diagonal."""
    drawn = 1500
    place = (np.arange(drawn) - (drawn - 1) / 2) / (drawn / 2)
    inside = place[:, None] ** 2 + place**2 <= 1
    pupil = inside * np.exp(2j * np.pi / 0.48 * 1.6 * np.sqrt(6) * (place**2 - place[:, None] ** 2))
    moved = np.array([30, 100, 220, 400, 700])  # points along either axis
    expected = [np.vdot(pupil[:-n, :-n], pupil[n:, n:]) / inside.sum() for n in moved]
    cpd = np.pi / 180 * moved * 0.004 / drawn / 480e-9
    setting = {"pupil_diameter": 0.004, "wavelength_nm": 480, "defocus": 0.0}
    found = pupil_transfer(cpd, cpd, **setting, aberrations=((2, 2, 1.6),))
    assert np.abs(found - expected).max() < 2e-3
