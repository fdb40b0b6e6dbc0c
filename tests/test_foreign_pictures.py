"""Pictures and depth maps of other programs: marked holes, layers, pages and lost frames."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from focalgradient import FocalGradientWarning, InputError
from focalgradient.photographs import read_photograph
from focalgradient.photographs.pictures import read_distances, read_picture
from focalgradient.video.pairing import Pair, Skipped, alternation, pairs
from focalgradient.video.reading import Frame

RAMP = np.linspace(1.0, 3.0, 48).reshape(6, 8).astype(np.float32)


@pytest.mark.parametrize(
    ("values", "unit", "scale"),
    [
        (np.where(RAMP > 2.5, 65535, RAMP * 1000).astype(np.uint16), "mm", 1.0),
        (np.where(RAMP > 2.5, 65535, RAMP * 5000).astype(np.uint16), "m", 1 / 5000),
        (np.where(RAMP > 2.5, 32767, RAMP * 1000).astype(np.int16), "mm", 1.0),
        (np.where(RAMP > 2.5, 255, RAMP * 40).astype(np.uint8), "m", 1 / 40),
        (np.where(RAMP > 2.5, 8191, RAMP * 1000).astype(np.uint16), "mm", 1.0),
        (np.where(RAMP > 2.5, 65535.0, RAMP * 1000), "mm", None),
        (np.where(RAMP > 2.5, 1e9, RAMP * 1000), "mm", None),
        (np.where(RAMP > 2.5, np.float32(65.535), RAMP), "m", None),
        (np.where(RAMP > 2.5, -1.0, RAMP), "m", None),
    ],
)
def test_marked_pixels_are_holes(tmp_path: Path, values: np.ndarray, unit: str, scale: float | None) -> None:
    np.save(tmp_path / "depth.npy", values)
    with pytest.warns(FocalGradientWarning, match="have no depth"):
        found = read_distances(tmp_path / "depth.npy", unit, scale=scale)  # type: ignore[arg-type]
    assert found.metres.max() < 2.6
    assert found.filled == pytest.approx((RAMP > 2.5).mean())


def exr(folder: Path, **channels: np.ndarray) -> Path:
    module = pytest.importorskip("OpenEXR")
    path = folder / "layers.exr"
    named = {name.replace("_", "."): np.ascontiguousarray(value, np.float32) for name, value in channels.items()}
    module.File({"compression": module.ZIP_COMPRESSION, "type": module.scanlineimage}, named).write(str(path))
    return path


COLOURS = {f"View_Combined_{name}": RAMP / 3 for name in "RGB"}


@pytest.mark.parametrize(
    "others",
    [
        {"View_Depth_Z": RAMP},
        {"Z": RAMP},
        {"View_Depth_V": RAMP, "View_Mist_Z": RAMP * 2},
        {"View_Depth_Z": RAMP, "View_Normal_X": RAMP, "View_Normal_Y": RAMP, "View_Normal_Z": RAMP * 9},
        {f"View_Depth_{name}": RAMP for name in "RGB"},
    ],
)
def test_the_layers_of_depth_and_colour_are_found(tmp_path: Path, others: dict[str, np.ndarray]) -> None:
    path = exr(tmp_path, **COLOURS, **others)
    np.testing.assert_allclose(read_distances(path).metres, RAMP, rtol=1e-6)
    np.testing.assert_allclose(read_picture(path).light[..., 1], RAMP / 3, rtol=1e-6)


@pytest.mark.parametrize("lost", [1, 2, 3, 7, 12, 20, 22])
def test_a_frame_lost_anywhere_keeps_the_order_of_the_apertures(lost: int) -> None:
    levels = [40 if number % 2 == 0 else 20 for number in range(24)]
    del levels[lost]
    frames = [Frame(number, np.full((1, 1), level, np.uint8)) for number, level in enumerate(levels)]
    step = alternation(frames, lambda image: float(image.mean()))
    assert step == pytest.approx(np.log(2))
    found = list(pairs(frames, lambda image: float(image.mean()), step))
    made = [pair for pair in found if isinstance(pair, Pair)]
    assert all(pair.even[0, 0] == 40 and pair.odd[0, 0] == 20 for pair in made)
    assert len(made) >= 20
    assert any("a frame between them was lost" in str(item) for item in found if isinstance(item, Skipped))


def deep_tiff(path: Path, channels: int, *, photometric: int, planes: bool) -> np.ndarray:
    """Write a 16-bit TIFF file by the TIFF 6.0 specification, and return its values, H x W x channels."""
    values = np.arange(1000, 1000 + 48 * channels, dtype="<u2").reshape(6, 8, channels)
    layers = np.moveaxis(values, -1, 0) if planes else values[None]
    count, size = len(layers), layers[0].nbytes
    numbers = [(256, [8]), (257, [6]), (258, [16] * channels), (259, [1]), (262, [photometric]), (273, [0] * count)]
    numbers += [(277, [channels]), (278, [6]), (279, [size] * count), (284, [2 if planes else 1])]
    numbers += [(338, [2])] if channels == 2 else []
    lists_at = 14 + 12 * len(numbers)
    first = lists_at + 4 * sum(len(items) for _, items in numbers)
    numbers[5] = (273, [first + n * size for n in range(count)])
    entries, lists = b"", b""
    for tag, items in numbers:  # all of 32 bits
        data = struct.pack(f"<{len(items)}I", *items)
        entries += struct.pack("<HHI", tag, 4, len(items))
        entries += data if len(items) == 1 else struct.pack("<I", lists_at + len(lists))
        lists += data if len(items) > 1 else b""
    head = struct.pack("<2sHIH", b"II", 42, 8, len(numbers)) + entries + bytes(4) + lists
    path.write_bytes(head.ljust(first, b"\0") + layers.tobytes())
    return values


@pytest.mark.parametrize(("channels", "planes"), [(3, True), (2, False)], ids=["separate planes", "grey and alpha"])
def test_layouts_of_16_bits_that_opencv_decodes_wrongly_are_refused(
    tmp_path: Path, channels: int, planes: bool
) -> None:
    # OpenCV returned wrong values for the one, and 8 bits, hence sRGB, for the other.
    deep_tiff(tmp_path / "view.tif", channels, photometric=2 if channels == 3 else 1, planes=planes)
    with pytest.raises(InputError, match=r"view.tif has 16 bits per channel .* interleaved"):
        read_photograph(tmp_path / "view.tif")


def test_16_bit_tiff_files_are_not_shown_as_negatives(tmp_path: Path) -> None:
    values = deep_tiff(tmp_path / "white.tif", 1, photometric=0, planes=False)[..., 0]
    found = read_photograph(tmp_path / "white.tif").luminance
    np.testing.assert_allclose(found, (65535 - values) / 65535, atol=1e-7)
    same = deep_tiff(tmp_path / "black.tif", 3, photometric=2, planes=False)
    luminance = read_photograph(tmp_path / "black.tif").luminance
    np.testing.assert_allclose(luminance, same / 65535 @ [0.2126, 0.7152, 0.0722], atol=1e-7)
