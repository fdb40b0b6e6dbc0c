"""Pictures of one's own made a set: read back as ours are, and wrong tables refused by row and column."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter

from focalgradient import FocalGradientWarning, InputError, Lens
from focalgradient.dataset import check_stimuli
from focalgradient.display import Display
from focalgradient.render import blur_picture
from focalgradient.stimuli import import_pictures, read_set

HEADER = "file,scene,aperture,fixation,depth,contrast\n"
ROWS = [
    "a.png,yard,pinhole,,yard.npy,1.0",
    "b.png,yard,f/8,nearest,yard.npy,1.0",
    "c.jpg,yard,f/8.0,farthest,yard.npy,0.5",
]


@pytest.fixture
def photos(tmp_path: Path) -> Path:
    folder = tmp_path / "photos"
    folder.mkdir()
    random = np.random.default_rng(0)
    for name in ("a.png", "b.png", "c.jpg"):
        Image.fromarray(random.integers(0, 256, (48, 64, 3), np.uint8)).save(folder / name)
    distance = np.full((48, 64), 2.0)
    distance[10:20, 10:30] = 1.0
    np.save(folder / "yard.npy", distance)
    (folder / "pictures.csv").write_text(HEADER + "\n".join(ROWS) + "\n", encoding="utf-8")
    return folder


def test_a_set_of_own_pictures_is_read_as_ours(photos: Path, tmp_path: Path) -> None:
    made = import_pictures(photos, photos / "pictures.csv", tmp_path / "set", display=Display(gamma=2.0))
    check_stimuli(made.folder)
    assert (made.scenes, len(made.pictures)) == (("yard",), 4)
    sharp = made.picture("yard", "pinhole", "farthest")
    original = np.asarray(Image.open(photos / "a.png"))
    assert (made.pixels(sharp) == original).all()
    np.testing.assert_allclose(made.linear(sharp), (original / 255) ** 2, atol=1e-6)
    assert sharp.png == made.picture("yard", "pinhole", "nearest").png
    assert made.picture("yard", "f/8", "nearest").aperture_mm == 6.25  # 50 mm / 8
    near = made.scene("yard").nearest
    assert near.distance_m == 1.0
    assert 10 < near.position_px[0] < 30
    assert 10 < near.position_px[1] < 20
    assert made.manifest["pictures"][-1]["further"] == {"contrast": "0.5"}
    light = [made.linear(made.picture("yard", *one)).mean() for one in (("f/8", "nearest"), ("pinhole", "nearest"))]
    stated = made.manifest["controls"]["scenes"]["yard"]["pictures"]["f8-nearest"]["mean_luminance_percent"]
    assert stated == pytest.approx(100 * (light[0] / light[1] - 1), abs=0.5)  # weights of colours apart


def blurred_series(folder: Path, focus: float) -> Path:
    """A slanted wall, sharp and at f/8 and f/2 in focus at its near end, but claimed to be in focus at `focus`."""
    random = np.random.default_rng(1)
    sharp = gaussian_filter(random.uniform(0.1, 0.9, (128, 160, 3)), (0.7, 0.7, 0)).astype(np.float32)
    distance = np.broadcast_to(1 / np.linspace(1, 0.5, 160), (128, 160))
    np.save(folder / "wall.npy", distance)
    display = Display()
    Image.fromarray(display.encode(sharp)).save(folder / "sharp.png")
    lines = [f"{HEADER.strip()},focus_m", "sharp.png,wall,pinhole,,wall.npy,1,"]
    angle = 2 * np.tan(np.radians(10) / 2) / 160
    for number in (8, 2):
        light = blur_picture(sharp, distance, Lens(0.05, number, 1.0), pixel_angle=angle)
        Image.fromarray(display.encode(np.clip(light, 0, 1))).save(folder / f"f{number}.png")
        lines.append(f"f{number}.png,wall,f/{number},nearest,wall.npy,1,{focus}")
    (folder / "series.csv").write_text("\n".join(lines) + "\n")
    return folder / "series.csv"


@pytest.mark.slow
def test_spectra_and_shifts_are_measured_where_the_field_is_known(photos: Path, tmp_path: Path) -> None:
    table = blurred_series(photos, 1.0)
    controls = import_pictures(photos, table, tmp_path / "right", field=np.radians(10)).manifest["controls"]
    assert set(controls) == {"scenes", "mean_luminance_percent", "shift_px", "spectrum_percent", "sharpest"}
    assert all(one["met"] for name, one in controls.items() if name != "scenes"), controls
    table = blurred_series(photos, 1.6)
    with pytest.raises(InputError, match=r"wall/f2-nearest is sharper than its blur allows, .*; or leave out .*field"):
        import_pictures(photos, table, tmp_path / "wrong", field=np.radians(10))
    assert set(import_pictures(photos, table, tmp_path / "plain").manifest["controls"]) == {
        "scenes",
        "mean_luminance_percent",
    }
    with pytest.raises(InputError, match="field"):
        import_pictures(photos, table, tmp_path / "none", field=0.0)


def test_pictures_are_never_written_over(photos: Path) -> None:
    """A set may be made where its pictures lie, unless one of its files would take the place of one of them."""
    (photos / "yard").mkdir()
    table = photos / "pictures.csv"
    for old, new in (("b.png", "yard/f8-nearest.png"), ("yard.npy", "yard/depth.npy")):
        (photos / old).rename(photos / new)
        text = table.read_text()
        table.write_text(text.replace(old, new))
        before = (photos / new).read_bytes()
        with pytest.raises(InputError, match=rf"{new} would be overwritten, but it is read"):
            import_pictures(photos, table, photos)
        assert (photos / new).read_bytes() == before
        assert not (photos / "manifest.json").exists()
        (photos / new).rename(photos / old)
        table.write_text(text)
    import_pictures(photos, table, photos)


def test_without_depth_marks_are_in_the_middle_and_said_so(photos: Path, tmp_path: Path) -> None:
    table = photos / "plain.csv"
    table.write_text("file;scene;aperture;fixation\na.png;x;pinhole;\nb.png;x;4;nearest\n", encoding="utf-8-sig")
    with pytest.warns(FocalGradientWarning, match="marks are put in the middle"):
        made = import_pictures(photos, table, tmp_path / "set")
    assert made.scene("x").nearest.position_px == (32, 24)
    assert np.isnan(made.picture("x", "f/4", "nearest").focus_m)
    with pytest.raises(InputError, match="no depth of 'x'"):
        read_set(made.folder).depth("x")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HEADER + "a.png,yard,f/0,nearest,,", "row 2, column aperture: is 'f/0'"),
        (HEADER + ROWS[0] + "\nb.png,yard,f/8,left side,,", "row 3, column fixation: is 'left side'"),
        (HEADER + "\n".join([*ROWS, ROWS[1]]), "row 5, columns scene, aperture and fixation: the same .* row 3"),
        (HEADER + "../a.png,yard,f/8,nearest,,", "row 2, column file is '..'"),
        ("file,scene,aperture,fixation,x_px,y_px\na.png,x,4,nearest,6,", "row 2, column y_px: is empty"),
    ],
)
def test_wrong_tables_are_refused_by_row_and_column(photos: Path, tmp_path: Path, text: str, said: str) -> None:
    (photos / "bad.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=said) as raised:
        import_pictures(photos, photos / "bad.csv", tmp_path / "set")
    assert "\n" not in str(raised.value)
    assert not (tmp_path / "set").exists()


def test_wrong_pictures_are_refused(photos: Path, tmp_path: Path) -> None:
    for values, said in (
        (np.zeros((48, 62, 3), np.uint8), "62 x 48 pixels, but those before it 64 x 48"),
        (np.zeros((48, 64, 4), np.uint8), "transparent"),
        (np.zeros((48, 64), np.uint16), "8-bit grey or RGB"),
    ):
        Image.fromarray(values).save(photos / "b.png")
        with pytest.raises(InputError, match=f"row 3, column file: b.png .*{said}"):
            import_pictures(photos, photos / "pictures.csv", tmp_path / "set")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(InputError, match="the display 32 x 32"):
            import_pictures(photos, photos / "pictures.csv", tmp_path / "set", display=Display((32, 32)))
