"""`focalgradient demo`: every file is there, small, and holds what README.txt in it says is true."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from scipy import ndimage

from focalgradient import DepthMap
from focalgradient.cli import main
from focalgradient.examples.files import CARDS_M, EFFECT, FOCUS_M, FRAMES, STOPS
from focalgradient.photographs import load_camera, load_settings, load_targets
from focalgradient.statistics import depth_rating, read_ratings
from focalgradient.video import Frame, Source


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> tuple[Path, Result]:
    """The folder, and what the command said."""
    folder = tmp_path_factory.mktemp("examples") / "demo"
    result = CliRunner().invoke(main, ["demo", "--out", str(folder)])
    assert result.exit_code == 0, result.output
    return folder, result


def test_it_is_small_and_says_what_each_file_is(made):
    folder, result = made
    files = [path for path in folder.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) < 3e6
    said = (folder / "README.txt").read_text()
    for path in folder.iterdir():
        assert path.name in said or path.name.startswith("target_") or path.name == "README.txt", path.name
    assert "about twice the stated uncertainty" in result.stdout
    assert (folder / "depth" / "depth.png").is_file()


def test_the_depth_map_is_that_of_the_scene(made):
    folder, _ = made
    depth = DepthMap.load(folder / "depth" / "depth.npz")
    truth = np.load(folder / "distance.npy")
    valid = depth.valid
    assert valid.mean() > 0.6
    error = np.abs(1 / depth.distance[valid] - 1 / truth[valid])  # dioptres; the picture is magnified by 1 % more
    assert np.median(error) < 0.03
    assert np.percentile(error, 90) < 0.3
    vergence = 1 / truth
    jumps = ndimage.maximum_filter(vergence, 3) - ndimage.minimum_filter(vergence, 3) > 0.06  # dioptres
    outlines = ndimage.distance_transform_edt(~jumps) < 16  # twice the window's standard deviation
    within = np.abs(1 / depth.distance - vergence) < 2 * depth.vergence_sd
    assert within[valid & ~outlines].mean() == pytest.approx(0.97, abs=0.015)
    assert within[valid & outlines].mean() == pytest.approx(0.93, abs=0.015)  # as the sentence on what to trust states
    assert [shot.image.name for shot in load_settings(folder / "views.toml").shots] == ["near.png", "far.png"]


def test_the_camera_is_the_true_one_within_its_uncertainty(made):
    folder, _ = made
    camera = load_camera(folder / "camera.toml").calibration
    sd = camera.sd
    assert abs(camera.offset) < 3 * sd[2]
    for n, stop in enumerate(sorted(STOPS)):
        assert abs(np.log(camera.f_numbers[stop] / stop)) < 3 * sd[3 + n]
    assert abs(camera.focus[FOCUS_M] - 1 / FOCUS_M) < 3 * sd[5]
    assert len(load_targets(folder / "targets.toml").shots) == 6


def test_the_camera_is_what_calibrate_makes_of_the_targets(made, tmp_path):
    folder, _ = made
    again = CliRunner().invoke(main, ["calibrate", str(folder / "targets.toml"), "--out", str(tmp_path / "again.toml")])
    assert again.exit_code == 0, again.output
    kept, found = (load_camera(path).calibration for path in (folder / "camera.toml", tmp_path / "again.toml"))
    assert found.offset == pytest.approx(kept.offset, abs=0.05 * kept.sd[2])
    assert np.allclose(found.sd, kept.sd, rtol=0.02)
    assert found.focus[FOCUS_M] == pytest.approx(kept.focus[FOCUS_M], abs=0.05 * kept.sd[5])
    for stop in STOPS:
        assert found.f_numbers[stop] == pytest.approx(kept.f_numbers[stop], rel=0.002)


def test_edges_by_the_calibrated_camera_give_the_distances_of_the_cards(made, tmp_path):
    folder, _ = made
    command = ["depth", str(folder / "cards.png"), "--method", "edges", "--f-number", "5.6", "--near", "0.85"]
    result = CliRunner().invoke(
        main, [*command, "--calibration", str(folder / "camera.toml"), "--out", str(tmp_path / "cards")]
    )
    assert result.exit_code == 0, result.output
    depth = DepthMap.load(tmp_path / "cards" / "depth.npz")
    columns = np.array_split(np.arange(depth.distance.shape[1]), 3)
    for metres, part in zip(CARDS_M, columns, strict=True):
        found = depth.distance[:, part][depth.valid[:, part]]
        assert len(found) > 50
        assert np.median(found) == pytest.approx(metres, rel=0.05)


def test_the_frames_of_the_video_alternate_in_aperture(made):
    folder, _ = made
    with Source(folder / "video.mkv") as source:
        frames = [item for item in source.frames() if isinstance(item, Frame)]
    assert len(frames) == FRAMES
    detail = [float(np.abs(np.diff(frame.image[:, -64:].astype(float), axis=1)).mean()) for frame in frames[:2]]
    assert detail[0] > 1.1 * detail[1]


def test_the_ratings_say_that_they_are_simulated(made):
    folder, _ = made
    table = read_ratings(folder / "ratings.csv").table
    assert set(table["kind"]) == {"simulated"}
    assert table["participant_id"].nunique() == 16
    rises = {each.fixation: each.rise for each in depth_rating(table, equivalence_bound=1.2).fixations}
    assert rises["nearest"].significant  # a newcomer's first report finds the effect that was put in
    logs = np.log(table["rating"].astype(float))
    near = table["fixation"] == "nearest"
    rise = logs[near & (table["aperture"] == "f/5.6")].mean() - logs[near & (table["aperture"] == "pinhole")].mean()
    assert rise == pytest.approx(np.log(EFFECT), abs=0.2)


def test_a_file_in_the_place_of_the_folder_is_refused(made):
    folder, _ = made
    before = (folder / "near.png").read_bytes()
    result = CliRunner().invoke(main, ["demo", "--out", str(folder / "near.png")])
    assert result.exit_code == 2
    assert result.stderr.startswith("Error: ")
    assert result.stderr.count("\n") == 1
    assert (folder / "near.png").read_bytes() == before


def test_files_of_somebody_else_are_not_replaced(tmp_path):
    (tmp_path / "views.toml").write_text("mine")
    result = CliRunner().invoke(main, ["demo", "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "views.toml is there already and was not written by 'focalgradient demo'" in result.output
    assert [path.name for path in tmp_path.iterdir()] == ["views.toml"]
