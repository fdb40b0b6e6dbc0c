"""A session from its first screen to its last, whatever the experiment.

Consent is taken, the participant is asked for, and the steps of `design.sequence` follow each other; each answer is on
the disk before the next trial begins, and escape asks before it quits.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import asdict, replace
from functools import partial
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from focalgradient.dataset import Answer, Apparatus, Noted, Session, answer_event
from focalgradient.design import Trial
from focalgradient.design.pages import pages_of
from focalgradient.design.sequence import Page, Repeat, Standard, Step, Turn, sequence
from focalgradient.errors import InputError, one_line
from focalgradient.lab.boxes import keys_of, open_gamepad
from focalgradient.lab.consent import agree
from focalgradient.lab.experiment import Again, Experiment, Quit, Sitting
from focalgradient.lab.forms import pages, rest
from focalgradient.lab.gaze import Recorder, open_gaze
from focalgradient.lab.participant import ask_participant
from focalgradient.lab.preparation import WINDOW, Prepared, prepare
from focalgradient.lab.questions import ask, explain
from focalgradient.lab.stereoscope import align
from focalgradient.lab.triggers import Triggers
from focalgradient.tasks import task_named
from focalgradient.tasks.noted import AGAIN, AGAIN_ABOUT, SHOWN, SHOWN_ABOUT

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["PART", "parted", "run"]

Shown = TypeVar("Shown")

PART = 0.05
"""Seconds by which the wall clock and the monotonic one may part during a trial, beside one in a thousand: three frames
at 60 Hz. A wall clock that is kept right by slewing it (at most 500 in a million on Linux) stays within."""

VOID = 5
"""Times that one trial is shown again because the clocks parted, before the session ends."""


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
        with closing(ready.triggers):
            return _in_window(experiment, ready)
    except InputError as error:
        print(f"Error: {one_line(error)}", file=sys.stderr)
        return 2


def _in_window(experiment: Experiment, ready: Prepared) -> int:
    """Open the window, and run the experiment in it: its exit code."""
    options = ready.options
    window = ready.screen.Screen(
        options.screen,
        WINDOW if options.windowed else None,
        ready.display,
        background=experiment.background,
        patch=options.photodiode,
        words=ready.words,
        stereoscope=ready.stereoscope,
    )
    sitting = Sitting(window, ready.design, options.participant or "", ready.stimuli, window.now())
    window.keys.boxes += ready.boxes
    if options.pointer:
        window.point()
    try:
        if "gamepad" in options.box:
            window.keys.boxes.append(open_gamepad(window.window, keys_of(options.box_keys)))
        window.on_event = _listener(sitting, ready.triggers)
        if ready.tracker is not None:
            sitting.recorder = Recorder(window, open_gaze(window, ready.tracker), sitting.start)
        _run(experiment, ready, sitting)
    except Quit:
        return 1
    finally:
        if sitting.recorder is not None:
            sitting.recorder.gaze.close()
        window.close()
    return 0


def guard(what: str, call: Callable[[], object], said: set[str]) -> str | None:
    """Call a laboratory's own code, or what it has started: what went wrong, or None; warned of once."""
    try:
        call()
    except Exception as error:
        if what not in said:
            said.add(what)
            print(f"Warning: {what} failed ({error!r}); the session goes on.", file=sys.stderr, flush=True)
        return repr(error)[:200]
    return None


def _listener(sitting: Sitting, triggers: Triggers) -> Callable[[str, float], None]:
    """What is done at each event: it is kept for the journal, and sent to all ports and to a running ioHub.

    What goes wrong in a laboratory's own code is kept too, and said once; the session goes on.
    """
    said: set[str] = set()

    def guarded(what: str, call: Callable[[], object]) -> None:
        if failed := guard(what, call, said):
            sitting.failures.append((what, failed))

    def listen(name: str, at: float) -> None:
        seconds = sitting.since_start(at)
        # The wall clock at that event: now, less what has passed since.
        sitting.events.append((name, seconds, time.time() - (time.monotonic() - at)))
        for port in triggers.ports:
            guarded(port.name, partial(triggers.send, port, name, at, seconds, sitting.shown))
        # PsychoPy's ioHub runs where the lab's own file of markers has launched it.
        client = sys.modules.get("psychopy.iohub.client")
        hub = client and client.ioHubConnection.getActiveConnection()
        if hub:
            guarded("ioHub", lambda: hub.sendMessageEvent(text=name, category="focalgradient"))

    return listen


def _run(experiment: Experiment, ready: Prepared, sitting: Sitting) -> None:
    window, options = sitting.screen, ready.options
    consent = ready.consent
    agreed = None if consent is None else consent.stated(_uninterrupted(lambda: agree(window, consent)))
    about = _uninterrupted(lambda: ask_participant(sitting, options))
    if window.eyes is not None:
        _uninterrupted(lambda: align(window, options.stereoscope))
    with _opened(ready, sitting, about) as session:
        window.on_event("sitting", window.now())
        session.note(
            "sitting",
            pilot=options.pilot,
            consent=agreed,
            warnings=ready.warnings,
            words={"language": ready.words.language, "sha256": ready.words.sha256},
        )
        if ready.triggers.ports or sitting.recorder is not None:
            ports = [port.name for port in ready.triggers.ports]
            session.note("triggers", ports=ports, **ready.triggers.codes.entry())
        sitting.next = next(iter(session.remaining()), None)
        texts = pages_of(ready.design, ready.words, sitting.participant)
        done = len(session.trials) - len(session.remaining())
        steps = sequence(ready.design, ready.words, texts, session.trials, done)
        walk = _Walk(experiment, sitting, session)
        try:
            for step in steps:
                if not _is_last(step):
                    walk.show(step)
        except Quit:
            _note_events(sitting, session)
            print(f"Stopped; {len(session.remaining())} trials are left: go on with --resume.", file=sys.stderr)
            _may_keep(window, session, sitting)
            raise
    window.on_event("end", window.now())
    for step in filter(_is_last, steps):  # the data are safe by now
        walk.show(step)


def _is_last(step: Step) -> bool:
    """Whether a step comes after the last answer."""
    return isinstance(step, Page) and step.event in ("debriefing", "thanks")


def _calibrate(sitting: Sitting, session: Session) -> None:
    """Let the eye tracker find the eyes, and note what the gaze is recorded with."""
    if sitting.recorder is None:
        return
    gaze = sitting.recorder.gaze
    gaze.calibrate()
    session.note(
        "eye tracker",
        name=gaze.name,
        software=f"psychopy {version('psychopy')}",
        pixels_per_degree=sitting.screen.display.pixels_per_degree,
        window_px=sitting.screen.size,
        **gaze.about(),
    )


def _happened(sitting: Sitting) -> dict[str, Any]:
    """Events since the last trial was recorded, with the condition of the trial that began with the `first` of them."""
    shown = sitting.shown or {"phase": None, "trial": None}
    about = {"phase": shown["phase"], "trial": shown["trial"], "condition": shown}
    return about | {"events": sitting.events, "first": sitting.first}


def _note_events(sitting: Sitting, session: Session) -> None:
    """Write down what happened in a trial and before it, and what has gone wrong in a laboratory's own code."""
    session.note("events", **_happened(sitting), failures=sitting.failures)
    sitting.events, sitting.failures = [], []


def _note_gaze(sitting: Sitting, session: Session, trial: Trial) -> None:
    """Write down the gaze of a trial, before its answer."""
    if sitting.taken is not None:
        session.note("gaze", phase=trial.phase, trial=trial.trial, samples=[list(one) for one in sitting.taken.samples])


def _may_keep(window: Screen, session: Session, sitting: Sitting) -> None:
    """Ask who stops whether the answers may be kept, and note it; the answers are removed by who runs the study."""
    words = window.words
    foot = words("session.keep_keys", yes=words.yes.upper(), no=words.no.upper())
    with suppress(Quit):  # escape once more: nothing was answered
        key = _uninterrupted(
            lambda: pages(window, [words("session.keep")], "keep?", keys=(words.yes, words.no), foot=foot)
        )
        session.note("keep", kept=key == words.yes)
        if key == words.no:
            print(
                f"The participant wants the answers removed: focalgradient withdraw {session.files.root} "
                f"sub-{sitting.participant}",
                file=sys.stderr,
            )


def _opened(ready: Prepared, sitting: Sitting, about: Mapping[str, Any]) -> Session:
    """The session to record in: begun, or resumed as the options ask."""
    options = ready.options
    apparatus = _apparatus(ready, sitting.screen)
    whose = (sitting.participant, options.session)
    if options.resume:
        return Session.resume(options.data, ready.design.task, *whose, apparatus=apparatus, stimuli=options.stimuli)
    return Session.begin(options.data, ready.design, *whose, apparatus=apparatus, stimuli=options.stimuli, about=about)


class _Walk:
    """The steps of a sitting, shown one after the other; each answer is recorded before the next trial begins."""

    def __init__(self, experiment: Experiment, sitting: Sitting, session: Session):
        self._experiment, self._sitting, self._session = experiment, sitting, session
        self._began, self._counted = sitting.screen.now(), 0
        self._practised: list[tuple[Trial, Answer]] = []
        self._prepared = False

    def show(self, step: Step) -> None:
        """Show a step, again from its start where escape came between and was taken back."""
        instructions = isinstance(step, Page) and step.event == "instructions"
        if not (self._prepared or instructions):
            self._prepare()
        if isinstance(step, Turn):
            self._turn(step.trial)
        elif isinstance(step, Repeat):
            self._repeat(step)
        elif isinstance(step, Standard):
            _uninterrupted(lambda: self._experiment.standard(self._sitting))
        elif not (instructions and self._experiment.instructions is not None):
            _uninterrupted(partial(self._page, step))

    def _prepare(self) -> None:
        """Do what comes between the instructions and all else."""
        sitting, own = self._sitting, self._experiment.instructions
        self._prepared = True
        if own is not None:
            _uninterrupted(lambda: pages(sitting.screen, own(sitting), "instructions"))
        _calibrate(sitting, self._session)
        _uninterrupted(lambda: self._experiment.before(sitting))

    def _page(self, page: Page) -> None:
        screen, words = self._sitting.screen, self._sitting.words
        if page.at is not None:
            explain(screen, self._sitting.design.response_scale.control(words), page.text, page.at)
        elif page.event == "break":
            rest(screen, page.text.replace("{minutes}", str(self._minutes())), page.least_s)
            if self._practised:
                self._practised, self._began = [], screen.now()
        else:
            foot = words("session.thanks_keys") if page.event == "thanks" else ""
            pages(screen, [page.text], page.event, foot=foot)

    def _minutes(self) -> int:
        """Minutes that the trials left will take at the pace so far; ten seconds each where there is none yet."""
        sitting = self._sitting
        left = sum(one.phase == "main" for one in self._session.remaining())
        each = (sitting.screen.now() - self._began) / self._counted if self._counted else 10.0
        return max(1, round(left * each / 60))

    def _turn(self, trial: Trial) -> None:
        sitting, session = self._sitting, self._session
        sitting.next, sitting.recorded = trial, session.recorded
        answer = _timed(self._experiment, sitting, session, trial)
        _note_events(sitting, session)
        _note_gaze(sitting, session, trial)
        session.record(trial, answer)
        sitting.noted = {}
        if trial.phase == "practice":
            self._practised.append((trial, answer))
        else:
            self._counted += 1
        sitting.screen.on_event("recorded", sitting.screen.now())
        sitting.shown = None

    def _repeat(self, repeat: Repeat) -> None:
        """Repeat practice until it meets the design's criterion; what was answered in it stays in the journal."""
        experiment, sitting, session = self._experiment, self._sitting, self._session
        design, practised = sitting.design, self._practised
        for number in range(1, design.practice_rounds + 1):
            right = [experiment.right(sitting, trial, answer) for trial, answer in practised]
            known = [one for one in right if one is not None]
            passed = not known or sum(known) >= design.practice_right * len(known)
            session.note("practice", round=number, right=sum(known), of=len(known), passed=passed)
            if passed or number == design.practice_rounds:
                return
            _uninterrupted(partial(self._page, repeat.again))
            repeated = []
            for turn in repeat.turns:
                answer = _timed(experiment, sitting, session, turn.trial)
                session.note("practice again", round=number + 1, trial=asdict(turn.trial), answer=answer_event(answer))
                _note_events(sitting, session)
                sitting.shown = None
                sitting.noted = {}
                repeated.append((turn.trial, answer))
            practised = repeated


def _uninterrupted(shown: Callable[[], Shown]) -> Shown:
    """Do something; where escape came between and was taken back, do it again from its start."""
    return _counted(shown)[0]


def _counted(shown: Callable[[], Shown]) -> tuple[Shown, int]:
    """Do something until escape does not come between: what it gave, and how many times it was begun in vain."""
    interrupted = 0
    while True:
        try:
            return shown(), interrupted
        except Again:
            interrupted += 1


def _timed(experiment: Experiment, sitting: Sitting, session: Session, trial: Trial) -> Answer:
    """Run a trial; again where the wall clock and the monotonic one parted meanwhile."""
    sitting.begin(trial)
    noted = dict(sitting.noted)  # before the trial
    interrupted = 0
    for number in range(VOID):
        before = time.monotonic(), time.time()
        answer, more = _counted(partial(_one, experiment, sitting, trial, noted))
        by = parted(before, (time.monotonic(), time.time()))
        interrupted += more
        if not by:
            if not (begun_again := interrupted + number):
                return answer
            return replace(answer, extra={**answer.extra, AGAIN: Noted(begun_again, description=AGAIN_ABOUT)})
        session.note("void", clocks_parted_s=by, **_happened(sitting))
        sitting.events, sitting.first = [], 0
    raise InputError(
        f"the computer's clock was set {VOID} times in a row during trial {trial.trial}: stop what sets it, and go on "
        "with --resume."
    )


def parted(before: tuple[float, float], after: tuple[float, float]) -> float:
    """By how many seconds the wall clock has gained on the monotonic one between two readings of both; 0 where by few.

    >>> parted((100.0, 5000.0), (110.0, 5010.001)), parted((100.0, 5000.0), (110.0, 1410.0))
    (0.0, -3600.0)
    """
    lasted = after[0] - before[0]
    by = (after[1] - before[1]) - lasted
    return by if abs(by) > PART + lasted / 1000 else 0.0


def _one(experiment: Experiment, sitting: Sitting, trial: Trial, noted: Mapping[str, Noted]) -> Answer:
    """Run a trial from its start, with what was noted before it, and ask the further questions of the design."""
    sitting.screen.dropped, sitting.noted = 0, dict(noted)
    sitting.screen.drawn.clear()
    answer = experiment.trial(sitting, trial)
    shown = [*sitting.screen.drawn]
    if not sitting.unchanged.issuperset(shown):  # of pictures of the set the column stimulus says it all
        sitting.noted[SHOWN] = Noted(" ".join(shown), description=SHOWN_ABOUT)
    task = task_named(experiment.task)
    for name, (control, about) in task.further(sitting.design, sitting.words, trial).items():
        sitting.noted[name] = replace(about, value=ask(sitting.screen, control).value)
    return replace(answer, dropped_frames=sitting.screen.dropped, extra={**sitting.noted, **answer.extra})


def _apparatus(ready: Prepared, window: Screen) -> Apparatus:
    display = ready.display
    clock = "seconds from when the window opened, of a monotonic clock, which nobody can set"
    if window.refresh_hz is None:
        clock += f"; the display does not report its frames, which are paced at {ready.screen.PACE:g} Hz"
    monitor = ready.options.monitor
    measured = None if monitor is None else ready.screen.calibration_of(monitor)
    width, height = (side * display.pixel_pitch for side in display.size_px)
    return Apparatus(
        clock=clock,
        screen_px=display.size_px,
        screen_m=(width, height) if ready.calibrated else None,
        viewing_distance_m=display.distance if ready.calibrated else None,
        refresh_hz=window.refresh_hz,
        gamma=None if display.gamma == "sRGB" else float(np.mean(display.gamma)),
        gamma_channels=None if measured is None else measured.channels,
        white_cd_m2=None if measured is None else measured.white,
        versions=ready.screen.versions(),
        stereoscope=None if window.eyes is None else window.eyes.setup.stated(window.eyes.displays),
    )
