"""Questions about values of subjects x scenes, tested over both and over subjects for these scenes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import pandas as pd
from numpy.typing import ArrayLike

from focalgradient.statistics.crossed import crossed_effect, over_subjects
from focalgradient.statistics.questions import HERE, Answers, Question, Tested, Tests, in_r
from focalgradient.statistics.records import Effect, NotComputed

__all__ = ["OVER_SCENES", "OVER_SUBJECTS", "Way", "in_two_ways"]

Values = Callable[[Any], Mapping[str, pd.DataFrame | NotComputed]]
"""Function of the data that returns the values of each level, or the reason why there are none."""


class Way(NamedTuple):
    """Test of values: its function, its name in R, and the end of a question's name where another test decides."""

    test: Callable[[ArrayLike], Effect | NotComputed]
    in_r: str
    end: str

    def fit(self, values: Values) -> Callable[[Any], Tests]:
        """Return the fit of a question that tests values by level."""
        return lambda data: {
            level: found if isinstance(found, NotComputed) else Tested(self.test(found), found)
            for level, found in values(data).items()
        }


OVER_SCENES = Way(crossed_effect, "crossed", ", subjects and scenes")
OVER_SUBJECTS = Way(over_subjects, "over_subjects", HERE)


def in_two_ways(
    decides: Way,
    values: Values,
    tables: str,
    question: Question,
    sentence: Callable[[str, Answers], str] = lambda level, answers: "",
) -> tuple[Question, Question]:
    """Return a question about values by the test that decides, and by the other as a check.

    Parameters
    ----------
    decides
        `OVER_SCENES` or `OVER_SUBJECTS`.
    values
        Values by level, whose test replaces the fit of the question.
    tables
        Name of the R list of the values; empty without R code.
    question
        Question, with the R code that makes the list.
    sentence
        Finding of the check in words.

    Examples
    --------
    >>> asked = Question("rise", lambda data: {}, "primary")
    >>> [one.name for one in in_two_ways(OVER_SCENES, lambda data: {}, "rises", asked)]
    ['rise', 'rise, these scenes']
    """
    other = OVER_SUBJECTS if decides is OVER_SCENES else OVER_SCENES
    name, fit = question.name + other.end, other.fit(values)
    own, beside = (
        in_r(of, tables, way.in_r) if tables else "" for of, way in ((question.name, decides), (name, other))
    )
    check = Question(name, fit, "check", question.unit, ratio=question.ratio, sentence=sentence, r_code=beside)
    return replace(question, fit=decides.fit(values), r_code=question.r_code + own), check
