"""What the page sends, checked before anything is done with it."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field

from focalgradient.design.form import ABOUT, LONGEST_ABOUT

__all__ = [
    "Answer",
    "Answered",
    "Begin",
    "Begun",
    "Depth",
    "Frames",
    "Given",
    "Join",
    "Necker",
    "Next",
    "Note",
    "Resumed",
    "Sitting",
    "Who",
]

Count = Annotated[int, Field(ge=0, le=1_000_000)]
Label = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[\w-]+$")]
Milliseconds = Annotated[float, Field(ge=0, le=1e12, allow_inf_nan=False)]
About = Annotated[str, Field(min_length=1, max_length=LONGEST_ABOUT, pattern=ABOUT)]
Seconds = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]


class Message(BaseModel):
    """Of a kind that is known, with nothing else in it."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Join(Message):
    """Somebody comes by the open link; the browser keeps `secret`, with which alone the session goes on."""

    secret: Annotated[str, Field(min_length=32, max_length=64, pattern=r"^[\w-]+$")] | None = None
    platform: Annotated[dict[str, Annotated[str, Field(max_length=200)]], Field(max_length=20)] = {}


class Who(Message):
    """Which session, and which tab of which browser shows it."""

    token: Label
    tab: Label


class Sitting(Message):
    """The participant agrees, the screen is measured.

    Its size and distance by `card_px` and `blind_spot_px`, or given in metres; its gamma by matches of greys.
    `refresh_hz` is None where the browser does not show how often it draws. `now_ms` is the page's clock when the
    measurement ended, `waited_ms` the time from then to this message. `about` is what the form asked for.
    """

    consent: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")] | None = None
    screen_px: Annotated[list[Annotated[int, Field(gt=0, le=100_000)]], Field(min_length=2, max_length=2)]
    screen_m: (
        Annotated[list[Annotated[float, Field(gt=0, le=10, allow_inf_nan=False)]], Field(min_length=2, max_length=2)]
        | None
    ) = None
    viewing_distance_m: Annotated[float, Field(gt=0, le=20, allow_inf_nan=False)] | None = None
    card_px: Annotated[float, Field(gt=1, le=20_000, allow_inf_nan=False)] | None = None
    blind_spot_px: Annotated[
        list[Annotated[float, Field(ge=-20_000, le=20_000, allow_inf_nan=False)]], Field(max_length=100)
    ] = []
    gamma_matches: Annotated[
        list[tuple[Annotated[float, Field(gt=0, lt=1)], Annotated[int, Field(ge=1, le=254)]]], Field(max_length=100)
    ] = []
    pixel_ratio: Annotated[float, Field(gt=0, le=20, allow_inf_nan=False)]
    refresh_hz: Annotated[float, Field(gt=0, le=2000, allow_inf_nan=False)] | None = None
    browser: Annotated[str, Field(max_length=500)]
    now_ms: Milliseconds
    waited_ms: Milliseconds = 0.0
    about: Annotated[dict[Label, About], Field(max_length=20)] = {}


class Begin(Sitting, Who):
    """The session begins or goes on."""


class Shown(Message):
    """Time stamps of all frames of one interval, from its onset to its offset."""

    event: Annotated[str, Field(pattern=r"^[a-z]{1,20}$")]
    stamps: Annotated[list[Milliseconds], Field(min_length=2, max_length=200_000)]


class Frames(Message):
    """What the page noted of a trial beside its answer."""

    shown: Annotated[list[Shown], Field(max_length=10)]
    hidden: Count = 0
    left_full_screen: Count = 0
    zoomed: Count = 0


Also = Annotated[dict[Label, Annotated[float, Field(allow_inf_nan=False)]], Field(max_length=50)]
"""Answers to further questions, by their column; of two ways 1 or 2."""


class Depth(Message):
    """An answer on how three-dimensional a picture looked."""

    onset: Seconds
    rating: Annotated[float, Field(allow_inf_nan=False)]
    response_time: Seconds
    dropped_frames: Count = 0
    start: Annotated[float, Field(allow_inf_nan=False)] | None = None
    frames: Frames
    also: Also = {}


class Necker(Message):
    """Keys held while the cube turned."""

    onset: Seconds
    presses: Annotated[
        list[tuple[Annotated[float, Field(ge=-10, le=1e6)], Annotated[str, Field(max_length=20)], bool]],
        Field(max_length=100_000),
    ]
    trial_duration: Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]
    dropped_frames: Count = 0
    frames: Frames
    also: Also = {}


class Again(Message):
    """An answer in practice that was repeated: `phase` and `trial` are those of the list."""

    phase: Literal["practice"]
    trial: Annotated[int, Field(ge=1, le=100_000)]
    answer: dict[str, Any]


class Round(Message):
    """Practice, judged once: how many answers were right, and of a repetition the answers."""

    round: Annotated[int, Field(ge=1, le=20)]
    right: Count
    of: Count
    passed: bool
    again: Annotated[list[Again], Field(max_length=100)] = []


class Answer(Message):
    """An answer: `phase` and `trial` are its key, `attempt` distinguishes one sending from another of the same.

    What was found in practice comes with the first answer that counts.
    """

    phase: Annotated[str, Field(pattern=r"^(practice|main)$")]
    trial: Annotated[int, Field(ge=1, le=100_000)]
    attempt: Label
    answer: dict[str, Any]
    practice: Annotated[list[Round], Field(max_length=20)] = []


class Given(Answer, Who):
    """An answer of a session's page."""


class Next(Who):
    """The page asks what a trial shows."""

    phase: Annotated[str, Field(pattern=r"^(practice|main)$")]
    trial: Annotated[int, Field(ge=1, le=100_000)]


Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class Line(Message):
    """Something that the page of an exported study notes: `line` counts those of its session, from 0."""

    focalgradient: Literal[1]
    session: Label
    line: Count
    time: AwareDatetime


class Opened(Line):
    """A sitting begins."""

    platform: Annotated[str, Field(pattern=r"^[a-z]{1,20}$")]
    sitting: Sitting


class Begun(Opened):
    """The first line of a session: whose it is, and what it shows."""

    kind: Literal["begun"]
    participant: Annotated[str, Field(pattern=r"^[A-Za-z0-9]{1,32}$")]
    design: dict[str, Any]
    stimuli: Sha256 | None
    list: Sha256
    study: Sha256


class Resumed(Opened):
    """The page was loaded again."""

    kind: Literal["resumed"]


class Answered(Line):
    """An answer."""

    kind: Literal["answer"]
    given: Answer


Note = Annotated[Begun | Resumed | Answered, Field(discriminator="kind")]
"""A line of an exported study."""
