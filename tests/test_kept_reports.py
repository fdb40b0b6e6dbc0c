"""Reports and preregistrations of each kind, kept in `kept_reports/`: no word or number of them changes unnoticed.

    python tests/test_kept_reports.py [NAME ...]

writes them anew after a change that is meant; what then differs shows in the files. That the numbers are right is the
subject of other tests.
"""

from __future__ import annotations

import functools
import io
import re
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd
import pytest
import test_report_own_detection
import test_report_own_thresholds
from recorded import record_necker, record_ratings
from test_report_rules import careful
from test_scales import design_of, record

from focalgradient.power import Model
from focalgradient.report import Report, Stated, make_report
from focalgradient.report.meta import combined_report
from focalgradient.report.preregister import preregistration
from focalgradient.statistics import Rules

pytestmark = pytest.mark.usefixtures("unrendered")

KEPT = Path(__file__).parent / "kept_reports"

DIGITS, RELATIVE = 5, 2e-3
"""Digits of kept numbers, and how far others may be from them: another computer's iterations stop elsewhere."""

NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?![\w]|\.\d)|(?<!\w)\.\d+")
"""Numbers of a text, but not those of names, dates and versions."""


def exclusions(root: Path) -> Path:
    """Of six people one answers mostly at random, and one always the same."""
    table, random = careful(1, 6, 0.4).drop(columns="catch"), np.random.default_rng(1)
    guessed = (table["participant_id"] == "03") & (random.random(len(table)) < 0.7)
    table.loc[guessed, "rating"] = np.exp(random.uniform(-2.5, 2.5, guessed.sum()))
    table.loc[table["participant_id"] == "05", "rating"] = 1.0
    table.to_csv(root.with_suffix(".csv"), index=False)
    return root.with_suffix(".csv")


def incomplete(root: Path) -> Path:
    """Of a table of one's own, with names of its own, a fifth of the rows, and some cells, are not there."""
    table = careful(2, 6, 0.2).drop(columns=["trial", "catch"]).sample(frac=0.8, random_state=1).sort_index()
    table = table[~((table["participant_id"] == "02") & (table["scene"] == "s3"))]
    table.to_csv(root.with_suffix(".csv"), index=False)
    return root.with_suffix(".csv")


def own_steps(root: Path) -> Path:
    """Whole numbers of 1 to 7 in a table of one's own."""
    table = careful(3, 5, 0.3).drop(columns=["trial", "catch"])
    table["rating"] = np.digitize(np.log(table["rating"]), np.linspace(-0.6, 0.6, 6)) + 1
    table.to_csv(root.with_suffix(".csv"), index=False)
    return root.with_suffix(".csv")


def factors(root: Path) -> Path:
    light = {"light": {"levels": ["dim", "bright"]}}
    return record(root, design_of(factors=light), 6)


def thresholds(root: Path) -> Path:
    """Two conditions, and one person who guesses."""
    table = test_report_own_thresholds.answers(4, 12)
    table.loc[table["subject"] == "P3", "correct"] = np.random.default_rng(1).integers(0, 2, sum(table.subject == "P3"))
    table.drop(columns=["interval", "response"]).to_csv(root.with_suffix(".csv"), index=False)
    return root.with_suffix(".csv")


def table_of(made: Callable[[], pd.DataFrame]) -> Callable[[Path], Path]:
    def write(root: Path) -> Path:
        made().to_csv(root.with_suffix(".csv"), index=False)
        return root.with_suffix(".csv")

    return write


class Case(NamedTuple):
    """How data are made at a path, and what is given to `make_report` with them."""

    data: Callable[[Path], Path]
    given: Mapping[str, object] = MappingProxyType({})


WHOSE, WHERE = {"columns": {"participant": "participant_id"}}, {"columns": {"condition": "where"}}
CASES = {
    "ratings": Case(lambda root: record_ratings(root, 6, Model(effect=1.6)), {"bound": 1.25}),
    "exclusions": Case(exclusions, WHOSE),
    "factors": Case(factors),
    "steps": Case(lambda root: record(root, design_of(scale="steps"), 5)),
    "comparisons": Case(lambda root: record(root, design_of(scale="bipolar"), 6)),
    "choices": Case(lambda root: record(root, design_of(scale="choice"), 6)),
    "cube": Case(lambda root: record_necker(root, 6)),
    "thresholds": Case(thresholds, WHERE),
    "detection": Case(table_of(functools.partial(test_report_own_detection.answers, 4, 120)), WHERE),
}
COMPARED = {**CASES, "incomplete": Case(incomplete, WHOSE), "own_steps": Case(own_steps, {"scale": "ordinal", **WHOSE})}
"""Data sets on which processors, and states of the package, are compared."""


def pooled(root: Path) -> Report:
    made = {f"study {n}": record_ratings(root / f"{n}", 3 + n, Model(effect=1 + n / 4), seed=n) for n in (1, 2, 3)}
    return combined_report({name: make_report(data) for name, data in made.items()})


PLANS = {"plan_of_ratings": 'task = "depthrating"\n', "plan_of_the_cube": 'task = "necker"\n'}
"""Designs that are preregistered."""


def plan(design: str, folder: Path) -> Report:
    (folder / "design.toml").write_text(design)
    files = preregistration(folder / "design.toml", stated=Stated(Rules()))
    return Report({"report.md": files["preregistration.md"]}, ())


def report_of(name: str, folder: Path) -> Report:
    if name in PLANS:
        return plan(PLANS[name], folder)
    if name == "pooled":
        return pooled(folder)
    case = COMPARED[name]
    return make_report(case.data(folder / "data"), **case.given)  # type: ignore[arg-type]


NAMES = ["exclusions", "steps", "choices", "cube", "thresholds", "detection", "pooled", *PLANS]


def words_of(report: Report) -> str:
    """The text, but for lines that count or name versions, hashes, dates or random identifiers."""
    lines = report.files["report.md"].decode().splitlines()
    return (
        "\n".join(
            line for line in lines if not re.search(r"Analysed with|[0-9a-f]{16}|\d{4}-\d\d-\d\d|\d\.\d+\.\d", line)
        )
        + "\n"
    )


def numbers_of(report: Report) -> pd.DataFrame:
    """Every number of every table, once, by its table, row and column, but for the trials themselves."""
    rows = []
    for name, content in sorted(report.files.items()):
        if name.endswith(".csv") and not re.search(
            "trials|reports|versions|^files|results|robustness|dictionary", name
        ):
            table = pd.read_csv(io.BytesIO(content))
            for column in table.select_dtypes("number"):
                values = table[column].to_numpy(float)
                rows += [(name.removesuffix(".csv"), column, n, v) for n, v in enumerate(values) if np.isfinite(v)]
    return pd.DataFrame(rows, columns=["table", "column", "row", "value"])


def write(name: str) -> None:
    """Keep the report of a case."""
    KEPT.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        report = report_of(name, Path(folder))
    (KEPT / f"{name}.md").write_text(words_of(report), "utf-8")
    if len(found := numbers_of(report)):
        found.to_csv(KEPT / f"{name}.csv", index=False, float_format=f"%.{DIGITS}g")


def numbers(text: str) -> Iterator[tuple[float, float]]:
    """Each number of a text, and one of its last digit."""
    for found in NUMBER.findall(text):
        yield float(found), 10.0 ** -len(found.partition(".")[2])


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name == "pooled" else name for name in NAMES]
)
def test_a_report_is_as_it_was(name: str, tmp_path: Path) -> None:
    report = report_of(name, tmp_path)
    kept = (KEPT / f"{name}.md").read_text("utf-8").splitlines()
    made = words_of(report).splitlines()
    assert [NUMBER.sub("#", line) for line in made] == [NUMBER.sub("#", line) for line in kept]
    for line, before in zip(made, kept, strict=True):
        for (one, unit), (other, _) in zip(numbers(line), numbers(before), strict=True):
            assert abs(one - other) <= 1.01 * unit, f"{before}\n{line}"
    found = numbers_of(report)
    assert (KEPT / f"{name}.csv").exists() == bool(len(found))
    if not len(found):
        return
    before = pd.read_csv(KEPT / f"{name}.csv")
    pd.testing.assert_frame_equal(found.drop(columns="value"), before.drop(columns="value"))
    far = ~np.isclose(found["value"], before["value"], rtol=RELATIVE, atol=1e-6)
    assert not far.any(), pd.concat([before[far], found.loc[far, "value"].rename("found")], axis=1).to_string()


if __name__ == "__main__":
    for one in sys.argv[1:] or NAMES:
        write(one)
