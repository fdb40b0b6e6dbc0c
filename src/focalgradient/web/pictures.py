"""Content of trials for the page: addresses of pictures and films, marks, durations, response control."""

from __future__ import annotations

import hashlib
import json
import os
import zlib
from collections import deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from focalgradient.design.words import Words
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.live import FocusSeries, packed, page_script, page_shaders
from focalgradient.scales import Control, Held, OwnControl
from focalgradient.stimuli import StimulusSet
from focalgradient.stimuli.sets import png_of
from focalgradient.tasks import Task
from focalgradient.tasks.steps import Look, Step, pauses, steps_of

__all__ = [
    "CONTENT",
    "FILM",
    "PNG",
    "REFOCUSING",
    "Described",
    "drawn",
    "form_of",
    "is_png",
    "own_session",
    "own_trial",
    "padded",
    "parts",
    "refocusing",
    "shown_sha256",
    "standard",
]

CONTENT = "content"
"""Key of a picture's file, bytes or function that makes them, in a trial's entry, where the page gets an address."""

PNG = b"\x89PNG"
"""First bytes of a picture's file."""

FILM = b"\0"
"""First byte of a film's file; that of a focus series is JSON."""

FILM_HZ = 60.0
"""Frames of a film per second, on displays of any refresh rate."""

END_BYTES = 12
"""Size of the last chunk of a PNG, and of an empty one."""

PNG_BYTES = 4096
"""Size in bytes of all that a PNG holds besides its pixels; their incompressible blocks take up to 1/256 more."""

SPACES = bytes(b" \n\t\r"[byte % 4] for byte in range(256))
"""Translation of random bytes to spaces, which readers of JSON ignore."""

MARK_DEG = 0.3
"""Radius of the fixation mark, in degrees on the pictures' display."""


def parts(entry: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the parts of a trial's entry that show a picture: its intervals, or the views of its knob."""
    shown = [*entry.get("intervals", ()), *entry.get("knob", {}).get("views", ())]
    return [part for part in shown if "look" not in part]


def standard(
    task: Task, design: Any, form: str, words: Words, display: Display, stimuli: StimulusSet | None
) -> dict[str, Any]:
    """Return the interval that shows the standard."""
    assert task.standard is not None
    made = partial(task.standard, design, form, display.pixels_per_degree, stimuli, words)
    return _intervals(made(), stimuli, "standard", lambda: _film(made().picture))[0]


REFOCUSING = "focus.js"
"""File name of the script with which the page refocuses pictures."""


def refocusing() -> bytes:
    """Return the source of the module with `FocusView` and its shaders, which windows and plugins also use."""
    return f"{page_script()}\nexport {{ FocusView }};\nexport const SHADERS = {json.dumps(page_shaders())};\n".encode()


def own_session(design: Any, display: Display) -> dict[str, Any]:
    """Return the settings that all trials of a described task share."""
    radius = MARK_DEG * display.pixels_per_degree
    pause, blank = pauses(design)
    return {"blank_s": blank, "pause_s": pause, "mark_radius_px": radius}


@dataclass(frozen=True, slots=True)
class Described:
    """Described trial, whose `key` identifies its picture."""

    key: tuple[Hashable, ...]
    task: Task = field(compare=False)
    design: Any = field(compare=False)
    trial: Any
    seed: int
    words: Words = field(compare=False)
    display: Display
    stimuli: Any = field(compare=False)

    @classmethod
    def of(
        cls, task: Task, design: Any, trial: Any, seed: int, words: Words, display: Display, stimuli: Any = None
    ) -> Described:
        """Return a trial of a design, with its texts, display and set of pictures."""
        key = (task.name, design.model_dump_json(), None if stimuli is None else stimuli.folder)
        return cls(key, task, design, trial, seed, words, display, stimuli)


class Drawn(NamedTuple):
    """What a trial shows: its duration, the names of its pictures, and the place of the first judged one."""

    seconds: float
    events: tuple[str, ...]
    judged: int


def _made(shown: Described) -> list[Step]:
    known = {"seed": shown.seed, "stimuli": shown.stimuli, "words": shown.words, "display": shown.display}
    known["refresh_hz"] = FILM_HZ
    return steps_of(shown.task, shown.design, shown.trial, shown.display.pixels_per_degree, **known)


_steps = lru_cache(maxsize=16)(_made)
"""Steps for the page; their films are not made."""


@dataclass(frozen=True, slots=True)
class _Film:
    """Film of a trial, which is made when its file is asked for."""

    shown: Described
    number: int

    def __call__(self) -> bytes:
        """Return its file."""
        return _film_of(self)

    def __deepcopy__(self, memo: object) -> _Film:
        """Return the same film: its content is never changed."""
        return self


_DIGESTS: dict[_Film, str] = {}
"""SHA-256 of the pixels of films whose files were made, until their trials are answered."""


@lru_cache(maxsize=16)
def _film_of(film: _Film) -> bytes:
    digest = hashlib.sha256()
    file = _film(_hashed(_made(film.shown)[film.number].picture, digest))
    _DIGESTS[film] = digest.hexdigest()
    return file


def _hashed(frames: Iterable[Any], digest: Any) -> Iterator[Any]:
    for pixels in frames:
        digest.update(pixels.tobytes())
        yield pixels


def _film(frames: Iterable[Any]) -> bytes:
    """Return the frames of a film, each a PNG after its number of bytes; 0 bytes end them."""
    files = [*map(png_of, frames), b""]
    return b"".join(len(file).to_bytes(4, "big") + file for file in files)


def padded(files: Sequence[bytes], least: int = 0) -> list[bytes]:
    """Return the files of a trial, filled up at random to one size in bytes, which tells nothing about their content.

    Pictures of one width and height get one size, that of their uncompressed colours; other files a power of two of
    `least` bytes or more.

    >>> films = padded([bytes(4), bytes(20)], least=40)
    >>> [len(film) for film in films], films[1][:20] == bytes(20)
    ([64, 64], True)
    """
    least = max(least, *(len(file) + END_BYTES for file in files))
    size = max(map(_uncompressed, files))
    if size < least:
        size = 1 << (least - 1).bit_length()
    return [_filled(file, size - len(file)) for file in files]


def _uncompressed(file: bytes) -> int:
    """Return the maximum size in bytes of an 8-bit PNG with a file's width and height; 0 for other files."""
    if not is_png(file):
        return 0
    wide, high = (int.from_bytes(file[at : at + 4], "big") for at in (16, 20))
    values = (1 + 3 * wide) * high
    return values + values // 256 + PNG_BYTES


def is_png(file: bytes) -> bool:
    """Return whether a file is a picture, not a film or a focus series."""
    return file.startswith(PNG)


def _filled(file: bytes, gap: int) -> bytes:
    if file.startswith(FILM):
        return file + os.urandom(gap)
    if not is_png(file):
        return file + os.urandom(gap).translate(SPACES)
    body = b"fiLl" + os.urandom(gap - END_BYTES)  # a chunk that readers of PNG ignore
    chunk = (len(body) - 4).to_bytes(4, "big") + body + zlib.crc32(body).to_bytes(4, "big")
    return file[:-END_BYTES] + chunk + file[-END_BYTES:]


@lru_cache(maxsize=20_000)  # ten times the maximum number of trials per participant
def drawn(shown: Described) -> Drawn:
    """Return what a described trial has shown."""
    steps = _steps(shown)
    seconds, events = sum(step.seconds for step in steps), tuple(step.event for step in steps)
    return Drawn(seconds, events, [step.judged for step in steps].index(True))


@lru_cache(maxsize=20_000)
def shown_sha256(shown: Described) -> str:
    """Return the SHA-256 of each picture and film of a described trial that no file holds, separated by spaces."""
    digests = dict[str, None]()
    for number, picture in enumerate(step.picture for step in _made(shown)):
        if isinstance(picture, Iterator | np.ndarray):
            frames = picture if isinstance(picture, Iterator) else [picture]
            digests[_DIGESTS.pop(_Film(shown, number), "") or _sha256(frames)] = None
    return " ".join(digests)


def _sha256(frames: Iterable[Any]) -> str:
    digest = hashlib.sha256()
    deque(_hashed(frames, digest), maxlen=0)
    return digest.hexdigest()


def own_trial(shown: Described) -> dict[str, Any]:
    """Return the stimuli of a described task's trial; the page calls all pictures alike."""
    if shown.task.adjusts:
        return _adjusted(shown.task, shown.design, shown.trial, shown.words, shown.display)
    drawn(shown)
    intervals = list[dict[str, Any]]()
    for number, step in enumerate(_steps(shown)):
        intervals += _intervals(step, shown.stimuli, "picture", _Film(shown, number))
    return {"intervals": intervals}


def form_of(control: Control | Held | OwnControl, words: Words) -> dict[str, Any]:
    """Return the description of a control for the page; raise `InputError` for one that the page cannot show."""
    if isinstance(control, Held):
        names = [words.key(key) for key in control.keys]
        return {"kind": "held", "keys": list(control.keys), "names": names, "labels": list(control.labels)}
    if isinstance(control, OwnControl):
        raise InputError("a question has a control of its own, which a browser cannot show: use one of Scale or Steps.")
    return control.form()


def _intervals(step: Step, stimuli: Any, event: str, film: Callable[[], bytes]) -> list[dict[str, Any]]:
    """Return a step as the page shows it: a picture or `film`, and its mask; or a look at the real world."""
    if isinstance(step.picture, Look):
        return [
            {"look": {"page": step.picture.page, "text": step.picture.text}, "seconds": step.seconds, "event": event}
        ]
    x, y = step.mark or (0.0, 0.0)
    mark = {"mark": {"x": x, "y": y}, "mark_seconds": step.mark_s, "mark_kept": step.mark_kept}
    content: bytes | Path | Callable[[], bytes]
    if isinstance(step.picture, Iterator):
        content, mark = film, {"film": FILM_HZ}
    else:
        made = isinstance(step.picture, np.ndarray)
        content = png_of(step.picture) if made else stimuli.folder / step.picture.png
    shown = [{CONTENT: content, "seconds": step.seconds, "event": event, **mark}]
    if step.mask is not None and step.mask_s:
        shown.append({CONTENT: png_of(step.mask), "seconds": step.mask_s, "event": "mask", "follows": True})
    return shown


def _adjusted(task: Task, design: Any, trial: Any, words: Words, display: Display) -> dict[str, Any]:
    """Return an adjustment trial's knob and focus series; of a view with a fixed focus, that picture alone."""
    assert task.adjustment is not None
    asked = task.adjustment(design, words, trial, display.pixels_per_degree)
    views = [{CONTENT: _packed(view.series, view.focus), "pos": list(view.pos)} for view in asked.views]
    names = ("least", "most", "question", "ratios")
    return {"knob": {"views": views, **{name: getattr(asked, name) for name in names}}}


@lru_cache(maxsize=64)
def _packed(series: FocusSeries, focus: float | None) -> bytes:
    if focus is not None:
        plane = np.asarray(series.at(focus), np.float16)
        series = FocusSeries((0.0,), (plane,), np.ones_like(series.distance), np.zeros((0, 2)))
    return json.dumps(packed(series)).encode()
