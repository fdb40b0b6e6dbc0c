"""Records of a session: the apparatus, and the answer to each kind of trial."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Annotated, Any

from focalgradient.dataset.percepts import Press, percepts
from focalgradient.errors import InputError, check_fields
from focalgradient.quantities import Range
from focalgradient.tasks import Noted, Response
from focalgradient.tasks.noted import EXTRA, OpenRecord
from focalgradient.tasks.response import SECONDS

__all__ = ["Answer", "Apparatus", "Chosen", "Noted", "Rated", "Response", "Watched", "answer_event", "fields_of"]


GAMMA = Range("exponents of luminance", positive=True)


@dataclass(frozen=True, slots=True)
class Apparatus:
    """Apparatus of a sitting.

    Parameters
    ----------
    clock
        Description of the clock and its origin.
    screen_px, screen_m
        Width and height of the screen, in px and m.
    screen_sd_m
        Standard errors of width and height in m, if they were estimated with a card held against the screen.
    viewing_distance_m
        Distance from the eye to the screen, in m.
    viewing_distance_sd_m
        Standard error of the viewing distance in m, if it was estimated by the blind spot; includes the error of the
        screen's size.
    refresh_hz
        Measured refresh rate, in Hz.
    gamma
        Gamma for which the pictures were corrected; None if they were not.
    gamma_channels
        Measured gammas of red, green and blue; None if unknown.
    gamma_seen
        Gamma and its standard error from grey matches by the participant; it was not corrected for.
    white_cd_m2
        Measured luminance of white, in cd/m2.
    versions
        Versions of other software, by name.
    stereoscope
        Layout, offset in px and gamma of each eye, if the eyes saw different parts of a screen; None: both saw the
        whole screen.
    """

    clock: str
    screen_px: Annotated[tuple[int, int], Range("pixels", positive=True)] | None = None
    screen_m: Annotated[tuple[float, float], Range("metres", positive=True)] | None = None
    screen_sd_m: Annotated[tuple[float, float], Range("metres", 0)] | None = None
    viewing_distance_m: Annotated[float, Range("metres", positive=True)] | None = None
    viewing_distance_sd_m: Annotated[float, Range("metres", 0)] | None = None
    refresh_hz: Annotated[float, Range("hertz", positive=True)] | None = None
    gamma: Annotated[float, GAMMA] | None = None
    gamma_channels: Annotated[tuple[float, float, float], GAMMA] | None = None
    gamma_seen: Annotated[tuple[float, float], Range("exponents of luminance", 0)] | None = None
    white_cd_m2: Annotated[float, Range("cd/m^2", positive=True)] | None = None
    versions: Mapping[str, str] = field(default_factory=dict)
    stereoscope: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rated(Response):
    """Answer to a rating trial, with the parameters of `Response`; `onset` is that of the picture.

    Parameters
    ----------
    rating
        Ratio to the standard, or a value on the design's other scale.
    confidence
        Confidence from 0 to 1, if it was asked for.
    stimulus
        File of the picture, as named in the manifest.
    start
        Random initial position of the marker on the scale.
    gaze_away
        Largest distance of a fixation from the object to be fixated, in degrees; None if unknown or not recorded.
    gaze_left
        Whether that exceeds the design's limit or is unknown; None if gaze was not recorded.
    """

    rating: Annotated[float, Range("the units of the scale")]
    confidence: Annotated[float, Range("shares", 0, 1)] | None = None
    stimulus: str | None = None
    start: float | None = None
    gaze_away: Annotated[float, Range("degrees", 0)] | None = None
    gaze_left: bool | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Watched(metaclass=OpenRecord):
    """Answer to a Necker cube trial: the key presses and releases.

    Parameters
    ----------
    onset
        Onset of the trial, in s on the clock of the sitting.
    presses
        Presses and releases in order of time, in s from the onset.
    trial_duration
        Duration of the trial, in s.
    dropped_frames
        Number of frames dropped during the trial.
    extra
        Additional values by name, from keywords other than the fields above.
    """

    onset: Annotated[float, SECONDS]
    presses: Sequence[Press]
    trial_duration: float
    dropped_frames: int = 0
    extra: Mapping[str, Noted] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_fields(self)
        percepts(self.presses, {}, self.trial_duration)

    def share_held(self, keys: Mapping[str, str], percept: str) -> float:
        """Return the share of the trial for which only the key of a percept was held; `keys` by percept.

        >>> Watched(onset=0.0, presses=[Press(1.0, "f", True)], trial_duration=4.0).share_held({"rigid": "f"}, "rigid")
        0.75
        """
        seen = percepts(self.presses, keys, self.trial_duration)
        return sum(part.end - part.onset for part in seen if part.percept == percept) / self.trial_duration


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen(Response):
    """Answer to a two-interval forced-choice (2IFC) trial, with the level that a procedure had chosen.

    It also has the parameters of `Response`; `onset` is that of the first picture.

    Parameters
    ----------
    level
        Level added in one interval, in dioptres or millimetres.
    answer
        Interval chosen, 1 or 2.
    correct
        Whether the interval with the added level was chosen.
    stimulus
        File of the picture that was blurred, as named in the manifest.
    """

    level: Annotated[float, Range("the unit of the design", 0)]
    answer: int
    correct: bool
    stimulus: str | None = None

    def __post_init__(self) -> None:
        Response.__post_init__(self)
        if self.answer not in (1, 2):
            raise InputError(f"answer is {self.answer!r}, but must be 1 or 2, the interval that was chosen.")


Answer = Response | Watched
"""Answer to any trial."""


def answer_event(answer: Answer) -> dict[str, Any]:
    """Return an answer as a journal entry."""
    event = fields_of(answer)
    event.pop(EXTRA)
    return event | ({EXTRA: {name: one.entry() for name, one in answer.extra.items()}} if answer.extra else {})


def fields_of(record: Any) -> dict[str, Any]:
    """Return the fields of a trial or an answer, whose values need no copy."""
    return {one.name: getattr(record, one.name) for one in fields(record)}
