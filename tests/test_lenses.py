"""Lenses whose focus can be set: a simulated one, planes, and Optotune's protocol on a pseudo terminal."""

from __future__ import annotations

import os
import struct
import sys
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from focalgradient.errors import InputError
from focalgradient.lab import lenses
from focalgradient.lab.devices.lenses import Optotune, Planes, SimulatedLens, crc16, open_lens

EXAMPLE = bytes([0x50, 0x77, 0x44, 0x41, 0x07, 0xD0, 0x00, 0x00, 0x31, 0xFD])
"""The published example of the manual: 5 dioptres, with its CRC."""


def test_the_manual_s_example_and_an_independent_crc() -> None:
    assert struct.pack("<H", crc16(EXAMPLE[:8])) == EXAMPLE[8:]
    assert crc16(b"123456789") == 0xBB3D  # the check value of CRC-16/ARC in Greg Cook's catalogue


@given(st.lists(st.floats(-9, 9), min_size=1, max_size=5))
def test_a_simulated_lens_reaches_every_focus_and_never_beyond(steps: list[float]) -> None:
    now = [0.0]
    lens = SimulatedLens(0.1, clock=lambda: now[0])
    before = 0.0
    for step in steps:
        lens.set_focus(step)
        assert lens.focus_d == pytest.approx(before)
        now[0] += 0.05
        assert min(before, step) - 1e-9 <= lens.focus_d <= max(before, step) + 1e-9
        now[0] += 5.0
        assert lens.settled()
        assert lens.focus_d == pytest.approx(step, abs=1e-9)
        before = lens.focus_d


class Driver(threading.Thread):
    """A lens driver of -2 to 3 dioptres, which answers as its manual says."""

    def __init__(self, device: int, ready: bytes = b"Ready\r\n", damage: int = 0):
        super().__init__(daemon=True)
        self.device, self.ready, self.damage = device, ready, damage
        self.got = b""
        self.start()

    def run(self) -> None:
        while True:
            try:
                self.got += os.read(self.device, 99)
            except OSError:
                return
            if self.got == b"Start":
                os.write(self.device, self.ready)
                self.got = b""
            if self.got == b"MwCA" + struct.pack("<H", crc16(b"MwCA")):
                body = b"MCA\x00" + struct.pack(">hh", 1600, 600)
                os.write(self.device, body + struct.pack("<H", crc16(body) ^ self.damage) + b"\r\n")
                self.got = b""


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo terminals")
def test_a_lens_driver_is_spoken_to_as_its_manual_says() -> None:
    pytest.importorskip("serial")
    device, port = os.openpty()
    driver = Driver(device)
    lens = open_lens(f"optotune:{os.ttyname(port)}")
    assert lens.range_d == (-2.0, 3.0)
    with pytest.raises(InputError, match="focus_d is 5, but must be from -2 to 3 dioptres for the Optotune lens"):
        lens.set_focus(5.0)
    lens.range_d = (-2.0, 6.0)  # so that the manual's own example can be sent
    lens.set_focus(5.0)
    assert not lens.settled()
    while len(driver.got) < 10:
        pass
    assert driver.got == EXAMPLE
    while not lens.settled():
        pass
    lens.close()
    os.close(port)


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo terminals")
@pytest.mark.parametrize(
    ("ready", "damage", "message"),
    [
        (b"Hello\r\n", 0, "answers b'Hello"),
        (b"Ready\r\n", 1, "connect a lens with a temperature"),
    ],
)
def test_another_device_and_a_damaged_answer_are_refused(ready: bytes, damage: int, message: str) -> None:
    pytest.importorskip("serial")
    device, port = os.openpty()
    Driver(device, ready, damage)
    with pytest.raises(InputError, match=message):
        Optotune(os.ttyname(port))
    os.close(port)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("lens", "but must be simulated, optotune:PORT or planes"),
        ("optotune", "but must be simulated, optotune:PORT or planes"),
        ("planes:", "must list vergences in dioptres"),
        ("planes:nan", "must list vergences in dioptres"),
        ("optotune:/dev/no-such", "port /dev/no-such cannot be opened"),
    ],
)
def test_a_lens_that_is_none_is_refused(given: str, message: str) -> None:
    pytest.importorskip("serial")
    with pytest.raises(InputError) as error:
        open_lens(given)
    assert message in str(error.value)


@given(st.lists(st.floats(0, 5), min_size=1, max_size=6), st.floats(0, 1))
def test_of_several_planes_the_nearest_is_chosen(vergences: list[float], share: float) -> None:
    planes = Planes(vergences)
    focus = min(max(vergences), min(vergences) + share * (max(vergences) - min(vergences)))
    planes.set_focus(focus)
    assert abs(planes.vergences[planes.plane] - focus) == min(abs(one - focus) for one in vergences)


def test_the_former_name_warns_and_is_the_same() -> None:
    with pytest.warns(DeprecationWarning, match=r"is now focalgradient\.lab\.devices\.lenses; the old name goes in"):
        former = lenses.open_lens
    assert former is open_lens
