"""Views for two eyes: the geometry of planes, signs, half-occlusion against rays, and blur set apart from disparity."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import focalgradient as fg
from focalgradient.binocular import StereoPair, monocular, warp
from focalgradient.binocular.warp import sample
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.scenes import Plane, Scene, Texture, plane

ANGLE = 1e-3
SHAPE = (48, 96)
NARROW = 0.03
"""Between the eyes, in metres: so that what is completed at the frame's sides is little."""


def lens(focus: float = 1.0, f_number: float = 4.0) -> fg.Lens:
    return fg.Lens(0.017, f_number, 1 / focus)


def card_before_wall(near: float = 0.8, far: float = 2.0) -> Scene:
    """A card of 40 mrad by 24 mrad, seen from the middle, before a wall."""
    fine = Texture(texel=0.4e-3)
    card = Plane((0.0, 0.0, near), (0, 0, -1), fine, size=(0.040 * near, 0.024 * near))
    return Scene(objects=(card, Plane((0, 0, far), (0, 0, -1), Texture(texel=1e-3))))


def shift_between(left: NDArray[np.floating], right: NDArray[np.floating]) -> float:
    """Pixels by which the left picture lies to the right of the right one, by the phase of their spectra."""
    window = np.hanning(left.shape[1])
    a, b = (np.fft.rfft((one - one.mean()) * window, axis=1) for one in (left, right))
    cross = (a * b.conj()).sum(axis=0)
    frequency = np.fft.rfftfreq(left.shape[1])
    shifts = np.linspace(-12, 12, 4801)
    fit = [(cross[1:14] * np.exp(2j * np.pi * frequency[1:14] * shift)).real.sum() for shift in shifts]
    return float(shifts[int(np.argmax(fit))])


@pytest.mark.parametrize("vergence", [0.6, 1.3])
def test_the_disparity_of_a_wall_is_dioptres_times_the_distance_between_the_eyes(vergence: float) -> None:
    wall = plane(1.0)
    pair = fg.stereo(wall, lens(), pixel_angle=ANGLE, vergence=vergence, interocular=0.02, shape=SHAPE, samples=64)
    expected = 0.02 * (1.0 - vergence)
    np.testing.assert_allclose(pair.left.disparity, expected, atol=1e-12)
    assert shift_between(pair.left.light, pair.right.light) * ANGLE == pytest.approx(expected, abs=1e-4)
    moved = fg.stereo(
        fg.cast(wall, fg.Lens(0.017, np.inf, 1.0), SHAPE, ANGLE).view.image,
        np.ones(SHAPE),
        lens(),
        pixel_angle=ANGLE,
        vergence=vergence,
        interocular=0.02,
    )
    assert shift_between(moved.left.light, moved.right.light) * ANGLE == pytest.approx(expected, abs=1e-4)
    np.testing.assert_allclose(moved.right.disparity, expected, atol=1e-12)


def test_signs() -> None:
    """What is nearer than the plane of zero disparity is farther right in the left eye's view (crossed, positive)."""
    pair = fg.stereo(card_before_wall(), lens(), pixel_angle=ANGLE, vergence=0.5, shape=SHAPE, samples=1)
    columns = {eye: np.nonzero(view.distance[24] < 1)[0].mean() for eye, view in (("l", pair.left), ("r", pair.right))}
    assert columns["l"] > columns["r"]
    assert (columns["l"] - columns["r"]) * ANGLE == pytest.approx(0.063 * (1.25 - 0.5), abs=1.5e-3)
    assert pair.left.disparity[24, int(columns["l"])] == pytest.approx(0.063 * 0.75)
    assert pair.left.disparity[2, 2] == pytest.approx(0)  # the wall is at 0.5 D
    # Of the wall the left eye alone sees what is left of the card, the right eye what is right of it.
    for view, side in ((pair.left, -1), (pair.right, 1)):
        alone = np.nonzero(view.is_monocular[24])[0]
        card = np.nonzero(view.distance[24] < 1)[0]
        assert (side * (alone - card.mean()) > 0).all()


def hidden_by_the_card(view: Any, side: float, vergence: float) -> NDArray[np.bool_]:
    """Exactly: whether the card is on the line from the other eye to the wall's point, or its frame leaves that out."""
    rows, columns = np.indices(SHAPE)
    across = (columns - (SHAPE[1] - 1) / 2) * ANGLE - side * NARROW * vergence  # tangent from this eye
    down = (rows - (SHAPE[0] - 1) / 2) * ANGLE
    x, y, z = side * NARROW + across * view.distance, down * view.distance, view.distance
    other = -side * NARROW
    share = 0.8 / z
    at_x, at_y = other + share * (x - other), share * y
    hidden = (z > 0.8) & (np.abs(at_x) < 0.020 * 0.8) & (np.abs(at_y) < 0.012 * 0.8)
    seen_at = ((x - other) / z - side * NARROW * vergence) / ANGLE + (SHAPE[1] - 1) / 2
    return np.asarray(hidden | (seen_at < -0.5) | (seen_at > SHAPE[1] - 0.5))


@pytest.mark.parametrize("vergence", [1.25, 0.5])
def test_what_one_eye_sees_alone_is_what_the_rays_say(vergence: float) -> None:
    scene = card_before_wall()
    how: dict[str, Any] = {"pixel_angle": ANGLE, "vergence": vergence, "interocular": NARROW}
    cast = fg.stereo(scene, lens(), shape=SHAPE, samples=1, **how)
    middle = fg.cast(scene, fg.Lens(0.017, np.inf, 1.0), SHAPE, ANGLE)
    moved = fg.stereo(middle.view.image, middle.distance, lens(), **how)
    for name, side in (("left", -0.5), ("right", 0.5)):
        exact = hidden_by_the_card(getattr(cast, name), side, vergence)
        assert 0.03 < exact.mean() < 0.8
        wrong = getattr(cast, name).is_monocular != exact
        assert wrong.sum(axis=1).max() <= 3  # a pixel at each outline and at the frame's rim
        assert not getattr(cast, name).is_invented.any()
        view = getattr(moved, name)
        assert (view.is_monocular != exact).sum(axis=1).max() <= 4
        # What the middle does not see was completed: by the wall, where the wall is.
        assert view.is_invented.any()
        assert (np.abs(view.distance - getattr(cast, name).distance) > 0.01).mean() < 0.02
        assert (view.is_invented & ~exact).sum(axis=1).max() <= 1


def test_a_moved_picture_is_that_of_the_rays_where_nothing_was_completed() -> None:
    scene, sharp = card_before_wall(1.0, 1.4), fg.Lens(0.017, np.inf, 1.0)
    how: dict[str, Any] = {"pixel_angle": ANGLE, "vergence": 0.9, "interocular": 0.02}
    cast = fg.stereo(scene, lens(), shape=SHAPE, samples=64, **how)
    middle = fg.cast(scene, sharp, SHAPE, ANGLE, samples=64)
    moved = fg.stereo(middle.view.image, middle.distance, lens(), **how)
    for name in ("left", "right"):
        one, other = getattr(cast, name), getattr(moved, name)
        away = ~other.is_invented
        away[:, :6] = away[:, -6:] = False
        error = (one.light - other.light)[away]
        assert np.sqrt(np.mean(error**2)) < 0.05 * one.light.mean()
        contrast = [view.light[:20, 10:-10].std() for view in (one, other)]
        assert contrast[1] == pytest.approx(contrast[0], rel=0.05)  # moving by parts of a pixel blurs little


@settings(max_examples=20, deadline=None)
@given(st.floats(-6, 6), st.integers(0, 2**31))
def test_a_plane_moved_there_and_back_is_itself(shift: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    waves = np.cumsum(np.cumsum(random.normal(size=(3, 64)), axis=1), axis=1)
    moved = np.full(waves.shape, shift)
    there = warp(moved, moved)
    kept = ~there.is_invented
    np.testing.assert_allclose(there.source[kept], np.clip(np.arange(64) - moved, 0, 63)[kept], atol=1e-9)
    seen = sample(waves, moved, there.source)
    back = warp(-moved, moved)
    again = sample(seen, -moved, back.source)[:, 14:-14]
    assert np.abs(again - waves[:, 14:-14]).max() < 0.1 * np.ptp(waves)


def test_each_eye_has_its_own_blur() -> None:
    wall = np.full(SHAPE, 1.0)
    light = np.random.default_rng(1).uniform(0.2, 0.8, SHAPE)
    pair = fg.stereo(light, wall, (lens(1.0), lens(2.5)), pixel_angle=ANGLE, vergence=1.0)
    assert pair.left.light.std() > 2 * pair.right.light.std()
    np.testing.assert_allclose(pair.left.blur, 0, atol=1e-12)
    np.testing.assert_allclose(pair.right.blur, 1.5 * 0.017 / 4 / 2)
    assert fg.stereo(light, wall, (lens(1.0), lens(2.5)), pixel_angle=ANGLE).vergence == 1.75


def test_blur_and_disparity_are_set_apart() -> None:
    random = np.random.default_rng(2)
    light = random.uniform(0.2, 0.8, SHAPE)
    far = np.where(np.arange(96) < 48, 1.0, 0.8) * np.ones(SHAPE)
    how: dict[str, Any] = {"pixel_angle": ANGLE, "vergence": 1.0}
    sharp = fg.stereo(light, far, lens(2.0), blur=False, **how)
    assert (sharp.left.blur == 0).all()
    np.testing.assert_allclose(sharp.left.light[:, 20:30], light[:, 20:30], atol=1e-6)
    true = fg.stereo(light, far, lens(2.0), **how)
    reversed_blur = fg.stereo(light, far, lens(2.0), blur_distance=lambda z: 1 / (2.25 - 1 / z), **how)
    even = fg.stereo(light, far, lens(2.0), blur_distance=0.5, **how)
    flat = fg.stereo(light, far, lens(2.0), disparity_distance=1.0, **how)
    for pair in (sharp, reversed_blur, even):
        np.testing.assert_allclose(pair.left.disparity, true.left.disparity)
        np.testing.assert_allclose(pair.left.distance, true.left.distance)
    radius = 0.017 / 4 / 2
    np.testing.assert_allclose(true.left.blur[0, [10, 80]], [radius * 1.0, radius * 0.75])
    np.testing.assert_allclose(reversed_blur.left.blur[0, [10, 80]], [radius * 0.75, radius * 1.0])
    np.testing.assert_allclose(even.left.blur, 0, atol=1e-12)
    assert (flat.left.disparity == 0).all()
    np.testing.assert_allclose(flat.left.light, flat.right.light)
    np.testing.assert_allclose(flat.left.blur[0, [10, 80]], [radius * 1.0, radius * 0.75])
    of_scene = fg.stereo(card_before_wall(), lens(), disparity_distance=1.0, shape=SHAPE, samples=4, **how)
    assert (of_scene.left.disparity == 0).all()
    assert of_scene.left.distance.min() == pytest.approx(0.8)
    scene_sharp = fg.stereo(card_before_wall(), lens(), blur=False, shape=SHAPE, samples=4, **how)
    assert (scene_sharp.right.blur == 0).all()


def test_a_picture_by_the_left_camera_is_the_left_eyes() -> None:
    light, far = np.random.default_rng(3).uniform(size=SHAPE), np.full(SHAPE, 0.9)
    pair = fg.stereo(light, far, lens(), pixel_angle=ANGLE, vergence=1.0, camera=-0.5, blur=False)
    np.testing.assert_allclose(pair.left.light, light, atol=1e-6)
    assert not pair.left.is_invented.any()
    assert pair.right.is_invented[:, -5:].all()


@pytest.fixture(scope="module")
def pair() -> StereoPair:
    light = np.random.default_rng(4).uniform(0.1, 0.9, (*SHAPE, 3))
    return fg.stereo(light, np.full(SHAPE, 0.95), lens(), pixel_angle=ANGLE, vergence=1.0, blur=False)


def test_the_ways_to_show_a_pair(pair: StereoPair) -> None:
    left, right = pair.left.light, pair.right.light
    assert (pair.side_by_side()[:, 96:] == right).all()
    assert (pair.side_by_side(crossed=True)[:, 96:] == left).all()
    assert (pair.over_under()[:48] == left).all()
    rows = pair.interleaved()
    assert (rows[::2] == left[::2]).all()
    assert (rows[1::2] == right[1::2]).all()
    assert (pair.interleaved(first="right")[::2] == right[::2]).all()
    grey = pair.anaglyph()
    np.testing.assert_allclose(grey[..., 0], left @ [0.2126, 0.7152, 0.0722], rtol=1e-3)
    assert (grey[..., 1] == grey[..., 2]).all()
    colour = pair.anaglyph("colour")
    assert (colour[..., 0] == left[..., 0]).all()
    assert (colour[..., 1:] == right[..., 1:]).all()
    turned = pair.screens()
    assert (turned[0] == left[:, ::-1]).all()
    screen = pair.halves((320, 100), centres_px=200)
    assert (screen[26:74, 12:108] == left).all()
    assert (screen[26:74, 212:308] == right).all()
    with pytest.raises(InputError, match="do not fit"):
        pair.halves((180, 100))
    with pytest.raises(InputError, match="grey"):
        pair.anaglyph("purple")  # type: ignore[arg-type]


def test_the_truth_is_kept_beside_the_pictures(pair: StereoPair, tmp_path: Path) -> None:
    pair.save(tmp_path)
    with np.load(tmp_path / "right.npz") as found:
        assert set(found) >= {"light", "distance", "vergence", "disparity", "blur", "is_monocular", "is_invented"}
        np.testing.assert_allclose(found["disparity"], pair.right.disparity, rtol=1e-6)
        np.testing.assert_allclose(found["vergence"], 1 / 0.95, rtol=1e-6)


def test_a_thin_post_is_seen_on_either_side() -> None:
    own = np.zeros((1, 20))
    other = np.zeros((1, 20))
    own[0, 12:14], other[0, 8:10] = 1.0, 1.0  # 4 pixels a dioptre
    assert np.nonzero(monocular(own, other, 4.0, 1)[0])[0].tolist() == [8, 9]
    assert np.nonzero(monocular(other, own, 4.0, -1)[0])[0].tolist() == [12, 13]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"eye": (lens(),) * 3}, "eye contains 3 optics"),
        ({"scene": np.ones((*SHAPE, 4))}, "must be H x W"),
        ({"disparity_distance": np.ones(3)}, "disparity_distance"),
        ({"scene": plane(1.0), "shape": SHAPE}, "distance is given with a scene"),
    ],
)
def test_what_makes_no_sense_is_refused(change: dict[str, Any], said: str) -> None:
    given_: dict[str, Any] = {"scene": np.ones(SHAPE), "distance": np.ones(SHAPE), "eye": lens(), "pixel_angle": ANGLE}
    with pytest.raises(InputError, match=said):
        fg.stereo(**{**given_, **change})


def test_a_view_that_is_mostly_guessed_is_warned_about() -> None:
    with pytest.warns(FocalGradientWarning, match="was inpainted"):
        fg.stereo(np.ones(SHAPE), np.full(SHAPE, 0.5), lens(), pixel_angle=ANGLE, vergence=0.5)
