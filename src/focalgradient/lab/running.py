"""A session from its first screen to its last, whatever the experiment.

The participant is asked for, consent is taken, trials follow each other in their order, each answer is safe on the disk
before the next begins, and escape asks before it quits.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from focalgradient.dataset import Answer, Apparatus, Session
from focalgradient.design import Trial
from focalgradient.errors import InputError
from focalgradient.lab.experiment import EVENTS, Again, Experiment, Quit, Sitting
from focalgradient.lab.preparation import WINDOW, Hook, Prepared, check_session, prepare
from focalgradient.lab.questions import form, pages

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["run"]

Shown = TypeVar("Shown")


def run(experiment: Experiment, given: Sequence[str] | None = None, *, program: str | None = None) -> int:
    """Run an experiment with one participant.

    Parameters
    ----------
    experiment
        What to run.
    given
        Options, as on the command line; None: those of this process. ``--help`` lists them.
    program
        How the help calls the program; None: by its file.

    Returns
    -------
    int
        Exit code: 0 when it came to its end, 1 when it was stopped before, 2 where it cannot run, which one sentence on
        standard error then says.
    """
    try:
        ready = prepare(experiment, given, program)
        for warning in ready.warnings:
            print(f"Warning: {warning}", file=sys.stderr, flush=True)
        options = ready.options
        window = ready.screen.Screen(
            options.screen,
            WINDOW if options.windowed else None,
            ready.display,
            background=experiment.background,
            patch=options.photodiode,
        )
        try:
            sitting = Sitting(window, ready.design, options.participant or "", ready.stimuli, window.now())
            window.on_event = _listener(sitting, ready.hook)
            _run(experiment, ready, sitting)
        except Quit:
            return 1
        finally:
            window.close()
    except InputError as error:
        print(f"Error: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    return 0


def _listener(sitting: Sitting, hook: Hook | None) -> Callable[[str, float], None]:
    """What is done at each event: it is kept for the journal, and sent to the hook and to a running ioHub."""

    def listen(name: str, time: float) -> None:
        seconds = sitting.since_start(time)
        sitting.events.append((name, seconds))
        if hook is not None:
            hook(EVENTS[name], name, seconds)
        # PsychoPy's ioHub runs where the lab's own file of markers has launched it.
        client = sys.modules.get("psychopy.iohub.client")
        hub = client and client.ioHubConnection.getActiveConnection()
        if hub:
            hub.sendMessageEvent(text=name, category="focalgradient")

    return listen


def _run(experiment: Experiment, ready: Prepared, sitting: Sitting) -> None:
    window, options = sitting.screen, ready.options
    about = {"age": options.age, "sex": options.sex, "handedness": options.handedness}
    if not sitting.participant:
        about |= _uninterrupted(lambda: _who(sitting, options))
    if ready.consent is not None:
        consent = ready.consent
        _uninterrupted(lambda: _agree(window, consent))
    with _opened(ready, sitting, about) as session:
        window.on_event("sitting", window.now())
        session.note("sitting", pilot=options.pilot, consent=ready.consent is not None, warnings=ready.warnings)
        try:
            _uninterrupted(lambda: pages(window, experiment.instructions(sitting), "instructions"))
            _uninterrupted(lambda: experiment.before(sitting))
            _trials(experiment, sitting, session)
        except Quit:
            print(f"Stopped; {len(session.remaining())} trials are left: go on with --resume.", file=sys.stderr)
            raise
    window.on_event("end", window.now())
    thanks = ["That is all\n\nThank you for taking part."]
    _uninterrupted(lambda: pages(window, thanks, "thanks", foot="Press SPACE to end."))


def _opened(ready: Prepared, sitting: Sitting, about: Mapping[str, Any]) -> Session:
    """The session to record in: begun, or resumed as the options ask."""
    options = ready.options
    apparatus = _apparatus(ready, sitting.screen)
    whose = (sitting.participant, options.session)
    if options.resume:
        return Session.resume(options.data, ready.design.task, *whose, apparatus=apparatus, stimuli=options.stimuli)
    return Session.begin(options.data, ready.design, *whose, apparatus=apparatus, stimuli=options.stimuli, about=about)


def _trials(experiment: Experiment, sitting: Sitting, session: Session) -> None:
    """Run what is left of the list, each answer recorded before the next trial begins."""
    window, practised = sitting.screen, False
    for trial in session.remaining():
        if practised and trial.phase == "main":
            _uninterrupted(lambda: pages(window, ["Practice is over\n\nFrom here on, it counts."], "break"))
        practised = trial.phase == "practice"
        if trial.break_before:
            text = f"Time for a break\n\n{_done(trial, session)}\n\nRest your eyes."
            _uninterrupted(partial(pages, window, [text], "break"))
        answer = _uninterrupted(partial(_one, experiment, sitting, trial))
        session.note("events", phase=trial.phase, trial=trial.trial, events=sitting.events)
        session.record(trial, answer)
        sitting.events = []
        window.on_event("recorded", window.now())


def _uninterrupted(shown: Callable[[], Shown]) -> Shown:
    """Do something; where escape came between and was taken back, do it again from its start."""
    while True:
        try:
            return shown()
        except Again:
            continue


def _one(experiment: Experiment, sitting: Sitting, trial: Trial) -> Answer:
    sitting.screen.dropped = 0
    answer = experiment.trial(sitting, trial)
    return replace(answer, dropped_frames=sitting.screen.dropped)


def _done(trial: Trial, session: Session) -> str:
    total = sum(one.phase == "main" for one in session.trials)
    return f"{trial.trial - 1} of {total} are done."


def _who(sitting: Sitting, options: argparse.Namespace) -> Mapping[str, str]:
    """Ask who takes part, until it is someone who can; give what is to stand in the table of participants."""
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
    *first, last = text.split("\f")
    pages(window, first, "consent")
    if pages(window, [last], "consent", keys=("y", "n"), foot="Y: I agree            N: I do not agree") == "n":
        raise Quit


def _apparatus(ready: Prepared, window: Screen) -> Apparatus:
    display = ready.display
    clock = "seconds from when the window opened, of the clock that times frames and keys"
    if window.refresh_hz is None:
        clock += f"; the display does not tell its frames, which are paced at {ready.screen.PACE:g} Hz"
    width, height = (side * display.pixel_pitch for side in display.size_px)
    return Apparatus(
        clock=clock,
        screen_px=display.size_px,
        screen_m=(width, height) if ready.calibrated else None,
        viewing_distance_m=display.distance if ready.calibrated else None,
        refresh_hz=window.refresh_hz,
        gamma=None if display.gamma == "sRGB" else display.gamma,
        versions=ready.screen.versions(),
    )
