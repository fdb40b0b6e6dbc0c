"""Section of the report on simulated observers, fitted by maximum likelihood and cross-validated over people."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from focalgradient.observers import ObserverComparison, compare_observers
from focalgradient.progress import Progress
from focalgradient.report.document import Block, Heading, Notice, Paragraph
from focalgradient.report.observed import Observed, observed_percepts, observed_ratings, observed_thresholds
from focalgradient.report.parts import Output, Part
from focalgradient.report.tables import Sheet, listed, sheet
from focalgradient.statistics import NotComputed
from focalgradient.statistics.questions import Kind
from focalgradient.statistics.wording import decimals, probability

__all__ = ["FittedObservers", "fitted_observers"]

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
