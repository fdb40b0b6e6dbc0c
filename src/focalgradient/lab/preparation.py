"""Checks before a window is opened: command line, design, data, pictures and screen geometry.

Each fault is reported in one sentence. Whether PsychoPy is installed is checked first; it is imported last, because
that is slow.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import platform
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from focalgradient.dataset import Session
from focalgradient.design import Design, check_label, design_of, design_text
from focalgradient.design.consent import Consent, read_consent
from focalgradient.design.form import GIVEN, check_about
from focalgradient.design.given_list import read_trials
from focalgradient.design.words import Words, load_words, words_text
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.lab.devices.boxes import Box, check_keys, open_boxes
from focalgradient.lab.devices.stereoscope import Stereoscope, eye_displays, open_stereoscope
from focalgradient.lab.devices.trackers import tracker_settings
from focalgradient.lab.devices.triggers import Triggers, open_triggers
from focalgradient.lab.experiment import Experiment
from focalgradient.lab.options import MonitorOptions, SessionOptions
from focalgradient.luminance import UNEQUAL
from focalgradient.options import parsed
from focalgradient.stimuli import StimulusSet, read_set
from focalgradient.tasks import check_task, task_named

__all__ = [
    "ASSUMED_DISTANCE",
    "ASSUMED_PITCH",
    "WINDOW",
    "Prepared",
    "check_session",
    "import_screen",
    "plain_screen",
    "prepare",
]

ASSUMED_PITCH, ASSUMED_DISTANCE = 0.0254 / 96, 0.57  # in m, for an uncalibrated screen
WINDOW = (1024, 768)  # pixels
NEAR = 0.01  # tolerance of the pictures' visual angle, as a fraction
PILOT_TRIALS = 20  # above which a test run is long
GAMMA_NEAR = 0.1  # tolerance between the display's measured gamma and that of the pictures

NO_PSYCHOPY = (3, 13)  # first Python version that PsychoPy's metadata exclude


@dataclass(frozen=True, slots=True)
class Prepared:
    """Validated settings and opened devices of a run, before its window is opened.

    Parameters
    ----------
    options
        Parsed command line.
    program, given
        Name and words of the command that resumes the session, without `--resume`.
    design, stimuli
        Design; and the set of pictures, if it shows any.
    tracker
        Source of gaze: ioHub's name and settings of the tracker, "mouse" for the pointer; None if gaze is not recorded.
    words
        Texts shown on the screen.
    consent
        Consent text, if there is one.
    triggers
        Ports to which events are sent.
    boxes
        Response boxes at serial ports.
    screen
        The module that imports PsychoPy.
    display, calibrated
        Geometry and light encoding of the screen (with a stereoscope: of the part that one eye sees), and whether its
        size and viewing distance are known.
    stereoscope
        Settings of the stereoscope, with the displays of the left and right eye; None without one.
    warnings
        Warnings for the experimenter.
    """

    options: SessionOptions
    program: str
    given: Sequence[str]
    design: Design
    stimuli: StimulusSet | None
    tracker: tuple[str, dict[str, Any]] | None
    words: Words
    consent: Consent | None
    triggers: Triggers
    boxes: list[Box]
    screen: ModuleType
    display: Display
    calibrated: bool
    stereoscope: tuple[Stereoscope, tuple[Display, Display]] | None
    warnings: Sequence[str]


def prepare(experiment: Experiment, given: Sequence[str] | None, program: str | None = None) -> Prepared:
    """Check everything that can be checked without a window.

    Raises
    ------
    InputError
        At the first fault found.
    """
    words, program = (sys.argv[1:] if given is None else given), program or Path(sys.argv[0]).name
    options = _options(experiment, words, program)
    _psychopy()
    design = design_of(experiment.task, options.design)
    if options.trials is not None:
        if options.resume:
            raise InputError("--trials is given, but a resumed session continues with its own list: leave it out.")
        design = design.with_trials(str(options.trials), read_trials(options.trials))
    short = design.pilot() if options.pilot else design
    given_design = short.model_copy(update={"gaze": _gaze(options, short)}) if hasattr(short, "gaze") else short
    design = check_session(options, given_design)
    if options.resume and options.design is not None:
        _same_design(options, given_design, design)
    texts = load_words(design.language, None if options.design is None else options.design.parent)
    tracker = _tracker(options, design)
    stimuli = _stimuli(options, experiment, design)
    consent = None if options.consent is None else read_consent(options.consent)
    setup = open_stereoscope(options)
    if setup is not None and tracker is not None:
        raise InputError("--stereoscope is given, but the gaze cannot be recorded through mirrors: give --gaze none.")
    triggers = open_triggers(options)
    try:
        screen = import_screen()
        display, calibrated, warnings = _display(options, screen, stimuli, setup)
        warnings = [*warnings, *_unshortened(options, short, design)]
        stereoscope = None
        if setup is not None:
            stereoscope = setup, eye_displays(setup, screen, display, gamma_shown)
        room = _room(options, screen.screen_size(options.screen), setup)
        experiment.check(design, display, room)
        check_task(
            design,
            texts,
            pixels_per_degree=display.pixels_per_degree,
            room=None if options.pilot else room,
            stimuli=None if task_named(design.task).adapts else stimuli,
        )
        boxes = open_boxes(options.box, check_keys(options.box_keys, screen.key_names()))
    except BaseException:
        triggers.close()
        raise
    parts = (design, stimuli, tracker, texts, consent, triggers, boxes, screen, display, calibrated, stereoscope)
    return Prepared(options, program, _to_repeat(words), *parts, warnings)


def _options(experiment: Experiment, given: Sequence[str], program: str) -> SessionOptions:
    options = parsed(SessionOptions, given, program=program, about=experiment.about)
    if options.print_design or options.print_words is not None:
        text = design_text(experiment.task) if options.print_words is None else words_text(options.print_words)
        print(text, end="")
        sys.exit(0)
    check_about({name: text for name in GIVEN if (text := getattr(options, name))}, GIVEN)
    if options.screen < 0:
        raise InputError(f"--screen is {options.screen}, but must be 0 or more.")
    if options.pilot:
        options.windowed = options.uncalibrated = True
        options.participant = options.participant or "pilot"
        if not options.resume:
            options.session = options.session or datetime.now().strftime("%Y%m%dT%H%M%S")
    if options.resume and not options.participant:
        raise InputError(
            "--resume is given without the participant whose session is to be resumed: give --participant."
        )
    return options


def _unshortened(options: SessionOptions, short: Design, design: Design) -> Iterator[str]:
    """Yield a warning if a test run has as many trials as a session."""
    if not options.pilot:
        return
    trials = len(short.trials(options.participant or "pilot"))
    if trials > PILOT_TRIALS and trials == len(design.trials(options.participant or "pilot")):
        yield (
            f"the test run has all {trials} trials of the design: it omits repetitions, of which there are none, and "
            "what shortened in the design's class names."
        )


def _to_repeat(given: Sequence[str]) -> list[str]:
    """Return command-line words for a resumed session, which continues with its own list of trials."""
    words = iter(given)
    kept = []
    for word in words:
        if word == "--trials":
            next(words, None)
        elif not word.startswith("--trials=") and word != "--resume":
            kept.append(word)
    return kept


def _gaze(options: SessionOptions, design: Any) -> str:
    """Return the source of gaze: the options', else the design's; in a pilot, the mouse replaces an eye tracker."""
    gaze = str(options.gaze or getattr(design, "gaze", "none"))
    return "mouse" if options.pilot and gaze == "tracker" else gaze


def _tracker(options: SessionOptions, design: Design) -> tuple[str, dict[str, Any]] | None:
    """Return the eye tracker's class and settings, if gaze is recorded; "mouse" for the pointer."""
    gaze = getattr(design, "gaze", None) or _gaze(options, design)
    if gaze != "tracker" and options.tracker is not None:
        raise InputError(f"--tracker is given, but the gaze is {gaze!r}: give --gaze tracker, or leave it out.")
    if gaze == "none":
        return None
    if gaze == "tracker" and options.windowed:
        raise InputError(
            "the eye tracker reports positions on the whole screen, which --windowed does not use: leave out "
            "--windowed."
        )
    return tracker_settings(gaze, options.tracker)


def check_session(options: SessionOptions, design: Design) -> Design:
    """Check labels, data and disk space for the session that the options request; return the design to be run."""
    if options.session is not None:
        check_label("the session", options.session)
    if options.participant is None:
        return design
    return Session.check(
        options.folder,
        design,
        options.participant,
        options.session,
        resume=options.resume,
        stimuli=options.stimuli,
    )


def _same_design(options: SessionOptions, given: Design, began: Design) -> None:
    """Raise `InputError` if a session is resumed with a design other than the one that it began with."""
    own, recorded = (design.of(options.participant or "").model_dump(mode="json") for design in (given, began))
    if changed := sorted(
        name for name in own if own[name] != recorded.get(name) and name not in ("gaze", "given_trials")
    ):
        raise InputError(
            f"{options.design} has another {', '.join(changed)} than the session began with: give --resume without "
            "--design, or begin a new session."
        )


def _stimuli(options: SessionOptions, experiment: Experiment, design: Any) -> StimulusSet | None:
    """Read the set of pictures, and check that it has everything that the design requires."""
    needed = experiment.pictures(design)
    if not needed:
        if options.stimuli is not None:
            raise InputError("--stimuli is given, but this design shows no pictures of a set: leave it out.")
        return None
    if options.stimuli is None:
        raise InputError("the pictures are missing: make them with 'focalgradient stimuli', and give --stimuli DIR.")
    stimuli = read_set(options.stimuli)
    stimuli.check(needed, getattr(design, "picture_factors", ()))
    made, designed = stimuli.manifest["parameters"].get("focal_length_mm"), getattr(design, "focal_length_mm", None)
    if None not in (made, designed) and made != designed:
        raise InputError(
            f"focal_length_mm is {designed:g} in the design, but the pictures were made with {made:g}: set it to "
            f"{made:g}."
        )
    stimuli.pixels(stimuli.picture(*needed[-1]))
    if getattr(design, "judged", None) == "depth":
        for scene in design.scenes:
            stimuli.depth(scene)
    return stimuli


def _psychopy() -> None:
    """Raise `InputError` if PsychoPy is not installed."""
    if importlib.util.find_spec("psychopy") is not None:
        return
    if sys.version_info >= NO_PSYCHOPY:
        raise InputError(
            f"PsychoPy is not installed, and Python {platform.python_version()} is too new for it: use Python 3.11 or "
            "3.12, and pip install 'focalgradient[lab]'."
        )
    raise InputError("PsychoPy is not installed: pip install 'focalgradient[lab]'.")


def import_screen() -> ModuleType:
    """Import the module that uses PsychoPy.

    Raises
    ------
    InputError
        If there is no display, or PsychoPy cannot be imported.
    """
    _psychopy()
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        raise InputError("there is no display (DISPLAY is not set): run this on a machine with a screen.")
    try:
        importlib.import_module("psychtoolbox")  # PsychoPy would go on without it, and without a keyboard
    except (ImportError, OSError) as error:
        raise InputError(_without_keyboard(str(error))) from error
    try:
        from focalgradient.lab import screen
    except ImportError as error:
        remedy = "reinstall it with pip install 'focalgradient[lab]'"
        raise InputError(f"PsychoPy cannot be imported ({error}): {remedy}.") from error
    except Exception as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"no window can be opened ({error or type(error).__name__}): check that a display is connected."
        ) from error
    return screen


def plain_screen(options: MonitorOptions, module: ModuleType) -> Any:
    """Open a window of assumed size and viewing distance; `module` is that of the screens."""
    display = Display(module.screen_size(options.screen), ASSUMED_PITCH, ASSUMED_DISTANCE)
    return module.Screen(options.screen, WINDOW if options.windowed else None, display)


LIBRARIES = {"libjack": "libjack-jackd2-0", "libasound": "libasound2"}
"""Debian package of each system library that PsychoPy's keyboard needs."""


def _without_keyboard(error: str) -> str:
    """Return why PsychoPy's keyboard cannot be used, and the remedy.

    >>> _without_keyboard("libjack.so.0: cannot open shared object file")
    "PsychoPy's keyboard needs libjack: apt-get install libjack-jackd2-0."
    """
    for library, package in LIBRARIES.items():
        if library in error:
            return f"PsychoPy's keyboard needs {library}: apt-get install {package}."
    return f"PsychoPy's keyboard cannot be used ({error}): reinstall psychtoolbox with pip."


def _made_for(guns: tuple[float, float, float], stimuli: StimulusSet | None) -> bool:
    """Return whether the channels' gammas agree with each other, or with those that the pictures were made for."""
    made = None if stimuli is None else stimuli.display.gamma
    if isinstance(made, tuple):
        return max(abs(one - other) for one, other in zip(made, guns, strict=True)) <= GAMMA_NEAR
    return max(guns) - min(guns) <= UNEQUAL


def _unequal(guns: tuple[float, float, float]) -> str:
    red, green, blue = (f"{gun:.2f}" for gun in guns)
    return (
        f"the gammas of red, green and blue are {red}, {green} and {blue}: they differ by {max(guns) - min(guns):.2f}, "
        f"more than {UNEQUAL:g}, so that greys of pictures made for another gamma are not neutral: make them with "
        f"--gamma {red},{green},{blue}."
    )


def gamma_shown(found: Any) -> float | tuple[float, float, float] | None:
    """Return the gamma with which light is encoded for a calibrated monitor: per channel, if measured per channel."""
    if found.channels is not None:
        red, green, blue = (min(max(gun, 1.0), 4.0) for gun in found.channels)
        return red, green, blue
    return None if found.gamma is None else min(max(found.gamma, 1.0), 4.0)


def _room(options: SessionOptions, size: tuple[int, int], setup: Stereoscope | None) -> tuple[int, int]:
    """Return the size in pixels that one eye sees: of window or screen or, with a stereoscope, of the eye's part."""
    whole = WINDOW if options.windowed else size
    return whole if setup is None else setup.part(whole, options.windowed)


def _display(
    options: SessionOptions, screen: Any, stimuli: StimulusSet | None, setup: Stereoscope | None = None
) -> tuple[Display, bool, list[str]]:
    """Return geometry and encoding of the screen, whether they are calibrated, and warnings."""
    size, found, warnings = screen.screen_size(options.screen), screen.calibration_of(options.monitor), []
    remedy = "or give --uncalibrated to run with wrong visual angles"
    if found.channels is not None and not _made_for(found.channels, stimuli):
        warnings.append(_unequal(found.channels))
    pitch, distance = ASSUMED_PITCH, ASSUMED_DISTANCE
    if calibrated := bool(found.width and found.distance):
        if found.size_px and found.size_px != size and not options.uncalibrated:
            raise InputError(
                f"the monitor {options.monitor!r} was calibrated at {found.size_px[0]} x {found.size_px[1]} pixels, "
                f"but the screen has {size[0]} x {size[1]}: set its resolution, calibrate it again, {remedy}."
            )
        pitch, distance = found.width / size[0], found.distance
    elif not options.uncalibrated:
        lacks, name = f"the monitor {options.monitor!r} has no width or no viewing distance", ""
        if options.monitor is None:
            lacks, name = "the screen's size and viewing distance are unknown", " and give --monitor NAME"
        raise InputError(f"{lacks}: enter them in PsychoPy's Monitor Center{name}, {remedy}.")
    if found.gamma is None:
        warnings.append("the screen's gamma has not been measured: light is encoded for the sRGB curve.")
    seen = size if setup is None else setup.part(size, windowed=False)
    white = {} if found.white is None else {"white": found.white}
    display = Display(seen, pitch, distance, gamma_shown(found) or "sRGB", **white)
    if stimuli is not None:
        made = stimuli.display
        ratio = made.pixels_per_degree / display.pixels_per_degree
        if calibrated and abs(ratio - 1) > NEAR and not options.uncalibrated:
            raise InputError(
                f"the pictures were made for {made.pixels_per_degree:.2f} pixels per degree, but the screen has "
                f"{display.pixels_per_degree:.2f}: change the viewing distance to {distance * ratio:.3f} m (in the "
                f"Monitor Center too), make the pictures again, {remedy}."
            )
        meant = 2.2 if made.gamma == "sRGB" else float(np.mean(made.gamma))
        if found.gamma is not None and abs(found.gamma - meant) > GAMMA_NEAR:
            warnings.append(
                f"the pictures were made for a gamma of {made.gamma}, but the screen's is {found.gamma:.2f}."
            )
        height, width = stimuli.pixels(stimuli.pictures[0]).shape[:2]
        room = _room(options, size, setup)
        if (width > room[0] or height > room[1]) and not options.pilot:
            raise InputError(
                f"the pictures have {width} x {height} pixels, but the window has only {room[0]} x {room[1]}: leave "
                "out --windowed, use a larger screen, or make smaller pictures."
            )
    return display, calibrated, warnings
