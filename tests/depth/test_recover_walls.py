"""Depth of flat walls whose views are made by filtering: no bias, an honest uncertainty, and what must not matter."""

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import blurred
import numpy as np
import pytest
from blurred import SHAPE, lens, texture, wall
from judged import check, over_sd

from focalgradient import DepthMap, FocalGradientWarning, Lens, View, recover_depth

APERTURES = [lens(16), lens(5.6)]
FOCI = [lens(8, 0.8), lens(8, 1.25)]
INSIDE = np.s_[16:-16, 16:-16]


def apart(one: DepthMap, other: DepthMap) -> float:
    """Root mean square difference of two readings, in units of the stated uncertainty, where both are valid."""
    both = one.valid & other.valid
    assert both.mean() > 0.9
    difference = (one.vergence - other.vergence)[both]
    return float(np.sqrt(np.mean(difference**2) / np.mean(one.vergence_sd[both] ** 2)))


@pytest.mark.slow
def test_light_from_beyond_the_frame_misleads_no_more_of_it_than_blur_reaches() -> None:
    """At 10 pixels of blur all but a narrow rim is claimed, and what is claimed there is as sure as stated."""
    near_border = np.ones(SHAPE, np.bool_)
    near_border[24:-24, 24:-24] = False
    within = []
    for seed in range(4):
        depth = recover_depth(wall([lens(16, 0.55), lens(5.6, 0.55)], 1.7, seed=seed), near=0.55)
        assert depth.valid[near_border].mean() > 0.8
        use = depth.valid & near_border
        within.append((np.abs(depth.vergence - 1 / 1.7) < 2 * depth.vergence_sd)[use].mean())
    assert np.mean(within) > 0.9


# --- right, and honest about it ---------------------------------------------------------------------------------------


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(("distance", "noise"), [(3.0, 0.01), (2.8, 0.003), (2.6, 0.003)])
def test_in_focus_and_just_off_it_depth_is_right_as_often_as_stated(distance: float, noise: float) -> None:
    """Blur from 0 to 0.36 px: by a straight line in depth these walls were 2 to 3 stated sd too near."""
    errors = []
    for seed in range(3):
        depth = recover_depth(wall([lens(16, 3.0), lens(5.6, 3.0)], distance, seed=seed, noise=noise), far=3.0)
        assert depth.valid.mean() > 0.8
        errors.append(over_sd(depth, distance))
    error = np.concatenate(errors)
    assert 0.92 <= np.mean(np.abs(error) <= 2) <= 0.995
    # In focus half of what noise does is cut off.
    assert np.median(error) < (0.9 if distance == 3 else 0.25)


@pytest.mark.fast_cases(3)
@pytest.mark.parametrize(
    ("lenses", "limits", "distance", "psf"),
    [
        (APERTURES, {"near": 0.85}, 1.0, "disc"),
        (APERTURES, {"near": 0.85}, 2.0, "disc"),
        ([lens(16, 2.0), lens(5.6, 2.0)], {"far": 2.0}, 1.1, "gaussian"),
        (FOCI, {}, 1.0, "gaussian"),
        (FOCI, {}, 1.6, "disc"),
        ([lens(16), lens(8), lens(4)], {"near": 0.85}, 1.4, "disc"),
        ([lens(8, 0.7), lens(8, 1.0), lens(8, 1.6)], {}, 1.2, "gaussian"),
        ([lens(5.6), lens(math.inf)], {"near": 0.85}, 2.0, "gaussian"),
    ],
    ids=lambda value: (
        "-".join(f"f{v.f_number:g}@{v.focus_distance:g}" for v in value) if isinstance(value, list) else None
    ),
)
def test_unbiased_with_the_uncertainty_stated(
    lenses: list[Lens], limits: dict[str, float], distance: float, psf: str
) -> None:
    errors, stated = [], []
    for seed in range(3):
        depth = recover_depth(wall(lenses, distance, seed=seed, psf=psf), psf=psf, **limits)
        assert depth.valid.mean() > 0.95
        assert depth.details["noise"] == pytest.approx([0.01] * len(lenses), rel=0.05)
        errors.append((depth.vergence - 1 / distance)[INSIDE])
        stated.append(depth.vergence_sd[INSIDE])
    rms, sd = np.sqrt(np.mean(np.square(errors))), np.sqrt(np.mean(np.square(stated)))
    # Tiles much larger than the window err independently.
    tiles = np.array(
        [[tile.mean() for rows in np.array_split(e, 2) for tile in np.array_split(rows, 3, 1)] for e in errors]
    )
    standard_error = tiles.std(ddof=1) / math.sqrt(tiles.size)
    bias = np.mean(errors)
    assert abs(bias) * distance <= 0.001 + 2 * standard_error * distance, (
        f"bias {bias / sd:+.2f} sd, {100 * bias * distance:+.3f} %"
    )
    assert 0.75 <= rms / sd <= 1.3, f"root mean square error {rms / sd:.2f} times what is stated"
    within = np.mean(np.abs(errors) <= 2 * np.array(stated))
    assert 0.88 <= within <= 0.99, f"{100 * within:.1f} % within 2 sd"


@pytest.mark.slow
@pytest.mark.parametrize("distance", [0.7, 1.6])
@pytest.mark.filterwarnings("ignore:.*valid, most likely")
def test_what_two_depths_explain_alike_is_rejected(distance: float) -> None:
    """Gaussians tell only the difference of two variances: with aperture and focus both changed, two depths have it."""
    depth = recover_depth(wall([lens(4, 1.25), lens(11, 0.8)], distance, psf="gaussian"), psf="gaussian")
    assert (np.abs(over_sd(depth, distance)) > 4).sum() <= 0.01 * depth.valid.size


def test_gaussian_of_another_width() -> None:
    """k is sigma / disc radius: the right k gives the right depth; half of it takes the blur for twice as wide."""
    views = wall(APERTURES, 1.2, psf="gaussian", k=0.7)
    right = recover_depth(views, near=0.85, psf="gaussian", k=0.7)
    assert np.median(right.distance[right.valid]) == pytest.approx(1.2, rel=0.005)
    half = recover_depth(views, near=0.85, psf="gaussian", k=0.35)
    assert np.median(half.vergence[half.valid]) == pytest.approx(1 / 0.85 - 2 * (1 / 0.85 - 1 / 1.2), abs=0.01)


# --- what must not matter ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def pair() -> list[View]:
    return wall(APERTURES, 1.3, seed=2)


@pytest.fixture(scope="module")
def reading(pair: list[View]) -> DepthMap:
    return recover_depth(pair, near=0.85)


def test_exposure(pair: list[View], reading: DepthMap) -> None:
    """A gain on one view is measured; with the noise given too, nothing changes at all."""
    brighter = [pair[0], replace(pair[1], image=np.float32(3) * pair[1].image)]
    depth = recover_depth(brighter, near=0.85, noise=[0.01, 0.03])
    assert depth.details["gain"] == pytest.approx([1.0, 3.0], rel=5e-3)
    assert apart(recover_depth(pair, near=0.85, noise=0.01), depth) < 0.02
    assert apart(reading, recover_depth(brighter, near=0.85)) < 0.5


@pytest.mark.parametrize("unit", [1e-3, 65535.0])
def test_unit_of_radiance(pair: list[View], reading: DepthMap, unit: float) -> None:
    depth = recover_depth([replace(view, image=view.image * np.float32(unit)) for view in pair], near=0.85)
    assert apart(reading, depth) < 0.02
    assert depth.details["noise"] == pytest.approx([unit * sd for sd in reading.details["noise"]], rel=0.01)


def test_precision_of_storage_and_order_of_views(pair: list[View], reading: DepthMap) -> None:
    assert apart(reading, recover_depth([replace(v, image=v.image.astype(float)) for v in pair], near=0.85)) < 0.01
    assert apart(reading, recover_depth(pair[::-1], near=0.85)) < 0.5


def test_mirror_image(pair: list[View], reading: DepthMap) -> None:
    """Down and across at once."""
    flipped = recover_depth([replace(v, image=np.flip(v.image).copy()) for v in pair], near=0.85)
    back = DepthMap(*(np.flip(getattr(flipped, name)) for name in ("vergence", "vergence_sd", "valid", "side_known")))
    assert apart(reading, back) < 0.5


@pytest.mark.parametrize(
    ("near", "far"),
    [(np.s_[:, 404:416], np.s_[20:-20, :40]), (np.s_[136:148], np.s_[-40:, 20:-20])],
    ids=["right", "top"],
)
def test_a_border_does_not_reach_the_opposite_one(pair: list[View], reading: DepthMap, near, far) -> None:
    """A bright stripe along one border: filters that wrapped would carry it to the other."""
    lit = texture(2)
    lit[near] *= 6
    depth = recover_depth(wall(APERTURES, 1.3, seed=2, field=lit), near=0.85)
    # More light alters the weights of all frequencies, and all depths by a fraction of their sd: the middle shows it.
    moved = np.abs(depth.vergence - reading.vergence) / reading.vergence_sd
    assert np.median(moved[far]) < 0.1 + 1.25 * np.median(moved[80:160, 120:200])
    assert (depth.valid[far] == reading.valid[far]).mean() > 0.97


@pytest.mark.slow
def test_threads_do_not_meddle(pair: list[View], reading: DepthMap) -> None:
    """Calls side by side give what they give one after another."""
    others = wall(FOCI, 1.0)
    alone = recover_depth(others)
    found: dict[int, DepthMap] = {}

    def work(number: int) -> None:
        found[number] = recover_depth(others) if number % 2 else recover_depth(pair, near=0.85)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(work, range(4)))
    for number, depth in found.items():
        expected = alone if number % 2 else reading
        assert depth.vergence == pytest.approx(expected.vergence, abs=1e-5)
        assert (depth.valid == expected.valid).all()
    assert len(found) == 4


# --- what must be rejected --------------------------------------------------------------------------------------------


def test_no_texture_is_rejected() -> None:
    """Where nothing but noise and uneven light is seen, nothing is claimed."""
    field = texture(4)
    ramp = np.linspace(0.9, 1.1, field.shape[1])
    field[:, 256:] = ramp[256:]  # the right half of the frame
    depth = recover_depth(wall(APERTURES, 1.3, field=field), near=0.85)
    assert depth.valid[16:-16, 16:120].mean() > 0.97
    assert depth.valid[:, 200:].mean() < 0.02
    assert np.median(depth.distance[16:-16, 16:120]) == pytest.approx(1.3, rel=0.01)


@pytest.mark.filterwarnings("ignore:.*valid, most likely")
@pytest.mark.filterwarnings("ignore:view 2 (is displaced|does not seem)")  # what shows nothing may seem to lie anywhere
def test_one_view_without_detail_is_rejected(pair: list[View]) -> None:
    """Detail in one view and none in the other fits no depth."""
    ramp = np.broadcast_to(np.linspace(0.9, 1.1, SHAPE[1]), SHAPE)
    image = ramp + 0.01 * np.random.default_rng(0).standard_normal(SHAPE)
    assert recover_depth([pair[0], replace(pair[1], image=image)], near=0.85).valid.mean() < 0.05


def test_without_the_mechanism_there_is_no_depth() -> None:
    """Both views blurred alike and said to differ: what was right before was owed to blur."""
    sharp = wall([lens(16)] * 2, 1.5, seed=6)
    stated = [sharp[0], replace(sharp[1], optics=lens(5.6))]
    depth = recover_depth(stated, near=0.85)
    assert (depth.valid & (np.abs(depth.distance / 1.5 - 1) < 0.1)).mean() < 0.01


# --- the side of focus ------------------------------------------------------------------------------------------------


def test_side_left_open_is_said() -> None:
    """Two apertures, no limit: nearer points read as their mirror image beyond focus, and the map says so."""
    nearer = 0.7
    with pytest.warns(FocalGradientWarning, match="share one plane of focus.*taken to lie beyond it"):
        depth = recover_depth(wall(APERTURES, nearer))
    assert not depth.side_known.any()
    assert "taken to lie beyond it" in depth.details["side"]
    mirror = 2 / 0.85 - 1 / nearer
    assert np.median(depth.vergence[depth.valid]) == pytest.approx(mirror, abs=0.01)


@pytest.mark.parametrize(
    ("lenses", "distance", "limits", "said"),
    [
        (APERTURES, 1.2, {"near": 1.0, "far": 3.0}, "beyond focus, by the limits"),
        (APERTURES, 0.7, {"far": 0.85}, "nearer than focus, by the limits"),
        (FOCI, 0.7, {}, "estimated from the views"),
    ],
)
def test_side_known(lenses: list[Lens], distance: float, limits: dict[str, float], said: str) -> None:
    depth = recover_depth(wall(lenses, distance), **limits)
    assert depth.side_known.all()
    assert said in depth.details["side"]
    check(depth, distance)


@pytest.mark.parametrize("near", [0.1, pytest.param(1e-6, marks=pytest.mark.slow)])
def test_limits_that_leave_all_open_do_no_harm(near: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Blur of hundreds of pixels passes next to nothing, which any views would fit."""
    monkeypatch.setattr(blurred, "SHAPE", (96, 128))
    depth = recover_depth(wall([lens(4, 0.8), lens(4, 1.25)], 1.0), near=near)
    check(depth, 1.0, rel=0.003)


@pytest.mark.filterwarnings("ignore:view 2 is displaced")  # 32 pixels do not tell 1 % of scale
@pytest.mark.parametrize("shape", [(32, 32), (33, 40), (40, 200)])
def test_depth_of_small_frames_is_estimated(shape: tuple[int, int]) -> None:
    """Few frequencies fall on a small frame's spectrum, and none at many radii."""
    views = [replace(view, image=view.image[: shape[0], : shape[1]]) for view in wall([lens(16), lens(5.6)], 1.2)]
    depth = recover_depth(views, near=0.85)
    assert depth.valid.mean() > 0.99
    assert abs(np.median(depth.vergence[depth.valid]) - 1 / 1.2) < 3 * np.median(depth.vergence_sd[depth.valid])
