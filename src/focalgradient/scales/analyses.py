"""The statistics that answers on a scale can be analysed by; a scale names one, the room `statistics` computes it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from focalgradient.errors import InputError, described

__all__ = [
    "ANALYSES",
    "AS_GIVEN",
    "LOGARITHM",
    "RANKS",
    "Analysis",
    "Choices",
    "OrdinalSteps",
    "Ratios",
    "Slopes",
    "analysis_named",
]

LOGARITHM, AS_GIVEN, RANKS = "logarithm", "as given", "ranks"
"""Transformations of answers; ranks are each subject's own, as shares of the highest."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysis:
    """A statistic, with what the report and the exclusion criteria need to know of the answers.

    Parameters
    ----------
    name
        Name in arguments and tables, like "ratio".
    middle
        Answer between flatter and deeper; None where the design decides it or it is not known.
    standard_known
        Whether some answer to the standard itself is right.
    answers
        What the answers are, to complete "..., and these answers are".
    """

    name: str
    middle: float | None = None
    standard_known: bool = False
    answers: str = "steps or choices"

    ratios: ClassVar[bool] = False
    """Whether answers are ratios: analysed on their logarithm, and judged by spread and lapses, which are factors."""
    whole: ClassVar[bool] = False
    """Whether answers must be whole numbers."""
    positive: ClassVar[bool] = True
    """Whether every answer is above 0."""
    signed: ClassVar[bool] = False
    """Whether answers may be below 0."""
    binary: ClassVar[bool] = False
    """Whether there are two answers only, modelled by log odds."""
    compares_slopes: ClassVar[bool] = True
    """Whether the slopes of two fixations are compared."""
    experiments: ClassVar[int] = 60
    """Simulated experiments of each size for the power: as many as take some 20 s on one core."""
    seconds: ClassVar[float] = 0.004
    """Processor time (s) of the analysis of one simulated experiment for each of its subjects: measured."""
    latent: ClassVar[bool] = False
    """Whether the statistic is the model by which power simulates answers, so that its mean is what was put in."""

    transformations: ClassVar[tuple[str, ...]] = (AS_GIVEN, RANKS)
    """Transformations of the answers under which data are re-analysed; the first is that of the main analysis."""

    @property
    def no_rises(self) -> str:
        """Reason for which there is no analysis of ratios."""
        return "The answers compare two pictures: they have no ratios."

    @property
    def no_ratios(self) -> str:
        """Reason for which the criteria of spread and lapses cannot be applied."""
        return f"it is judged of ratios, and these answers are {self.answers}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ratios(Analysis):
    """Rise of the log ratio from the pinhole to the largest aperture, subjects and scenes crossed."""

    name: str = "ratio"
    middle: float | None = 1.0
    standard_known: bool = True
    ratios: ClassVar[bool] = True
    transformations: ClassVar[tuple[str, ...]] = (LOGARITHM, AS_GIVEN, RANKS)


@dataclass(frozen=True, slots=True, kw_only=True)
class OrdinalSteps(Analysis):
    """Cumulative-link mixed model (logit) of ordinal steps."""

    name: str = "ordinal"
    whole: ClassVar[bool] = True
    seconds: ClassVar[float] = 0.03
    experiments: ClassVar[int] = 8  # a model takes 0.5 to 2 s; the mean standard error is known to some 7 %
    latent: ClassVar[bool] = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Slopes(Analysis):
    """Least-squares slope of the answer on the aperture (mm) of each subject and scene, both crossed as random.

    Parameters
    ----------
    unit
        Unit of the answers, like "steps".
    mean
        The mean answer in words, like "mean step".
    alike
        Answer to two pictures that are alike, which answers at the largest aperture are tested against; None where the
        scale has no such answer.
    compared
        What is answered, to complete "Pictures were compared with REFERENCE in"; empty where `alike` is None.
    """

    name: str
    unit: str
    mean: str
    alike: float | None = None
    compared: str = ""
    positive: ClassVar[bool] = False
    signed: ClassVar[bool] = True

    @property
    def no_rises(self) -> str:
        if self.alike is None:
            return f"The answers are {self.answers}: they have no ratios."
        return super(Slopes, self).no_rises


@dataclass(frozen=True, slots=True, kw_only=True)
class Choices(Analysis):
    """Least-squares slope of the share of choices on the aperture (mm) of each subject and scene, both as random."""

    name: str = "choice"
    middle: float | None = 0.5
    unit: str = "share of choices"
    mean: str = "share of choices"
    alike: float | None = 0.5
    positive: ClassVar[bool] = False
    binary: ClassVar[bool] = True
    experiments: ClassVar[int] = 30
    transformations: ClassVar[tuple[str, ...]] = (AS_GIVEN,)  # ranks of two answers are the answers
    compares_slopes: ClassVar[bool] = False


BIPOLAR = Slopes(
    name="bipolar",
    middle=0.0,
    standard_known=True,
    unit="steps",
    mean="mean step",
    alike=0.0,
    compared="from much flatter to much deeper, 0 being alike",
)
"""Of steps from flatter to deeper."""

ANALYSES: dict[str, Analysis] = {one.name: one for one in (Ratios(), OrdinalSteps(), BIPOLAR, Choices())}
"""By the name that the functions of `focalgradient.statistics` take."""


def analysis_named(analysis: Analysis | str) -> Analysis:
    """Return the analysis of a name; an `Analysis` is returned as it is.

    Raises
    ------
    InputError
        If there is none of that name.

    Examples
    --------
    >>> analysis_named("choice").middle
    0.5
    """
    if isinstance(analysis, Analysis):
        return analysis
    if not (isinstance(analysis, str) and analysis in ANALYSES):
        raise InputError(f"scale is {described(analysis)}, but must be one of {', '.join(_names())}.")
    return ANALYSES[analysis]


def _names() -> Iterator[str]:
    return map(repr, ANALYSES)
