"""Gaze-contingent focus: a focus series, focused at the distance of the fixated point.

Gaze is recorded with an eye tracker (ioHub, extra gaze), or replaced by the mouse pointer. The distance at the gaze
position determines the focus of the series. The latency is measured from each gaze sample that changes the focus to the
first frame that shows it; the square of --photodiode is inverted at that frame.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import closing
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focalgradient.dataset import Files, Journal, begin_dataset
from focalgradient.dataset.bids import add_participant
from focalgradient.dataset.focus import Change, export_focus
from focalgradient.design.words import load_words
from focalgradient.display import Display
from focalgradient.errors import InputError, one_line
from focalgradient.files import printable
from focalgradient.lab.devices.trackers import tracker_settings
from focalgradient.lab.devices.triggers import Triggers, open_triggers
from focalgradient.lab.experiment import Again, Quit
from focalgradient.lab.forms import pages
from focalgradient.lab.gaze import Gaze, gaze_entry, open_gaze
from focalgradient.lab.options import FollowOptions
from focalgradient.lab.preparation import (
    ASSUMED_DISTANCE,
    ASSUMED_PITCH,
    WINDOW,
    gamma_shown,
    import_screen,
)
from focalgradient.lab.running import guard, uninterrupted
from focalgradient.live import TIME_CONSTANT, Focusing, FocusSeries, read_series
from focalgradient.options import parsed

if TYPE_CHECKING:
    from focalgradient.lab.screen import Screen

__all__ = ["run"]

AROUND_DEG = 0.25
"""Half-width in degrees of the region around the gaze over which the median depth is taken: about the error of a good
eye tracker.
"""


def _options(given: Sequence[str] | None, program: str | None) -> FollowOptions:
    words, name = (sys.argv[1:] if given is None else given), program or Path(sys.argv[0]).name
    options = parsed(FollowOptions, words, program=name, about=__doc__)
    if options.tracker is not None and options.gaze != "tracker":
        raise InputError("--tracker is given, but --gaze is mouse: give --gaze tracker too.")
    if options.windowed and options.gaze == "tracker":
        raise InputError(
            "--gaze tracker reports positions on the whole screen, which --windowed does not use: leave out --windowed."
        )
    return options


def run(given: Sequence[str] | None = None, *, program: str | None = None) -> int:
    """Show a focus series contingent on one participant's gaze.

    Parameters are as for `focalgradient.lab.run`.

    Returns
    -------
    int
        Exit code: 0 at the end, 1 if stopped earlier, 2 with one sentence on standard error if it cannot run.
    """
    try:
        options = _options(given, program)
        series = read_series(options.series)
        files = Files(options.data, "gazefocus", options.participant, options.session)
        kind, settings = tracker_settings(options.gaze, options.tracker)
        load_words(options.language)  # checked before a window opens
        module = import_screen()
        display = _display(options, module)
        size = WINDOW if options.windowed else display.size_px
        height, width = series.distance.shape
        if width > size[0] or height > size[1]:
            raise InputError(
                f"the series has {width} x {height} pixels, but the window has {size[0]} x {size[1]}: make it smaller, "
                "or leave out --windowed."
            )
        about = _about(options, series, kind)
        with (
            closing(open_triggers(options)) as triggers,
            closing(_begin(files, options, about)) as journal,
        ):
            return _window(module, options, display, series, (kind, settings), triggers, journal)
    except InputError as error:
        print(f"Error: {one_line(error)}", file=sys.stderr)
        return 2


def _display(options: FollowOptions, module: Any) -> Display:
    size = module.screen_size(options.screen)
    if options.monitor is None:
        return Display(size, ASSUMED_PITCH, ASSUMED_DISTANCE)
    found = module.calibration_of(options.monitor)
    if not (found.width and found.distance):
        raise InputError(
            f"the monitor {options.monitor!r} has no width or no viewing distance: enter them in PsychoPy's Monitor "
            "Center."
        )
    return Display(size, found.width / size[0], found.distance, gamma_shown(found) or "sRGB")


def _about(options: FollowOptions, series: FocusSeries, kind: str) -> dict[str, Any]:
    """Return the settings and software versions of the session."""
    return {
        "task": "gazefocus",
        "participant": options.participant,
        "session": options.session,
        "series": printable(options.series),
        "focus_dioptre": series.vergences,
        "gaze": kind,
        "language": options.language,
        "transition": options.transition,
        "time_constant_s": TIME_CONSTANT if options.transition == "eye" else 0.0,
        "versions": {name: version(name) for name in ("focalgradient", "psychopy")},
    }


def _begin(files: Files, options: FollowOptions, about: dict[str, Any]) -> Journal:
    """Create the data set if necessary, and the journal of this session."""
    begin_dataset(options.data, "human")
    path = files.journal.with_name(files.journal.name.replace("_beh.", "_events."))
    head = {"event": "begun", **about}
    try:
        journal = Journal.begin(path, head, durable=False)  # waiting for the disk would drop frames
    except FileExistsError as error:
        raise InputError(f"{printable(path)} is there already: give another --participant or --session.") from error
    add_participant(options.data, options.participant, {"kind": "human"})
    return journal


def _window(
    module: Any,
    options: FollowOptions,
    display: Display,
    series: FocusSeries,
    tracker: tuple[str, dict[str, Any]],
    triggers: Triggers,
    journal: Journal,
) -> int:
    size, words = WINDOW if options.windowed else None, load_words(options.language)
    screen = module.Screen(options.screen, size, display, patch=options.photodiode, words=words)
    screen.stop_question = "gaze_focus.stop"  # the session cannot be resumed
    start = screen.now()
    gaze: Gaze | None = None

    said: set[str] = set()

    def listen(name: str, time: float) -> None:
        journal.write({"event": "note", "kind": name, "time": time - start})
        for port in triggers.ports:
            send = partial(triggers.send, port, name, time, time - start, None)
            if failed := guard(port.name, send, said):
                journal.write({"event": "note", "kind": "failure", "what": port.name, "error": failed})

    screen.on_event = listen
    try:
        gaze = open_gaze(screen, tracker)
        gaze.calibrate()
        _note_gaze(journal, screen, gaze, series, calibrated=options.monitor is not None)
        view = screen.refocused(series)
        screen.warm(view)
        uninterrupted(lambda: pages(screen, [words("gaze_focus.instructions")], "ready"))
        _follow(screen, gaze, series, view, options, journal, start)
        screen.on_event("end", screen.now())
    except Quit:
        return 1
    finally:
        if gaze is not None:
            gaze.close()
        screen.close()
        export_focus(journal.path)
    return 0


def _note_gaze(journal: Journal, screen: Screen, gaze: Gaze, series: FocusSeries, *, calibrated: bool) -> None:
    """Write the gaze source and the picture's position to the journal first, so that they survive a crash."""
    height, width = series.distance.shape
    display = screen.display
    journal.write(
        {
            "event": "note",
            "kind": "eye tracker",
            **gaze_entry(screen, gaze),
            "picture_px": (width, height),
            "screen_m": [side * display.pixel_pitch for side in screen.size] if calibrated else None,
            "viewing_distance_m": display.distance if calibrated else None,
            "refresh_hz": screen.refresh_hz,
            "frame_s": screen.frame_s,
            **gaze.about(),
        }
    )


def _follow(
    screen: Screen,
    gaze: Gaze,
    series: FocusSeries,
    view: Any,
    options: FollowOptions,
    journal: Journal,
    start: float,
) -> None:
    """Show frames for the set duration, each at the focus that the gaze requires."""
    height, width = series.distance.shape
    # Picture centre in the window: offset by half a pixel where one side is odd and the other even.
    middle = [(side - own) % 2 / 2 for side, own in zip(screen.size, (width, height), strict=True)]
    around = AROUND_DEG * screen.display.pixels_per_degree
    focusing = Focusing(series.vergences, options.transition)
    kept = _Samples(journal)
    lit, onset, before = True, None, None
    while onset is None or screen.now() < onset + options.seconds:
        found = gaze.sample()
        pending = None
        if found is not None:
            x, y = found.x - middle[0] + width / 2, height / 2 - (found.y - middle[1])
            kept.add(found.time - start, x, y)
            vergence = series.vergence_at(x, y, around)
            if vergence is not None and (focusing.look(series.nearest(vergence)) or onset is None):
                pending = (found, x, y, vergence)
                lit = not lit
        view.focus = focusing.step(screen.frame_s)
        view.draw()
        flip = screen.frame(lit)
        if onset is None:
            onset = flip
            screen.on_event("picture", onset)
        elif before is not None:
            screen.dropped += max(round((flip - before) / screen.frame_s) - 1, 0)
        before = flip
        if pending is not None:
            sample, x, y, vergence = pending
            change = Change(
                onset=flip - start,
                focus_dioptre=series.vergences[focusing.target],
                gaze_x=x,
                gaze_y=y,
                gaze_dioptre=vergence,
                latency_ms=1e3 * (flip - sample.time),
                latency_frames=(flip - sample.time) / screen.frame_s,
            )
            journal.write({"event": "note", "kind": "focus", **change._asdict()})
            screen.on_event("focus", flip)
        try:
            screen.stop_if_asked(screen.keys.events())
        except Again:
            before = None
        except Quit:
            kept.write(screen.dropped)
            raise
    kept.write(screen.dropped)
    screen.on_event("off", screen.blank())


class _Samples:
    """Buffer of gaze samples, written to the journal about once per second: time (s), x and y in the picture (px)."""

    def __init__(self, journal: Journal):
        self._journal = journal
        self._found: list[tuple[float, float, float]] = []

    def add(self, time: float, x: float, y: float) -> None:
        self._found.append((time, x, y))
        if len(self._found) >= 60:
            self.write()

    def write(self, dropped: int | None = None) -> None:
        about = {} if dropped is None else {"dropped_frames": dropped}
        self._journal.write({"event": "note", "kind": "gaze", "samples": self._found, **about})
        self._found = []
