"""The cone mosaic: density and Nyquist limit against published counts, sampling, noise of photons, and back."""

import math

import numpy as np
import pytest
from scipy.spatial import cKDTree

from focalgradient import InputError, View
from focalgradient.eye import Cones, Eye, Photons, midget_density, resolved_cpd
from focalgradient.retina import ConeMosaic, cone_density, cone_nyquist_cpd


def test_density_is_that_of_published_counts() -> None:
    """14,804.6 in a square degree at the centre; a tenth at 1 mm; 40 % more in the nasal retina far out (Curcio)."""
    assert cone_density(0.0) == pytest.approx(14804.6, rel=2e-3)
    for side in ("temporal", "nasal", "superior", "inferior"):
        assert 0.05 < float(cone_density(3.6, side) / cone_density(0.0, side)) < 0.12  # 1 mm
        falls = -np.diff(np.log(cone_density(np.arange(20, 61), side)))  # by 1 to 3 % a degree
        assert 0.005 < falls.min() < falls.max() < 0.04
    assert 1.35 < float(cone_density(34.0, "temporal") / cone_density(34.0, "nasal")) < 1.45
    # One on and one off midget cell a cone in the fovea, fewer than that far out (Watson 2014).
    assert float(midget_density(0.0) / cone_density(0.0)) == pytest.approx(2.0, rel=0.01)
    assert float(midget_density(20.0) / cone_density(20.0)) < 0.5


def test_limits_of_sampling_are_those_that_are_published() -> None:
    """About 60 cycles per degree at the centre; ganglion cells resolve less than cones from a few degrees on."""
    assert cone_nyquist_cpd(0.0) == pytest.approx(65.4, abs=0.2)
    assert cone_nyquist_cpd(0.0) == pytest.approx(float(resolved_cpd(0.0)), rel=0.01)
    assert (cone_nyquist_cpd([5.0, 10.0, 30.0]) > resolved_cpd([5.0, 10.0, 30.0])).all()


@pytest.mark.parametrize(("far", "side"), [(0.0, "temporal"), (1.0, "nasal"), (5.0, "superior"), (30.0, "inferior")])
def test_a_mosaic_is_as_dense_and_as_fine_as_the_retina(far, side) -> None:
    """Cones counted, distances of neighbours, and the lowest frequency at which the mosaic repeats itself."""
    density = float(cone_density(far, side))
    field = math.sqrt(900 / density) if far else 0.12  # about 900 cones, but at the peak a place that is even
    mosaic = ConeMosaic.over((40, 40), math.radians(field) / 40, eccentricity_deg=far, meridian=side)
    assert len(mosaic) == pytest.approx(density * field**2, rel=0.12 if far < 2 else 0.03)
    assert mosaic.cell.sum() == pytest.approx(math.radians(field) ** 2, rel=0.06)
    place = np.degrees(mosaic.place)
    inside = (np.abs(place) < 0.4 * field).all(axis=1)
    nearest = cKDTree(place).query(place[inside], 2)[0][:, 1] * np.sqrt(1 / np.degrees(np.degrees(mosaic.cell[inside])))
    assert 0.85 < nearest.min() < nearest.max() < 1.08
    if far == 1.0:
        return  # where density falls fastest, limits differ within the field
    limit = float(cone_nyquist_cpd(far, side))
    turn = np.pi * np.arange(180) / 180
    even = place[np.hypot(*place.T) < min(0.5 * field, 0.06 if far == 0 else 9)]
    ratio = np.arange(0.5, 1.2, 0.01)
    wave = 2 * limit * ratio[:, None, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    power = np.abs(np.exp(2j * np.pi * wave @ even.T).mean(axis=-1)).max(axis=1)
    first = ratio[int(np.argmax(power > 0.6 * power.max()))]
    assert 0.82 < first < 1.05


def test_gratings_below_the_limit_are_kept_and_above_it_alias() -> None:
    """At 10 degrees in the temporal field, where cones' limit is 14 cycles per degree; half that is well sampled."""
    side, field = 256, 2.0
    limit = float(cone_nyquist_cpd(10.0))
    mosaic = ConeMosaic.over((side, side), math.radians(field) / side, eccentricity_deg=10.0)
    x = (np.arange(side) - (side - 1) / 2) * field / side
    inner = slice(side // 4, -side // 4)

    def kept(cpd: float) -> float:
        grating = 1 + np.cos(2 * np.pi * cpd * x) * np.ones((side, 1))
        seen = mosaic.image(mosaic.catch(grating))[inner, inner]
        return float(np.corrcoef(seen.ravel(), grating[inner, inner].ravel())[0, 1])

    assert kept(0.5 * limit) > 0.97
    assert kept(0.8 * limit) > 0.8
    assert kept(1.5 * limit) < 0.5
    # What is above the limit is seen as something coarser, which the picture does not have.
    fine = 1 + np.cos(2 * np.pi * 1.6 * limit * x) * np.ones((side, 1))
    seen = mosaic.image(mosaic.catch(fine))[inner, inner]
    spectrum = np.abs(np.fft.rfft2(seen - seen.mean()))
    down, right = np.fft.fftfreq(side // 2, field / side)[:, None], np.fft.rfftfreq(side // 2, field / side)
    assert spectrum[np.hypot(down, right) < limit].max() > spectrum[np.hypot(down, right) > 1.2 * limit].max()


def test_noise_is_that_of_the_photons_a_cone_catches() -> None:
    """Of the L and M cones at 100 cd/m^2, through 4 mm: the variance over the square of the mean is 1 / quanta."""
    angle = math.radians(1 / 120)
    quanta = Photons(100.0).caught("L+M", 0.004, angle)
    mosaic = ConeMosaic.over((96, 96), angle, eccentricity_deg=10.0, share=0.93, seed=3)
    flat = np.full((96, 96), 5.0)
    caught = np.concatenate([mosaic.catch(flat, quanta=quanta, seed=seed) for seed in range(20)])
    expected = quanta * float(mosaic.cell.mean()) / angle**2
    assert caught.mean() == pytest.approx(5.0, rel=0.01)
    assert (caught / 5.0).var() == pytest.approx(1 / expected, rel=0.1)
    assert len(mosaic) == pytest.approx(0.93 * len(ConeMosaic.over((96, 96), angle, eccentricity_deg=10.0)), rel=0.1)
    assert (mosaic.catch(flat, quanta=quanta, seed=1) == mosaic.catch(flat, quanta=quanta, seed=1)).all()
    assert mosaic.catch(flat) == pytest.approx(5.0)


def test_a_view_is_sampled_last() -> None:
    angle = math.radians(1 / 60)
    image = np.random.default_rng(0).uniform(0.2, 1.0, (32, 40)).astype(np.float32)
    view = View(image, Cones.of(Eye(0.003, 1.0), "L+M"), angle)
    mosaic = ConeMosaic.over((32, 40), angle, eccentricity_deg=5.0)
    seen = mosaic.view(view)
    assert seen.image.dtype == np.float32
    assert seen.optics is view.optics
    assert seen.image.std() < 0.7 * image.std()  # a pixel is finer than a cone there
    with pytest.raises(InputError, match="make the mosaic for the view"):
        ConeMosaic.over((32, 40), 2 * angle).view(view)
