"""What an experiment is made of: its own part (`Experiment`), and what each of its trials has at hand (`Sitting`)."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.dataset import Answer, Noted
from focalgradient.dataset.markers import MARKERS
from focalgradient.display import Display
from focalgradient.stimuli import Picture, StimulusSet

if TYPE_CHECKING:
    from focalgradient.design.words import Words
    from focalgradient.lab.gaze import Recorder, Taken
    from focalgradient.lab.screen import Screen

__all__ = ["EVENTS", "GREY", "Again", "Experiment", "Quit", "Sitting"]


class Quit(Exception):  # noqa: N818  not an error
    """The participant, or who runs the experiment, wants to stop."""


class Again(Exception):  # noqa: N818  not an error
    """What was being shown has been interrupted, and is to be shown again from its start."""


GREY = -0.004  # of the screen, as 127 of 255: PsychoPy counts from -1 to 1

EVENTS = {name: marker.code for name, marker in MARKERS.items()}
"""Markers: the code of each event, for eye trackers and EEG."""


@dataclass(frozen=True, slots=True)
class Experiment:
    """What is particular to one experiment.

    Parameters
    ----------
    task
        Of its design.
    about
        What it does, for the help of the command line.
    trial
        Runs one and gives its answer; it is called again for one that was interrupted.
    pictures
        The pictures that a design needs: scene, aperture, fixation, levels of its factors.
    check
        Raises InputError where a design cannot be shown on a display, in a window of so many pixels.
    check_pictures
        Raises InputError where a design cannot be shown with a set of pictures.
    background
        Of the screen, from -1, black, to 1, white.
    instructions
        Pages to read instead of the task's own, the first line of each its title.
    before
        Is done at the start of a sitting, after the instructions.
    standard
        Shows the standard, after its page.
    right
        Whether an answer in practice is right, of a trial and its answer; None where none can be.
    """

    task: str
    about: str
    trial: Callable[[Sitting, Any], Answer]
    pictures: Callable[[Any], Sequence[tuple[str, str, str, Mapping[str, str]]]] = lambda design: ()
    check: Callable[[Any, Display, tuple[int, int]], None] = lambda design, display, room: None
    check_pictures: Callable[[Any, Display, StimulusSet | None], None] = lambda design, display, stimuli: None
    background: float = -1.0
    instructions: Callable[[Sitting], Sequence[str]] | None = None
    before: Callable[[Sitting], None] = lambda sitting: None
    standard: Callable[[Sitting], None] = lambda sitting: None
    right: Callable[[Sitting, Any, Any], bool | None] = lambda sitting, trial, answer: None


@dataclass
class Sitting:
    """What a trial has at hand.

    Parameters
    ----------
    screen
        Window, keys and clock.
    design, participant
        What is run, and for whom (empty until it has been asked).
    stimuli
        The set of pictures, where there is one.
    start
        When the sitting began, on the screen's clock.
    next
        The trial that comes next.
    events
        Of what has happened since the last trial was recorded: its name, its time on the sitting's clock, and the wall
        clock's time then.
    shown
        The condition of the trial that is shown, by name, with its "phase" and "trial"; None outside trials.
    first
        Number of the event in `events` with which that trial began.
    failures
        What has gone wrong in a laboratory's own code since then: what, and the error.
    levels
        Of the factors in blocks, those of the block that is shown.
    recorded
        The trials recorded so far with their answers, those of earlier sittings included.
    procedure
        Of an adaptive experiment, what chooses the level of the next trial.
    recorder
        Of the gaze, where the design wants it.
    taken
        The gaze of the last trial.
    noted
        Values noted beside the answer of this trial, by name.
    unchanged
        SHA-256 of the pixels of pictures of the set, as they were loaded.
    """

    screen: Screen
    design: Any
    participant: str
    stimuli: StimulusSet | None = None
    start: float = 0.0
    next: Any = None
    events: list[tuple[str, float, float]] = field(default_factory=list)
    shown: Mapping[str, Any] | None = None
    first: int = 0
    failures: list[tuple[str, str]] = field(default_factory=list)
    levels: dict[str, str] = field(default_factory=dict)
    recorded: Sequence[Mapping[str, Any]] = ()
    procedure: Any = None
    recorder: Recorder | None = None
    taken: Taken | None = None
    noted: dict[str, Noted] = field(default_factory=dict)
    unchanged: set[str] = field(default_factory=set)

    @property
    def words(self) -> Words:
        """What is said on the screen."""
        return self.screen.words

    def begin(self, trial: Any) -> None:
        """Begin a trial: events from now on are marked with its condition."""
        condition = asdict(trial)
        self.shown, self.first = condition | dict(condition.pop("factors", {})), len(self.events)

    def event(self, name: str) -> None:
        """Send a marker of one's own now; its name has a code in the file that ``--codes`` gives."""
        self.screen.on_event(name, self.screen.now())

    def note(self, name: str, value: Any, *, unit: str | None = None, description: str = "") -> None:
        """Note a value beside the answer of this trial: it becomes a column of the table, described in its sidecar.

        Parameters
        ----------
        name
            Of the column: letters, digits and _, a letter first.
        value
            A number, a text, true or false; or what `ask` gave, of which the value is noted.
        unit
            As BIDS writes it, like "s".
        description
            Meaning of the column.

        Raises
        ------
        InputError
            If the value is of another kind. A name that the table has already is refused when the answer is recorded.
        """
        from focalgradient.lab.questions import Given

        self.noted[name] = Noted(value.value if isinstance(value, Given) else value, unit, description)

    def since_start(self, time: float) -> float:
        """A time of the screen's clock, on that of the sitting."""
        return time - self.start

    def picture(
        self, scene: str, aperture: str, fixation: str, levels: Mapping[str, str] | None = None
    ) -> tuple[Picture, Any]:
        """A picture of the set, with the levels of the design's factors, and what draws it."""
        assert self.stimuli is not None
        found = self.stimuli.picture(scene, aperture, fixation, levels)
        return found, self.screen.picture(self.pixels(found))

    def pixels(self, picture: Picture) -> NDArray[np.uint8]:
        """The 8-bit values of a picture, H x W x 3."""
        assert self.stimuli is not None
        pixels = self.stimuli.pixels(picture)
        self.unchanged.add(hashlib.sha256(np.ascontiguousarray(pixels).tobytes()).hexdigest())
        return pixels

    def fixated(self, picture: Picture) -> tuple[float, float]:
        """Where the object is that is fixated in a picture, in its pixels from the upper left corner."""
        assert self.stimuli is not None
        return self.stimuli.scene(picture.scene).target(picture.fixation).position_px

    def place(self, picture: Picture) -> tuple[float, float]:
        """Where the fixated object of a picture is on the screen: pixels from the middle, x right and y up."""
        height, width = self.pixels(picture).shape[:2]
        x, y = self.fixated(picture)
        return x - width / 2, height / 2 - y

    def mark(self, picture: Picture) -> Any:
        """The mark on the object that is fixated in a picture."""
        return self.screen.fixation(*self.place(picture))
