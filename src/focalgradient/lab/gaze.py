"""Gaze from an eye tracker supported by ioHub, or from the mouse pointer instead, and its recording by trial."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from focalgradient.dataset.gaze import Sample as Kept
from focalgradient.dataset.gaze import Shown, away
from focalgradient.errors import InputError, one_line
from focalgradient.lab.devices.trackers import SIMULATED, check_answers
from focalgradient.tasks.columns import AWAY_ABOUT
from focalgradient.tasks.noted import Noted

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["WITHIN_DEG", "Gaze", "Recorder", "Sample", "Taken", "gaze_entry", "open_gaze"]

WITHIN_DEG = 2.0
"""Distance in degrees beyond which gaze has left the object to be fixated, in designs that state none."""


class Sample(NamedTuple):
    """One gaze sample: position in px from the window's centre (x right, y up), time in s on the screen's clock.

    `x` is NaN if no eye was found; `pupil` is in the tracker's units.
    """

    x: float
    y: float
    time: float
    pupil: float | None = None


class Gaze(Protocol):
    """Protocol of a gaze source."""

    name: str

    def sample(self) -> Sample | None:
        """Return the newest sample; None if the eyes were not found."""

    def samples(self) -> list[Sample]:
        """Return all samples since the last call, in order of time."""

    def about(self) -> dict[str, Any]:
        """Return metadata of the recording: sampling rate, eye, software."""

    def calibrate(self) -> None:
        """Run the tracker's own calibration procedure."""

    def close(self) -> None:
        """Stop recording and close the device."""


class _Mouse:
    """Mouse pointer as a substitute for gaze, sampled once per frame."""

    name = "mouse"

    def __init__(self, screen: Screen):
        self._screen = screen

    def sample(self) -> Sample | None:
        if not self._screen.window.mouseVisible:
            self._screen.window.mouseVisible = True
        x, y = self._screen.mouse.getPos()
        return Sample(float(x), float(y), self._screen.now())

    def samples(self) -> list[Sample]:
        found = self.sample()
        return [] if found is None else [found]

    def about(self) -> dict[str, Any]:
        return {}

    def calibrate(self) -> None:
        pass

    def close(self) -> None:
        self._screen.window.mouseVisible = False


class _Tracker:
    """Eye tracker supported by ioHub, with its own time stamp of each sample."""

    def __init__(self, screen: Screen, kind: str, settings: dict[str, Any]):
        from psychopy.iohub import launchHubServer

        self.name, self._screen, self._settings = kind, screen, settings
        width, height = (1e3 * screen.display.pixel_pitch * side for side in screen.display.size_px)
        where = {
            "physical_dimensions": {"width": width, "height": height, "unit_type": "mm"},
            "default_eye_distance": {"surface_center": 1e3 * screen.display.distance, "unit_type": "mm"},
            # Without a unit, ioHub reports every position as 0.
            "reporting_unit_type": "pix",
            "device_number": screen.window.screen,
        }
        try:
            with _quiet():
                self._hub = launchHubServer(
                    window=screen.window,
                    Display=where,
                    udp_port=_free_port(),
                    **{kind: {"name": "tracker", **settings}},
                )
        except Exception as error:
            raise InputError(
                f"the eye tracker {kind} cannot be started ({one_line(error)}): see the settings of --tracker."
            ) from error
        device: Any = getattr(self._hub.devices, "tracker", None)
        try:
            check_answers(kind, device)
        except InputError:
            self._hub.quit()
            raise
        self._tracker: Any = device
        self._tracker.setRecordingState(True)

    def calibrate(self) -> None:
        if self.name == SIMULATED:
            return
        self._tracker.setRecordingState(False)
        self._tracker.runSetupProcedure()
        self._tracker.setRecordingState(True)

    def _here(self, time: float) -> float:
        """Convert a time on ioHub's clock to the screen's clock."""
        return self._screen.now() - (float(self._hub.getTime()) - time)

    def sample(self) -> Sample | None:
        sample, place = self._tracker.getLastSample(), self._tracker.getLastGazePosition()
        # Some trackers return a number while they have no sample.
        if not isinstance(sample, list | tuple) or not isinstance(place, list | tuple):
            return None
        return Sample(float(place[0]), float(place[1]), self._here(sample[7]))  # the header's field "time"

    def samples(self) -> list[Sample]:
        # Fixations and saccades detected by the tracker also have a position and a status.
        found = [_averaged(event) for event in self._tracker.getEvents() if "Sample" in type(event).__name__]
        kept = [Sample(x, y, self._here(time), pupil) for time, x, y, pupil in found]
        return sorted(kept, key=lambda one: one.time)

    def about(self) -> dict[str, Any]:
        runtime = self._settings.get("runtime_settings", {})
        eyes = str(runtime.get("track_eyes", ""))
        eye = {"LEFT_EYE": "left", "RIGHT_EYE": "right"}.get(eyes, "cyclopean")
        return {"sampling_rate": runtime.get("sampling_rate"), "eye": eye, "calibrated": self.name != SIMULATED}

    def close(self) -> None:
        self._tracker.setRecordingState(False)
        self._hub.quit()


def _free_port() -> int:
    """Return a free UDP port: on ioHub's fixed one, two sessions on one computer would take each other's samples."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("", 0))
        return int(found.getsockname()[1])


@contextmanager
def _quiet() -> Iterator[None]:
    """Suppress output of ioHub and its process, including tracebacks, so that only our own message is printed."""
    sys.stdout.flush()
    sys.stderr.flush()
    with open(os.devnull, "wb") as nowhere:
        kept = [os.dup(stream) for stream in (1, 2)]
        try:
            for stream in (1, 2):
                os.dup2(nowhere.fileno(), stream)
            yield
        finally:
            for stream, own in zip((1, 2), kept, strict=True):
                os.dup2(own, stream)
                os.close(own)


def _averaged(event: Any) -> tuple[float, float, float, float | None]:
    """Return time, position and pupil size of an ioHub sample, averaged over the eyes that were found.

    The status of a monocular sample is 2 if the eye was lost; of a binocular one, the tens digit is 2 if the left eye
    was lost, and the units digit is 2 if the right eye was.
    """
    nan = float("nan")
    if hasattr(event, "gaze_x"):
        lost = event.status == 2
        return event.time, *((nan, nan, None) if lost else (event.gaze_x, event.gaze_y, _size(event.pupil_measure1)))
    eyes = [name for name, lost in (("left", event.status // 10), ("right", event.status % 10)) if lost != 2]
    if not eyes:
        return event.time, nan, nan, None
    x, y, pupil = (
        sum(float(getattr(event, f"{eye}_{field}")) for eye in eyes) / len(eyes)
        for field in ("gaze_x", "gaze_y", "pupil_measure1")
    )
    return event.time, x, y, _size(pupil)


def _size(pupil: float) -> float | None:
    return float(pupil) if pupil > 0 else None


def open_gaze(screen: Screen, tracker: tuple[str, dict[str, Any]]) -> Gaze:
    """Start recording gaze from the mouse or an eye tracker.

    Raises
    ------
    InputError
        If the eye tracker does not respond.
    """
    kind, settings = tracker
    return _Mouse(screen) if kind == "mouse" else _Tracker(screen, kind, settings)


def gaze_entry(screen: Screen, gaze: Gaze) -> dict[str, Any]:
    """Return the entry of a gaze source for a journal's note."""
    software, degree = f"psychopy {version('psychopy')}", screen.display.pixels_per_degree
    return {"name": gaze.name, "software": software, "pixels_per_degree": degree, "window_px": screen.size}


class Taken(NamedTuple):
    """Gaze of one trial: samples in the format of the data set, and distance from the object in degrees.

    `marked` is False if the trial had no object to be fixated.
    """

    samples: Sequence[Kept]
    away: float | None
    marked: bool = True

    def noted(self, within_deg: float) -> dict[str, Noted]:
        """Return the values recorded with the answer; empty if the trial had no object to be fixated."""
        if not self.marked:
            return {}
        left = self.away is None or self.away > within_deg
        about = f"Whether gaze_away exceeds {within_deg:g} degrees, or is missing."
        return {"gaze_away": Noted(self.away, "deg", AWAY_ABOUT), "gaze_left": Noted(left, description=about)}


class Recorder:
    """Recorder of gaze samples during trials.

    Parameters
    ----------
    screen
        Window; samples are fetched after each of its frames.
    gaze
        Source of the samples.
    start
        Start of the sitting, in s on the screen's clock.
    """

    def __init__(self, screen: Screen, gaze: Gaze, start: float):
        self.gaze = gaze
        self._screen, self._start = screen, start
        self._samples: list[Kept] = []
        self._shown: list[Shown] = []

    def begin(self) -> None:
        """Begin a trial, and discard earlier samples."""
        self.gaze.samples()
        self._samples, self._shown = [], []
        self._screen.after_frame = self._fetch

    def _fetch(self) -> None:
        width, height = self._screen.size
        for x, y, time, pupil in self.gaze.samples():
            at = round(time - self._start, 6)
            if x != x:
                self._samples.append(Kept(at, None, None))
            else:
                self._samples.append(Kept(at, round(width / 2 + x, 2), round(height / 2 - y, 2), pupil))

    def shown(self, start: float, end: float, place: tuple[float, float]) -> None:
        """Record a picture's display interval (s) and its object's position (px from the centre, y up)."""
        width, height = self._screen.size
        self._shown.append(Shown(start - self._start, end - self._start, width / 2 + place[0], height / 2 - place[1]))

    def end(self) -> Taken:
        """End a trial; return its gaze."""
        self._fetch()
        self._screen.after_frame = lambda: None
        samples = sorted(self._samples, key=lambda one: one.time)
        farthest = away(samples, self._shown, self._screen.display.pixels_per_degree)
        return Taken(samples, farthest, bool(self._shown))
