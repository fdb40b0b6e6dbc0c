"""Session of any experiment, from the first screen to the last.

Consent is obtained, the participant's data are asked for, and the steps of `design.sequence` follow; each answer is on
disk before the next trial begins, and Escape asks for confirmation before it quits.
"""

from __future__ import annotations

import shlex
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import asdict, replace
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from focalgradient.dataset import Answer, Apparatus, Noted, Session, answer_event
from focalgradient.design import Trial
from focalgradient.design.pages import pages_of
from focalgradient.design.sequence import Page, Repeat, Standard, Step, Turn, sequence
from focalgradient.errors import InputError, one_line
from focalgradient.lab.devices.boxes import keys_of, open_gamepad
from focalgradient.lab.devices.stereoscope import align
from focalgradient.lab.devices.triggers import Triggers
from focalgradient.lab.experiment import Again, Experiment, Quit, Sitting, Unpractised
from focalgradient.lab.forms import missing_glyphs, pages, rest
from focalgradient.lab.gaze import WITHIN_DEG, Recorder, gaze_entry, open_gaze
from focalgradient.lab.participant import agree, ask_participant
from focalgradient.lab.preparation import WINDOW, Prepared, prepare
from focalgradient.lab.questions import ask, explain
from focalgradient.tasks import task_named
from focalgradient.tasks.noted import SHOWN, SHOWN_ABOUT, with_noted
from focalgradient.tasks.steps import judged_round
from focalgradient.termination import exit_code, terminable

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["PART", "guard", "parted", "run", "uninterrupted"]

Shown = TypeVar("Shown")

PART = 0.05
"""Tolerated drift between wall clock and monotonic clock during a trial, in s, in addition to 0.1 % of its duration:
three frames at 60 Hz. Corrections by slewing (at most 500 ppm on Linux) stay within it.
"""

NOTHING = "no session had begun."
"""Message after Ctrl-C before the first answer can have been saved."""

MOST_REPEATS = 5
"""Number of times that a trial invalidated by clock drift is repeated before the session ends."""


def run(experiment: Experiment, given: Sequence[str] | None = None, *, program: str | None = None) -> int:
    """Run an experiment with one participant.

    Parameters
    ----------
    experiment
        Experiment to run.
    given
        Command-line options; None: those of this process. ``--help`` lists them.
    program
        Program name shown in the help; None: the script's name.

    Returns
    -------
    int
        Exit code: 0 if completed, 1 if stopped earlier, 2 with one sentence on standard error if it cannot run, 130
        after Ctrl-C and 143 after SIGTERM.
    """
    try:
        with terminable():
            ready = prepare(experiment, given, program)
            for warning in ready.warnings:
                _warn(warning)
            with closing(ready.triggers):
                return _in_window(experiment, ready)
    except KeyboardInterrupt as stop:
        if program is not None:
            raise  # the command states the exit code of its signal
        print(f"Interrupted: {str(stop) or NOTHING}", file=sys.stderr)
        return exit_code(stop)
    except InputError as error:
        print(f"Error: {one_line(error)}", file=sys.stderr)
        return 2


def _warn(warning: str) -> None:
    print(f"Warning: {warning}", file=sys.stderr, flush=True)


def _in_window(experiment: Experiment, ready: Prepared) -> int:
    """Open the window, and run the experiment in it; return the exit code."""
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
    warnings = [*_of_window(ready, window)]
    for warning in warnings:
        _warn(warning)
    ready = replace(ready, warnings=[*ready.warnings, *warnings])
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


def _of_window(ready: Prepared, window: Screen) -> Iterator[str]:
    """Yield warnings that only an open window can give: of frames, and of texts that the font cannot show."""
    if window.refresh_hz is None:
        yield (
            f"the display does not report its frames (no vertical synchronisation): they are paced at "
            f"{ready.screen.PACE:g} Hz, and durations are not exact to a frame."
        )
    shown = {name: entry for name, entry in ready.words.entries.items() if not name.startswith("web.")}
    if lacking := missing_glyphs("".join(line for entry in shown.values() for line in entry)):
        some = f"{', '.join(lacking[:3])}{' and others' if len(lacking) > 3 else ''}"
        yield (
            f"the screen's font cannot show {some} of the language {ready.words.language!r}, but shows boxes: install "
            "a font with these characters, and make it the system's default."
        )


def guard(what: str, call: Callable[[], object], said: set[str]) -> str | None:
    """Call code supplied by the laboratory; return its error, or None. Each source of errors is reported once."""
    try:
        call()
    except Exception as error:
        if what not in said:
            said.add(what)
            print(f"Warning: {what} failed ({error!r}); the session continues.", file=sys.stderr, flush=True)
        return repr(error)[:200]
    return None


def _listener(sitting: Sitting, triggers: Triggers) -> Callable[[str, float], None]:
    """Return the function called at each event: it stores the event for the journal, and sends it to ports and ioHub.

    Errors in code supplied by the laboratory are recorded, and reported once; the session continues.
    """
    said: set[str] = set()

    def guarded(what: str, call: Callable[[], object]) -> None:
        if failed := guard(what, call, said):
            sitting.failures.append((what, failed))

    def listen(name: str, at: float) -> None:
        seconds = sitting.since_start(at)
        # Wall-clock time of the event: the present time less the time elapsed since.
        sitting.events.append((name, seconds, time.time() - (time.monotonic() - at)))
        for port in triggers.ports:
            guarded(port.name, partial(triggers.send, port, name, at, seconds, sitting.shown))
        # PsychoPy's ioHub runs if the file given with --markers launched it.
        client = sys.modules.get("psychopy.iohub.client")
        hub = client and client.ioHubConnection.getActiveConnection()
        if hub:
            guarded("ioHub", lambda: hub.sendMessageEvent(text=name, category="focalgradient"))

    return listen


def _run(experiment: Experiment, ready: Prepared, sitting: Sitting) -> None:
    window, options = sitting.screen, ready.options
    consent = ready.consent
    agreed = None if consent is None else consent.stated(uninterrupted(lambda: agree(window, consent)))
    about = uninterrupted(lambda: ask_participant(sitting, options))
    sitting.session = options.session
    if window.eyes is not None:
        uninterrupted(lambda: align(window, options.stereoscope))
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
        texts = pages_of(ready.design, ready.words, sitting.participant)
        done = len(session.recorded)
        steps = sequence(ready.design, ready.words, texts, session.trials, done)
        walk = _Walk(experiment, sitting, session)
        try:
            for step in steps:
                if not _is_last(step):
                    walk.show(step)
        except KeyboardInterrupt as stop:
            raise type(stop)(_saved(ready, session)) from None
        except Unpractised as failed:
            _note_events(sitting, session)
            print(f"Stopped: practice was not passed ({failed}), which the design requires.", file=sys.stderr)
            for step in filter(_is_last, steps):
                walk.show(step)
            raise
        except Quit:
            _note_events(sitting, session)
            left = len(session.remaining())
            amount = "1 trial is" if left == 1 else f"{left} trials are"
            print(f"Stopped; {amount} left: continue with --resume.", file=sys.stderr)
            _may_keep(window, session, sitting)
            raise
    window.on_event("end", window.now())
    print(f"Saved in {options.folder}.", flush=True)
    for step in filter(_is_last, steps):
        walk.show(step)


def _saved(ready: Prepared, session: Session) -> str:
    """Return what an interrupted session has saved, and the command that continues it."""
    options, files, done = ready.options, session.files, len(session.recorded)
    answers = "1 answer is" if done == 1 else f"{done} answers are"
    if not session.remaining():
        return f"all {answers} saved in {options.folder}."
    given = [*ready.given]
    labels = {"--participant": files.participant, "--session": files.session}
    for name, label in labels.items():
        if label is not None and not any(word.partition("=")[0] == name for word in given):
            given += [name, label]
    call = f"{ready.program} {shlex.join([*given, '--resume'])}"
    return f"{answers} saved in {options.folder}; continue with: {call}"


def _is_last(step: Step) -> bool:
    """Return whether a step follows the last answer."""
    return isinstance(step, Page) and step.event in ("debriefing", "thanks")


def _calibrate(sitting: Sitting, session: Session) -> None:
    """Calibrate the eye tracker, and note the metadata of its recording."""
    if sitting.recorder is None:
        return
    gaze = sitting.recorder.gaze
    gaze.calibrate()
    session.note("eye tracker", **gaze_entry(sitting.screen, gaze), **gaze.about())


def _happened(sitting: Sitting) -> dict[str, Any]:
    """Return events since the last trial was recorded, with the current trial's condition and its `first` event."""
    shown = sitting.shown or {"phase": None, "trial": None}
    about = {"phase": shown["phase"], "trial": shown["trial"], "condition": shown}
    return about | {"events": sitting.events, "first": sitting.first}


def _note_events(sitting: Sitting, session: Session) -> None:
    """Write events since the last trial, and errors in code supplied by the laboratory, to the journal."""
    session.note("events", **_happened(sitting), failures=sitting.failures)
    sitting.events, sitting.failures = [], []


def _may_keep(window: Screen, session: Session, sitting: Sitting) -> None:
    """Ask a participant who stops whether the answers may be kept; note the reply, and tell the experimenter."""
    words = window.words
    foot = words("session.keep_keys", yes=words.yes.upper(), no=words.no.upper())
    with suppress(Quit):  # Escape again: no reply
        key = uninterrupted(
            lambda: pages(window, [words("session.keep")], "keep?", keys=(words.yes, words.no), foot=foot)
        )
        session.note("keep", kept=key == words.yes)
        if key == words.no:
            print(
                f"The participant asks for removal of the answers: run focalgradient withdraw {session.files.root} "
                f"sub-{sitting.participant}",
                file=sys.stderr,
            )


def _opened(ready: Prepared, sitting: Sitting, about: Mapping[str, Any]) -> Session:
    """Begin or resume the session, as the options require."""
    options = ready.options
    apparatus = _apparatus(ready, sitting.screen)
    whose = (sitting.participant, options.session)
    if options.resume:
        return Session.resume(options.folder, ready.design.task, *whose, apparatus=apparatus, stimuli=options.stimuli)
    return Session.begin(
        options.folder, ready.design, *whose, apparatus=apparatus, stimuli=options.stimuli, about=about
    )


class _Walk:
    """Execution of the steps of a sitting; each answer is recorded before the next trial begins."""

    def __init__(self, experiment: Experiment, sitting: Sitting, session: Session):
        self._experiment, self._sitting, self._session = experiment, sitting, session
        self._began, self._counted = sitting.screen.now(), 0
        self._practised: list[tuple[Trial, Answer]] = []
        self._prepared = False

    def show(self, step: Step) -> None:
        """Run a step; repeat it from its start if Escape interrupted it and the session continues."""
        instructions = isinstance(step, Page) and step.event == "instructions"
        if not (self._prepared or instructions):
            self._prepare()
        if isinstance(step, Turn):
            self._turn(step)
        elif isinstance(step, Repeat):
            self._repeat(step)
        elif isinstance(step, Standard):
            self._sitting.lead = (step,)
            uninterrupted(lambda: self._experiment.standard(self._sitting))
        elif not (instructions and self._experiment.instructions is not None):
            uninterrupted(partial(self._page, step))

    def _prepare(self) -> None:
        """Show the experiment's own instructions, calibrate the eye tracker, and call the experiment's `before`."""
        sitting, own = self._sitting, self._experiment.instructions
        self._prepared = True
        if own is not None:
            uninterrupted(lambda: pages(sitting.screen, own(sitting), "instructions"))
        _calibrate(sitting, self._session)
        uninterrupted(lambda: self._experiment.before(sitting))

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
        """Return the estimated minutes left at the pace so far; at 10 s per trial if there is none yet."""
        sitting = self._sitting
        left = sum(one.phase == "main" for one in self._session.remaining())
        each = (sitting.screen.now() - self._began) / self._counted if self._counted else 10.0
        return max(1, round(left * each / 60))

    def _turn(self, turn: Turn) -> None:
        sitting, session, trial = self._sitting, self._session, turn.trial
        sitting.recorded = session.recorded
        answer = _timed(self._experiment, sitting, session, turn)
        _note_events(sitting, session)
        if sitting.taken is not None:
            samples = [list(sample) for sample in sitting.taken.samples]
            session.note("gaze", phase=trial.phase, trial=trial.trial, samples=samples)
        session.record(trial, answer)
        sitting.noted = {}
        if trial.phase == "practice":
            self._practised.append((trial, answer))
        else:
            self._counted += 1
        sitting.screen.on_event("recorded", sitting.screen.now())
        sitting.shown = None

    def _repeat(self, repeat: Repeat) -> None:
        """Repeat practice until it meets the design's criterion; its answers remain in the journal."""
        experiment, sitting, session = self._experiment, self._sitting, self._session
        design, practised = sitting.design, self._practised
        for number in range(1, design.practice_rounds + 1):
            judged = judged_round(design, [experiment.right(sitting, *one) for one in practised])
            session.note("practice", round=number, **judged)
            if not judged["passed"] and number == design.practice_rounds and design.practice_required:
                raise Unpractised(f"{judged['right']} of {judged['of']} trials right in round {number}")
            if judged["passed"] or number == design.practice_rounds:
                return
            uninterrupted(partial(self._page, repeat.again))
            repeated = []
            for turn in repeat.turns:
                answer = _timed(experiment, sitting, session, turn, number + 1)
                session.note("practice again", round=number + 1, trial=asdict(turn.trial), answer=answer_event(answer))
                _note_events(sitting, session)
                sitting.shown = None
                sitting.noted = {}
                repeated.append((turn.trial, answer))
            practised = repeated


def uninterrupted(shown: Callable[[], Shown]) -> Shown:
    """Call a function; repeat it from its start if Escape interrupted it and the session continues."""
    while True:
        with suppress(Again):
            return shown()


def _timed(experiment: Experiment, sitting: Sitting, session: Session, turn: Turn, round: int = 1) -> Answer:
    """Run a trial; repeat it if the wall clock drifted from the monotonic clock meanwhile."""
    trial, sitting.lead, sitting.after = turn.trial, turn.lead, turn.after
    sitting.begin(trial)
    noted = dict(sitting.noted)  # before the trial

    def shown() -> Answer:
        session.expose(trial, round)
        return _one(experiment, sitting, trial, noted)

    for _ in range(MOST_REPEATS):
        before = time.monotonic(), time.time()
        answer = uninterrupted(shown)
        by = parted(before, (time.monotonic(), time.time()))
        if not by:
            return answer
        session.note("void", clocks_parted_s=by, **_happened(sitting))
        sitting.events, sitting.first = [], 0
    raise InputError(
        f"the computer's clock was set {MOST_REPEATS} times in a row during trial {trial.trial}: pause clock "
        "synchronisation, and continue with --resume."
    )


def parted(before: tuple[float, float], after: tuple[float, float]) -> float:
    """Return the drift of the wall clock relative to the monotonic clock between two readings, in s; 0 if tolerated.

    >>> parted((100.0, 5000.0), (110.0, 5010.001)), parted((100.0, 5000.0), (110.0, 1410.0))
    (0.0, -3600.0)
    """
    lasted = after[0] - before[0]
    by = (after[1] - before[1]) - lasted
    return by if abs(by) > PART + lasted / 1000 else 0.0


def _one(experiment: Experiment, sitting: Sitting, trial: Trial, noted: Mapping[str, Noted]) -> Answer:
    """Run a trial from its start, with values noted before it, and ask the design's additional questions."""
    sitting.screen.dropped, sitting.noted = 0, dict(noted)
    sitting.screen.drawn.clear()
    answer = experiment.trial(sitting, trial)
    shown = [*sitting.screen.drawn]
    if not sitting.unchanged.issuperset(shown):  # unchanged pictures of the set are identified by the column stimulus
        sitting.noted[SHOWN] = Noted(" ".join(shown), description=SHOWN_ABOUT)
    task, design = task_named(experiment.task), sitting.design
    if sitting.taken is not None:
        within = getattr(design, "gaze_within_deg", WITHIN_DEG)
        answer = with_noted(answer, sitting.taken.noted(within), task.columns(design.model_dump(mode="json")))
    for name, (control, about) in task.further(sitting.design, sitting.words, trial).items():
        event = name if name == "confidence" else "question"
        sitting.note(name, ask(sitting.screen, control, event), unit=about.unit, description=about.description)
    return replace(with_noted(answer, sitting.noted), dropped_frames=sitting.screen.dropped)


def _apparatus(ready: Prepared, window: Screen) -> Apparatus:
    display = ready.display
    clock = "seconds since the window opened, on a monotonic clock that cannot be set"
    if window.refresh_hz is None:
        clock += f"; the display does not report its frames, which are paced at {ready.screen.PACE:g} Hz"
    measured = ready.screen.calibration_of(ready.options.monitor)
    width, height = (side * display.pixel_pitch for side in display.size_px)
    return Apparatus(
        clock=clock,
        screen_px=display.size_px,
        screen_m=(width, height) if ready.calibrated else None,
        viewing_distance_m=display.distance if ready.calibrated else None,
        refresh_hz=window.refresh_hz,
        gamma=None if display.gamma == "sRGB" else float(np.mean(display.gamma)),
        gamma_channels=measured.channels,
        white_cd_m2=measured.white,
        versions=ready.screen.versions(),
        stereoscope=None if window.eyes is None else window.eyes.setup.stated(window.eyes.displays),
    )
