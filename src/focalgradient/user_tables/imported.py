"""Answers of the user's own table, with notes on its reading and the columns that have no role."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Self

import pandas as pd

from focalgradient.user_tables.cleaning import note_few_trials
from focalgradient.user_tables.source import Source

__all__ = ["ImportedAnswers"]

ADDED = ("included", "log_rating")
"""Columns that a report adds to the exported trials."""


@dataclass(frozen=True, slots=True, eq=False)
class ImportedAnswers:
    """Answers of the user's own table.

    Parameters
    ----------
    table
        One row per trial or report. The index contains file and row.
    notes
        Assumptions, omissions and changes, one sentence each.
    notices
        Interpretations that change the results, one sentence each, shown at the top of a report.
    problems
        Omitted data that may be answers, one sentence each.
    unused
        All rows of the columns without a role, as texts.
    """

    table: pd.DataFrame
    notes: tuple[str, ...]
    notices: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    unused: pd.DataFrame = field(default_factory=pd.DataFrame)

    @classmethod
    def of(cls, source: Source, table: pd.DataFrame, **more: Any) -> Self:
        """Return a table that was read from a source, with notes on its reading."""
        used = {source.columns.get(str(role)) for role in table}
        if table.index.nlevels > 2:  # a column for each condition
            used |= {*table.index.get_level_values(2)}
        unused = source.cells[[name for name in source.cells if str(name).strip() and name not in used]]
        if "percept" not in table:
            note_few_trials(table, source.notices)
        said = tuple(source.notes), tuple(source.notices), tuple(source.problems)
        return cls(table, *said, unused=unused, **more)

    @property
    def exported(self) -> pd.DataFrame:
        """Table with all columns of the file: `unused` ones last, with " (file)" if the table has their name.

        >>> cells = pd.DataFrame({"eye": ["L", "R"], "kind": ["a", "b"]})
        >>> ImportedAnswers(pd.DataFrame({"kind": ["human"]}, index=[1]), (), unused=cells).exported.to_dict("records")
        [{'kind': 'human', 'eye': 'R', 'kind (file)': 'b'}]
        """
        index = self.table.index
        places = index.droplevel(2) if index.nlevels > 2 else index  # type: ignore[arg-type]  # its stub is wrong
        unused = self.unused.loc[places].set_axis(index)
        names = {name: f"{name} (file)" for name in unused if name in self.table or name in ADDED}
        return pd.concat([self.table, unused.rename(columns=names)], axis=1)
