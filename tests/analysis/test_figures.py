"""Figures of the paper and of eyes on few points: what is drawn is what lenses, rays and published numbers say."""

import math

import accommodation_experiments as experiments
import autofocus
import eye_gaussian
import eyes
import fig2_measured
import fig5
import fig6
import numpy as np
import pytest
import wavelength_in_focus as mixed
from fig1 import FOCUS, pair, peak, sweep
from fig2 import focal_gradient_error, stereo_error
from fig4 import LENS, Room, noisy_bits

from focalgradient import Lens, View, recover_depth
from focalgradient.depth.ratio.disparity import focal_disparity


@pytest.mark.slow
def test_reflection_is_sharpest_where_traced_rays_put_it():
    foci = np.arange(0.65, 1.2, 0.1)
    measured = sweep(foci, 1e-3, 32)
    across, upright = (peak(foci, measured[name]) for name in ("across", "upright"))
    assert abs(across - measured["traced_across"][0]) < 0.04
    assert measured["traced_upright"][1] < upright < measured["traced_upright"][2]
    # Both lie behind the surface, the upright image far behind.
    assert upright < across - 0.1 < FOCUS - 0.1


@pytest.mark.slow
def test_the_large_aperture_blurs_what_is_out_of_focus_alone():
    small, large = pair((90, 66), 32)
    near = np.abs(1 / small.distance - FOCUS) < 0.02
    far = small.distance > 2
    row = np.abs(np.diff(large.view.image, axis=1)) / np.abs(np.diff(small.view.image, axis=1)).mean()
    assert row[:, :-1][far[:, 2:]].mean() < 0.6 * np.abs(row[:, :-1][near[:, 2:]]).mean()
    # The truth is that of the scene: the same through both.
    assert np.array_equal(small.distance, large.distance)


@pytest.mark.parametrize(("distance", "error"), [(1.0, 0.01), (2.0, 0.0), (4.0, 0.08), (10.0, 0.8)])
def test_focal_gradient_at_points_of_the_paper(distance, error):
    assert focal_gradient_error(distance) == pytest.approx(error, abs=1e-15)


def test_stereo_is_a_millimetre_at_a_metre_and_grows_with_the_square():
    assert stereo_error(1.0) == pytest.approx(1e-3)
    assert stereo_error(10.0) == pytest.approx(0.1)


DISTANCES = (1.2, 3.5, 8.0)


@pytest.mark.slow
def test_errors_follow_the_curve_and_collapse_without_blur():
    on = fig2_measured.measure(DISTANCES, shape=(176, 176))
    off = fig2_measured.measure(DISTANCES, shape=(176, 176), blur=False)
    # One relative error of blur serves all distances, though the errors of distance differ sixty-fold.
    assert on["relative_error"].max() < 0.015  # in the figure .006 to .009
    assert on["relative_error"].max() < 2 * on["relative_error"].min()
    curve = focal_gradient_error(DISTANCES, float(on["relative_error"].mean()))
    assert np.all(np.abs(np.log(on["rms_m"] / curve)) < np.log(2))
    assert on["valid"].min() > 0.9
    assert 0.5 < np.median(on["rms_m"] / on["predicted_m"]) < 2
    assert not on["warned"].any()
    # Views that were blurred alike are estimated in focus, wherever the wall is.
    assert np.nanmin(off["relative_error"]) > 0.8
    assert off["rms_m"][-1] > 0.5 * (DISTANCES[-1] - fig2_measured.FOCUS)


@pytest.fixture(scope="module")
def blurred_room():
    return Room.of((480, 480), 32)


@pytest.mark.slow
def test_segments_are_sorted_by_their_blur_and_by_nothing_else(blurred_room):
    scores = blurred_room.blurred.scores()
    assert scores["segments"] > 20
    assert scores["segments_in_the_right_class_percent"] > 75
    assert scores["pairs_in_the_right_order_percent"] > 80
    sharp = blurred_room.sharp.scores()
    assert sharp["segments_in_the_right_class_percent"] < 75
    assert sharp["pairs_in_the_right_order_percent"] < 60


def test_three_of_eight_bits_are_noise():
    view = View(np.linspace(0.05, 0.8, 6000).reshape(60, 100), LENS, 8e-4)
    grey = 255 * noisy_bits(view, 0.8, 1).image.astype(float)
    assert np.abs(grey - np.rint(grey)).max() < 1e-4
    noise = grey - 250 * view.image / 0.8
    assert np.abs(noise).max() < 4.6
    assert abs(noise.std() - 8 / np.sqrt(12)) < 0.2


@pytest.mark.slow
def test_content_of_a_checkerboard_is_known():
    board = 2 + 0.3 * (np.indices((64, 64)).sum(axis=0) % 2)
    content = fig5.content(View(board.astype(np.float32), Lens(0.025, 8, 1.0), 3e-4))
    # Every pixel differs from each of its four neighbours by 0.3, about a mean of 2.15.
    assert content == pytest.approx(4 * 0.3 / 2.15, rel=1e-3)


@pytest.mark.slow
def test_disparity_comes_out_of_the_blur_and_reflections_lie_behind_their_mirror():
    views, again, truth = fig5.views_and_truth(shape=(200, 150), samples=64)
    small, large, twice = (view.image for view in (*views, again))
    seen = np.trace(truth.vergence, axis1=-2, axis2=-1) / 2
    noise = 0.03 * float(small.mean())  # of the rays, mostly
    disparity, valid = focal_disparity(small, large, noise=noise, window=8)
    control, control_valid = focal_disparity(small, twice, noise=noise, window=8)
    grid, shown = (image[2::4, 2::4][: valid.shape[0], : valid.shape[1]] for image in (1 / truth.distance, seen))
    near, far = valid & (shown > 0.97), valid & (shown < 0.8)
    assert np.median(disparity[near]) > 1.5 * np.median(disparity[far])
    assert np.median(control[control_valid]) == pytest.approx(1, abs=0.05)
    # At the foot of the bottle the checks are seen in it, behind its surface.
    depth = recover_depth(views, method="ratio", near=fig5.FOCUS, far=fig5.FAR)
    mirrored = depth.valid & (1 / truth.distance - seen > fig5.MIRRORED)
    assert np.median((1 / truth.distance - depth.vergence)[mirrored]) > 0
    assert np.mean(grid[valid] >= shown[valid] - 1e-3) > 0.9


@pytest.fixture(scope="module")
def shown():
    return fig6.make()


def test_fig6_shows_rays_as_the_thin_lens_bends_them(shown):
    assert shown.summary["sigma_mm"] == pytest.approx(shown.summary["sigma_by_similar_triangles_mm"])
    assert shown.summary["sigma_mm"] == pytest.approx(3.125)  # 12.5 mm x (75 - 60) / 60
    assert shown.summary["u_from_sigma_by_Eq_1_mm"] == pytest.approx(300)
    mm = shown.summary
    for there, here in (("u0", "v0"), ("u", "v")):
        assert 1 / mm[f"{there}_mm"] + 1 / mm[f"{here}_mm"] == pytest.approx(1 / mm["F_mm"])
    assert mm["v_mm"] < mm["v0_mm"]  # a point beyond focus is imaged in front of the image plane
    ends = [line.get_xydata()[-1] for line in shown.figure.axes[0].lines if len(line.get_xdata()) == 4]
    assert len(ends) == 2
    for x, y in ends:
        assert x == pytest.approx(shown.summary["v0_mm"])
        assert abs(y) == pytest.approx(shown.summary["sigma_mm"])
    assert ends[0][1] == -ends[1][1]
    rays = shown.plotted["ray_from_beyond_mm"]
    slopes = np.diff([y for _, y in rays]) / np.diff([x for x, _ in rays])
    assert slopes[1] == pytest.approx(slopes[2])  # straight behind the lens


def test_agreement_follows_the_numbers():
    """A model that did just what was published would agree everywhere; one that responds to nothing would not."""
    published = {
        "gain": {"white": 0.8, "monochromatic": 0.4, "neutralised": 0.45, "reversed": 0.1},
        "focus": {"white": 2.0, "reversed": 0.2},
        "error": {"white": 0.3, "reversed": 2.0},
        "phase": {"white": -30.0, "monochromatic": -50.0},
        "pupil": {"0.5 mm": 0.2, "1 mm": 0.5, "3 mm": 0.9},
        "low-pass": {"1 c/deg": 0.0, "5.6 c/deg": 0.8, "sharp": 0.9},
        "empty": {"from 0.5 D": 1.4, "from 4 D": 1.6},
        "flicker": {"none": 1.0, "focus": 0.6, "contrast": 0.95},
        "rendered": {"real": 0.9, "defocus": 0.0, "chromatic": 0.8},
    }
    assert all(row.agrees(published[row.kind]) for row in experiments.ROWS)
    nothing = {kind: dict.fromkeys(values, 0.0) for kind, values in published.items()}
    assert sum(row.agrees(nothing[row.kind]) for row in experiments.ROWS) <= 1
    agreed = {cue: [True] * len(experiments.ROWS) for cue in experiments.CUES}
    assert experiments._draw(dict.fromkeys(experiments.CUES, published), agreed).axes


def test_images_needed_for_an_accuracy():
    assert autofocus.images_needed([3, 10, 30], [4.0, 1.0, 0.25], 2.0) == pytest.approx(math.sqrt(30))
    assert autofocus.images_needed([3, 10, 30], [4.0, 1.0, 0.25], 0.1) == math.inf
    assert autofocus.images_needed([3, 10, 30], [4.0, 1.0, 0.25], 5.0) == 3
    assert autofocus.images_needed([3, 10, 30], [1.0, 4.0, 2.0], 2.0) == pytest.approx(30)  # for good, not by chance


@pytest.mark.slow
def test_few_settings_err_more_than_two_views_and_many_less():
    measured = autofocus.measure(autofocus.PLACES[0], counts=(3, 10), samples=64)
    few, many = measured["autofocus"]["median_error_percent"]
    two = measured["two foci"]["median_error_percent"][0]
    assert many < two < few
    shared = measured["same light"]["median_error_percent"][1]
    assert many < shared < 4 * many  # noise is 2.1 times as much
    for values in measured.values():
        assert min(values["valid_percent"]) > 80
        assert min(values["within_2_sd_percent"]) > 88


@pytest.mark.slow
def test_far_from_focus_the_disc_comes_back_and_near_it_a_core_on_a_skirt():
    defocus = np.array([0.0, 0.75, 2.0, 6.0])
    white = eye_gaussian.measure(defocus, step_nm=20)
    one = eye_gaussian.measure(defocus, white=False)
    assert np.isnan(white["k"][:, 0]).all()
    assert white["k"][1:, 3] == pytest.approx(eye_gaussian.DISC, abs=0.01)
    assert (white["residual"][2:, 0] > 0.5).all()
    assert (white["residual"][1:, 1] < 0.1).all()
    assert (white["residual"][:, 2:] < one["residual"][:, 2:]).all()
    assert (one["lowest"][:, 2:] < white["lowest"][:, 2:]).all()
    assert (white["lowest"][:, 2:] < -0.05).all()


def test_the_drawn_transfers_reverse_where_no_gaussian_does():
    transfers = eye_gaussian._transfers()
    assert min(curve.min() for curve in transfers["gaussian"]) >= 0
    assert [bool(curve.min() < -0.05) for curve in transfers["white"]] == [False, False, True]


BY_NAME = {subject.name: subject for subject in eyes.SUBJECTS}


def strehl(name: str, vergence: float) -> float:
    return float(eyes.quality(BY_NAME[name], np.array([vergence]))[0][0])


@pytest.mark.slow
def test_a_myope_sees_near_and_a_presbyope_far_and_a_bifocal_lens_gives_both() -> None:
    myope, old, bifocal = "myope, −2 D, uncorrected", "presbyope, 60 years", "60 years, bifocal +2.5 D"
    assert strehl(myope, 0.0) < 0.05 < 0.5 < strehl(myope, 2.5)
    assert strehl(old, 2.5) < 0.05 < 0.5 < strehl(old, 0.0)
    assert strehl(old, 0.0) > strehl(bifocal, 0.0) > 0.3
    assert strehl(bifocal, 2.5) > 0.1
    assert strehl(bifocal, 1.5) < 0.1


def test_the_wavelength_in_focus_by_each_rule():
    red, blue = (mixed.Mixture(share) for share in (0.0, 1.0))
    for rule in (mixed.by_luminance, mixed.by_colour):
        assert mixed.wavelength(rule(red)) > 595  # the display's red is about 610 nm
        assert mixed.wavelength(rule(blue)) < 490
    # L and M cones see the mixture's red still where the opponent channel, with S cones, sees its blue.
    both = mixed.Mixture(0.3)
    assert mixed.by_luminance(both) - mixed.by_colour(both) > 0.8
    focus = np.array([-1.0, -0.5, 0.0, 0.5])
    assert mixed._root(focus, np.array([0.5, 0.25, -0.25, -0.5])) == pytest.approx(-0.25)
    assert np.isnan(mixed._root(focus, np.array([-0.5, -0.25, 0.25, 0.5])))
    assert mixed._draw({name: [580.0] * len(mixed.SHARES) for name in mixed.RULES}).axes


@pytest.mark.slow
def test_depth_taken_for_white_leaves_about_580_nm_in_focus_in_any_mixture():
    for share in (0.15, 0.7):
        assert abs(mixed.by_depth(mixed.Mixture(share), seeds=2)) < 0.15
