"""Definition of an experiment (`Experiment`), and the state that its trials share (`Sitting`)."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.dataset import Answer, Noted
from focalgradient.dataset.markers import MARKERS
from focalgradient.display import Display
from focalgradient.lab.questions import Given
from focalgradient.stimuli import Picture, StimulusSet
from focalgradient.tasks.noted import noted_start

if TYPE_CHECKING:
    from focalgradient.design.sequence import Page, Standard
    from focalgradient.design.words import Words
    from focalgradient.lab.gaze import Recorder, Taken
    from focalgradient.lab.screen import Screen

__all__ = ["EVENTS", "GREY", "Again", "Experiment", "Quit", "Sitting", "Unpractised"]


class Quit(Exception):  # noqa: N818  not an error
    """Raised when the participant or the experimenter stops the session."""


class Unpractised(Quit):
    """Raised when practice was not passed in its last round, and the design requires that."""


class Again(Exception):  # noqa: N818  not an error
    """Raised when a trial was interrupted and must be repeated from its start."""


GREY = -0.004  # 8-bit value 127, on PsychoPy's scale from -1 to 1

EVENTS = {name: marker.code for name, marker in MARKERS.items()}
"""Marker code by event name, for eye trackers and EEG."""


@dataclass(frozen=True, slots=True)
class Experiment:
    """Parts that are specific to one experiment.

    Parameters
    ----------
    task
        Name of the task of its design.
    about
        Description shown by the command's --help.
    trial
        Runs one trial and returns its answer; called again for an interrupted trial.
    pictures
        Lists the pictures required by a design: scene, aperture, fixation, levels of its factors.
    check
        Raises `InputError` if a design cannot be shown on a display, in a window of the given size in pixels.
    background
        Background grey of the screen, from -1 (black) to 1 (white).
    instructions
        Pages that replace the task's own instructions; the first line of each is its title.
    before
        Called at the start of a sitting, after the instructions.
    standard
        Shows the standard, after its introductory page, at the beginning of a sitting.
    right
        Returns whether a practice answer is correct, given trial and answer; None if it has no correct answer.
    """

    task: str
    about: str
    trial: Callable[[Sitting, Any], Answer]
    pictures: Callable[[Any], Sequence[tuple[str, str, str, Mapping[str, str]]]] = lambda design: ()
    check: Callable[[Any, Display, tuple[int, int]], None] = lambda design, display, room: None
    background: float = -1.0
    instructions: Callable[[Sitting], Sequence[str]] | None = None
    before: Callable[[Sitting], None] = lambda sitting: None
    standard: Callable[[Sitting], None] = lambda sitting: None
    right: Callable[[Sitting, Any, Any], bool | None] = lambda sitting, trial, answer: None


@dataclass
class Sitting:
    """State that the trials of one sitting share.

    Parameters
    ----------
    screen
        Window, keys and clock.
    design, participant
        Design, and label of the participant (empty until entered).
    stimuli
        Set of pictures, if the experiment uses one.
    start
        Start of the sitting, in s on the screen's clock.
    session
        Label of the session, if it has one.
    events
        Events since the last trial was recorded: name, time in s from the start of the sitting, and wall-clock time.
    shown
        Condition of the current trial by name, with its "phase" and "trial"; None between trials.
    first
        Index in `events` of the current trial's first event.
    failures
        Errors since then in code supplied by the laboratory: where, and the error.
    lead, after
        Pages directly before and after the current trial, and the standard if it is due.
    recorded
        Trials recorded so far with their answers, including those of earlier sittings.
    recorder
        Gaze recorder, if the design records gaze.
    taken
        Gaze of the last trial.
    noted
        Values noted with the current trial's answer, by name.
    unchanged
        SHA-256 of the pixels of pictures of the set, as loaded.
    """

    screen: Screen
    design: Any
    participant: str
    stimuli: StimulusSet | None = None
    start: float = 0.0
    session: str | None = None
    events: list[tuple[str, float, float]] = field(default_factory=list)
    shown: Mapping[str, Any] | None = None
    first: int = 0
    failures: list[tuple[str, str]] = field(default_factory=list)
    lead: Sequence[Page | Standard] = ()
    after: Sequence[Page] = ()
    recorded: Sequence[Mapping[str, Any]] = ()
    recorder: Recorder | None = None
    taken: Taken | None = None
    noted: dict[str, Noted] = field(default_factory=dict)
    unchanged: set[str] = field(default_factory=set)

    @property
    def words(self) -> Words:
        """Texts shown on the screen."""
        return self.screen.words

    def begin(self, trial: Any) -> None:
        """Begin a trial: label the events that follow with its condition."""
        self.screen.practice, self.taken = trial.phase == "practice", None
        condition = asdict(trial)
        self.shown, self.first = condition | dict(condition.pop("factors", {})), len(self.events)

    def noise_seed(self, trial: Any) -> int:
        """Return the seed of a trial's noise, which no other trial has."""
        return int(self.design.noise_seed(self.participant, trial, self.session))

    def event(self, name: str) -> None:
        """Send a custom event marker now; its code is looked up in the file given with ``--codes``."""
        self.screen.on_event(name, self.screen.now())

    @contextmanager
    def gaze(self) -> Iterator[None]:
        """Record gaze, if there is a source of it: in a trial of your own, while its pictures are shown."""
        if self.recorder is None:
            yield
            return
        self.recorder.begin()
        try:
            yield
        finally:
            self.taken = self.recorder.end()

    def note(self, name: str, value: Any, *, unit: str | None = None, description: str = "") -> None:
        """Record a value with the answer of this trial, as a column of the table that its sidecar describes.

        Parameters
        ----------
        name
            Column name: letters, digits and _, starting with a letter.
        value
            A number, a text or a boolean; or the result of `ask`, whose value and `start` are recorded.
        unit
            Unit in BIDS notation, such as "s".
        description
            Meaning of the column.

        Raises
        ------
        InputError
            If the value is of another type. A name that is already a column is rejected when the answer is recorded.
        """
        if isinstance(value, Given):
            self.noted |= noted_start(value.start, name)
            value = value.value
        self.noted[name] = Noted(value, unit, description)

    def since_start(self, time: float) -> float:
        """Convert a time on the screen's clock to s from the start of the sitting."""
        return time - self.start

    def picture(
        self, scene: str, aperture: str, fixation: str, levels: Mapping[str, str] | None = None
    ) -> tuple[Picture, Any]:
        """Return a picture of the set, at the given levels of the design's factors, and its drawable image."""
        assert self.stimuli is not None
        found = self.stimuli.picture(scene, aperture, fixation, levels)
        return found, self.screen.picture(self.pixels(found))

    def pixels(self, picture: Picture) -> NDArray[np.uint8]:
        """Return the 8-bit pixel values of a picture, H x W x 3."""
        assert self.stimuli is not None
        pixels = self.stimuli.pixels(picture)
        self.unchanged.add(hashlib.sha256(np.ascontiguousarray(pixels).tobytes()).hexdigest())
        return pixels

    def mark(self, picture: Picture) -> Any:
        """Return the fixation mark at a picture's fixated object."""
        assert self.stimuli is not None
        height, width = self.pixels(picture).shape[:2]
        x, y = self.stimuli.scene(picture.scene).target(picture.fixation).position_px
        return self.screen.fixation(x - width / 2, height / 2 - y)
