"""Mixed-up units are refused with the likely one, at the command line, in settings files and in Python; what is rare
but real is accepted."""

import math
import re
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_line import run, sentence
from two_views import TOML, picture, write

from focalgradient import DepthMap, Eye, FocalGradientWarning, InputError, Lens, View, cast, render_bands
from focalgradient.depth.search import Search
from focalgradient.display import Display
from focalgradient.eye import eye_views
from focalgradient.plausibility import picture_slip, too_near
from focalgradient.plotting import depth_figure
from focalgradient.scenes import plane

LENS = ("--focal-length", "25", "--pixel-pitch", "8", "--f-number", "16", "--f-number", "5.6")
INF = math.inf


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, stop in (("a.png", 16), ("b.png", 5.6)):
        write(tmp_path / name, picture(stop))
    np.save("metres.npy", np.linspace(0.6, 3.0, 96) * np.ones((96, 1)))
    (tmp_path / "views.toml").write_text(TOML)
    targets = TOML.replace("[[view]]", "[[view]]\ndistance_m = 0.5")
    (tmp_path / "targets.toml").write_text(targets)
    return tmp_path


def search(length: float, stops: tuple[float, ...], foci: tuple[float, ...], pitch: float, **limits: float) -> Search:
    lenses = [Lens(length, stop, focus) for stop in stops for focus in foci]
    return Search.over(lenses, pitch / lenses[0].sensor_distance, limits.get("near"), limits.get("far"))


RARE: dict[str, Callable[[], object]] = {
    "25 mm telecentric": lambda: search(0.025, (8.3,), (0.529, 0.869), 25e-6),
    "a standard lens": lambda: search(0.05, (4, 20), (1.0,), 5e-6),
    "a long lens at 800 m": lambda: search(0.6, (4, 16), (800.0,), 4e-6),
    "stars": lambda: search(0.5, (4, 8), (INF,), 4e-6),
    "a microscope's objective of 4 mm": lambda: search(0.004, (1.0, 2.0), (0.0042,), 1e-6, near=0.0042),
    "large format": lambda: search(0.3, (5.6, 45), (3.0,), 10e-6),
    "thermal pixels": lambda: search(0.1, (1.0, 2.0), (10.0,), 50e-6),
    "a wide frame": lambda: View(np.ones((100, 1920)), Lens(0.009, 5.6, 1.0), 1.0 / 1920 * 4.8),
}


@pytest.mark.parametrize("name", RARE)
def test_what_is_rare_but_real_is_accepted(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", FocalGradientWarning)
        RARE[name]()


@pytest.mark.parametrize("unit", [1e-2, 1e-3, 1.0])
def test_a_rendered_scene_may_have_any_unit_of_length(unit: float) -> None:
    """An office of which published parameters are in units of its scene: here centimetres, millimetres, metres."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FocalGradientWarning)  # 2.8 m is long, f/0.28 is wide
        found = search(2.8 * unit, (INF, 2.8 / 5, 2.8 / 10), (267 * unit,), 0.00625 * unit)
        View(np.ones((720, 1080)), Lens(2.8 * unit, 0.56, 267 * unit), 0.00625 / 2.8)
    assert found.slope * unit**-1 * unit == pytest.approx(10 * unit / 2 / (0.00625 / (1 / (1 / 2.8 - 1 / 267))))


A_LENS, WALL, FRAME, FLAT = Lens(0.025, 4, 1.0), plane(1.0), ((8, 8), 3e-4), np.ones((8, 8), np.float32)
MAP = DepthMap(FLAT, FLAT, FLAT > 0, FLAT > 0)
REFUSED: dict[str, tuple[Callable[[], object], str]] = {
    "focal length in mm": (lambda: Lens(25, 4, 1.0), r"focal_length is 25 m, .* 0\.025 for 25 mm"),
    "a diameter": (lambda: Lens(0.025, 0.0045, 1.0), "f_number is 0.0045, .* 5.56 for 0.0045 m"),
    "focus in km": (lambda: Lens(0.025, 4, 8e-4), "lies within the focal length 0.025 m"),
    "focus in cm": (lambda: search(0.025, (16, 5.6), (85,), 8e-6), r"focus_distance is 85 m, .* 0\.85 for 85 cm"),
    "focal length and f-number exchanged": (
        lambda: search(0.0056, (25, 25), (0.8,), 8e-6),
        r"focus_distance is 0\.8 m, .*; or focal_length and f_number are exchanged",
    ),
    "limits in mm": (
        lambda: search(0.025, (16, 5.6), (0.8,), 8e-6, near=900, far=2200),
        r"near is 900 m and far is 2200 m, .* 0\.9 for 900 mm",
    ),
    "pixels of a wide frame": (
        lambda: View(np.ones((9, 320)), Lens(0.025, 4, 1.0), 0.31),
        "320 pixels of 0.31 rad make a frame of 178 degrees",
    ),
    "display in cm": (lambda: Display(distance=57.0), r"at 57 m are .* 0\.57 for 57 cm"),
    "screen in dm": (lambda: Display.of_width(5.31), "width is 5.31 m, which at 0.57 m fills 156 degrees"),
    "wavelength in metres": (lambda: Eye(0.004, 1.0, 5.5e-7), "wavelength_nm is 5.5e-07, .* give it in nanometres"),
    "one lens for three": (lambda: render_bands(WALL, A_LENS, *FRAME), "optics is a Lens, but must be a list"),
    "an array for views": (lambda: depth_figure(FLAT, MAP), r"views is an array of shape \(8, 8\), but must be a list"),
    "eyes for cones": (lambda: eye_views(0.5, [Eye(0.004, 1.0)], *FRAME), "cones holds an Eye, but must hold Cones"),
    "no optics": (lambda: cast(WALL, "50 mm", *FRAME), "optics is '50 mm', but must be a Lens, an Eye"),
    "one side for two": (lambda: cast(WALL, A_LENS, 8, 3e-4), "shape is 8, but must be a positive height and width"),
}


@pytest.mark.parametrize("slip", REFUSED)
def test_a_slip_of_unit_is_refused_in_python(slip: str) -> None:
    call, said = REFUSED[slip]
    with pytest.raises(InputError, match=said) as caught:
        call()
    assert str(caught.value).endswith(".")
    assert "\n" not in str(caught.value)
    assert " --" not in str(caught.value)  # options are the command line's


COMMANDS = {
    "depth": ["a.png", "b.png", *LENS, "--focus-distance", "0.85"],
    "blur": [
        *("a.png", "metres.npy", "--focal-length", "25", "--f-number", "2.8", "--focus", "0.8", "--field", "6"),
        *("--encoding", "linear"),
    ],
}
SLIPS = {
    ("depth", "--focal-length", "0.025"): r"--focal-length is 0\.025 mm, .* 25 for 0\.025 m\.",
    ("depth", "--pixel-pitch", "0.008"): r"--pixel-pitch is 0\.008 um, .* 8 for 0\.008 mm\.",
    ("depth", "--focus-distance", "85"): r"--focus-distance is 85 m, .* 0\.85 for 85 cm",
    ("depth", "--sensor-to-pupil", "0.03"): r"--sensor-to-pupil is 0\.03, but must be a number of millimetres from 1",
    ("blur", "--focus", "80"): r"do not reach the focus at 80 m: most likely, --focus 80 is 0\.8 m in cm",
    ("blur", "--focal-length", "0.025"): r"--focal-length is 0\.025 mm, .* 25 for 0\.025 m\.",
    ("blur", "--f-number", "0.0089"): r"--f-number is 0\.0089, .* give focal length / diameter",
}


@pytest.mark.parametrize("slip", SLIPS)
def test_options_name_themselves_and_their_unit(folder: Path, slip: tuple[str, str, str]) -> None:
    command, option, value = slip
    words = [*COMMANDS[command], option, "none"][: None if option not in COMMANDS[command] else -2]
    words[words.index(option) + 1] = value
    assert re.search(SLIPS[slip], sentence(run(command, *words, "--out", "out")))
    assert not Path("out").exists()


VIEWS, TARGETS = "depth views.toml --out out", "calibrate targets.toml --out camera.toml"
KEYS = {
    ("focal_length_mm = 25.0", "focal_length_mm = 0.025"): r"focal_length_mm is 0\.025 mm, .* 25 for 0\.025 m\.",
    ("focus_distance_m = 0.85", "focus_distance_m = 850"): r"focus_distance_m is 850 m, .* 0\.85 for 850 mm",
    ("distance_m = 0.5", "distance_m = 500"): r"distance_m is 500 m, .* 0\.5 for 500 mm",
    ("[[view]]", "offset_sd_m = 20.0\n[[view]]"): r"offset_sd_m is 20 m, .* 0\.02 for 20 mm",
}


@pytest.mark.parametrize(
    ("command", "slip"), [*((VIEWS, slip) for slip in [*KEYS][:2]), *((TARGETS, slip) for slip in KEYS)]
)
def test_keys_of_settings_files_name_themselves(folder: Path, slip: tuple[str, str], command: str) -> None:
    for name in ("views.toml", "targets.toml"):
        Path(name).write_text(Path(name).read_text().replace(*slip, 1 if slip[0] == "[[view]]" else -1))
    assert re.search(KEYS[slip], sentence(run(*command.split())))


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "mm"), (1e2, "cm")])
def test_depth_in_another_unit_is_refused_unless_its_unit_is_stated(folder: Path, factor: float, unit: str) -> None:
    np.save("other.npy", factor * np.load("metres.npy"))
    words = ["blur", "a.png", "other.npy", "--out", "out", "--pupil", "4", "--focus", "0.8", "--field", "3"]
    words += ["--encoding", "linear"]
    said = sentence(run(*words))
    remedy = ": give --depth-unit mm" if unit == "mm" else ""
    assert f"most likely, these are 0.6 to 3 m in {unit}{remedy}. If all is correct, give --depth-unit m." in said
    stated = run(*words, "--depth-unit", "m")
    assert stated.exit_code == 0
    assert "most likely" in stated.stderr


def test_pupils_name_their_option_or_key(folder: Path) -> None:
    words = ["blur", "a.png", "metres.npy", "--out", "out", "--focus", "0.8", "--field", "3"]
    for value, given in (("0.004", "0.004 m"), ("4000", "4000 um")):
        done = run(*words, "--pupil", value)
        assert re.search(rf"Error: --pupil is {value} mm, but must be from 0\.1 to 9 mm: .* 4 for {given}", done.stderr)
    Path("eye.toml").write_text("pupil_mm = 0.004\n")
    assert re.search(r"eye\.toml: pupil_mm is 0\.004 mm, .* 4 for 0\.004 m", sentence(run(*words, "--eye", "eye.toml")))
    done = run(*words[:-2], "--field", "0.026", "--pupil", "4")
    assert re.search(r"--field is 0\.026 degrees, .* 1\.49 for 0\.026 radians", done.stderr)


def test_a_focus_hardly_short_of_infinity_is_warned_of() -> None:
    with pytest.warns(FocalGradientWarning, match=r"focus_distance is 800 m, .* 0\.8 for 800 mm, or inf"):
        search(0.05, (16, 2.8), (800,), 5e-6)


def test_distances_that_do_not_suit_their_focus_are_unlikely() -> None:
    """As where the focal length was given in centimetres."""
    assert "6.8 focal lengths" in (too_near(0.017, [(1.25, 0.0025), (0.6, 0.0025)]) or "")
    assert too_near(0.2, [(5.0, 0.1)]) is None  # macro, focused there
    assert too_near(0.5, [(0.0, 0.025)]) is None  # focused at infinity
    assert too_near(0.03, [(3.0, None)]) is None  # an eye
    for focus in (0.0, 0.4, 1.0, 2.0):
        assert picture_slip((0.5, 3.0), 0.009, focus, 3e-4, 320) is None
    assert picture_slip((0.5, 3.0), 0.0, 100.0, 3e-4, 320) is None  # a pinhole
    assert "wider than the picture" in (picture_slip((0.0005, 0.003), 0.009, 1.25, 3e-4, 320) or "")
