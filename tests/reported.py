"""Data sets of each kind, recorded or written as tables, of which reports are made and compared."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
import pandas as pd
import test_report_own_detection
import test_report_own_thresholds
from recorded import record_necker, record_ratings
from test_report_rules import careful
from test_scales import design_of, record

from focalgradient.power import Model
from focalgradient.report import Report, make_report


class Case(NamedTuple):
    """How data are made at a path, and what is given to `make_report` with them."""

    data: Callable[[Path], Path]
    given: Mapping[str, object] = MappingProxyType({})

    def report(self, root: Path) -> Report:
        return make_report(self.data(root), **self.given)  # type: ignore[arg-type]


def table_of(made: Callable[[], pd.DataFrame]) -> Callable[[Path], Path]:
    def write(root: Path) -> Path:
        made().to_csv(root.with_suffix(".csv"), index=False)
        return root.with_suffix(".csv")

    return write


def exclusions() -> pd.DataFrame:
    """Of six people one answers mostly at random, and one always the same."""
    table, random = careful(1, 6, 0.4).drop(columns="catch"), np.random.default_rng(1)
    guessed = (table["participant_id"] == "03") & (random.random(len(table)) < 0.7)
    table.loc[guessed, "rating"] = np.exp(random.uniform(-2.5, 2.5, guessed.sum()))
    table.loc[table["participant_id"] == "05", "rating"] = 1.0
    return table


def incomplete() -> pd.DataFrame:
    """Of a table of one's own a fifth of the rows, and some cells, are not there."""
    table = careful(2, 6, 0.2).drop(columns=["trial", "catch"]).sample(frac=0.8, random_state=1).sort_index()
    return table[~((table["participant_id"] == "02") & (table["scene"] == "s3"))]


def own_steps() -> pd.DataFrame:
    """Whole numbers of 1 to 7 in a table of one's own."""
    table = careful(3, 5, 0.3).drop(columns=["trial", "catch"])
    return table.assign(rating=np.digitize(np.log(table["rating"]), np.linspace(-0.6, 0.6, 6)) + 1)


def thresholds() -> pd.DataFrame:
    """Two conditions, and one person who guesses."""
    table = test_report_own_thresholds.answers(4, 12)
    table.loc[table["subject"] == "P3", "correct"] = np.random.default_rng(1).integers(0, 2, sum(table.subject == "P3"))
    return table.drop(columns=["interval", "response"])


LIGHT = {"light": {"levels": ["dim", "bright"]}}
WHOSE, WHERE = {"columns": {"participant": "participant_id"}}, {"columns": {"condition": "where"}}
CASES = {
    "ratings": Case(lambda root: record_ratings(root, 6, Model(effect=1.6)), {"bound": 1.25}),
    "exclusions": Case(table_of(exclusions), WHOSE),
    "factors": Case(lambda root: record(root, design_of(factors=LIGHT), 6)),
    "comparisons": Case(lambda root: record(root, design_of(scale="bipolar"), 6)),
    "cube": Case(lambda root: record_necker(root, 6)),
    "thresholds": Case(table_of(thresholds), WHERE),
    "detection": Case(table_of(functools.partial(test_report_own_detection.answers, 4, 120)), WHERE),
    "incomplete": Case(table_of(incomplete), WHOSE),
    "own_steps": Case(table_of(own_steps), {"scale": "ordinal", **WHOSE}),
}
