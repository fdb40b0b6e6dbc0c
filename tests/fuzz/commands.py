"""Every command, as its own options and files describe it, given wrong values: `run.py 10000 --door commands`.

This reads the options and their types from the command line itself, so that a new option is tried without being named
here, and damages files by what they are (`mutations.py`), or puts one in the place of another.

A case passes where the exit code is 0, 1 or 2, the screen shows neither a traceback nor a path of the source code, and
a refused command leaves its folder as it was.
"""

from __future__ import annotations

import contextlib
import csv
import importlib
import io
import os
import random
import shutil
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import click
import cv2
import numpy as np
from click.testing import CliRunner

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1])]

from doors import CALIBRATED, photograph  # noqa: E402
from mutations import as_toml, is_text, workbook, wrong_file  # noqa: E402

OPTICS = "--focal-length 25 --pixel-pitch 8 --f-number 16 --f-number 5.6 --focus-distance 0.85"
LENS = "--f-number 4 --focal-length 25 --focus 0.8 --field 6"
LINES = (
    f"depth a.png b.png {OPTICS} --focus-distance 0.85 --out out",
    f"depth a.tif a.npy {OPTICS} --focus-distance 0.85 --out out",
    "depth a.jpg b.jpg --f-number 16 --f-number 5.6 --out out",
    "depth views.toml --out out",
    "depth views.toml --method edges --out out",
    "depth a.png b.png --f-number 16 --f-number 5.6 --focus-distance .85 --calibration camera.toml --out out",
    "depth f0.toml f1.toml --workers 1 --out out",
    "calibrate targets.toml --out out.toml",
    "calibrate --sheet a4 --out sheet.pdf",
    f"stream a.avi --out d.avi {OPTICS}",
    f"blur a.png far.npy {LENS} --out out",
    "blur a.png far.exr --pupil 4 --field 6 --focus 1 --out out",
    "blur a.png far.pfm --pupil 4 --field 6 --focus 1 --out out",
    "blur a.png far.tif --eye eye.toml --display display.toml --focus 1 --out out",
    "stereo a.png far.npy --pupil 4 --field 6 --focus 1 --show anaglyph --show halves --out out",
    "focus-series a.png far.npy --pupil 1 --field 6 --out out",
    "eye --accommodate course.csv --out out",
    "eye sphere --out out",
    "stimuli texture-border --width-deg 2 --height-deg 2 --pixels-per-degree 24 --out out",
    "stimuli dead-leaves --width-deg 2 --height-deg 2 --pixels-per-degree 24 --out out",
    "stimuli blurred-edge --width-deg 2 --height-deg 2 --pixels-per-degree 24 --out out",
    "stimuli slanted-plane --width-deg 2 --height-deg 2 --pixels-per-degree 24 --out out",
    "stimuli corrugated-plane --width-deg 2 --height-deg 2 --pixels-per-degree 24 --out out",
    "stimuli miniature --width-deg 2 --height-deg 2 --pixels-per-degree 24 --out out",
    "stimuli fixated-cube --edge-deg 0.8 --width-deg 3 --height-deg 3 --pixels-per-degree 24 --out out",
    "stimuli wide-field --screen 200x200 --pixel-pitch 3000 --out out",
    "stimuli replica mather2002 --screen 160x120 --pixel-pitch 3000 --out out",
    "stimuli set drawn --out out",
    "stimuli necker --gradient none --size 64 --edge 3 --speed 3 --workers 1 --out out",
    "stimuli depth-rating --seed 1 --scenes 1 --size 64 --samples 2 --engine cast --pixel-pitch 3000 --workers 1 "
    "--out out",
    "stimuli depth-rating --picture a.png --depth far.npy --field 6 --workers 1 --out out",
    "stimuli import own --table own/pictures.csv --pixel-pitch 3000 --out out",
    "run depth-rating --pilot --stimuli pictures --design rating.toml",
    "run necker --participant 01 --design necker.toml --data new",
    "run pinhole --participant 01 --data new",
    "run blur-threshold --participant 01 --stimuli pictures --design threshold.toml --data new",
    "run gaze-focus --series blurred --gaze mouse --windowed",
    "serve study.toml --data new --port 0",
    "serve study.toml --data new --links links.jsonl --consent consent.txt --port 0",
    "serve study.toml --export study --participants 2",
    "serve rating.toml --stimuli pictures --data new --port 0",
    "trials rating.toml --participant 01 --stimuli pictures --files out",
    "validate data",
    "validate cut --export",
    "validate data --stimuli pictures",
    "repair damaged",
    "withdraw data sub-02 --yes",
    "collect answers.txt --data collected",
    "report data --workers 1 --out out",
    "report table.csv --out out",
    "report wide.csv --conditions open=f/2,sharp=pinhole --out out",
    "report reports.csv --out out",
    "report table.xlsx --out out",
    "report table.csv --rules rules.toml --out out",
    "report --preregister rating.toml --out out",
    "report --preregister necker.toml --rules rules.toml --out out",
    "power depth-rating --subjects 3 --experiments 2 --design rating.toml --workers 1 --out out",
    "power necker --subjects 3 --experiments 2 --design necker.toml --workers 1 --out out",
    "simulate necker --observers 1 --seed 1 --design necker.toml --workers 1 --out out",
    "simulate blur-threshold --observers 1 --seed 1 --design threshold.toml --workers 1 --out out",
    "simulate depth-rating --observers 1 --seed 1 --stimuli pictures --design rating.toml --workers 1 --out out",
    "run gaze-focus --series blurred --gaze tracker --tracker tracker.json --windowed",
    "run necker --participant 01 --design own.toml --consent consent.txt --data new",
    "run necker --participant 01 --design own.toml --data data --resume",
    "serve own.toml --data new --consent consent.txt --port 0",
    "blur a.png far.npy --eye zernike.toml --field 6 --focus 1 --out out",
    "blur frames depths --pupil 4 --field 6 --focus 1 --out out",
    "report seen --workers 1 --out out",
    "validate seen --stimuli pictures",
    "doctor --seconds 0.1 --luminance photometer.csv",
    "demo --out out",
)
COSTLY = {
    "demo": 0.002,
    "doctor": 0.005,
    "simulate": 0.05,
    "eye": 0.1,
    "power": 0.15,
    "report": 0.2,
    "stimuli": 0.2,
    "calibrate": 0.2,
}
"""Share of the cases of commands that take long that is kept."""

CHANGED = {"focus-series", "repair", "withdraw", "collect", "validate", "serve", "run", "simulate", "power"}
"""Commands that add to what is there, or go on with it: what they keep when they refuse is theirs."""

EXPENSIVE = {"--workers", "--scheduler", "--store", "--host", "--bayes", "--experiments", "--seconds"}
"""Options of which only wrong values are tried: right ones start processes, use the network or take long."""

NUMBERS = (
    *("0", "-0", "1", "-1", "2", "0.5", "10", "1e-9", "1e9", "1e30", "1e308", "1e309", "-1e308", "1e-320", "inf"),
    *("-inf", "nan", "9" * 400, "9" * 5000, "1_0", "0x10", "1,5", "१", "1e", " 3 ", "+5", "1/2", "3 mm", "--5"),
)
WORDS = (
    *("", " ", "x", "-", "--", "é", "\udcff", "a\nb", "a\tb", "\u202e", "x" * 500, "=", "a=b", "a=", "=b", "a=b=c"),
    *("a=b,a=c", ",", "participant=nope", "rating=rating,rating=scene", "%s%n", "{0}", "[]", "null", "../../x", "~x"),
    *("$HOME", "\x1b[31m", "1-0", "0-5", "101-150", "99999999-1", "A4", "sub-01", "SUB-01 "),
)
PLACES = (
    *(".", "/", "", "nowhere", "nowhere/further", "x" * 300, "/dev/null", "/dev/zero", "/proc/self/mem", "loop"),
    *("a.png", "far.npy", "views.toml", "data", "pictures", "table.csv", "study.toml", "a\nb.png", "\udcff.csv"),
    *("a.png/x", "camera.toml", "out.html", "d.mp4", "d.", ".avi", "con", "dataset_description.json"),
)


@cache
def base() -> Path:
    """A folder with what every line of `LINES` reads; it is removed at the end."""
    import atexit

    from long_commands import participant, prepare
    from recorded import APPARATUS

    from focalgradient.dataset import Rated, Session
    from focalgradient.design import load_design
    from focalgradient.design.words import words_text

    folder = Path(tempfile.mkdtemp(prefix="fuzz-base-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    prepare(folder)
    participant.make_set(folder / "pictures", ("spheres-00", "spheres-01"))
    (folder / "views.toml").write_bytes((folder / "f0.toml").read_bytes())
    light = cv2.imread(str(folder / "a.png"), cv2.IMREAD_UNCHANGED) / np.float32(65535)
    cv2.imwrite(str(folder / "a.tif"), light)
    np.save(folder / "a.npy", light)
    for name in ("a.jpg", "b.jpg"):
        (folder / name).write_bytes(photograph())
    (folder / "camera.toml").write_bytes(as_toml(CALIBRATED))
    (folder / "rules.toml").write_text("same_answer = 0.9\ndropped_frames = 3\n")
    (folder / "eye.toml").write_text(
        "pupil_mm = 4.0\nchromatic_scale = 1.0\naberrations = [[2, 0, 0.1], [4, 0, 0.05]]\n"
    )
    (folder / "display.toml").write_text(
        'size_px = [1920, 1080]\npixel_pitch_um = 276.7\ndistance_m = 0.57\ngamma = "sRGB"\n'
    )
    (folder / "own.toml").write_text((folder / "necker.toml").read_text() + 'language = "words.toml"\n')
    (folder / "words.toml").write_text(words_text("en"))
    (folder / "tracker.json").write_text('{"eyetracker.hw.tobii.EyeTracker": {"runtime_settings": {"rate": 120}}}')
    (folder / "zernike.toml").write_text('pupil_mm = 4.0\nzernike = "zernike.csv"\nmeasured_mm = 6.0\n')
    (folder / "zernike.csv").write_text("n,m,um\n2,0,0.1\n4,0,0.05\n3,1,0.02\n")
    levels = "".join(
        f"{n},{n**2.2 / 4:.3f},{n**2.2 / 2:.3f},{n**2.2 / 9:.3f},{n**2.2:.3f}\n" for n in range(0, 256, 51)
    )
    (folder / "photometer.csv").write_text("level,red,green,blue,grey\n" + levels)
    for name, files in (("frames", ("a.png", "b.png")), ("depths", ("far.npy", "far.npy"))):
        (folder / name).mkdir()
        for number, file in enumerate(files):
            shutil.copy2(folder / file, folder / name / f"{number}{Path(file).suffix}")
    design = load_design(folder / "rating.toml")
    for who in ("01", "02", "03"):
        with Session.begin(folder / "seen", design, who, apparatus=APPARATUS, stimuli=folder / "pictures") as session:
            for trial in session.remaining():
                session.record(trial, Rated(onset=5.0 * trial.trial, rating=1.1, response_time=1.5))
    (folder / "consent.txt").write_text("# Consent\n\nVersion: 2.1\n\nI agree.\n")
    (folder / "links.jsonl").write_bytes(b"")
    far = np.load(folder / "far.npy").astype(np.float32)
    (folder / "far.pfm").write_bytes(b"Pf\n96 96\n-1.0\n" + far[::-1].astype("<f4").tobytes())
    cv2.imwrite(str(folder / "far.tif"), far)
    _exr(folder / "far.exr", far)
    rows = [["participant", "scene", "aperture", "fixation", "rating"]]
    reports = [["participant", "trial", "gradient", "percept", "duration"]]
    chance = random.Random(1)
    for who in range(1, 5):
        for scene in ("a", "b", "c"):
            for aperture in ("pinhole", "f/5.6", "f/2"):
                for end in ("nearest", "farthest"):
                    rows.append([f"P{who}", scene, aperture, end, f"{chance.uniform(0.8, 1.6):.2f}"])
        for trial in range(1, 7):
            for report in range(3):
                percept = ("rigid", "nonrigid")[report % 2]
                lasts = f"{chance.uniform(1, 9):.2f}"
                reports.append([f"P{who}", str(trial), ("none", "rigid", "nonrigid")[trial % 3], percept, lasts])
    wide = [["participant", "scene", "fixation", "sharp", "open"]]
    wide += [[f"P{n}", s, e, "1.0", f"{1.1 + n / 99}"] for n in range(4) for s in "ab" for e in ("nearest", "farthest")]
    for name, table in (("table", rows), ("reports", reports), ("wide", wide)):
        (folder / f"{name}.csv").write_bytes(_csv(table, ","))
    (folder / "table.xlsx").write_bytes(workbook(rows))
    (folder / "loop").symlink_to("loop")
    return folder


def _exr(path: Path, values: np.ndarray) -> None:
    with contextlib.suppress(ImportError):
        OpenEXR = importlib.import_module("OpenEXR")
        with OpenEXR.File({"type": OpenEXR.scanlineimage}, {"Z": values}) as file:
            file.write(str(path))


def _csv(rows: list[list[str]], delimiter: str) -> bytes:
    text = io.StringIO()
    csv.writer(text, delimiter=delimiter, lineterminator="\n").writerows(rows)
    return text.getvalue().encode("utf-8", "surrogatepass")


@cache
def leaves() -> dict[tuple[str, ...], click.Command]:
    """Every command of the command line, by its words."""
    from focalgradient.cli import main

    found: dict[tuple[str, ...], click.Command] = {}

    def walk(command: click.Command, words: tuple[str, ...]) -> None:
        if isinstance(command, click.Group):
            for name, inner in command.commands.items():
                walk(inner, (*words, name))
        else:
            found[words] = command

    walk(main, ())
    return found


def wrong_value(kind: click.ParamType, option: str, chance: random.Random) -> str:
    """A value that a parameter of this type may or may not take."""
    if option in EXPENSIVE:
        return chance.choice(("0", "-1", "x", "", "nan", "1e9", "9" * 400, "1.5", "tcp://nowhere:0"))
    pick = chance.random()
    if isinstance(kind, click.Path) or pick < 0.1:
        return chance.choice(PLACES)
    if isinstance(kind, click.Choice) and pick < 0.6:
        return str(chance.choice(list(kind.choices)))
    if pick < 0.7 or "float" in kind.name or "integer" in kind.name:
        return chance.choice(NUMBERS) if chance.random() < 0.7 else f"{10 ** chance.uniform(-4, 5):.4g}"
    return chance.choice(WORDS)


def wrong_options(line: list[str], chance: random.Random) -> list[str]:
    """A command line with options changed, added, repeated or lost."""
    line = list(line)
    words = tuple(line[: 2 if tuple(line[:2]) in leaves() else 1])
    options = [one for one in leaves()[words].params if isinstance(one, click.Option)]
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        way = chance.randrange(6)
        flags = [at for at, word in enumerate(line) if word.startswith("--") and at + 1 < len(line)]
        if way == 0 and flags:
            at = chance.choice(flags)
            known = [one for one in options if line[at] in one.opts]
            line[at + 1] = wrong_value(known[0].type if known else click.FLOAT, line[at], chance)
        elif way == 1 and len(line) > 2:
            del line[chance.randrange(len(words), len(line))]
        elif way == 2 and len(line) > len(words):
            line[chance.randrange(len(words), len(line))] = chance.choice((*PLACES, *WORDS))
        elif options:
            option = chance.choice(options)
            name = chance.choice(option.opts)
            if name in ("--bayes", "--help", "-h"):
                continue
            values = () if option.is_flag else range(option.nargs)
            line += [name, *(wrong_value(option.type, name, chance) for _ in values)]
        else:
            line += [chance.choice(("--pilot", "--data", "--stimuli", "--monitor", "--resume", "--design", "--gamma"))]
            line += [chance.choice((*PLACES, *NUMBERS, *WORDS))] if chance.random() < 0.7 else []
    return [word for word in line if "\0" not in word]


def _serve(study: Any, password: str, host: str, port: int, ready: Callable[[str], None], *_: Any, **more: Any) -> None:
    """In the place of a server: all is read that it reads when it starts."""
    ready("http://localhost")


def files(folder: Path) -> dict[str, tuple[int, int]]:
    """Size and time of every file below a folder."""
    found = {}
    for path in folder.rglob("*"):
        status = path.lstat()
        found[path.relative_to(folder).as_posix()] = (status.st_size, status.st_mtime_ns) if path.is_file() else (0, 0)
    return found


def made(seed: int, only: str | None, folder: Path) -> list[str]:
    """The command line of a case, and in `folder` the files that it names."""
    chance = random.Random(f"commands {seed}")
    lines = [line for line in LINES if only is None or line.split()[0] == only or line.startswith(only)]
    line = chance.choice(lines).split()
    while only is None and chance.random() > COSTLY.get(line[0], 1.0):
        line = chance.choice(lines).split()
    given = [word for word in line if os.path.exists(base() / word)]
    if "views.toml" in given or {"f0.toml", "f1.toml"} & set(given):
        given += ["near.png", "soft.png"]
    given += ["words.toml"] if "own.toml" in given else ["zernike.csv"] if "zernike.toml" in given else []
    if "targets.toml" in given:
        given += [path.name for path in base().glob("*.png")]
    given = [name for name in dict.fromkeys(given) if not name.startswith("own/")]
    pick = chance.random()
    args = wrong_options(line, chance) if pick < 0.5 else line
    given += [
        word for word in args if word in PLACES and word not in (".", "..", "/", "") and os.path.exists(base() / word)
    ]
    given = [name for name in dict.fromkeys(given) if not name.startswith("/")]
    for name in given:
        if (base() / name).is_dir():
            shutil.copytree(base() / name, folder / name, symlinks=True)
        elif not (folder / name).exists():
            shutil.copy2(base() / name, folder / name)
    (folder / "loop").symlink_to("loop")
    if pick > 0.45:
        within = sorted(path for path in folder.rglob("*") if path.is_file())
        small = [path for path in within if path.stat().st_size < 300_000] or within
        texts = [path for path in small if is_text(path) or path.suffix == ".xlsx"]
        if small:
            wrong_file(chance.choice(texts if texts and chance.random() < 0.7 else small), base(), chance)
    return args


def case(seed: int, only: str | None = None) -> tuple[str, str]:
    """Try one case: its command line, and what went wrong (nothing: empty)."""
    from focalgradient import web
    from focalgradient.cli import main

    with tempfile.TemporaryDirectory(prefix="fuzz-") as outer:
        folder = Path(outer, "folder")
        folder.mkdir()
        args = made(seed, only, folder)
        before, here = files(folder), os.getcwd()
        serving, web.run = web.run, _serve  # type: ignore[assignment]
        os.chdir(folder)
        try:
            with warnings.catch_warnings():
                warnings.resetwarnings()
                warnings.simplefilter("ignore", DeprecationWarning)
                warnings.simplefilter("ignore", ResourceWarning)
                warnings.simplefilter("ignore", PendingDeprecationWarning)
                result = CliRunner().invoke(main, args, prog_name="focalgradient")
        finally:
            os.chdir(here)
            web.run = serving
        outside = [path.name for path in Path(outer).iterdir()]
        return " ".join(args)[:300], judged(args, result, before, files(folder), outside)


def judged(args: list[str], result: Any, before: dict[str, Any], after: dict[str, Any], outside: list[str]) -> str:
    """What is wrong with a result (nothing: empty)."""
    error = result.exception
    if error is not None and not isinstance(error, SystemExit):
        frames = [one for one in traceback.extract_tb(error.__traceback__) if "focalgradient" in one.filename]
        at = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else "outside"
        return f"{type(error).__name__} at {at}: {str(error)[:150]}"
    if result.exit_code not in (0, 1, 2):
        return f"exit code {result.exit_code}: {result.output[-150:]}"
    for sign in ("Traceback (most recent", "RuntimeWarning", "site-packages", "src/focalgradient", ".py:"):
        if sign in result.output:
            at = result.output.index(sign)
            return f"on the screen: {result.output[max(at - 60, 0) : at + 200]!r}"
    if outside != ["folder"]:
        return f"left outside: {outside}"
    changed = sorted(name for name in before.keys() | after.keys() if before.get(name) != after.get(name))
    kept = "frames" in args or "f1.toml" in args  # what was finished of several is kept
    if result.exit_code == 2 and changed and not kept and args[0] not in CHANGED:
        return f"a refused command changed {changed[:5]}: {result.output[-200:]}"
    hidden = [name for name in after if ".focalgradient-" in name]
    if hidden:
        return f"left over: {hidden[:5]}"
    last = result.stderr.rstrip("\n").rpartition("\n")[2]
    if result.exit_code == 2 and not last.startswith("Error: "):
        return f"no sentence: {result.stderr[-200:]!r}"
    if len(last) > 4000:  # a message names up to twenty places
        return f"a sentence of {len(last)} letters: {last[:200]!r}"
    return ""
