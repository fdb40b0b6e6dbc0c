"""Options of the laboratory's programs, as typed records."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from focalgradient.options import File, Folder
from focalgradient.quantities import Quantity

__all__ = ["CheckOptions", "FollowOptions", "MeterOptions", "MonitorOptions", "SessionOptions", "TriggerOptions"]

Label = Annotated[str, "LABEL"]
Name = Annotated[str, "NAME"]
Word = Annotated[str, "WORD"]


@dataclass(kw_only=True)
class TriggerOptions:
    """Ports to which events are sent.

    Parameters
    ----------
    markers
        Python file whose function mark(code, name, seconds, trial) is called at each event.
    triggers
        Send each event's code to parallel:/dev/parport0 (Windows: parallel:0x378), serial:PORT[:BAUD], lsl or
        file:PATH; may be given more than once.
    codes
        TOML file with custom event codes, by name and by condition.
    """

    markers: File | None = None
    triggers: Annotated[tuple[str, ...], "PORT"] = ()
    codes: File | None = None


@dataclass(kw_only=True)
class MonitorOptions:
    """Screen of a window.

    Parameters
    ----------
    screen
        Number of the screen.
    monitor
        Name of the screen in PsychoPy's Monitor Center, for its size, viewing distance and gamma.
    windowed
        Show a window of 1024 x 768 pixels instead of the whole screen.
    """

    screen: Annotated[int, "N"] = 0
    monitor: Name | None = None
    windowed: bool = False


@dataclass(kw_only=True)
class CheckOptions(MonitorOptions, TriggerOptions):
    """What 'focalgradient doctor' checks on the screen.

    Parameters
    ----------
    seconds
        Duration of counting dropped frames, in seconds: 0.1 to 600.
    luminance
        Photometer measurements (CSV: level, red, green, blue, grey in cd/m2): fitted, plotted as FILE-fit.png, and
        stored for the experiments with --monitor.
    card
        Measure the screen's size with a bank card held against it.
    """

    seconds: Annotated[float, Quantity(words="seconds", least=0.1, most=600)] = 10.0
    luminance: File | None = None
    card: bool = False


@dataclass(kw_only=True)
class MeterOptions(MonitorOptions):
    """Options of the measurement with a photometer.

    Parameters
    ----------
    device
        Photometer and its port, such as LS100:/dev/ttyUSB0.
    """

    device: Annotated[str, "NAME:PORT"]


@dataclass(kw_only=True)
class RecordingOptions(MonitorOptions, TriggerOptions):
    """Options of programs that record a participant.

    Parameters
    ----------
    participant
        Label of the participant: letters and digits.
    session
        Label of the session, for participants with more than one.
    tracker
        Eye tracker: gazepoint, eyelink, pupil-core, tobii, or a JSON file with a tracker's ioHub settings, such as
        {"eyetracker.hw.tobii.EyeTracker": {...}} (default: ioHub's simulated tracker, which follows the mouse).
    photodiode
        Show a square in this lower corner that is white while a stimulus is shown, or inverted when focus changes.
    """

    participant: Label | None = None
    session: Label | None = None
    tracker: Name | None = None
    photodiode: Literal["left", "right"] | None = None


@dataclass(kw_only=True)
class FollowOptions(RecordingOptions):
    """Options of gaze-contingent focus.

    Parameters
    ----------
    series
        Folder written by 'focalgradient focus-series', or by 'focalgradient blur' with at least two foci.
    gaze
        Source of the gaze position.
    transition
        How focus changes: with the eye's time constant of 0.3 s, or at once.
    seconds
        Duration in s.
    data
        Folder of the data set.
    language
        Language of the texts: en, de, or a TOML file.
    """

    series: Folder
    gaze: Literal["mouse", "tracker"] = "mouse"
    transition: Literal["eye", "immediate"] = "eye"
    seconds: Annotated[float, Quantity(words="seconds", most=3600), "S"] = 60.0
    participant: Label = "pilot"
    data: Folder = Path("data")
    language: Name = "en"


@dataclass(kw_only=True)
class SessionOptions(RecordingOptions):
    """Options of an experiment's session.

    Parameters
    ----------
    participant
        Label of the participant: letters and digits (default: asked for on the screen).
    age
        Age, recorded in the table of participants.
    sex
        Sex, recorded in the table of participants.
    handedness
        Handedness, recorded in the table of participants.
    eye
        Viewing eye: left, right or both.
    data
        Folder of the data set (default: data; with --pilot: pilot).
    stimuli
        Folder of the pictures, written by 'focalgradient stimuli'.
    design
        Settings file of the design (default: those that --print-design writes).
    print_design
        Print the default settings file, as a template.
    print_words
        Print all texts shown on the screen in en or de, as a template.
    trials
        List of trials instead of the design's own (CSV, XLSX).
    consent
        Consent text, shown before everything else.
    resume
        Continue an interrupted session, with the design that it began with.
    pilot
        Make a short test run in a small window.
    uncalibrated
        Run although the screen's size and viewing distance are unknown.
    stereoscope
        Settings of a mirror stereoscope or two screens (TOML).
    box
        Response box whose buttons count as keys: serial:PORT[:BAUD] (one letter or digit per press), cedrus:PORT (XID)
        or gamepad; may be given more than once.
    pointer
        Allow responses by mouse or touch alone: pages and questions show buttons.
    box_keys
        Keys assigned to the buttons of the box, such as 1=left,2=right,3=space,4=return.
    gaze
        Source of gaze recorded during trials, instead of the design's.
    """

    age: Annotated[str, "YEARS"] | None = None
    sex: Word | None = None
    handedness: Word | None = None
    eye: Word | None = None
    data: Folder | None = None
    stimuli: Folder | None = None
    design: File | None = None
    print_design: bool = False
    print_words: Annotated[str, "LANGUAGE"] | None = None
    trials: File | None = None
    consent: File | None = None
    resume: bool = False
    pilot: bool = False
    uncalibrated: bool = False
    stereoscope: File | None = None
    box: Annotated[tuple[str, ...], "PORT"] = ()
    pointer: bool = False
    box_keys: Annotated[str, "LIST"] | None = None
    gaze: Literal["none", "mouse", "tracker"] | None = None

    @property
    def folder(self) -> Path:
        """Folder of the data set."""
        return self.data or Path("pilot" if self.pilot else "data")
