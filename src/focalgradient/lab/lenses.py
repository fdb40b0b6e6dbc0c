"""What sets the distance at which a display appears: a focus-tunable lens, planes at several distances, a simulation.

Each has `set_focus(D)` and `settled()`. The serial one speaks the protocol of Optotune's Lens Driver 4 and 4i (Lens
Driver Manual, 28.06.2019, section 5): commands end in a CRC-16 (polynomial 0xA001, from 0), low byte first.
"""

from __future__ import annotations

import math
import struct
import time
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from focalgradient.errors import InputError, check_installed, check_number

__all__ = ["FocusDevice", "Optotune", "Planes", "SimulatedLens", "crc16", "open_lens"]

SETTLED_D = 0.05
"""Dioptres within which a simulated lens counts as settled: a fifth of the eye's depth of focus (0.25 D)."""

SETTLE_S = 0.025
"""Seconds in which an electrically tunable lens settles after a step (Optotune, data sheet of the EL-16-40-TC)."""

BAUD = 115200
"""Bits a second of the Lens Driver 4, by its manual."""

ANSWER_S = 1.0
"""Seconds within which a lens driver answers; it takes some milliseconds."""


class FocusDevice(Protocol):
    """What sets the vergence at which a display appears."""

    name: str
    range_d: tuple[float, float]
    """Least and greatest focus, in dioptres."""

    def set_focus(self, focus_d: float) -> None:
        """Go to a focus, in dioptres, and return at once.

        Raises
        ------
        InputError
            If the focus is out of range.
        """

    def settled(self) -> bool:
        """Whether the focus has been reached."""

    def close(self) -> None:
        """Give the device back."""


def _checked(device: FocusDevice, focus_d: float) -> float:
    check_number("focus_d", focus_d, "dioptres")
    least, most = device.range_d
    if not least <= focus_d <= most:
        raise InputError(f"focus_d is {focus_d:g}, but must be from {least:g} to {most:g} dioptres for {device.name}.")
    return float(focus_d)


class SimulatedLens:
    """A lens that follows its target as a first-order response.

    Parameters
    ----------
    time_constant
        Of its response, in seconds.
    clock
        Gives the time in seconds.

    Examples
    --------
    >>> now = [0.0]
    >>> lens = SimulatedLens(0.1, clock=lambda: now[0])
    >>> lens.set_focus(2.0)
    >>> now[0] = 0.1
    >>> round(lens.focus_d, 3), lens.settled()
    (1.264, False)
    """

    name = "a simulated lens"
    range_d = (-10.0, 10.0)

    def __init__(self, time_constant: float = 0.01, clock: Callable[[], float] = time.monotonic):
        self._constant, self._clock = time_constant, clock
        self._from, self._target, self._began = 0.0, 0.0, -math.inf

    @property
    def focus_d(self) -> float:
        """The focus now, in dioptres."""
        return self._target + (self._from - self._target) * math.exp((self._began - self._clock()) / self._constant)

    def set_focus(self, focus_d: float) -> None:
        """Go to a focus, in dioptres."""
        target = _checked(self, focus_d)
        self._from, self._target, self._began = self.focus_d, target, self._clock()

    def settled(self) -> bool:
        """Whether the focus is within 0.05 dioptres of its target."""
        return abs(self.focus_d - self._target) <= SETTLED_D

    def close(self) -> None:
        """Do nothing."""


class Planes:
    """Planes or screens at several distances, of which the nearest to a focus is shown.

    Parameters
    ----------
    vergences
        Of the planes, in dioptres.

    Examples
    --------
    >>> planes = Planes([0.5, 1.5, 3.0])
    >>> planes.set_focus(1.2)
    >>> planes.plane, planes.settled()
    (1, True)
    """

    name = "the planes"

    def __init__(self, vergences: Sequence[float]):
        for one in vergences:
            check_number("a plane", one, "dioptres")
        if not vergences:
            raise InputError("planes must have at least one vergence, in dioptres, got none: give one.")
        self.vergences = tuple(float(one) for one in vergences)
        self.range_d = (min(self.vergences), max(self.vergences))
        self.plane = 0

    def set_focus(self, focus_d: float) -> None:
        """Choose the plane nearest to a focus, in dioptres."""
        focus_d = _checked(self, focus_d)
        self.plane = min(range(len(self.vergences)), key=lambda number: abs(self.vergences[number] - focus_d))

    def settled(self) -> bool:
        """Return True: the plane is chosen at once."""
        return True

    def close(self) -> None:
        """Do nothing."""


def crc16(content: bytes) -> int:
    """Return the CRC-16 of a command (polynomial 0xA001, from 0), as the Lens Driver 4's manual has it.

    >>> hex(crc16(bytes([0x50, 0x77, 0x44, 0x41, 0x07, 0xD0, 0x00, 0x00])))  # the manual's example: 5 dioptres
    '0xfd31'
    """
    found = 0
    for byte in content:
        found ^= byte
        for _ in range(8):
            found = (found >> 1) ^ 0xA001 if found & 1 else found >> 1
    return found


class Optotune:
    """A lens at an Optotune Lens Driver 4 or 4i, in its mode of controlled focal power.

    Parameters
    ----------
    port
        Serial port, as "/dev/ttyACM0" or "COM4".

    Raises
    ------
    InputError
        If the port cannot be opened, or no lens driver answers as its manual says.
    """

    name = "the Optotune lens"

    def __init__(self, port: str):
        check_installed("a lens driver at a serial port", "devices", "serial")
        import serial

        remedy = "see that it is the lens driver's port, that it has power, and that no other program uses it"
        try:
            self._port: Any = serial.Serial(port, BAUD, timeout=ANSWER_S, write_timeout=ANSWER_S)
        except (OSError, ValueError) as error:
            raise InputError(f"the lens driver's port {port} cannot be opened ({error}): {remedy}.") from error
        try:
            self._port.reset_input_buffer()
            self._port.write(b"Start")
            if (said := self._port.readline()) != b"Ready\r\n":
                raise InputError(f"at {port} no lens driver answers Ready, but {said[:20]!r}: {remedy}.")
            self.range_d = self._controlled(port)
        except OSError as error:
            self._port.close()
            raise InputError(f"the lens driver at {port} does not answer ({error}): {remedy}.") from error
        except InputError:
            self._port.close()
            raise
        self._until = 0.0

    def _send(self, command: bytes) -> None:
        self._port.write(command + struct.pack("<H", crc16(command)))

    def _controlled(self, port: str) -> tuple[float, float]:
        """Go over to controlled focal power: its range in dioptres."""
        self._send(b"MwCA")
        said = self._port.read(12)  # "MCA", status, two limits, CRC, line end
        if len(said) != 12 or said[:3] != b"MCA" or struct.unpack("<H", said[8:10])[0] != crc16(said[:8]):
            raise InputError(
                f"the lens driver at {port} does not go over to controlled focal power ({said!r}): it needs a lens "
                "with a temperature sensor and its calibration."
            )
        least, most = sorted(value / 200 - 5 for value in struct.unpack(">hh", said[4:8]))
        return least, most

    def set_focus(self, focus_d: float) -> None:
        """Go to a focal power, in dioptres."""
        coded = round((_checked(self, focus_d) + 5) * 200)
        try:
            self._send(b"PwDA" + struct.pack(">hxx", coded))
        except OSError as error:
            raise InputError(f"the lens driver does not take commands any more ({error}): see its cable.") from error
        self._until = time.monotonic() + SETTLE_S

    def settled(self) -> bool:
        """Whether the time in which such a lens settles is over; the driver does not measure it."""
        return time.monotonic() >= self._until

    def close(self) -> None:
        """Give the port back."""
        self._port.close()


def open_lens(given: str) -> FocusDevice:
    """Open a device by its name: ``simulated``, ``optotune:PORT``, or ``planes:D,D,...``.

    Raises
    ------
    InputError
        If there is no such device, or it does not answer.

    Examples
    --------
    >>> open_lens("planes:0.5,2").range_d
    (0.5, 2.0)
    """
    kind, _, place = given.partition(":")
    if kind == "simulated" and not place:
        return SimulatedLens()
    if kind == "optotune" and place:
        return Optotune(place)
    if kind == "planes":
        try:
            return Planes([float(one) for one in place.split(",")])
        except ValueError as error:
            raise InputError(f"planes are {place!r}, but must be vergences in dioptres, as planes:0.5,1,2.") from error
    raise InputError(
        f"the lens is {given!r}, but must be simulated, optotune:PORT or planes:D,D,...: give one of them."
    )
