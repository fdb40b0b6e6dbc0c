import math
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image, ImageCms
from PIL.PngImagePlugin import PngInfo

from focalgradient import FocalGradientWarning, InputError
from focalgradient.cli.groups import GIVEN
from focalgradient.depth import DepthMap
from focalgradient.photographs import from_exif, load_settings, read_photograph, read_photographs, read_views
from focalgradient.photographs import srgb_to_linear as decode
from focalgradient.photographs.depths import PhotographedDepth
from focalgradient.plausibility import given_as

RNG = np.random.default_rng(7)
RGB16 = RNG.integers(0, 65000, (12, 16, 3), dtype=np.uint16)
RGB8 = RNG.integers(0, 250, (12, 16, 3), dtype=np.uint8)
REC709 = np.array([0.2126, 0.7152, 0.0722])


def write(path: Path, rgb: np.ndarray) -> Path:
    """Through OpenCV, which writes what Pillow cannot: 16-bit colour, floating point."""
    path.write_bytes(cv2.imencode(path.suffix, rgb[..., ::-1] if rgb.ndim == 3 else rgb)[1].tobytes())
    return path


# --- Encoding and luminance --------------------------------------------------------------------------------------


def test_luminance_is_formed_of_colour_decoded_by_the_standard(tmp_path):
    # IEC 61966-2-1; mid grey 0.5 and the knee from colour-science tables.
    np.testing.assert_allclose(
        decode([0.0, 0.04045, 0.2, 0.5, 0.735357, 1.0]), [0, 0.0031308, 0.0331048, 0.2140411, 0.5, 1], atol=1e-6
    )
    # Pure green at half the code value: decoding after mixing would give decode(0.7152 * 128 / 255) = 0.101.
    pixels = np.zeros((4, 6, 3), np.uint8)
    pixels[1, 2] = (0, 128, 0)
    luminance = read_photograph(write(tmp_path / "green.png", pixels)).luminance
    assert luminance.dtype == np.float32
    assert luminance[1, 2] == pytest.approx(0.7152 * 0.21586, rel=1e-4)
    assert luminance[0, 0] == 0


def test_16_bit_colour_keeps_its_depth_and_channel_order(tmp_path):
    for name in ("deep.png", "deep.tif"):
        photograph = read_photograph(write(tmp_path / name, RGB16))
        assert (photograph.encoding, photograph.pixel_type) == ("linear", "uint16")
        np.testing.assert_allclose(photograph.luminance, RGB16 / 65535 @ REC709, atol=1e-7)
        # 8 bits would leave errors of 1/512.
        assert np.unique(photograph.luminance).size == 12 * 16


@pytest.mark.parametrize(
    ("name", "pixels", "stated", "encoding", "expected"),
    [
        ("a.png", RGB8[..., 0], None, "srgb", decode(RGB8[..., 0] / 255)),
        ("a.png", RGB8[..., 0], "linear", "linear", RGB8[..., 0] / 255),
        ("a.tif", RGB8, None, "srgb", decode(RGB8 / 255) @ REC709),
        ("a.png", RGB16[..., 0], "srgb", "srgb", decode(RGB16[..., 0] / 65535)),
        ("a.tif", (RGB16 / 1e5).astype(np.float32), None, "linear", RGB16 / 1e5 @ REC709),
        ("a.tif", (RGB16[..., 0] / 1e5).astype(np.float32), None, "linear", RGB16[..., 0] / 1e5),
        ("a.png", np.dstack([RGB16, RGB16[..., :1]])[..., [2, 1, 0, 3]], None, "linear", RGB16 / 65535 @ REC709),
    ],
    ids=["grey8", "grey8-linear", "colour8-tiff", "grey16-srgb", "float-colour", "float-grey", "alpha"],
)
def test_formats_and_encodings(tmp_path, name, pixels, stated, encoding, expected):
    if pixels.shape[2:] == (4,):  # already in OpenCV's order
        (tmp_path / name).write_bytes(cv2.imencode(".png", pixels)[1].tobytes())
    else:
        write(tmp_path / name, pixels)
    photograph = read_photograph(tmp_path / name, stated)
    assert photograph.encoding == encoding
    np.testing.assert_allclose(photograph.luminance, expected, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize(
    ("pixels", "expected"),
    [
        (RGB8, decode(RGB8 / 255) @ REC709),
        (RGB16[..., 1] * 1e-3, RGB16[..., 1] * 1e-3),
        (RGB16, RGB16 / 65535 @ REC709),
    ],
)
def test_arrays_are_linear_but_of_8_bits(tmp_path, pixels, expected):
    np.save(tmp_path / "a.npy", pixels)
    read = read_photograph(tmp_path / "a.npy")
    np.testing.assert_allclose(read.luminance, expected, rtol=1e-5)
    assert read.assumed == (pixels.dtype == np.uint8)


@pytest.mark.parametrize("quality", [50, 85, 90])
def test_strong_compression_is_warned_of_with_its_quality(tmp_path, quality):
    Image.fromarray(RGB8 // 2 + 32).save(tmp_path / "a.jpg", quality=quality)
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always")
        read_photograph(tmp_path / "a.jpg")
    assert [f"about quality {quality}:" in str(one.message) for one in given] == ([True] if quality < 90 else [])


def _with_gamma(gamma: float) -> bytes:
    """A colour profile like that of sRGB, but with this gamma: type 0 of the curves that ICC.1 calls parametric."""
    profile = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    curve = b"para" + bytes(4) + (3).to_bytes(2) + bytes(2)
    assert curve in profile
    at = profile.index(curve) + len(curve)
    return profile.replace(curve + profile[at : at + 4], curve[:8] + bytes(4) + round(gamma * 65536).to_bytes(4))


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize(
    ("chunk", "profile", "expected"),
    [
        ((b"sRGB", bytes(1)), None, "srgb"),
        ((b"gAMA", (45455).to_bytes(4)), None, "srgb"),
        ((b"gAMA", (100000).to_bytes(4)), None, "linear"),
        (None, _with_gamma(2.2), "srgb"),
        (None, _with_gamma(1.0), "linear"),
    ],
)
def test_files_that_say_their_encoding_are_read_by_it(tmp_path, bits, chunk, profile, expected):
    pixels = RGB16[..., 0] if bits == 16 else RGB8[..., 0]
    word = PngInfo()
    if chunk:
        word.add(*chunk)
    Image.fromarray(pixels).save(tmp_path / "said.png", pnginfo=word, icc_profile=profile)
    read = read_photograph(tmp_path / "said.png")
    assert (read.encoding, read.assumed) == (expected, False)
    share = pixels / (2**bits - 1)
    np.testing.assert_allclose(read.luminance, decode(share) if expected == "srgb" else share, atol=1e-6)
    other = "linear" if expected == "srgb" else "srgb"
    assert read_photograph(tmp_path / "said.png", other).encoding == other  # who gives it knows better


def test_a_tone_curve_that_is_neither_is_warned_of(tmp_path):
    Image.fromarray(RGB16[..., 0]).save(tmp_path / "16.tif", icc_profile=_with_gamma(1.8))
    with pytest.warns(FocalGradientWarning, match="tone curve is neither sRGB nor linear; it is treated as srgb"):
        assert read_photograph(tmp_path / "16.tif").encoding == "srgb"
    Image.fromarray(RGB16[..., 0]).save(tmp_path / "none.tif")
    silent = read_photograph(tmp_path / "none.tif")
    assert (silent.encoding, silent.assumed) == ("linear", True)


def test_views_of_unequal_encodings_are_warned_of(tmp_path):
    paths = tmp_path / "deep.png", tmp_path / "flat.png"
    for path, pixels in zip(paths, (RGB16[..., 0], RGB8[..., 0]), strict=True):
        Image.fromarray(pixels).save(path)
    with pytest.warns(FocalGradientWarning, match=r"deep.png \(uint16\) is assumed to be linear, but .* sRGB"):
        read_photographs(paths)
    read_photographs(paths, "srgb")  # without a warning
    Image.fromarray(RGB16[..., 0]).save(paths[0], icc_profile=_with_gamma(1.0))
    with pytest.warns(FocalGradientWarning, match=r"deep.png \(uint16\) is linear, but"):
        read_photographs(paths)


@pytest.mark.parametrize("suffix", ["jpg", "tif"])
def test_orientation_is_obeyed_alike_in_every_format(tmp_path, suffix):
    upright = np.zeros((16, 32), np.uint8)
    upright[:, 16:] = 200
    exif = Image.Exif()
    exif[0x0112] = 6  # stored turned: to be shown, turn it clockwise
    Image.fromarray(np.rot90(upright)).save(
        tmp_path / f"turned.{suffix}", exif=exif, **({"quality": 100} if suffix == "jpg" else {})
    )
    luminance = read_photograph(tmp_path / f"turned.{suffix}", "linear").luminance
    np.testing.assert_allclose(luminance, upright / 255, atol=0.02)


def test_saturated_pixels_are_counted_and_said(tmp_path):
    pixels = RGB8.copy()
    pixels[:3, :, 2] = 255  # one channel is enough
    with pytest.warns(FocalGradientWarning, match=r"a\.png: 25\.0% of the pixels are saturated"):
        photograph = read_photograph(write(tmp_path / "a.png", pixels))
    assert photograph.saturated == 0.25
    assert photograph.mask is not None
    np.testing.assert_array_equal(photograph.mask, np.arange(12)[:, None] * np.ones(16) >= 3)
    assert read_photograph(write(tmp_path / "b.png", RGB8 // 2)).mask is None


def test_data_of_12_bits_saturate_below_the_maximum_of_their_type(tmp_path):
    light = np.random.default_rng(0).normal(3900, 1000, (64, 80))
    clipped = np.clip(light, 0, 4095).astype(np.uint16)
    share = float((clipped == 4095).mean())
    assert share > 0.4
    for name, shift in (("low", 0), ("high", 4)):
        with pytest.warns(FocalGradientWarning, match="of the pixels are saturated"):
            photograph = read_photograph(write(tmp_path / f"{name}.png", clipped << shift))
        assert photograph.saturated == pytest.approx(share)
    assert read_photograph(write(tmp_path / "free.png", light.clip(0).astype(np.uint16))).saturated == 0


def test_bad_pixels_are_masked_and_filled_from_beside(tmp_path):
    pixels = RGB16 / 65535
    pixels[4, 5, 1], pixels[0, 0] = np.nan, -np.inf
    np.save(tmp_path / "a.npy", pixels)
    with pytest.warns(FocalGradientWarning, match=r"a\.npy: 2 pixels are NaN or infinite and are excluded"):
        photograph = read_photograph(tmp_path / "a.npy")
    assert photograph.mask is not None
    assert np.argwhere(~photograph.mask).tolist() == [[0, 0], [4, 5]]
    beside = photograph.luminance[[3, 5, 4, 4], [5, 5, 4, 6]]
    assert photograph.luminance[4, 5] in beside
    assert photograph.saturated == 0


@pytest.mark.parametrize("deep", [False, True])
def test_transparent_pixels_are_masked(tmp_path, deep):
    colours = RGB16 if deep else RGB8
    alpha = np.full(colours.shape[:2], np.iinfo(colours.dtype).max, colours.dtype)
    alpha[:3], alpha[5, 5] = 0, alpha[-1, -1] // 2  # a soft rim still shows the scene
    for name in ("a.png", "a.tif"):
        (tmp_path / name).write_bytes(cv2.imencode(name[1:], np.dstack([colours, alpha]))[1].tobytes())
        with pytest.warns(
            FocalGradientWarning, match=rf"{name}: 25\.0% of the pixels are transparent and are excluded"
        ):
            photograph = read_photograph(tmp_path / name)
        assert photograph.mask is not None
        np.testing.assert_array_equal(photograph.mask, np.arange(12)[:, None] * np.ones(16) >= 3)
    alpha[:7] = 0
    (tmp_path / "a.png").write_bytes(cv2.imencode(".png", np.dstack([colours, alpha]))[1].tobytes())
    with pytest.raises(InputError, match=r"a\.png is transparent over 58% of its pixels, .*: crop it"):
        read_photograph(tmp_path / "a.png")
    hidden = cv2.imencode(".png", np.dstack([colours, np.zeros_like(alpha)]))[1].tobytes()
    (tmp_path / "b.png").write_bytes(hidden)
    assert read_photograph(tmp_path / "b.png").mask is None


def test_the_mask_travels_to_the_view(tmp_path):
    images = [np.random.default_rng(n).uniform(0.2, 0.8, (48, 64)) for n in (0, 1)]
    images[1][10:13, 20:25] = np.nan
    for n, image in enumerate(images):
        np.save(tmp_path / f"{n}.npy", image)
    shot = '[[view]]\nimage = "{n}.npy"\nf_number = {f}\nfocus_distance_m = 0.8\n'
    (tmp_path / "v.toml").write_text(
        "[camera]\nfocal_length_mm = 25\npixel_pitch_um = 8\n" + shot.format(n=0, f=16) + shot.format(n=1, f=4)
    )
    with pytest.warns(FocalGradientWarning, match="15 pixels are NaN"):
        sharp, wide = read_views(tmp_path / "v.toml")
    assert sharp.mask is None
    np.testing.assert_array_equal(wide.mask, np.isfinite(images[1]))


@pytest.mark.parametrize("kind", ["jpg", "png", "tif", "npy"])
def test_truncated_files_are_refused_in_silence(tmp_path, kind, capfd):
    whole = tmp_path / f"whole.{kind}"
    if kind == "npy":
        np.save(whole, RGB16)
    else:
        write(whole, np.kron(RGB8, np.ones((8, 8, 1), np.uint8)))
    cut = tmp_path / f"cut.{kind}"
    cut.write_bytes(whole.read_bytes()[:-300])
    with pytest.raises(InputError, match=rf"cut\.{kind} cannot be read as an image"):
        read_photograph(cut)
    assert capfd.readouterr() == ("", "")


# --- Settings ----------------------------------------------------------------------------------------------------

TOML = """
[camera]
focal_length_mm = 25
pixel_pitch_um = 8.0
{camera}
[[view]]
image = "near.png"
f_number = 8
focus_distance_m = 0.8
[[view]]
image = "sub/far.png"
f_number = inf
focus_distance_m = 1.25
"""


def test_telecentric_views_share_the_pixel_angle(tmp_path):
    (tmp_path / "views.toml").write_text(TOML.format(camera='telecentric = true\nencoding = "srgb"\nblur_k = 0.7'))
    settings = load_settings(tmp_path / "views.toml")
    # Image-side telecentric: pitch / focal length in every view, 8 um / 25 mm.
    assert settings.pixel_angles() == pytest.approx([320.0e-6, 320.0e-6])
    assert (settings.camera.encoding, settings.camera.blur_k) == ("srgb", 0.7)


# --- EXIF --------------------------------------------------------------------------------------------------------

FOCAL_LENGTH, F_NUMBER, DISTANCE, PER_UNIT, UNIT, WIDTH, HEIGHT = 37386, 33437, 37382, 41486, 41488, 40962, 40963
WHOLE = {FOCAL_LENGTH: 18.0, F_NUMBER: 10.0, DISTANCE: 0.25, PER_UNIT: 5080.0, UNIT: 2}  # 25400 um / 5080 = 5 um


def with_exif(path: Path, tags: dict[int, float]) -> Path:
    exif = Image.Exif()
    exif.get_ifd(0x8769).update(tags)
    Image.fromarray(np.kron(RGB8, np.ones((8, 8, 1), np.uint8))).save(path, exif=exif)  # 128 x 96
    return path


def test_exif_tells_the_optics(tmp_path):
    files = [with_exif(tmp_path / "a.jpg", WHOLE), with_exif(tmp_path / "b.jpg", WHOLE | {F_NUMBER: 2.8})]
    settings = from_exif(files)
    assert settings.camera.focal_length_mm == 18.0
    assert settings.camera.pixel_pitch_um == pytest.approx(5.0)
    assert [shot.f_number for shot in settings.shots] == pytest.approx([10.0, 2.8])
    assert [shot.focus_distance_m for shot in settings.shots] == pytest.approx([0.25, 0.25])
    assert [shot.image for shot in settings.shots] == files


@pytest.mark.parametrize(
    ("tags", "pitch"),
    [
        ({UNIT: 3, PER_UNIT: 2000.0}, 5.0),
        ({UNIT: 4, PER_UNIT: 200.0}, 5.0),
        ({WIDTH: 512, HEIGHT: 384}, 20.0),  # stored at a quarter of its width: four sensor pixels to one
        ({WIDTH: 128, HEIGHT: 96}, 5.0),
        ({WIDTH: 511, HEIGHT: 385}, 5.0 * 511 / 128),  # rounded when it was resized
    ],
)
def test_pixel_pitch_by_unit_and_resizing(tmp_path, tags, pitch):
    files = [with_exif(tmp_path / name, WHOLE | tags) for name in ("a.jpg", "b.jpg")]
    assert from_exif(files).camera.pixel_pitch_um == pytest.approx(pitch)


def test_pixel_pitch_follows_from_the_35_mm_equivalent_with_a_warning(tmp_path):
    """A phone: 4.25 mm is 26 mm of a full frame, so that its sensor has a diagonal of 7.07 mm."""
    tags = {FOCAL_LENGTH: 4.25, F_NUMBER: 1.8, DISTANCE: 0.5, 41989: 26}
    files = [with_exif(tmp_path / name, tags) for name in ("a.jpg", "b.jpg")]
    with (
        given_as(GIVEN),
        pytest.warns(FocalGradientWarning, match="35-mm equivalent .* give --pixel-pitch if it is known"),
    ):
        settings = from_exif(files, focus_distances_m=(0.5, 0.7))
    assert settings.camera.pixel_pitch_um == pytest.approx(1e3 * 43.267 * 4.25 / 26 / 160, rel=1e-4)
    tags |= {PER_UNIT: 5080.0, WIDTH: 500, HEIGHT: 96}
    cropped = [with_exif(tmp_path / name, tags) for name in ("c.jpg", "d.jpg")]
    with pytest.raises(InputError, match="pixel pitch"):
        from_exif(cropped, focus_distances_m=(0.5, 0.7))


def test_options_go_before_exif(tmp_path):
    files = [with_exif(tmp_path / name, WHOLE) for name in ("a.jpg", "b.jpg")]
    settings = from_exif(
        files, focal_length_mm=50.0, f_numbers=(16, 4), focus_distances_m=(1, math.inf), pixel_pitch_um=2.0
    )
    assert (settings.camera.focal_length_mm, settings.camera.pixel_pitch_um) == (50.0, 2.0)
    assert [(shot.f_number, shot.focus_distance_m) for shot in settings.shots] == [(16, 1), (4, math.inf)]


@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        ({FOCAL_LENGTH: 0.0}, {FOCAL_LENGTH: 0.0}, r"give the focal length in mm: give focal_length_mm\."),
        ({}, {F_NUMBER: 0.0}, r"give the f-number \(of b\.jpg\): give f_numbers"),
        ({DISTANCE: 0.0}, {DISTANCE: 0.0}, r"give the distance of focus in m: give focus_distances_m"),
        ({UNIT: 1}, {UNIT: 1}, r"give the pixel pitch in um: give pixel_pitch_um\."),
        # Cropped: width and height have shrunk unequally.
        ({WIDTH: 4752, HEIGHT: 3168}, {WIDTH: 4752, HEIGHT: 3168}, r"pixel pitch in um: give pixel_pitch_um\."),
        ({}, {FOCAL_LENGTH: 55.0}, r"focal length in mm of 18 for a\.jpg but 55 for b\.jpg.*focal_length_mm"),
    ],
)
def test_what_exif_lacks_is_named_with_its_parameter(tmp_path, first, second, said):
    files = [with_exif(tmp_path / "a.jpg", WHOLE | first), with_exif(tmp_path / "b.jpg", WHOLE | second)]
    with pytest.raises(InputError, match=said):
        from_exif(files)


def test_sizes_must_agree(tmp_path):
    files = [write(tmp_path / "a.png", RGB16), write(tmp_path / "b.png", RGB16[:-1])]
    with pytest.raises(InputError, match=r"a\.png is 16 x 12 pixels but .*b\.png is 16 x 11"):
        read_photographs(files)


def test_settings_become_views(tmp_path):
    (tmp_path / "sub").mkdir()
    write(tmp_path / "near.png", RGB16)
    write(tmp_path / "sub" / "far.png", RGB16[::-1])
    (tmp_path / "views.toml").write_text(TOML.format(camera=""))
    near, far = read_views(tmp_path / "views.toml")
    assert (near.optics.focal_length, near.optics.f_number, near.optics.focus_distance) == (0.025, 8.0, 0.8)
    assert (far.optics.aperture_diameter, far.optics.focus_distance) == (0.0, 1.25)
    # By hand: 1/v0 = 1/0.025 - 1/0.8 = 38.75, so 8 um / v0 = 310 urad; at 1.25 m 39.2, 313.6 urad.
    assert near.pixel_angle == pytest.approx(310.0e-6)
    assert far.pixel_angle == pytest.approx(313.6e-6)
    np.testing.assert_array_equal(near.image, far.image[::-1])


@pytest.mark.parametrize(
    ("valid", "first"),
    [(0, "No pixel is valid: there is no median distance"), (1, "(of 1 valid pixel only)"), (100, "from the sensor")],
)
def test_a_summary_states_of_how_few_pixels_its_median_is(valid: int, first: str) -> None:
    """A median of 1 in 10,000 pixels is printed beside 0.0 % valid."""
    is_valid = np.arange(10_000).reshape(100, 100) < valid
    medians = dict.fromkeys(("distance_m", "vergence_sd_dioptres", "common_sd_dioptres", "distance_sd_m"), math.nan)
    depth = SimpleNamespace(valid=is_valid, details={})
    settings = SimpleNamespace(relative=False, plane="the sensor")
    made: Any = SimpleNamespace(depth=depth, medians=medians | {"distance_m": 1.5}, settings=settings, views=())
    assert PhotographedDepth.summary(made).endswith(first)


@pytest.mark.parametrize(
    ("sd", "end"),
    [
        (0.1, "total 0.041 m"),
        (0.42, "total 0.42 D: distance 0.42 m to 1.36 m (95 %)"),
        (1.0, "total 1 D: distance 0.284 m to infinity (95 %)"),
    ],
)
def test_a_large_total_sd_is_stated_as_the_range_of_distance(sd: float, end: str) -> None:
    """By hand: 1 / 0.641 = 1.560 D, +- 1.96 x 0.42 D: 1 / 2.383 and 1 / 0.737 m, symmetric in dioptres only."""
    shape = 4, 5
    depth = DepthMap(np.full(shape, 1 / 0.641), np.full(shape, sd), np.ones(shape, bool), np.ones(shape, bool), {})
    settings: Any = SimpleNamespace(relative=False, plane="the sensor")
    assert PhotographedDepth(depth, settings, (), (), {}).summary().endswith(end)
