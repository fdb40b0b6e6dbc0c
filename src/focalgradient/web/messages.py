"""Messages from the page, with their validation."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field

from focalgradient.design.form import ABOUT, LONGEST_ABOUT

__all__ = [
    "Answer",
    "AnswerWithPractice",
    "Answered",
    "Begin",
    "Begun",
    "Expose",
    "Exposed",
    "Exposure",
    "Frames",
    "Given",
    "Held",
    "Join",
    "Judge",
    "Next",
    "Note",
    "Rating",
    "Record",
    "Resumed",
    "Sitting",
    "Who",
]

Count = Annotated[int, Field(ge=0, le=1_000_000)]
Label = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[\w-]+$")]
Milliseconds = Annotated[float, Field(ge=0, le=1e12)]
RoundNumber = Annotated[int, Field(ge=1, le=20)]
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
TrialNumber = Annotated[int, Field(ge=1, le=100_000)]
About = Annotated[str, Field(min_length=1, max_length=LONGEST_ABOUT, pattern=ABOUT)]
Seconds = Annotated[float, Field(ge=0, le=1e6)]


class Message(BaseModel):
    """Base of all messages: unknown fields and numbers that are not finite are rejected."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class Join(Message):
    """Request to join through the open link; the browser keeps `secret`, which alone gives access to the session."""

    secret: Annotated[str, Field(min_length=32, max_length=64, pattern=r"^[\w-]+$")] | None = None
    platform: Annotated[dict[str, Annotated[str, Field(max_length=200)]], Field(max_length=20)] = {}


class Who(Message):
    """Session, and browser tab that shows it."""

    token: Label
    tab: Label


class OfTrial(Message):
    """Message about a trial."""

    phase: Annotated[str, Field(pattern=r"^(practice|main)$")]
    trial: TrialNumber


class Sitting(Message):
    """Consent, and measurements of the screen.

    Size and distance are derived from `card_px` and `blind_spot_px`, or given in metres; gamma from matches of greys.
    `refresh_hz` is None if the browser does not report its frame rate. `now_ms` is the page's clock at the end of the
    measurement, `waited_ms` the time from then to this message. `about` contains the entries of the form.
    """

    consent: Sha256 | None = None
    screen_px: Annotated[list[Annotated[int, Field(gt=0, le=100_000)]], Field(min_length=2, max_length=2)]
    screen_m: Annotated[list[Annotated[float, Field(gt=0, le=10)]], Field(min_length=2, max_length=2)] | None = None
    viewing_distance_m: Annotated[float, Field(gt=0, le=20)] | None = None
    card_px: Annotated[float, Field(gt=1, le=20_000)] | None = None
    blind_spot_px: Annotated[list[Annotated[float, Field(ge=-20_000, le=20_000)]], Field(max_length=100)] = []
    gamma_matches: Annotated[
        list[tuple[Annotated[float, Field(gt=0, lt=1)], Annotated[int, Field(ge=1, le=254)]]], Field(max_length=100)
    ] = []
    pixel_ratio: Annotated[float, Field(gt=0, le=20)]
    refresh_hz: Annotated[float, Field(gt=0, le=2000)] | None = None
    browser: Annotated[str, Field(max_length=500)]
    now_ms: Milliseconds
    waited_ms: Milliseconds = 0.0
    about: Annotated[dict[Label, About], Field(max_length=20)] = {}


class Begin(Sitting, Who):
    """Request to begin or resume the session."""


class Shown(Message):
    """Time stamps of all frames of one interval, from onset to offset, in ms."""

    event: Annotated[str, Field(pattern=r"^[a-z]{1,20}$")]
    stamps: Annotated[list[Milliseconds], Field(min_length=2, max_length=200_000)]


class Frames(Message):
    """Frame times of a trial, and disturbances of its display."""

    shown: Annotated[list[Shown], Field(max_length=60)]
    hidden: Count = 0
    left_full_screen: Count = 0
    zoomed: Count = 0


Also = Annotated[dict[Label, float], Field(max_length=50)]
"""Responses to additional questions by column; for a choice, 1 or 2."""


class Response(Message):
    """Parts of every response to a trial."""

    onset: Seconds
    dropped_frames: Count = 0
    frames: Frames
    also: Also = {}


class Rating(Response):
    """Response to a question; of a choice, which alternative was `chosen`."""

    rating: float | None = None
    chosen: Literal[1, 2] | None = None
    response_time: Seconds
    start: float | None = None


class Held(Response):
    """Presses and releases of keys while the pictures of a trial are shown."""

    presses: Annotated[
        list[tuple[Annotated[float, Field(ge=-10, le=1e6)], Annotated[str, Field(max_length=20)], bool]],
        Field(max_length=100_000),
    ]
    trial_duration: Annotated[float, Field(gt=0, le=1e6)]


class Again(Message):
    """Response to a repeated practice trial, identified by `phase` and `trial` of the list."""

    phase: Literal["practice"]
    trial: TrialNumber
    answer: dict[str, Any]


class Judge(Who):
    """Request to judge the responses of a round of practice so far."""

    round: RoundNumber
    answers: Annotated[list[Again], Field(min_length=1, max_length=100)]


class Round(Message):
    """Evaluation of one practice round: number of correct responses, and the responses of a repeated round."""

    round: RoundNumber
    right: Count
    of: Count
    passed: bool
    again: Annotated[list[Again], Field(max_length=100)] = []


class Answer(OfTrial):
    """Response, identified by `phase` and `trial`; `attempt` distinguishes repeated transmissions."""

    attempt: Label
    answer: dict[str, Any]


class AnswerWithPractice(Answer):
    """Response of a page without a server; the first of the main trials has the results of practice."""

    practice: Annotated[list[Round], Field(max_length=20)] = []


class Given(Answer, Who):
    """Response sent by a session's page; `trial_token` proves that the server gave this trial to it."""

    trial_token: Label


class Exposure(OfTrial):
    """Exposure of a trial, reported before it begins; `exposure` distinguishes repeated transmissions."""

    round: RoundNumber
    exposure: Label


class Expose(Exposure, Who):
    """Exposure reported by a session's page."""


class Next(OfTrial, Who):
    """Request for a trial and the few that follow it: their tokens, stimuli and pages.

    Main trials need the token that the last judgement of practice gave, unless an earlier sitting had all practice.
    """

    practice_token: Annotated[str, Field(max_length=100)] = ""


class Line(Message):
    """Record written by the page of an exported study; `line` numbers the session's records from 0."""

    focalgradient: Literal[1]
    session: Label
    line: Count
    time: AwareDatetime


class Opened(Line):
    """Record of the beginning of a sitting."""

    platform: Annotated[str, Field(pattern=r"^[a-z]{1,20}$")]
    sitting: Sitting


class Begun(Opened):
    """First record of a session: participant, design and stimuli."""

    kind: Literal["begun"]
    participant: Annotated[str, Field(pattern=r"^[A-Za-z0-9]{1,32}$")]
    design: dict[str, Any]
    stimuli: Sha256 | None
    list: Sha256
    study: Sha256


class Resumed(Opened):
    """Record of a reloaded page."""

    kind: Literal["resumed"]


class Exposed(Line):
    """Record that a trial was about to be shown."""

    kind: Literal["shown"]
    shown: Exposure


class Answered(Line):
    """Record of a response."""

    kind: Literal["answer"]
    given: AnswerWithPractice


Record = Begun | Resumed | Exposed | Answered
"""Any record of an exported study."""

Note = Annotated[Record, Field(discriminator="kind")]
"""As above, parsed by its kind."""
