"""Cases of `wrong_depth.py` with wrong statements about a calibration target."""

from __future__ import annotations

import re
import tempfile
from functools import cache, partial
from pathlib import Path

from reruns import Lines, run_command

__all__ = ["add_lines"]


def _run(*words: object) -> tuple[int, str]:
    """Return the exit code of a command, and its errors."""
    code, _, said = run_command(*words)
    return code, said


@cache
def _demo() -> tempfile.TemporaryDirectory[str]:
    folder = tempfile.TemporaryDirectory()
    _run("demo", "--out", folder.name)
    return folder


def _calibrated(changes: dict[str, str]) -> str:
    """Return the result of `calibrate` on the demonstration's target, with settings changed (regular expressions)."""
    folder = Path(_demo().name)
    text = (folder / "targets.toml").read_text()
    names = {old: f"@{number}@" for number, old in enumerate(changes)}
    for old, name in names.items():
        text = re.sub(old + "\\b", name, text)
    for old, name in names.items():
        text = text.replace(name, changes[old])
    (folder / "changed.toml").write_text(text)
    code, said = _run("calibrate", folder / "changed.toml", "--out", folder / "camera.toml")
    errors = [line for line in said.splitlines() if line.startswith("Error")]
    return f"exit {code}" + (f": {errors[0].partition('fits better with ')[2]}" if errors else "")


def add_lines(table: Lines) -> None:
    """Add the lines 2.6."""
    cases = {
        "nothing wrong": ({}, "exit 0"),
        "centimetres for metres": (
            {f"distance_m = {d}": f"distance_m = {100 * d}" for d in (0.45, 0.65, 1.5)},
            "exit 0, targets at inf +- inf",
        ),
        "two distances exchanged": (
            {"distance_m = 0.45": "distance_m = 1.5", "distance_m = 1.5": "distance_m = 0.45"},
            "exit 0, model error 42 %",
        ),
        "f-numbers exchanged": (
            {"f_number = 5.6": "f_number = 16", "f_number = 16": "f_number = 5.6"},
            "exit 0, model error 82 %",
        ),
        "pixel pitch halved": ({"pixel_pitch_um = 8.0": "pixel_pitch_um = 4.0"}, "exit 0"),
        "focus marks in centimetres": ({"focus_distance_m = 0.85": "focus_distance_m = 85"}, "exit 0"),
    }
    for number, (what, (changes, before)) in enumerate(cases.items(), 1):
        table.line(f"2.6.{number}", f"calibrate: {what}", before)(partial(_calibrated, changes))
