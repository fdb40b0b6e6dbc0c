"""What the experiments share: a session from its first screen to its last.

A program gives a `Programme`: its instructions and how a trial is run. Here the participant is asked for, consent is
taken, trials follow each other in their order, each answer is safe on the disk before the next begins, and escape asks
before it quits.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from preparation import WINDOW, Hook, Prepared, check_session, prepare

from focalgradient.dataset import Answer, Apparatus, Session
from focalgradient.design import Trial
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.stimuli import Picture, StimulusSet

if TYPE_CHECKING:
    from screen import Screen

__all__ = ["EVENTS", "GREY", "Programme", "Sitting", "run"]

GREY = -0.004  # of the screen, as 127 of 255: PsychoPy counts from -1 to 1

EVENTS = {
    "sitting": 1,
    "form": 2,
    "consent": 3,
    "instructions": 4,
    "ready": 5,
    "break": 6,
    "standard": 7,
    "mark": 10,
    "picture": 11,
    "cube": 12,
    "look": 13,
    "off": 20,
    "question": 21,
    "confidence": 22,
    "feedback": 23,
    "recorded": 30,
    "quit?": 40,
    "end": 50,
    "thanks": 51,
}
"""Markers: the code of each event, for eye trackers and EEG."""


@dataclass(frozen=True, slots=True)
class Programme:
    """What is particular to one of the programs.

    Parameters
    ----------
    task
        Of its design.
    about
        What the program does, for its help.
    instructions
        Pages to read, the first line of each its title.
    trial
        Runs one and gives its answer; it is called again for one that was interrupted.
    pictures
        The pictures that a design needs: scene, aperture, fixation.
    check
        Raises InputError where a design cannot be shown on a display, in a window of so many pixels.
    background
        Of the screen, from -1, black, to 1, white.
    before
        Is shown at the start of a sitting, after the instructions.
    """

    task: str
    about: str
    instructions: Callable[[Sitting], Sequence[str]]
    trial: Callable[[Sitting, Any], Answer]
    pictures: Callable[[Any], Sequence[tuple[str, str, str]]] = lambda design: ()
    check: Callable[[Any, Display, tuple[int, int]], None] = lambda design, display, room: None
    background: float = -1.0
    before: Callable[[Sitting], None] = lambda sitting: None


@dataclass
class Sitting:
    """What a trial has at hand.

    Parameters
    ----------
    screen
        Window, keys and clock.
    design, participant
        What is run, and for whom.
    stimuli
        The set of pictures, where there is one.
    start
        When the sitting began, on the screen's clock.
    events
        Name and time, on the sitting's clock, of what has happened since the last trial was recorded.
    """

    screen: Screen
    design: Any
    participant: str
    stimuli: StimulusSet | None = None
    start: float = 0.0
    events: list[tuple[str, float]] = field(default_factory=list)

    def since_start(self, time: float) -> float:
        """A time of the screen's clock, on that of the sitting."""
        return time - self.start

    def picture(self, scene: str, aperture: str, fixation: str) -> tuple[Picture, Any]:
        """A picture of the set, and what draws it."""
        assert self.stimuli is not None
        found = self.stimuli.picture(scene, aperture, fixation)
        return found, self.screen.picture(self.pixels(found))

    def pixels(self, picture: Picture) -> NDArray[np.uint8]:
        """The 8-bit values of a picture, H x W x 3."""
        assert self.stimuli is not None
        return self.stimuli.pixels(picture)

    def fixated(self, picture: Picture) -> tuple[float, float]:
        """Where the object is that is fixated in a picture, in its pixels from the upper left corner."""
        assert self.stimuli is not None
        return self.stimuli.scene(picture.scene).target(picture.fixation).position_px

    def mark(self, picture: Picture) -> Any:
        """The mark on the object that is fixated in a picture."""
        height, width = self.pixels(picture).shape[:2]
        x, y = self.fixated(picture)
        return self.screen.fixation(x - width / 2, height / 2 - y)


def run(programme: Programme, given: Sequence[str] | None = None) -> int:
    """Run a program: 0 when it came to its end, 1 when it was stopped before, 2 with a sentence where it cannot run."""
    try:
        ready = prepare(programme, given)
        for warning in ready.warnings:
            print(f"Warning: {warning}", file=sys.stderr, flush=True)
        options = ready.options
        window = ready.screen.Screen(
            options.screen,
            WINDOW if options.windowed else None,
            ready.display,
            background=programme.background,
            patch=options.photodiode,
        )
        try:
            sitting = Sitting(window, ready.design, options.participant, ready.stimuli, window.now())
            window.tell = _teller(sitting, ready.hook)
            _run(programme, ready, sitting)
        except ready.screen.Quit:
            return 1
        finally:
            window.close()
    except InputError as error:
        print(f"Error: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    return 0


def _teller(sitting: Sitting, hook: Hook | None) -> Callable[[str, float], None]:
    """What is done at each event: it is kept for the journal, and told to the hook and to a running ioHub."""

    def tell(name: str, time: float) -> None:
        seconds = sitting.since_start(time)
        sitting.events.append((name, seconds))
        if hook is not None:
            hook(EVENTS[name], name, seconds)
        # PsychoPy's ioHub runs where the lab's own file of markers has launched it.
        client = sys.modules.get("psychopy.iohub.client")
        hub = client and client.ioHubConnection.getActiveConnection()
        if hub:
            hub.sendMessageEvent(text=name, category="focalgradient")

    return tell


def _run(programme: Programme, ready: Prepared, sitting: Sitting) -> None:
    from questions import pages
    from screen import Quit

    window, options = sitting.screen, ready.options
    about = {"age": options.age, "sex": options.sex, "handedness": options.handedness}
    if sitting.participant is None:
        about |= _step(lambda: _who(sitting, options))
    if ready.consent is not None:
        _step(lambda: _agree(window, ready.consent))
    start = Session.resume if options.resume else Session.begin
    with start(
        options.data,
        sitting.design.task if options.resume else sitting.design,
        sitting.participant,
        options.session,
        apparatus=_apparatus(window, ready.display, ready.calibrated),
        stimuli=options.stimuli,
        **({} if options.resume else {"about": about}),
    ) as session:
        window.tell("sitting", window.now())
        session.note("sitting", pilot=options.pilot, consent=ready.consent is not None, warnings=ready.warnings)
        try:
            _step(lambda: pages(window, programme.instructions(sitting), "instructions"))
            _step(lambda: programme.before(sitting))
            practised = False
            for trial in session.remaining():
                if practised and trial.phase == "main":
                    _step(lambda: pages(window, ["Practice is over\n\nFrom here on, it counts."], "break"))
                practised = trial.phase == "practice"
                if trial.break_before:
                    text = f"Time for a break\n\n{_done(trial, session)}\n\nRest your eyes."
                    _step(lambda text=text: pages(window, [text], "break"))
                answer = _step(lambda trial=trial: _one(programme, sitting, trial))
                session.note("events", phase=trial.phase, trial=trial.trial, events=sitting.events)
                session.record(trial, answer)
                sitting.events = []
                window.tell("recorded", window.now())
        except Quit:
            print(f"Stopped; {len(session.remaining())} trials are left: go on with --resume.", file=sys.stderr)
            raise
    window.tell("end", window.now())
    _step(lambda: pages(window, ["That is all\n\nThank you for taking part."], "thanks", foot="Press SPACE to end."))


def _step(shown: Callable[[], Any]) -> Any:
    """Do something; where escape came between and was taken back, do it again from its start."""
    from screen import Again

    while True:
        try:
            return shown()
        except Again:
            continue


def _one(programme: Programme, sitting: Sitting, trial: Trial) -> Answer:
    sitting.screen.dropped = 0
    answer = programme.trial(sitting, trial)
    return replace(answer, dropped_frames=sitting.screen.dropped)


def _done(trial: Trial, session: Session) -> str:
    total = sum(one.phase == "main" for one in session.trials)
    return f"{trial.trial - 1} of {total} are done."


def _who(sitting: Sitting, options: argparse.Namespace) -> Mapping[str, str]:
    """Ask who takes part, until it is someone who can; give what is to stand in the table of participants."""
    from questions import form

    fields = {
        "Participant": "letters and digits, as 01",
        "Session": "may be empty",
        "Age": "in years; may be empty",
        "Sex": "may be empty",
        "Handedness": "may be empty",
    }

    def check(typed: Mapping[str, str]) -> None:
        asked = argparse.Namespace(**vars(options))
        asked.participant, asked.session = typed["Participant"], typed["Session"] or options.session
        check_session(asked, sitting.design)
        sitting.participant, options.session = asked.participant, asked.session

    typed = form(sitting.screen, "Who takes part?", fields, check)
    return {name.lower(): typed[name] for name in ("Age", "Sex", "Handedness") if typed[name]}


def _agree(window: Screen, text: str) -> None:
    """Let the participant read, page by page, and agree; who does not agree does not take part."""
    from questions import pages
    from screen import Quit

    *first, last = text.split("\f")
    pages(window, first, "consent")
    if pages(window, [last], "consent", keys=("y", "n"), foot="Y: I agree            N: I do not agree") == "n":
        raise Quit


def _apparatus(window: Screen, display: Display, calibrated: bool) -> Apparatus:
    from screen import PACE, versions

    clock = "seconds from when the window opened, of the clock that times frames and keys"
    if window.refresh_hz is None:
        clock += f"; the display does not tell its frames, which are paced at {PACE:g} Hz"
    width, height = (side * display.pixel_pitch for side in display.size_px)
    return Apparatus(
        clock=clock,
        screen_px=display.size_px,
        screen_m=(width, height) if calibrated else None,
        viewing_distance_m=display.distance if calibrated else None,
        refresh_hz=window.refresh_hz,
        gamma=None if display.gamma == "sRGB" else display.gamma,
        versions=versions(),
    )
