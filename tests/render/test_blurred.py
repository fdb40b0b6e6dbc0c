"""A picture with its depth through a lens: against the ray caster, which knows nothing of it, and against theory."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

import focalgradient as fg
from focalgradient.errors import InputError
from focalgradient.optics import Aperture
from focalgradient.psf import disc_transfer
from focalgradient.render import blur_picture, cast
from focalgradient.scenes import slant, spheres, step

PIXEL = 8e-4
SHAPE = (96, 128)


def both(scene, optics: Aperture, pixel: float = PIXEL) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Error over the mean, blur radius in pixels, and pixels from the nearest outline, within the rim."""
    sharp = cast(scene, Aperture(0.0, 1.0), SHAPE, pixel, samples=64)
    truth = cast(scene, optics, SHAPE, pixel, samples=256).view.image
    blurred = blur_picture(sharp.view.image, sharp.distance, optics, pixel_angle=pixel)
    vergence = optics.aperture_diameter / 2 / pixel / sharp.distance
    radius = np.abs(vergence - optics.aperture_diameter / 2 / pixel * optics.focus_vergence)
    jumps = [np.abs(np.diff(vergence, axis=axis, prepend=vergence.take([0], axis))) > 1 for axis in (0, 1)]
    away = distance_transform_edt(~(jumps[0] | jumps[1]))
    rim = int(radius.max()) + 3
    inside = (slice(rim, -rim), slice(rim, -rim))
    return ((blurred - truth) / truth.mean())[inside], radius[inside], away[inside]


@pytest.mark.parametrize("focus", [0.8, 1.6])
def test_an_outline_hides_and_shows_what_a_lens_sees_past_it(focus: float) -> None:
    error, radius, away = both(step(0.8, 1.6, seed=2), Aperture(0.02, 1 / focus))
    near = away <= 2 * radius.max()
    assert np.sqrt(np.mean(error[near] ** 2)) < 0.03
    assert np.sqrt(np.mean(error[~near] ** 2)) < 0.01


def test_spheres_a_slant_and_what_is_in_focus() -> None:
    error, radius, away = both(spheres(6, field=SHAPE[1] * PIXEL), Aperture(0.008, 1 / 0.8))
    near = away <= 2 * radius.max()
    assert np.sqrt(np.mean(error[near] ** 2)) < 0.03
    error, _, _ = both(slant(0.8, 2.0, 0.1, seed=4), Aperture(0.02, 0.85))
    assert np.sqrt(np.mean(error**2)) < 0.006
    picture = np.random.default_rng(1).random((20, 30)).astype(np.float32)
    blurred = blur_picture(picture, np.full((20, 30), 1.6), Aperture(0.05, 1 / 1.6), pixel_angle=PIXEL)
    assert np.allclose(blurred, picture, atol=1e-5)


@pytest.mark.parametrize("radius", [0.6, 1.7, 5.0, 6.5, 12.0])
def test_the_disc_has_the_transfer_of_theory(radius: float) -> None:
    point, distance = np.zeros((128, 128), np.float32), 2.0 if radius < 5 else np.inf
    point[64, 64] = 1
    optics = Aperture(2 * radius * PIXEL, 1 + 1 / distance)
    spread = blur_picture(point, np.full(point.shape, distance), optics, pixel_angle=PIXEL)
    found = np.abs(np.fft.rfft2(spread))[0]
    expected = np.abs(disc_transfer(np.fft.rfftfreq(128), radius))
    error = np.abs(found - expected)
    assert error[:16].max() < 0.006  # up to 1/8 cycle a pixel
    assert error[:38].max() < 0.017  # up to 0.3: what weights that must be positive leave


@pytest.mark.parametrize("radius", [0.3, 1.0, 2.0, 6.5, 15.0])
def test_a_bright_point_becomes_a_disc_without_halo(radius: float) -> None:
    """Nothing around it is darker than it was, and the disc is even."""
    picture = np.full((64, 64), 0.05, np.float32)
    picture[32, 32] = 100
    blurred = blur_picture(picture, np.full(picture.shape, 2.0), Aperture(2 * radius * PIXEL, 1.5), pixel_angle=PIXEL)
    assert blurred.min() > 0.05 - 1e-5
    away = np.hypot(*(np.indices(picture.shape) - 32))
    inside = blurred[away < radius - 1]
    assert not len(inside) or inside.std() < 0.25 * inside.mean()
    assert np.sum((blurred - 0.05)[away > radius + 1.5]) < 1e-3 * 100


def test_an_eye_blurs_by_its_own_waves() -> None:
    """A point through an eye in focus has the transfer of diffraction, not that of a disc."""
    eye = fg.Eye(pupil_diameter=0.002, accommodation=1.0)
    minute = np.radians(1 / 120)
    point = np.zeros((96, 96), np.float32)
    point[48, 48] = 1
    for distance in (1.0, 2.0):
        spread = blur_picture(point, np.full(point.shape, distance), eye, pixel_angle=minute)
        frequency = np.fft.rfftfreq(96)
        expected = np.abs(eye.optical_transfer(0.0, frequency / minute, 1 / distance))
        assert np.abs(np.abs(np.fft.rfft2(spread))[0] - expected)[:40].max() < 0.03


def test_oblique_astigmatism_makes_no_rows_of_alternating_sign() -> None:
    """A point through an astigmatic eye keeps its exact transfer, and has no comb of bright and dark rows beside it."""
    eye = fg.Eye(0.005, 2.5, aberrations=((2, 2, -0.45), (2, -2, 0.16)))
    angle = np.radians(1.2 / 60)
    point = np.zeros((65, 65), np.float32)
    point[32, 32] = 1
    spread = blur_picture(point, np.full(point.shape, 1 / 2.75), eye, pixel_angle=angle)
    down, right = np.fft.fftfreq(65)[:, None], np.fft.rfftfreq(65)
    exact = (np.abs(down) < 0.35) & (right < 0.35)
    expected = eye.optical_transfer(down / angle, right / angle, 2.75)
    error = np.abs(np.fft.rfft2(np.fft.ifftshift(spread)) - expected)[exact].max()
    assert error < 0.006  # 0.0125 and more with the comb, which is cut off
    alternating = np.abs(spread - (np.roll(spread, 1, 0) + np.roll(spread, -1, 0)) / 2) / 2
    assert alternating[:20].max() < 1.2e-4  # 3e-4 and more with the comb


@pytest.mark.slow
def test_a_point_on_a_slope_is_blurred_as_on_a_plane_there() -> None:
    """Slopes take their blur from a table, a frontal plane at a multiple of 1/32 px its own: .175 with steps of .25."""
    eye, pixel, side = fg.Eye(0.004, 2.0), np.radians(1 / 30), 81
    errors: list[float] = []
    distance = 1 / (2 + 3 / 32 * (np.arange(side) - 40) * pixel / 0.002)
    for column in range(20, 61, 4):
        point = np.zeros((side, side), np.float32)
        point[40, column] = 1
        views = [
            blur_picture(point, np.broadcast_to(metres, point.shape), eye, pixel_angle=pixel)
            for metres in (distance, distance[column])
        ]
        errors.append(float(np.abs(views[0] - views[1]).max() / views[1].max()))
    assert max(errors) < 0.075


def test_a_wide_point_spread_is_not_cut_off() -> None:
    """Coma of 0.3 um takes 6 % of the light in focus farther than 12 of these pixels, 6 arcmin."""
    eye = fg.Eye(0.005, 1.0, aberrations=((3, 1, 0.3), (2, 2, -0.2), (3, -3, 0.15)))
    angle = np.radians(0.5 / 60)
    point = np.zeros((65, 65), np.float32)
    point[32, 32] = 1
    spread = blur_picture(point, np.ones(point.shape), eye, pixel_angle=angle)
    down, right = np.fft.fftfreq(65)[:, None], np.fft.rfftfreq(65)
    error = np.abs(np.fft.rfft2(np.fft.ifftshift(spread)) - eye.optical_transfer(down / angle, right / angle, 1.0))
    assert error[(np.abs(down) < 0.35) & (right < 0.35)].max() < 0.02  # 0.084 where it is cut off at 12 pixels


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"picture": np.ones(5)}, "picture has shape"),
        ({"distance": np.zeros((8, 8))}, "not positive"),
        ({"picture": np.ones((8, 8), np.uint8)}, "type uint8, but must be .*: decode and convert it first"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(changes: dict, words: str) -> None:
    good = {"picture": np.ones((8, 8)), "distance": np.full((8, 8), 2.0), "optics": Aperture(0.01, 1.0)}
    with pytest.raises(InputError, match=words):
        fg.blur(**{**good, **changes}, pixel_angle=1e-3)
