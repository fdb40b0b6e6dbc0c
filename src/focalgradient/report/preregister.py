"""The text of a preregistration, written from a design before there are data."""

from __future__ import annotations

from pathlib import Path

from focalgradient.design import DepthRatingDesign, load_design
from focalgradient.errors import InputError
from focalgradient.power import TESTS, Model, Study, quick_power
from focalgradient.report.analysed import BOUND
from focalgradient.report.document import Block, Heading, Paragraph, Table, as_html, as_markdown
from focalgradient.report.rules import MEANING, Stated, as_toml
from focalgradient.report.words import analysis_ratings

__all__ = ["preregistration"]

SUBJECTS = (6, 8, 10, 12, 16, 20, 24, 30, 40)
EXPERIMENTS = 2000
WANTED = 0.8
"""Power that the number of subjects is to reach, for all of the hypotheses: Cohen's (1988) convention."""


def preregistration(
    design_file: Path, *, bound: float | None = None, stated: Stated, model: Model | None = None
) -> dict[str, bytes]:
    """Files of a preregistration of experiment 1: HTML, Markdown, and the rules as a file for `report --rules`.

    Parameters
    ----------
    design_file
        The design (TOML).
    bound
        Of equivalence; without it that of `stated`, or 1.2.
    stated
        Rules of exclusion.
    model
        Of the simulated subjects, for the number of subjects.

    Raises
    ------
    InputError
        If the file is no design of depth ratings, or lacks what the hypotheses need.
    """
    design = load_design(design_file)
    if not isinstance(design, DepthRatingDesign):
        raise InputError(f"{design_file} is a design of {design.task}: a preregistration is written for depthrating.")
    used = bound or stated.bound or BOUND
    model = model or Model()
    study = Study(model, design, used)
    powers = {subjects: quick_power(study, subjects, EXPERIMENTS) for subjects in SUBJECTS}
    enough = next((subjects for subjects, found in powers.items() if min(found.values()) >= WANTED), None)
    title = "Preregistration: depth ratings by aperture and fixation"
    blocks: list[Block] = [
        Heading("Hypotheses"),
        Paragraph(
            "H1 (primary). With the nearest object in focus, ratings of depth rise from the pinhole to the largest "
            "aperture."
        ),
        Paragraph(
            f"H2. With the farthest object in focus, that rise is equivalent to zero: within a factor of {used:g}, the "
            "smallest rise that would matter."
        ),
        Paragraph("H3. The rise is larger with the nearest than with the farthest object in focus."),
        Heading("Primary outcome"),
        Paragraph(
            "The log ratio of the rating at the largest aperture to that at the pinhole with the nearest object in "
            "focus, one value for each subject and scene, repetitions averaged."
        ),
        Heading("Design"),
        Paragraph(
            f"{len(design.scenes)} scenes, the apertures {', '.join(design.apertures)} of a lens of "
            f"{design.focal_length_mm:g} mm, each scene with the {' and the '.join(design.fixations)} object in focus "
            f"({design.fixation_order} order), {design.repetitions} repetitions, {design.catch_trials} catch trials. "
            "Every subject judges every scene, in a random order from the seed that the data set records."
        ),
        Heading("Exclusions"),
        Paragraph("Rules that do not look at the effect, applied before the analysis; the file rules.toml holds them."),
        _rules(stated),
        Heading("Analysis"),
        *map(Paragraph, analysis_ratings(used, "ratio")),
        Heading("Number of subjects"),
        Paragraph(_enough(enough, model, used)),
        _power(powers),
    ]
    return {
        "preregistration.html": as_html(title, blocks).encode(),
        "preregistration.md": as_markdown(title, blocks).encode(),
        "rules.toml": as_toml(stated.rules, used).encode(),
    }


def _rules(stated: Stated) -> Table:
    rows = []
    for name, meaning in MEANING.items():
        value = getattr(stated.rules, name)
        rows.append([name, "none" if value is None else str(value), meaning.split("; false")[0]])
    return Table("Rules", ["rule", "value", "meaning"], rows)


def _enough(subjects: int | None, model: Model, bound: float) -> str:
    number = (
        f"{subjects} subjects are the fewest of those tried with a power of {WANTED:.0%} or more for each hypothesis"
        if subjects
        else f"None of the numbers tried reaches a power of {WANTED:.0%} for each hypothesis"
    )
    return (
        f"{number}, by {EXPERIMENTS:,} simulated experiments each, analysed as above (Holm\u2019s p for H1 and H3, two "
        f"one-sided tests for H2), none excluded. Assumed: a mean near rise of {model.effect:g} and far rise of "
        f"{model.far_effect:g} (ratios), standard deviations of the log rise of {model.between:g} over subjects and "
        f"{model.between_scenes:g} over scenes, of one log rating of {model.noise:g}. These are assumptions; "
        "focalgradient power takes others."
    )


def _power(powers: dict[int, dict[str, float]]) -> Table:
    rows = [[str(subjects), *(f"{found[test]:.0%}" for test in TESTS)] for subjects, found in powers.items()]
    return Table("Share of simulated experiments that find", ["subjects", *TESTS.values()], rows)
