"""The command, end to end on small pictures, and all that can be wrong with what it is given."""

import json
import os
import re
import signal
import time
import warnings
from pathlib import Path

import click
import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from interrupts import interruptible
from PIL import Image
from two_views import DISTANCE, TOML, run, sentence, write

import focalgradient
from focalgradient import DepthMap, FocalGradientWarning, InputError, memory, termination
from focalgradient.cli.program import write_set
from focalgradient.photographs import depths

# --- What it does ------------------------------------------------------------------------------------------------


def test_views_in_depth_out(folder):
    result = run("depth", "views.toml", "--out", "new/out", "--near", "0.9", "--far", "4", "--psf", "gaussian")
    assert result.exit_code == 0, result.output
    out = folder / "new" / "out"
    assert sorted(path.name for path in out.iterdir()) == ["depth.npz", "depth.png", "summary.json"]
    with np.load(out / "depth.npz") as arrays:
        assert {arrays[name].shape for name in ("distance", "vergence", "vergence_sd", "valid")} == {(96, 96)}
        median = float(np.median(arrays["distance"][arrays["valid"]]))
    assert median == pytest.approx(DISTANCE, rel=0.02)
    with Image.open(out / "depth.png") as figure:
        assert figure.size[0] > 400
    summary = json.loads((out / "summary.json").read_text(), parse_constant=pytest.fail)
    assert summary["medians"]["distance_m"] == pytest.approx(median)
    assert summary["share_valid"] > 0.5
    assert [view["f_number"] for view in summary["settings"]["views"]] == [16, 5.6]
    assert summary["versions"]["focalgradient"] == focalgradient.__version__
    assert 0 < summary["seconds"] < 600
    assert f"{median:.4g} m" in result.stdout
    assert sorted(path.name for path in folder.iterdir()) == ["a.png", "b.png", "new", "views.toml"]


def test_photographs_without_a_settings_file(folder, pictures):
    for name, pixels in pictures.items():
        exif = Image.Exif()
        exif.get_ifd(0x8769).update({37386: 25.0, 41486: 1250.0, 41488: 3})  # 1250 per cm: 8 um
        grey = Image.fromarray((pixels >> 8).astype(np.uint8))
        grey.save(folder / name.replace("png", "jpg"), quality=98, exif=exif)
    optics = ["--f-number", "16", "--f-number", "5.6", "--focus-distance", "0.85", "--focus-distance", "0.85"]
    limits = ["--near", "0.9", "--far", "4", "--psf", "gaussian", "--encoding", "linear"]
    result = run("depth", "a.jpg", "b.jpg", "--out", "out", *optics, *limits)
    assert result.exit_code == 0, result.output
    summary = json.loads((folder / "out" / "summary.json").read_text())
    assert summary["settings"]["camera"]["pixel_pitch_um"] == pytest.approx(8.0)
    assert summary["medians"]["distance_m"] == pytest.approx(DISTANCE, rel=0.02)


def test_results_replace_earlier_ones(folder):
    for far in ("3", "4"):
        assert run("depth", "views.toml", "--out", "out", "--near", "0.9", "--far", far).exit_code == 0
    assert json.loads((folder / "out" / "summary.json").read_text())["settings"]["far_m"] == 4
    assert len(list((folder / "out").iterdir())) == 3


def test_results_of_an_earlier_run_that_remain_are_named(tmp_path):
    """A folder may keep another set's files; they must not be taken for this set's."""

    @click.command("draw")
    @click.argument("names", nargs=-1)
    def draw(names: tuple[str, ...]) -> None:
        write_set(tmp_path, dict.fromkeys(names, b"{}\n"), names[-1])

    def said(*names: str) -> str:
        return CliRunner().invoke(draw, names).stderr

    (tmp_path / "own.json").write_text("{}")
    assert said("a.json", "b.json", "c.json", "d.json", "summary.json") == ""
    assert said("a.json", "b.json", "c.json", "d.json", "summary.json") == ""
    note = f"Note: {tmp_path} also contains results of an earlier run: "
    assert said("summary.json") == f"{note}a.json, b.json, c.json and others.\n"
    assert said("a.json", "b.json", "summary.json") == f"{note}c.json, d.json.\n"


def fake_depth(details: dict, valid: bool = True):
    """A stand-in for recover_depth, for what the command does with awkward results."""

    def recover(views, **_):
        ok = np.full(views[0].shape, valid)
        vergence = np.linspace(0.5, 0.6, ok.size).reshape(ok.shape)
        warnings.warn("the side\nis open", FocalGradientWarning, stacklevel=1)
        return DepthMap(vergence, 0.01 * vergence, ok, ok, details)

    return recover


def test_summary_is_strict_json_and_keeps_the_warnings(folder, monkeypatch):
    (folder / "views.toml").write_text(TOML.replace("5.6", "inf"))
    details = {
        "noise": [float("nan"), np.float32(0.5)],
        "reach": np.array([1.0, np.inf]),
        "rejected": "noise hides all (align=True)",
    }
    monkeypatch.setattr(depths, "recover_depth", fake_depth(details, valid=False))
    monkeypatch.setattr(DepthMap, "save", lambda self, path: path.touch())
    draw, drawn = focalgradient.plotting.depth_figure, []

    def drawing(*views, **how):
        drawn.append(draw(*views, **how))
        return drawn[0]

    monkeypatch.setattr(focalgradient.plotting, "depth_figure", drawing)
    result = run("depth", "views.toml", "--out", "out")
    assert result.exit_code == 1, result.output
    words = [text.get_text().replace("\n", " ") for ax in drawn[0].axes for text in ax.texts]
    assert "No depth: most likely because noise hides all (--align)." in words
    assert result.stdout.splitlines()[-1] == "No depth: most likely because noise hides all (--align)."
    assert [line[:9] for line in result.stderr.splitlines()] == ["Warning: "]
    summary = json.loads((folder / "out" / "summary.json").read_text(), parse_constant=pytest.fail)
    assert summary["settings"]["views"][1]["f_number"] == "inf"
    assert summary["details"] == details | {"noise": [None, 0.5], "reach": [1.0, "inf"]}
    assert summary["medians"]["distance_m"] is None
    assert summary["warnings"][0] == "the side\nis open"


@pytest.mark.parametrize(
    ("number", "raised"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, termination.Terminated)]
)
@interruptible()
def test_a_signal_in_a_destructor_is_not_lost(number, raised):
    class Odd:
        def __del__(self):
            signal.raise_signal(number)

    def work():
        Odd()
        time.sleep(20)

    start = time.monotonic()
    with termination.terminable(), pytest.raises(raised):
        work()
    assert time.monotonic() - start < 15  # the sleep is cut short


@pytest.mark.parametrize(("broken", "code"), [(KeyboardInterrupt, 130), (OSError(28, "No space left"), 2)])
def test_nothing_is_half_written(folder, monkeypatch, broken, code):
    def save(self, path):
        path.write_bytes(b"half")
        raise broken

    monkeypatch.setattr(depths, "recover_depth", fake_depth({"psf": "disc", "k": 0.5}))
    monkeypatch.setattr(DepthMap, "save", save)
    before = sorted(folder.rglob("*"))
    result = run("depth", "views.toml", "--out", "out")
    assert result.exit_code == code
    assert "Traceback" not in result.stderr
    assert sorted(folder.rglob("*")) == before


def test_images_too_large_for_the_memory_are_refused_before_the_work(folder, monkeypatch):
    monkeypatch.setattr(depths, "recover_depth", lambda *_, **__: pytest.fail("began"))
    monkeypatch.setattr(memory, "available", lambda: 100_000)
    assert "of memory, but 0.0 GB are available: crop" in sentence(run("depth", *SETTINGS))
    monkeypatch.setattr(memory, "available", lambda: None)
    with Image.new("L", (20_000, 20_000)) as huge:
        huge.save(folder / "b.png")
    assert "b.png has more than 179 million pixels" in sentence(run("depth", *SETTINGS))


def test_help_and_version():
    assert run("--version").stdout == f"focalgradient {focalgradient.__version__}\n"
    said = run("depth", "--help").stdout
    assert "focal_length_mm = 25.0" in said
    assert "--focus-distance" in said


# --- What it refuses ---------------------------------------------------------------------------------------------

SETTINGS = ("views.toml", "--out", "out")
PHOTOGRAPHS = ("a.png", "b.png", "--out", "out")


def edit(old: str, new: str):
    def apply(folder: Path) -> None:
        assert old in TOML
        (folder / "views.toml").write_text(TOML.replace(old, new, 1))

    return apply


def content(name: str, data: bytes):
    return lambda folder: (folder / name).write_bytes(data)


def pixels(name: str, change):
    def apply(folder: Path) -> None:
        image = cv2.imread(str(folder / "b.png"), cv2.IMREAD_UNCHANGED)
        write(folder / name, change(image))

    return apply


def array(change):
    def apply(folder: Path) -> None:
        image = cv2.imread(str(folder / "b.png"), cv2.IMREAD_UNCHANGED).astype(float)
        np.save(folder / "b.npy", change(image))
        edit("b.png", "b.npy")(folder)

    return apply


def poke(value: float):
    def change(image: np.ndarray) -> np.ndarray:
        image[:60] = value
        return image

    return array(change)


BAD = {
    # files
    "no settings file": (None, ("none.toml", "--out", "out"), r"none\.toml cannot be read \(No such file"),
    "settings is a folder": (
        lambda f: (f / "d.toml").mkdir(),
        ("d.toml", "--out", "out"),
        r"d\.toml is a folder: give the path of a settings",
    ),
    "no image": (lambda f: (f / "b.png").unlink(), SETTINGS, r"b\.png cannot be read \(No such file"),
    "empty image": (content("b.png", b""), SETTINGS, r"b\.png is empty"),
    "damaged image": (
        content("b.png", b"\x89PNG\r\n\x1a\n" + b"x" * 99),
        SETTINGS,
        r"b\.png cannot be read as an image",
    ),
    "sizes differ": (pixels("b.png", lambda p: p[:-2]), SETTINGS, r"a\.png is 96 x 96 pixels but b\.png is 96 x 94"),
    "black": (pixels("b.png", lambda p: 0 * p), SETTINGS, r"b\.png is black"),
    "nearly black": (pixels("b.png", lambda p: (p >> 15).astype(np.uint8)), SETTINGS, r"b\.png is black"),
    "saturated": (pixels("b.png", lambda p: np.where(p > 2**14, 2**16 - 1, p)), SETTINGS, r"b\.png is saturated: \d+%"),
    "NaN": (poke(np.nan), SETTINGS, r"b\.npy contains 5760 pixels that are NaN or infinite \(62%\)"),
    "values beyond single precision": (
        poke(1e38),
        SETTINGS,
        r"b\.npy contains values from .* to 1e\+38, but the bright",
    ),
    "a torn array": (
        lambda f: (edit("b.png", "b.npy")(f), (f / "b.npy").write_bytes(b"PK\x03\x04" + b"x" * 99)),
        SETTINGS,
        r"b\.npy cannot be read as an image: expected an array that numpy\.save wrote",
    ),
    "array of a wrong shape": (
        array(lambda p: p[None]),
        SETTINGS,
        r"b\.npy: its shape is \(1, 96, 96\), but must be H x W",
    ),
    "pickled array": (array(lambda p: p.astype(object)), SETTINGS, r"b\.npy cannot be read as an image"),
    "results over an image": (
        lambda f: ((f / "depth.png").write_bytes((f / "b.png").read_bytes()), edit("b.png", "depth.png")(f)),
        ("views.toml", "--out", "."),
        r"depth\.png would be overwritten, but it is read",
    ),
    "results over a photograph": (
        lambda f: ((f / "in").mkdir(), (f / "b.png").rename(f / "in" / "depth.png")),
        ("a.png", "in/depth.png", "--out", "in"),
        r"in/depth\.png would be overwritten, but it is read",
    ),
    "results over an image behind a link": (
        lambda f: ((f / "in").mkdir(), (f / "in" / "depth.png").symlink_to(f / "b.png")),
        ("views.toml", "--out", "in"),
        r"in/depth\.png would be overwritten, but it is read \(b\.png\)",
    ),
    "results of one frame over an image of the next": (
        lambda f: (
            (f / "out" / "first").mkdir(parents=True),
            (f / "first.toml").write_text(TOML),
            (f / "b.png").rename(f / "out" / "first" / "depth.png"),
            edit("b.png", "out/first/depth.png")(f),
        ),
        ("first.toml", *SETTINGS),
        r"out/first/depth\.png would be overwritten, but it is read",
    ),
    # settings
    "not TOML": (edit("= 25.0", "25.0"), SETTINGS, r"views\.toml is not valid TOML: .*line 2"),
    "backslash": (edit("a.png", "C:\\Users\\a.png"), SETTINGS, r"views\.toml is not valid TOML: .*write \\ as /"),
    "empty settings": (content("views.toml", b""), SETTINGS, r"camera \(a table \[camera\].* are missing: give them"),
    "missing key": (
        edit("pixel_pitch_um = 8.0\n", ""),
        SETTINGS,
        r"camera: pixel_pitch_um is missing: give a positive",
    ),
    "unknown key": (
        edit("[camera]", "[camera]\nlens = 1"),
        SETTINGS,
        r"camera: lens is not a known key: use focal_len",
    ),
    "misspelt key of a view": (edit("f_number = 5.6", "fnumber = 5.6"), SETTINGS, r"view 2: fnumber .*mean f_number\?"),
    "text for a number": (
        edit("= 5.6", '= "5.6"'),
        SETTINGS,
        r"view 2: f_number is '5\.6', but must be a positive number",
    ),
    "truth for a number": (
        edit("= 25.0", "= true"),
        SETTINGS,
        r"focal_length_mm is true, but must be a positive number",
    ),
    "unknown encoding": (
        edit("[camera]", '[camera]\nencoding = "log"'),
        SETTINGS,
        r"camera: encoding is 'log', but must be 'linear' or 'srgb'",
    ),
    "zero length": (
        edit("= 25.0", "= 0"),
        SETTINGS,
        r"camera: focal_length_mm is 0, but must be a positive number of mill",
    ),
    "endless length": (edit("= 8.0", "= inf"), SETTINGS, r"pixel_pitch_um is inf, but must be a positive number"),
    "undefined number": (edit("= 5.6", "= nan"), SETTINGS, r"view 2: f_number is nan, but must be"),
    "focus inside": (edit("= 0.85", "= 0.02"), SETTINGS, r"views\.toml: view 1 \(a\.png\): .* within the focal length"),
    "one view": (
        lambda f: (f / "views.toml").write_text(TOML[: TOML.rindex("[[view]]")]),
        SETTINGS,
        r"1 view given, but method .equalise. needs 2 or more: add a view",
    ),
    "view not a list": (
        lambda f: (f / "views.toml").write_text(TOML[: TOML.rindex("[[view]]")].replace("[[view]]", "[view]")),
        SETTINGS,
        r"view is a table, but must be one or more \[\[view\]\] tables, in double brackets",
    ),
    "camera not a table": (
        lambda f: (f / "views.toml").write_text("camera = 3\n" + TOML[TOML.index("[[view]]") :]),
        SETTINGS,
        r"camera is 3, but must be a table \[camera\]",
    ),
    "identical optics": (edit("= 5.6", "= 16"), SETTINGS, r"same aperture and focus"),
    # arguments and options
    "no arguments": (
        None,
        (),
        r"Missing argument .*, as in 'focalgradient depth .*': see 'focalgradient depth --help'\.",
    ),
    "no folder": (
        None,
        ("views.toml",),
        r"Missing option '--out', as in 'focalgradient depth demo/views\.toml --out results': see 'focalgradient depth",
    ),
    "no folder, nor the file": (
        None,
        ("view.toml",),
        r"view\.toml does not exist \(missing option '--out'\): see 'focalgradient depth --help'\.",
    ),
    "no folder, and a table": (
        None,
        ("t.csv",),
        r"t\.csv is one file, but not a photograph: .* 'focalgradient report'",
    ),
    "an empty folder": (
        lambda f: (f / "none").mkdir(),
        ("none", "--out", "out"),
        r"none is an empty folder, but depth needs at least 2 photographs",
    ),
    "unknown shape": (None, (*SETTINGS, "--psf", "ring"), r"'--psf': 'ring' is not one of"),
    "near beyond far": (None, (*SETTINGS, "--near", "2", "--far", "1"), r"--near 2 lies beyond or at --far 1"),
    "negative near": (None, (*SETTINGS, "--near", "-1"), r"--near is -1, but must be a positive number of metres"),
    "near beyond reason": (
        None,
        (*SETTINGS, "--near", "1e-5"),
        r"--near is 1e-05, but must be a number of metres from",
    ),
    "f-number beyond reason": (
        None,
        (*PHOTOGRAPHS, "--f-number", "1e-9"),
        r"--f-number is 1e-09, but must be a number",
    ),
    "near no number": (None, (*SETTINGS, "--near", "x"), r"'--near': 'x' is not a number"),
    "a settings file twice": (
        None,
        ("views.toml", *SETTINGS),
        r"several settings files have the same name, .*: rename them",
    ),
    "a picture beside a settings file": (
        None,
        ("a.png", *SETTINGS),
        r"views\.toml is a settings file, .*: give it alone",
    ),
    "one photograph": (
        None,
        ("a.png", "--out", "out"),
        r"a\.png is one file, but depth needs at least 2 photographs, or a settings file whose name ends in \.toml",
    ),
    "a video": (
        None,
        ("v.mkv", "--out", "out"),
        r"v\.mkv is one file, but not a photograph: .* 'focalgradient stream'",
    ),
    "a calibration": (
        lambda f: (f / "camera.toml").write_text("[[aperture]]\nf_number = 8\n"),
        ("camera.toml", "--out", "out"),
        r"camera\.toml is the calibration of a camera: give it beside the photographs \(--calibration\)",
    ),
    "targets": (
        lambda f: (f / "targets.toml").write_text("[[view]]\nimage = 'a.png'\ndistance_m = 0.5\n"),
        ("targets.toml", "--out", "out"),
        r"targets\.toml names photographs of a target at known distances: give it to focalgradient calibrate",
    ),
    "options with settings": (None, (*SETTINGS, "--f-number", "8"), r"--f-number cannot go with views\.toml"),
    "no EXIF": (None, PHOTOGRAPHS, r"--focal-length MM, --f-number N .*, --focus-distance M .* and --pixel-pitch UM"),
    "too many options": (
        None,
        (*PHOTOGRAPHS, *3 * ("--f-number", "8")),
        r"--f-number N was given 3 times: give it once for all photographs, or once for each of the 2",
    ),
    "no photograph": (None, ("a.png", "c.png", "--out", "out"), r"c\.png cannot be read \(No such file"),
    # the folder for the results
    "out is a file": (None, ("views.toml", "--out", "a.png"), r"--out a\.png cannot be written \(Not a directory\)"),
    "result is a folder": (
        lambda f: (f / "depth.npz").mkdir(),
        ("views.toml", "--out", "."),
        r"depth\.npz is a folder, where a file is to be written",
    ),
}


@pytest.mark.parametrize(("prepare", "args", "said"), BAD.values(), ids=BAD.keys())
def test_bad_input_is_refused_in_one_sentence(folder, prepare, args, said):
    if prepare:
        prepare(folder)
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    assert re.search(said, sentence(run("depth", *args)))
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before


LENS = ("--focal-length", "25", "--pixel-pitch", "8")


@pytest.mark.slow
def test_what_is_given_once_serves_all_photographs(folder):
    stops, once = ("--f-number", "16", "--f-number", "5.6"), ("--focus-distance", "0.85")
    for words, out in ((once, "one"), (once + once, "two")):
        assert run("depth", "a.png", "b.png", *LENS, *stops, *words, "--near", "0.85", "--out", out).exit_code == 0
    one, two = (np.load(folder / out / "depth.npz") for out in ("one", "two"))
    assert np.array_equal(one["vergence"], two["vergence"])
    foci = ("--focus-distance", "0.85", "--focus-distance", "2")
    assert run("depth", "a.png", "b.png", *LENS, "--f-number", "5.6", *foci, "--out", "three").exit_code in (0, 1)


def test_one_value_of_each_leaves_all_views_alike(folder):
    said = sentence(run("depth", *PHOTOGRAPHS, *LENS, "--f-number", "5.6", "--focus-distance", "0.85"))
    assert "both photographs have an f-number of 5.6 and are focused at 0.85 m" in said
    assert "give --f-number N or --focus-distance M once for each photograph" in said


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written(folder):
    (folder / "locked").mkdir(mode=0o555)
    assert "--out locked/out cannot be written" in sentence(run("depth", "views.toml", "--out", "locked/out"))


def test_input_errors_of_the_depth_core_are_sentences_too(folder, monkeypatch):
    def recover(views, **_):
        raise InputError("the views tell\nnothing: take others.")

    monkeypatch.setattr(depths, "recover_depth", recover)
    assert sentence(run("depth", *SETTINGS)) == "Error: the views tell nothing: take others.\n"
