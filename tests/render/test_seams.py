"""No seam at outlines: against what a lens makes of two planes, and against rays through a lens over whole scenes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from focalgradient.errors import InputError
from focalgradient.eye import Cones, Eye
from focalgradient.optics import Aperture
from focalgradient.render import blur_picture
from focalgradient.stimuli.controls import refuse_seams
from focalgradient.stimuli.sharpness import sharpest

PIXEL = 1e-3


def blurred(light: np.ndarray, vergence: np.ndarray, focus: float) -> np.ndarray:
    """A picture through an aperture of which a dioptre is a pixel."""
    return blur_picture(light, 1 / (vergence + 5), Aperture(2 * PIXEL, focus + 5), pixel_angle=PIXEL)


def covered(edge: np.ndarray) -> np.ndarray:
    """Share of a disc of radius 1 on the near side of a straight edge at these distances from its middle."""
    edge = np.clip(edge, -1, 1)
    return (np.arccos(edge) - edge * np.sqrt(1 - edge**2)) / np.pi


@pytest.mark.parametrize("focus", [0.0, 5.0, 8.0, 10.0, -6.0])
def test_a_straight_edge_covers_the_lens_as_geometry_says(focus: float) -> None:
    """A near plane of light 1 before a far one of light 0: what is seen is the share of the lens that it covers."""
    vergence = np.zeros((80, 120))
    vergence[:, :60] = 10
    seen = blurred((vergence > 0).astype(float), vergence, focus)[40]
    fine = (np.arange(1200) + 0.5) / 10 - 0.5 - 59.5
    radius = max(abs(10 - focus), 1e-6)
    expected = covered(fine / radius).reshape(120, 10).mean(axis=1)
    assert np.abs(seen - expected).max() < 0.03  # 0.025 where both planes are blurred by 2 pixels


@pytest.mark.parametrize("focus", [-4.0, 0.0, 4.0])
def test_what_is_hidden_fades_with_the_jump(focus: float) -> None:
    """A step of depth that begins at 0: along it nothing changes faster than the depth does."""
    jump = np.linspace(0, 6, 160)[:, None]
    vergence = np.where(np.arange(96) < 48, jump, 0.0)
    light = np.where(np.arange(96) < 48, 1.0, 0.3) * np.ones((160, 1))
    seen = blurred(light, vergence, focus)[20:-20]
    assert np.abs(np.diff(seen, axis=0)).max() < 0.035  # 0.7 of light: 5 %; it was 25 % at the former threshold


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**31), st.floats(-10, 20))
def test_light_stays_within_the_range_of_the_picture(seed: int, focus: float) -> None:
    random = np.random.default_rng(seed)
    vergence = random.uniform(0, 15, (6, 7)).repeat(9, axis=0).repeat(9, axis=1)
    light = random.uniform(0.2, 0.8, vergence.shape)
    seen = blurred(light, vergence, focus)
    assert np.isfinite(seen).all()
    assert seen.min() > 0
    assert seen.max() < 1.2


def test_a_picture_changes_evenly_with_focus() -> None:
    """A card before a wall, both with texture: no step of focus changes a pixel much more than the others do."""
    random = np.random.default_rng(2)
    light = random.uniform(0.2, 0.8, (24, 24)).repeat(2, axis=0).repeat(2, axis=1)
    vergence = np.full(light.shape, 5.0)
    vergence[12:36, 12:30] = 8.3
    seen = np.stack([blurred(light, vergence, 5.0 + far) for far in np.arange(0.8, 2.3, 1 / 16)])
    steps = np.abs(np.diff(seen, axis=0)).max(axis=(1, 2))
    assert steps.max() < 2 * np.median(steps)


def test_an_edge_of_an_eye_has_no_seam() -> None:
    """A near plane that leaves a far one slowly, by waves: no step where the jump begins."""
    minute = np.radians(1 / 60)
    cones = Cones.of(Eye(0.005, 2.0), "L+M", wavelengths=3)
    vergence = np.where(np.arange(64) < 32, 1.0 + np.linspace(0, 0.9, 96)[:, None], 1.0)
    light = np.where(np.arange(64) < 32, 0.8, 0.3) * np.ones((96, 1))
    seen = blur_picture(light, 1 / vergence, cones, pixel_angle=minute)[16:-16]
    assert np.abs(np.diff(seen, axis=0)).max() < 0.03


@pytest.mark.slow
@pytest.mark.parametrize(("number", "rays"), [(23, 256), (3, 1024)])
def test_against_rays_through_a_lens(number: int, rays: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A card that leans on a wall; balls that stand on a floor: no place is sharper than its blur allows."""
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "benchmarks")
    import lens_rays
    import seams

    scene = lens_rays.scenes()[number]
    picture, vergence = lens_rays.picture_of(scene)
    seen = lens_rays.seen_through_lens(scene, rays=rays)
    made = seams.blurred(scene, picture, vergence)
    found = seams.compared(scene, made, vergence, seen, np.ones(seen.shape, bool))
    assert found.median < 1.1
    assert found.worst < (6 if number == 23 else 10)
    assert found.gradient < 1.15
    assert found.local < 1.7


@pytest.mark.parametrize("focus", [2.0, 9.0])
def test_the_control_of_stimuli_finds_a_seam_and_none_in_a_blurred_picture(focus: float) -> None:
    """A ball's foot on a floor; the same with a step of one tenth of the light where the blur is 5 pixels or more."""
    random = np.random.default_rng(3)
    down, right = np.mgrid[:96, :96] - 48.0
    floor = 3 + 0.06 * (down + 48)
    vergence = np.where(np.hypot(down, right) < 30, 9 - 4 * (np.hypot(down, right) / 30) ** 2, floor)
    light = random.uniform(0.3, 0.6, (24, 24)).repeat(4, axis=0).repeat(4, axis=1)
    optics = Aperture(2 * PIXEL, focus + 5)
    seen = blurred(light, vergence, focus).astype(float)
    found = sharpest(seen, light, 1 / (vergence + 5), [optics], PIXEL)
    assert found["sharpest"] < 1.15
    refuse_seams({"ball": {"pictures": {"f4-near": found}}})
    blur = np.abs(vergence - focus)
    row, column = np.argwhere(blur[20:-20, 20:-20] > 4)[0] + 20
    seen[row:, column:] += 0.1
    found = sharpest(seen, light, 1 / (vergence + 5), [optics], PIXEL)
    assert found["sharpest"] > 1.15
    with pytest.raises(InputError, match="ball/f4-near is sharper than its blur allows"):
        refuse_seams({"ball": {"pictures": {"f4-near": found}}})


def test_uneven_noise_of_samples_is_no_seam_and_hides_none() -> None:
    """Noise of one half of a picture four times that of the other, with one stray sample; then a step in quiet blur."""
    random = np.random.default_rng(4)
    distance, optics = np.full((96, 96), 1 / 9.0), Aperture(2 * PIXEL, 15.0)  # a radius of 6 pixels
    level = np.where(np.arange(96) < 48, 0.002, 0.008) * np.ones((96, 1))
    halves = [0.5 + np.sqrt(2) * level * random.normal(size=level.shape) for _ in range(2)]
    halves[0][30, 20] += 0.3
    seen, residual = (halves[0] + halves[1]) / 2, (halves[0] - halves[1]) / 2
    plain = np.full(seen.shape, 0.5)
    found = sharpest(seen, plain, distance, [optics], PIXEL, residual=residual)
    assert found["sharpest"] < 1.15
    assert sharpest(seen, plain, distance, [optics], PIXEL)["sharpest"] > 1.15
    seen[:, 10:] += 0.1
    found = sharpest(seen, plain, distance, [optics], PIXEL, residual=residual)
    assert found["sharpest"] > 1.15
    assert found["sharpest_px"][0] == 9


def test_what_the_pinhole_hides_is_not_judged() -> None:
    """A bright line in focus, hidden by an edge before it that is blurred by 6 pixels, shows in the picture."""
    before = np.broadcast_to(np.arange(96) < 48, (96, 96))
    distance = np.where(before, 1 / 15.0, 1 / 9.0)
    optics, plain = Aperture(2 * PIXEL, 9.0), np.full(before.shape, 0.3)
    seen = plain.copy()
    seen[:, 45] = 0.6
    assert sharpest(seen, plain, distance, [optics], PIXEL)["sharpest"] > 1.15
    assert sharpest(seen, plain, distance, [optics], PIXEL, unseen=True)["sharpest"] < 1.15
    seen[:, 20] = 0.6  # not by the outline
    assert sharpest(seen, plain, distance, [optics], PIXEL, unseen=True)["sharpest_px"][0] in (19, 20)
