"""The text of a preregistration, written from a design before there are data."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from focalgradient.design import DepthRatingDesign, NeckerDesign, load_design
from focalgradient.errors import InputError
from focalgradient.power import TESTS, CubeModel, CubeStudy, Model, Study, quick_cube_power, quick_power
from focalgradient.report.analysed import BOUND
from focalgradient.report.document import Block, Heading, Paragraph, Table, as_html, as_markdown
from focalgradient.report.rules import MEANING, Stated, as_toml
from focalgradient.report.words import analysis_necker, analysis_ratings

__all__ = ["preregistration"]

SUBJECTS = (6, 8, 10, 12, 16, 20, 24, 30, 40)
EXPERIMENTS = 2000
WANTED = 0.8
"""Power that the number of subjects is to reach, for all of the hypotheses: Cohen's (1988) convention."""


def preregistration(
    design_file: Path, *, bound: float | None = None, stated: Stated, model: Model | None = None
) -> dict[str, bytes]:
    """Files of a preregistration: HTML, Markdown, and the rules as a file for `report --rules`.

    Parameters
    ----------
    design_file
        The design (TOML).
    bound
        Of equivalence; without it that of `stated`, or 1.2.
    stated
        Rules of exclusion.
    model
        Of the simulated subjects that rate depth, for the number of subjects.

    Raises
    ------
    InputError
        If the file is no design, or lacks what the hypotheses need.
    """
    design = load_design(design_file)
    used = next((one for one in (bound, stated.bound) if one is not None), BOUND)
    if isinstance(design, DepthRatingDesign):
        title, blocks = _of_ratings(design, used, stated, model or Model())
    elif isinstance(design, NeckerDesign):
        title, blocks = _of_cube(design, stated)
    else:
        raise InputError(
            f"{design_file} is a design of {design.task}: a preregistration is written for depthrating and necker."
        )
    return {
        "preregistration.html": as_html(title, blocks).encode(),
        "preregistration.md": as_markdown(title, blocks).encode(),
        "rules.toml": as_toml(stated.rules, used).encode(),
    }


def _of_ratings(design: DepthRatingDesign, bound: float, stated: Stated, model: Model) -> tuple[str, list[Block]]:
    study = Study(model, design, bound)
    powers = {subjects: quick_power(study, subjects, EXPERIMENTS) for subjects in SUBJECTS}
    hypotheses = [
        "H1 (primary). With the nearest object in focus, ratings of depth rise from the pinhole to the largest "
        "aperture.",
        f"H2. With the farthest object in focus, that rise is equivalent to zero: within a factor of {bound:g}, the "
        "smallest rise that would matter.",
        "H3. The rise is larger with the nearest than with the farthest object in focus.",
    ]
    outcome = (
        "The log ratio of the rating at the largest aperture to that at the pinhole with the nearest object in "
        "focus, one value for each subject and scene, repetitions averaged."
    )
    shown = (
        f"{len(design.scenes)} scenes, the apertures {', '.join(design.apertures)} of a lens of "
        f"{design.focal_length_mm:g} mm, each scene with the {' and the '.join(design.fixations)} object in focus "
        f"({design.fixation_order} order), {design.repetitions} repetitions, {design.catch_trials} catch trials. "
        "Every subject judges every scene, in a random order from the seed that the data set records."
    )
    assumed = (
        "analysed as above (Holm\u2019s p for H1 and H3, two one-sided tests for H2), none excluded. Assumed: a mean "
        f"near rise of {model.effect:g} and far rise of {model.far_effect:g} (ratios), standard deviations of the "
        f"log rise of {model.between:g} over subjects and {model.between_scenes:g} over scenes, of one log rating of "
        f"{model.noise:g}."
    )
    title = "Preregistration: depth ratings by aperture and fixation"
    return title, _blocks(hypotheses, outcome, shown, stated, analysis_ratings(bound, "ratio"), assumed, powers, TESTS)


def _of_cube(design: NeckerDesign, stated: Stated) -> tuple[str, list[Block]]:
    model = CubeModel()
    study = CubeStudy(model, design)
    powers = quick_cube_power(study, SUBJECTS, EXPERIMENTS)
    largest = max(design.strengths_mm)
    claims = {
        "nonrigid_longer": ("nonrigid", "raises"),
        "nonrigid_shorter": ("rigid", "lowers"),
    }
    hypotheses = [
        f"H{number}{' (primary)' if number == 1 else ''}. Blur that agrees with the {claims[test][0]} reading "
        f"({largest:g} mm) {claims[test][1]} the nonrigid share of the time."
        for number, test in enumerate(study.tests, start=1)
    ]
    first = claims[next(iter(study.tests))][0]
    outcome = (
        "The nonrigid share of the time with one of the two readings: that with blur that agrees with the "
        f"{first} reading ({largest:g} mm) less that without blur, one value for each subject."
    )
    sizes = ", ".join(f"{mm:g}" for mm in design.strengths_mm)
    shown = (
        f"A turning wireframe Necker cube; gradients of blur: {', '.join(design.gradients)}; apertures of {sizes} mm; "
        f"trials of {design.trial_s:g} s, {design.repetitions} repetitions, turning {' and '.join(design.directions)}; "
        f"catch trials: {design.catch_trials}. Every subject sees every condition, in random order from the seed that "
        "the data set records."
    )
    assumed = (
        "drawn from one pool of 400 simulated people and analysed as above (paired t-tests, Holm\u2019s p over all "
        f"gradients and strengths), none excluded. Assumed: a ratio of odds of {model.effect:g} at the largest "
        f"aperture, its standard deviation over subjects (of its logarithm) of {model.between:g}, a nonrigid share of "
        f"{model.nonrigid:g} without blur, and durations as 22 people reported of a lattice."
    )
    title = "Preregistration: the turning Necker cube and focal gradients"
    analysis = [analysis_necker(stated.rules.shortest_both)]
    return title, _blocks(hypotheses, outcome, shown, stated, analysis, assumed, powers, study.tests)


def _blocks(
    hypotheses: list[str],
    outcome: str,
    shown: str,
    stated: Stated,
    analysis: list[str],
    assumed: str,
    powers: Mapping[int, Mapping[str, float]],
    tests: Mapping[str, str],
) -> list[Block]:
    return [
        Heading("Hypotheses"),
        *map(Paragraph, hypotheses),
        Heading("Primary outcome"),
        Paragraph(outcome),
        Heading("Design"),
        Paragraph(shown),
        Heading("Exclusions"),
        Paragraph("Rules that do not look at the effect, applied before the analysis; the file rules.toml holds them."),
        _rules(stated),
        Heading("Analysis"),
        Paragraph("In the words in which the report will describe it:"),
        *map(Paragraph, analysis),
        Heading("Number of subjects"),
        Paragraph(_enough(powers, assumed)),
        _power(powers, tests),
    ]


def _rules(stated: Stated) -> Table:
    rows = []
    for name, meaning in MEANING.items():
        value = getattr(stated.rules, name)
        rows.append([name, "none" if value is None else str(value), meaning.split("; false")[0]])
    return Table("Rules", ["rule", "value", "meaning"], rows)


def _enough(powers: Mapping[int, Mapping[str, float]], assumed: str) -> str:
    subjects = next((number for number, found in powers.items() if min(found.values()) >= WANTED), None)
    number = (
        f"{subjects} subjects are the fewest of those tried with a power of {WANTED:.0%} or more for each hypothesis"
        if subjects
        else f"None of the numbers tried reaches a power of {WANTED:.0%} for each hypothesis"
    )
    return (
        f"{number}, by {EXPERIMENTS:,} simulated experiments each, {assumed} These are assumptions; "
        "focalgradient power takes others."
    )


def _power(powers: Mapping[int, Mapping[str, float]], tests: Mapping[str, str]) -> Table:
    rows = [[str(subjects), *(f"{found[test]:.0%}" for test in tests)] for subjects, found in powers.items()]
    return Table("Share of simulated experiments that find", ["subjects", *tests.values()], rows)
