"""Motion of an accommodation target in depth, from its short form or from a table."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from focalgradient.errors import InputError
from focalgradient.eye.accommodation import Accommodation, target_course
from focalgradient.files import LARGEST_LIST, printable
from focalgradient.files.cells import as_number, name_and_unit
from focalgradient.files.tables import read_cells

__all__ = ["TargetMotion"]

DURATION_S, LONGEST_S = 10.0, 120.0
"""Default and maximum duration of a course, in seconds."""

STEP_S, AFTER_STEP_S = 1.0, 5.0
"""Default time of a step, and minimum time shown after it, in seconds."""

FORMS = "step:FROM,TO[,SECOND], sine:MEAN,AMPLITUDE,HZ or a CSV file of time,dioptres"


@dataclass(frozen=True, slots=True)
class TargetMotion:
    """Vergence of a target over time.

    Parameters
    ----------
    at
        Vergence in dioptres at a time in seconds, for `accommodate`.
    duration
        Duration in seconds.
    text, title
        Short form or file name, and description.
    file
        File that it was read from.

    Examples
    --------
    >>> [TargetMotion.parse(text).at(1.0) for text in ("step:1,3", "sine:2,0.5,0.25")]
    [3.0, 2.5]
    """

    at: Callable[[float], float]
    duration: float
    text: str
    title: str
    file: Path | None = None

    @classmethod
    def parse(cls, motion: str) -> TargetMotion:
        """Parse "step:FROM,TO[,SECOND]" or "sine:MEAN,AMPLITUDE,HZ" (D, s, Hz), or read a CSV file of time,dioptres.

        Raises
        ------
        InputError
            If the text has no such form, the file cannot be read, or a number is out of its range.
        """
        kind, colon, rest = motion.partition(":")
        if not motion:
            raise InputError(f"motion is empty, but must be {FORMS}.")
        if not colon or kind not in ("step", "sine"):
            if not motion.lower().endswith((".csv", ".tsv", ".txt")) and not Path(motion).exists():
                raise InputError(f"motion is {printable(motion)!r}, but must be {FORMS}.")
            return cls.read(motion)
        numbers = _numbers(rest.split(","))
        if kind == "step" and len(numbers) in (2, 3):
            before, after, second = (*numbers, STEP_S)[:3]
            latest = LONGEST_S - AFTER_STEP_S
            if not 0 <= second <= latest:
                raise InputError(f"motion {motion} steps at {second:g} s, but must step between 0 and {latest:g} s.")
            duration, title = max(DURATION_S, second + AFTER_STEP_S), f"step from {before:g} to {after:g} D"
            return cls(lambda t: after if t >= second else before, duration, motion, title)
        if kind == "sine" and len(numbers) == 3:
            mean, amplitude, hertz = numbers
            most = Accommodation().rate / 2  # Nyquist frequency of the eye's moments
            if not 0 < hertz < most:
                raise InputError(f"motion {motion} has {hertz:g} Hz, but must be above 0 and below {most:g} Hz.")
            title = f"{mean:g} ± {amplitude:g} D at {hertz:g} Hz"
            return cls(lambda t: mean + amplitude * math.sin(2 * math.pi * hertz * t), DURATION_S, motion, title)
        raise InputError(f"motion is {printable(motion)!r}, but must be {FORMS}.")

    @classmethod
    def read(cls, path: str | Path) -> TargetMotion:
        """Read a table of time (s) and vergence (D), with or without a header; two rows of one time are a step."""
        cells = read_cells(path, "a target's course", largest=LARGEST_LIST, header=False, spaces=True, columns=2)
        name, points = cells.name, cells.with_points()
        if len(points.rows) < 2 or any(len(row) != 2 for row in points.rows):
            raise InputError(f"{name} must contain at least two lines of time,dioptres, in seconds and dioptres.")
        units = [_unit(name, heading, column) for column, heading in enumerate(points.header or ("", ""))]
        times = np.array(points.numbers(0, "a number of seconds")) * units[0]
        if units[1] > 0:
            vergences = np.array(points.numbers(1, "a number of dioptres")) * units[1]
        else:
            vergences = -1 / (np.array(points.numbers(1, "above 0", lowest=math.ulp(0.0))) * units[1])
        if np.any(np.diff(times) < 0) or times[0] < 0:
            raise InputError(f"{name} has times that decrease or are negative: sort its lines by time.")
        if not 0 < times[-1] <= LONGEST_S:
            raise InputError(f"{name} ends at {times[-1]:g} s, but must end by {LONGEST_S:g} s.")
        return cls(target_course(times, vergences), float(times[-1]), name, name, Path(path))


SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "milliseconds": 1e-3, "min": 60.0}
VERGENCES = {
    **dict.fromkeys(("", "d", "dpt", "diopters", "dioptres", "diopter", "dioptre"), 1.0),
    "m": -1.0,
    "cm": -0.01,
    "mm": -0.001,
}
"""Units that the headings of a course may state, with the factor to seconds and dioptres; negative: of distances."""

COUNTS = ("frame", "sample", "index", "row", "trial")
OTHER_COLUMN = ((*COUNTS, "diopt", "vergence", "distance"), (*COUNTS, "time", "zeit", "temps", "second"))
"""Beginnings of names that the first and the second column may not have."""


def _unit(name: str, heading: str, column: int) -> float:
    """Return the factor of the unit that a heading states; negative if the column holds distances.

    >>> _unit("x.csv", "time (ms)", 0), _unit("x.csv", "distance_m", 1), _unit("x.csv", "dioptres", 1)
    (0.001, -1.0, 1.0)
    """
    text, unit = name_and_unit(heading)
    known = (SECONDS, VERGENCES)[column]
    unit = unit or (text if text in known else "")
    if not unit and (text.startswith(OTHER_COLUMN[column]) or text in (VERGENCES, SECONDS)[column]):
        unit = text
    if column == 1 and not unit and "distance" in text:
        unit = "distance of unknown unit"
    if unit not in known or (column == 1 and "distance" in text and known[unit] > 0):
        wanted = "seconds" if column == 0 else "dioptres, or of distances in metres"
        raise InputError(f"{name}: the heading {heading!r} is of {unit}, but must be of {wanted}: convert the column.")
    return known[unit]


def _numbers(texts: list[str]) -> list[float]:
    """Return texts as numbers; an empty list unless all are finite."""
    numbers = [number for text in texts if (number := as_number(text)) is not None]
    return numbers if len(numbers) == len(texts) else []
