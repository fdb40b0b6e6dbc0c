"""Every file that a command is given, in its place something that is no such file: one sentence, nothing written."""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner

sys.path.append(str(Path(__file__).parent / "fuzz"))

pytestmark = pytest.mark.skipif(os.name != "posix", reason="makes FIFOs and limits time as POSIX does")

OPTICS = ("--focal-length", "25", "--pixel-pitch", "8", "--f-number", "16", "--f-number", "5.6", "--focus-distance")
OPTICS += ("0.85", "--focus-distance", "0.85")

# What each command is given, with {} for the file; then the ending of its name.
TEXTS = {
    "depth, settings": ("depth {} --out out", ".toml"),
    "depth, calibration": (f"depth a.png b.png {' '.join(OPTICS)} --calibration {{}} --out out", ".toml"),
    "calibrate": ("calibrate {} --out camera.toml", ".toml"),
    "blur, eye": ("blur a.png far.npy --eye {} --field 6 --focus 1 --out out", ".toml"),
    "blur, display": ("blur a.png far.npy --pupil 4 --display {} --focus 1 --out out", ".toml"),
    "power, design": ("power necker --subjects 3 --experiments 1 --design {} --out out", ".toml"),
    "simulate, design": ("simulate necker --observers 1 --seed 1 --design {} --out out", ".toml"),
    "report, table": ("report {} --out out", ".csv"),
    "report, rules": ("report data --rules {} --out out", ".toml"),
    "preregistration": ("report --preregister {} --out out", ".toml"),
    "serve, design": ("serve {} --data out --port 0", ".toml"),
    "serve, consent": ("serve necker.toml --consent {} --data out --port 0", ".txt"),
    "serve, links": ("serve necker.toml --links {} --data out --port 0", ".jsonl"),
    "serve, design to export": ("serve {} --export out", ".toml"),
    "collect, results": ("collect {} --data out", ".txt"),
    "import, table": ("stimuli import . --table {} --out out", ".csv"),
}
PICTURES = {
    "depth": (f"depth a.png {{}} {' '.join(OPTICS)} --out out", ".png"),
    "depth, array": (f"depth a.png {{}} {' '.join(OPTICS)} --out out", ".npy"),
    "stream": (f"stream {{}} --out out/d.avi {' '.join(OPTICS[:8])} --focus-distance 0.85", ".avi"),
    "blur, picture": ("blur {} far.npy --pupil 4 --field 6 --focus 1 --out out", ".png"),
    "blur, depth": ("blur a.png {} --pupil 4 --field 6 --focus 1 --out out", ".npy"),
    "blur, depth in EXR": ("blur a.png {} --pupil 4 --field 6 --focus 1 --out out", ".exr"),
    "blur, depth in PFM": ("blur a.png {} --pupil 4 --field 6 --focus 1 --out out", ".pfm"),
    "stimuli, picture": ("stimuli depth-rating --picture {} --depth far.npy --field 6 --out out", ".png"),
    "stimuli, depth": ("stimuli depth-rating --picture a.png --depth {} --field 6 --out out", ".npy"),
}


def content(data: bytes) -> Callable[[Path], object]:
    return lambda path: path.write_bytes(data)


HEADER = b"\x93NUMPY\x01\x00v\x00{'descr': '<f8', 'fortran_order': False, 'shape': (%s,), }"
ALL = {
    "missing": lambda path: None,
    "a folder": Path.mkdir,
    "a FIFO": os.mkfifo,
    "a device without end": lambda path: path.symlink_to("/dev/zero"),
    "links in a circle": lambda path: path.symlink_to(path),
    "bytes": content(bytes(range(256)) * 20),
    "not UTF-8": content(b"participant,\xff\xfe\n"),
}
OF_TEXTS = {
    "nested": content(b"a = " + b"[" * 30_000),
    "nested JSON": content(b"[" * 30_000),
    "a number of thousands of digits": content(b"a = " + b"9" * 5000),
    "twenty thousand dotted keys": content(b"a" + b".b" * 20_000 + b" = 1"),
    "NUL": content(b'a = "x\0y"\n'),
}
OF_PICTURES = {
    "empty": content(b""),
    "an archive's beginning": content(b"PK\x03\x04" + b"x" * 99),
    "a torn array": content(HEADER.ljust(128) % b"99"),
    "an endless array": content((HEADER % b"9" * 3).ljust(128)),
    "a header without end": content(b"\x93NUMPY\x02\x00\xff\xff\xff\x7f{'descr'"),
}
FINE = {("serve, links", "missing"), *(("serve, consent", kind) for kind in OF_TEXTS)}
CASES = [
    (name, kind)
    for kinds, given in (((*ALL, *OF_TEXTS), TEXTS), ((*ALL, *OF_PICTURES), PICTURES))
    for number, name in enumerate(given)
    for kind in dict.fromkeys(["a FIFO", "bytes", *(kinds[(number + step) % len(kinds)] for step in (0, 5))])
    if (name, kind) not in FINE
]
"""Two damages at every door; each of the others at some, as the same functions read at all of them."""


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from killing_commands import prepare

    folder = tmp_path_factory.mktemp("given")
    prepare(folder)
    return folder


@pytest.fixture
def given(base: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    for path in base.iterdir():
        (tmp_path / path.name).symlink_to(path)
    monkeypatch.chdir(tmp_path)

    def late(*_: object) -> None:
        raise AssertionError("it hangs")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, 120, 20)  # again, where what it ends waits, too
    yield tmp_path
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize(("name", "kind"), CASES)
def test_it_is_refused_in_a_sentence(name: str, kind: str, given: Path) -> None:
    from focalgradient.cli import main

    args, ending = (TEXTS | PICTURES)[name]
    path = given / f"bad{ending}"
    (ALL | OF_TEXTS | OF_PICTURES)[kind](path)
    there = set(given.iterdir())
    result = CliRunner().invoke(main, args.format(path.name).split())
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exc_info
    assert result.exit_code == 2, result.output
    assert result.stderr.splitlines()[-1].startswith("Error: "), result.stderr
    assert result.stderr.count("\n") <= 3, result.stderr
    assert set(given.iterdir()) == there, "something was written"


LINES = " ".join(OPTICS)
OVER = {
    "calibrate targets.toml --out targets.toml": "targets.toml",
    "calibrate targets.toml --out link": "targets.toml",
    f"stream a.avi --out d.avi --values values.npy {LINES}": "a.avi",
    f"depth depth.png b.png --out in/.. {LINES}": "a.png",
    "blur a.png distance.npy --pupil 4 --field 6 --focus 1 --out .": "far.npy",
    "power necker --subjects 3 --experiments 1 --design power.csv --out .": "necker.toml",
    "report report.md --out .": "own.csv",
    "serve necker.toml --data out --links in/../necker.toml": "necker.toml",
}
OTHER_NAMES = {
    "depth.png": "a.png",
    "distance.npy": "far.npy",
    "power.csv": "necker.toml",
    "report.md": "own.csv",
    "values.npy": "a.avi",
    "preregistration.md": "own.csv",
}


@pytest.mark.parametrize("args", OVER)
def test_an_input_is_never_an_output(args: str, given: Path) -> None:
    """By the file itself: under another spelling, and behind a link."""
    from doors import CALIBRATED
    from mutations import as_toml

    from focalgradient.cli import main

    (given / "in").mkdir()
    (given / "own.csv").write_text("subject,scene,aperture_mm,rating\n01,a,0,1\n01,a,4,2\n")
    (given / "link").symlink_to(OVER[args])
    (given / "rules.toml").write_text("dropped_frames = 3\n")
    (given / "summary.json").write_bytes(as_toml(CALIBRATED))
    views = [{"image": f"{name}.png", "f_number": n, "focus_distance_m": 0.85} for name, n in (("a", 16), ("b", 5.6))]
    (given / "views.toml").write_bytes(as_toml({"camera": {"calibration": "summary.json"}, "view": views}))
    for name, of in OTHER_NAMES.items():
        (given / name).symlink_to(of)
    before = {path: path.read_bytes() for path in given.iterdir() if path.is_file()}
    result = CliRunner().invoke(main, args.split())
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit), result.exc_info
    assert "would be overwritten, but it is read" in result.stderr or "is a file, but must be" in result.stderr
    assert {path: path.read_bytes() for path in given.iterdir() if path.is_file()} == before
