"""Messages on wrong calls: what was given, what is expected, and the nearest name or a call that works."""

from __future__ import annotations

import re
import warnings

import pytest
from click.testing import CliRunner

from focalgradient import FocalGradientWarning
from focalgradient.cli import main, program
from focalgradient.cli.program import warnings_given

TASKS = "depth-rating, necker, blur-threshold, published"
OTHERS = r"(?:, [\w-]+)*"  # tasks that other tests have registered
LENS = "--focal-length 25 --focus 0.8 --field 6 --out out"
WRONG = {
    "task": ("power foo", rf"TASK is 'foo', but must be one of {TASKS}{OTHERS}\."),
    "picture to calibrate": ("calibrate a.png", r"a\.png is a picture: give a settings file that names photographs of"),
    "two numbers": ("stimuli depth-rating --size 33x32", r"--size is 33x32, but must be one even .* --size 34\."),
    "out of range": ("power necker --experiments 0", r"'--experiments': 0 is not between 1 and 1000000: see"),
    "no argument": ("validate", r"Missing argument 'DIR', as in 'focalgradient validate data'"),
    "unknown option": ("trials necker --colour 4", r"'--colour' \(a right call: 'focalgradient trials necker --part"),
    "option of another command": ("simulate necker --subjects 4", r"'--subjects' \(did you mean '--observers'\?\)"),
    "option of another experiment": ("run necker --out data", r"'--out' \(did you mean '--data'\?\)"),
    "option for an argument": ("blur a.png --depth d.npy", r"'--depth' \(a right call: 'focalgradient blur demo/pict"),
    "no photograph": ("depth b.png --out out", r"b\.png does not exist, but depth needs at least 2 photographs"),
    "design to report": ("report d.toml --out out", r"d\.toml is a settings file: .* --preregister' takes a design"),
    "no folder": ("power depth-rating", r"'--out', as in 'focalgradient power depth-rating --subjects .* --out "),
    "unit in a number": (f"blur a.png d.npy --f-number 5.6mm {LENS}", r"is not a number \(write it without its"),
    "two values of an option": ("depth a.png b.png --f-number 16 4 --out out", r"4 is not a file: .* --f-number 4\."),
    "misspelt choice": ("depth a.png --method edge --out out", r"'edge' is not one of .* \(did you mean edges\?\)"),
}


@pytest.mark.parametrize(("call", "said"), WRONG.values(), ids=WRONG)
def test_the_message_on_a_wrong_call_names_the_remedy(tmp_path, monkeypatch, call, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(99))
    (tmp_path / "d.toml").write_text("task = 'necker'\n")
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


def test_off_a_terminal_progress_is_printed_in_lines(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    seconds = iter([0.0, 5.0, 31.0, 31.0, 40.0])
    monkeypatch.setattr(program.time, "monotonic", lambda: next(seconds))
    with program.resumable("") as say:
        for share in (0.1, 0.42, 0.5):
            say(share, "planes")
    assert capsys.readouterr().err == "planes: 42%\n"
