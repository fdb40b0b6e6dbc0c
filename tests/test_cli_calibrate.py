"""`focalgradient calibrate`, and depth by what it writes: from pictures on disk to distances."""

import json
import math
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import Result
from command_line import run, sentence, succeed
from scipy import ndimage

from focalgradient import DepthMap, Lens
from focalgradient.calibration import EDGE_K
from focalgradient.errors import InputError
from focalgradient.photographs import camera_toml, load_camera, load_settings
from focalgradient.psf import transfer

OFFSET, FOCUS, PITCH = 0.05, 0.35, 8e-6  # m; focus from the optical centre
STOPS = {"8": 8.6, "16": 15.4}  # marked and true
OWN = -0.8  # px^2: the camera sharpens

CAMERA = "[camera]\nfocal_length_mm = 25\npixel_pitch_um = 8\n"
SURE = "offset_sd_m = 0.1\nf_number_tolerance = 0.1\ndistance_sd_m = 0.001\n"


def picture(path: Path, distance: float, f_number: float, *, seed: int = 0, own: float = OWN) -> Path:
    """A dark square on white at `distance` from the user's plane, its edges blurred as by a disc on the whole."""
    lens = Lens(0.025, f_number, FOCUS)
    radius = float(lens.blur_radius(distance + OFFSET)) * lens.sensor_distance / PITCH
    sigma = math.sqrt((EDGE_K * radius) ** 2 + own)
    fine = np.full((512, 640), 0.75)
    fine[141:361, 154:419] = 0.06
    blurred = ndimage.gaussian_filter(fine, 4 * sigma).reshape(128, 4, 160, 4).mean(axis=(1, 3))
    noisy = blurred + 0.002 * np.random.default_rng(seed).standard_normal(blurred.shape)
    path.write_bytes(cv2.imencode(".png", np.rint(65535 * np.clip(noisy, 0, 1)).astype(np.uint16))[1].tobytes())
    return path


def targets(folder: Path, distances: tuple[float, ...], head: str = CAMERA + SURE) -> Path:
    text = head
    for n, distance in enumerate(distances):
        for mark, true in STOPS.items():
            name = picture(folder / f"{distance}_{mark}.png", distance, true, seed=n).name
            text += f'[[view]]\nimage = "{name}"\ndistance_m = {distance}\nf_number = {mark}\n'
    (folder / "targets.toml").write_text(text)
    return folder / "targets.toml"


@pytest.fixture(scope="module")
def camera(tmp_path_factory) -> tuple[Path, Result]:
    """CAMERA.toml of four distances, and what the command said."""
    folder = tmp_path_factory.mktemp("camera")
    result = succeed("calibrate", targets(folder, (0.5, 0.7, 1.1, 2.0)), "--out", folder / "camera.toml")
    return folder / "camera.toml", result


def test_the_camera_is_told_with_its_uncertainties(camera):
    path, result = camera
    calibration = load_camera(path).calibration
    assert calibration.offset == pytest.approx(OFFSET, abs=0.02)
    assert 1 / calibration.focus[None] - calibration.offset == pytest.approx(FOCUS - OFFSET, abs=0.01)
    assert calibration.f_numbers[16] / calibration.f_numbers[8] == pytest.approx(15.4 / 8.6, rel=0.02)
    assert calibration.own / PITCH**2 == pytest.approx(OWN, abs=0.3)
    table = result.stdout
    assert re.search(r"f-number marked 16 +1\d\.\d\d +\d\.\d\d  ", table)
    assert re.search(r"offset, m +0\.0\d+ +0\.0\d+  the views \(\d+%\)", table)
    rms = re.findall(r"predicted without (.+): (\d\.\d+) D", table)
    assert [name for name, _ in rms] == ["it", "its distance"]
    assert all(float(value) < 0.05 for _, value in rms)


def test_the_file_keeps_what_was_found(camera, tmp_path):
    calibrated = load_camera(camera[0])
    (tmp_path / "again.toml").write_text(camera_toml(calibrated))
    again = load_camera(tmp_path / "again.toml")
    assert again.sensor == calibrated.sensor
    np.testing.assert_allclose(again.calibration.parameters, calibrated.calibration.parameters, rtol=1e-4)
    np.testing.assert_allclose(again.calibration.covariance, calibrated.calibration.covariance, rtol=1e-5)


def test_a_camera_file_that_cannot_be_one_is_refused(camera, tmp_path):
    text = camera[0].read_text()
    first = re.search(r"covariance = \[\n *\[([^,]*), ([^,]*),", text)
    variance, joint = first[1], first[2]
    doubled = text.replace("f_number = 16", "f_number = 8", 1)
    assert "f_number = 16" in text
    for changed, said in (
        (text.replace(variance, f"-{variance}", 1), "covariance is not symmetric and positive semidefinite"),
        (text.replace(joint, f"{1 + abs(float(joint))}", 1), "covariance is not symmetric"),
        (text.replace(joint, "1e300").replace(variance, "1e-300"), "covariance is not symmetric"),
        (doubled, r"two \[\[aperture\]\] tables have the same f_number: remove one"),
    ):
        assert changed != text
        (tmp_path / "camera.toml").write_text(changed)
        with pytest.raises(InputError, match=said):
            load_camera(tmp_path / "camera.toml")


def test_edges_give_the_distance_from_the_users_plane(camera, tmp_path):
    photographs = [picture(tmp_path / f"{mark}.png", 0.9, true, seed=7) for mark, true in STOPS.items()]
    succeed(
        *("depth", *photographs, "--f-number", 8, "--f-number", 16, "--calibration", camera[0], "--method", "edges"),
        *("--near", 0.45, "--far", 3, "--out", tmp_path / "out"),
    )
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    systematic = summary["calibration"]["systematic_sd"]
    assert 0 < systematic["distance_m"] < 0.1
    assert summary["medians"]["distance_m"] == pytest.approx(0.9, abs=min(3 * systematic["distance_m"], 0.03))
    assert summary["settings"]["psf"] == "gaussian"
    assert summary["calibration"]["effective_f_numbers"] == pytest.approx([8.6, 15.4], rel=0.15)
    depth = DepthMap.load(tmp_path / "out" / "depth.npz")
    assert depth.offset == pytest.approx(summary["calibration"]["offset_m"])
    np.testing.assert_allclose((depth.distance + depth.offset) * depth.vergence, 1, rtol=1e-5)


def test_compared_views_give_it_too_from_a_settings_file_that_names_the_calibration(camera, tmp_path):
    """A texture, blurred by true discs, compared by the default method."""
    rng = np.random.default_rng(4)
    frequency = np.hypot(np.fft.fftfreq(160)[:, None], np.fft.rfftfreq(160))
    frequency[0, 0] = np.inf
    spectrum = np.fft.rfft2(rng.standard_normal((160, 160))) / frequency
    names = []
    for mark, true in STOPS.items():
        lens = Lens(0.025, true, FOCUS)
        radius = float(lens.blur_radius(0.9 + OFFSET)) * lens.sensor_distance / PITCH
        image = np.fft.irfft2(spectrum * transfer(np.where(frequency < 1, frequency, 0), radius, "disc"))
        image = 0.5 + 0.1 * image / 40 + 0.001 * rng.standard_normal(image.shape)
        names.append(tmp_path / f"{mark}.npy")
        np.save(names[-1], image)
    shots = "".join(f'[[view]]\nimage = "{n.name}"\nf_number = {n.stem}\n' for n in names)
    (tmp_path / "views.toml").write_text(f'[camera]\ncalibration = "{camera[0].as_posix()}"\n{shots}')
    settings, calibration = load_settings(tmp_path / "views.toml"), load_camera(camera[0]).calibration
    assert [lens.f_number for lens in settings.lenses()] == list(calibration.f_numbers.values())
    assert (settings.offset, settings.given_k("gaussian")) == (calibration.offset, calibration.k)
    assert settings.camera.pixel_pitch_um == 8
    succeed("depth", tmp_path / "views.toml", "--near", 0.4, "--far", 3, "--out", tmp_path / "out")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    systematic = summary["calibration"]["systematic_sd"]["distance_m"]
    assert summary["medians"]["distance_m"] == pytest.approx(0.9, abs=min(0.09, 3 * systematic))
    assert summary["settings"]["psf"] == "disc"


def test_a_shaken_photograph_and_an_offset_that_is_not_determined_are_named(tmp_path, camera):
    head = CAMERA + SURE
    for n in range(3):
        name = picture(tmp_path / f"{n}.png", 1.0, 8, seed=n, own=6.0 if n == 1 else OWN).name
        head += f'[[view]]\nimage = "{name}"\ndistance_m = 1.0\nf_number = 8\nfocus_distance_m = 0.3\n'
    (tmp_path / "t.toml").write_text(head)
    result = succeed("calibrate", tmp_path / "t.toml", "--out", tmp_path / "camera.toml")
    assert re.search(r"Warning: .*1\.png is \d+% more blurred than the others of its kind", result.stderr)
    assert "1 distance does not determine the offset" in result.stdout
    assert "determine the offset" not in camera[1].stdout
    assert load_camera(tmp_path / "camera.toml").calibration.sd[2] > 1.5 * load_camera(camera[0]).calibration.sd[2]


@pytest.mark.slow
def test_slips_are_refused_and_named(tmp_path):
    path = targets(tmp_path, (0.5, 0.7, 1.1))
    text = path.read_text().replace("distance_m = 0.7", "distance_m = 70")
    path.write_text(text.replace("f_number =", "focus_distance_m = 0.3\nf_number ="))
    result = run("calibrate", path, "--out", tmp_path / "camera.toml")
    assert result.exit_code == 2
    assert "their blur fits better with 0.7 m for the distance of 70 m" in result.stderr
    assert not (tmp_path / "camera.toml").exists()


# --- What can be wrong -------------------------------------------------------------------------------------------


def test_targets_without_edges_are_refused_with_the_file_and_the_remedy(tmp_path):
    cv2.imwrite(str(tmp_path / "a.png"), np.random.default_rng(0).integers(100, 120, (64, 64), dtype=np.uint8))
    (tmp_path / "t.toml").write_text(CAMERA + '[[view]]\nimage = "a.png"\ndistance_m = 1.0\nf_number = 8\n')
    said = sentence(run("calibrate", tmp_path / "t.toml", "--out", tmp_path / "c.toml"))
    assert re.search(r"a\.png: the view shows \d+ usable points along edges, .* flat sheet", said)
    assert not (tmp_path / "c.toml").exists()
