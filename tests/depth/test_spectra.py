"""Comparison of spectra: the line of Eq. 9 without its window's bias, and depth from it."""

import blurred as blurred_walls
import numpy as np
import pytest
from blurred import PIXEL, lens, texture, wall
from judged import covered, said

from focalgradient import recover_depth
from focalgradient.depth.filters import RADII
from focalgradient.depth.numerics import block_sum
from focalgradient.depth.spectra import spectral_difference
from focalgradient.depth.spectra.bands import Bands, Hypothesis, compare, scene_level
from focalgradient.psf import gaussian_transfer
from focalgradient.render import cast, noisy
from focalgradient.scenes import plane

FREQUENCY = np.hypot(np.fft.fftfreq(256)[:, None], np.fft.rfftfreq(256))
INSIDE = np.s_[5:-5, 5:-5]


def blurred(one: float, other: float, *, noise: float = 0.01, slope: float = 1.0, seed: int = 0) -> list[np.ndarray]:
    """A periodic scene of contrast 0.2 whose amplitude falls as 1 / f^slope, blurred twice, with noise."""
    random = np.random.default_rng(seed)
    scene = np.fft.rfft2(random.standard_normal((256, 256))) / np.maximum(FREQUENCY, 1 / 256) ** slope
    scene[0, 0] = 0
    scene *= 0.2 / np.fft.irfft2(scene).std()
    return [
        1 + np.fft.irfft2(scene * gaussian_transfer(FREQUENCY, sigma, k=1)) + noise * random.standard_normal((256, 256))
        for sigma in (one, other)
    ]


def test_the_difference_of_what_shows_nothing_is_unknown() -> None:
    blank = [1 + 0.01 * np.random.default_rng(seed).standard_normal((96, 96)) for seed in (0, 1)]
    difference, sd = spectral_difference(*blank, noise=0.01)
    assert np.isfinite(difference).all()
    assert np.median(sd) > 20


# --- the bands --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("window", [4.0, 8.0])
def test_mean_and_covariance_of_noise(window: float) -> None:
    """What the bands gather of filtered noise has the mean and the covariance that are stated for it."""
    bands = Bands.of(window)
    density = np.exp(-((RADII / 0.2) ** 2))
    frequency = np.hypot(np.fft.fftfreq(1024)[:, None], np.fft.rfftfreq(1024))
    noise = np.fft.rfft2(np.random.default_rng(0).standard_normal((1024, 1024)))
    noise *= np.interp(frequency, RADII, np.sqrt(density)) * (frequency < 0.5)
    fields = [np.fft.irfft2(noise * np.interp(frequency, RADII, shape)) for shape in bands.shapes]
    blocks = np.stack([block_sum(field.astype(np.float32) ** 2, bands.step) for field in fields])
    found = bands.gather(blocks)[:, 5:-5, 5:-5].reshape(len(fields), -1)
    finer = RADII[bands.shapes.argmax(axis=1)] < 0.3
    assert found.mean(axis=1)[finer] == pytest.approx(bands.means(density)[finer], rel=0.03)
    stated = 2 * bands.covariance(density, density)
    assert np.cov(found)[0] == pytest.approx(stated[0], rel=0.15, abs=0.05 * stated[0, 0])
    assert np.diag(np.cov(found))[finer] == pytest.approx(np.diag(stated)[finer], rel=0.15)


def test_equal_images_differ_by_noise_alone() -> None:
    """Two noisy images of one blur: slope and misfit are what their stated variances say."""
    same = np.tile(gaussian_transfer(RADII, 1.5, k=1), (2, 1))
    scaled, misfit = [], []
    for seed in range(4):
        images = [image.astype(np.float32) for image in blurred(1.5, 1.5, seed=seed)]
        hypothesis = Hypothesis.of((0, 1), same, np.ones(len(RADII)), (0.01, 0.01), scene_level(images), 4)
        (compared,) = compare(Bands.of(8.0), images, np.ones(images[0].shape, np.bool_), [hypothesis], 32)
        scaled.append((compared.slope / np.sqrt(compared.variance))[INSIDE])
        misfit.append(compared.misfit[INSIDE])
    assert abs(np.mean(scaled)) < 0.25
    assert np.std(scaled) == pytest.approx(1, abs=0.1)
    assert abs(np.mean(misfit)) < 0.5


# --- the difference of blur -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.0, 0.5])
def test_the_papers_patches_give_large_blurs_too_small(ratio: float) -> None:
    truth = 4.0**2 * (1 - ratio**2)
    found, _ = spectral_difference(*blurred(ratio * 4.0, 4.0), window=9.0, noise=0.01)
    assert -0.3 < (found[INSIDE].mean() / truth - 1) / 2 < -0.04


# --- depth ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lenses", "limits", "distance", "psf"),
    [
        ([lens(16), lens(5.6)], {"near": 0.85}, 1.4, "disc"),
        ([lens(8, 0.8), lens(8, 1.25)], {"near": 0.7, "far": 2.0}, 1.0, "gaussian"),
        ([lens(16, 2.0), lens(5.6, 2.0)], {"far": 2.0, "near": 0.9}, 1.2, "disc"),
    ],
)
def test_walls(lenses: list, limits: dict, distance: float, psf: str) -> None:
    depth = recover_depth(wall(lenses, distance, psf=psf), method="spectra", psf=psf, noise=0.01, **limits)
    inside = depth.valid[40:-40, 40:-40]
    assert inside.mean() > 0.9
    assert depth.side_known.all()
    defocus = np.max([abs(one.focus_vergence - 1 / distance) for one in lenses])
    assert abs((depth.vergence - 1 / distance)[depth.valid].mean()) <= 0.01 * defocus
    assert 0.88 <= covered(depth, distance) <= 0.995
    assert np.isfinite(depth.vergence).all()
    assert np.isfinite(depth.vergence_sd).all()


@pytest.mark.parametrize(("distance", "assumed"), [(1.4, "disc"), (1.1, "gaussian")])
def test_a_wrong_shape_of_blur_is_covered_and_a_right_one_left_alone(distance: float, assumed: str) -> None:
    """Coarse and fine bands disagree by a model error, which is part of the sd; without it 0 to 3 % lay within 2 sd."""
    views = wall([lens(16), lens(5.6)], distance, seed=21)
    depth, text = said(views, method="spectra", psf=assumed, noise=0.01, near=0.85)
    assert covered(depth, distance) >= 0.88
    if assumed == "disc":
        assert depth.valid[40:-40, 40:-40].mean() > 0.9
        assert depth.details["tau"] < 0.005
        assert not text
    else:
        assert depth.valid[40:-40, 40:-40].mean() > 0.3
        assert depth.details["tau"] > 0.05
        assert "not quite a gaussian" in text


@pytest.mark.parametrize("near", [0.219, 0.223])
def test_large_blur_among_the_hypotheses_does_no_harm(near: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of blur of 30 pixels a band passes next to nothing, and of that a sliver of its frequencies only."""
    monkeypatch.setattr(blurred_walls, "SHAPE", (96, 128))
    depth = recover_depth(wall([lens(4, 0.8), lens(4, 1.25)], 1.0), method="spectra", noise=0.01, near=near)
    assert depth.valid[24:-24, 24:-24].mean() > 0.75
    assert np.median(depth.vergence[depth.valid]) == pytest.approx(1.0, abs=0.002)


def test_cast_wall_and_bare_wall() -> None:
    """A ray-cast wall is read right; where it shows nothing, nothing is claimed."""
    lenses = [lens(16), lens(5.6)]
    views = [cast(plane(1.3, seed=3), one, (128, 160), PIXEL, samples=256, seed=1).view for one in lenses]
    views = [noisy(view, 0.0035, seed) for seed, view in enumerate(views)]
    depth = recover_depth(views, method="spectra", near=0.85, far=4.0)
    assert depth.valid[40:-40, 40:-40].mean() > 0.9
    assert np.median(depth.distance[depth.valid]) == pytest.approx(1.3, rel=0.01)
    field = texture(4)
    field[:, 256:] = np.linspace(0.9, 1.1, field.shape[1])[256:]
    bare = recover_depth(wall(lenses, 1.3, field=field), method="spectra", near=0.85, far=4.0, noise=0.01)
    assert bare.valid[:, 200:].mean() < 0.05
