"""One sequence of pages and trials for laboratory and browser, and texts that are true of their design."""

from __future__ import annotations

import re
from dataclasses import asdict
from typing import Any

import pytest

from focalgradient.design import BlurThresholdDesign, DepthRatingDesign, NeckerDesign, Pinhole
from focalgradient.design.pages import pages_of
from focalgradient.design.sequence import Page, Repeat, Standard, Step, Turn, breaks, sequence
from focalgradient.design.words import LANGUAGES, load_words

FACTOR = {"light": {"levels": ["dim", "bright"], "order": "blocked"}}
EXAMPLES = ("flatter", "deeper")
DESIGNS: dict[str, Any] = {
    "ratio": DepthRatingDesign(repetitions=1),
    "ratio, same scene": DepthRatingDesign(repetitions=1, reference="same-scene"),
    "ratio, blocked factor": DepthRatingDesign(repetitions=1, factors=FACTOR),
    "ratio, no practice": DepthRatingDesign(repetitions=1, practice_trials=0, catch_trials=0),
    "steps": DepthRatingDesign(repetitions=1, scale="steps", catch_pictures=EXAMPLES),
    "bipolar": DepthRatingDesign(repetitions=1, scale="bipolar", catch_pictures=EXAMPLES),
    "choice": DepthRatingDesign(repetitions=1, scale="choice", catch_pictures=EXAMPLES),
    "necker": NeckerDesign(),
    "necker, no practice": NeckerDesign(practice_trials=0),
    "pinhole": Pinhole(),
    "blur threshold": BlurThresholdDesign(repetitions=2),
}


def steps_of(design: Any, done: int = 0, *, browser: bool = False, language: str = "en") -> tuple[Step, ...]:
    words = load_words(language)
    return sequence(design, words, pages_of(design, words, "01", browser=browser), design.trials("01"), done)


@pytest.mark.parametrize("name", DESIGNS)
@pytest.mark.parametrize("place", [0, 1, 2, 0.5, -1])
def test_what_a_browser_gets_is_the_laboratorys_sequence(name: str, place: float) -> None:
    """Composed of what a browser gets of each trial, a sitting has the steps of the sequence, wherever it begins."""
    design = DESIGNS[name]
    trials = design.trials("01")
    done = {0.5: len(trials) // 2, -1: len(trials) - 1}.get(place, int(place))
    words = load_words("en")
    pages = pages_of(design, words, "01")
    given = breaks(design, words, pages, trials, done)
    shown: list[Step] = [*pages.opening()]
    for number, (turn, first, before) in enumerate(given):
        shown += [*(before if number else first), turn]
    wanted = [one for one in steps_of(design, done) if not isinstance(one, Repeat)]
    assert shown == wanted[: len(shown)]
    assert [one.event for one in wanted[len(shown) :] if isinstance(one, Page)] == ["debriefing", "thanks"]


@pytest.mark.parametrize("name", [name for name, design in DESIGNS.items() if getattr(design, "has_standard", False)])
@pytest.mark.parametrize("done", [0, 1, 9])
def test_every_sitting_shows_the_standard_before_anything_is_rated(name: str, done: int) -> None:
    design = DESIGNS[name]
    seen = []
    for step in steps_of(design, done):
        if isinstance(step, Turn):
            seen += [*step.lead]
            break
        seen.append(step)
    assert sum(isinstance(one, Standard) for one in seen) == 1


RATINGS = [
    DepthRatingDesign(repetitions=1, **(given | {"catch_trials": catch, "practice_trials": practice}))
    for given in (
        *({"scale": "steps", "steps": steps, "catch_pictures": EXAMPLES} for steps in range(2, 22)),
        *({"scale": "bipolar", "steps": steps, "catch_pictures": EXAMPLES} for steps in range(3, 22, 2)),
        *(
            {"least_rating": least, "most_rating": most}
            for least in (0.1, 0.5, 0.9)
            for most in (1.1, 1.5, 1.9, 2.0, 9.0)
        ),
        {"scale": "choice", "catch_pictures": EXAMPLES},
        {"fixations": ["nearest"], "reference": "same-scene"},
    )
    for catch, practice in ((0, 0), (3, 3))
]


def texts_of(design: Any, language: str) -> str:
    steps = steps_of(design, language=language)
    turns = [page for step in steps if isinstance(step, Turn) for page in step.after]
    pages = [step for step in steps if isinstance(step, Page)]
    repeats = [step.again for step in steps if isinstance(step, Repeat)]
    return "\n".join(page.text for page in (*pages, *turns, *repeats))


@pytest.mark.slow
@pytest.mark.parametrize("language", LANGUAGES)
def test_texts_of_depth_rating_are_true_of_the_design(language: str) -> None:
    words = load_words(language)
    for design in RATINGS:
        told = texts_of(design, language)
        shown = {trial.scene for trial in design.trials("01")}
        drawings = bool(shown & {"example-flat", "example-deep"})
        assert (words("depth.about_drawings") in told) is drawings
        assert (words("depth.about_fixation") in told) is (len(design.fixations) > 1)
        least, most = design.response_scale.bounds
        if design.scale == "choice":
            assert words("depth.answer_choice") in told
            continue
        example = design.response_scale.example
        assert design.response_scale.is_answer(example)
        middle = design.right_side(_deep(design))["above"]  # type: ignore[index]
        assert example > middle  # what looks deep is answered on the deep side
        scale = design.response_scale.control(words)
        digits = words("depth.answer_steps") in told
        assert digits is (design.scale == "steps" and most <= 9)
        assert not digits or scale.has_digits  # type: ignore[union-attr]
        if design.scale == "ratio":
            ratios = words("depth.ratios", half=words.number(0.5, "g"))
            assert (ratios in told) is (least <= 0.5 and most >= 2)


def _deep(design: DepthRatingDesign) -> Any:
    trial = design.trials("01")[0]
    return type(trial)(**{**asdict(trial), "scene": "example-deep"})


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", DESIGNS)
def test_nothing_is_left_unfilled_or_doubled(language: str, name: str) -> None:
    told = texts_of(DESIGNS[name], language)
    assert set(re.findall(r"\{\w*\}", told)) <= {"{minutes}", "{share}"}
    assert "necker" in name or "  " not in told
    assert ".." not in told.replace("...", "")
