"""Real photographs move: a shift is measured, said, and removed on request."""

import math
from dataclasses import replace

import numpy as np
import pytest
from blurred import PIXEL, SHAPE, Camera, lens, texture, wall
from judged import over_sd

from focalgradient import FocalGradientWarning, InputError, View, recover_depth
from focalgradient.depth.registration import Placement, RegisteredViews, resample
from focalgradient.optics import Mixture

LENSES = [lens(16), lens(5.6)]
DISTANCE = 1.3  # blur discs of 0.9 and 2.8 pixels


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    "camera",
    [
        Camera(down=0.4, right=-0.3),
        Camera(scale=1.002, down=-0.8, right=0.55, gain=1.7),
        Camera(scale=0.998, down=12.2, right=3.1),
    ],
    ids=lambda c: f"{c.scale}{c.down:+}{c.right:+}",
)
@pytest.mark.filterwarnings("ignore:.*valid, most likely")
def test_a_shift_is_said_and_removed(camera: Camera) -> None:
    """Measured to 0.05 pixel at every pixel of the frame; with it removed, depth is as good as without it."""
    views = wall(LENSES, DISTANCE, cameras=[Camera(), camera], seed=5)
    with pytest.warns(FocalGradientWarning, match=r"view 2 is displaced against view 1 .*align=True"):
        left_alone = recover_depth(views, near=0.85)
    aligned = recover_depth(views, near=0.85, align=True)  # and says nothing
    for depth in (left_alone, aligned):
        (down, right), scale = depth.details["shift_px"][1], depth.details["scale"][1]
        stretch = abs(scale - camera.scale) / 2 * np.array(SHAPE)
        assert np.hypot(*(np.abs([down - camera.down, right - camera.right]) + stretch)) <= 0.05
        assert depth.details["shift_px"][0] == [0.0, 0.0]
    assert np.median(np.abs(aligned.distance[aligned.valid] / DISTANCE - 1)) < 0.008
    assert aligned.valid.mean() > 0.9


def test_registered_views_are_left_alone_up_to_a_quarter_pixel() -> None:
    """However different their blur and exposure."""
    depth = recover_depth(wall(LENSES, 2.0, cameras=[Camera(), Camera(gain=0.3)]), near=0.85)
    assert np.hypot(*depth.details["shift_px"][1]) < 0.05
    assert depth.details["scale"][1] == pytest.approx(1, abs=1e-4)
    recover_depth(wall(LENSES, DISTANCE, cameras=[Camera(), Camera(right=0.15)]), near=0.85)
    with pytest.warns(FocalGradientWarning, match=r"\+0\.3. right"):
        recover_depth(wall(LENSES, DISTANCE, cameras=[Camera(), Camera(right=0.35)]), near=0.85)


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [-1.0, 2.0])
def test_rotation_is_measured_and_removed(degrees: float) -> None:
    views = wall(LENSES, DISTANCE, cameras=[Camera(), Camera(turn=math.radians(degrees), down=0.6)], seed=5)
    depth = recover_depth(views, near=0.85, align=True)
    assert depth.details["turn_deg"] == pytest.approx([0, degrees], abs=0.02)
    assert depth.details["shift_px"][1] == pytest.approx([0.6, 0.0], abs=0.03)
    assert depth.valid.mean() > 0.95
    assert np.median(np.abs(over_sd(depth, DISTANCE))) < 1.5


def test_rotation_left_in_is_named() -> None:
    views = wall(LENSES, DISTANCE, cameras=[Camera(), Camera(turn=math.radians(-0.15))])
    with pytest.warns(FocalGradientWarning, match=r"view 2 is turned by 0.15 degrees counterclockwise"):
        recover_depth(views, near=0.85)


@pytest.mark.parametrize(
    "placement", [Placement(1.01, 2.3, -1.7), Placement(0.97, 0.5, 0.0), Placement(1.01, 2.3, -1.7, 0.05)]
)
def test_resampling_a_wave_is_exact(placement: Placement) -> None:
    """A plane wave sampled elsewhere is known in closed form."""
    height, width = 90, 120
    down, right = np.mgrid[:height, :width] - np.array([(height - 1) / 2, (width - 1) / 2])[:, None, None]

    def wave(y: np.ndarray, x: np.ndarray) -> np.ndarray:
        return np.cos(1.9 * x + 1.2 * y + 0.3)  # near the finest that pixels carry

    moved, covered = resample(wave(down, right).astype(np.float32), placement)
    cos, sin = placement.scale * math.cos(placement.turn), placement.scale * math.sin(placement.turn)
    there = cos * down + sin * right + placement.down, cos * right - sin * down + placement.right
    inside = (np.abs(there[0]) <= height / 2) & (np.abs(there[1]) <= width / 2)
    assert (covered == inside).all()
    middle = np.s_[16:-16, 16:-16]  # the mirror image beyond the frame is no wave
    assert moved[middle] == pytest.approx(wave(*there)[middle], abs=0.01)


def test_beyond_its_border_a_view_is_continued_by_its_mirror_image() -> None:
    image = np.random.default_rng(2).random((30, 40), np.float32)
    shifted = np.pad(image, 3, mode="symmetric")[5:35, :40]
    moved, covered = resample(image, Placement(1.0, 2.0, -3.0))
    assert moved == pytest.approx(shifted, abs=1e-6)
    assert covered[:28, 3:].all()
    assert covered.sum() == 28 * 37


def test_placements_compose() -> None:
    first, second = Placement(1.01, 3.0, -2.0, 0.1), Placement(0.99, 0.5, 0.25, -0.03)
    both = first.then(second)
    for point in ((-10.0, 3.0), (0.0, 0.0), (7.0, 20.0)):  # what the second finds, the first finds in the view
        assert both.of(*point) == pytest.approx(first.of(*second.of(*point)))


def test_a_region_that_differs_does_not_pull_the_rest() -> None:
    views = wall([*LENSES, lens(8)], DISTANCE, cameras=[Camera(), Camera(down=0.6, right=-0.4), Camera()])
    views[1].image[60:150, 100:210] = wall(LENSES, DISTANCE, seed=9)[1].image[60:150, 100:210]
    found = recover_depth(views, near=0.85, align=True).details["shift_px"][1]
    assert found == pytest.approx([0.6, -0.4], abs=0.05)


@pytest.mark.parametrize("masked", [False, True])
def test_what_is_blown_out_displaces_nothing(masked: bool) -> None:
    """Blur makes a clipped sky larger in one view than in the other, all on one side."""
    field = texture(0)
    field[:200] += 2.5  # an eighth of the frame and more
    views = []
    for view in wall(LENSES, DISTANCE, field=field):
        image = np.minimum(view.image, np.float32(2.0))
        views.append(View(image, view.optics, PIXEL, image < 1.999 if masked else None))
    depth = recover_depth(views, near=0.85)  # and says nothing
    assert np.hypot(*depth.details["shift_px"][1]) < 0.1
    assert depth.details["scale"][1] == pytest.approx(1, abs=1e-3)


class Mixed:
    """Optics with a mixture of two blurs."""

    aperture_diameter, focus_vergence, isotropic = 0.005, 1.2, True

    def __init__(self, shares: np.ndarray):
        self.mixture = Mixture((lens(16), lens(5.6)), shares, np.zeros(shares.shape[1:]))

    def transfer(self, frequency, vergence):
        return np.exp(-((1e-3 * (np.asarray(vergence) - 1.2) * np.asarray(frequency)) ** 2))


def test_shares_of_a_mixture_are_at_the_views_pixels() -> None:
    whole = np.full((2, 48, 64), 0.5)
    own = Mixed(whole)
    views = [View(image, own, PIXEL) for image in np.random.default_rng(1).uniform(0.4, 0.6, (2, 48, 64))]
    assert np.array_equal(RegisteredViews.of(views, align=False).shares, whole)
    with pytest.raises(InputError, match=r"shares of shape \(48, 64\), but the views have shape \(64, 48\)"):
        RegisteredViews.of([replace(view, image=view.image.T.copy()) for view in views], align=False)
