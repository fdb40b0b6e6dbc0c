"""Response boxes whose buttons count as keys: at a serial port, Cedrus (XID), or a gamepad.

Bytes of a port are timed as they arrive, by a thread of their own.
"""

from __future__ import annotations

import argparse
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, Protocol

from focalgradient.dataset import Press
from focalgradient.errors import InputError, check_installed

__all__ = ["Box", "Gamepad", "add_boxes", "check_keys", "keys_of", "open_boxes", "open_gamepad", "xid_presses"]

BAUD = 115200
"""Bits a second of a serial port where none are given; Cedrus's boxes use it, too."""

AXIS = 0.5
"""Share of its way beyond which a stick counts as pressed to that side."""


Reader = Callable[[bytes], tuple[list[tuple[str, bool]], bytes]]
"""Reads what a box has sent: its buttons, each with whether it went down; and what is left."""

SIDES = (("x", "left", "right"), ("hat_x", "left", "right"), ("y", "up", "down"), ("hat_y", "down", "up"))
"""Axes of a gamepad as pyglet names them, each with the keys of its low and high side."""


class Box(Protocol):
    """What has buttons."""

    def events(self) -> list[Press]:
        """Return what was pressed and released since the last call; times of the monotonic clock."""

    def close(self) -> None:
        """Give the box back."""


def xid_presses(content: bytes) -> tuple[list[tuple[str, bool]], bytes]:
    """Read the packets of a Cedrus box: its buttons, from "1", each with whether it went down; and what is left.

    A packet has six bytes: the letter k; bits 5 to 7 the button, bit 4 whether it went down, bits 0 to 3 the port; and
    the box's own time (Cedrus, XID protocol).

    >>> xid_presses(b"k" + bytes([0b01010000, 10, 0, 0, 0]) + b"k")
    ([('3', True)], b'k')
    """
    found = []
    while (at := content.find(b"k")) >= 0 and len(content) >= at + 6:
        state = content[at + 1]
        if not state & 0x0F:  # port 0 has the buttons; others are light and sound
            found.append((str((state >> 5) + 1), bool(state & 0x10)))
        content = content[at + 6 :]
    return found, content[at:] if at >= 0 else b""


def _letters(content: bytes) -> tuple[list[tuple[str, bool]], bytes]:
    """Read a box that sends a letter or digit for each press, and nothing for releases."""
    letters = [letter for letter in content.decode("ascii", "replace").lower() if letter.isalnum()]
    return [(letter, down) for letter in letters for down in (True, False)], b""


class _Serial:
    """A box at a serial port."""

    def __init__(self, port: Any, read: Reader, keys: Mapping[str, str]):
        self._port, self._read, self._keys = port, read, keys
        self._found: list[Press] = []
        self._lock, self._open = threading.Lock(), True
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        left = b""
        while self._open:
            try:
                got = self._port.read(1)
            except (OSError, TypeError):  # it was pulled out, or closed
                return
            at = time.monotonic()
            presses, left = self._read(left + got)
            with self._lock:
                self._found += [Press(at, self._keys.get(name, name), down) for name, down in presses]

    def events(self) -> list[Press]:
        with self._lock:
            found, self._found = self._found, []
        return found

    def close(self) -> None:
        self._open = False
        self._thread.join(1.0)
        with suppress(OSError):
            self._port.close()


class Gamepad:
    """A gamepad, read when frames are drawn: buttons from "1", and its stick and cross as arrow keys."""

    def __init__(self, device: Any, keys: Mapping[str, str]):
        self._device, self._keys = device, keys
        self._down: set[str] = set()

    def _now(self) -> Iterator[str]:
        device = self._device
        yield from (str(number) for number, down in enumerate(device.buttons, start=1) if down)
        for axis, low, high in SIDES:
            value = getattr(device, axis, None) or 0.0
            if abs(value) > AXIS:
                yield low if value < 0 else high

    def events(self) -> list[Press]:
        """Return what was pressed and released since the last call."""
        now, at = {*self._now()}, time.monotonic()
        found = [Press(at, self._keys.get(name, name), False) for name in sorted(self._down - now)]
        found += [Press(at, self._keys.get(name, name), True) for name in sorted(now - self._down)]
        self._down = now
        return found

    def close(self) -> None:
        """Give the gamepad back."""
        self._device.close()


def add_boxes(add: Callable[..., object]) -> None:
    """Add --box and --box-keys to a command, whose parser's `add_argument` is given."""
    add(
        "--box",
        action="append",
        default=[],
        metavar="PORT",
        help="response box whose buttons count as keys: serial:PORT[:BAUD] (a letter or digit a press), cedrus:PORT "
        "(XID) or gamepad; may be given more than once",
    )
    add("--pointer", action="store_true", help="let mouse or touch be enough: pages and questions get buttons")
    add("--box-keys", metavar="LIST", help="keys that its buttons stand for, as 1=left,2=right,3=space,4=return")


def keys_of(given: str | None) -> dict[str, str]:
    """Read --box-keys.

    Raises
    ------
    InputError
        Unless it lists buttons with their keys.

    Examples
    --------
    >>> keys_of("1=left,2=right")
    {'1': 'left', '2': 'right'}
    """
    pairs = [one.strip().partition("=") for one in (given or "").split(",") if one.strip()]
    if any(not (button and sign and key) for button, sign, key in pairs):
        raise InputError(f"--box-keys is {given!r}, but must name buttons with their keys, as 1=left,2=right.")
    return {button: key for button, _, key in pairs}


def open_boxes(given: Sequence[str], keys: Mapping[str, str]) -> list[Box]:
    """Open the boxes at serial ports of the options of `add_boxes`; gamepads need a window (`open_gamepad`).

    Raises
    ------
    InputError
        If one is of no known kind, or cannot be opened.
    """
    found: list[Box] = []
    try:
        for one in given:
            kind, _, place = one.partition(":")
            if kind == "gamepad" and not place:
                continue
            if kind not in ("serial", "cedrus") or not place:
                raise InputError(
                    f"--box is {one!r}, but must be serial:PORT, cedrus:PORT or gamepad: give one of them."
                )
            found.append(_open(place, keys, cedrus=kind == "cedrus"))
    except InputError:
        for box in found:
            box.close()
        raise
    return found


def _open(place: str, keys: Mapping[str, str], *, cedrus: bool) -> Box:
    check_installed("a response box", "devices", "serial")
    import serial

    path, _, baud = place.rpartition(":") if place.rpartition(":")[2].isdigit() else (place, "", "")
    try:
        port = serial.Serial(path, int(baud or BAUD), timeout=0.1, write_timeout=1.0)
        if cedrus:
            port.reset_input_buffer()
            port.write(b"c10")  # the XID protocol, whatever its switches say
    except (OSError, ValueError) as error:
        raise InputError(
            f"the response box at {path or place} cannot be opened ({error}): plug it in, join the group dialout on "
            "Linux, or give another --box."
        ) from error
    return _Serial(port, xid_presses if cedrus else _letters, keys)


def open_gamepad(window: Any, keys: Mapping[str, str]) -> Box:
    """Open the first gamepad; `window` is PsychoPy's.

    Raises
    ------
    InputError
        If there is none.
    """
    import pyglet.input

    found = pyglet.input.get_joysticks()
    if not found:
        raise InputError("no gamepad was found: plug one in, or leave out --box gamepad.")
    found[0].open(window.winHandle)
    return Gamepad(found[0], keys)


def check_keys(options: argparse.Namespace, known: set[str]) -> dict[str, str]:
    """Read --box-keys of a command, and refuse keys that keyboards do not have."""
    keys = keys_of(options.box_keys)
    if wrong := [key for key in keys.values() if key not in known]:
        raise InputError(f"--box-keys has the key {wrong[0]!r}, which no keyboard has: give left, space, return, ...")
    return keys
