"""Records of published experiments: findings, their sources, and the scoring rule for predictions."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np

from focalgradient.errors import InputError, check_fields
from focalgradient.observers import Observer
from focalgradient.quantities import Range

__all__ = [
    "AGREES",
    "CANNOT_BE_ASKED",
    "DIFFERS",
    "UNDECIDED",
    "Finding",
    "Prediction",
    "Published",
    "Source",
    "mean_of",
    "ratio_of",
    "simulate",
]

Source = Literal["full text", "abstract", "secondary"]
"""Source of a number or direction: the paper, its abstract, or another publication."""

AGREES, DIFFERS, UNDECIDED, CANNOT_BE_ASKED = "agrees", "differs", "undecided", "cannot be asked"

STANDARD_ERRORS = 2.0
"""Half-width of the interval of a prediction, and of a printed mean, in standard errors."""


@dataclass(frozen=True, slots=True)
class Prediction:
    """Prediction of a simulated observer: value, and standard error over repetitions (0 without repetitions)."""

    value: Annotated[float, Range("the units of the finding")]
    standard_error: Annotated[float, Range("the units of the finding", 0)] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)


def mean_of(values: Sequence[float]) -> Prediction:
    """Return the mean of repetitions, with its standard error.

    >>> mean_of([1.0, 2.0, 3.0])
    Prediction(value=2.0, standard_error=0.5773502691896258)
    """
    return Prediction(float(np.mean(values)), float(np.std(values, ddof=1)) / math.sqrt(len(values)))


def ratio_of(logarithms: Sequence[float]) -> Prediction:
    """Return the geometric mean of repeated ratios, given their logarithms, with its standard error.

    >>> ratio_of([0.0, 0.0])
    Prediction(value=1.0, standard_error=0.0)
    """
    log = mean_of(logarithms)
    return Prediction(math.exp(log.value), math.exp(log.value) * log.standard_error)


def jackknife(value: float, left_out: Sequence[float]) -> Prediction:
    """Return an estimate with its jackknife standard error, from the estimates that each omit one part.

    >>> jackknife(2.0, [2.5, 2.0, 1.5])
    Prediction(value=2.0, standard_error=0.5773502691896258)
    """
    return Prediction(value, float(np.std(left_out)) * (len(left_out) - 1) ** 0.5)


Ask = Callable[[Observer], Prediction]
"""Function that runs the experiment with a simulated observer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """Number or direction found in an experiment.

    The scoring rule was fixed before any prediction was computed: `AGREES` if the value +- 2 standard errors lies
    inside the range from `low` to `high` (ends excluded); `DIFFERS` if it lies outside; `UNDECIDED` if it contains an
    end of the range, which does not count as agreement; `CANNOT_BE_ASKED` without a prediction. The range is the
    printed one, or a printed mean +- 2 standard errors, or the printed side of no effect.

    Parameters
    ----------
    quantity, units
        Measured quantity and its unit; "1" for ratios and proportions.
    printed
        Number or statement as printed by the source.
    low, high
        Range of agreement in `units`; infinite on the open side of a direction.
    source
        Source of the number or statement.
    taken
        Property of the observer that was taken from this finding or a similar one; empty if the prediction is
        independent.
    ask
        Function that asks an observer; None if the observer cannot be asked.
    remark
        Reason why the observer cannot be asked; otherwise choices made in the simulation.

    Raises
    ------
    InputError
        If a field has the wrong type, the range is empty or unbounded, a text is missing, or both `ask` and the reason
        for its absence are missing.

    Examples
    --------
    >>> found = Finding(
    ...     quantity="Weber fraction", units="1", printed="0.28 to 0.56", low=0.28, high=0.56, source="abstract",
    ...     remark="an example",
    ... )
    >>> found.score(Prediction(0.4)), found.score(Prediction(0.3, 0.02)), found.score(None)
    ('agrees', 'undecided', 'cannot be asked')
    """

    quantity: str
    units: str
    printed: str
    low: float
    high: float
    source: Source
    taken: str = ""
    ask: Ask | None = None
    remark: str = ""

    def __post_init__(self) -> None:
        check_fields(self)
        for name in ("quantity", "units", "printed"):
            if not getattr(self, name).strip():
                raise InputError(f"{name} is empty: state it for each finding.")
        if not self.low < self.high or (math.isinf(self.low) and math.isinf(self.high)):
            raise InputError(
                f"{self.quantity} has the range {self.low:g} to {self.high:g}: give a low end below the high one, and "
                "one of them finite."
            )
        if not (self.ask is None or callable(self.ask)):
            raise InputError(f"{self.quantity} has an ask that cannot be called: give a function of an observer.")
        if self.ask is None and not self.remark.strip():
            raise InputError(f"{self.quantity} has no way to ask an observer: state the reason as its remark.")

    def score(self, prediction: Prediction | None) -> str:
        """Score a prediction by the rule of the class."""
        if prediction is None:
            return CANNOT_BE_ASKED
        reach = STANDARD_ERRORS * prediction.standard_error
        least, most = prediction.value - reach, prediction.value + reach
        if self.low < least and most < self.high:
            return AGREES
        return DIFFERS if most <= self.low or least >= self.high else UNDECIDED


@dataclass(frozen=True, slots=True, kw_only=True)
class Published:
    """Published experiment.

    Parameters
    ----------
    key
        Key in the bibliography, with a suffix for a paper's second experiment. For keys in `stimuli.PAPERS`,
        ``stimuli.replica(key, condition)`` draws the stimuli.
    citation
        Authors, year (four digits) and journal; at the end, which experiment of the paper, if there are several.
    doi
        DOI as printed by a source; empty if not verified.
    design
        Design in one sentence.
    conditions
        Names of the conditions.
    findings
        Findings; empty if no text at hand prints a result.
    settings
        Settings of the design for people, including its task; empty if people cannot be tested here.
    needs
        Apparatus or pictures without which people cannot be tested; empty if they can.

    Raises
    ------
    InputError
        If a field has the wrong type or is empty, or two findings have the same name.
    """

    key: str
    citation: str
    doi: str
    design: str
    conditions: tuple[str, ...]
    findings: tuple[Finding, ...]
    settings: Mapping[str, str] = field(default_factory=dict)
    needs: str = ""

    def __post_init__(self) -> None:
        check_fields(self)
        for name in ("key", "citation", "design"):
            if not getattr(self, name).strip():
                raise InputError(f"{name} is empty: state it for each published experiment.")
        if not self.design.endswith("."):
            raise InputError(f"design is {self.design!r}: end the sentence with a full stop.")
        if not re.search(r"\b\d{4}\b", self.citation):
            raise InputError(f"citation is {self.citation!r}: give the year in four digits.")
        if self.doi and not self.doi.startswith("10."):
            raise InputError(f"doi is {self.doi!r}, but must begin with 10., or be empty where it was not verified.")
        quantities = [finding.quantity for finding in self.findings]
        if not self.conditions or len(set(quantities)) < len(quantities):
            raise InputError(f"{self.key} needs conditions, and findings of different names.")
        if bool(self.settings) == bool(self.needs.strip()):
            raise InputError(f"{self.key} needs the settings of a design, or the missing conditions: give one.")

    def design_text(self) -> str:
        """Return the design for people or simulated observers as the text of a design file (TOML).

        It is run by ``focalgradient run TASK --design FILE``, ``serve`` or ``simulate``.

        Raises
        ------
        InputError
            If the stimuli need unavailable apparatus or pictures; the message names them.

        Examples
        --------
        >>> from focalgradient.published import EXPERIMENTS
        >>> print(EXPERIMENTS["mather1996"].design_text(), end="")
        task = "published"
        experiment = "mather1996"
        """
        if self.needs:
            raise InputError(f"{self.short} cannot be run here: it needs {self.needs}.")
        return "".join(f'{name} = "{value}"\n' for name, value in self.settings.items())

    @property
    def short(self) -> str:
        """Authors and year, and which experiment of the paper, if there are several."""
        authors, year, rest = re.split(r"(\d{4})", self.citation, maxsplit=1)
        return authors + year + (f" ({rest.rpartition(', ')[2]})" if rest.endswith("experiment") else "")


def simulate(experiment: Published, observer: Observer) -> Mapping[str, Prediction | None]:
    """Predict each finding of an experiment with a simulated observer.

    Returns
    -------
    Mapping
        Prediction of each quantity; None if the observer cannot be asked.

    Raises
    ------
    InputError
        If the experiment or the observer has the wrong type.

    Examples
    --------
    >>> from focalgradient.observers import OBSERVERS
    >>> from focalgradient.published import EXPERIMENTS
    >>> predicted = simulate(EXPERIMENTS["jacobs1989"], OBSERVERS["default"])
    >>> round(predicted["least noticeable defocus"].value, 2)
    0.13
    """
    for name, given, kind in (("experiment", experiment, Published), ("observer", observer, Observer)):
        if not isinstance(given, kind):
            raise InputError(f"{name} is of the class {type(given).__name__}, but must be of {kind.__name__}.")
    return {finding.quantity: None if finding.ask is None else finding.ask(observer) for finding in experiment.findings}
