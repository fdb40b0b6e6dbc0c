"""Eye trackers by name: PsychoPy's package for each, and the remedy if it is missing or does not respond.

PsychoPy's own messages appear in another process's output, or as tracebacks; here each becomes one sentence.
"""

from __future__ import annotations

import importlib.util
import socket
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from focalgradient.errors import InputError, check_installed
from focalgradient.files import printable, read_json

__all__ = ["SIMULATED", "TRACKERS", "Tracker", "check_answers", "tracker_settings"]

SIMULATED = "eyetracker.hw.mouse.EyeTracker"
"""ioHub's simulated eye tracker, which follows the mouse."""

RATE = 100
"""Sampling rate of the simulated tracker, in Hz."""

CONNECT_S = 2.0
"""Time limit in s for a connection to a tracker's program on this or a neighbouring computer."""


LINK_S = 20.0
"""Time limit in s for the EyeLink SDK's connection attempt; without a Host PC the attempt takes 3 s."""


@dataclass(frozen=True, slots=True)
class Tracker:
    """Properties of an eye tracker that PsychoPy supports.

    Parameters
    ----------
    iohub
        Class of the device in ioHub.
    needs
        Modules that must be installed.
    install
        How to install them.
    remedy
        Remedy if the tracker does not respond.
    address
        Default host and port of its program.
    place
        Keys that lead to "ip_address" and "port" in its settings.
    answers
        Function that tests whether it responds at a host and port; None if only ioHub can find out.
    """

    iohub: str
    needs: tuple[str, ...]
    install: str
    remedy: str
    address: tuple[str, int] = ("", 0)
    place: tuple[str, ...] = ()
    answers: Callable[[str, int], bool] | None = None


def _takes_connections(host: str, port: int) -> bool:
    """Return whether a program accepts TCP connections."""
    try:
        socket.create_connection((host, port), CONNECT_S).close()
    except (OSError, OverflowError):
        return False
    return True


def _links(host: str, port: int) -> bool:
    """Return whether an EyeLink responds; without one, PsychoPy's package would use a dummy mode that records nothing.

    The SDK is called in a separate process, because it keeps one connection per process.
    """
    program = "import sys, pylink; pylink.EyeLink(sys.argv[1]).close()"
    try:
        run = subprocess.run([sys.executable, "-c", program, host], capture_output=True, timeout=LINK_S)
    except subprocess.TimeoutExpired:
        return False
    return run.returncode == 0


TRACKERS: Mapping[str, Tracker] = {
    "gazepoint": Tracker(
        "eyetracker.hw.gazepoint.gp3.EyeTracker",
        ("psychopy_eyetracker_gazepoint",),
        "pip install 'focalgradient[gaze]'",
        "start Gazepoint Control on the computer at that address",
        ("127.0.0.1", 4242),
        ("network_settings",),
        _takes_connections,
    ),
    "eyelink": Tracker(
        "eyetracker.hw.sr_research.eyelink.EyeTracker",
        ("psychopy_eyetracker_sr_research", "pylink"),
        "pip install 'focalgradient[gaze]'",
        "switch the Host PC on, connect its cable, and give this computer's network card the address 100.1.1.2",
        ("100.1.1.1", 0),
        ("network_settings",),
        _links,
    ),
    "pupil-core": Tracker(
        "eyetracker.hw.pupil_labs.pupil_core.EyeTracker",
        ("psychopy_eyetracker_pupil_labs", "zmq", "msgpack"),
        "pip install --no-deps psychopy-eyetracker-pupil-labs (it asks for NumPy below 2 without need)",
        "start Pupil Capture with its plugin Network API on the computer at that address",
        ("127.0.0.1", 50020),
        ("runtime_settings", "pupil_remote"),
        _takes_connections,
    ),
    "tobii": Tracker(
        "eyetracker.hw.tobii.EyeTracker",
        ("psychopy_eyetracker_tobii", "tobii_research"),
        "pip install psychopy-eyetracker-tobii tobii_research, as soon as Tobii's SDK has a version for this Python "
        "(2.1.0 is for 3.10 alone)",
        "switch it on, connect it, and see that Tobii Pro Eye Tracker Manager finds it",
    ),
}
"""Supported eye trackers, by the names that ``--tracker`` accepts."""


def _known(iohub: str) -> Tracker | None:
    return next((one for one in TRACKERS.values() if one.iohub == iohub), None)


def tracker_settings(gaze: str, given: str | Path | None) -> tuple[str, dict[str, Any]]:
    """Return the eye tracker's class in ioHub and its settings; "mouse" for the mouse pointer.

    Parameters
    ----------
    gaze
        "mouse" or "tracker".
    given
        Name of a tracker, or a file with its settings; None: ioHub's simulated tracker.

    Raises
    ------
    InputError
        If ioHub or the tracker's package is not fully installed, or the file names no eye tracker.
    """
    if gaze == "mouse":
        return "mouse", {}
    if importlib.util.find_spec("psychopy") is not None:
        check_installed("ioHub, which reads eye trackers,", "gaze", "gevent", "astunparse", "esprima")
    if given is None:
        controls = {"move": ["CONTINUOUS"], "blink": ["LEFT_BUTTON", "RIGHT_BUTTON"], "saccade_threshold": 0.5}
        runtime = {"sampling_rate": RATE, "track_eyes": "RIGHT_EYE"}
        return SIMULATED, {"controls": controls, "runtime_settings": runtime}
    iohub, settings = (TRACKERS[str(given)].iohub, {}) if str(given) in TRACKERS else _read(Path(given))
    if (tracker := _known(iohub)) is not None:
        missing = [name for name in tracker.needs if importlib.util.find_spec(name) is None]
        if missing:
            raise InputError(
                f"the eye tracker {iohub} needs {' and '.join(missing)}, not installed here: {tracker.install}."
            )
        _check_connection(iohub, tracker, settings)
    return iohub, settings


def _read(path: Path) -> tuple[str, dict[str, Any]]:
    if not path.suffix and not path.exists():
        raise InputError(f"--tracker is {str(path)!r}, but must be {', '.join(TRACKERS)} or a JSON file: give one.")
    table = read_json(path, "the settings of an eye tracker")
    if not (isinstance(table, dict) and len(table) == 1 and isinstance(next(iter(table.values())), dict)):
        raise InputError(
            f"{printable(path)} must contain one eye tracker's name with its settings, such as "
            '{"eyetracker.hw.tobii.EyeTracker": {}}.'
        )
    return next(iter(table.items()))


def _check_connection(iohub: str, tracker: Tracker, settings: Mapping[str, Any]) -> None:
    """Raise `InputError` if the tracker does not respond at the address in its settings."""
    if tracker.answers is None:
        return
    stated: Any = settings
    for name in tracker.place:
        stated = stated.get(name, {}) if isinstance(stated, Mapping) else {}
    stated = {"ip_address": stated} if isinstance(stated, str) else stated if isinstance(stated, Mapping) else {}
    host, port = stated.get("ip_address", tracker.address[0]), stated.get("port", tracker.address[1])
    if not (isinstance(host, str) and type(port) is int):
        raise InputError(
            f"the eye tracker {iohub} has ip_address {host!r} and port {port!r}, but they must be a text and a whole "
            "number: correct them."
        )
    if not tracker.answers(host, port):
        where = f"{host}:{port}" if port else host
        raise InputError(
            f"the eye tracker {iohub} does not respond at {where}: {tracker.remedy}, or give its address in the file "
            "of --tracker."
        )


def check_answers(iohub: str, device: object) -> None:
    """Raise `InputError` if ioHub created the device without connecting to the tracker.

    Raises
    ------
    InputError
        With the remedy for this tracker.
    """
    try:
        answers = bool(device.isConnected())  # type: ignore[attr-defined]
    except Exception:  # a device that ioHub could not create has no methods
        answers = False
    if not (answers or iohub == SIMULATED):  # which connects to no device
        tracker = _known(iohub)
        remedy = (
            "check that it is switched on, and its settings in the file of --tracker"
            if tracker is None
            else tracker.remedy
        )
        raise InputError(f"the eye tracker {iohub} does not respond: {remedy}.")
