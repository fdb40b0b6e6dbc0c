"""The command, end to end on small pictures, and all that can be wrong with what it is given."""

import json
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
from command_line import run, sentence, succeed
from interrupts import interruptible
from PIL import Image
from two_views import DISTANCE, TOML, write

import focalgradient
from focalgradient import DepthMap, FocalGradientWarning, memory, termination
from focalgradient.cli.program import write_set
from focalgradient.photographs import depths

# --- What it does ------------------------------------------------------------------------------------------------


def test_views_in_depth_out(folder):
    result = succeed("depth", "views.toml", "--out", "new/out", "--near", "0.9", "--far", "4", "--psf", "gaussian")
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
    succeed("depth", "a.jpg", "b.jpg", "--out", "out", *optics, *limits)
    summary = json.loads((folder / "out" / "summary.json").read_text())
    assert summary["settings"]["camera"]["pixel_pitch_um"] == pytest.approx(8.0)
    assert summary["medians"]["distance_m"] == pytest.approx(DISTANCE, rel=0.02)


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


# --- What it refuses ---------------------------------------------------------------------------------------------

SETTINGS = ("views.toml", "--out", "out")
PHOTOGRAPHS = ("a.png", "b.png", "--out", "out")


def edit(old: str, new: str):
    def apply(folder: Path) -> None:
        assert old in TOML
        (folder / "views.toml").write_text(TOML.replace(old, new, 1))

    return apply


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
    "nearly black": (pixels("b.png", lambda p: (p >> 15).astype(np.uint8)), SETTINGS, r"b\.png is black"),
    "values beyond single precision": (
        poke(1e38),
        SETTINGS,
        r"b\.npy contains values from .* to 1e\+38, but the bright",
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
    "misspelt key of a view": (edit("f_number = 5.6", "fnumber = 5.6"), SETTINGS, r"view 2: fnumber .*mean f_number\?"),
    "no folder, nor the file": (
        None,
        ("view.toml",),
        r"view\.toml does not exist \(missing option '--out'\): see 'focalgradient depth --help'\.",
    ),
    "a picture beside a settings file": (
        None,
        ("a.png", *SETTINGS),
        r"views\.toml is a settings file, .*: give it alone",
    ),
    "a calibration": (
        lambda f: (f / "camera.toml").write_text("[[aperture]]\nf_number = 8\n"),
        ("camera.toml", "--out", "out"),
        r"camera\.toml is the calibration of a camera: give it beside the photographs \(--calibration\)",
    ),
    "too many options": (
        None,
        (*PHOTOGRAPHS, *3 * ("--f-number", "8")),
        r"--f-number N was given 3 times: give it once for all photographs, or once for each of the 2",
    ),
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


def test_one_value_of_each_leaves_all_views_alike(folder):
    said = sentence(run("depth", *PHOTOGRAPHS, *LENS, "--f-number", "5.6", "--focus-distance", "0.85"))
    assert "both photographs have an f-number of 5.6 and are focused at 0.85 m" in said
    assert "give --f-number N or --focus-distance M once for each photograph" in said
