"""Depth of ray-cast scenes, whose blur comes from the geometry of rays: the figures that the depth core is held to."""

import numpy as np
import pytest
from blurred import lens
from judged import over_sd

from focalgradient import DepthMap, Lens, View, recover_depth
from focalgradient.render import Rendered, cast, noisy
from focalgradient.scenes import slant

SHAPE = (240, 320)
SEEDS = range(3)
PITCH = 8e-6
REGION = np.s_[75:165, 105:215]


def rendered(
    lenses: list[Lens], near: float, far: float, seed: int, pixels: list[float] | None = None
) -> tuple[list[View], np.ndarray]:
    """Views of a slanted plane with noise of 1 % of the mean, and the true distance on the first one's pixels."""
    pixels = pixels or [PITCH / lenses[0].sensor_distance] * len(lenses)
    scene = slant(near, far, SHAPE[1] * pixels[0], seed=seed)
    cameras = zip(lenses, pixels, strict=True)
    casts: list[Rendered] = [cast(scene, optics, SHAPE, pixel, samples=128, seed=seed) for optics, pixel in cameras]
    sd = 0.01 * float(casts[0].view.image.mean())
    return [noisy(one.view, sd, 10 * seed + i) for i, one in enumerate(casts)], casts[0].distance


class Pooled:
    """Valid readings of several frames against the truth."""

    def __init__(self, readings: list[tuple[DepthMap, np.ndarray]]):
        self.share_valid = [float(depth.valid.mean()) for depth, _ in readings]
        self.error = np.concatenate([(d.distance / truth - 1)[d.valid] for d, truth in readings])
        self.in_sd = np.concatenate([over_sd(depth, truth) for depth, truth in readings])

    def check(self, median: float, p90: float, bias: float | None = None) -> None:
        size = np.abs(self.error)
        within = np.mean(np.abs(self.in_sd) <= 2)
        assert min(self.share_valid) > 0.95
        assert np.median(size) <= median
        assert np.quantile(size, 0.9) <= p90
        assert bias is None or abs(np.mean(self.error)) <= bias
        assert 0.90 <= within <= 0.98, f"{100 * within:.1f} % within 2 sd"


def test_two_apertures() -> None:
    """A plane from 0.9 to 2.2 m at f/16 and f/5.6."""
    readings = []
    for seed in SEEDS:
        views, truth = rendered([lens(16), lens(5.6)], 0.9, 2.2, seed)
        readings.append((recover_depth(views, near=0.85), truth))
    Pooled(readings).check(median=0.005, p90=0.015, bias=0.001)


@pytest.mark.slow
@pytest.mark.parametrize("breathing", [False, True])
def test_two_focus_distances(breathing: bool) -> None:
    """A plane from 0.7 to 1.6 m focused at 0.8 and 1.25 m, telecentric or with the magnification of each focus."""
    lenses = [lens(8, 0.8), lens(8, 1.25)]
    pixels = [PITCH / one.sensor_distance for one in lenses] if breathing else None
    readings = []
    for seed in SEEDS:
        views, truth = rendered(lenses, 0.7, 1.6, seed, pixels)
        depth = recover_depth(views)
        assert depth.side_known.all()
        # Never on the wrong side, but for what lies in the plane of focus to within the error.
        for focus in (0.8, 1.25):
            clear = depth.valid & (np.abs(truth / focus - 1) > 0.02)
            assert ((depth.distance > focus) == (truth > focus))[clear].all()
        readings.append((depth, truth))
    Pooled(readings).check(median=0.0045, p90=0.012)


@pytest.fixture(scope="module")
def three() -> tuple[list[View], np.ndarray]:
    return rendered([lens(16), lens(8), lens(5.6)], 0.9, 2.2, seed=1)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("replaced", [0, 1, 2])
def test_a_view_of_another_scene_is_rejected(replaced: int, three: tuple[list[View], np.ndarray]) -> None:
    """The paper's internal check (Eq. 11): three views overdetermine depth."""
    views, truth = list(three[0]), three[1]
    other = rendered([views[replaced].optics], 0.9, 2.2, seed=7)[0][0]
    image = views[replaced].image.copy()
    image[REGION] = other.image[REGION]
    views[replaced] = View(image, views[replaced].optics, views[replaced].pixel_angle)
    depth = recover_depth(views, near=0.85)
    elsewhere = np.ones(SHAPE, bool)
    elsewhere[REGION] = False
    assert (~depth.valid[REGION]).mean() >= 0.95
    assert (~depth.valid[elsewhere]).mean() <= 0.05
    good = depth.valid & elsewhere
    assert np.median(np.abs(depth.distance / truth - 1)[good]) <= 0.005


@pytest.mark.parametrize("false_alarm", [1e-3, 0.02])
def test_false_alarms_are_as_rare_as_stated(false_alarm: float, three: tuple[list[View], np.ndarray]) -> None:
    """Rejected pixels come in clumps as large as the squares that are tested, 25 pixels: hence the tolerance."""
    rejected = recover_depth(three[0], near=0.85, false_alarm=false_alarm).details["share_disagreeing"]
    pixels = SHAPE[0] * SHAPE[1]
    assert rejected <= false_alarm + 4 * np.sqrt(25 * false_alarm / pixels)
