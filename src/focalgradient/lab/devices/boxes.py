"""Response boxes whose buttons act as keys: serial port, Cedrus (XID protocol) or gamepad.

A separate thread time-stamps the bytes of a serial port as they arrive.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, Protocol

from focalgradient.dataset import Press
from focalgradient.errors import InputError, check_installed

__all__ = ["Box", "Gamepad", "check_keys", "keys_of", "open_boxes", "open_gamepad", "xid_presses"]

BAUD = 115200
"""Default rate of a serial port, in bits per second; Cedrus boxes use this rate."""

AXIS_THRESHOLD = 0.5
"""Deflection beyond which a gamepad stick counts as pressed, as a fraction of its full range."""


Reader = Callable[[bytes], tuple[list[tuple[str, bool]], bytes]]
"""Parser of bytes from a box: returns pairs of button and whether it was pressed, and the bytes not yet parsed."""

SIDES = (("x", "left", "right"), ("hat_x", "left", "right"), ("y", "up", "down"), ("hat_y", "down", "up"))
"""Axes of a gamepad by pyglet's names, with the keys for negative and positive deflection."""


class Box(Protocol):
    """Protocol of a response box."""

    def events(self) -> list[Press]:
        """Return presses and releases since the last call; times are on the monotonic clock, in s."""

    def close(self) -> None:
        """Close the device."""


def xid_presses(content: bytes) -> tuple[list[tuple[str, bool]], bytes]:
    """Parse packets of a Cedrus box: pairs of button (from "1") and whether it was pressed, and the bytes left over.

    A packet has six bytes: the letter k; a byte with the button (bits 5 to 7), whether it was pressed (bit 4) and the
    port (bits 0 to 3); and the box's own time in 4 bytes (Cedrus, XID protocol).

    >>> xid_presses(b"k" + bytes([0b01010000, 10, 0, 0, 0]) + b"k")
    ([('3', True)], b'k')
    """
    found = []
    while (at := content.find(b"k")) >= 0 and len(content) >= at + 6:
        state = content[at + 1]
        if not state & 0x0F:  # port 0 has the buttons; other ports are light and sound sensors
            found.append((str((state >> 5) + 1), bool(state & 0x10)))
        content = content[at + 6 :]
    return found, content[at:] if at >= 0 else b""


def _letters(content: bytes) -> tuple[list[tuple[str, bool]], bytes]:
    """Parse bytes of a box that sends one letter or digit per press, and nothing on release."""
    letters = [letter for letter in content.decode("ascii", "replace").lower() if letter.isalnum()]
    return [(letter, down) for letter in letters for down in (True, False)], b""


class _Serial:
    """Response box at a serial port."""

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
            except (OSError, TypeError):  # the device was unplugged or closed
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
    """Gamepad, polled once per frame: buttons are named from "1", stick and directional pad act as arrow keys."""

    def __init__(self, device: Any, keys: Mapping[str, str]):
        self._device, self._keys = device, keys
        self._down: set[str] = set()

    def _now(self) -> Iterator[str]:
        device = self._device
        yield from (str(number) for number, down in enumerate(device.buttons, start=1) if down)
        for axis, low, high in SIDES:
            value = getattr(device, axis, None) or 0.0
            if abs(value) > AXIS_THRESHOLD:
                yield low if value < 0 else high

    def events(self) -> list[Press]:
        """Return presses and releases since the last call."""
        now, at = {*self._now()}, time.monotonic()
        found = [Press(at, self._keys.get(name, name), False) for name in sorted(self._down - now)]
        found += [Press(at, self._keys.get(name, name), True) for name in sorted(now - self._down)]
        self._down = now
        return found

    def close(self) -> None:
        """Close the gamepad."""
        self._device.close()


def keys_of(given: str | None) -> dict[str, str]:
    """Parse the value of --box-keys into keys by button.

    Raises
    ------
    InputError
        If an entry is not of the form button=key.

    Examples
    --------
    >>> keys_of("1=left,2=right")
    {'1': 'left', '2': 'right'}
    """
    pairs = [one.strip().partition("=") for one in (given or "").split(",") if one.strip()]
    if any(not (button and sign and key) for button, sign, key in pairs):
        raise InputError(f"--box-keys is {given!r}, but must assign a key to each button, such as 1=left,2=right.")
    return {button: key for button, _, key in pairs}


def open_boxes(given: Sequence[str], keys: Mapping[str, str]) -> list[Box]:
    """Open the serial and Cedrus boxes given with --box; `open_gamepad` opens gamepads, which need a window.

    Raises
    ------
    InputError
        If the kind of a box is unknown, or it cannot be opened.
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
            port.write(b"c10")  # select the XID protocol, whatever the box's switches select
    except (OSError, ValueError) as error:
        raise InputError(
            f"the response box at {path or place} cannot be opened ({error}): plug it in, join the group dialout on "
            "Linux, or give another --box."
        ) from error
    return _Serial(port, xid_presses if cedrus else _letters, keys)


def open_gamepad(window: Any, keys: Mapping[str, str]) -> Box:
    """Open the first gamepad; `window` is a PsychoPy window.

    Raises
    ------
    InputError
        If no gamepad is connected.
    """
    import pyglet.input

    found = pyglet.input.get_joysticks()
    if not found:
        raise InputError("no gamepad was found: plug one in, or leave out --box gamepad.")
    found[0].open(window.winHandle)
    return Gamepad(found[0], keys)


def check_keys(given: str | None, known: set[str]) -> dict[str, str]:
    """Parse the value of --box-keys; raise `InputError` for keys outside `known`."""
    keys = keys_of(given)
    if wrong := [key for key in keys.values() if key not in known]:
        raise InputError(
            f"--box-keys has the key {wrong[0]!r}, but must name keys of a keyboard, such as left, space or return."
        )
    return keys
