"""The likelihood of one depth for a whole patch: against its definition, and by simulating and estimating."""

import numpy as np
import pytest
from textures import natural_spectrum

from focalgradient import Lens, View
from focalgradient.depth.equalise.patch import POWERS, RINGS, WEIGHTS, vergence_likelihood
from focalgradient.eye import Cones, Eye, Target

LEVELS = np.arange(0.0, 4.0, 0.04)


def seen(vergence, accommodations=(1.0,), bands=("L+M", "S"), noise=0.2, seed=0, target=None):
    random = np.random.default_rng([seed, 99])
    target = target or Target()
    views = []
    for focus in accommodations:
        views += target.views(
            [Cones.of(Eye(0.004, focus), band) for band in bands], vergence, noise=noise, random=random, texture=seed
        )
    return views


def moments(likelihood):
    p = np.exp(likelihood) / np.exp(likelihood).sum()
    mean = p @ LEVELS
    return mean, np.sqrt(p @ (LEVELS - mean) ** 2)


def test_against_the_multivariate_normal():
    """All frequencies of two tiny views, with the covariance that the model says, and the scene's power averaged."""
    shape, noise, correlation = (16, 16), 0.3, 0.9
    views = seen(1.4, noise=noise, target=Target(shape=shape, correlation=correlation, pixel_angle=np.radians(1 / 30)))
    levels = np.array([0.6, 1.0, 1.4, 1.8, 2.2])
    down, right = np.fft.fftfreq(16)[:, None], np.fft.fftfreq(16)[None]
    radial = np.hypot(down, right)
    used = (radial > 0) & (radial < 0.47)
    radii = radial[used]
    both = np.stack([np.fft.fft2(view.image)[used] / 16 for view in views], axis=-1)
    # What one ring holds is given the ring's mean power, and the transfer at its mean frequency.
    rings = np.rint(radii * 16 * RINGS)
    share = ((np.sinc(down) * np.sinc(right)) ** 2)[used]
    means = {ring: (radii[rings == ring].mean(), share[rings == ring].mean()) for ring in np.unique(rings)}
    middle, passed = np.array([means[ring] for ring in rings]).T
    low = middle < 0.08
    seen_low = [np.maximum(np.mean(np.abs(both[low, i]) ** 2) / noise**2 - 1, 0) * (1 / 16) ** 2 for i in (0, 1)]
    values = []
    for level in levels:
        h = np.stack([view.optics.transfer(middle / view.pixel_angle, level) for view in views], axis=-1)
        of_powers = []
        for factor in POWERS:
            power = max(seen_low) * noise**2 * factor * passed / middle**2
            covariance = power[:, None, None] * h[:, :, None] * h[:, None] * [[1, correlation], [correlation, 1]]
            covariance = covariance + noise**2 * np.eye(2)
            fits = np.einsum("fi,fij,fj->f", both.conj(), np.linalg.inv(covariance), both).real
            # A frequency and its mirror image are one.
            of_powers.append(-(fits + np.log(np.linalg.det(covariance))).sum() / 2)
        values.append(np.logaddexp.reduce(np.array(of_powers) + np.log(WEIGHTS)))
    found = vergence_likelihood(views, levels, noise=noise, correlation=correlation, wraps=True)
    assert found == pytest.approx(np.array(values) - max(values), abs=1e-6)
    assert np.ptp(found) > 3


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("vergence", [0.5, 1.0, 1.5, 2.5])
def test_errors_are_as_stated(vergence):
    """40 patches in two bands: unbiased, and within two standard deviations as often as they should be."""
    found = np.array(
        [
            moments(vergence_likelihood(seen(vergence, seed=s), LEVELS, noise=0.2, correlation=0.95, wraps=True))
            for s in range(40)
        ]
    )
    error, sd = found[:, 0] - vergence, found[:, 1]
    assert abs(error.mean()) < 3 * error.std() / np.sqrt(40) + 0.005
    assert np.mean(np.abs(error) < 2 * sd) >= 0.85  # 95 %, less two and a half binomial deviations
    assert 0.6 < np.sqrt(np.mean((error / sd) ** 2)) < 1.4


def test_one_view_leaves_the_side_open():
    """The size of defocus follows from how natural scenes are; of the sign one wavelength says nothing."""
    cones = [Cones(Eye(0.004, 1.5), "L+M", (580.0,))]
    views = Target().views(cones, 2.3, noise=0.05, random=np.random.default_rng(3), texture=3)
    found = vergence_likelihood(views, LEVELS, noise=0.05, wraps=True)
    best = LEVELS[np.abs(LEVELS - 1.5) > 0.4][found[np.abs(LEVELS - 1.5) > 0.4].argmax()]
    assert abs(abs(best - 1.5) - 0.8) < 0.1
    mirrored = np.interp(3.0 - LEVELS, LEVELS, found)
    inside = (LEVELS > 0.1) & (LEVELS < 2.9)
    assert found[inside] == pytest.approx(mirrored[inside], abs=1e-6)


def test_an_empty_field_says_nothing():
    assert np.ptp(vergence_likelihood(seen(2.0), LEVELS, noise=0.2, wraps=True)) > 100
    views = seen(2.0, target=Target(contrast=0.0))
    found = vergence_likelihood(views, LEVELS, noise=0.2, wraps=True)
    assert np.ptp(found) < 4.0


def test_views_that_do_not_wrap():
    """A tapered patch cut from a wider wall, through two apertures of a lens."""
    from focalgradient.psf import transfer

    random = np.random.default_rng(5)
    frequency = np.hypot(np.fft.fftfreq(256)[:, None], np.fft.rfftfreq(256))
    texture = natural_spectrum((256, 256), random)
    views = []
    for n in (4, 8):
        lens = Lens(0.025, n, 1.0)
        blurred = texture * transfer(frequency, float(lens.blur_radius(1 / 1.8)) / 2.6e-4, "disc")
        image = np.fft.irfft2(blurred, (256, 256))[64:192, 64:192] + 0.02 * random.standard_normal((128, 128))
        views.append(View(1 + image, lens, 2.6e-4))
    levels = np.arange(1.0, 3.0, 0.01)
    found = levels[vergence_likelihood(views, levels, noise=0.02).argmax()]
    assert found == pytest.approx(1.8, abs=0.05)
