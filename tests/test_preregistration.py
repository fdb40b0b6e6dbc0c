"""A preregistration states the analysis that the report makes, of every task, scale and option."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from recorded import record_necker
from test_scales import record

from focalgradient.design import DepthRatingDesign, DepthTrial, load_design
from focalgradient.errors import InputError
from focalgradient.power import Model
from focalgradient.report import Stated, make_report
from focalgradient.report.preregister import preregistration
from focalgradient.statistics import NotComputed, Rules

pytestmark = pytest.mark.usefixtures("unrendered")

DESIGN = """task = "depthrating"
scale = "{scale}"
reference = "{reference}"
scenes = [{scenes}]
fixations = [{fixations}]
repetitions = {repetitions}
practice_trials = 3
standard_every = 0
catch_pictures = ["standard", "flatter", "deeper"]
"""
NEAR, BOTH, OWN = ("nearest",), ("nearest", "farthest"), ("house", "gate", "tree")


def design_of(
    folder: Path, scale: str, scenes: int = 2, fixations: tuple[str, ...] = BOTH, repetitions: int = 2
) -> Path:
    path = folder / "design.toml"
    quoted = ", ".join(f'"{one}"' for one in fixations)
    names = ", ".join(f'"s{number}"' for number in range(scenes))
    reference = "same-scene" if scale in ("bipolar", "choice") else "standard"
    settings = {"scale": scale, "reference": reference, "scenes": names, "fixations": quoted}
    path.write_text(DESIGN.format(**settings, repetitions=repetitions))
    return path


def section(text: str, heading: str) -> list[str]:
    """Paragraphs under a heading of level 2."""
    part = text.split(f"## {heading}\n")[1].split("\n## ")[0]
    return [one for one in part.strip().split("\n\n") if not one.startswith(("**", "|", "In the words"))]


WORDS = {
    "ratio": ("Ratings were analysed on their logarithm", "two one-sided tests"),
    "steps": ("cumulative-link mixed model", "odds of a higher answer"),
    "bipolar": ("A straight line on aperture diameter", "7 steps from much flatter to much deeper"),
    "choice": ("slope was tested", "chosen"),
}

CASES = [
    *((scale, 2, BOTH) for scale in ("ratio", "steps", "choice")),
    *((scale, 5, NEAR) for scale in ("steps", "bipolar")),
    ("ratio", 5, OWN),
    ("bipolar", 2, OWN),
]


@pytest.mark.slow
@pytest.mark.parametrize(("scale", "scenes", "fixations"), CASES)
def test_its_sentences_are_those_of_the_report_and_name_the_test_that_is_run(
    tmp_path: Path, scale: str, scenes: int, fixations: tuple[str, ...]
) -> None:
    path = design_of(tmp_path, scale, scenes, fixations)
    before = preregistration(path, stated=Stated(Rules()))["preregistration.md"].decode()
    root = record(tmp_path / "data", load_design(path), 6)
    made = make_report(root)
    after = made.files["report.md"].decode()
    methods = after.split("## Methods\n")[1]
    (outcome,) = section(before, "Primary outcome")
    for sentence in [outcome, *section(before, "Analysis"), *section(before, "Exclusions")[:-1]]:
        assert sentence in methods
    for word in WORDS[scale]:
        assert word in before
    first = made.results[0]
    assert fixations[0] in first["what"] or sorted(fixations)[0] in first["what"]
    analysis = section(before, "Analysis")[0]
    method = str(first["method"])
    assert ("cumulative-link" in method) == ("cumulative-link" in analysis)
    if "Satterthwaite" in method:
        assert "Satterthwaite" in analysis
    if scenes < 5:
        assert "t on subjects - 1" in method
        assert "Satterthwaite" not in analysis
        assert "N − 1 degrees of freedom" in analysis
    assert "difference" in analysis or len(fixations) == 1 or scale == "choice"


def test_the_cube_s_sentences_are_those_of_the_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "focalgradient.statistics.cube.fit_dominance", lambda data: NotComputed("not fitted")
    )  # slow, and not looked at
    root = record_necker(tmp_path / "data", 3)
    (tmp_path / "cube.toml").write_text('task = "necker"\n')
    before = preregistration(tmp_path / "cube.toml", stated=Stated(Rules()))["preregistration.md"].decode()
    methods = make_report(root).files["report.md"].decode().split("## Methods\n")[1]
    assert section(before, "Analysis")[0] in methods
    assert "paired t-test" in section(before, "Analysis")[0]
    for absent in ("rated", "ratings", "marker"):
        assert absent not in section(before, "Exclusions")[0]


def test_a_model_of_subjects_states_the_effect_and_a_given_one_goes_before(tmp_path: Path) -> None:
    path = design_of(tmp_path, "ratio", 1, NEAR, 1)
    path.write_text(path.read_text() + "catch_trials = 3\n")

    def stated(**given: object) -> bytes:
        return preregistration(path, stated=Stated(Rules()), **given)["preregistration.md"]

    assert stated(model=Model(effect=1.5)) == stated(effect=1.5) == stated(model=Model(effect=1.1), effect=1.5)
    assert stated(model=Model(between=0.3, noise=0.2)) == stated(between=0.3, noise=0.2)
    with pytest.raises(InputError, match=r"between is -1"):
        stated(between=-1.0)
    steps = tmp_path / "steps.toml"
    steps.write_text('task = "depthrating"\nscale = "steps"\n')
    with pytest.raises(InputError, match=r"noise does not apply to the simulated answers of this design: leave it"):
        preregistration(steps, stated=Stated(Rules()), noise=0.2)


def test_factors_of_the_design_are_hypotheses_with_their_test(tmp_path: Path) -> None:
    path = tmp_path / "design.toml"
    path.write_text('task = "depthrating"\n[factors.light]\nlevels = ["dim", "bright"]\nvary = "between"\n')
    text = preregistration(path, stated=Stated(Rules()))["preregistration.md"].decode()
    assert "The change with blur differs between the levels of light." in text
    assert "Factor light (dim, bright; between subjects: Welch’s t-test)" in text


def test_results_stand_with_and_without_exclusions(tmp_path: Path) -> None:
    """Three of eight guess: left out, they leave a significant rise; with them it is not."""

    def guesses(design: DepthRatingDesign, trial: DepthTrial, chance: np.random.Generator) -> float:
        return float(np.exp(chance.uniform(-1.3, 1.3)))

    design = load_design(design_of(tmp_path, "ratio", 2))
    assert isinstance(design, DepthRatingDesign)
    root = record(tmp_path / "data", design, 5)
    for label in ("guess1", "guess2", "guess3"):
        record(root, design, 1, guesses, label)
    made = make_report(root)
    told = json.loads(made.files["results.json"])["results"]
    rises = {one["exclusions"]: one for one in told if one["what"].startswith("depth") and "nearest" in one["what"]}
    kept, everyone = rises["with exclusions"], rises["without exclusions"]
    assert (kept["subjects"], everyone["subjects"]) == (5, 8)
    assert kept["value"] != everyone["value"]
    assert {one["exclusions"] for one in told} == {"with exclusions", "without exclusions"}
    assert json.loads(made.files["results.json"])["problems"] == []
    for text in (made.files["report.md"].decode(), made.files["report.html"].decode()):
        assert "Without exclusions (8 subjects, 256 trials): depth effect at the largest aperture" in text
        assert "Main results with and without exclusions" in text
        decisive = "depth effect at the largest aperture (ratio to the pinhole), nearest in focus"
        assert f"Exclusions decide: {decisive}" in text
    assert made.files["depth_rating_exclusions_effect.csv"].count(b"without exclusions") == 3
    variants = pd.read_csv(io.BytesIO(made.files["robustness.csv"]))
    said = made.files["report.md"].decode().split("Robustness. ")[1].split("\n\n")[0]
    for focus, sentence in zip(("nearest", "farthest"), said.split("With the ")[1:], strict=True):
        own = variants[(variants["fixation"] == focus) & variants["distinct"] & (variants["rules"] != "all")]
        ratios = [float(ratio) for ratio in re.findall(r"([\d.]+) without the rule", sentence)]
        assert ratios == pytest.approx(np.exp(own["estimate"]), rel=5e-3)
        assert own["subjects"].max() > 5
