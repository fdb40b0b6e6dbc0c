"""Response scales as classes: the check that each must pass, the registry, and a scale of a package of its own."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from extended import build, python
from hypothesis import given
from hypothesis import strategies as st

from focalgradient.design import DepthRatingDesign, load_design
from focalgradient.design.words import load_words
from focalgradient.errors import InputError
from focalgradient.scales import (
    AnswerColumn,
    OrdinalScale,
    Ratio,
    ResponseScale,
    Scale,
    SignedComparison,
    Slopes,
    Steps,
    TwoIntervals,
    VisualAnalogue,
    check_scale,
)

OURS = [
    Ratio(),
    Ratio(0.5, 1.3, answer="typed", reference="same-scene"),
    OrdinalScale(),
    OrdinalScale(steps=2),
    OrdinalScale(steps=21, labels=("flat", "deep")),
    SignedComparison(),
    SignedComparison(steps=3, reference="same-scene"),
    TwoIntervals(),
    VisualAnalogue(),
    VisualAnalogue(labels=("shallow", "deep")),
]


@dataclass(frozen=True)
class HalfSteps(SignedComparison):
    """Signed comparison in half steps."""

    name: ClassVar[str] = "half-steps"
    off: ClassVar[str] = "has half steps"
    texts: ClassVar = {}

    def is_answer(self, value: float) -> bool:
        return ResponseScale.is_answer(self, value) and value % 0.5 == 0

    def control(self, texts: Any) -> Steps:
        return replace(super().control(texts), size=0.5)


def test_half_steps_pass_the_check() -> None:
    check_scale(HalfSteps())
    control = HalfSteps().control(load_words("en"))
    assert control.values == [number / 2 for number in range(-6, 7)]
    assert [step["value"] for step in control.form()["steps"]] == control.values
    assert control.labelled()[1] == (0.0, "alike")
    assert not Steps("", "", 0, 2, size=0.5).has_digits


@pytest.mark.parametrize("scale", OURS, ids=str)
def test_each_of_ours_passes_the_check(scale) -> None:
    check_scale(scale)


@dataclass(frozen=True)
class Wrong(VisualAnalogue):
    """A visual analogue scale, of which a test breaks one part."""

    name: ClassVar[str] = "wrong"
    texts: ClassVar = VisualAnalogue.texts


BROKEN = {
    "middle is 120, outside": {"middle": 120.0},
    "is_answer refuses its own end 0": {"is_answer": lambda self, value: 1 <= value <= 100},
    "example is 20, not above the middle": {"example": 20.0},
    "has no text 'example' in 'en'": {"texts": {"en": {"instructions": "A title\nA text."}}},
    "keys reach 100.8": {
        "control": lambda self, texts: Scale("How deep?", "", 0.0, 110.0, ratios=False, ends=("a", "b"))
    },
    "intervals is 2, which does not go with": {"intervals": 2},
    "column.levels does not name": {"column": AnswerColumn("How deep.", levels={"0": "flat"})},
    "simulated answers 101": {"simulated": lambda self, log, largest: 101.0 if log > 1 else 50 + 30 * log},
    "analysis.middle is not": {"analysis": Slopes(name="wrong", middle=0.0, unit="%", mean="mean place")},
}


@pytest.mark.parametrize("reason", BROKEN)
def test_a_broken_part_fails_the_check_by_name(reason: str) -> None:
    scale = dataclass(frozen=True)(type("Broken", (Wrong,), BROKEN[reason]))
    with pytest.raises(InputError, match=re.escape(reason)):
        check_scale(scale)


@given(st.floats(allow_nan=True))
def test_a_place_on_the_line_is_an_answer_within_its_ends_only(value: float) -> None:
    design = DepthRatingDesign(scale="visual-analogue")
    assert design.response_scale.is_answer(value) == (-1e-6 <= value <= 100 + 1e-6)


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build("A response scale", "numeric_rating.py", tmp_path_factory.mktemp("package"))


OWN = """
import json, sys
from pathlib import Path
import focalgradient
assert "numeric_rating" not in sys.modules
from focalgradient.dataset import Apparatus, Rated, Session, validate
from focalgradient.design import load_design
from focalgradient.design.pages import pages_of
from focalgradient.design.words import load_words
from focalgradient.report import Stated, make_report
from focalgradient.report.preregister import preregistration
from focalgradient.scales import check_scale, scale_class
from focalgradient.statistics import Rules
check_scale(scale_class("numeric-rating"))
file, data = map(Path, sys.argv[1:])
design = load_design(file)
for number in range(6):
    with Session.begin(data, design, f"{number:02}", apparatus=Apparatus("seconds of the test")) as session:
        for at, trial in enumerate(session.remaining()):
            deep = {"example-flat": -1.2, "example-deep": 1.2}.get(trial.scene, 0.08 * trial.aperture_mm)
            deep += 0.1 * ((at * 7 + number) % 11 - 5) / 5
            rating = design.response_scale.simulated(max(min(deep, 1.38), -1.38), 1.386)
            session.record(trial, Rated(onset=20.0 * at, rating=rating, response_time=1.5))
files = make_report(data).files
pages = pages_of(design, load_words("en"), "01").opening()
told = {
    "problems": validate(data).problems,
    "report": files["report.md"].decode(),
    "plan": preregistration(file, stated=Stated(Rules()))["preregistration.md"].decode(),
    "pages": [page.text for page in pages],
    "form": design.response_scale.control(load_words("en")).form(),
    "sidecar": json.loads(next(data.glob("sub-00/**/*_beh.json")).read_text())["rating"],
}
print(json.dumps(told))
"""


@pytest.mark.slow
def test_the_scale_of_the_document_is_found_and_goes_from_its_pages_to_the_report(
    installed: Path, tmp_path: Path
) -> None:
    design = 'task = "depthrating"\nscale = "numeric-rating"\nscenes = ["s1", "s2"]\nrepetitions = 1\n'
    (tmp_path / "own.toml").write_text(design)
    done = python(installed, "-c", OWN, tmp_path / "own.toml", tmp_path / "data")
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["problems"] == []
    assert "the mean number rose with the aperture (points per millimetre" in told["report"]
    assert "slope of the number on aperture diameter (points per millimetre)" in told["plan"]
    assert "Answers are whole numbers from 0 to 10." in told["plan"]
    assert "Answer each picture by a number from 0 to 10." in told["pages"][0]
    assert told["form"]["steps"][0] == {"value": 0, "label": "no depth"}
    assert told["sidecar"]["Maximum"] == 10
    # Where the package is not installed, the file is refused by name.
    with pytest.raises(InputError, match="scale is 'numeric-rating', but must be one of 'ratio'"):
        load_design(tmp_path / "own.toml")


def test_power_of_a_line_is_that_of_its_simulated_experiments() -> None:
    chance = np.random.default_rng(1)
    felt = chance.logistic(size=10_000)
    places = VisualAnalogue().latent(felt)
    assert 0 <= places.min() < 5
    assert 95 < places.max() <= 100
    assert abs(places.mean() - 50) < 1  # the logistic function of a logistic variable is uniform
    assert abs(places.std() - 100 / 12**0.5) < 1
