"""``focalgradient eye --accommodate TARGET``: simulate an eye that focuses a target by its own estimate of depth."""

from __future__ import annotations

import csv
import io
import math
import platform
import re
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from focalgradient.cli.program import announce, resumable, show, summary_json, warnings_given, writable, write_set
from focalgradient.errors import InputError
from focalgradient.files import LARGEST_LIST, printable, read_text

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from focalgradient.eye import Accommodation, Course
    from focalgradient.eye.accommodation import Cue

__all__ = ["TargetCourse", "accommodate", "target_of"]

FILES = ("course.csv", "course.png", "retina.mp4", "summary.json")
DURATION_S = 10.0
LONGEST_S = 120.0
"""Default and maximum duration of a course, in seconds."""

STEP_S = 1.0
"""Default time of a step, in seconds."""

AFTER_STEP_S = 5.0
"""Minimum time shown after a step, in seconds."""

SECONDS_PER_SECOND = 0.5
"""Computing time per second of the course, on two cores."""

CHANNELS_NM = (610.0, 550.0, 465.0)
"""Wavelengths in nm of the film's red, green and blue: about the peaks of displays' primaries."""

DRAWN_S = 0.01
"""Interval of time at which the target is drawn, in seconds: on paper below the width of its line."""

ENLARGED = 5
FORMS = "step:FROM,TO[,SECOND], sine:MEAN,AMPLITUDE,HZ or a CSV file of time,dioptres"


@dataclass(frozen=True)
class TargetCourse:
    """Vergence of the target over time, its duration, its description, and (if other) that in the figure's title."""

    at: Callable[[float], float]
    seconds: float
    words: str
    file: Path | None = None
    title: str | None = None


def target_of(text: str) -> TargetCourse:
    """Return the course of a target from its short form or from a CSV file.

    >>> target_of("step:1,3").at(0.5), target_of("step:1,3").at(2.0), target_of("sine:2,0.5,0.25").at(1.0)
    (1.0, 3.0, 2.5)
    """
    kind, colon, rest = text.partition(":")
    if not text:
        raise InputError(f"--accommodate is empty, but must be {FORMS}.")
    if not colon or kind not in ("step", "sine"):
        return _from_file(text)
    try:
        numbers = [float(part) for part in rest.split(",")]
    except ValueError:
        numbers = []
    if kind == "step" and len(numbers) in (2, 3) and all(map(math.isfinite, numbers)):
        before, after, at = (*numbers, STEP_S)[:3]
        latest = LONGEST_S - AFTER_STEP_S
        if not 0 <= at <= latest:
            raise InputError(f"--accommodate {text} steps at {at:g} s, but must step between 0 and {latest:g} s.")
        seconds, title = max(DURATION_S, at + AFTER_STEP_S), f"step from {before:g} to {after:g} D"
        return TargetCourse(lambda t: after if t >= at else before, seconds, text, title=title)
    if kind == "sine" and len(numbers) == 3 and all(map(math.isfinite, numbers)):
        mean, amplitude, hertz = numbers
        from focalgradient.eye import Accommodation

        most = Accommodation().rate / 2  # Nyquist frequency of the eye's moments
        if not 0 < hertz < most:
            raise InputError(f"--accommodate {text} has {hertz:g} Hz, but must be above 0 and below {most:g} Hz.")
        title = f"{mean:g} ± {amplitude:g} D at {hertz:g} Hz"
        return TargetCourse(
            lambda t: mean + amplitude * math.sin(2 * math.pi * hertz * t), DURATION_S, text, title=title
        )
    raise InputError(f"--accommodate is {printable(text)!r}, but must be {FORMS}.")


def _from_file(name: str) -> TargetCourse:
    from focalgradient.eye import target_course

    if not name.lower().endswith((".csv", ".tsv", ".txt")) and not Path(name).exists():
        raise InputError(f"--accommodate is {printable(name)!r}, but must be {FORMS}.")
    text = read_text(name, "a target's course", LARGEST_LIST)
    rows = [re.split(r"[,;\t]", line.strip()) for line in text.splitlines() if line.strip() and line.strip()[0] != "#"]
    if rows and not _is_number(rows[0][0]):
        rows = rows[1:]  # skip the header
    if len(rows) < 2 or any(len(row) != 2 or not all(map(_is_number, row)) for row in rows):
        raise InputError(
            f"{printable(name)} must contain at least two lines of time,dioptres, in seconds and dioptres."
        )
    times, vergences = np.array(rows, dtype=float).T
    if np.any(np.diff(times) < 0) or times[0] < 0:
        raise InputError(f"{printable(name)} has times that decrease or are negative: sort its lines by time.")
    if not 0 < times[-1] <= LONGEST_S:
        raise InputError(f"{printable(name)} ends at {times[-1]:g} s, but must end by {LONGEST_S:g} s.")
    return TargetCourse(target_course(times, vergences), float(times[-1]), printable(name), Path(name))


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def accommodate(text: str, out: Path, pupil_mm: float, cue: Cue, seed: int) -> None:
    """Simulate accommodation to the target, and write the results."""
    start = time.perf_counter()
    target = target_of(text)
    writable(out, FILES, [target.file] if target.file else [])
    with (
        resumable(
            "nothing was written.", lambda: announce(SECONDS_PER_SECOND * target.seconds, "Accommodating")
        ) as say,
        warnings_given() as given,
    ):
        say(0.0, "accommodating")
        from focalgradient.eye import Accommodation
        from focalgradient.eye import accommodate as look
        from focalgradient.eye.ranges import warn_if_artificial

        warn_if_artificial(1e-3 * pupil_mm)
        eye = Accommodation(cue=cue, pupil_diameter=1e-3 * pupil_mm)
        course = look(target.at, target.seconds, eye, seed=seed, progress=lambda share, words: say(0.9 * share, words))
        say(0.9, "drawing")
        figure = draw(course, target)
        film = retina(course, eye, seed)
    found = _found(course)
    summary = {
        "simulated": True,
        "settings": {
            "target": target.words,
            "seconds": target.seconds,
            "pupil_mm": pupil_mm,
            "cue": cue,
            "seed": seed,
            "plant": asdict(eye.plant),
            "pulse": asdict(eye.pulse) if eye.pulse else None,
            "noise_of_mean": eye.noise,
            "moments_per_second": eye.rate,
        },
        "found": found,
        "warnings": given,
        "versions": {name: version(name) for name in ("focalgradient", "numpy", "scipy")}
        | {"python": platform.python_version()},
    }

    def film_into(path: Path) -> None:
        from focalgradient.video import write_frames

        write_frames(path, film, eye.rate)

    writers: dict[str, bytes | Callable[[Path], object]] = {
        "course.csv": table(course),
        "course.png": figure.savefig,
        "retina.mp4": film_into,
        "summary.json": summary_json(summary | {"seconds": time.perf_counter() - start}),
    }
    write_set(out, writers, "summary.json")
    written = [printable(out / name) for name in writers]
    show(
        summary | {"written": written},
        f"Lag over the last two seconds: {found['lag_D']:.2f} D",
        f"Error of the estimate, root mean square: {found['estimate_rms_error_D']:.2f} D; "
        f"within two stated standard deviations: {found['estimate_within_2_sd']:.0%}",
        f"Written: {', '.join(written)}",
    )


def _found(course: Course) -> dict[str, float]:
    error = course.estimate - course.target
    return {
        "lag_D": course.lag(),
        "estimate_rms_error_D": float(np.sqrt(np.mean(error**2))),
        "estimate_within_2_sd": float(np.mean(np.abs(error) < 2 * course.estimate_sd)),
    }


def table(course: Course) -> bytes:
    """Return the course as a CSV file."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time_s", "target_D", "accommodation_D", "estimate_D", "estimate_sd_D"])
    columns = (course.times, course.target, course.accommodation, course.estimate, course.estimate_sd)
    writer.writerows([f"{value:.4f}" for value in row] for row in zip(*columns, strict=True))
    return text.getvalue().encode()


def draw(course: Course, target: TargetCourse) -> Any:
    """Draw target, estimate with two standard deviations, and focus over time."""
    from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style

    with style():
        figure = new_figure(150, 80, layout="constrained")
        ax = figure.subplots()
        low, high = (course.estimate + way * 2 * course.estimate_sd for way in (-1, 1))
        ax.fill_between(course.times, low, high, color=BLUE, alpha=0.2, linewidth=0)
        # Between the eye's moments, too: a smooth target is smooth, and a step is where it happens.
        fine = np.arange(0, float(course.times[-1]) + DRAWN_S, DRAWN_S)
        ax.plot(fine, [target.at(float(t)) for t in fine], color=GREY, linewidth=1.2, label="target")
        ax.plot(course.times, course.estimate, color=BLUE, linewidth=0.9, label="estimate of its vergence, ± 2 sd")
        ax.plot(course.times, course.accommodation, color=ORANGE, linewidth=1.4, label="accommodation")
        every = np.concatenate([course.target, course.accommodation])
        margin = 0.25 * max(1.0, float(np.ptp(every)))
        ax.set(xlabel="time (s)", ylabel="vergence (D)", xlim=(0, float(course.times[-1])))
        ax.set_ylim(float(every.min()) - margin, float(every.max()) + 1.6 * margin)
        ax.set_title(f"A simulated eye that focuses by its own estimate of depth: {target.title or target.words}")
        ax.legend(loc="upper left", ncols=3)
        figure.draw_without_rendering()
    return figure


def retina(course: Course, eye: Accommodation, seed: int) -> list[NDArray[np.uint8]]:
    """Return the retinal image of a grey texture in white light at every moment, in colour: RGB frames."""
    from focalgradient.eye import Cones, Eye, Target

    target, frames = Target(contrast=0.35), []
    random = np.random.default_rng(seed)
    for vergence, focus in zip(course.target, course.accommodation, strict=True):
        cones = [Cones(Eye(eye.pupil_diameter, float(focus)), "L+M", (nm,)) for nm in CHANNELS_NM]
        views = target.views(cones, float(vergence), noise=0.0, random=random, texture=seed)
        light = np.clip(np.stack([view.image for view in views], axis=-1) / 2, 0, 1) ** (1 / 2.2)
        small = np.rint(255 * light).astype(np.uint8)
        frames.append(small.repeat(ENLARGED, axis=0).repeat(ENLARGED, axis=1))
    return frames
