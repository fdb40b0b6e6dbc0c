"""Triggers: send event codes to a parallel or serial port, an LSL stream, a file, or a user-supplied function."""

from __future__ import annotations

import importlib.util
import inspect
import json
import os
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from focalgradient.dataset.markers import Codes, read_codes
from focalgradient.errors import InputError, check_installed
from focalgradient.files import printable
from focalgradient.lab.options import TriggerOptions

__all__ = ["PORTS", "Mark", "Port", "Triggers", "open_triggers", "read_hook"]

PARALLEL_PULSE_MS = 5.0
"""Pulse duration on a parallel port in ms: five samples of an amplifier at 1 kHz."""

BAUD = 115200
"""Default rate of a serial port in bits per second: that of most USB trigger boxes, which often ignore it."""

CLAIM, RELEASE, WRITE_DATA = 0x708B, 0x708C, 0x40017086
"""Request codes of Linux's parallel port driver (PPCLAIM, PPRELEASE and PPWDATA of linux/ppdev.h)."""

HEADER = "onset\tcode\tname\ttrial"
"""Header line of a marker file."""


class Mark(NamedTuple):
    """Event to be sent.

    `seconds` is its time from the start of the sitting, `at` its time on the monotonic clock; `trial` is the condition
    of its trial by name, with "phase" and "trial", or None between trials.
    """

    code: int
    name: str
    seconds: float
    trial: Mapping[str, Any] | None
    at: float


class Port(Protocol):
    """Protocol of a destination of event markers."""

    name: str

    def send(self, mark: Mark) -> None:
        """Send a marker, and return immediately."""

    def close(self) -> None:
        """Close the port."""


class _Bytes:
    """8-bit port that returns to 0 after each pulse."""

    def __init__(self, name: str, write: Callable[[int], object], give_back: Callable[[], object], pulse_ms: float):
        self.name, self._write, self._give_back, self._pulse = name, write, give_back, pulse_ms / 1e3
        self._lock, self._sent = threading.Lock(), 0

    def send(self, mark: Mark) -> None:
        with self._lock:
            self._sent += 1
            self._write(mark.code)
        if self._pulse:
            timer = threading.Timer(self._pulse, self._reset, (self._sent,))
            timer.daemon = True
            timer.start()

    def _reset(self, number: int) -> None:
        with self._lock, suppress(OSError):  # a disconnected port is reported by the next marker
            if number == self._sent:  # a later code has its own pulse
                self._write(0)

    def close(self) -> None:
        with self._lock:
            self._sent += 1
            if self._pulse:
                with suppress(OSError):
                    self._write(0)
            self._give_back()


def _parallel(address: str, codes: Codes) -> Port:
    pulse = PARALLEL_PULSE_MS if codes.pulse_ms is None else codes.pulse_ms
    if not sys.platform.startswith("linux"):
        return _inpout(address, pulse)
    import fcntl

    path = address or "/dev/parport0"
    try:
        port = os.open(path, os.O_RDWR)
        fcntl.ioctl(port, CLAIM)
    except OSError as error:
        raise InputError(
            f"the parallel port {path} for triggers cannot be opened ({error.strerror}): load its driver "
            "(sudo modprobe ppdev), join the group lp, or give another --triggers."
        ) from error

    def give_back() -> None:
        fcntl.ioctl(port, RELEASE)
        os.close(port)

    return _Bytes("parallel", lambda code: fcntl.ioctl(port, WRITE_DATA, bytes([code])), give_back, pulse)


def _inpout(address: str, pulse_ms: float) -> Port:
    """Open a parallel port through PsychoPy, which uses the driver inpout32 (Windows)."""
    try:
        from psychopy import parallel

        port = parallel.ParallelPort(int(address or "0x378", 16))
        port.setData(0)
    except Exception as error:
        raise InputError(
            f"the parallel port {address or '0x378'} cannot be opened ({error}): install the driver inpout32, give the "
            "address that the Device Manager shows (parallel:0x378), or give another --triggers."
        ) from error
    return _Bytes("parallel", port.setData, lambda: None, pulse_ms)


def _serial(address: str, codes: Codes) -> Port:
    check_installed("the serial port, where triggers go,", "devices", "serial")
    import serial

    path, _, baud = address.rpartition(":") if address.rpartition(":")[2].isdigit() else (address, "", "")
    if not path:
        raise InputError("--triggers serial names no port: give it, such as serial:/dev/ttyUSB0 or serial:COM3:115200.")
    try:
        port = serial.Serial(path, int(baud or BAUD), write_timeout=1.0)
    except (OSError, ValueError) as error:
        raise InputError(
            f"the serial port {path} for triggers cannot be opened ({error}): connect the device, join the "
            "group dialout on Linux, or give another --triggers."
        ) from error
    return _Bytes("serial", lambda code: port.write(bytes([code])), port.close, codes.pulse_ms or 0.0)


class _Stream:
    """LSL stream with one text channel: the marker as JSON, with the time of the event on LSL's clock."""

    name = "lsl"

    def __init__(self, lsl: Any, name: str):
        self._lsl = lsl
        info = lsl.StreamInfo(name, "Markers", 1, lsl.IRREGULAR_RATE, "string", f"focalgradient-{name}")
        self._outlet = lsl.StreamOutlet(info)

    def send(self, mark: Mark) -> None:
        sample = json.dumps({"code": mark.code, "name": mark.name, "trial": mark.trial})
        self._outlet.push_sample([sample], self._lsl.local_clock() - (time.monotonic() - mark.at))

    def close(self) -> None:
        del self._outlet


def _lsl(address: str, codes: Codes) -> Port:
    check_installed("Lab Streaming Layer, where triggers go,", "devices", "pylsl")
    try:
        import pylsl
    except (ImportError, OSError, RuntimeError) as error:  # liblsl is found when pylsl is imported
        raise InputError(
            f"Lab Streaming Layer cannot be used ({error}): install its library liblsl, or give another --triggers."
        ) from error
    return _Stream(pylsl, address or "focalgradient")


class _File:
    """Marker file: a table with one line per marker, flushed line by line."""

    name = "file"

    def __init__(self, path: Path):
        try:
            with path.open("r", encoding="utf-8") as file:
                known = file.readline().rstrip("\n") == HEADER
        except FileNotFoundError:
            known = None
        except (OSError, UnicodeDecodeError):
            known = False
        if known is False:
            raise InputError(f"{printable(path)} exists and is not a marker file: give --triggers another file.")
        try:
            self._file = path.open("a", encoding="utf-8", buffering=1)
            if known is None:
                self._file.write(f"{HEADER}\n")
        except OSError as error:
            raise InputError(
                f"{printable(path)} cannot be written ({error.strerror}): give --triggers another file."
            ) from error

    def send(self, mark: Mark) -> None:
        trial = "n/a" if mark.trial is None else json.dumps(mark.trial)
        self._file.write(f"{mark.seconds:.6f}\t{mark.code}\t{mark.name}\t{trial}\n")

    def close(self) -> None:
        self._file.close()


def _file(address: str, codes: Codes) -> Port:
    if not address:
        raise InputError("--triggers file names no file: give it, such as file:markers.tsv.")
    return _File(Path(address))


PORTS: Mapping[str, Callable[[str, Codes], Port]] = {
    "parallel": _parallel,
    "serial": _serial,
    "lsl": _lsl,
    "file": _file,
}
"""Function that opens each kind of port, given the text after the colon."""


class _Hook:
    """User-supplied function, called with the condition of the trial if it accepts that argument."""

    name = "mark() of --markers"

    def __init__(self, function: Callable[..., object]):
        self._function, self._trial = function, True
        try:
            inspect.signature(function).bind(0, "", 0.0, None)
        except TypeError:
            self._trial = False
        except ValueError:  # not a Python function: it is given everything
            pass

    def send(self, mark: Mark) -> None:
        given: tuple[Any, ...] = (mark.code, mark.name, mark.seconds)
        self._function(*given, *((mark.trial,) if self._trial else ()))

    def close(self) -> None:
        pass


class Triggers:
    """Open ports with the codes of the events."""

    def __init__(self, codes: Codes, ports: Sequence[Port]):
        self.codes, self.ports = codes, tuple(ports)

    def send(self, port: Port, name: str, at: float, seconds: float, trial: Mapping[str, Any] | None) -> None:
        """Send an event to a port, with the condition of its trial.

        Raises
        ------
        InputError
            If the event has no code.
        """
        port.send(Mark(self.codes.of(name, trial), name, seconds, trial, at))

    def close(self) -> None:
        """Close all ports."""
        for port in self.ports:
            with suppress(OSError):
                port.close()


def open_triggers(options: TriggerOptions) -> Triggers:
    """Open the ports given by the options.

    Raises
    ------
    InputError
        If a port cannot be opened or a file cannot be read; ports opened before are closed.
    """
    ports: list[Port] = []
    known = read_codes(options.codes)
    if hook := read_hook(options.markers):
        ports.append(_Hook(hook))
    try:
        for given in options.triggers:
            kind, _, address = given.partition(":")
            if kind not in PORTS:
                raise InputError(f"--triggers is {given!r}, but must begin with {', '.join(PORTS)}: give one of them.")
            ports.append(PORTS[kind](address, known))
    except InputError:
        Triggers(known, ports).close()
        raise
    return Triggers(known, ports)


def read_hook(path: Path | None) -> Callable[..., object] | None:
    """Load the function mark(code, name, seconds, trial) that is called at each event.

    Raises
    ------
    InputError
        If the file cannot be read or does not define that function.
    """
    if path is None:
        return None
    try:
        spec = importlib.util.spec_from_file_location("markers", path)
        if spec is None or spec.loader is None:
            raise ImportError("its name does not end in .py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        hook = module.mark
    except Exception as error:
        raise InputError(
            f"--markers {path} does not define a function mark(code, name, seconds, trial) ({error!r}): correct it."
        ) from error
    return hook
