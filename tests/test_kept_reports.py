"""Reports and preregistrations kept in `kept_reports/`: no word or number of them changes unnoticed.

    PYTHONPATH=tests python tests/test_kept_reports.py [NAME ...]

writes them anew after a change that is meant; what then differs shows in the files.
"""

from __future__ import annotations

import io
import re
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from reported import CASES

from focalgradient.report import Report, Stated
from focalgradient.report.preregister import preregistration
from focalgradient.statistics import Rules

KEPT = Path(__file__).parent / "kept_reports"
NAMES = ("exclusions", "cube", "comparisons", "thresholds", "detection")
PLANS = {
    "plan_of_ratings": 'task = "depthrating"\n',
    "plan_of_one_fixation": 'task = "depthrating"\nfixations = ["farthest"]\n',
    "plan_of_the_cube": 'task = "necker"\n',
}
"""Designs that are preregistered."""

NUMBER = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?![\w]|\.\d)|(?<!\w)\.\d+")
"""Numbers of a text, but not those of names, dates and versions."""


def plan(name: str, folder: Path) -> Report:
    (folder / "design.toml").write_text(PLANS[name])
    files = preregistration(folder / "design.toml", stated=Stated(Rules()))
    return Report({"report.md": files["preregistration.md"]}, ())


def words_of(report: Report) -> str:
    """The text, but for lines that count or name versions, hashes, dates or random identifiers."""
    lines = report.files["report.md"].decode().splitlines(keepends=True)
    return "".join(
        line for line in lines if not re.search(r"Analysed with|[0-9a-f]{16}|\d{4}-\d\d-\d\d|\d\.\d+\.\d", line)
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


def same_words(name: str, report: Report) -> None:
    made, kept = words_of(report), (KEPT / f"{name}.md").read_text("utf-8")
    assert NUMBER.sub("#", made).splitlines() == NUMBER.sub("#", kept).splitlines()
    for one, other in zip(NUMBER.findall(made), NUMBER.findall(kept), strict=True):
        assert abs(float(one) - float(other)) <= 1.01 * 10.0 ** -len(one.partition(".")[2])  # one of the last digit


@pytest.mark.parametrize("name", PLANS)
def test_a_preregistration_is_as_it_was(name: str, tmp_path: Path) -> None:
    same_words(name, plan(name, tmp_path))


@pytest.mark.usefixtures("unrendered")
@pytest.mark.parametrize("name", NAMES)
def test_a_report_is_as_it_was(name: str, tmp_path: Path) -> None:
    report = CASES[name].report(tmp_path / "data")
    same_words(name, report)
    found, before = numbers_of(report), pd.read_csv(KEPT / f"{name}.csv")
    pd.testing.assert_frame_equal(found, before, rtol=2e-3, atol=1e-6)  # another computer's iterations stop elsewhere


if __name__ == "__main__":
    for kind in sys.argv[1:] or (*NAMES, *PLANS):
        with tempfile.TemporaryDirectory() as folder:
            made = plan(kind, Path(folder)) if kind in PLANS else CASES[kind].report(Path(folder) / "data")
        (KEPT / f"{kind}.md").write_text(words_of(made), "utf-8")
        if kind in PLANS:
            continue
        numbers_of(made).to_csv(KEPT / f"{kind}.csv", index=False, float_format="%.5g")
