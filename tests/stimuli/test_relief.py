"""The prediction from the pinhole picture and its depth, against the ray caster, which knows nothing of it."""

import numpy as np
import pytest

from focalgradient.render import cast
from focalgradient.scenes import slant, step
from focalgradient.stimuli.depth_rating import Pupil
from focalgradient.stimuli.relief import predicted

PIXEL = 8e-4
SHAPE = (96, 128)


def both(scene, optics: Pupil) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Through the pinhole, cast through the lens, and predicted."""
    sharp = cast(scene, Pupil(0.0, 1.0), SHAPE, PIXEL, samples=64)
    blurred = cast(scene, optics, SHAPE, PIXEL, samples=512).view.image
    parts = [
        predicted(sharp.view.image, sharp.distance, optics.aperture_diameter, optics.focus_vergence, PIXEL, seed=seed)
        for seed in range(16)
    ]
    rim = 12
    inside = (slice(rim, -rim), slice(rim, -rim))
    return sharp.view.image[inside], blurred[inside], np.mean(parts, axis=0)[inside]


@pytest.mark.parametrize(
    ("make", "focus"), [(lambda: step(0.8, 1.6, seed=2), 1 / 0.8), (lambda: step(0.8, 1.6, seed=2), 1 / 1.6)]
)
def test_an_edge_that_hides_something(make, focus: float) -> None:
    sharp, cast_, seen = both(make(), Pupil(0.02, focus))
    # But for what the pinhole did not see, behind the edge.
    assert np.std(seen - cast_) < 0.2 * np.std(sharp - cast_)
    away = np.delete(np.arange(sharp.shape[1]), np.arange(40, 64))
    assert np.std((seen - cast_)[:, away]) < 0.1 * np.std(sharp - cast_)


def test_a_slanted_plane_through_the_focus() -> None:
    sharp, cast_, seen = both(slant(0.8, 2.0, 0.1, seed=4), Pupil(0.02, 0.85))
    assert np.std(seen - cast_) < 0.12 * np.std(sharp - cast_)


def test_what_is_in_focus_is_left_as_it_is() -> None:
    picture = np.random.default_rng(1).random((20, 30)).astype(np.float32)
    assert np.allclose(predicted(picture, np.full((20, 30), 1.6), 0.05, 1 / 1.6, PIXEL), picture, atol=1e-6)


@pytest.mark.parametrize("depth", [2.0, np.inf])
def test_width_of_the_blur(depth: float) -> None:
    """A line's light spreads over a disc: its second moment is a quarter of the radius squared."""
    line = np.zeros((216, 81), np.float32)
    line[:, 40] = 1
    optics, focus = 0.01, 0.5 + 1 / depth
    spread = np.mean(
        [predicted(line, np.full(line.shape, depth), optics, focus, PIXEL, seed=seed) for seed in range(8)], axis=0
    )[8:-8].mean(axis=0)
    radius = 0.005 * 0.5 / PIXEL
    place = np.arange(81) - 40
    assert spread.sum() == pytest.approx(1, rel=0.02)
    assert np.sum(spread * place**2) / spread.sum() == pytest.approx(radius**2 / 4, rel=0.03)
