"""``focalgradient blur`` from files to files, and what it says of bad ones."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import command_line
import cv2
import numpy as np
import pytest
from PIL import Image, ImageCms

from focalgradient import Lens
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.eye import natural_pupil
from focalgradient.live import read_series
from focalgradient.photographs import read_distances, read_picture, srgb_to_linear
from focalgradient.render import blur_picture
from focalgradient.video import write_frames

LENS = ["--f-number", "2", "--focal-length", "50"]


run = partial(command_line.run, "blur")
succeed = partial(command_line.succeed, "blur")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    random = np.random.default_rng(1)
    cv2.imwrite(str(tmp_path / "picture.png"), random.integers(20, 235, (48, 64, 3), np.uint8))
    np.save(tmp_path / "depth.npy", np.linspace(1, 3, 64) * np.ones((48, 1)))
    return tmp_path


def test_a_picture_lit_by_an_illuminant_is_blurred_as_its_light_is_focused(folder: Path) -> None:
    """A white surface stays white in any light; in a bulb's light, where there is little blue, other blur is left."""
    white = np.full((48, 64, 3), 200, np.uint8)
    white[:, 32:] = 90
    cv2.imwrite(str(folder / "edge.png"), white)
    np.save(folder / "wall.npy", np.full((48, 64), 1.0))
    light = {}
    for name, more in {
        "A": ["--illuminant", "A"],
        "D65": ["--illuminant", "D65"],
        "3000 K": ["--illuminant", "3000 K"],
        "old": ["--illuminant", "D65", "--age", "75", "--refraction", "-1.00"],
    }.items():
        given = ["--pupil", 4, "--focus", "1.0", "--field", 1, "--chromatic", "--wavelengths", 5, *more]
        succeed(folder / "edge.png", folder / "wall.npy", "--out", folder / name, *given)
        light[name] = np.load(folder / name / "blurred-1.0m.npy")
        assert np.ptp(light[name][24, 4]) < 0.02 * light[name].max()  # far from the edge: grey
        assert json.loads((folder / name / "summary.json").read_text())["settings"]["illuminant"] == more[1]
    assert np.abs(light["A"] - light["D65"]).max() > 0.01
    assert np.abs(light["A"] - light["3000 K"]).max() < 0.3 * np.abs(light["A"] - light["D65"]).max()
    assert np.abs(light["old"] - light["D65"]).max() > 0.01


def test_each_focus_gives_a_picture_for_the_display_and_its_light(folder: Path) -> None:
    out = folder / "out"
    given = ["--focus", "1.0", "--focus", "2.5", "--field", 4]
    succeed(folder / "picture.png", folder / "depth.npy", "--out", out, *LENS, *given)
    assert {path.name for path in out.iterdir()} == {
        *("blurred-1.0m.png", "blurred-1.0m.npy", "blurred-2.5m.png", "blurred-2.5m.npy"),
        *("distance.npy", "summary.json"),
    }
    light = np.load(out / "blurred-1.0m.npy")
    picture = cv2.imread(str(folder / "picture.png"))[..., ::-1]
    angle = 2 * np.tan(np.radians(2)) / 64
    expected = blur_picture(
        srgb_to_linear(picture / 255), np.load(folder / "depth.npy"), Lens(0.05, 2, 1.0), pixel_angle=angle
    )
    assert np.allclose(light, expected, atol=1e-5)
    shown = cv2.imread(str(out / "blurred-1.0m.png"))[..., ::-1]
    assert np.abs(srgb_to_linear(shown / 255) - light).max() < 0.006  # half a step of 8 bits
    summary = json.loads((out / "summary.json").read_text())
    assert summary["pictures"][0]["pixel_arcmin"] == pytest.approx(60 * np.degrees(angle))
    assert summary["pictures"][0]["largest_blur_px"][0] == pytest.approx(0.0125 * (1 - 1 / 3) / angle, rel=1e-6)


def test_pictures_focused_at_infinity_and_near_are_a_focus_series(folder: Path) -> None:
    given = ["--focus", "inf", "--focus", "0.5", "--field", 4]
    succeed(folder / "picture.png", folder / "depth.npy", "--out", folder / "two", *LENS, *given)
    assert (folder / "two" / "blurred-infm.png").exists()
    assert read_series(folder / "two").vergences == (0, 2)


def test_an_eye_from_its_pupil_or_its_file_in_colours_of_its_own_focus(folder: Path) -> None:
    (folder / "eye.toml").write_text("pupil_mm = 2.0\naberrations = [[4, 0, 0.2]]\n")
    np.save(folder / "wall.npy", np.full((48, 64), 1.0))
    light = []
    spectral = ["--pupil", 2, "--chromatic", "--wavelengths", 5]
    for number, given in enumerate(
        (["--pupil", 2], ["--pupil", 2, "--chromatic"], spectral, ["--eye", folder / "eye.toml"])
    ):
        out = folder / str(number)
        succeed(folder / "picture.png", folder / "wall.npy", "--out", out, *given, "--focus", 1, "--field", 1)
        light.append(np.load(out / "blurred-1.0m.npy"))
    plain, chromatic, parts, aberrated = (one.std(axis=(0, 1)) for one in light)
    assert parts[2] < 0.9 * plain[2]
    assert chromatic[2] < 0.9 * plain[2]  # blue is out of focus where the eye is focused
    assert (aberrated < 0.95 * plain).all()


def test_the_size_of_a_pixel_comes_from_the_display_or_the_sensor(folder: Path) -> None:
    screen = ["--screen", "1000x800", "--screen-width", "40", "--distance", "0.8"]
    for given, minutes in ((screen, 0.4e-3 / 0.8), (["--pixel-pitch", "50"], 0.05 / 50)):
        succeed(folder / "picture.png", folder / "depth.npy", "--out", folder / "out", *LENS, "--focus", 1, *given)
        summary = json.loads((folder / "out" / "summary.json").read_text())
        assert summary["pictures"][0]["pixel_arcmin"] == pytest.approx(60 * np.degrees(minutes))


def test_folders_of_frames_go_on_where_they_were_cut_off(folder: Path) -> None:
    frames, depths, out = folder / "frames", folder / "depths", folder / "out"
    frames.mkdir()
    depths.mkdir()
    for number in range(3):
        cv2.imwrite(str(frames / f"{number}.png"), np.full((40, 40), 50 + number, np.uint8))
        np.save(depths / f"{number}.npy", np.full((40, 40), 2.0))
    arguments = (frames, depths, "--out", out, *LENS, "--focus", 1, "--field", 4)
    succeed(*arguments)
    assert len(list(out.iterdir())) == 8
    kept = (out / "0-1.0m.npy").stat().st_mtime_ns
    (out / "1-1.0m.npy").unlink()
    succeed(*arguments)
    assert (out / "0-1.0m.npy").stat().st_mtime_ns == kept
    assert np.load(out / "1-1.0m.npy").shape == (40, 40)
    result = run(frames, depths, "--out", out, "--f-number", 4, "--focal-length", 50, "--focus", 1, "--field", 4)
    assert result.exit_code == 2
    assert "other settings" in result.output


def test_each_frame_of_a_video_has_its_depth(folder: Path) -> None:
    random = np.random.default_rng(2)
    frames = [cv2.GaussianBlur(random.integers(0, 256, (40, 64), np.uint8), (0, 0), 2) for _ in range(3)]
    write_frames(folder / "clip.mkv", frames, 25.0)
    (folder / "depths").mkdir()
    for number, metres in enumerate((1.0, 1.5, 3.0)):
        np.save(folder / "depths" / f"{number}.npy", np.full((40, 64), metres))
    given = [folder / "clip.mkv", folder / "depths", "--out", folder / "out", *LENS, "--focus", 1, "--field", 4]
    result = succeed(*given)
    seen = [np.load(folder / "out" / f"clip-{number:06}-1.0m.npy") for number in range(3)]
    sharp = srgb_to_linear(frames[0] / 255)
    assert np.abs(seen[0].mean(axis=2) - sharp).max() < 0.03  # in focus; the file's colours are rounded
    detail = [np.abs(np.diff(one.mean(axis=2))).mean() for one in seen]
    assert detail[0] > detail[1] > detail[2]
    np.save(folder / "depths" / "3.npy", np.full((40, 64), 1.0))
    result = run(*given[:3], folder / "other", *given[4:])
    assert result.exit_code == 2
    assert "3 frames" in result.output
    for number in (2, 3):
        (folder / "depths" / f"{number}.npy").unlink()
    result = run(*given[:3], folder / "third", *given[4:])
    assert result.exit_code == 2
    assert "more frames" in result.output


def test_an_alpha_channel_may_hide_nothing(folder: Path) -> None:
    values = cv2.imread(str(folder / "picture.png"))
    given = (folder / "depth.npy", *LENS, "--focus", 1, "--field", 4, "--out")
    for name, least, code in (("opaque", 255, 0), ("transparent", 254, 2)):
        alpha = np.full(values.shape[:2], 255, np.uint8)
        alpha[5, 7] = least
        cv2.imwrite(str(folder / f"{name}.png"), np.dstack([values, alpha]))
        result = run(folder / f"{name}.png", *given, folder / name)
        assert result.exit_code == code, result.output
    assert "transparent.png is transparent in places" in result.output
    assert not (folder / "transparent").exists()


METRES = np.linspace(1, 3, 12).reshape(3, 4)


@pytest.mark.parametrize(
    ("name", "values", "options"),
    [
        ("d.npy", METRES, {}),
        ("d.npy", 1e3 * METRES, {"unit": "mm"}),
        ("d.npy", 1 / METRES, {"unit": "dioptres"}),
        ("d.npy", 0.2 / 1e-3 / METRES - 7, {"unit": "disparity", "baseline": 0.2, "pixel_angle": 1e-3, "offset": 7}),
        ("d.png", (1e4 * METRES).round().astype(np.uint16), {"scale": 1e-4}),
        ("d.tiff", METRES.astype(np.float32), {}),
        ("d.pfm", METRES.astype(np.float32), {}),
    ],
)
def test_depth_comes_in_many_files_and_units(tmp_path: Path, name: str, values: np.ndarray, options: dict) -> None:
    path = tmp_path / name
    if path.suffix == ".npy":
        np.save(path, values)
    else:
        cv2.imwrite(str(path), values)
    found = read_distances(path, **options)
    assert np.allclose(found.metres, METRES, rtol=1e-4)
    assert found.filled == 0


@pytest.mark.parametrize(
    ("values", "options", "said"),
    [
        (METRES, {"baseline": 0.2}, "baseline and offset are for disparity, but"),
        (
            (1e3 * METRES).astype(np.int32),
            {},
            "contains integers of type int32, but not what one step is: give unit mm if it is a millimetre",
        ),
        (
            (10 * METRES).astype(np.uint16),  # a median of 20 mm
            {"unit": "mm"},
            "give the scale, 1 if a step is one millimetre, or a file of floating-point",
        ),
        ((1e3 * METRES).astype(np.uint8), {"unit": "dioptres"}, "the scale, 1 if a step is one dioptre"),
        (1e-300 * METRES, {}, "they must be 1e-06 m or more: check the unit and the scale"),
    ],
)
def test_depth_that_would_silently_be_another_is_refused(
    tmp_path: Path, values: np.ndarray, options: dict, said: str
) -> None:
    np.save(tmp_path / "d.npy", values)
    with pytest.raises(InputError, match=said):
        read_distances(tmp_path / "d.npy", **options)


def test_plausible_integers_in_millimetres_need_no_scale(tmp_path: Path) -> None:
    path = tmp_path / "d.png"
    cv2.imwrite(str(path), (1e3 * METRES).astype(np.uint16))
    found = read_distances(path, "mm")  # the unit is stated: no warning
    assert np.allclose(found.metres, METRES, atol=1e-3)


def test_the_encoding_assumed_of_16_bits_is_stated(tmp_path: Path) -> None:
    path = tmp_path / "16.png"
    cv2.imwrite(str(path), (1e4 * METRES).astype(np.uint16))
    with pytest.warns(FocalGradientWarning, match="16.png does not state its encoding of light"):
        assert read_picture(path).encoding == "linear"
    assert read_picture(path, "srgb").encoding == "srgb"  # without a warning


@pytest.mark.parametrize("channels", [(), (3,)])
def test_a_picture_given_as_depth_is_named(tmp_path: Path, channels: tuple[int, ...]) -> None:
    light, depth = tmp_path / "light.png", tmp_path / "depth.npy"
    noise = np.random.default_rng(1).integers(0, 256, (*METRES.shape, *channels), np.uint8)
    Image.fromarray(noise).save(light)
    np.save(depth, METRES)
    said = command_line.sentence(run(depth, light, *LENS, "--focus", 1, "--field", 3, "--out", tmp_path / "out"))
    assert "light.png" in said
    assert "give the picture first, then its depth" in said
    assert not (tmp_path / "out").exists()


def test_exr_files_hold_pictures_and_depth(tmp_path: Path) -> None:
    exr = pytest.importorskip("OpenEXR", reason="the extra exr is not installed")
    header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage}
    colours = np.random.default_rng(2).random((5, 6, 3)).astype(np.float32)
    exr.File(dict(header), {"RGB": colours}).write(str(tmp_path / "c.exr"))
    exr.File(dict(header), {"Z": METRES.astype(np.float32)}).write(str(tmp_path / "z.exr"))
    assert np.allclose(read_picture(tmp_path / "c.exr").light, colours)
    assert np.allclose(read_distances(tmp_path / "z.exr").metres, METRES)
    alpha = np.ones((5, 6, 1), np.float32)
    exr.File(dict(header), {"RGBA": np.dstack([colours, alpha])}).write(str(tmp_path / "a.exr"))
    assert np.allclose(read_picture(tmp_path / "a.exr").light, colours)
    alpha[2, 3] = 0.5
    exr.File(dict(header), {"RGBA": np.dstack([colours, alpha])}).write(str(tmp_path / "a.exr"))
    with pytest.raises(InputError, match=r"a\.exr is transparent in places"):
        read_picture(tmp_path / "a.exr")


def test_another_colour_profile_is_warned_of(tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    for space in ("sRGB", "LAB"):
        profile = ImageCms.ImageCmsProfile(ImageCms.createProfile(space)).tobytes()
        Image.new("RGB", (3, 2), (90, 60, 30)).save(tmp_path / f"{space}.png", icc_profile=profile)
    read_picture(tmp_path / "sRGB.png")
    read_picture(tmp_path / "LAB.png", "linear")
    assert not recwarn.list
    with pytest.warns(match=r"LAB\.png has the colour profile Lab .*, but its colours are treated as sRGB: convert it"):
        read_picture(tmp_path / "LAB.png")


def test_holes_are_filled_from_the_farther_side_and_said(tmp_path: Path) -> None:
    depth = np.array([[1.0, np.nan, 0.0, 2.0], [np.nan, -1.0, 3.0, 3.0], [np.nan] * 4])
    np.save(tmp_path / "d.npy", depth)
    with pytest.warns(match="66.67% of the pixels have no depth"):
        found = read_distances(tmp_path / "d.npy")
    assert found.metres.tolist() == [[1, 2, 2, 2], [3, 3, 3, 3], [3, 3, 3, 3]]


def test_a_focus_out_of_an_eyes_reach_is_stated(folder: Path) -> None:
    """A myope of 2 D is focused at 0.51 m where 4 m is asked for, as the name, the summary and the note state."""
    given = [folder / "picture.png", folder / "depth.npy", "--refraction", "-2.00", "--age", 30, "--field", 1]
    result = succeed(*given, "--focus", 4, "--focus", 0.4, "--out", folder / "seen")
    assert {path.name for path in (folder / "seen").glob("*.png")} == {"blurred-0.512m.png", "blurred-0.4m.png"}
    summary = json.loads((folder / "seen" / "summary.json").read_text())
    far, near = summary["settings"]["eyes"]
    assert far["focus_m"] == pytest.approx(0.512, abs=0.001)
    assert (far["in_reach"], far["accommodation_D"], near["in_reach"]) == (False, 0.0, True)
    assert near["accommodation_D"] == pytest.approx(2.5 - 1 / 0.512, abs=0.01)
    assert summary["settings"]["pupil"] == pytest.approx(1e3 * float(natural_pupil(100.0, age=30)))
    assert any("cannot focus on 4 m: it is focused at 0.512 m" in words for words in summary["warnings"])
    assert "focused at 0.512 m, accommodates by 0.00 D, pupil 3.78 mm" in result.stdout
    refused = run(*given, "--focus", 4, "--focus", 2, "--out", folder / "twice")
    assert refused.exit_code == 2
    assert "both give focus at 0.512m" in refused.stderr


def test_a_flat_picture_needs_one_distance(folder: Path) -> None:
    np.save(folder / "flat.npy", np.full((48, 64), 2.0))
    for depth, out in ((folder / "flat.npy", "file"), (2.0, "number")):
        succeed(folder / "picture.png", depth, "--out", folder / out, *LENS, "--focus", 1, "--field", 6)
    light = [np.load(folder / out / "blurred-1.0m.npy") for out in ("file", "number")]
    np.testing.assert_array_equal(*light)
    given = ["--out", folder / "mm", *LENS, "--focus", 1, "--field", 6, "--depth-unit", "mm"]
    assert "leave out --depth-unit" in run(folder / "picture.png", 2000, *given).stderr


def test_the_meridians_of_an_astigmat_are_stated(folder: Path) -> None:
    given = [folder / "picture.png", folder / "depth.npy", "--refraction", "+1.00 -2.00 x 180", "--age", 70]
    result = succeed(*given, "--field", 1, "--pupil", 4, "--focus", 3, "--out", folder / "seen")
    meridians = "focused at 628 m (its meridians at -1.00 and 1.00 D)"
    assert f"cannot focus on 3 m: it is {meridians}, as" in result.stderr
    assert f"looks at 3 m, {meridians}, accommodates" in result.stdout
    facts = json.loads((folder / "seen" / "summary.json").read_text())["pictures"][0]
    largest, arcmin = facts["largest_blur_px"][0], facts["pixel_arcmin"]
    assert f"Blur: radius up to {largest:.3g} px ({largest * arcmin:.3g} arcmin) in the more" in result.stdout


def test_a_picture_in_focus_has_no_blur(folder: Path) -> None:
    np.save(folder / "flat.npy", np.full(np.load(folder / "depth.npy").shape, 3.0))
    given = [folder / "picture.png", folder / "flat.npy", "--pupil", 4, "--age", 30, "--refraction", "-2.00"]
    result = succeed(*given, "--correction", "spectacles", "--focus", 3, "--field", 1, "--out", folder / "seen")
    assert "Blur: radius up to 0 px (0 arcmin), " in result.stdout
