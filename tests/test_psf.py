"""Blur transfers against integrals and Fourier transforms of the blurs themselves."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from focalgradient import InputError
from focalgradient.psf import DISC_K, disc_transfer, gaussian_transfer, pixel_transfer, transfer


def disc_by_quadrature(frequency: float, radius: float) -> float:
    """Fourier integral of the disc seen edge-on, whose chords are 2 sqrt(radius^2 - x^2) long: no Bessel function."""
    return quad(  # x = radius sin(t), for the ends to be smooth
        lambda t: 2 / np.pi * np.cos(t) ** 2 * np.cos(2 * np.pi * frequency * radius * np.sin(t)),
        *(-np.pi / 2, np.pi / 2),
        limit=200,
    )[0]


@pytest.mark.parametrize("radius", [0.3, 1.0, 7.5])
def test_disc_is_the_integral_over_its_chords(radius: float) -> None:
    frequency = np.concatenate([[0, 1e-7, 1e-5, 3e-5], np.linspace(0.001, 0.7, 40)])  # across the small-x series
    expected = [disc_by_quadrature(f, radius) for f in frequency]
    assert disc_transfer(frequency, radius) == pytest.approx(expected, abs=1e-9)


def test_disc_is_the_fourier_transform_of_a_disc() -> None:
    """A disc of 60 fine samples in radius, drawn and transformed in two dimensions: isotropic, and signed."""
    side, fine = 1024, 60
    place = np.arange(side) - side // 2
    disc = (np.hypot(place[:, None], place) <= fine).astype(float)
    spectrum = np.fft.fft2(np.fft.ifftshift(disc / disc.sum())).real
    frequency = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.fftfreq(side))
    low = frequency < 2.5 / fine  # past the third zero
    assert spectrum[low] == pytest.approx(disc_transfer(frequency[low], fine), abs=4e-3)


def test_disc_reverses_contrast_between_its_zeros() -> None:
    """The zeros of a uniform disc, known from the resolution of telescopes: 0.610, 1.117, 1.619 cycles per radius."""
    zeros = [brentq(lambda f: disc_transfer(f, 1.0), *about) for about in ((0.5, 0.7), (1.0, 1.2), (1.5, 1.7))]
    assert zeros == pytest.approx([0.6098, 1.1166, 1.6192], abs=1e-4)
    assert disc_transfer(0.8, 1.0) < -0.1
    assert disc_transfer(1.3, 1.0) > 0.05


def test_gaussian_is_the_fourier_transform_of_a_gaussian() -> None:
    sigma, side = 12.0, 512
    place = np.arange(side) - side // 2
    drawn = np.exp(-(place**2) / (2 * sigma**2))
    spectrum = np.fft.fft(np.fft.ifftshift(drawn / drawn.sum())).real
    frequency = np.abs(np.fft.fftfreq(side))
    assert gaussian_transfer(frequency, 30.0, k=sigma / 30) == pytest.approx(spectrum, abs=1e-9)


def test_k_is_the_second_moment_of_the_disc() -> None:
    """Per axis, by counting points of a disc; so that small blurs of both models act alike."""
    place = np.linspace(-1, 1, 1001)
    x, y = np.meshgrid(place, place)
    assert np.sqrt(np.mean(x[np.hypot(x, y) <= 1] ** 2)) == pytest.approx(DISC_K, rel=2e-3)
    low = np.linspace(0, 0.05, 6)  # cycles per radius
    assert gaussian_transfer(low, 1.0, DISC_K) == pytest.approx(disc_transfer(low, 1.0), abs=2e-4)


@pytest.mark.parametrize("psf", ["disc", "gaussian"])
def test_light_is_kept_and_no_blur_is_no_filter(psf: str) -> None:
    assert (transfer(0.0, [0.0, 0.1, 3.0, 100.0], psf) == 1).all()
    assert (transfer([0.0, 0.1, 0.5], 0.0, psf) == 1).all()


@pytest.mark.parametrize("psf", ["disc", "gaussian"])
def test_only_frequency_times_radius_counts(psf: str) -> None:
    """Pixels, radians or metres: whatever the unit, and shapes broadcast."""
    frequency, radius = np.linspace(0, 0.5, 7)[:, None], np.array([0.5, 2.0, 5.0])
    one = transfer(frequency, radius, psf)
    assert one.shape == (7, 3)
    assert transfer(frequency / 3e-4, radius * 3e-4, psf) == pytest.approx(one)
    assert (np.diff(one[:, 0]) < 0).all()  # within the first lobe more frequency is less contrast


def test_gaussian_k_scales_the_radius() -> None:
    assert transfer(0.1, 4.0, "gaussian", k=1.0) == pytest.approx(float(transfer(0.1, 8.0, "gaussian", k=0.5)))
    assert transfer(0.1, 4.0, "disc", k=1.0) == transfer(0.1, 4.0, "disc", k=0.5)  # a disc has none


def test_unknown_model() -> None:
    with pytest.raises(InputError, match="psf is 'pillbox', but must be one of disc, gaussian"):
        transfer(0.1, 1.0, "pillbox")


def test_pixel_averages_over_its_square() -> None:
    """Waves averaged over a unit square by a fine grid of points."""
    place = (np.arange(400) + 0.5) / 400 - 0.5
    for down, right in [(0.0, 0.0), (0.0, 0.5), (0.3, -0.2), (0.5, 0.5), (0.0, 1.0)]:
        wave = np.cos(2 * np.pi * (down * place[:, None] + right * place))
        assert pixel_transfer(down, right) == pytest.approx(wave.mean(), abs=1e-5)
