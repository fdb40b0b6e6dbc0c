"""Devices that set the optical distance of a display: focus-tunable lens, multiple focal planes, and a simulation.

Each has `set_focus(D)` and `settled()`. `Optotune` implements the protocol of Optotune's Lens Driver 4 and 4i (Lens
Driver Manual, 28.06.2019, section 5): commands end in a CRC-16 (polynomial 0xA001, initial value 0), low byte first.

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
"""Distance from the target in dioptres below which a simulated lens counts as settled: a fifth of the eye's depth of
focus (0.25 D).
"""

SETTLE_S = 0.025
"""Settling time in s of an electrically tunable lens after a step (Optotune, data sheet of the EL-16-40-TC)."""

BAUD = 115200
"""Serial rate of the Lens Driver 4 in bits per second, from its manual."""

RESPONSE_S = 1.0
"""Time limit in s for a response of the lens driver, which takes a few milliseconds."""


class FocusDevice(Protocol):
    """Protocol of a device that sets the vergence at which a display appears."""

    name: str
    range_d: tuple[float, float]
    """Smallest and largest focus, in dioptres."""

    def set_focus(self, focus_d: float) -> None:
        """Set the focus in dioptres, and return immediately.

        Raises
        ------
        InputError
            If the focus is outside `range_d`.
        """

    def settled(self) -> bool:
        """Return whether the focus has been reached."""

    def close(self) -> None:
        """Close the device."""


def _checked(device: FocusDevice, focus_d: float) -> float:
    check_number("focus_d", focus_d, "dioptres")
    least, most = device.range_d
    if not least <= focus_d <= most:
        raise InputError(f"focus_d is {focus_d:g}, but must be from {least:g} to {most:g} dioptres for {device.name}.")
    return float(focus_d)


class SimulatedLens:
    """Simulated tunable lens with a first-order step response.

    Parameters
    ----------
    time_constant
        Time constant of the response, in s.
    clock
        Function that returns the time in s.

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
        """Current focus, in dioptres."""
        return self._target + (self._from - self._target) * math.exp((self._began - self._clock()) / self._constant)

    def set_focus(self, focus_d: float) -> None:
        """Set the target focus, in dioptres."""
        target = _checked(self, focus_d)
        self._from, self._target, self._began = self.focus_d, target, self._clock()

    def settled(self) -> bool:
        """Return whether the focus is within 0.05 dioptres of its target."""
        return abs(self.focus_d - self._target) <= SETTLED_D

    def close(self) -> None:
        """Do nothing."""


class Planes:
    """Multiplane display: planes or screens at several distances, of which the one nearest to the focus is shown.

    Parameters
    ----------
    vergences
        Vergences of the planes, in dioptres.

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
            raise InputError("vergences is empty, but must have at least one vergence in dioptres: give one.")
        self.vergences = tuple(float(one) for one in vergences)
        self.range_d = (min(self.vergences), max(self.vergences))
        self.plane = 0

    def set_focus(self, focus_d: float) -> None:
        """Select the plane nearest to a focus in dioptres."""
        focus_d = _checked(self, focus_d)
        self.plane = min(range(len(self.vergences)), key=lambda number: abs(self.vergences[number] - focus_d))

    def settled(self) -> bool:
        """Return True: planes are switched instantly."""
        return True

    def close(self) -> None:
        """Do nothing."""


def crc16(content: bytes) -> int:
    """Return the CRC-16 of a command (polynomial 0xA001, initial value 0; manual of the Lens Driver 4).

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
    """Lens on an Optotune Lens Driver 4 or 4i, in controlled focal power mode.

    Parameters
    ----------
    port
        Serial port, such as "/dev/ttyACM0" or "COM4".

    Raises
    ------
    InputError
        If the port cannot be opened, or no lens driver responds as specified in its manual.
    """

    name = "the Optotune lens"

    def __init__(self, port: str):
        check_installed("a lens driver at a serial port", "devices", "serial")
        import serial

        remedy = "check that this is the lens driver's port, that it has power, and that no other program uses it"
        try:
            self._port: Any = serial.Serial(port, BAUD, timeout=RESPONSE_S, write_timeout=RESPONSE_S)
        except (OSError, ValueError) as error:
            raise InputError(f"the lens driver's port {port} cannot be opened ({error}): {remedy}.") from error
        try:
            self._port.reset_input_buffer()
            self._port.write(b"Start")
            if (said := self._port.readline()) != b"Ready\r\n":
                raise InputError(
                    f"the device at {port} answers {said[:20]!r}, but a lens driver answers Ready: {remedy}."
                )
            self.range_d = self._controlled(port)
        except OSError as error:
            self._port.close()
            raise InputError(f"the lens driver at {port} does not respond ({error}): {remedy}.") from error
        except InputError:
            self._port.close()
            raise
        self._until = 0.0

    def _send(self, command: bytes) -> None:
        self._port.write(command + struct.pack("<H", crc16(command)))

    def _controlled(self, port: str) -> tuple[float, float]:
        """Switch to controlled focal power mode; return its range in dioptres."""
        self._send(b"MwCA")
        said = self._port.read(12)  # "MCA", status, two limits, CRC, line end
        if len(said) != 12 or said[:3] != b"MCA" or struct.unpack("<H", said[8:10])[0] != crc16(said[:8]):
            raise InputError(
                f"the lens driver at {port} does not switch to controlled focal power mode ({said!r}): connect a lens "
                "with a temperature sensor and stored calibration."
            )
        least, most = sorted(value / 200 - 5 for value in struct.unpack(">hh", said[4:8]))
        return least, most

    def set_focus(self, focus_d: float) -> None:
        """Set the focal power, in dioptres."""
        coded = round((_checked(self, focus_d) + 5) * 200)
        try:
            self._send(b"PwDA" + struct.pack(">hxx", coded))
        except OSError as error:
            raise InputError(f"the lens driver no longer accepts commands ({error}): check its cable.") from error
        self._until = time.monotonic() + SETTLE_S

    def settled(self) -> bool:
        """Return whether the nominal settling time has passed; the driver does not measure settling."""
        return time.monotonic() >= self._until

    def close(self) -> None:
        """Close the port."""
        self._port.close()


def open_lens(given: str) -> FocusDevice:
    """Open a focus device by its specification: ``simulated``, ``optotune:PORT`` or ``planes:D,D,...``.

    Raises
    ------
    InputError
        If the specification is invalid, or the device does not respond.

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
            raise InputError(
                f"planes is {place!r}, but must list vergences in dioptres, such as planes:0.5,1,2."
            ) from error
    raise InputError(
        f"the lens is {given!r}, but must be simulated, optotune:PORT or planes:D,D,...: give one of them."
    )
