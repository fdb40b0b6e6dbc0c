"""Conformance check of response scales: raises an error that names the first failure."""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterable, Mapping

import numpy as np

from focalgradient.analyses import Analysis
from focalgradient.errors import InputError, described
from focalgradient.files.columns import cell, converted
from focalgradient.scales.base import ResponseScale
from focalgradient.scales.controls import Control, Scale, Steps, Ways
from focalgradient.words import LANGUAGES, Words, read_words

__all__ = ["check_scale"]

RANGE = (0.25, 4.0)
"""Range of depth ratios shown to simulated observers if the scale has no `least_rating` and `most_rating`: their
defaults.
"""

BEYOND = 1e-3
"""Distance beyond an end, as a fraction of the range, at which no number may be an answer: 1000 times the error of
rounding to four decimals.
"""


def check_scale(scale: ResponseScale | type[ResponseScale]) -> None:
    """Check that a response scale is complete and consistent with the rest of the package.

    The bounds enclose the middle. The window's control and the browser's form offer exactly the valid answers,
    including the ends. Answers survive a write and read of the table, and agree with its sidecar. Simulated answers are
    valid and never decrease with depth. The analysis recovers the sign of a simulated effect. No text is empty.

    Parameters
    ----------
    scale
        A scale, or its class, which is then created with its defaults.

    Raises
    ------
    InputError
        If a check fails; the message names the failure and its place.

    Examples
    --------
    >>> from focalgradient.scales import VisualAnalogue
    >>> check_scale(VisualAnalogue())
    """
    if inspect.isclass(scale) and issubclass(scale, ResponseScale) and not inspect.isabstract(scale):
        scale = scale()
    if not isinstance(scale, ResponseScale):
        raise InputError(f"scale is {described(scale)}, but must be a response scale: derive it from ResponseScale.")
    checked = _Checked(scale)
    checked.bounds()
    for texts in checked.languages():
        control = checked.texts(texts)
        checked.answers(control)
    checked.observers()
    checked.column()
    checked.analysis()


class _Checked:
    """A response scale under test."""

    def __init__(self, scale: ResponseScale):
        self.scale = scale
        self.least, self.most = scale.bounds
        least, most = (
            getattr(scale, name, end) for name, end in zip(("least_rating", "most_rating"), RANGE, strict=True)
        )
        self.logs = (math.log(least), math.log(most))

    def need(self, holds: object, what: str) -> None:
        """Raise `InputError` with the message `what` unless a condition holds."""
        if not holds:
            raise InputError(f"the scale {type(self.scale).__name__} fails: {what}.")

    def bounds(self) -> None:
        """Check the name, the ends and the middle, and that numbers beyond the ends are rejected."""
        scale, least, most = self.scale, self.least, self.most
        self.need(isinstance(getattr(scale, "name", None), str) and scale.name.strip(), "name must be a text")
        self.need(scale.intervals in (1, 2), f"intervals is {scale.intervals!r}, but a trial has 1 or 2")
        self.need(math.isfinite(least) and math.isfinite(most) and least < most, f"bounds are {scale.bounds}")
        self.need(least < scale.middle < most, f"middle is {scale.middle:g}, outside the bounds {least:g} to {most:g}")
        for end in (least, most):
            self.need(scale.is_answer(end), f"is_answer refuses its own end {end:g}")
        away = BEYOND * (most - least)
        for value in (least - away, most + away, math.nan, math.inf, -math.inf):
            self.need(not scale.is_answer(value), f"is_answer accepts {value:g}, which is outside the bounds")
        if scale.standard is not None:
            self.need(scale.is_answer(scale.standard), f"standard is {scale.standard:g}, which is not an answer")
        if scale.example is not None:
            self.need(scale.is_answer(scale.example), f"example is {scale.example:g}, which is not an answer")
            self.need(scale.example > scale.middle, f"example is {scale.example:g}, not above the middle")

    def languages(self) -> Iterable[Words]:
        """Return the texts of the scale's own languages, or of all languages of the package."""
        own = self.scale.texts
        self.need(not own or "en" in own, "texts has no 'en', the language of the package's own designs")
        return [read_words(name) for name in LANGUAGES if not own or name in own]

    def texts(self, texts: Words) -> Control:
        """Check that no text is empty; return the control."""
        scale, where = self.scale, f"in {texts.language!r}"
        control = scale.control(texts)
        self.need(isinstance(control, Scale | Steps | Ways), f"control is {described(control)}, none of ours")
        shown: dict[str, str] = {
            "question": control.question,
            "instructions": scale.instructions(texts),
            "answered": scale.answered,
            "column.about": scale.column.about,
            "again": texts(scale.again),
        }
        if scale.example is not None:
            shown["example_text"] = scale.example_text(texts)
        if isinstance(control, Ways):
            shown |= {f"ways[{number}]": text for number, text in enumerate(control.ways)}
        elif isinstance(control, Steps):
            shown |= {f"labels[{number}]": text for number, text in enumerate(control.labels)}
            self.need(control.labelled(), f"control has {len(control.labels)} labels {where}, which fit no steps")
        else:
            shown |= {f"ends[{number}]": text for number, text in enumerate(control.ends)}
        for name, text in shown.items():
            self.need(isinstance(text, str) and text.strip(), f"{name} is empty {where}")
            self.need("{" not in text, f"{name} has a brace {where}, which nothing fills in")
        return control

    def answers(self, control: Control) -> None:
        """Check that the keys reach every answer, and that window and browser accept only valid answers."""
        scale = self.scale
        self.need(
            isinstance(control, Ways) == (scale.intervals > 1),
            f"intervals is {scale.intervals}, which does not go with the control {type(control).__name__}",
        )
        given = control.reached()
        reached = {scale.answer_in(value, interval) for value in given for interval in (1, 2)[: scale.intervals]}
        for value in reached:
            self.need(scale.is_answer(value), f"keys reach {value:g}, which is_answer refuses")
        for end in scale.bounds:
            self.need(min(abs(end - value) for value in reached) < 1e-6, f"no key reaches the end {end:g}")
        if isinstance(control, Scale):
            places = np.linspace(0, 1, 101).tolist()
            offered = [control.value(place) for place in places]
            self.need(np.allclose([control.share(value) for value in offered], places), "value and share disagree")
            for value in offered:
                self.need(scale.is_answer(round(value, 4)), f"the line offers {value:g}, which is_answer refuses")
        else:  # nothing between the answers
            between = [(one + other) / 2 for one, other in zip(sorted(reached), sorted(reached)[1:], strict=False)]
            for value in between:
                self.need(not scale.is_answer(value), f"is_answer accepts {value:g}, which no key reaches")
        self.form(control.form(), reached)

    def form(self, form: Mapping[str, object], reached: set[float]) -> None:
        """Check that the browser offers the same answers as the window."""
        if "least" in form:
            ends = (form["least"], form["most"])
            self.need(ends == self.scale.bounds, f"the browser's form goes over {ends}, not the bounds")
        elif isinstance(steps := form.get("steps"), list):
            offered = {float(step["value"]) for step in steps}
            self.need(offered == reached, f"the browser's form offers {sorted(offered)}, the window {sorted(reached)}")

    def column(self) -> None:
        """Check that answers survive writing and reading of the table, and agree with the sidecar."""
        scale = self.scale
        column = scale.column.rating()
        sidecar = column.described()
        inside = [scale.simulated(log, self.logs[1]) for log in np.linspace(*self.logs, 31).tolist()]
        for value in (*inside, *scale.bounds):
            values, wrong = converted(column, [cell(value)])
            self.need(wrong is None, f"column refuses the answer {value:g}: it must be {column.expected}")
            self.need(abs(float(values[0]) - value) < 1e-9, f"column changes the answer {value:g} to {values[0]:g}")
            named = sidecar.get("Levels")
            self.need(not named or f"{value:g}" in named, f"column.levels does not name the answer {value:g}")
        self.need(sidecar.get("Minimum", self.least) <= self.least, "column.least is above the smallest answer")
        self.need(sidecar.get("Maximum", self.most) >= self.most, "column.most is below the largest answer")
        for name, text in {"Units": sidecar.get("Units", "x"), "Description": sidecar["Description"]}.items():
            self.need(isinstance(text, str) and text.strip(), f"the sidecar's {name} is empty")

    def observers(self) -> None:
        """Check that simulated answers are valid and never decrease with depth."""
        scale = self.scale
        seen = np.linspace(*self.logs, 81)
        answers = {"simulated": [scale.simulated(log, self.logs[1]) for log in seen.tolist()]}
        if not scale.analysis.ratios:
            answers["latent"] = np.asarray(scale.latent(5 * seen), float).tolist()
        for name, found in answers.items():
            for value in found:
                self.need(scale.is_answer(value), f"{name} answers {value:g}, which is_answer refuses")
            self.need(bool((np.diff(found) >= 0).all()), f"{name} falls where depth rises")
            self.need(found[0] < found[-1], f"{name} is the same whatever is seen")
            self.need(found[0] < scale.middle < found[-1], f"{name} does not cross the middle, {scale.middle:g}")

    def analysis(self) -> None:
        """Check that the analysis recovers the sign of an aperture effect, and that the report has the texts for it."""
        from focalgradient.statistics import Effect, analyse  # with pandas and SciPy

        analysis = self.scale.analysis
        self.need(isinstance(analysis, Analysis), f"analysis is {described(analysis)}, no Analysis")
        if analysis.middle is not None:
            self.need(abs(analysis.middle - self.scale.middle) < 1e-9, "analysis.middle is not the scale's middle")
        self.need(
            analysis.standard_known == (self.scale.standard is not None),
            "analysis.standard_known must be True where standard is an answer, and only there",
        )
        self.need(not (analysis.positive and self.least <= 0), "the analysis needs answers above 0, which bounds break")
        self.need(analysis.signed or self.least >= 0, "the analysis takes no answer below 0, which bounds allow")
        for direction in (1, -1):
            found = analyse(self._table(direction), analysis).answers.primary[0].outcome
            self.need(isinstance(found, Effect), f"the analysis of simulated data gives no effect: {found}")
            estimate = found.estimate if isinstance(found, Effect) else math.nan
            self.need(
                estimate * direction > 0, f"the analysis finds {estimate:+.2g}, but depth changed by {direction:+d}"
            )

    def _table(self, direction: int):  # type: ignore[no-untyped-def]  # pandas is imported when called
        """Simulate 8 subjects x 6 scenes: log depth changes by 0.05 per mm of aperture, with an SD of 0.3."""
        import pandas as pd

        rng = np.random.default_rng(1)
        rows: list[dict[str, object]] = []
        for who in range(8):
            for scene in range(6):
                for name, mm in (("pinhole", 0.0), ("f/22", 2.3), ("f/11", 4.5), ("f/5.6", 8.9)):
                    log = direction * 0.05 * mm + 0.3 * float(rng.standard_normal())
                    answer = self.scale.simulated(min(max(log, self.logs[0]), self.logs[1]), self.logs[1])
                    row = {"participant_id": f"{who}", "trial": len(rows), "scene": f"{scene}", "aperture": name}
                    rows.append(row | {"aperture_mm": mm, "fixation": "nearest", "rating": answer, "catch": False})
        return pd.DataFrame(rows)
