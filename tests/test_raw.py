"""Camera raw files, from minimal ones written here: an uncompressed Bayer mosaic with the tags of a DNG."""

import importlib.util
import struct
import sys
from pathlib import Path

import numpy as np
import pytest

from focalgradient import FocalGradientWarning, InputError
from focalgradient.photographs import load_settings, read_photograph, read_photographs, read_views

BLACK, WHITE = 64, 4095
RGGB, GBRG = (0, 1, 1, 2), (1, 2, 0, 1)

needs_rawpy = pytest.mark.skipif(
    importlib.util.find_spec("rawpy") is None, reason="rawpy (the extra 'raw') is not installed"
)


def dng(path: Path, counts: np.ndarray, *, pattern: tuple[int, ...] = RGGB, orientation: int = 1) -> Path:
    """Write what the sensor counted, H x W, as a DNG file with little EXIF: 18 mm, f/10."""
    height, width = counts.shape
    kinds = {1: "B", 2: "B", 3: "H", 4: "I", 5: "II", 10: "ii"}
    unit = (1, 1, 0, 1, 0, 1, 0, 1, 1, 1, 0, 1, 0, 1, 0, 1, 1, 1)  # the identity, in fractions

    def directory(tags: list[tuple[int, int, tuple[int, ...]]], start: int) -> bytes:
        """A directory of (tag, type, values) at byte `start`, and the values that do not fit into it."""
        table, rest = b"", b""
        after = start + 2 + 12 * len(tags) + 4
        for tag, kind, values in sorted(tags):
            packed = struct.pack("<" + kinds[kind][0] * len(values), *values)
            if len(packed) > 4:
                packed, rest = struct.pack("<I", after + len(rest)), rest + packed + b"\0" * (len(packed) % 2)
            table += struct.pack("<HHI", tag, kind, len(values) // len(kinds[kind])) + packed.ljust(4, b"\0")
        return struct.pack("<H", len(tags)) + table + bytes(4) + rest

    exif = directory([(33437, 5, (10, 1)), (37386, 5, (18, 1)), (41486, 5, (5080, 1)), (41488, 3, (2,))], 8)
    tags = [
        *((256, 4, (width,)), (257, 4, (height,)), (258, 3, (16,)), (259, 3, (1,)), (262, 3, (32803,))),
        *((271, 2, tuple(b"Maker\0")), (272, 2, tuple(b"Model\0")), (273, 4, (0,)), (274, 3, (orientation,))),
        *((277, 3, (1,)), (278, 4, (height,)), (279, 4, (2 * height * width,)), (284, 3, (1,))),
        *((33421, 3, (2, 2)), (33422, 1, pattern), (34665, 4, (8,)), (50706, 1, (1, 4, 0, 0))),
        *((50708, 2, tuple(b"Maker Model\0")), (50714, 4, (BLACK,)), (50717, 4, (WHITE,))),
        *((50721, 10, unit), (50728, 5, (1,) * 6), (50778, 3, (21,))),
    ]
    first = 8 + len(exif)
    end = first + len(directory(tags, first))
    tags = [(273, 4, (end,)) if tag[0] == 273 else tag for tag in tags]
    body = struct.pack("<I", first) + exif + directory(tags, first) + counts.astype("<u2").tobytes()
    path.write_bytes(b"II*\0" + body)
    return path


def mosaic(green: np.ndarray, red: float = 0.9, blue: float = 0.1, pattern: tuple[int, ...] = RGGB) -> np.ndarray:
    """What a sensor counts of light whose green is `green` (0 to 1) at every one of its pixels."""
    colours = np.stack([np.full_like(green, red), green, np.full_like(green, blue)])
    rows, columns = np.indices(green.shape)
    channel = np.array(pattern).reshape(2, 2)[rows % 2, columns % 2]
    return np.rint(BLACK + (WHITE - BLACK) * np.take_along_axis(colours, channel[None], 0)[0]).astype(np.uint16)


GREEN = np.random.default_rng(3).uniform(0.05, 0.8, (24, 36))


@needs_rawpy
@pytest.mark.parametrize("pattern", [RGGB, GBRG])
def test_green_light_is_read_linearly_and_alone(tmp_path, pattern):
    photograph = read_photograph(dng(tmp_path / "a.dng", mosaic(GREEN, pattern=pattern), pattern=pattern), "srgb")
    sites = [(n // 2, n % 2) for n in range(4) if pattern[n] == 1]
    expected = np.mean([GREEN[row::2, column::2] for row, column in sites], axis=0)
    np.testing.assert_allclose(photograph.luminance, expected, atol=2e-4)
    assert (photograph.encoding, photograph.binning, photograph.saturated) == ("linear", 2, 0.0)


@needs_rawpy
@pytest.mark.parametrize(("orientation", "turns"), [(1, 0), (3, 2), (6, 3), (8, 1)])
def test_the_picture_stands_upright(tmp_path, orientation, turns):
    upright = read_photograph(dng(tmp_path / "a.dng", mosaic(GREEN))).luminance
    stored = read_photograph(dng(tmp_path / "b.dng", mosaic(GREEN), orientation=orientation)).luminance
    np.testing.assert_array_equal(stored, np.rot90(upright, turns))


@needs_rawpy
def test_a_cell_with_one_saturated_green_pixel_counts_as_saturated(tmp_path):
    counts = mosaic(GREEN)
    counts[0, 1:20:2] = WHITE  # one green of each cell
    counts[::2, ::2] = WHITE  # red, which is not looked at
    with pytest.warns(FocalGradientWarning, match=r"a\.dng: 4\.6% of the pixels are saturated"):
        photograph = read_photograph(dng(tmp_path / "a.dng", counts))
    assert np.all(photograph.luminance[0, :10] == 1.0)
    assert photograph.luminance[1:].max() < 1


@needs_rawpy
def test_a_pixel_of_the_view_is_two_of_the_sensor(tmp_path):
    for name, light in (("a.dng", GREEN), ("b.dng", 0.9 * GREEN)):
        dng(tmp_path / name, mosaic(light))
    shots = "".join(
        f'[[view]]\nimage = "{n}.dng"\nf_number = {f}\nfocus_distance_m = 0.5\n' for n, f in (("a", 4), ("b", 8))
    )
    (tmp_path / "v.toml").write_text(f"[camera]\nfocal_length_mm = 25\npixel_pitch_um = 4\n{shots}")
    (view, _), settings = read_views(tmp_path / "v.toml"), load_settings(tmp_path / "v.toml")
    # By hand: 1 / v0 = 40 - 2, so that 8 um subtend 304 urad.
    assert view.pixel_angle == pytest.approx(304e-6)
    assert settings.pixel_angles()[0] == pytest.approx(152e-6)


@needs_rawpy
def test_damaged_files_and_strange_sensors_are_refused(tmp_path, capfd):
    whole = dng(tmp_path / "a.dng", mosaic(GREEN))
    (tmp_path / "cut.nef").write_bytes(whole.read_bytes()[:100])
    with pytest.raises(InputError, match=r"cut\.nef cannot be read as a camera raw file"):
        read_photograph(tmp_path / "cut.nef")
    with pytest.raises(InputError, match=r"b\.dng comes from a sensor without the usual 2 x 2 cells"):
        read_photograph(dng(tmp_path / "b.dng", mosaic(GREEN), pattern=(0, 1, 2, 0)))
    (tmp_path / "empty.cr2").write_bytes(b"")
    with pytest.raises(InputError, match=r"empty\.cr2 is empty"):
        read_photographs([tmp_path / "empty.cr2"])
    assert capfd.readouterr() == ("", "")


class _Shots:
    """Stands in for rawpy: a file whose second picture is one half of the first."""

    LibRawError, NotSupportedError = OSError, KeyError

    def __init__(self, *pictures):
        self.pictures = pictures

    def imread(self, path, shot_select=0):
        import contextlib

        if shot_select >= len(self.pictures):
            raise OSError("no such shot")
        return contextlib.nullcontext(self.pictures[shot_select])


def test_the_halves_of_a_dual_pixel_raw_add_up_to_the_picture(monkeypatch):
    from focalgradient.photographs import raw, read_dual_pixel_raw

    left = np.full((4, 6), 1000, np.uint16)
    monkeypatch.setattr(raw, "check_installed", lambda *words: None)
    monkeypatch.setattr(raw, "_green", lambda path, picture: picture)
    monkeypatch.setitem(sys.modules, "rawpy", _Shots(left + 500, left))
    one, other = read_dual_pixel_raw(Path("a.cr3"))
    assert (one == 1000).all()
    assert (other == 2000).all()  # the picture is the mean of the two
    monkeypatch.setitem(sys.modules, "rawpy", _Shots(left))
    with pytest.raises(InputError, match="not a dual-pixel raw file"):
        read_dual_pixel_raw(Path("a.cr3"))
    monkeypatch.setitem(sys.modules, "rawpy", _Shots(left, left))
    with pytest.raises(InputError, match="one picture only"):
        read_dual_pixel_raw(Path("a.cr3"))
