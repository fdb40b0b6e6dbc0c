"""Drawn stimuli: arrays, depth, equalisation, sources and rejected arguments (for blur see test_drawn_blur.py)."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from itertools import islice
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from focalgradient import InputError, Lens
from focalgradient.eye import Eye
from focalgradient.stimuli import (
    Stimulus,
    blurred_edge,
    corrugated_plane,
    dead_leaves,
    depth_of_blur,
    fixated_cube,
    miniature,
    slanted_plane,
    texture_border,
    wide_field,
)
from focalgradient.stimuli.leaves import _leaves

Draw = Callable[..., Stimulus]
ARCMIN = np.radians(1 / 60)
SMALL: dict[Draw, dict[str, Any]] = {
    texture_border: {"width_deg": 4, "height_deg": 3},
    dead_leaves: {"width_deg": 4, "height_deg": 3},
    wide_field: {"window_deg": 16, "eccentricity_deg": 4, "pixels_per_degree": 10},
    blurred_edge: {"width_deg": 2, "height_deg": 1.5},
    slanted_plane: {"width_deg": 4, "height_deg": 3},
    corrugated_plane: {"width_deg": 4, "height_deg": 3},
    miniature: {"width_deg": 6, "height_deg": 4},
    fixated_cube: {"edge_deg": 4, "width_deg": 8, "height_deg": 8},
}
every = pytest.mark.parametrize("draw", SMALL, ids=lambda draw: draw.__name__)


@cache
def drawn(draw: Draw) -> Stimulus:
    return draw(**SMALL[draw])


@every
def test_arrays_agree_and_light_is_in_range(draw: Draw) -> None:
    one = drawn(draw)
    for array in (one.picture, one.sharp, one.depth_m, one.blur_arcmin):
        assert array.shape == one.shape
        assert array.dtype == float
    for mask in one.masks.values():
        assert mask.shape == one.shape
        assert mask.dtype == bool
    assert one.shape[0] % 2 == one.shape[1] % 2 == 0
    assert 0 <= one.picture.min() < one.picture.max() <= 1
    assert one.name == draw.__name__
    assert one.controlled["range"] == [one.picture.min(), one.picture.max()]
    assert one.controlled["mean_luminance"]["picture"] == pytest.approx(one.picture.mean())
    np.testing.assert_array_equal(draw(**SMALL[draw]).picture, one.picture)


@every
def test_depth_and_blur_obey_the_lens_law(draw: Draw) -> None:
    """Blur of the depth that is stated, by a lens: its disc's radius is twice the standard deviation."""
    one = drawn(draw)
    given = {**dict.fromkeys(("focus_m",)), **one.parameters}
    focus = one.controlled.get("focus_m") or given["focus_m"] or given.get("distance_m") or given["true_distance_m"]
    aperture = one.controlled.get("aperture_m", given["pupil_mm"] / 1000)
    scale = np.radians(given["edge_deg"]) / given["perspective"] if draw is fixated_cube else 1.0
    known = np.isfinite(one.depth_m)
    radius = scale * aperture / 2 * np.abs(1 / focus - 1 / one.depth_m[known]) / ARCMIN
    np.testing.assert_allclose(radius, 2 * one.blur_arcmin[known], atol=1e-6)
    assert known.any()


def test_the_same_seed_gives_the_same_leaves_whatever_their_blur() -> None:
    several = [dead_leaves(blurs_arcmin=blurs, width_deg=4, height_deg=4) for blurs in ((0.0, 1.0), (0.0, 4.0), (2.0,))]
    for one in several[1:]:
        assert np.mean(np.abs(one.sharp - several[0].sharp) < 2e-3) > 0.9  # all but the pixels of edges
    shares = [mask.mean() for mask in several[1].masks.values()]
    assert min(shares) > 0.25


@pytest.mark.parametrize("optics", [Lens(0.05, 8.0, 0.5), Eye(0.005, 1.8)], ids=["lens", "eye"])
def test_surfaces_are_seen_through_a_lens_or_an_eye(optics: Any) -> None:
    one = corrugated_plane(optics=optics, width_deg=6, height_deg=4)
    radius = optics.aperture_diameter / 2 * np.abs(optics.focus_vergence - 1 / one.depth_m)
    np.testing.assert_allclose(one.blur_arcmin, radius / 2 / ARCMIN, rtol=1e-9, atol=1e-12)
    assert one.picture.std() < one.sharp.std()


def test_a_corrugated_plane_has_the_relief_that_was_set() -> None:
    one = corrugated_plane(
        amplitude_m=0.1, cycles_per_degree=0.5, distance_m=0.6, orientation_deg=90, width_deg=8, height_deg=3
    )
    x = (np.arange(256) - 127.5) / 32
    np.testing.assert_allclose(one.depth_m, np.broadcast_to(0.6 + 0.1 * np.sin(np.pi * x), one.shape), atol=1e-9)
    sharp, blurred = (np.gradient(light, axis=0).std(axis=0) for light in (one.sharp, one.picture))
    assert np.corrcoef(blurred / sharp, one.blur_px[0])[0, 1] < -0.8  # most detail is lost where blur is most


def test_a_miniature_depends_on_the_simulated_distance_alone() -> None:
    given = {"width_deg": 8, "height_deg": 6, "seed": 2}
    one, other = (miniature(true_distance_m=metres, simulated_distance_m=0.15, **given) for metres in (20.0, 783.0))
    np.testing.assert_allclose(one.picture, other.picture, atol=1e-5)
    np.testing.assert_allclose(one.blur_arcmin, other.blur_arcmin, rtol=1e-6, atol=1e-9)
    near = miniature(simulated_distance_m=0.075, **given)
    np.testing.assert_allclose(near.blur_arcmin, 2 * one.blur_arcmin, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(("gradient", "axis"), [("vertical", 0), ("horizontal", 1)])
def test_the_control_of_the_miniature_has_a_planar_gradient_with_as_much_blur(gradient: Any, axis: int) -> None:
    given = {"width_deg": 8, "height_deg": 6}
    control, one = miniature(gradient=gradient, **given), miniature(**given)
    signed = np.abs(np.diff(control.blur_arcmin, n=2, axis=axis))
    assert np.quantile(signed, 0.95) < 1e-6  # linear but where it crosses the focus
    assert np.ptp(control.blur_arcmin, axis=1 - axis).max() < 1e-9
    assert control.blur_arcmin.max() == pytest.approx(one.blur_arcmin.max(), rel=1e-6)
    assert not control.controlled["blur_agrees_with_depth"]
    np.testing.assert_array_equal(control.depth_m, one.depth_m)


@pytest.mark.parametrize("gradient", ["vertical", "horizontal"])
@pytest.mark.parametrize("nearer_first", [True, False])
def test_the_gradient_of_the_control_slopes_as_the_scene(gradient: Any, nearer_first: bool) -> None:
    line = np.linspace(0.02, 0.005, 48)[:: 1 if nearer_first else -1]
    vergence = np.broadcast_to(line[:, None] if gradient == "vertical" else line, (48, 48))
    one = miniature(
        gradient=gradient,
        picture=np.full((48, 48), 0.5),
        depth_m=1 / vergence,
        width_deg=10,
        true_distance_m=100,
        simulated_distance_m=1.0,
        pupil_mm=4.0,
    )
    # A model a hundred times smaller, seen by an eye that is focused at 1 m.
    wanted = 4e-3 / 4 * np.abs(1 - 100 * vergence)
    np.testing.assert_allclose(one.blur_arcmin * ARCMIN, wanted, rtol=1e-9)


@pytest.mark.parametrize("exponent", [1.0, 3.0])
def test_leaves_have_the_sizes_and_the_shapes_that_were_set(exponent: float) -> None:
    drawn = [*islice(_leaves((64, 64), (2.0, 20.0), exponent, 3.0, 1.0, (0.5, 0.5), 4), 4000)]
    radius = np.array([math.sqrt(leaf.long * leaf.short) for leaf in drawn])

    def share(size: Any) -> Any:  # of leaves up to a size, by 1 / r^exponent
        if exponent == 1:
            return np.log(size / 2) / np.log(10)
        return (size ** (1 - exponent) - 2 ** (1 - exponent)) / (20 ** (1 - exponent) - 2 ** (1 - exponent))

    assert stats.kstest(radius, share).pvalue > 0.001
    assert stats.kstest([leaf.long / leaf.short for leaf in drawn], stats.uniform(1, 2).cdf).pvalue > 0.001
    light = np.array([leaf.light for leaf in drawn])
    assert (light.mean(), light.std()) == (pytest.approx(0.5, abs=0.01), pytest.approx(0.25, abs=0.01))


@pytest.mark.parametrize("fixation", ["nearest", "farthest", "centre"])
@pytest.mark.parametrize("gradient", ["rigid", "nonrigid"])
def test_the_cube_is_sharp_where_it_is_fixated_and_gives_off_the_same_light(fixation: Any, gradient: Any) -> None:
    one = fixated_cube(fixation=fixation, gradient=gradient)
    assert one.controlled["light_percent"] == pytest.approx(0, abs=0.05)
    lines = one.masks["lines"]
    np.testing.assert_array_equal(np.isfinite(one.depth_m), lines)
    sharpest = one.depth_m[lines][one.blur_arcmin[lines].argmin()]
    assert sharpest == pytest.approx(one.controlled["focus_m"], rel=0.02)
    if fixation != "centre":
        x, y = one.controlled["fixation_px"]
        assert one.masks["fixation"][int(y), int(x)]
        assert one.blur_arcmin[int(y), int(x)] < 0.1 * one.blur_arcmin.max()
        assert one.controlled["focus_m"] == pytest.approx(
            one.depth_m[lines].min() if fixation == "nearest" else one.depth_m[lines].max(), rel=0.02
        )
    assert one.controlled["sharpest"] <= 1.05


@pytest.mark.parametrize("draw", [dead_leaves, slanted_plane, corrugated_plane])
def test_luminance_and_contrast_are_equalised_over_blur(draw: Draw) -> None:
    blur = {"blurs_arcmin": (1.0, 3.0)} if draw is dead_leaves else {"pupil_mm": 20}
    given = {**blur, "contrast": 0.15, "width_deg": 6, "height_deg": 4}
    one, plain = draw(**given, equalise=("luminance", "contrast")), draw(**given)
    assert one.picture.mean() == pytest.approx(one.sharp.mean(), rel=1e-6)
    assert one.picture.std() == pytest.approx(one.sharp.std(), rel=1e-6)
    assert one.controlled["equalised"] == ["luminance", "contrast"]
    assert plain.picture.std() < 0.985 * plain.sharp.std()
    same = draw(**given, equalise=("spectrum",))
    spectra = [np.abs(np.fft.fft2(light)) for light in (same.picture, same.sharp)]
    np.testing.assert_allclose(*spectra, rtol=1e-6, atol=1e-6 * spectra[1].max())


def test_both_sides_of_a_border_are_equalised() -> None:
    blurs = {"left_blur_arcmin": 0.0, "right_blur_arcmin": 4.0, "border_blur_arcmin": 0.0}
    one = texture_border(**blurs, equalise=("luminance", "contrast"))
    for measure in ("mean_luminance", "rms_contrast"):
        left, right = (one.controlled[measure][side] for side in ("left", "right"))
        assert left == pytest.approx(right, rel=0.01)
    same = texture_border(**blurs, equalise=("spectrum",), width_deg=8)
    power = [np.abs(np.fft.rfft(same.picture[:, part], axis=0)).mean(axis=1) for part in (np.s_[:64], np.s_[-64:])]
    assert power[0][20:60].mean() == pytest.approx(power[1][20:60].mean(), rel=0.15)


def test_a_border_belongs_to_the_side_whose_blur_it_has() -> None:
    blurs = {"left_blur_arcmin": 0.0, "right_blur_arcmin": 4.0}
    for edge, near in ((0.0, "left"), (4.0, "right"), (None, "left")):
        one = texture_border(**blurs, border_blur_arcmin=edge)
        assert one.controlled["near"] == near
        assert one.controlled["occlusion_agrees_with_blur"]
        other = "right" if near == "left" else "left"
        assert one.depth_m[one.masks[near]].max() < one.depth_m[one.masks[other]].min()
    assert not texture_border(**blurs, border_blur_arcmin=0.0, near="right").controlled["occlusion_agrees_with_blur"]
    # With equal spectra both sides have the larger blur: only a border of that blur agrees.
    for edge, agrees in ((0.0, False), (4.0, True)):
        one = texture_border(**blurs, border_blur_arcmin=edge, equalise=("spectrum",))
        assert one.controlled["occlusion_agrees_with_blur"] is agrees


@pytest.mark.parametrize("settings", [{}, {"perspective": 0.8, "tilt_deg": 40.0, "edge_deg": 4.0, "pupil_mm": 4.0}])
def test_the_centre_of_the_cube_is_marked_where_it_is_seen(settings: dict[str, float]) -> None:
    one = fixated_cube(fixation="centre", **settings)
    assert one.controlled["fixation_px"] == [side / 2 for side in one.shape[::-1]]
    y, x = np.nonzero(one.masks["fixation"])
    assert (y.mean(), x.mean()) == tuple((side - 1) / 2 for side in one.shape)


@pytest.mark.slow
def test_pixels_at_an_annulus_are_counted_on_a_flat_screen() -> None:
    one = wide_field(eccentricity_deg=30, annulus_deg=4, window_deg=80, pixels_per_degree=8)
    # Directions to the middle of a pixel at 30 degrees and to its neighbours, outwards and around.
    away, pixel = math.tan(math.radians(30)), one.pixel_angle
    here, outwards, around = (
        np.array(way) / np.linalg.norm(way) for way in ((away, 0, 1), (away + pixel, 0, 1), (away, pixel, 1))
    )
    degrees = [math.degrees(math.acos(here @ other)) for other in (outwards, around)]
    assert one.controlled["pixels_per_degree_at_annulus"] == pytest.approx(1 / math.sqrt(math.prod(degrees)), rel=0.01)


@pytest.mark.parametrize(
    ("draw", "wrong", "said"),
    [
        (texture_border, {"right_blur_arcmin": 9}, "9 arcmin exceeds that of infinity for a pupil of 4 mm"),
        (dead_leaves, {"blurs_arcmin": (1, 1)}, "must be different blurs"),
        (dead_leaves, {"smallest_deg": 0.01}, "leaves of 0.01 to 2 degrees have radii of 0.32"),
        (wide_field, {"eccentricity_deg": 22}, "eccentricity_deg is 22, with which the annulus leaves the window"),
        (slanted_plane, {"pupil_mm": 900, "focus_m": 0.1}, "radius of .* pixels, but the picture"),
    ],
)
def test_what_cannot_be_drawn_is_refused(draw: Draw, wrong: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said) as raised:
        draw(**wrong)
    assert "\n" not in str(raised.value)


def test_depth_of_blur_is_the_inverse_of_the_lens_law() -> None:
    blur = np.array([0.0, 1.0, 3.0])
    for side in ("beyond", "nearer"):
        metres: NDArray[np.float64] = depth_of_blur(blur, side, focus_m=0.5, pupil_mm=5)
        found = Lens(0.01, 2.0, 0.5).blur_radius(metres) / 2 / ARCMIN
        np.testing.assert_allclose(found, blur, atol=1e-9)
        assert (metres[1:] > 0.5).all() == (side == "beyond")
