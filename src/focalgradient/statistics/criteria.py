"""Numerical exclusion criteria, stated before the data are seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from focalgradient.analyses import Analysis
from focalgradient.errors import InputError, check_fields
from focalgradient.quantities import Range

__all__ = ["BOUND", "OF_CUBE", "OF_RATINGS", "SHORTEST_BOTH", "AnalysisOptions", "Rules"]

SHORTEST_BOTH = 0.25
"""Minimum overlap in seconds of both keys to count as a "both" report: about a simple reaction time (Luce 1986), by
which the release of one key may lag the press of the other.
"""

BOUND = 1.2
"""Default equivalence bound: ratio of the depth effect at the largest aperture within which it counts as zero."""

OF_RATINGS = (
    *("response_time", "dropped_frames", "catch_factor", "catch_passed", "repeat_factor", "lapse_factor", "lapses"),
    *("fast", "same_answer", "first_press"),
)
"""Fields of `Rules` that apply to depth ratings."""

OF_CUBE = ("dropped_frames", "catch_share", "catch_passed", "lapses", "shortest_both")
"""Fields of `Rules` that apply to reports on the cube."""


SHARE = Range("shares", 0, 1)


@dataclass(frozen=True, slots=True)
class Rules:
    """Exclusion and analysis rules; None switches a rule off: its measure is still counted, but excludes nobody.

    Parameters
    ----------
    response_time
        Minimum and maximum response time, in seconds; depth ratings outside are excluded.
    dropped_frames
        Maximum number of dropped frames; trials with more are excluded.
    catch_factor
        Maximum factor between the rating of the standard itself (a catch trial) and its correct value, 1.
    catch_share
        Minimum proportion of the reported time that a physically nonrigid cube (a catch trial) is seen as nonrigid.
    catch_passed
        Minimum proportion of catch trials that a subject must pass.
    repeat_factor
        Maximum geometric standard deviation of a subject's answers to the same picture.
    lapse_factor
        Factor of deviation that makes an answer a lapse: relative to the subject's other answers at that aperture and
        fixation, and to all subjects' answers to that picture; see `quality`.
    lapses
        Maximum proportion of lapses; for the cube, of the time without a gradient during which no key or both were
        held.
    shortest_both
        Minimum duration of a "both" report on the cube, in seconds; a shorter overlap of the keys counts as a
        transition.
    fast
        Maximum proportion of answers faster than the minimum response time.
    same_answer
        Maximum proportion of identical answers (for choices: of the same key) among pictures whose answers must differ
        regardless of blur: catch trials with different correct answers, else pinhole pictures of scenes whose
        differences most subjects agree on. Without such pictures the rule cannot be applied.
    first_press
        Maximum chance-corrected proportion of answers left at the random starting position of the marker.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    response_time: tuple[float, float] | None = (0.3, 60.0)
    dropped_frames: int | None = None
    catch_factor: float = 2.0
    catch_share: Annotated[float, SHARE] = 0.5
    catch_passed: Annotated[float, SHARE] | None = 0.7
    repeat_factor: float | None = 2.0
    lapse_factor: float = 3.0
    lapses: Annotated[float, SHARE] | None = 0.2
    shortest_both: Annotated[float, Range("seconds", 0)] = SHORTEST_BOTH
    fast: Annotated[float, SHARE] | None = 0.2
    same_answer: Annotated[float, SHARE] | None = 0.9
    first_press: Annotated[float, SHARE] | None = 0.5

    def __post_init__(self) -> None:
        check_fields(self)
        if self.response_time is not None and not 0 <= self.response_time[0] < self.response_time[1]:
            raise InputError(
                f"response_time is {self.response_time!r}, but must be a shortest and a longest time in seconds."
            )
        for name in ("catch_factor", "repeat_factor", "lapse_factor"):
            value = getattr(self, name)
            if value is not None and not value > 1:
                raise InputError(f"{name} is {value!r}, but must be a factor above 1.")
        if self.dropped_frames is not None and self.dropped_frames < 0:
            raise InputError(f"dropped_frames is {self.dropped_frames!r}, but must be a number of frames, 0 or more.")


@dataclass(frozen=True, slots=True, kw_only=True)
class AnalysisOptions:
    """What a report may set of an analysis.

    Parameters
    ----------
    bound
        Equivalence bound, a ratio.
    rules
        Exclusion rules.
    scale
        Analysis of ratings, or its name; None: that of the design.
    """

    bound: float = BOUND
    rules: Rules = Rules()
    scale: Analysis | str | None = None
