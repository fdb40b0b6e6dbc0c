"""Autofocus: the sharpest of a stack of focus settings, to a small part of their spacing, and honest about it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from blurred import Camera, lens, wall
from hypothesis import given, settings
from hypothesis import strategies as st
from judged import covered, over_sd

from focalgradient import DepthMap, InputError, Lens, View, recover_depth
from focalgradient.depth.autofocus.estimate import peaks
from focalgradient.render import cast, noisy
from focalgradient.scenes import slant

PITCH = 8e-6


def stack(*vergences: float, f_number: float = 4) -> list[Lens]:
    return [lens(f_number, 1 / vergence) for vergence in vergences]


# --- the peak ---------------------------------------------------------------------------------------------------------


@settings(max_examples=20, deadline=None)
@given(
    steps=st.lists(st.floats(0.05, 0.5), min_size=3, max_size=12),
    place=st.floats(0.05, 0.95),
    width=st.floats(0.2, 1.0),
    height=st.floats(1e-6, 1e6),
)
def test_the_peak_of_blur_that_is_even_about_focus_is_covered(
    steps: list[float], place: float, width: float, height: float
) -> None:
    """Sharpness as 1 / (s^2 + sigma^2)^2, at settings of any spacing, by whatever power few settings make likely."""
    focus = np.cumsum(steps)
    vergence = focus[0] + place * (focus[-1] - focus[0])
    measure = height / (1 + ((focus - vergence) / width) ** 2) ** 2
    found = peaks(measure[:, None, None], np.full((len(focus), 1, 1), 1e-18 * height**2), focus, reach=0.5)
    assert found.valid.all()
    assert found.vergence.item() == pytest.approx(vergence, abs=1e-3 * width + found.shape_sd.item())


@pytest.mark.parametrize("power", [0.3, 0.5, 0.6])
@pytest.mark.parametrize("place", [0.52, 0.8, 1.08])
def test_the_power_that_is_parabolic_is_found_from_many_settings(power: float, place: float) -> None:
    focus = np.linspace(0.5, 1.1, 12)
    measure = (1 + ((focus - place) / 0.1) ** 2) ** (-1 / power)
    found = peaks(measure[:, None, None], 1e-12 * np.ones((12, 1, 1)), focus, reach=0.2)
    assert found.vergence.item() == pytest.approx(place, abs=3e-4)


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize("psf", ["disc", "gaussian"])
@pytest.mark.parametrize("place", [0.42, 0.7, 0.98])
def test_depth_is_unbiased_up_to_the_ends_of_the_stack(psf: str, place: float) -> None:
    """Blur of the next setting is 0.2 pixel in radius: settings on one side of the ends alone tell."""
    depth = recover_depth(wall(stack(*np.linspace(0.4, 1, 8), f_number=16), 1 / place, psf=psf), method="autofocus")
    assert depth.valid.mean() > 0.9
    assert abs(np.median(over_sd(depth, 1 / place))) < 0.6


def test_uncertainty_of_a_peak_is_that_of_its_noise() -> None:
    focus = np.array([0.4, 0.6, 0.7, 1.0, 1.1])
    clean = (1 + ((focus - 0.77) / 0.2) ** 2) ** -2.0
    sd = 0.02 * np.sqrt(clean)
    random = np.random.default_rng(3)
    measure = clean[:, None, None] + sd[:, None, None] * random.standard_normal((5, 40, 50))
    found = peaks(measure, np.broadcast_to(sd[:, None, None] ** 2, measure.shape), focus, reach=0.3)
    assert found.vergence.mean() == pytest.approx(0.77, abs=3 * found.vergence.std() / np.sqrt(2000) + 0.001)
    assert found.vergence.std() == pytest.approx(np.sqrt(np.mean(found.sd**2)), rel=0.1)
    # What the reading claims of each setting's measure is what it does.
    changed = measure.copy()
    changed[2] *= 1 + 1e-6
    again = peaks(changed, np.broadcast_to(sd[:, None, None] ** 2, measure.shape), focus, reach=0.3)
    assert np.allclose(again.vergence - found.vergence, 1e-6 * found.rise[2] * measure[2], rtol=0.25, atol=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_settings_that_are_off_by_more_than_is_stated_are_seen_and_covered(seed: int) -> None:
    """As the foci of a phone's stack, which are rounded: error of depth, by peaks of a slant, follows the settings'."""
    focus, vergence = np.linspace(0.4, 1.2, 7), np.linspace(0.55, 1.05, 2000).reshape(40, 50)
    off = 0.02 * np.random.default_rng(seed).standard_normal(7)
    off -= np.polyval(np.polyfit(focus, off, 1), focus)  # what all peaks follow is not seen
    for error in (0 * off, off):
        measure = (1 + ((focus + error)[:, None, None] - vergence) ** 2 / 0.1**2) ** -2.0
        found = peaks(measure, 1e-8 * measure, focus, reach=0.2)
        assert found.focus_sd == pytest.approx(np.sqrt(error @ error / 5), rel=0.5)
        within = np.abs(found.vergence - vergence) < 2 * np.hypot(found.sd, found.shape_sd) + 1e-4
        assert within.mean() > 0.88


# --- walls ------------------------------------------------------------------------------------------------------------


def test_uneven_settings_in_any_order_through_cameras_of_any_exposure() -> None:
    lenses = stack(0.95, 0.5, 1.2, 0.72, 0.81, 0.6)
    cameras = [Camera(gain=gain) for gain in (1.0, 0.5, 2.0, 1.0, 1.5, 1.0)]
    depth = recover_depth(wall(lenses, 1.3, cameras=cameras), method="autofocus")
    assert depth.valid.mean() > 0.99
    assert np.median(depth.distance[depth.valid]) == pytest.approx(1.3, rel=5e-4)
    assert depth.side_known.all()
    assert depth.details["gain"] == pytest.approx([1.0, 0.5, 2.0, 1.0, 1.5, 1.0], rel=5e-3)
    assert json.loads(json.dumps(depth.details)) == depth.details


def test_needs_no_model_of_blur() -> None:
    depth = recover_depth(wall(stack(0.5, 0.65, 0.8, 0.95), 1.4, psf="gaussian", k=0.6), method="autofocus")
    assert np.median(depth.distance[depth.valid]) == pytest.approx(1.4, rel=2e-3)
    assert np.mean(np.diff(depth.vergence) == 0) < 0.1, "interpolated between blocks, which are not repeated"


@pytest.mark.filterwarnings("ignore:.*valid, most likely")
@pytest.mark.parametrize(("distance", "way", "focus"), [(2.5, -1, 0.6), (0.7, 1, 1.2)])
def test_what_lies_beyond_the_stack_is_stated_as_such(distance: float, way: int, focus: float, tmp_path: Path) -> None:
    depth = recover_depth(wall(stack(0.6, 0.8, 1.0, 1.2), distance), method="autofocus")
    assert depth.beyond is not None
    assert np.mean(depth.beyond == way) > 0.9
    assert not (depth.beyond == -way).any()
    assert not depth.valid[depth.beyond != 0].any()
    assert depth.vergence[depth.beyond == way] == pytest.approx(focus)
    assert "lies at or beyond the farthest focus (view 1)" in depth.details["rejected"]
    assert "at or beyond the farthest focus: " in depth.summary()
    depth.save(tmp_path / "depth.npz")
    again = DepthMap.load(tmp_path / "depth.npz")
    assert (again.beyond == depth.beyond).all()
    assert again.evidence is None


def test_within_the_stack_nothing_lies_beyond_and_no_sliver_is_claimed() -> None:
    assert not recover_depth(wall(stack(0.5, 0.65, 0.8, 0.95), 1.4), method="autofocus").beyond.any()
    # Half of the frame lies in the stack, half beyond it: what is claimed is that half, and no strip beside it.
    lenses = stack(0.6, 0.8, 1.0, 1.2)
    near, far = (wall(lenses, distance) for distance in (1.25, 2.6))
    width = near[0].shape[1]
    at = np.arange(width) < width // 2
    views = [replace(one, image=np.where(at, one.image, other.image)) for one, other in zip(near, far, strict=True)]
    depth = recover_depth(views, method="autofocus")
    beside = np.abs(np.arange(width) - width / 2) > 16
    assert depth.valid[:, at & beside].mean() > 0.9
    assert (depth.beyond[:, ~at & beside] == -1).mean() > 0.9
    assert (np.abs(over_sd(depth, np.where(at, 1.25, 2.6))) > 5).sum() < 0.01 * depth.valid.size


def test_uncertainty_of_views_that_rounding_made_equal_covers_the_foci_of_both() -> None:
    """A stored picture, blurred by 0.3 pixel and stored again, is that picture: the last two views are equal."""
    lenses = stack(*np.linspace(0.4, 1.0, 6), f_number=16)
    *views, _, last = wall(lenses, 1 / lenses[-1].focus_vergence, noise=0.003)
    depth = recover_depth([*views, replace(last, optics=lenses[-2]), last], method="autofocus")
    assert depth.vergence[depth.valid].min() > 0.87
    assert depth.valid.mean() > 0.9
    assert covered(depth, 1.0) > 0.95
    assert np.median(depth.vergence_sd) < 0.12, "the spacing of the foci"


@pytest.mark.parametrize("exposures", [2, 3])
def test_several_exposures_at_each_setting(exposures: int) -> None:
    """Blur of the next setting is 2 pixels and more: the nearest three views are of one setting or two."""
    settings_ = np.repeat([0.5, 0.65, 0.8, 0.95], exposures).tolist()
    depth = recover_depth(wall(stack(*settings_, f_number=2.8), 1.4), method="autofocus")
    assert depth.valid.mean() > 0.95
    assert abs(np.median(over_sd(depth, 1.4))) < 1
    assert covered(depth, 1.4) > 0.9


# --- ray-cast scenes --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def slanted() -> list[tuple[list[View], np.ndarray]]:
    """A plane from 0.9 to 2.2 m at nine settings, 1 % noise, each view with the magnification of its own focus."""
    pairs = []
    lenses = stack(*np.linspace(0.42, 1.15, 9).tolist())
    pixels = [PITCH / one.sensor_distance for one in lenses]
    for seed in range(2):
        scene = slant(0.9, 2.2, 320 * pixels[0], seed=seed)
        cameras = zip(lenses, pixels, strict=True)
        rendered = [cast(scene, optics, (240, 320), pixel, samples=128, seed=seed) for optics, pixel in cameras]
        sd = 0.01 * float(rendered[0].view.image.mean())
        views = [noisy(one.view, sd, 50 * seed + i) for i, one in enumerate(rendered)]
        pairs.append((views, rendered[0].distance))
    return pairs


@pytest.mark.slow
@pytest.mark.parametrize(("every", "valid", "median"), [(1, 0.95, 0.001), (2, 0.95, 0.003), (4, 0.8, 0.01)])
def test_slanted_plane(every: int, valid: float, median: float, slanted: list[tuple[list[View], np.ndarray]]) -> None:
    """Nine settings, five, three: blur of the next setting grows from 0.9 to 3.6 pixels in radius."""
    readings = [(recover_depth(views[::every], method="autofocus"), truth) for views, truth in slanted]
    relative = np.concatenate([(depth.distance / truth - 1)[depth.valid] for depth, truth in readings])
    stated = np.concatenate([over_sd(depth, truth) for depth, truth in readings])
    assert min(depth.valid.mean() for depth, _ in readings) > valid
    assert np.median(np.abs(relative)) <= median
    assert abs(np.median(relative)) <= median / 3
    within = np.mean(np.abs(stated) <= 2)
    assert 0.90 <= within <= 0.98, f"{100 * within:.1f} % within 2 sd"


# --- what is no stack -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lenses", "limits", "words"),
    [
        ([lens(4), lens(5.6), lens(8)], {}, "hold 1 different focus setting, but"),
        (stack(0.5, 0.8, 0.5), {}, "hold 2 different focus settings, but"),
        ([*stack(0.5, 0.8), *stack(1.0, f_number=8)], {}, "differ in aperture"),
        (stack(0.5, 0.8, 1.0), {"near": 2.5}, "focused from 1 to 2 m, but"),
        (stack(0.5, 0.8), {}, "needs 3 or more"),
    ],
)
def test_refusals(lenses: list[Lens], limits: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        recover_depth(wall(lenses, 1.4), method="autofocus", **limits)
