"""Messages on wrong calls: what was given, what is expected, and the nearest name or a call that works."""

from __future__ import annotations

import re
import warnings

import pytest
from click.testing import CliRunner

from focalgradient import FocalGradientWarning
from focalgradient.cli import main
from focalgradient.cli.program import warnings_given

TASKS = "depth-rating, necker, blur-threshold, published"
OTHERS = r"(?:, [\w-]+)*"  # tasks that other tests have registered
LENS = "--focal-length 25 --focus 0.8 --field 6 --out out"
WRONG = {
    "task": ("power foo", rf"TASK is 'foo', but must be one of {TASKS}{OTHERS}\."),
    "misspelt task": ("power depth-ratng --out out", rf"must be one of {TASKS}{OTHERS}: did you mean depth-rating\?"),
    "task without observers": (
        "power pinhole",
        rf"'pinhole', a task without simulated observers: give one of {TASKS}",
    ),
    "misspelt task to simulate": ("simulate neker", r"EXPERIMENT is 'neker', .*: did you mean necker\?"),
    "misspelt task to run": ("run pinhle", r"EXPERIMENT is 'pinhle', .*: did you mean pinhole\?"),
    "misspelt task to list": (
        "trials depthratin --participant 01",
        r"task is 'depthratin', .*did you mean depth-rating",
    ),
    "bound of power": ("power depth-rating --bound 20 --out out", r"--bound is 20\.0, but must be a ratio above 1 and"),
    "picture to calibrate": ("calibrate a.png", r"a\.png is a picture: give a settings file that names photographs of"),
    "picture to collect": (
        "collect a.png --data out",
        r"a\.png is a picture: give a result file of a study",
    ),
    "JPEG to calibrate": ("calibrate a.jpg --out c.toml", r"a\.jpg is a picture: give a settings file that names"),
    "table to calibrate": ("calibrate t.csv", r"t\.csv is not valid TOML: .*: give a settings file that .*\(TOML\)\."),
    "picture to eye": (
        "eye a.png",
        r"'a\.png', but must be one of spheres, .*'focalgradient blur', .*'focalgradient depth'",
    ),
    "misspelt scene": ("eye sphere --out out", r"SCENE is 'sphere', .*: did you mean spheres\?"),
    "two numbers": ("stimuli depth-rating --size 33x32", r"--size is 33x32, but must be one even .* --size 34\."),
    "odd": ("stimuli depth-rating --seed 1 --size 33 --out out", r"--size is 33, but must be even, .*: use 34\."),
    "odd cube": ("stimuli necker --size 33 --out out", r"--size is 33, but must be a positive even .*: give 34\."),
    "picture to report": (
        "report a.png",
        r"a\.png is a picture: give a table, or the folder of a data set instead",
    ),
    "out of range": ("power necker --experiments 0", r"'--experiments': 0 is not between 1 and 1000000: see"),
    "below the range": ("power necker --seed -1", r"'--seed': -1 is not 0 or more: see"),
    "text to report": ("report README.txt", r"README\.txt is not a table: give a CSV, TSV, XLSX or JSON file, or"),
    "words to report": (
        "report words --out out",
        r"words is not a table: give a CSV, TSV, XLSX or JSON file, or the folder",
    ),
    "no option": (
        "power necker",
        r"Missing option '--out', as in 'focalgradient power .* --out \w+': see 'focalgradient",
    ),
    "no second argument": (
        "blur a.png",
        r"Missing argument 'DEPTH', as in 'focalgradient blur .*': see 'focalgradient",
    ),
    "no option, example on two lines": (
        "stream a.avi",
        r"as in 'focalgradient stream demo/video\.mkv --out depth\.mp4 ",
    ),
    "no argument": ("validate", r"Missing argument 'DIR', as in 'focalgradient validate data'"),
    "no option, nor the file": ("blur b.png c.npy", r"b\.png does not exist \(missing option '--out'\): see"),
    "f/ in a number": (f"blur a.png d.npy --f-number f/5.6 {LENS}", r"'f/5\.6' is not a number \(write 5\.6\): see"),
    "unit in a number": (
        f"blur a.png d.npy --f-number 5.6mm {LENS}",
        r"is not a number \(write it without its unit\): see",
    ),
    "folder of depth": (
        f"blur a.png data --f-number 4 {LENS}",
        r"data is a folder but PICTURE a\.png is one picture: give",
    ),
    "eyes in metres": (
        "stereo a.png d.npy --pupil 4 --focus 0.8 --field 6 --interocular 0.063 --out out",
        r"--interocular is 0\.063, but must be a number of millimetres from 1 to 1000: check its unit\.",
    ),
    "misspelt choice": (
        "depth a.png --method edge --out out",
        r"'edge' is not one of .* \(did you mean edges\?\): see",
    ),
    "misspelt paper": (
        "stimuli replica mather --out out",
        r"paper is 'mather', but .*: did you mean mather(1996|2002)\?",
    ),
    "misspelt observer": (
        "simulate necker --observers 2 --seed 1 --observer opposit --out out",
        r"observer is 'opposit', but must be one of default, .*: did you mean opposite\?",
    ),
    "misspelt task of a design": (
        "power necker --design design.toml --out out",
        r"design\.toml: task is 'neker', but must be one of .*: did you mean necker\?",
    ),
    "no refraction": ("eye --through-focus --refraction minus --out out", r"--refraction is 'minus', but must be"),
    "incomplete optics": (
        "stream a.avi --out d.mp4 --focal-length 25 --pixel-pitch 8",
        r"--f-number and --focus-distance are missing, but --focal-length and --pixel-pitch are given: give all",
    ),
    "table of pictures": (
        "stimuli import data --table t.csv --out out",
        r"t\.csv has no column 'file' \(its columns are subject, rating\), but must have file, scene, aperture",
    ),
    "folder without a stimulus": (
        "stimuli set data --out out",
        r"stimulus\.json cannot be read .*: give the path of the rec",
    ),
}


@pytest.mark.parametrize(("call", "said"), WRONG.values(), ids=WRONG)
def test_the_message_on_a_wrong_call_names_the_remedy(tmp_path, monkeypatch, call, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(99))
    (tmp_path / "a.jpg").write_bytes(b"\xff\xd8\xff\xe0" + bytes(99))
    (tmp_path / "a.avi").write_bytes(b"RIFF")
    (tmp_path / "t.csv").write_text("subject,rating\n1,2\n")
    (tmp_path / "README.txt").write_text("Examples.\n\nnear.png, far.png   two photographs\nmore, words, here\n")
    (tmp_path / "data").mkdir()
    (tmp_path / "design.toml").write_text("task = 'neker'\n")
    (tmp_path / "words").write_text("nothing but\nwords\n")
    result = CliRunner().invoke(main, call.split())
    assert result.exit_code == 2, result.output
    assert re.fullmatch(r"Error: [^\n]+[.?]\n", result.stderr)
    assert re.search(said, result.stderr), result.stderr
    assert not (tmp_path / "out").exists()


def test_parameters_in_warnings_become_options(capsys: pytest.CaptureFixture[str]) -> None:
    with warnings_given():
        message = "compare psf='blend', k=0.35, or psf='disc', or take another method (method='equalise')."
        warnings.warn(message, FocalGradientWarning, stacklevel=1)
    said = capsys.readouterr().err
    assert "compare --psf blend --k 0.35, or --psf disc, or take another method (--method equalise)." in said
