"""Section of the report on simulated observers, fitted by maximum likelihood and cross-validated over people."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from focalgradient.observers import ObserverComparison, compare_observers
from focalgradient.progress import Progress
from focalgradient.report.cube_part import CubePart
from focalgradient.report.document import Block, Heading, Notice, Paragraph, Table
from focalgradient.report.observed import Observed, observed_percepts, observed_ratings, observed_thresholds
from focalgradient.report.parts import Output, Part
from focalgradient.report.rating_part import RatingPart
from focalgradient.report.tables import Sheet
from focalgradient.report.thresholds import ThresholdPart
from focalgradient.statistics import NotComputed
from focalgradient.statistics.wording import decimals, number, probability

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
        file = f"{self.part.name}_observers.csv"
        head = ["observer", "parameters", "log likelihood", "AIC", "BIC", "held out", "behind best", "SE", "exceedance"]
        names, numbers = [one.name for one in self.compared], []
        for one in self.compared:
            fit, behind = one.fit, _ahead(self.compared[0], one)
            numbers.append(
                [fit.parameters, fit.log_likelihood, fit.aic, fit.bic, one.held_out_total, *behind, one.exceedance]
            )
        places = (0, 1, 1, 1, 1, 1, 1, 3)
        shown = [[name, *map(decimals, row, places)] for name, row in zip(names, numbers, strict=True)]
        rows = [[name, *row] for name, row in zip(names, numbers, strict=True)]
        note = "Held out: log likelihood of each person by the fit to all others, summed. Natural logarithms."
        return Sheet(
            file, Table("Observers compared", head, shown, (note,), file), pd.DataFrame(rows, columns=pd.Index(head))
        )

    def _parameters(self) -> Sheet:
        file = f"{self.part.name}_observer_parameters.csv"
        rows = [
            (one.name, name, value, one.fit.standard_errors.get(name, math.nan))
            for one in self.compared
            for name, value in one.fit.values.items()
        ]
        shown = [[name, parameter, number(value), number(error)] for name, parameter, value, error in rows]
        head = ["observer", "parameter", "value", "SE"]
        notes = ("A dash: the likelihood does not determine it.",)
        return Sheet(
            file,
            Table("Parameters of the observers", head, shown, notes, file, folded=True),
            pd.DataFrame(rows, columns=pd.Index(head)),
        )

    def _people(self) -> Sheet:
        file = f"{self.part.name}_observer_people.csv"
        head = ["participant", *(one.name for one in self.compared)]
        people = sorted(self.compared[0].held_out)
        numbers = [[one.held_out[person] for one in self.compared] for person in people]
        shown = [[person, *(decimals(value, 1) for value in row)] for person, row in zip(people, numbers, strict=True)]
        rows = [[person, *row] for person, row in zip(people, numbers, strict=True)]
        return Sheet(
            file,
            Table("Held-out log likelihood of each person", head, shown, (), file, folded=True),
            pd.DataFrame(rows, columns=pd.Index(head)),
        )


def _ahead(best: ObserverComparison, other: ObserverComparison) -> tuple[float, float]:
    """Return the difference in held-out log likelihood between two observers (summed over people) and its SE."""
    each = np.array([best.held_out[person] - other.held_out[person] for person in best.held_out])
    return float(each.sum()), float(each.std(ddof=1) * math.sqrt(len(each)))


def observed_in(part: Part) -> Observed | NotComputed:
    """Return a section's answers and the observers that can be fitted to them, or the reason why there are none."""
    match part:
        case RatingPart():
            return observed_ratings(part.ratings.kept, part.ratings.analysis)
        case CubePart():
            return observed_percepts(part.reports.kept)
        case ThresholdPart():
            return observed_thresholds(part.table, part.guess)
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
