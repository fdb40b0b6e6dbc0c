"""The clear defocused pupil against closed forms, its limits, an integral in the plane and the paper's own series."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pupil_waves import lommel_point_spread
from scipy.integrate import quad

from focalgradient import FocalGradientWarning
from focalgradient.eye import Eye, cutoff_cpd, mean_eye_mtf, optical_transfer, point_spread
from focalgradient.psf import disc_transfer

PUPIL = st.floats(0.5e-3, 9e-3)
LIGHT = st.floats(380, 780)
DEFOCUS = st.floats(-6, 6)


def test_diffraction_alone_has_a_closed_form() -> None:
    s = np.linspace(0, 1, 101)
    closed = 2 / np.pi * (np.arccos(s) - s * np.sqrt(1 - s**2))
    for pupil, nm in ((0.002, 450.0), (0.006, 650.0)):
        found = optical_transfer(s * cutoff_cpd(pupil, nm), pupil_diameter=pupil, wavelength_nm=nm, defocus=0)
        assert found == pytest.approx(closed, abs=1e-13)


@pytest.mark.parametrize("defocus", [0.05, 1.0, 8.0])
def test_against_adaptive_quadrature_of_the_plain_integral(defocus: float) -> None:
    """Along the shift, without the substitution: (4 / pi) sqrt(1 - (x + s)^2) cos(a x), x from 0 to 1 - s."""
    pupil, nm = 0.005, 500.0
    s = np.array([0.01, 0.1, 0.3, 0.5, 0.8, 0.99])
    a = np.pi * defocus * pupil**2 / (nm * 1e-9) * s
    chord = lambda x, s: 4 / np.pi * np.sqrt(max(1 - (x + s) ** 2, 0))  # noqa: E731
    finely = {"weight": "cos", "epsabs": 1e-12, "limit": 400}
    expected = [quad(chord, 0, 1 - one, (one,), wvar=rate, **finely)[0] for one, rate in zip(s, a, strict=True)]
    frequency = s * cutoff_cpd(pupil, nm)
    found = optical_transfer(frequency, pupil_diameter=pupil, wavelength_nm=nm, defocus=defocus)
    assert found == pytest.approx(expected, abs=1e-8)


def test_large_defocus_is_a_geometric_disc() -> None:
    """The first lobes, at the same share of the disc: what diffraction takes halves as defocus doubles."""
    per_radius = np.linspace(0, 2, 60)  # cycles
    disc = disc_transfer(per_radius, 1.0)
    assert disc.min() < -0.1
    errors = []
    for defocus in (2.0, 4.0, 8.0, 16.0):
        frequency = np.radians(per_radius / (0.003 * defocus))
        found = optical_transfer(frequency, pupil_diameter=0.006, wavelength_nm=555, defocus=defocus)
        errors.append(np.abs(found - disc).max())
    assert errors[-1] < 2e-3
    assert np.divide(errors[:-1], errors[1:]) == pytest.approx(2, rel=0.1)


@given(PUPIL, LIGHT, DEFOCUS, st.lists(st.floats(0, 400), min_size=1, max_size=8))
def test_never_more_contrast_than_in_focus(pupil: float, nm: float, defocus: float, frequency: list[float]) -> None:
    setting = {"pupil_diameter": pupil, "wavelength_nm": nm}
    found = optical_transfer(frequency, **setting, defocus=defocus)
    sharp = optical_transfer(frequency, **setting, defocus=0)
    assert found.shape == (len(frequency),)
    assert (np.abs(found) <= sharp + 1e-12).all()
    assert (sharp <= 1 + 1e-12).all()
    assert (found[np.array(frequency) >= cutoff_cpd(pupil, nm)] == 0).all()
    assert optical_transfer(frequency, **setting, defocus=-defocus) == pytest.approx(found, abs=1e-12)
    assert optical_transfer(np.negative(frequency), **setting, defocus=defocus) == pytest.approx(found, abs=0)
    assert float(optical_transfer(0.0, **setting, defocus=defocus)) == pytest.approx(1, abs=1e-12)


def test_mean_eye_by_hand_and_where_it_extrapolates() -> None:
    """4 mm, 10 cycles/degree: u1 = 6.1772, diffraction 0.89904 of a cut-off of 125.79, so 0.442 x 0.948."""
    s = 10 / 125.790
    diffraction = 2 / np.pi * (np.arccos(s) - s * np.sqrt(1 - s**2))
    expected = (1 + (10 / 6.1772) ** 2) ** -0.62 * np.sqrt(diffraction)
    assert float(mean_eye_mtf(10.0, pupil_diameter=0.004)) == pytest.approx(expected, rel=1e-4)
    assert expected == pytest.approx(0.4265, abs=5e-4)
    with pytest.warns(FocalGradientWarning, match="2 to 6 mm, and is extrapolated to one of 7 mm") as caught:
        mean_eye_mtf(10.0, pupil_diameter=0.007)
    assert caught[0].filename == __file__  # the user's line, whatever lies between


SPREADS = [(0.002, 450, 0.0), (0.003, 555, 0.0001), (0.003, 555, 0.05), (0.004, 555, 0.5), (0.006, 650, 2.0)]


@pytest.mark.parametrize(("pupil", "nm", "defocus"), SPREADS)
def test_lommel_equals_wave_optics(pupil: float, nm: float, defocus: float) -> None:
    """To 1e-6 of the peak of the spread in focus: inside the geometric shadow, across its rim and outside."""
    setting = {"pupil_diameter": pupil, "wavelength_nm": nm, "defocus": defocus}
    angle = np.linspace(0, 2 * pupil * defocus / 2 + 6e-4, 121)
    peak = np.pi * pupil**2 / (4 * (nm * 1e-9) ** 2)
    eye = Eye(pupil, defocus, wavelength_nm=nm, chromatic_scale=0)
    series, waves = lommel_point_spread(angle, **setting) / peak, point_spread([0.0], angle, eye, 0.0)[0] / peak
    assert np.abs(series - waves).max() < 1e-6 * max(1, waves.max())
    assert series == pytest.approx(waves, abs=1e-10)
