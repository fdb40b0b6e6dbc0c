"""Numerical exclusion criteria, stated before the data are seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from focalgradient.analyses import Analysis
from focalgradient.errors import InputError, check_fields
from focalgradient.quantities import Range

__all__ = [
    "BOUND",
    "OF_CUBE",
    "OF_RATINGS",
    "OF_TRIALS",
    "SHORTEST_BOTH",
    "WORDING",
    "AnalysisOptions",
    "Rules",
]

SHORTEST_BOTH = 0.25
"""Minimum overlap in seconds of both keys to count as a "both" report: about a simple reaction time (Luce 1986), by
which the release of one key may lag the press of the other.
"""

BOUND = 1.2
"""Default equivalence bound: ratio of the depth effect at the largest aperture within which it counts as zero."""


class Wording(NamedTuple):
    """Texts of a field of `Rules`, and the answers that it applies to.

    Parameters
    ----------
    meaning
        Comment in a file of rules.
    name
        Name in lists of rules.
    clause
        Methods: a clause on trials, or the end of "subjects were left out who"; fields of `rules` in braces.
    reason
        Reason why a subject was excluded, with the limit in braces; "" if the rule excludes single trials or nobody.
    clause_of_cube
        Clause for the cube, where it differs.
    defines
        Rule whose measure the field defines; it excludes nobody by itself.
    ratings, cube
        Whether it applies to depth ratings, and to reports on the cube.
    """

    meaning: str
    name: str = ""
    clause: str = ""
    reason: str = ""
    clause_of_cube: str = ""
    defines: str = ""
    ratings: bool = True
    cube: bool = False


WORDING: Mapping[str, Wording] = {
    "response_time": Wording(
        "a depth rating given in less or in more time (s) is left out",
        "bounds of the response time",
        "ratings given in less than {rules.response_time[0]:g} s or more than {rules.response_time[1]:g} s were left "
        "out",
    ),
    "dropped_frames": Wording(
        "a trial with more dropped frames is left out; false: they are counted only",
        "dropped frames",
        "trials with more than {rules.dropped_frames} dropped frames were left out",
        cube=True,
    ),
    "catch_factor": Wording("a rating of the standard passes within this factor of 1", defines="catch_passed"),
    "catch_share": Wording(
        "a truly nonrigid cube passes when reported so for this share of the time with a report",
        defines="catch_passed",
        ratings=False,
        cube=True,
    ),
    "catch_passed": Wording(
        "least share of catch trials that a subject must pass; false: nobody is left out",
        "catch trials",
        "passed less than {rules.catch_passed:.0%} of the catch trials ({catch})",
        "passed less than {:.0%} of the catch trials",
        cube=True,
    ),
    "repeat_factor": Wording(
        "largest spread (geometric SD) of answers to one picture; false: nobody is left out",
        "spread of repeated answers",
        "spread answers to one picture by more than a factor {rules.repeat_factor:g} (geometric SD)",
        "answers to one picture spread by more than a factor {:g}",
    ),
    "lapse_factor": Wording("an answer farther than this factor from its expectation is a lapse", defines="lapses"),
    "lapses": Wording(
        "largest share of lapses; false: nobody is left out",
        "lapses",
        "differed by more than a factor {rules.lapse_factor:g} from the expected answer on more than "
        "{rules.lapses:.0%} of the trials (expected from their own median for the condition, and all subjects’ answers "
        "to the picture or their own to its scene)",
        "more than {:.0%} lapses",
        "held no key or both for more than {rules.lapses:.0%} of the time in trials without a gradient",
        cube=True,
    ),
    "shortest_both": Wording("both keys held for less (s) is a change of keys and no report", ratings=False, cube=True),
    "fast": Wording(
        "largest share of answers in less than the shortest time; false: nobody is left out",
        "fast answers",
        "answered too fast in more than {rules.fast:.0%} of the trials",
        "answered too fast in more than {:.0%} of the trials",
    ),
    "same_answer": Wording(
        "largest share of one and the same answer to pictures that must differ; false: nobody is left out",
        "one and the same answer",
        "gave one and the same answer to more than {rules.same_answer:.0%} of the pictures whose answers must differ "
        "whatever blur does",
        "gave one and the same answer to more than {:.0%} of pictures that must differ",
    ),
    "first_press": Wording(
        "largest share of answers left at the first place of the marker; false: nobody is left out",
        "answers left at the marker’s first place",
        "left the answer where the marker first stood in more than {rules.first_press:.0%} of the trials, "
        "chance taken off",
        "left more than {:.0%} of the answers where the marker first stood",
    ),
}
"""Wording of each field of `Rules`, in the order of the fields."""

OF_TRIALS = tuple(name for name, rule in WORDING.items() if rule.clause and not rule.reason)
"""Rules that exclude single trials."""

OF_RATINGS = tuple(name for name, rule in WORDING.items() if rule.ratings)
"""Fields of `Rules` that apply to depth ratings."""

OF_CUBE = tuple(name for name, rule in WORDING.items() if rule.cube)
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
    dropped_frames: Annotated[int, Range("frames", 0)] | None = None
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
