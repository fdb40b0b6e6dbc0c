"""The bounds: against closed forms, against the likelihood's own best, and as laws."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from blurred import PIXEL, lens
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, optimize, stats

from focalgradient import Lens
from focalgradient.depth.limits import comparison_bound, edge_bound, natural_power
from focalgradient.psf import transfer

WIDE = lens(5.6)


def vergence(sigma: float, optics: Lens = WIDE) -> float:
    """Where, beyond focus, the blur's standard deviation is `sigma` pixels at k = 0.5."""
    return optics.focus_vergence - 2 * sigma * PIXEL / (optics.aperture_diameter / 2)


@pytest.mark.parametrize(("kappa", "sigma"), [(0.0, 1.0), (0.5, 4.0), (0.625, 1.0)])
def test_two_gaussian_views_of_natural_texture_agree_with_the_closed_form(kappa: float, sigma: float) -> None:
    optics = [lens(5.6 / kappa if kappa else math.inf), WIDE]
    found = comparison_bound(
        optics, vergence(sigma), PIXEL, power=natural_power(0.2, 32), noise=0.01, area=32**2, psf="gaussian"
    ) / (WIDE.focus_vergence - vergence(sigma))
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(32), np.fft.fftfreq(32))).ravel()[1:]
    c = np.sum(1 / (frequency * 32) ** 2)
    J = integrate.quad(lambda u: u / (math.exp(u) + math.exp(kappa**2 * u)), 0, 80)[0]
    assert found == pytest.approx(0.01 / 0.2 * math.sqrt(c / (math.pi * J)) / 32 / (1 - kappa**2), rel=1e-3)


def test_the_papers_working_figures() -> None:
    """32 x 32 pixels, 1 % noise, contrast 20 %: 0.44, 0.61, 0.76 % of sigma at ratios 0, 0.5, 0.625."""
    for kappa, percent in ((0.0, 0.44), (0.5, 0.61), (0.625, 0.76)):
        optics = [lens(5.6 / kappa if kappa else math.inf), WIDE]
        sd = comparison_bound(
            optics, vergence(2.0), PIXEL, power=natural_power(0.2, 32), noise=0.01, area=1024, psf="gaussian"
        )
        assert 100 * float(sd) / (WIDE.focus_vergence - vergence(2.0)) == pytest.approx(percent, abs=0.005)


@pytest.mark.parametrize(("kappa", "sigma"), [(0.0, 4.0), (0.5, 1.0)])
def test_a_disc_does_better_than_a_gaussian_by_a_quarter_to_a_half(kappa: float, sigma: float) -> None:
    """As docs/report/limits.md says: .53 to .76 of its bound, for discs of one second moment with the Gaussians."""
    optics = [lens(5.6 / kappa if kappa else math.inf), WIDE]
    disc, gaussian = (
        comparison_bound(optics, vergence(sigma), PIXEL, power=natural_power(0.2, 32), noise=0.01, area=32**2, psf=psf)
        for psf in ("disc", "gaussian")
    )
    assert 0.5 < disc / gaussian < 0.78


def test_the_likelihoods_best_reaches_the_bound() -> None:
    """Periodic patches, the texture unknown: the least of the cost scatters as the bound says, and no less."""
    side, sd, truth = 64, 0.01, vergence(2.0)
    optics = [lens(11.2), WIDE]
    random = np.random.default_rng(3)
    frequency = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.fftfreq(side))
    amplitude = np.where(frequency > 0, 1 / np.maximum(frequency, 1e-9), 0)
    amplitude *= 0.2 * side / np.sqrt(np.sum(amplitude**2))

    def transfers(level: float) -> list[np.ndarray]:
        return [transfer(frequency, one.blur_radius(1 / level) / PIXEL, "gaussian") for one in optics]

    estimates = []
    for _ in range(120):
        # A texture of exactly this power, of random phase; only its bound is fixed, not the sample's luck.
        phase = np.fft.fft2(random.standard_normal((side, side)))
        spectrum = amplitude * side * phase / np.maximum(np.abs(phase), 1e-9)
        noise = [np.fft.fft2(sd * random.standard_normal((side, side))) for _ in optics]
        one, other = (spectrum * h + n for h, n in zip(transfers(truth), noise, strict=True))

        def cost(level: float, one: np.ndarray = one, other: np.ndarray = other) -> float:
            a, b = transfers(level)
            return float(np.sum(np.abs(a * other - b * one) ** 2 / (a**2 + b**2)))

        best = optimize.minimize_scalar(cost, bounds=(truth - 0.05, truth + 0.05), method="bounded")
        estimates.append(best.x - truth)
    bound = float(
        comparison_bound(optics, truth, PIXEL, power=natural_power(0.2, side), noise=sd, area=side**2, psf="gaussian")
    )
    assert np.std(estimates) / bound == pytest.approx(1, abs=4 / math.sqrt(2 * 120))
    assert abs(np.mean(estimates)) < 4 * bound / math.sqrt(120)


def test_edge_bound_is_the_information_of_the_blurred_step() -> None:
    sigma, length, contrast, noise = 3.0, 16, 0.5, 0.01
    x = np.arange(-400, 401) / 10
    step = 1e-4
    slope = contrast * (stats.norm.cdf(x / (sigma + step)) - stats.norm.cdf(x / (sigma - step))) / (2 * step)
    place = contrast * stats.norm.pdf(x / sigma) / sigma
    levels = [stats.norm.cdf(x / sigma), stats.norm.cdf(-x / sigma)]
    jacobian = np.stack([slope, place, *levels])
    information = length * 0.1 * jacobian @ jacobian.T / noise**2
    alone = 1 / math.sqrt(information[0, 0]) / sigma
    assert edge_bound(sigma, noise=noise, contrast=contrast, length=length) == pytest.approx(alone, rel=1e-6)
    # What the levels cost where 37 pixels are seen on either side of them:
    assert math.sqrt(np.linalg.inv(information)[0, 0]) / sigma == pytest.approx(alone, rel=0.05)


@pytest.mark.slow
@settings(deadline=None)
@given(
    f_numbers=st.lists(st.floats(2.0, 64.0), min_size=2, max_size=4),
    noise=st.floats(1e-4, 0.1),
    sigma=st.floats(0.2, 5.0),
    psf=st.sampled_from(["disc", "gaussian"]),
)
def test_laws(f_numbers: list[float], noise: float, sigma: float, psf: str) -> None:
    def bound(numbers: list[float], noise: float = noise, area: float = 400) -> float:
        power: Callable = natural_power(0.2, 32)
        return float(
            comparison_bound(
                [lens(n) for n in numbers], vergence(sigma), PIXEL, power=power, noise=noise, area=area, psf=psf
            )
        )

    all_views = bound(f_numbers)
    fewer = bound(f_numbers[:-1] if len(f_numbers) > 2 else f_numbers)
    assert all_views <= fewer * (1 + 1e-9) or min(all_views, fewer) > 1e9  # more tells no less; equal ones nothing
    assert bound(f_numbers[::-1]) == pytest.approx(all_views, rel=1e-6)
    if all_views < 1e3:  # equal apertures tell nothing
        assert bound(f_numbers, noise=2 * noise) == pytest.approx(2 * all_views, rel=1e-6)
        assert bound(f_numbers, area=100) == pytest.approx(2 * all_views, rel=1e-6)


def test_a_view_drowned_in_noise_or_without_blur_tells_nothing() -> None:
    """A third view drowned in noise tells nothing."""
    texture = {"power": natural_power(0.2, 32), "area": 400.0}
    two = comparison_bound([lens(16), WIDE], vergence(2.0), PIXEL, noise=[0.01, 0.02], **texture)
    three = comparison_bound([lens(16), WIDE, lens(8)], vergence(2.0), PIXEL, noise=[0.01, 0.02, 1e3], **texture)
    assert three == pytest.approx(two, rel=1e-6)
    pinholes = [lens(math.inf), lens(math.inf)]
    bound = comparison_bound(pinholes, [0.5, 1.0], PIXEL, power=natural_power(0.2, 32), noise=0.01, area=100)
    assert bound.tolist() == [math.inf, math.inf]
