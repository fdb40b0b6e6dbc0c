"""What is recorded of a session: what it was run with, and how each kind of trial was answered."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from focalgradient.dataset.percepts import Press, percepts
from focalgradient.errors import InputError, check_fields
from focalgradient.tasks import Noted, Response
from focalgradient.tasks.noted import EXTRA, OpenRecord

__all__ = ["Answer", "Apparatus", "Chosen", "Noted", "Rated", "Response", "Watched", "answer_event"]


@dataclass(frozen=True, slots=True)
class Apparatus:
    """What a sitting was run with.

    Parameters
    ----------
    clock
        What onsets are counted by and from, in words.
    screen_px, screen_m
        Width and height of the screen.
    screen_sd_m
        Standard errors of width and height, where they were estimated from a card held against the screen.
    viewing_distance_m
        From the eye to the screen.
    viewing_distance_sd_m
        Its standard error, where it was estimated by the blind spot; the screen's own error is in it.
    refresh_hz
        Measured.
    gamma
        That the screen was corrected for; None where it was not.
    gamma_channels
        Measured, of red, green and blue; None where they were not.
    gamma_seen
        The screen's own and its standard error, where a participant matched greys by eye; it was not corrected for.
    white_cd_m2
        Luminance of white, measured.
    versions
        Of what else was used, by name.
    stereoscope
        Layout, offset in pixels and gamma of each eye, where each eye saw a part of its own; None: both saw one screen.
    """

    clock: str
    screen_px: tuple[int, int] | None = None
    screen_m: tuple[float, float] | None = None
    screen_sd_m: tuple[float, float] | None = None
    viewing_distance_m: float | None = None
    viewing_distance_sd_m: float | None = None
    refresh_hz: float | None = None
    gamma: float | None = None
    gamma_channels: tuple[float, float, float] | None = None
    gamma_seen: tuple[float, float] | None = None
    white_cd_m2: float | None = None
    versions: Mapping[str, str] = field(default_factory=dict)
    stereoscope: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Rated(metaclass=OpenRecord):
    """An answer on how three-dimensional something looks.

    Parameters
    ----------
    onset
        When the picture appeared, in seconds of the sitting's clock.
    rating
        Ratio to the standard; or what else the scale of the design has.
    response_time
        From the question to the answer, in seconds.
    dropped_frames
        That came late during the trial.
    confidence
        From 0 to 1, where it was asked.
    stimulus
        The picture's file, as the manifest names it.
    start
        Where the marker first stood on the scale, at random.
    gaze_away
        Where the gaze was recorded: greatest distance of a fixation from the fixated object, in degrees; None where
        that is not known.
    gaze_left
        Whether that is farther than the design allows, or not known; None where the gaze was not recorded.
    extra
        Values noted beside it, by name: keywords that name none of these.
    """

    onset: float
    rating: float
    response_time: float
    dropped_frames: int = 0
    confidence: float | None = None
    stimulus: str | None = None
    start: float | None = None
    gaze_away: float | None = None
    gaze_left: bool | None = None
    extra: Mapping[str, Noted] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_fields(self)
        _finite(self, "onset", "response_time", "confidence", "gaze_away")
        if not math.isfinite(self.rating):
            raise InputError(f"rating is {self.rating!r}, but must be a finite number.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Watched(metaclass=OpenRecord):
    """What was pressed while the cube turned.

    Parameters
    ----------
    onset
        When the trial began, in seconds of the sitting's clock.
    presses
        In order of time.
    trial_duration
        How long it lasted, in seconds.
    dropped_frames
        That came late during the trial.
    extra
        Values noted beside it, by name: keywords that name none of these.
    """

    onset: float
    presses: Sequence[Press]
    trial_duration: float
    dropped_frames: int = 0
    extra: Mapping[str, Noted] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_fields(self)
        _finite(self, "onset")
        percepts(self.presses, {}, self.trial_duration)


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen(metaclass=OpenRecord):
    """Which of two intervals was chosen, at the level that a procedure had set.

    Parameters
    ----------
    onset
        When the first picture appeared, in seconds of the sitting's clock.
    level
        What was added in one interval: dioptres, or millimetres.
    answer
        The interval that was chosen, 1 or 2.
    correct
        Whether that is the one with the level.
    response_time
        From the question to the answer, in seconds.
    dropped_frames
        That came late during the trial.
    stimulus
        The file of the picture that was blurred, as the manifest names it.
    extra
        Values noted beside it, by name: keywords that name none of these.
    """

    onset: float
    level: float
    answer: int
    correct: bool
    response_time: float
    dropped_frames: int = 0
    stimulus: str | None = None
    extra: Mapping[str, Noted] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_fields(self)
        _finite(self, "onset", "level", "response_time")
        if self.answer not in (1, 2):
            raise InputError(f"answer is {self.answer!r}, but must be 1 or 2, the interval that was chosen.")


Answer = Rated | Watched | Chosen | Response
"""What a trial is answered by; a `Response` is that of a task of one's own."""


def answer_event(answer: Answer) -> dict[str, Any]:
    """Return what a journal keeps of an answer."""
    event = asdict(answer)
    event.pop(EXTRA)
    return event | ({EXTRA: {name: one.entry() for name, one in answer.extra.items()}} if answer.extra else {})


def _finite(answer: Answer, *names: str) -> None:
    for name in names:
        value = getattr(answer, name)
        if value is not None and not (math.isfinite(value) and value >= 0):
            raise InputError(f"{name} is {value!r}, but must be a finite number of 0 or more.")
