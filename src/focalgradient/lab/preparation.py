"""What is checked before a window opens: the command line, the design, the data, the pictures, the screen's geometry.

Whatever is wrong is said in one sentence. That PsychoPy is installed is seen first; it is imported last, and only where
all else is right.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import platform
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

import numpy as np

from focalgradient.dataset import Session
from focalgradient.design import Design, check_label, design_text, load_design
from focalgradient.design.consent import Consent, read_consent
from focalgradient.design.given_list import read_trials
from focalgradient.design.words import LANGUAGES, Words, load_words, words_text
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.lab.boxes import Box, add_boxes, check_keys, open_boxes
from focalgradient.lab.experiment import Experiment
from focalgradient.lab.stereoscope import Stereoscope, eye_displays, open_stereoscope
from focalgradient.lab.trackers import add_tracker, tracker_settings
from focalgradient.lab.triggers import Triggers, add_triggers, open_triggers
from focalgradient.luminance import UNEQUAL
from focalgradient.stimuli import StimulusSet, read_set
from focalgradient.tasks import task_named

__all__ = [
    "ASSUMED_DISTANCE",
    "ASSUMED_PITCH",
    "WINDOW",
    "Arguments",
    "Prepared",
    "check_session",
    "import_screen",
    "prepare",
]

ASSUMED_PITCH, ASSUMED_DISTANCE = 0.0254 / 96, 0.57  # metres, of a screen that has not been calibrated
WINDOW = (1024, 768)  # pixels
NEAR = 0.01  # by which the degrees of pictures may be wrong
GAMMA_NEAR = 0.1  # by which a display's measured gamma may differ from the one that pictures were made for

NO_PSYCHOPY = (3, 13)  # the first Python that PsychoPy cannot be installed on, by its own metadata


@dataclass(frozen=True, slots=True)
class Prepared:
    """What a window can be opened with.

    Parameters
    ----------
    options
        The command line.
    design, stimuli
        What is run; the pictures, where it shows any.
    tracker
        Of the gaze: name and settings in ioHub, "mouse" for the pointer; None where the design wants none.
    words
        What is said on the screen.
    consent
        Text to agree to, where there is one.
    triggers
        Where each event is sent.
    boxes
        Response boxes at serial ports.
    screen
        The module that knows PsychoPy.
    display, calibrated
        The screen's geometry and encoding of light, and whether its size and distance are known; with a stereoscope of
        the part that an eye sees.
    stereoscope
        How it is set up, with the displays of the left and of the right eye; None: there is none.
    warnings
        What whoever runs the experiment should know.
    """

    options: argparse.Namespace
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
    """Check all that can be known without a window.

    Raises
    ------
    InputError
        If something is wrong: the first is said.
    """
    options = _arguments(experiment, given, program)
    _psychopy()
    design = task_named(experiment.task).design() if options.design is None else load_design(options.design)
    if design.task != experiment.task:
        raise InputError(f"{options.design} is a design of {design.task!r}, but {experiment.task!r} is to be run.")
    if options.trials is not None:
        if options.resume:
            raise InputError("--trials is given, but a session goes on with the list that it began with: leave it out.")
        design = design.with_trials(str(options.trials), read_trials(options.trials))
    design = check_session(options, _with_gaze(options, design.pilot() if options.pilot else design))
    tracker = _tracker(options, design)
    stimuli = _stimuli(options, experiment, design)
    words = load_words(design.language, None if options.design is None else options.design.parent)
    consent = None if options.consent is None else read_consent(options.consent)
    setup = open_stereoscope(options)
    if setup is not None and tracker is not None:
        raise InputError("--stereoscope is given, but the gaze cannot be recorded through mirrors: give --gaze none.")
    triggers = open_triggers(options.markers, options.triggers, options.codes)
    try:
        screen = import_screen()
        display, calibrated, warnings = _display(options, screen, stimuli, setup)
        stereoscope = None
        if setup is not None:
            stereoscope = setup, eye_displays(setup, screen, display, gamma_shown)
        experiment.check(design, display, _room(options, screen.screen_size(options.screen), setup))
        experiment.check_pictures(design, display, stimuli)
        boxes = open_boxes(options.box, check_keys(options, screen.key_names()))
    except BaseException:
        triggers.close()
        raise
    parts = (design, stimuli, tracker, words, consent, triggers, boxes, screen, display, calibrated, stereoscope)
    return Prepared(options, *parts, warnings)


class Arguments(argparse.ArgumentParser):
    """Options of a program: what is wrong with them is an InputError."""

    def error(self, message: str) -> NoReturn:
        """Raise InputError with the parser's message."""
        raise InputError(f"{message.rstrip('.')}: see --help.")


class _PrintDesign(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, *rest: Any) -> None:
        print(design_text(self.const), end="")
        parser.exit()


class _PrintWords(argparse.Action):
    def __call__(self, parser: argparse.ArgumentParser, namespace: object, values: Any, option: object = None) -> None:
        print(words_text(values), end="")
        parser.exit()


def _arguments(experiment: Experiment, given: Sequence[str] | None, program: str | None = None) -> argparse.Namespace:
    add = (parser := Arguments(program, description=experiment.about)).add_argument
    add("--participant", metavar="LABEL", help="letters and digits; asked for on the screen where it is not given")
    add("--session", metavar="LABEL", help="for participants who come more than once")
    add("--age", metavar="YEARS", help="for the table of participants, as are the next two")
    add("--sex", metavar="WORD")
    add("--handedness", metavar="WORD")
    add("--eye", metavar="WORD", help="left, right or both: the viewing eye")
    add("--data", type=Path, metavar="DIR", help="folder of the data set (default: data; with --pilot: pilot)")
    add("--stimuli", type=Path, metavar="DIR", help="folder of the pictures, made by 'focalgradient stimuli'")
    add("--design", type=Path, metavar="FILE", help="settings (default: those of the paper)")
    add(
        "--print-design",
        action=_PrintDesign,
        nargs=0,
        const=experiment.task,
        help="print the settings file of the paper, to copy and change",
    )
    add(
        "--print-words",
        action=_PrintWords,
        metavar="LANGUAGE",
        help=f"print all that is said on the screen in {' or '.join(LANGUAGES)}, to copy and change",
    )
    add("--trials", type=Path, metavar="FILE", help="list of trials instead of the design's own (CSV, XLSX)")
    add("--consent", type=Path, metavar="FILE", help="text to agree to before all else")
    add("--resume", action="store_true", help="go on with a session that was cut off")
    add("--pilot", action="store_true", help="a short run in a small window, to see that all works")
    add("--windowed", action="store_true", help=f"a window of {WINDOW[0]} x {WINDOW[1]} pixels, not the whole screen")
    add("--screen", type=int, default=0, metavar="N", help="number of the screen (default: 0)")
    add("--monitor", metavar="NAME", help="the screen's name in PsychoPy's Monitor Center, with its size and distance")
    add("--uncalibrated", action="store_true", help="run without knowing the screen's size and distance")
    add("--photodiode", choices=("left", "right"), help="lower corner for a square that is white with the stimulus")
    add("--stereoscope", type=Path, metavar="FILE", help="settings of a mirror stereoscope or two screens (TOML)")
    add_triggers(add)
    add_boxes(add)
    if "gaze" in task_named(experiment.task).design.model_fields:  # its trials have an object to fixate
        add("--gaze", choices=("none", "mouse", "tracker"), help="record where one looks, whatever the design says")
        add_tracker(parser)
    options = parser.parse_args(given)
    if options.screen < 0:
        raise InputError(f"--screen is {options.screen}, but must be 0 or more.")
    if options.pilot:
        options.windowed = options.uncalibrated = True
        options.participant = options.participant or "pilot"
        if not options.resume:
            options.session = options.session or datetime.now().strftime("%Y%m%dT%H%M%S")
    options.data = options.data or Path("pilot" if options.pilot else "data")
    if options.resume and not options.participant:
        raise InputError("--resume needs to know whose session to resume: give --participant.")
    return options


def _with_gaze(options: argparse.Namespace, design: Design) -> Design:
    """The design, with the gaze recorded as the options say; in a pilot's window the mouse stands for a tracker."""
    if not hasattr(design, "gaze"):
        return design
    gaze = options.gaze or design.gaze
    return design.model_copy(update={"gaze": "mouse" if options.pilot and gaze == "tracker" else gaze})


def _tracker(options: argparse.Namespace, design: Design) -> tuple[str, dict[str, Any]] | None:
    """The eye tracker that the design asks for."""
    gaze = getattr(design, "gaze", "none")
    if gaze != "tracker" and getattr(options, "tracker", None) is not None:
        raise InputError(f"--tracker is given, but the gaze is {gaze!r}: give --gaze tracker, or leave it out.")
    if gaze == "none":
        return None
    if gaze == "tracker" and options.windowed:
        raise InputError("the eye tracker counts from the middle of the whole screen: leave out --windowed.")
    return tracker_settings(gaze, options.tracker)


def check_session(options: argparse.Namespace, design: Design) -> Design:
    """Check labels, data and disk for the session that the options ask for: the design that is going to be run."""
    if options.session is not None:
        check_label("the session", options.session)
    if options.participant is None:
        return design
    return Session.check(
        options.data,
        design,
        options.participant,
        options.session,
        resume=options.resume,
        stimuli=options.stimuli,
    )


def _stimuli(options: argparse.Namespace, experiment: Experiment, design: Any) -> StimulusSet | None:
    """The set of pictures, with all that the design asks for."""
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
            f"focal_length_mm is {designed:g} in the design, but the pictures were made with {made:g}: give that."
        )
    stimuli.pixels(stimuli.picture(*needed[-1]))
    if getattr(design, "judged", None) == "depth":
        for scene in design.scenes:
            stimuli.depth(scene)
    return stimuli


def _psychopy() -> None:
    """Refuse to go on without PsychoPy, before anything else is asked for."""
    if importlib.util.find_spec("psychopy") is not None:
        return
    if sys.version_info >= NO_PSYCHOPY:
        raise InputError(
            f"PsychoPy is not installed, and Python {platform.python_version()} is too new for it: use Python 3.11 or "
            "3.12, and pip install 'focalgradient[lab]'."
        )
    raise InputError("PsychoPy is not installed: pip install 'focalgradient[lab]'.")


def import_screen() -> ModuleType:
    """Import the module that knows PsychoPy.

    Raises
    ------
    InputError
        If there is no display, or no PsychoPy.
    """
    _psychopy()
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        raise InputError("there is no display (DISPLAY is not set): run this on a machine with a screen.")
    try:
        from focalgradient.lab import screen
    except ImportError as error:
        remedy = "install it anew, with pip install 'focalgradient[lab]'"
        raise InputError(f"PsychoPy cannot be imported ({error}): {remedy}.") from error
    except Exception as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"no window can be opened ({error or type(error).__name__}): see that a display is there."
        ) from error
    return screen


def _made_for(guns: tuple[float, float, float], stimuli: StimulusSet | None) -> bool:
    """Whether guns are alike, or the pictures were made for them as they are."""
    made = None if stimuli is None else stimuli.display.gamma
    if isinstance(made, tuple):
        return max(abs(one - other) for one, other in zip(made, guns, strict=True)) <= GAMMA_NEAR
    return max(guns) - min(guns) <= UNEQUAL


def _unequal(guns: tuple[float, float, float]) -> str:
    red, green, blue = (f"{gun:.2f}" for gun in guns)
    return (
        f"the gammas of red, green and blue are {red}, {green} and {blue}: they differ by {max(guns) - min(guns):.2f}, "
        f"more than {UNEQUAL:g}, so that greys of pictures made for another gamma are coloured: make them with --gamma "
        f"{red},{green},{blue}."
    )


def gamma_shown(found: Any) -> float | tuple[float, float, float] | None:
    """The gamma to encode light by, of a monitor's calibration: of each gun, where they were measured."""
    if found.channels is not None:
        red, green, blue = (min(max(gun, 1.0), 4.0) for gun in found.channels)
        return red, green, blue
    return None if found.gamma is None else min(max(found.gamma, 1.0), 4.0)


def _room(options: argparse.Namespace, size: tuple[int, int], setup: Stereoscope | None) -> tuple[int, int]:
    """Pixels that an eye sees: of the window or the screen, or, with a stereoscope, of an eye's part."""
    whole = WINDOW if options.windowed else size
    return whole if setup is None else setup.part(whole, options.windowed)


def _display(
    options: argparse.Namespace, screen: Any, stimuli: StimulusSet | None, setup: Stereoscope | None = None
) -> tuple[Display, bool, list[str]]:
    """The screen's geometry and encoding, whether they have been calibrated, and what is to be warned of."""
    size, gamma, warnings = screen.screen_size(options.screen), None, []
    pitch, distance = ASSUMED_PITCH, ASSUMED_DISTANCE
    calibrated, white, found = False, None, None
    remedy = "or give --uncalibrated to run all the same, with degrees that are not right"
    if options.monitor is not None:
        found = screen.calibration_of(options.monitor)
        gamma, white = found.gamma, found.white
        if found.channels is not None and not _made_for(found.channels, stimuli):
            warnings.append(_unequal(found.channels))
        calibrated = bool(found.width and found.distance)
        if calibrated and found.size_px and found.size_px != size and not options.uncalibrated:
            raise InputError(
                f"the monitor {options.monitor!r} was calibrated at {found.size_px[0]} x {found.size_px[1]} pixels, "
                f"but the screen has {size[0]} x {size[1]}: set its resolution, calibrate it anew, {remedy}."
            )
        if calibrated:
            pitch, distance = found.width / size[0], found.distance
        elif not options.uncalibrated:
            raise InputError(
                f"the monitor {options.monitor!r} has no width or no distance: enter them in PsychoPy's Monitor "
                f"Center, {remedy}."
            )
    elif not options.uncalibrated:
        raise InputError(
            "the screen's size and distance are not known: enter them in PsychoPy's Monitor Center and give --monitor "
            f"NAME, {remedy}."
        )
    if gamma is None:
        warnings.append("the screen's gamma has not been measured: light is shown as if its curve were that of sRGB.")
    shown_by = None if found is None else gamma_shown(found)
    seen = size if setup is None else setup.part(size, windowed=False)
    display = Display(seen, pitch, distance, shown_by or "sRGB", **({} if white is None else {"white": white}))
    if stimuli is not None:
        made = stimuli.display
        ratio = made.pixels_per_degree / display.pixels_per_degree
        if calibrated and abs(ratio - 1) > NEAR and not options.uncalibrated:
            raise InputError(
                f"the pictures were made for {made.pixels_per_degree:.2f} pixels per degree, but the screen has "
                f"{display.pixels_per_degree:.2f}: sit at {distance * ratio:.3f} m (and say so in the Monitor Center), "
                f"make the pictures anew, {remedy}."
            )
        meant = 2.2 if made.gamma == "sRGB" else float(np.mean(made.gamma))
        if gamma is not None and abs(gamma - meant) > GAMMA_NEAR:
            warnings.append(f"the pictures were made for a gamma of {made.gamma}, but the screen's is {gamma:.2f}.")
        height, width = stimuli.pixels(stimuli.pictures[0]).shape[:2]
        room = _room(options, size, setup)
        if (width > room[0] or height > room[1]) and not options.pilot:
            raise InputError(
                f"the pictures have {width} x {height} pixels, but the window only {room[0]} x {room[1]}: leave out "
                "--windowed, take a larger screen, or make the pictures anew."
            )
    return display, calibrated, warnings
