"""Calibration in the default method's terms: focus over the field, total standard deviations, another distance."""

import json
import warnings
from dataclasses import replace

import numpy as np
import pytest
from command_line import run, sentence, succeed
from photographed import MARKS, RealCamera, targets
from scipy.special import ndtr

from focalgradient import DepthMap, FocalGradientWarning, Lens, View, recover_depth
from focalgradient.calibration import Calibration, Field, Priors, Reading, apply_calibration, calibrate, fit_field
from focalgradient.photographs import limits_beside_focus, load_camera, load_settings

SHAPE = (180, 240)
PIXEL = 3e-4


def noisy_map(
    centre: float, focus: float, *, noise: float = 0.002, tau: float = 0.02, excess: float = 1.0, seed: int = 0
):
    """A map of a flat sheet at `centre` that reads tilted and curved, and scatters by what it says times `excess`."""
    random = np.random.default_rng(seed)
    x, y = Field.coordinates(SHAPE)
    shape = 0.05 * x - 0.02 * y + 0.06 * (x**2 + y**2)
    optics = [Lens(0.035, n, 1 / focus, field_tolerance=0) for n in (11, 4)]
    views = [View(random.uniform(0.4, 0.6, SHAPE), one, PIXEL) for one in optics]
    slope = optics[1].aperture_diameter / 2 / PIXEL
    model = tau * np.maximum(0.5, slope * np.abs(centre - focus)) / slope
    scatter = np.hypot(noise, excess * model) * random.standard_normal(SHAPE)
    sd = np.full(SHAPE, np.hypot(noise, model))
    valid = random.uniform(size=SHAPE) < 0.7
    details = {"method": "equalise", "psf": "disc", "split_band": {"tau": tau}}
    return DepthMap(centre + shape + scatter, sd, valid, valid, details), views


def test_the_field_is_found_and_taken_off():
    depth, views = noisy_map(1.7, 1.0)
    found = fit_field([depth], [views])
    assert not any(found.field.focus)  # a slant is the sheet's, and curvature of one sheet that of its blur
    np.testing.assert_allclose(found.field.blur, [0, 0, 0.06 / 0.7, 0, 0.06 / 0.7], atol=0.01)
    np.testing.assert_allclose(found.field.tilt, [0.3 * 0.05, 0.3 * 0.02], atol=0.002)
    assert found.centres[0] == pytest.approx(1.7, abs=0.002)
    assert found.left < 0.2 * found.left_without
    x, y = Field.coordinates(SHAPE)
    even = found.field.corrected(depth.vergence, 1.0) - (0.05 * x - 0.02 * y)
    assert np.ptp(even.reshape(6, 30, 8, 30).mean(axis=(1, 3))) < 0.012
    assert found.coverage == pytest.approx(0.95, abs=0.02)


def test_scatter_beyond_what_the_split_band_test_says_is_learnt():
    for excess in (0.5, 1.6):
        found = fit_field(*([part] for part in noisy_map(1.7, 1.0, excess=excess)))
        assert found.field.split_band_scale == pytest.approx(excess, rel=0.1)
        assert found.coverage == pytest.approx(0.95, abs=0.02)


def test_two_distances_tell_blur_over_the_field():
    maps, views = zip(*(noisy_map(centre, 1.0, seed=n) for n, centre in enumerate((1.4, 2.2))), strict=True)
    x, y = Field.coordinates(SHAPE)
    wider = [
        DepthMap(1.0 + (m.vergence - 1.0) * (1 + 0.1 * x**2), m.vergence_sd, m.valid, m.valid, m.details) for m in maps
    ]
    found = fit_field(wider, views)
    assert found.field.blur[2] == pytest.approx(0.1, abs=0.03)
    np.testing.assert_allclose(found.field.focus, [0, 0, -0.06, 0, -0.06], atol=0.02)
    for depth, centre in zip(wider, (1.4, 2.2), strict=True):
        even = found.field.corrected(depth.vergence, 1.0) - (0.05 * x - 0.02 * y)
        np.testing.assert_allclose(even.reshape(6, 30, 8, 30).mean(axis=(1, 3)), centre, atol=0.012)


@pytest.mark.parametrize("where", ["one corner", "scattered spots"])
def test_too_little_says_nothing(where):
    depth, views = noisy_map(1.7, 1.0)
    few = np.zeros(SHAPE, bool)
    if where == "one corner":
        few[:40, :40] = True
    else:  # as beside the edges of printed squares: cells all over the frame, an eighth of the pixels
        few[::4, ::2] = True
    found = fit_field([DepthMap(depth.vergence, depth.vergence_sd, few, few, depth.details)], [views])
    assert found.field == Field()
    assert np.isnan(found.centres[0])


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("field")
    target = targets(folder, RealCamera(psf="blend", k=0.3), (0.6,))
    return folder, succeed("calibrate", target, "--method", "equalise", "--out", folder / "c.toml")


def read(folder, distance, *args, seed=9):
    camera = RealCamera(psf="blend", k=0.3)
    files = [camera.take(folder / f"held_{mark}.png", distance, mark, seed=seed) for mark in MARKS]
    f_numbers = [part for mark in MARKS for part in ("--f-number", mark)]
    said = succeed("depth", *files, *f_numbers, "--calibration", folder / "c.toml", *args, "--out", folder / "out")
    return DepthMap.load(folder / "out" / "depth.npz"), json.loads((folder / "out" / "summary.json").read_text()), said


@pytest.mark.slow
def test_one_distance_predicts_another_to_a_fiftieth_of_a_dioptre(calibrated):
    depth, summary, _ = read(calibrated[0], 0.75, "--far", 1.0)  # the limit is the focus as marked
    assert depth.valid.mean() > 0.9
    error = (1 / depth.distance - 1 / 0.75)[depth.valid]
    assert abs(np.median(error)) < 0.02
    assert np.percentile(np.abs(error - np.median(error)), 90) < 0.01  # even over the field
    assert (np.abs(error) < 2 * depth.total_sd[depth.valid]).mean() > 0.92
    # The calibration's own error is what the whole frame shares, and is stated.
    common = float(np.median(depth.common_sd[depth.valid]))
    assert summary["details"]["common_sd_D"]["calibration"] == pytest.approx(common, rel=1e-3)
    assert summary["medians"]["common_sd_dioptres"] == pytest.approx(common, rel=1e-3)
    assert common > 0
    assert summary["settings"]["psf"] == "blend"


@pytest.mark.filterwarnings("ignore")
def test_other_methods_use_the_calibrated_shape_or_refuse_it_by_name(calibrated):
    folder, _ = calibrated
    _, summary, said = read(folder, 0.75, "--far", 1.0, "--method", "ratio")
    assert said.exit_code == 0, said.output
    assert (summary["settings"]["psf"], list(summary["settings"]["psf_parameters"])) == ("blend", ["k"])
    text = (folder / "c.toml").read_text()
    (folder / "c.toml").write_text(text.replace('psf = "blend"', 'psf = {shape = "polygon", blades = 5}'))
    files = [str(folder / f"held_{mark}.png") for mark in MARKS]
    f_numbers = [part for mark in MARKS for part in ("--f-number", str(mark))]
    given = ["--calibration", folder / "c.toml", "--far", "1.0", "--method", "ratio", "--out", folder / "no"]
    refused = run("depth", *files, *f_numbers, *given)
    (folder / "c.toml").write_text(text)
    assert "'ratio' needs isotropic blur, which polygon does not give: use" in sentence(refused)


def test_limits_beside_the_focus_mean_one_side(calibrated, tmp_path):
    views = '[camera]\n[[view]]\nimage = "a.png"\nf_number = 4\n[[view]]\nimage = "b.png"\nf_number = 11\n'
    (tmp_path / "v.toml").write_text(views)
    settings = load_settings(tmp_path / "v.toml", load_camera(calibrated[0] / "c.toml"))
    focus = settings.lenses()[0].focus_distance
    assert limits_beside_focus(None, 1.02 * focus, settings) == (None, focus)
    assert limits_beside_focus(0.98 * focus, None, settings) == (focus, None)
    assert limits_beside_focus(0.3, 1.02 * focus, settings) == (0.3, focus)
    assert limits_beside_focus(0.5, 5.0, settings) == (0.5, 5.0)  # both sides are meant


def test_the_calibrations_error_is_part_of_the_sd():
    camera = Calibration(
        0.035, 2e-5, 0.5, 0.0, 0.0, {4.0: 4.0, 11.0: 11.0}, {1.0: 1.0}, 0.01,
        np.diag([0, 0, 0, 1e-4, 1e-4, 4e-4]), np.zeros(6), psf="disc", field=Field(split_band_scale=0.5),
    )  # fmt: skip
    depth, views = noisy_map(1.7, 1.0)
    total = apply_calibration(depth, views, camera, [(11.0, 1.0), (4.0, 1.0)])
    own = float(camera.systematic_sd([(11.0, 1.0), (4.0, 1.0)], 1.7, "disc", of="distance")) * 1.7**2
    model = 0.5 * 0.02 * 0.7
    at = np.abs(depth.vergence - 1.7) < 1e-3
    assert float(np.median(total.vergence_sd[at])) == pytest.approx(np.sqrt(0.002**2 + model**2), rel=0.01)
    assert float(np.median(total.common_sd[at])) == pytest.approx(own, rel=0.01)
    assert float(np.median(total.total_sd[at])) == pytest.approx(np.sqrt(0.002**2 + model**2 + own**2), rel=0.01)


def test_what_edges_depart_from_the_law_by_elsewhere_is_part_of_their_sd():
    camera = Calibration(0.035, 2e-5, 0.5, 0.0, 0.0, {4.0: 4.0}, {1.0: 1.0}, 0.01, np.zeros((5, 5)), np.zeros(5))
    depth, views = noisy_map(0.4, 1.0, tau=0.0)
    edges = DepthMap(
        depth.vergence, depth.vergence_sd, depth.valid, depth.valid, {"method": "edges", "psf": "gaussian"}
    )
    found = apply_calibration(edges, views[1:], camera, [(4.0, 1.0)])
    expected = np.hypot(0.045 * np.abs(1.0 - depth.vergence), depth.vergence_sd)
    np.testing.assert_allclose(found.vergence_sd, expected, rtol=1e-4)
    assert not found.common_sd.any()


@pytest.mark.parametrize("tolerance", [0.0, 0.1])
def test_an_edge_as_sharp_as_a_camera_draws_it_is_not_given_a_depth(tolerance):
    """Sigma of 0.7 pixel: of exact optics that is a defocus, of a camera it may be its own blur."""
    image = 0.2 + 0.5 * ndtr((np.arange(96) - 47.3) / np.hypot(0.7, np.sqrt(1 / 12))) * np.ones((96, 1))
    noisy = image + 0.002 * np.random.default_rng(0).standard_normal((96, 96))
    view = View(noisy, Lens(0.035, 4.0, 1.0, focus_tolerance=tolerance), PIXEL)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FocalGradientWarning)
        depth = recover_depth([view], method="edges", psf="gaussian", near=1.0)
    assert depth.valid.any() == (tolerance == 0)


def test_single_edges_scatter_is_part_of_the_sd_of_depth_by_edges():
    lens = Lens(0.035, 4.0, 1.0)
    seen = [
        Reading(d, 4.0, 1.0, 0.5 * float(lens.blur_radius(d)) * lens.sensor_distance, 1e-8, scatter)
        for d, scatter in ((1.4, 3e-6), (2.0, 4e-6), (3.0, 5e-6))
    ]
    camera = calibrate(seen, 0.035, 5e-6, Priors(k=0.5))
    assert camera.edge_scatter == pytest.approx(np.sqrt((9 + 16 + 25) / 3) * 1e-6)
    depth, views = noisy_map(0.6, 1.0, tau=0.0)
    edges = DepthMap(
        depth.vergence, depth.vergence_sd, depth.valid, depth.valid, {"method": "edges", "psf": "gaussian"}
    )
    none = replace(camera, edge_scatter=0.0)
    with_it, without = (apply_calibration(edges, views, one, [(4.0, 1.0)]).vergence_sd.mean() for one in (camera, none))
    per_dioptre = camera.k * 0.035 / camera.f_numbers[4.0] / 2 * lens.sensor_distance
    assert np.sqrt(with_it**2 - without**2) == pytest.approx(camera.edge_scatter / per_dioptre, rel=0.02)
