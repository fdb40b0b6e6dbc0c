"""The command ``stream``, end to end on small videos, and all that can be wrong with what it is given."""

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import command_line
import cv2
import numpy as np
import pytest

from focalgradient import Lens
from focalgradient.render import cast
from focalgradient.scenes import plane

DISTANCE = 1.3
LENSES = [Lens(0.025, number, 0.85) for number in (16, 5.6)]
OPTICS = ["--focal-length", "25", "--f-number", "16", "--f-number", "5.6", "--focus-distance", "0.85"]
OPTICS += ["--pixel-pitch", "8", "--near", "0.85"]


@pytest.fixture(scope="module")
def views() -> list[np.ndarray]:
    """A wall through both apertures, encoded as sRGB, before noise and rounding: 0 to 255."""
    pixel = 8e-6 / LENSES[0].sensor_distance
    images = [cast(plane(DISTANCE, seed=1), lens, (144, 192), pixel, samples=128).view.image for lens in LENSES]
    return [255 * (1.055 * (1.2 * image) ** (1 / 2.4) - 0.055) for image in images]


def write(path: Path, views: Sequence[np.ndarray], apertures: Sequence[int]) -> None:
    random = np.random.default_rng(0)
    size = views[0].shape[1], views[0].shape[0]
    writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, cv2.VideoWriter.fourcc(*"FFV1"), 25, size)
    for aperture in apertures:
        image = views[aperture] + 0.4 * random.standard_normal(views[0].shape)
        writer.write(np.repeat(np.clip(np.rint(image), 0, 255).astype(np.uint8)[..., None], 3, axis=2))
    writer.release()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, views: list[np.ndarray]) -> Path:
    write(tmp_path / "video.mkv", views, [0, 1] * 5)
    monkeypatch.chdir(tmp_path)
    return tmp_path


run = partial(command_line.run, "stream")
succeed = partial(command_line.succeed, "stream")


def refused(*args: str) -> str:
    """The one sentence with which a run was refused; it left nothing behind."""
    before = sorted(Path().iterdir())
    result = run(*args)
    assert result.exit_code == 2, result.output
    assert len(result.stderr.strip().splitlines()) == 1
    assert sorted(Path().iterdir()) == before
    return result.stderr


def test_depth_of_a_wall(folder: Path) -> None:
    succeed("video.mkv", "--out", "depth.mp4", "--values", "depth.npy", *OPTICS)
    values = np.load("depth.npy", mmap_mode="r")
    assert values.shape == (9, 36, 48)
    assert np.isfinite(values).mean() > 0.9
    assert np.nanmedian(values) == pytest.approx(DISTANCE, rel=0.05)
    summary = json.loads(Path("depth.json").read_text())
    assert summary["frames_read"] == 10
    assert summary["depth_frames"] == summary["frames_with_depth"] == 9
    assert summary["skipped"] == []
    assert summary["settings"]["optics"]["f_numbers"] == [16, 5.6]
    capture = cv2.VideoCapture("depth.mp4")
    assert capture.get(cv2.CAP_PROP_FRAME_COUNT) == 9
    assert sorted(path.name for path in folder.iterdir()) == ["depth.json", "depth.mp4", "depth.npy", "video.mkv"]


def test_a_video_without_depth_is_written_and_ends_with_exit_code_1(folder: Path) -> None:
    write(Path("blank.mkv"), [np.full((144, 192), 120.0)] * 2, [0, 1] * 3)
    result = run("blank.mkv", "--out", "depth.mp4", *OPTICS)
    assert result.exit_code == 1, result.output
    last = result.stdout.splitlines()[-1]
    assert last.startswith("No depth in any frame: most likely because the scene has too little")
    summary = json.loads(Path("depth.json").read_text())
    assert (summary["depth_frames"], summary["frames_with_depth"]) == (5, 0)
    assert Path("depth.mp4").exists()


def test_without_optics_it_is_focal_disparity_and_says_so(folder: Path) -> None:
    result = succeed("video.mkv", "--out", "new/disparity.avi", "--values", "disparity.npy")
    assert "focal disparity" in result.stdout
    assert "not distance" in result.stdout
    values = np.load("disparity.npy")
    assert 0.1 < np.nanmedian(values) < 0.5
    assert json.loads((folder / "new" / "disparity.json").read_text())["settings"]["optics"] is None


def test_a_video_that_does_not_alternate_is_refused_without_optics(folder: Path, views: list[np.ndarray]) -> None:
    write(Path("same.mkv"), views, [0] * 6)
    assert "does not show which aperture is the larger" in refused("same.mkv", "--out", "d.mp4")


def test_interrupted_it_leaves_nothing(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from focalgradient.video import VideoFile

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(VideoFile, "write", interrupt)
    result = run("video.mkv", "--out", "depth.mp4", *OPTICS)
    assert result.exit_code == 130
    assert "none of these results was written" in result.stderr
    assert [path.name for path in folder.iterdir()] == ["video.mkv"]
