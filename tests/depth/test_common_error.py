"""What focus and apertures that are known to a tolerance leave uncertain, and what measured points take away."""

from dataclasses import replace

import numpy as np
import pytest
from shaped import walls
from textures import natural

from focalgradient import DepthMap, InputError, Lens, View, recover_depth
from focalgradient.depth.common_error import common_modes, modes_of_optics, spread_over, with_known_points
from focalgradient.errors import FocalGradientWarning
from focalgradient.optics.lens import FIELD_TOLERANCE
from focalgradient.psf import Disc
from focalgradient.render import blur_picture

FOCUS = 1.0


def pair(focus: float = FOCUS, stop: float = 1.0, **tolerances: float) -> list[Lens]:
    """Return two lenses with a flat field, unless stated otherwise."""
    return [Lens(0.035, number * stop, 1 / focus, **{"field_tolerance": 0.0} | tolerances) for number in (11.0, 2.8)]


def seen(vergence: np.ndarray, lenses: list[Lens]) -> np.ndarray:
    """Difference of squared blur radii, which is all that two views of one focus show."""
    wide, narrow = (
        (0.5 * one.aperture_diameter * (one.focus_vergence - vergence)) ** 2 for one in (lenses[1], lenses[0])
    )
    return wide - narrow


@pytest.mark.parametrize("two_foci", [False, True])
def test_modes_are_what_wrong_optics_do_to_depth(two_foci: bool) -> None:
    """Against the answer itself: the vergence at which wrong optics explain what right ones show."""
    true = np.array([0.4, 0.7, 1.4])
    right = pair(focus_tolerance=0.05, aperture_tolerance=0.03)
    if two_foci:
        right[0] = Lens(0.035, 2.8, 0.6, focus_tolerance=0.05, aperture_tolerance=0.03)
    modes = modes_of_optics(true, right)
    foci = [one.focus_vergence for one in right]
    for number, mode in enumerate(modes["focus"]):
        small = 1e-4
        changed = [
            Lens(0.035, one.f_number, 1 / (focus * (1 + small * (not two_foci or n == number))))
            for n, (one, focus) in enumerate(zip(right, foci, strict=True))
        ]
        grid = true[:, None] + np.linspace(-1e-3, 1e-3, 4001)
        off = np.abs(seen(grid, changed) - seen(true, right)[:, None])
        moved = np.take_along_axis(grid, off.argmin(axis=1)[:, None], 1)[:, 0] - true
        np.testing.assert_allclose(moved / small, mode / 0.05, atol=0.02)
    assert len(modes["focus"]) == (2 if two_foci else 1)
    grid = true[:, None] + np.linspace(-1e-3, 1e-3, 4001)
    larger = [Lens(0.035, one.f_number / (1 + 1e-4), one.focus_distance) for one in right]
    off = np.abs(seen(grid, larger) - seen(true, right)[:, None])
    moved = np.take_along_axis(grid, off.argmin(axis=1)[:, None], 1)[:, 0] - true
    np.testing.assert_allclose(moved / 1e-4, modes["apertures"][0] / 0.03, atol=0.03)


def wall(vergence: float, optics: list[Lens], size: int = 64) -> DepthMap:
    flat = np.full((size, size), vergence, np.float32)
    slope = 0.1 * np.linspace(-1, 1, size, dtype=np.float32)
    read = flat + slope
    everywhere = np.ones((size, size), bool)
    return DepthMap(read, 0.002 * np.ones_like(flat), everywhere, everywhere, common_errors=common_modes(read, optics))


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_principal_modes_keep_the_joint_distribution_in_any_unit(unit: float) -> None:
    levels, at = np.linspace(0.5, 2, 30), np.array([[0.7, 1.1], [1.6, 1.9]])
    modes = unit * np.stack([levels, levels**2, 1 / levels])
    spread = spread_over(at, levels, modes).reshape(-1, 4)
    expected = np.stack([np.interp(at.ravel(), levels, mode) for mode in modes])
    np.testing.assert_allclose(spread.T @ spread, expected.T @ expected, rtol=2e-3)


def test_exact_optics_share_no_error() -> None:
    depth = wall(0.5, pair())
    assert depth.common_errors.shape == (0, 64, 64)
    assert not depth.common_sd.any()
    with pytest.raises(InputError, match="stated to be exact"):
        with_known_points(depth, [(5, 5, 2.0)])


def test_one_point_tells_the_focus_and_two_the_scale_as_well() -> None:
    """Optics off by what their tolerances allow: the map is moved to the truth, and stays within its uncertainty."""
    rng = np.random.default_rng(3)
    scores = []
    for _ in range(120):
        focus, scale = FOCUS * (1 + 0.1 * rng.standard_normal()), 1 + 0.05 * rng.standard_normal()
        true = np.linspace(0.3, 0.9, 64) * np.ones((64, 1))
        read = (FOCUS - (focus - true) * scale).astype(np.float32)  # blur of the true camera, by the stated one
        everywhere = np.ones((64, 64), bool)
        stated = pair(focus_tolerance=0.1, aperture_tolerance=0.05)
        depth = DepthMap(
            read, 0.002 * np.ones_like(read), everywhere, everywhere, common_errors=common_modes(read, stated)
        )
        points = [(10, 32, 1 / true[32, 10]), (55, 20, 1 / true[20, 55])]
        maps = [depth, with_known_points(depth, points[:1]), with_known_points(depth, points)]
        scores.append([[np.abs(one.vergence - true)[0, x] for one in maps] for x in (10, 55, 32)])
        scores[-1] += [[one.common_sd[0, x] for one in maps] for x in (10, 55, 32)]
    off, sd = np.split(np.sqrt((np.array(scores) ** 2).mean(axis=0)), 2)
    assert (off[:, 1:] < 0.35 * off[:, :1]).all()  # focus known
    assert off[1, 2] < 0.3 * off[1, 1]  # scale known
    np.testing.assert_allclose(off[1:, :2], sd[1:, :2], rtol=0.25)  # at the point itself only the tape errs
    assert (off[:, 2] < 1.2 * sd[:, 2]).all()


def test_a_point_that_contradicts_the_optics_is_warned_of() -> None:
    depth = wall(0.5, pair(focus_tolerance=0.01, aperture_tolerance=0.01))
    with pytest.warns(FocalGradientWarning, match="known points contradict"):
        with_known_points(depth, [(30, 30, 1.0)])


@pytest.mark.parametrize(
    ("point", "words"),
    [
        ((64, 3, 1.0), "outside of the picture"),
        ((-0.6, 3, 1.0), "outside of the picture"),
        ((3, -0.6, 1.0), "outside of the picture"),
        ((5, 5, 2.0), r"the nearest that has is \(40, 5\), 35 pixels away.*point at a textured surface"),
        ((25, 5, 0.7), r"the nearest surface that has, at \(40, 5\), lies at 1.87 m, which is not where"),
    ],
)
def test_points_that_cannot_be_used_are_refused(point: tuple[float, ...], words: str) -> None:
    depth = wall(0.5, pair(focus_tolerance=0.1))
    depth.valid[:, :40] = False
    with pytest.raises(InputError, match=words):
        with_known_points(depth, [point])  # type: ignore[list-item]


def test_a_point_beside_valid_depth_is_read_from_the_nearest_surface() -> None:
    """With the scatter of depth over the distance to it: a slanted wall costs more than a flat one."""
    left = []
    for slope in (0.0, 2e-3):
        depth = wall(0.5, pair(focus_tolerance=0.1))
        depth.vergence[:] += (slope * np.arange(64)).astype(np.float32)
        depth.valid[:, :20] = False
        tied = with_known_points(depth, [(9, 30, 2.05)])
        (point,) = tied.details["known_points"]
        assert point["read_px_away"] == 11
        left.append((point["recovered_sd_D"], float(tied.common_sd[30, 30])))
    assert left[1][0] > 1.3 * left[0][0]
    assert float(depth.common_sd[30, 30]) > left[1][1] > left[0][1]


def test_recover_depth_states_and_corrects_a_wrong_focus() -> None:
    tolerances = {"focus_tolerance": 0.1, "aperture_tolerance": 0.05, "field_tolerance": 0.0}
    marked = [Lens(0.025, number, 1.1, **tolerances) for number in (16.0, 4.0)]
    views = [
        replace(view, optics=one)
        for view, one in zip(walls(Disc(), [Lens(0.025, n, 1.0) for n in (16, 4)], 1.25), marked, strict=True)
    ]
    depth = recover_depth(views, near=1.1)
    off = np.median((depth.vergence - 0.8)[depth.valid])
    assert off == pytest.approx(1 / 1.1 - 1, abs=0.01)
    assert np.median(depth.common_sd[depth.valid]) == pytest.approx(np.hypot(0.1 / 1.1, 0.05 * 0.2), rel=0.1)
    assert depth.details["common_sd_D"]["focus"] == pytest.approx(0.1 / 1.1, rel=0.01)
    tied = recover_depth(views, near=1.1, known_points=[(64, 64, 1.25)])
    assert np.median(tied.vergence[tied.valid]) == pytest.approx(0.8, abs=0.005)
    assert np.median(tied.common_sd[tied.valid]) < 0.01


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("course", ["curved", "tilted"])
def test_a_surface_in_focus_that_is_no_plane_is_covered_by_place(course: str) -> None:
    """Focus 0.06 D off at the corner: a flat wall looks curved or slanted, which no view tells from a wall that is."""
    size, wall_at, corner = 160, 0.7, 0.06
    y, x = (np.mgrid[:size, :size] - (size - 1) / 2) / ((size - 1) / np.sqrt(2))
    off = corner * (x**2 + y**2 if course == "curved" else (x + y) / np.sqrt(2))
    picture = natural((size, size), seed=5)
    distance = 1 / (wall_at - off)  # at which a plane in focus would blur as much
    images = [blur_picture(picture, distance, lens, pixel_angle=1.5e-4) for lens in pair()]
    images = [image + 0.003 * np.random.default_rng(n).standard_normal((size, size)) for n, image in enumerate(images)]
    shares = {}
    for tolerance in (0.0, FIELD_TOLERANCE):
        lenses = pair(field_tolerance=tolerance)
        views = [View(image, lens, 1.5e-4) for image, lens in zip(images, lenses, strict=True)]
        depth = recover_depth(views, near=1.0)
        shares[tolerance] = (np.abs(depth.vergence - wall_at) < 2 * depth.total_sd)[depth.valid].mean()
        assert depth.valid.mean() > 0.6  # blur from beyond the rim reaches into so small a frame
    assert shares[0.0] < 0.5  # what is stated of each pixel does not cover it
    assert shares[FIELD_TOLERANCE] > 0.93
    across = depth.difference((30, 30), (size - 30, 80)), depth.difference((30, 30), (34, 30))
    assert abs(across[0][0]) < 2 * across[0][1]
    assert across[1][1] < 0.2 * across[0][1]  # neighbours share the error
