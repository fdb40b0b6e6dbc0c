"""The report of a data set that is damaged, incomplete or mixed: what can be analysed is, and the rest is named."""

import itertools
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from recorded import edit, rating_file, record_necker, record_ratings

from focalgradient import InputError
from focalgradient.power import Model
from focalgradient.report import make_report

pytestmark = pytest.mark.usefixtures("unrendered")


@pytest.fixture(scope="module")
def few(tmp_path_factory) -> Path:
    root = tmp_path_factory.mktemp("few") / "data"
    return record_necker(record_ratings(root, 2), 2)


@pytest.fixture
def copy(few, tmp_path) -> Path:
    """To be spoilt, and without journals, so that tables alone count."""
    root = Path(shutil.copytree(few, tmp_path / "data"))
    shutil.rmtree(root / "sourcedata")
    return root


def page(made) -> str:
    return made.files["report.html"].decode().replace("\N{NO-BREAK SPACE}", " ")


def test_what_can_be_analysed_is(copy):
    edit(rating_file(copy), 5, "rating", "0")
    made = make_report(copy)
    (problem,) = (one for one in made.problems if "has no journal" not in one)
    assert problem.startswith("Left out of the analysis: ")
    assert "row 5: rating is '0'" in problem
    assert "necker.png" in made.files
    assert "Problem: Left out of the analysis: sub-01" in page(made)
    assert "is the default: state your own" in page(made)  # the bound of equivalence


@pytest.mark.parametrize(
    ("table", "sidecar", "said"),
    [
        ("mine_beh", '{"GeneratedBy": "focalgradient"}', "is of a task 'mine' that is unknown here"),
        ("mine_beh", "{}", "holds the task 'mine' of another program"),
        ("necker_events", "{}", "contains no answers to any known task"),
    ],
)
def test_a_task_that_is_unknown_or_has_no_answers_is_named(tmp_path, copy, table, sidecar, said):
    for file in copy.glob("sub-*/beh/*.tsv"):
        file.unlink()
    path = copy / "sub-01" / "beh" / f"sub-01_task-{table}.tsv"
    path.write_text("onset\tduration\n0\t1\n")
    path.with_suffix(".json").write_text(sidecar)
    with pytest.raises(InputError, match=said):
        make_report(copy)


def test_all_excluded_is_said(tmp_path):
    made = make_report(record_ratings(tmp_path / "data", 2, Model(noise=2.0)))
    assert "leave out all 2 subjects (" in page(made)
    assert "answers to one picture spread by more than a factor 2: 2" in made.notices[-1]
    assert "depth_rating_exclusions.csv" in made.files


def test_cells_without_answers_are_stated_once_with_the_tests_concerned(tmp_path) -> None:
    """One subject did not answer one scene with the near object in focus."""
    random = np.random.default_rng(2)
    shown = itertools.product(range(8), range(6), ("pinhole", "f/11", "f/5.6"), ("near", "far"))
    rows = [
        f"p{who},s{scene},{aperture},{end},{np.exp(random.normal(0, 0.2)):.2f}"
        for who, scene, aperture, end in shown
        if (who, scene, end) != (1, 2, "near")
    ]
    table = tmp_path / "own.csv"
    table.write_text("\n".join(["participant,scene,aperture,fixation,rating", *rows]))
    [note] = re.findall(r"[^>]*: 1 of 48 cells of subjects by scenes have no answers", page(make_report(table)))
    assert "depth effect, nearest;" in note
    assert "depth effect, farthest" not in note
