"""Exclusion criteria as numbers, and the test that decides, stated before the data are seen."""

from __future__ import annotations

import math
from dataclasses import dataclass

from focalgradient.errors import InputError, check_fields
from focalgradient.statistics.cube import SHORTEST_BOTH
from focalgradient.statistics.hypotheses import robust_decides

__all__ = ["OF_CUBE", "OF_RATINGS", "Rules"]

OF_RATINGS = (
    *("response_time", "dropped_frames", "catch_factor", "catch_passed", "repeat_factor", "lapse_factor", "lapses"),
    *("fast", "same_answer", "first_press"),
)
"""Fields of `Rules` that concern depth ratings."""

OF_CUBE = ("dropped_frames", "catch_share", "catch_passed", "lapses", "shortest_both")
"""Fields of `Rules` that concern reports on the cube."""


@dataclass(frozen=True, slots=True)
class Rules:
    """Rules of exclusion and of analysis; with None a rule is off: it is counted, but leaves nobody out.

    Parameters
    ----------
    response_time
        Shortest and longest time to answer, in seconds: a depth rating outside is left out.
    dropped_frames
        Most frames a trial may drop, more and it is left out.
    catch_factor
        A rating of the standard itself (a catch trial) passes within this factor of 1, the standard's own.
    catch_share
        A physically nonrigid cube (a catch trial) passes when it is seen so for this share of the time with a reading.
    catch_passed
        Least share of catch trials that a subject must pass.
    repeat_factor
        Largest spread (geometric standard deviation) of a subject's answers to one and the same picture.
    lapse_factor
        An answer farther than this factor from what the subject's other answers to that aperture and fixation, and all
        subjects' answers to that picture, let expect is a lapse: see `quality`.
    lapses
        Largest share of lapses; with the cube, of the time without a gradient with no key or both held.
    shortest_both
        Both keys of the cube held for less than this, in seconds, is a change from one to the other and no report.
    fast
        Largest share of answers in less than the shortest response time.
    same_answer
        Largest share of answers that are one and the same (of a choice: given with the same key), of those that must
        differ whatever blur does: to catch trials with different right answers, else to scenes at the pinhole where
        most subjects agree on how the scenes differ. Elsewhere the rule cannot be applied.
    first_press
        Largest share of answers left where the first key had put the marker, at random, beyond what chance makes of it.
    deciding_test
        Of ratios, the test that decides: "robust" to skewed subjects, or Student's "t". It leaves nobody out.

    Raises
    ------
    InputError
        If a rule is out of range.
    """

    response_time: tuple[float, float] | None = (0.3, 60.0)
    dropped_frames: int | None = None
    catch_factor: float = 2.0
    catch_share: float = 0.5
    catch_passed: float | None = 0.7
    repeat_factor: float | None = 2.0
    lapse_factor: float = 3.0
    lapses: float | None = 0.2
    shortest_both: float = SHORTEST_BOTH
    fast: float | None = 0.2
    same_answer: float | None = 0.9
    first_press: float | None = 0.5
    deciding_test: str = "robust"

    def __post_init__(self) -> None:
        robust_decides(self.deciding_test)
        check_fields(self)
        if self.response_time is not None and not 0 <= self.response_time[0] < self.response_time[1]:
            raise InputError(
                f"response_time is {self.response_time!r}, but must be a shortest and a longest time in seconds."
            )
        for name in ("catch_share", "catch_passed", "lapses", "fast", "same_answer", "first_press"):
            value = getattr(self, name)
            if value is not None and not 0 <= value <= 1:
                raise InputError(f"{name} is {value!r}, but must be a share from 0 to 1.")
        for name in ("catch_factor", "repeat_factor", "lapse_factor"):
            value = getattr(self, name)
            if value is not None and not value > 1:
                raise InputError(f"{name} is {value!r}, but must be a factor above 1.")
        if not 0 <= self.shortest_both < math.inf:
            raise InputError(f"shortest_both is {self.shortest_both!r}, but must be a time in seconds, 0 or more.")
        if self.dropped_frames is not None and self.dropped_frames < 0:
            raise InputError(f"dropped_frames is {self.dropped_frames!r}, but must be a number of frames, 0 or more.")
