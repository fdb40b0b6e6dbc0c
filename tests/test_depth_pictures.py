"""Pictures with depth from files: the size of a pixel, and implausible distances."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from focalgradient import InputError, Lens
from focalgradient.photographs import depth_pairs, pixel_angle_of, read_depth_picture


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    light, depth = tmp_path / "light.npy", tmp_path / "depth.npy"
    np.save(light, np.full((20, 30), 0.5, np.float32))
    np.save(depth, np.full((20, 30), 2.0))
    return light, depth


def test_the_size_of_a_pixel() -> None:
    assert pixel_angle_of(100, pixel_pitch=5e-6, focal_length=0.05) == pytest.approx(1e-4)
    assert pixel_angle_of(100, pixel_angle=3e-4) == 3e-4
    assert pixel_angle_of(1000, field=math.radians(10), pixel_angle=1.0) == pytest.approx(
        math.tan(math.radians(5)) / 500
    )
    for given, said in (
        ({}, "size of a pixel is unknown: give field, or pixel_pitch, or pixel_angle"),
        ({"field": 0.1, "pixel_pitch": 5e-6}, "field and pixel_pitch both give the size of a pixel"),
        ({"pixel_pitch": 5e-6}, "requires a focal length: give focal_length, or field instead"),
        ({"field": 4.0}, "must be less than 180"),
    ):
        with pytest.raises(InputError, match=said):
            pixel_angle_of(100, **given)


def test_distances_in_another_unit_are_refused_unless_their_unit_is_given(files: tuple[Path, Path]) -> None:
    np.save(files[1], np.linspace(800.0, 2200.0, 600).reshape(20, 30))
    lens = [Lens(0.0225, 5.0, 0.8)]
    with pytest.raises(InputError, match=r"0\.8 to 2\.2 m in mm: give unit mm\. If all is correct, give unit m\."):
        read_depth_picture(*files, field=0.1, optics=lens)
    with pytest.warns(match=r"0\.8 to 2\.2 m in mm: give unit mm\."):
        assert read_depth_picture(*files, field=0.1, optics=lens, unit="m").metres.max() == 2200
    assert read_depth_picture(*files, field=0.1, optics=lens, unit="mm").metres.max() == pytest.approx(2.2)


def test_a_frame_replaces_the_pixels_of_a_file(files: tuple[Path, Path]) -> None:
    frame = np.full((20, 30, 3), 255, np.uint8)
    found = read_depth_picture(Path("clip.mkv"), files[1], field=0.1, frame=frame)
    assert (found.name, found.light.shape, float(found.light.max())) == ("clip.mkv", (20, 30, 3), 1.0)


def test_pairs(tmp_path: Path, files: tuple[Path, Path]) -> None:
    assert depth_pairs(*files) == [(*files, "light")]
    pictures, depths = tmp_path / "pictures", tmp_path / "depths"
    pictures.mkdir()
    depths.mkdir()
    with pytest.raises(InputError, match="contains no depth files"):
        depth_pairs(tmp_path / "clip.mp4", depths)
    with pytest.raises(InputError, match="contains no pictures"):
        depth_pairs(pictures, depths)
    for name in ("b.npy", "a.npy"):
        (depths / name).touch()
    assert [pair.stem for pair in depth_pairs(tmp_path / "clip.mp4", depths)] == ["clip-000000", "clip-000001"]
    (pictures / "c.png").touch()
    with pytest.raises(InputError, match=r"c\.png has no depth file of the same name"):
        depth_pairs(pictures, depths)
    with pytest.raises(InputError, match="picture is a folder but depth is not"):
        depth_pairs(pictures, files[1])
    with pytest.raises(InputError, match=r"is a folder but picture .* is one picture"):
        depth_pairs(files[0], depths)
