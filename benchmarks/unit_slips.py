"""Errors of unit (m, cm, mm, um, dioptres, radians, diameters as f-numbers) in every input that takes optics.

An error is refused (exit code 2), warned about, or silent; a silent one is wrong if its result differs from that of the
correct command: a median distance or calibrated focus by more than 5 %, or pictures by more than 1 % of white (root
mean square).
"""

from __future__ import annotations

import contextlib
import re
import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from reruns import Lines, run_command

from focalgradient import InputError, Lens, View, recover_depth

__all__ = ["register"]

Words = list[str]

PHOTOGRAPHS = ("depth", "near.png", "far.png")
TWO_FOCI = {"--focal-length": "25", "--pixel-pitch": "8", "--f-number": "5.6 5.6", "--focus-distance": "0.8 1.6"}
VIDEO = {"--focal-length": "25", "--f-number": "16 5.6", "--focus-distance": "0.85", "--pixel-pitch": "8"}
VIDEO |= {"--near": "0.85"}
LENS = {"--focal-length": "25", "--f-number": "2.8", "--focus": "0.8", "--field": "6"}
EYE = {"--pupil": "4", "--focus": "0.8", "--field": "3"}
SCREEN = {"--pupil": "4", "--focus": "0.8", "--screen-width": "53.1", "--distance": "0.57"}

DEPTH: Sequence[dict[str, str]] = [
    *({"--focal-length": value} for value in ("0.025", "2.5", "25000", "0.984")),
    *({"--pixel-pitch": value} for value in ("0.008", "8e-6", "0.0008", "8000")),
    *({"--focus-distance": value} for value in ("800 1600", "80 160", "0.0008 0.0016", "1.25 0.625")),
    *({"--f-number": value} for value in ("0.00446 0.00446", "4.46 4.46", "0.446 0.446")),
    *({"--near": near, "--far": far} for near, far in (("800", "4000"), ("80", "400"), ("0.25", "1.25"))),
    {"--distances-from": "sensor", "--sensor-to-pupil": "0.026"},
]
STREAM: Sequence[dict[str, str]] = [
    *({"--focal-length": value} for value in ("0.025", "2.5", "25000")),
    *({"--pixel-pitch": value} for value in ("0.008", "8e-6", "8000")),
    *({"--focus-distance": value, "--near": value} for value in ("850", "85", "1.18")),
    *({"--focus-distance": value} for value in ("850", "85")),
    *({"--near": value} for value in ("850", "85")),
    *({"--f-number": value} for value in ("0.0016 0.0045", "1.6 4.5")),
]
BLUR: Sequence[dict[str, str]] = [
    *({"--focal-length": value} for value in ("0.025", "2.5", "25000")),
    *({"--focus": value} for value in ("800", "80", "1.25", "0.0008")),
    *({"--field": value} for value in ("0.105", "360")),
    *({"--field": "", "--pixel-pitch": value} for value in ("0.008", "8000")),
    *({"--f-number": value} for value in ("0.0089", "8.9")),
    *({"DEPTH": value} for value in ("mm.npy", "cm.npy", "dioptres.npy", "km.npy")),
]
EYES: Sequence[dict[str, str]] = [
    *({"--pupil": value} for value in ("0.004", "0.4", "4000")),
    *({"--focus": value} for value in ("800", "80", "1.25")),
    {"--field": "0.052"},
    *({"DEPTH": value} for value in ("mm.npy", "cm.npy", "dioptres.npy")),
]
SCREENS: Sequence[dict[str, str]] = [
    *({"--screen-width": value} for value in ("0.531", "531", "20.9")),
    *({"--distance": value} for value in ("57", "570", "0.0057")),
]
VIEWS: Sequence[tuple[str, str]] = [
    *((r"focal_length_mm = 25.0", f"focal_length_mm = {value}") for value in ("0.025", "2.5", "25000.0")),
    *((r"pixel_pitch_um = 8.0", f"pixel_pitch_um = {value}") for value in ("0.008", "8e-6", "8000.0")),
    *((r"focus_distance_m = (\S+)", rf"focus_distance_m = \g<1>{power}") for power in ("e3", "e2", "e-3")),
    *((r"f_number = 5.6", f"f_number = {value}") for value in ("0.00446", "4.46")),
]
TARGETS: Sequence[tuple[str, str]] = [
    *VIEWS[:6],
    *((r"\ndistance_m = (\S+)", rf"\ndistance_m = \g<1>{power}") for power in ("e3", "e2", "e-3")),
    *((r"focus_distance_m = (\S+)", rf"focus_distance_m = \g<1>{power}") for power in ("e3", "e2")),
    (r"offset_sd_m = 0.02", "offset_sd_m = 20.0"),
    (r"distance_sd_m = 0.002", "distance_sd_m = 2.0"),
    (r"f_number_tolerance = 0.07", "f_number_tolerance = 7.0"),
]
PYTHON: Sequence[tuple[float, float, float, float]] = [
    (0.025, 5.6, 0.8, 8e-6),
    *((length, 5.6, 0.8, 8e-6) for length in (25.0, 2.5, 2.5e-5)),
    *((0.025, number, 0.8, 8e-6) for number in (0.00446, 4.46)),
    *((0.025, 5.6, focus, 8e-6) for focus in (800.0, 80.0, 8e-4, 1.25)),
    *((0.025, 5.6, 0.8, pitch) for pitch in (8.0, 8e-3, 8e-9, 8e-12)),
]


def _run(words: Words) -> tuple[int, str]:
    """Return the exit code of a command, and its standard error output."""
    code, _, said = run_command(*words)
    return code, said.strip()


@cache
def _demo() -> Path:
    """Return the folder of examples, with distances in other units."""
    folder = Path(tempfile.mkdtemp(prefix="slips-"))
    code, said = _run(["demo", "--out", str(folder / "demo")])
    assert code == 0, said
    metres = np.load(folder / "demo" / "distance.npy")
    for name, values in (("mm", 1e3 * metres), ("cm", 1e2 * metres), ("km", 1e-3 * metres), ("dioptres", 1 / metres)):
        np.save(folder / "demo" / f"{name}.npy", values.astype(np.float32))
    return folder / "demo"


def _words(first: Sequence[str], options: dict[str, str], out: str) -> Words:
    depth = [options["DEPTH"]] if "DEPTH" in options else []
    words = [*first, *depth, "--out", out]
    for option, values in options.items():
        for value in values.split() if option != "DEPTH" else ():
            words += [option, value]
    return words


def _result(place: Path) -> np.ndarray | float:
    """Return the result of a command: a median distance (m), or a picture."""
    if (place / "depth.npz").exists():
        found = np.load(place / "depth.npz")
        return float(np.median(found["distance"][found["valid"]])) if found["valid"].any() else np.nan
    if (place / "values.npy").exists():
        return float(np.nanmedian(np.load(place / "values.npy")))
    if pictures := sorted(place.glob("blurred*.npy")):
        return np.load(pictures[0])
    text = (place / "camera.toml").read_text()
    return float(re.findall(r"vergence_dioptres = (\S+)", text)[0])


def _differs(one: np.ndarray | float, other: np.ndarray | float) -> bool:
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return bool(np.sqrt(np.mean((one - other) ** 2)) > 0.01)
    return not abs(float(one) / float(other) - 1) < 0.05


def _counted(runs: Iterator[tuple[str, Callable[[Path], Words]]]) -> str:
    """Count the outcomes of errors, compared with the correct command, which comes first."""
    right: np.ndarray | float | None = None
    counts = {"refused": 0, "warned": 0, "harmless": 0, "wrong in silence": 0}
    silent = []
    with contextlib.chdir(_demo()):
        for name, words in runs:
            with tempfile.TemporaryDirectory() as out:
                code, said = _run(words(Path(out)))
                if right is None:
                    assert code == 0, said
                    right = _result(Path(out))
                    continue
                if code == 2:
                    counts["refused"] += 1
                elif said:
                    counts["warned"] += 1
                elif _differs(_result(Path(out)), right):
                    counts["wrong in silence"] += 1
                    silent.append(name)
                else:
                    counts["harmless"] += 1
    return _told(counts, silent)


def _told(counts: dict[str, int], silent: list[str]) -> str:
    named = f" ({'; '.join(silent)})" if silent else ""
    return f"of {sum(counts.values())}: " + ", ".join(f"{n} {kind}" for kind, n in counts.items()) + named


def _options(first: Sequence[str], right: dict[str, str], slips: Sequence[dict[str, str]]) -> str:
    def runs() -> Iterator[tuple[str, Callable[[Path], Words]]]:
        for slip in ({}, *slips):
            options = right | slip
            name = ", ".join(f"{option} {value}" for option, value in slip.items())
            yield name, lambda out, options=options: _words(first, options, str(out))  # type: ignore[misc]

    return _counted(runs())


def _stream() -> str:
    def runs() -> Iterator[tuple[str, Callable[[Path], Words]]]:
        for slip in ({}, *STREAM):
            options, name = VIDEO | slip, ", ".join(f"{option} {value}" for option, value in slip.items())
            yield (
                name,
                lambda out, options=options: [  # type: ignore[misc]
                    *_words(("stream", "video.mkv"), options, str(out / "d.mp4")),
                    *("--values", str(out / "values.npy")),
                ],
            )

    return _counted(runs())


def _file(command: str, file: str, out: str, slips: Sequence[tuple[str, str]]) -> str:
    def runs() -> Iterator[tuple[str, Callable[[Path], Words]]]:
        text = (_demo() / file).read_text()
        for pattern, value in (("^", ""), *slips):
            changed = re.sub(pattern, value, text)
            assert changed != text or not value, pattern
            (_demo() / f"slip-{file}").write_text(changed)
            name = value.strip().replace(r"\g<1>", "")
            yield name, lambda place: [command, f"slip-{file}", "--out", str(place / out)]

    return _counted(runs())


def _python() -> str:
    """Return the results for a wall at 1.25 m, through f/16 and one more aperture."""
    rng = np.random.default_rng(1)
    image = rng.random((96, 96))
    counts, silent = {"refused": 0, "warned": 0, "silent": 0}, []
    for length, number, focus, pitch in PYTHON:
        with warnings.catch_warnings(record=True) as given:
            warnings.simplefilter("always")
            try:
                lenses = [Lens(length, n, focus) for n in (16.0, number)]
                angle = pitch / lenses[0].sensor_distance
                views = [View(image + 0.01 * rng.random((96, 96)), lens, angle) for lens in lenses]
                recover_depth(views, near=max(1.0, focus) if focus < 1.0 else None)
            except InputError:
                counts["refused"] += 1
                continue
        if given:
            counts["warned"] += 1
        else:
            counts["silent"] += 1
            silent.append(f"{length:g}, {number:g}, {focus:g}, {pitch:g}")
    return _told(counts, silent)


def _once() -> str:
    """Compare values given once with values for each photograph, and check that giving all once is refused."""
    medians = []
    with contextlib.chdir(_demo()), tempfile.TemporaryDirectory() as out:
        for number, stops in enumerate(("5.6", "5.6 5.6")):
            code, said = _run(_words(PHOTOGRAPHS, TWO_FOCI | {"--f-number": stops}, f"{out}/{number}"))
            medians.append(f"{_result(Path(out, str(number))):.3f} m" if code == 0 else said)
        alike = _run(_words(PHOTOGRAPHS, TWO_FOCI | {"--f-number": "5.6", "--focus-distance": "0.8"}, f"{out}/2"))
    return f"once: {medians[0]}, for each: {medians[1]}; all once: {alike[1][:80]}..."


def register(table: Lines) -> None:
    """Add the lines to a table."""
    views = ("depth", "views.toml", "depth.npz")
    lines: list[tuple[str, str, Callable[[], str]]] = [
        ("2.5.1", "units: `depth`, options", lambda: _options(PHOTOGRAPHS, TWO_FOCI, DEPTH)),
        ("2.5.2", "units: `depth`, views.toml", lambda: _file(views[0], views[1], ".", VIEWS)),
        ("2.5.3", "units: `stream`", _stream),
        ("2.5.4", "units: `blur`, a lens", lambda: _options(BLURRED, LENS | METRES, BLUR)),
        ("2.5.5", "units: `blur`, an eye", lambda: _options(BLURRED, EYE | METRES, EYES)),
        ("2.5.6", "units: `blur`, a display", lambda: _options(BLURRED, SCREEN | METRES, SCREENS)),
        ("2.5.7", "units: `calibrate`", lambda: _file("calibrate", "targets.toml", "camera.toml", TARGETS)),
        ("2.5.8", "units: Lens, View, recover_depth", _python),
        ("2.9", "one --f-number for two photographs; one of all optics", _once),
    ]
    for number, what, measure in lines:
        table.line(number, what, BEFORE[number])(measure)


BLURRED, METRES = ("blur", "picture.png"), {"DEPTH": "distance.npy"}

BEFORE: dict[str, str] = {
    "2.5.1": "of 19: 5 refused, 12 warned of (noise, optics), 1 wrong in silence",
    "2.5.2": "of 11: 4 refused, 6 warned, 1 wrong in silence",
    "2.5.3": "of 15: 3 refused, 1 warned, 11 wrong in silence",
    "2.5.4": "of 17: 7 refused, 10 wrong in silence",
    "2.5.5": "of 10: 3 refused, 1 warned, 6 wrong in silence",
    "2.5.6": "of 6: 3 refused, 3 wrong in silence",
    "2.5.7": "of 14: 4 refused, 1 warned, 4 wrong in silence",
    "2.9": "once: --f-number N has 1 values, but needs one for each; for each: 1.797 m",
    "2.5.8": "of 14: 7 refused, 2 warned, 5 silent, of which 1 is right",
}
"""Results of each line before the fix."""
