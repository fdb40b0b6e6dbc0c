"""The columns of the long tables: what stands in them, for readers, for the sidecars, and for checks."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Any, Literal

from focalgradient.scales import AnswerColumn, scale_of

__all__ = ["APERTURE", "COLUMNS", "FORMULA", "TITLES", "Column", "cell", "columns_of"]

Form = Literal["integer", "number", "bool", "text"]

APERTURE = re.compile(r"pinhole|f/\d+(\.\d+)?")


FORMULA = ("=", "+", "-", "@")
"""What a cell that a spreadsheet takes for a formula begins with."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table.

    Parameters
    ----------
    name, about
        Its heading, and what it means.
    form
        What its cells are.
    units
        As BIDS writes them.
    levels
        The texts that there are, each with its meaning; empty where any text may stand.
    least, most
        No number is smaller, or larger.
    above
        Every number is greater.
    optional
        Whether a cell may be without a value ("n/a").
    """

    name: str
    about: str
    form: Form
    units: str | None = None
    levels: Mapping[str, str] = field(default_factory=dict, hash=False)
    least: float | None = None
    most: float | None = None
    above: float | None = None
    optional: bool = False

    @property
    def expected(self) -> str:
        """What a cell must be, in words."""
        if self.form == "bool":
            return "true or false"
        if self.form == "text":
            if self.name == "aperture":
                return "'pinhole' or an f-number like 'f/5.6'"
            return f"one of {', '.join(self.levels)}" if self.levels else "a text"
        kind = "a whole number" if self.form == "integer" else "a number"
        if self.above is not None:
            return f"{kind} above {self.above:g}"
        if self.least is not None and self.most is not None:
            return f"{kind} from {self.least:g} to {self.most:g}"
        return kind if self.least is None else f"{kind} of {self.least:g} or more"

    def described(self) -> dict[str, Any]:
        """What a sidecar says of it."""
        levels = {"true": "yes", "false": "no"} if self.form == "bool" else dict(self.levels)
        form = {"integer": "integer", "number": "number"}.get(self.form)
        # Of what must be greater, BIDS can say only that it is no smaller.
        minimum = self.above if self.least is None else self.least
        range_ = {"Minimum": minimum, "Maximum": self.most}
        entries = {"Description": self.about, "Units": self.units, "Levels": levels, "Format": form, **range_}
        return {key: value for key, value in entries.items() if value not in (None, {})}

    @property
    def absent(self) -> Any:
        """What stands for the column in the rows of sessions that do not have it."""
        return {"bool": False, "integer": 0, "number": math.nan, "text": None}[self.form]


def cell(value: Any) -> str:
    """A value as a cell of a table: numbers to nine decimals, "n/a" where there is none.

    A text that a spreadsheet would take for a formula gets an apostrophe before it; one line stays one line.

    >>> [cell(value) for value in (None, True, 3, 0.1 + 0.2, "f/22", "=1+1")]
    ['n/a', 'true', '3', '0.3', 'f/22', "'=1+1"]
    """
    kind = type(value)  # first what most cells hold
    if kind is float:
        return repr(round(value, 9)) if value == value else "n/a"
    if kind is str:
        return _text_cell(value)
    if kind is int:
        return str(value)
    if isinstance(value, str):
        return _text_cell(str(value))
    if value is None or value != value:
        return "n/a"
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(round(value, 9)) if isinstance(value, float) else str(value)


@lru_cache(maxsize=4096)
def _text_cell(text: str) -> str:
    line = text if text.isprintable() else " ".join(text.split())
    return f"'{line}" if line.startswith(FORMULA) else line


TRIAL = Column("trial", "Number of the trial, in the order shown.", "integer", least=1)
REPETITION = Column(
    "repetition", "How many times this condition has been shown, this time included.", "integer", least=1
)
SITTING = Column("sitting", "1; one more after each time that the session was cut off and resumed.", "integer", least=1)
DROPPED = Column("dropped_frames", "Frames of the display that came late during the trial.", "integer", least=0)
SCENE = Column("scene", "Name of the scene.", "text")
STIMULUS = Column("stimulus", "File of the picture, as the manifest of the stimuli names it.", "text", optional=True)


def _judged(standard: str) -> tuple[Column, ...]:
    return (
        Column("onset", "When the picture appeared, on the clock of the sitting.", "number", "s", least=0),
        Column("rating", f"Three-dimensionality as a ratio to {standard}, which is 1.", "number", above=0),
        Column("response_time", "From the question to the answer.", "number", "s", least=0),
        Column("confidence", "How sure the participant was, from 0 to 1.", "number", least=0, optional=True),
        DROPPED,
        STIMULUS,
        SITTING,
    )


COLUMNS: dict[str, tuple[Column, ...]] = {
    "depthrating": (
        TRIAL,
        SCENE,
        Column("aperture", "Aperture that the picture was made with: pinhole, or f-number.", "text"),
        Column("aperture_mm", "Its diameter; 0 for the pinhole.", "number", "mm", least=0),
        Column(
            "fixation",
            "The object to be fixated, which is in focus.",
            "text",
            levels={"nearest": "the nearest object of the scene", "farthest": "the farthest object of the scene"},
        ),
        REPETITION,
        Column("catch", "Whether the trial shows the standard itself, whose rating should be 1.", "bool"),
        *_judged("the standard, a pinhole picture"),
    ),
    "necker": (
        TRIAL,
        Column(
            "gradient",
            "The reading that the blur agrees with.",
            "text",
            levels={
                "none": "all lines are sharp",
                "rigid": "what is far in the rigid cube is blurred",
                "nonrigid": "what is near in the rigid cube, and far in its reversal, is blurred",
            },
        ),
        Column("strength", "Diameter of the aperture that would blur so; 0 without gradient.", "number", "mm", least=0),
        Column(
            "direction",
            "Where the near side of the rigid cube moves.",
            "text",
            levels={"right": "to the right", "left": "to the left"},
        ),
        Column(
            "shape",
            "What turns.",
            "text",
            levels={
                "ambiguous": "the wireframe cube",
                "rigid": "a shape that is rigid beyond doubt",
                "nonrigid": "a shape that is nonrigid beyond doubt",
            },
        ),
        REPETITION,
        Column("catch", "Whether the trial shows a shape that truly is nonrigid.", "bool"),
        Column("onset", "When the percept began, from the start of the trial.", "number", "s", least=0),
        Column("duration", "How long it lasted.", "number", "s", least=0),
        Column(
            "percept",
            "What the held keys say.",
            "text",
            levels={
                "rigid": "the key for rigid was held",
                "nonrigid": "the key for nonrigid was held",
                "none": "neither key was held",
                "both": "both keys were held",
            },
        ),
        Column("censored", "Whether the end of the trial cut the percept off.", "bool"),
        Column("trial_onset", "When the trial began, on the clock of the sitting.", "number", "s", least=0),
        Column("trial_duration", "How long the trial lasted.", "number", "s", above=0),
        DROPPED,
        SITTING,
    ),
    "pinhole": (
        TRIAL,
        Column(
            "form",
            "What was looked at.",
            "text",
            levels={"real": "the world around", "picture": "a picture on the screen"},
        ),
        Column(
            "viewing",
            "How it was looked at, with one eye.",
            "text",
            levels={
                "pinhole": "through a pinhole",
                "natural": "freely",
                "tube": "through a tube that shows as little of the scene as the pinhole does",
            },
        ),
        SCENE,
        REPETITION,
        *_judged("the view through the pinhole"),
    ),
    "blurthreshold": (
        TRIAL,
        SCENE,
        Column("interval", "Of the two intervals, the one to which the level was added.", "integer", least=1),
        Column(
            "level",
            "What was added: dioptres of defocus, or millimetres of aperture where depth is judged.",
            "number",
            above=0,
        ),
        Column("answer", "The interval that was chosen.", "integer", least=1),
        Column("correct", "Whether that is the one to which the level was added.", "bool"),
        REPETITION,
        Column("catch", "Whether the trial shows the greatest level, and does not count for the threshold.", "bool"),
        Column("onset", "When the first picture appeared, on the clock of the sitting.", "number", "s", least=0),
        Column("response_time", "From the question to the answer.", "number", "s", least=0),
        DROPPED,
        STIMULUS,
        SITTING,
    ),
}
"""By task, in the order of the table; a table has one row a trial, but for the cube one a percept."""

STANDARD_BEFORE = Column("standard_before", "Whether the standard was shown before the trial.", "bool")
START = Column(
    "start", "Where the marker first stood on the scale, at random; n/a where no key moved it.", "number", optional=True
)
INTERVAL = Column(
    "interval",
    "Of two intervals, the one in which the picture was; the reference was in the other.",
    "integer",
    least=1,
)
GAZE = (
    Column(
        "gaze_away",
        "Greatest distance between a fixation of the eyes and the fixated object, while pictures were shown; n/a where "
        "the eyes were not found for half of the time, or never stayed anywhere.",
        "number",
        "deg",
        least=0,
        optional=True,
    ),
    Column(
        "gaze_left",
        "Whether that is more than gaze_within_deg of the design, or is not known.",
        "bool",
    ),
)


def columns_of(task: str, design: Mapping[str, Any] | None) -> tuple[Column, ...]:
    """Give the columns that a session's table has, by its design as it was recorded.

    Designs of earlier versions say nothing of a scale, and their tables have none of what came with it.

    Raises
    ------
    InputError
        If the scale is not known here.

    Examples
    --------
    >>> names = [column.name for column in columns_of("depthrating", {"scale": "choice", "factors": {}})]
    >>> "interval" in names, "start" in names, len(columns_of("depthrating", {}))
    (True, True, 14)
    """
    if task != "depthrating" or not isinstance(design, Mapping) or "scale" not in design:
        return COLUMNS[task]
    factors = design.get("factors")
    levels = {
        str(name): [str(level) for level in factor.get("levels", ())]
        for name, factor in (factors if isinstance(factors, Mapping) else {}).items()
        if isinstance(factor, Mapping) and isinstance(factor.get("levels"), Sequence)
    }
    fixations = design.get("fixations")
    names = [str(name) for name in fixations] if isinstance(fixations, Sequence) else []
    gaze = design.get("gaze", "none") != "none"
    scale = scale_of(design)
    return _depth_columns(scale.column, scale.intervals, json.dumps(levels), json.dumps(names), gaze)


def rating_column(answer: AnswerColumn) -> Column:
    """Return the column of the answers on a scale.

    >>> from focalgradient.scales import VisualAnalogue
    >>> rating_column(VisualAnalogue().column).described()["Maximum"]
    100.0
    """
    return Column("rating", form="number", **{one.name: getattr(answer, one.name) for one in fields(answer)})


@lru_cache(maxsize=64)
def _depth_columns(
    answer: AnswerColumn, intervals: int, factors: str, fixations: str, gaze: bool
) -> tuple[Column, ...]:
    columns = list(COLUMNS["depthrating"])
    place = {column.name: number for number, column in enumerate(columns)}
    columns[place["rating"]] = rating_column(answer)
    own = [
        Column(name, "A factor of the design.", "text", levels=dict.fromkeys(levels, "as the design names it"))
        for name, levels in json.loads(factors).items()
    ]
    known = columns[place["fixation"]].levels
    others = [name for name in json.loads(fixations) if name not in known]
    if others:  # of the laboratory's own
        meanings = dict.fromkeys(others, "as the table of the pictures names it")
        columns[place["fixation"]] = replace(columns[place["fixation"]], levels={**known, **meanings})
    if gaze:
        columns[place["dropped_frames"] + 1 : place["dropped_frames"] + 1] = GAZE
    columns[place["catch"]] = replace(
        columns[place["catch"]], about="Whether the right answer is known: the standard itself, or an example."
    )
    columns.insert(place["rating"] + 1, START)
    columns[place["catch"] + 1 : place["catch"] + 1] = [
        STANDARD_BEFORE,
        *([INTERVAL] if intervals > 1 else []),
        *own,
    ]
    return tuple(columns)


TITLES = {
    "depthrating": "Three-dimensionality of pictures by aperture and fixation",
    "necker": "Rigidity of a rotating Necker cube by focal gradient",
    "pinhole": "Depth with one eye through a pinhole, freely, and through a tube",
    "blurthreshold": "Threshold of blur, or of depth from blur, by an adaptive procedure",
}
