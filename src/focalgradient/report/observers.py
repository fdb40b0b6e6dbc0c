"""Section of the report on simulated observers, fitted by maximum likelihood and cross-validated over people."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from focalgradient.observers import AnswerModel, Answers, ObserverComparison, PersonModel, compare_observers
from focalgradient.observers.blur_rules import blur_choices, blur_ratings
from focalgradient.observers.percept_rules import PERCEPT_OBSERVERS
from focalgradient.observers.transducers import transducer_observers
from focalgradient.progress import Progress
from focalgradient.report.document import Block, Heading, Notice, Paragraph
from focalgradient.report.parts import Output, Part
from focalgradient.report.tables import Sheet, listed, sheet
from focalgradient.scales import Analysis
from focalgradient.statistics import NotComputed
from focalgradient.statistics.cube import percepts_in_order
from focalgradient.statistics.questions import Kind
from focalgradient.statistics.wording import decimals, probability

__all__ = ["FittedObservers", "Observed", "fitted_observers", "observed_ratings", "observed_thresholds"]

FEWEST_PEOPLE = 3
"""Minimum number of people for cross-validation over people with a standard deviation over the others."""


@dataclass(frozen=True, slots=True)
class Observed:
    """Answers of one task, and observers to be fitted to them.

    Parameters
    ----------
    answers
        Answers of all people.
    observers
        Observers by name.
    method
        Description of the observers for the methods.
    """

    answers: Answers
    observers: Mapping[str, AnswerModel | PersonModel]
    method: str


def _too_few(table: pd.DataFrame) -> NotComputed | None:
    people = int(table["participant_id"].nunique())
    if people >= FEWEST_PEOPLE:
        return None
    return NotComputed(
        f"Observers are compared by people held out, which needs {FEWEST_PEOPLE} of them, and there are {people}."
    )


def observed_ratings(kept: pd.DataFrame, analysis: Analysis) -> Observed | NotComputed:
    """Prepare depth ratings or choices; scene means are removed, so that all observers account for scenes equally."""
    if analysis.whole:
        return NotComputed("Steps of a scale have no observer to fit: a normal error of ordinal steps is not assumed.")
    table = kept[~kept["catch"]]
    if other := sorted(set(table["fixation"]) - {"nearest", "farthest"}):
        return NotComputed(f"The observers know the foci nearest and farthest, and these trials have {other[0]}, too.")
    if few := _too_few(table):
        return few
    aperture = table["aperture_mm"].to_numpy(float)
    nearest = (table["fixation"] == "nearest").to_numpy(float)
    if np.ptp(aperture) == 0:
        return NotComputed("All pictures have one aperture: no observer differs from another in what it predicts.")
    who, shown = table["participant_id"].to_numpy(), {"aperture": aperture, "nearest": nearest}
    rules = "They see a defocus in proportion to the aperture and differ in what blur means with each object in focus."
    answer = pd.Series(table["rating"].to_numpy(float))
    if analysis.binary:
        method = f"{rules} Choices follow a cumulative normal; each person’s sensitivity is their own."
        return Observed(Answers(who, shown, np.asarray(answer, float)), blur_choices(aperture, nearest), method)
    rated = pd.Series(np.log(answer.to_numpy())) if analysis.ratios else answer
    rated = rated - rated.groupby(table["scene"].to_numpy()).transform("mean") + rated.mean()
    what = "logarithms of ratings" if analysis.ratios else "ratings as they stand"
    method = (
        f"{rules} The {what}, less the scenes’ means, are normally distributed; each person’s level and sensitivity to "
        "blur are their own."
    )
    answers = Answers(who, shown, np.asarray(rated, float))
    return Observed(answers, blur_ratings(aperture, nearest, answers.answer), method)


def observed_percepts(kept: pd.DataFrame) -> Observed | NotComputed:
    """Prepare percept durations of the cube, for both readings."""
    rows, first = percepts_in_order(kept[~kept["catch"]])
    if rows.empty:
        return NotComputed("No reading was reported for any time: no observer can be fitted.")
    if few := _too_few(rows):
        return few
    reading = rows["reading"].to_numpy()
    strengths = rows["strength"].to_numpy(float)
    size = np.where(rows["gradient"] == "none", 0.0, strengths / max(float(strengths.max()), 1e-9))
    favours = np.where(rows["gradient"] == "rigid", 1.0, -1.0)
    seconds = rows["duration"].to_numpy(float)
    shown = {"reading": reading, "favoured": size * favours * reading, "first": first.astype(float)}
    before = {f"before_{name}": np.where(first, 0.0, np.roll(array, 1)) for name, array in shown.items()}
    before["before_log"] = np.where(first, 0.0, np.roll(np.log(seconds), 1))
    shown |= before | {"censored": rows["censored"].to_numpy(float)}
    observers = {
        name: one for name, one in PERCEPT_OBSERVERS.items() if "gradient" not in one.start or bool((size > 0).any())
    }
    method = (
        "A reading lasts longer by a preference, by a gradient of blur that favours it, or by neither. Durations are "
        "log-normal, the first percept of a trial has a median of its own, and log duration is correlated with that of "
        "the percept before; one observer has percepts without this memory, and one of those has gamma distributions."
    )
    return Observed(Answers(rows["participant_id"].to_numpy(), shown, seconds), observers, method)


def observed_thresholds(table: pd.DataFrame, guess: float = 0.5) -> Observed | NotComputed:
    """Prepare correct and incorrect answers at levels, by condition if there are several."""
    rows = table[~table["catch"]]
    if few := _too_few(rows):
        return few
    names = rows["condition"].astype(str) if "condition" in rows else pd.Series("", index=rows.index)
    condition = pd.factorize(names, sort=True)[0].astype(float)
    level = rows["level"].to_numpy(float)
    method = (
        "They differ in how sensitivity grows with the level: not at all, in proportion, as the square, or as a power "
        "that is fitted; each person’s threshold is their own."
    )
    answers = Answers(
        rows["participant_id"].to_numpy(), {"level": level, "condition": condition}, rows["correct"].to_numpy(float)
    )
    return Observed(answers, transducer_observers(level, condition, guess), method)


METHOD = (
    "Observers were fitted by maximum likelihood, with people’s own effects integrated out, and compared by the log "
    "likelihood of each person’s answers under the fit to all the others. Exceedance is the probability that an "
    "observer is the one of most people (Stephan et al., 2009), with that log likelihood as each person’s evidence. "
    "BIC counts answers."
)


@dataclass(frozen=True, slots=True)
class FittedObservers:
    """Compared observers of one task, best first, or the reason why none can be fitted."""

    part: Part
    observed: Observed | NotComputed
    compared: Sequence[ObserverComparison]

    def findings(self, output: Output) -> Iterator[Block]:
        """Yield sentences and tables; the tables are also added to `output`."""
        yield Heading("Observers", 3)
        if isinstance(self.observed, NotComputed):
            yield Notice(self.observed.reason)
            return
        best = self.compared[0]
        sentence = (
            f"Of {len(self.compared)} observers fitted, “{best.name}” predicts the answers of people held out best "
            f"(log likelihood {decimals(best.held_out_total, 1)}; probability {probability(best.exceedance)} of being "
            "the observer of most people)."
        )
        if len(self.compared) > 1:
            second = self.compared[1]
            ahead, error = _ahead(best, second)
            sentence += (
                f" The next, “{second.name}”, is {decimals(ahead, 1)} ± {decimals(error, 1)} behind (sum over people, "
                "standard error)."
            )
        yield Paragraph(sentence)
        yield from output.tables([self._comparison(), self._parameters(), self._people()])

    def methods(self) -> Iterator[Block]:
        """Yield the methods for a paper."""
        if isinstance(self.observed, Observed):
            yield Paragraph(f"{METHOD} {self.observed.method}")

    def _comparison(self) -> Sheet:
        rows = [
            {
                "observer": one.name,
                "parameters": one.fit.parameters,
                "log likelihood": one.fit.log_likelihood,
                "AIC": one.fit.aic,
                "BIC": one.fit.bic,
                "held out": one.held_out_total,
                **dict(zip(("behind best", "SE"), _ahead(self.compared[0], one), strict=True)),
                "exceedance": one.exceedance,
            }
            for one in self.compared
        ]
        shown = {name: f"{{{name}:1}}" for name in rows[0]}
        shown |= {"observer": "{observer}", "parameters": "{parameters}", "exceedance": "{exceedance:3}"}
        notes = ["Held out: log likelihood of each person by the fit to all others, summed. Natural logarithms."]
        return sheet(f"{self.part.name}_observers.csv", "Observers compared", rows, shown, notes=notes)

    def _parameters(self) -> Sheet:
        rows = [
            {"observer": one.name, "parameter": name, "value": value, "SE": one.fit.standard_errors.get(name, math.nan)}
            for one in self.compared
            for name, value in one.fit.values.items()
        ]
        shown, notes = {name: f"{{{name}}}" for name in rows[0]}, ["A dash: the likelihood does not determine it."]
        file = f"{self.part.name}_observer_parameters.csv"
        return sheet(file, "Parameters of the observers", rows, shown, notes=notes, folded=True)

    def _people(self) -> Sheet:
        head = ["participant", *(one.name for one in self.compared)]
        rows = [[who, *(one.held_out[who] for one in self.compared)] for who in sorted(self.compared[0].held_out)]
        file = f"{self.part.name}_observer_people.csv"
        return listed(file, "Held-out log likelihood of each person", head, rows, folded=True)


def _ahead(best: ObserverComparison, other: ObserverComparison) -> tuple[float, float]:
    """Return the difference in held-out log likelihood between two observers (summed over people) and its SE."""
    each = np.array([best.held_out[person] - other.held_out[person] for person in best.held_out])
    return float(each.sum()), float(each.std(ddof=1) * math.sqrt(len(each)))


OBSERVED: Mapping[Kind, Callable[..., Observed | NotComputed]] = {
    "ratings": observed_ratings,
    "cube": observed_percepts,
    "thresholds": observed_thresholds,
}
"""Functions of `Part.observed` that return answers and the observers to be fitted to them, by kind of analysis."""


def observed_in(part: Part) -> Observed | NotComputed:
    """Return a section's answers and observers, or the reason why there are none."""
    kind = part.plan.questions.kind
    if kind in OBSERVED and part.observed:
        return OBSERVED[kind](*part.observed)
    return NotComputed(f"No built-in observer models {part.title!r}; use fit_observer.")


def fitted_observers(parts: Sequence[Part], progress: Progress | None = None) -> list[FittedObservers]:
    """Fit and compare the observers of each section's task."""
    observed = [observed_in(part) for part in parts]
    found: list[FittedObservers] = []
    for number_, (part, one) in enumerate(zip(parts, observed, strict=True)):

        def said(share: float, _: str, part: Part = part, before: int = number_) -> None:
            if progress is not None:
                progress((before + share) / len(parts), f"{part.title}: observers")

        compared = () if isinstance(one, NotComputed) else compare_observers(one.answers, one.observers, progress=said)
        found.append(FittedObservers(part, one, compared))
    return found
