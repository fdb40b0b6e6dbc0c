"""Statistical analyses of the answers on a response scale; each scale names one, `statistics` computes it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from focalgradient.errors import InputError, described

__all__ = [
    "ANALYSES",
    "Analysis",
    "Choices",
    "OrdinalSteps",
    "Ratios",
    "Slopes",
    "analysis_named",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Analysis:
    """Statistical analysis of the answers, with the properties that the report and the exclusion criteria depend on.

    Parameters
    ----------
    name
        Name in arguments and tables, like "ratio".
    middle
        Answer that separates flatter from deeper; None if it depends on the design or is unknown.
    standard_known
        True if the standard itself has a correct answer.
    answers
        Noun phrase for the answers, completing "..., and these answers are".
    """

    name: str
    middle: float | None = None
    standard_known: bool = False
    answers: str = "steps or choices"

    ratios: ClassVar[bool] = False
    """True if answers are ratios: analysed on their logarithm; spread and lapses are judged as factors."""
    whole: ClassVar[bool] = False
    """True if answers must be integers."""
    positive: ClassVar[bool] = True
    """True if every answer is above 0."""
    signed: ClassVar[bool] = False
    """True if answers may be negative."""
    binary: ClassVar[bool] = False
    """True if there are only two answers, modelled by log odds."""
    compares_slopes: ClassVar[bool] = True
    """True if slopes are compared between two fixations."""
    experiments: ClassVar[int] = 60
    """Number of simulated experiments per sample size in the power analysis: some 20 s on one core."""
    seconds: ClassVar[float] = 0.004
    """Processor time in seconds, measured, to analyse one simulated experiment, per subject."""
    choices: ClassVar[tuple[str, ...]] = ("logarithm", "random", "equivalence", "holm")
    """Methodological choices, of which the report gives the reasons."""
    latent: ClassVar[bool] = False
    """True if power analysis simulates answers from this very model, so that the mean estimate equals the input."""

    @property
    def no_rises(self) -> str:
        """Reason why answers have no ratio analysis."""
        return "The answers compare two pictures: they have no ratios."

    @property
    def no_ratios(self) -> str:
        """Reason why the spread and lapse criteria do not apply."""
        return f"they apply to ratios, and these answers are {self.answers}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ratios(Analysis):
    """Depth effect: ratio of the answers at the largest aperture to the pinhole, with crossed subjects and scenes."""

    name: str = "ratio"
    middle: float | None = 1.0
    standard_known: bool = True
    ratios: ClassVar[bool] = True


@dataclass(frozen=True, slots=True, kw_only=True)
class OrdinalSteps(Analysis):
    """Cumulative-link mixed model (logit) of ordinal steps."""

    name: str = "ordinal"
    whole: ClassVar[bool] = True
    positive: ClassVar[bool] = False
    signed: ClassVar[bool] = True
    seconds: ClassVar[float] = 0.03
    choices: ClassVar[tuple[str, ...]] = ("ordinal", "random", "holm")
    experiments: ClassVar[int] = 8  # a model takes 0.5 to 2 s; the mean standard error is accurate to some 7 %
    latent: ClassVar[bool] = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Slopes(Analysis):
    """Least-squares slope of the answer on aperture (mm), with subjects and scenes as crossed random factors.

    Parameters
    ----------
    unit
        Unit of the answers, like "steps".
    mean
        The mean answer in words, like "mean step".
    alike
        Answer for two identical pictures, against which answers at the largest aperture are tested; None if the scale
        has no such answer.
    compared
        Meaning of the answers, completing "Pictures were compared with REFERENCE in"; empty if `alike` is None.
    """

    name: str
    unit: str
    mean: str
    alike: float | None = None
    compared: str = ""
    choices: ClassVar[tuple[str, ...]] = ("slopes", "random", "holm")
    positive: ClassVar[bool] = False
    signed: ClassVar[bool] = True

    @property
    def no_rises(self) -> str:
        """Reason why answers have no ratio analysis."""
        if self.alike is None:
            return f"The answers are {self.answers}: they have no ratios."
        return super(Slopes, self).no_rises


@dataclass(frozen=True, slots=True, kw_only=True)
class Choices(Analysis):
    """Least-squares slope of the choice proportion on aperture (mm), tested over subjects."""

    name: str = "choice"
    middle: float | None = 0.5
    unit: str = "share of choices"
    mean: str = "share of choices"
    alike: float | None = 0.5
    choices: ClassVar[tuple[str, ...]] = ("choice", "holm")
    positive: ClassVar[bool] = False
    binary: ClassVar[bool] = True
    experiments: ClassVar[int] = 30
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
"""Analysis of signed steps from flatter to deeper."""

ANALYSES: dict[str, Analysis] = {one.name: one for one in (Ratios(), OrdinalSteps(), BIPOLAR, Choices())}
"""Analyses by the name that the functions of `focalgradient.statistics` accept."""


def analysis_named(analysis: Analysis | str) -> Analysis:
    """Return the analysis with a given name; an `Analysis` is returned unchanged.

    Raises
    ------
    InputError
        If the name is unknown.

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
