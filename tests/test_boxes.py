"""Response boxes: what they send becomes keys, at the time at which it came."""

from __future__ import annotations

import os
import sys
import time
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from focalgradient.errors import InputError
from focalgradient.lab.devices.boxes import Gamepad, check_keys, keys_of, open_boxes, xid_presses

PRESSES = st.lists(st.tuples(st.integers(0, 7), st.booleans(), st.integers(0, 2**32 - 1)), max_size=8)


def packet(button: int, down: bool, clock: int, port: int = 0) -> bytes:
    return b"k" + bytes([button << 5 | down << 4 | port]) + clock.to_bytes(4, "little")


@given(PRESSES, st.integers(1, 6))
def test_packets_are_read_however_they_are_cut(presses: list[tuple[int, bool, int]], piece: int) -> None:
    sent = b"".join(packet(*one) for one in presses)
    found, left = [], b""
    for at in range(0, len(sent), piece):
        more, left = xid_presses(left + sent[at : at + piece])
        found += more
    assert found == [(str(button + 1), down) for button, down, _ in presses]
    assert left == b""


def test_light_and_noise_are_no_buttons() -> None:
    assert xid_presses(packet(2, True, 5, port=3) + b"__" + packet(1, False, 6)) == ([("2", False)], b"")


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo terminals")
@pytest.mark.parametrize(
    ("kind", "sent", "expected"),
    [
        ("cedrus", packet(0, True, 1) + packet(0, False, 90), [("left", True), ("left", False)]),
        ("serial", b"3A\n", [("space", True), ("space", False), ("a", True), ("a", False)]),
    ],
)
def test_a_box_at_a_serial_port_is_timed_as_its_bytes_arrive(
    kind: str, sent: bytes, expected: list[tuple[str, bool]]
) -> None:
    pytest.importorskip("serial")
    device, port = os.openpty()
    (box,) = open_boxes([f"{kind}:{os.ttyname(port)}"], keys_of("1=left,3=space"))
    if kind == "cedrus":
        assert os.read(device, 9) == b"c10"
    before = time.monotonic()
    os.write(device, sent)
    found, deadline = box.events(), before + 10
    while len(found) < len(expected) and time.monotonic() < deadline:
        found += box.events()
    after = time.monotonic()
    box.close()
    assert [(press.key, press.down) for press in found] == expected
    assert all(before <= press.time <= after for press in found)
    os.close(device)
    os.close(port)


def test_a_gamepad_presses_buttons_and_arrows() -> None:
    device = SimpleNamespace(buttons=[False, False], x=0.0, y=0.0, hat_x=0, hat_y=0, close=lambda: None)
    pad = Gamepad(device, keys_of("1=return"))
    assert pad.events() == []
    device.buttons[0], device.x, device.hat_y = True, -0.9, 1
    assert [(one.key, one.down) for one in pad.events()] == [("return", True), ("left", True), ("up", True)]
    assert pad.events() == []
    device.x = 0.0
    assert [(one.key, one.down) for one in pad.events()] == [("left", False)]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("usb", "--box is 'usb', but must be serial:PORT, cedrus:PORT or gamepad"),
        ("cedrus", "--box is 'cedrus', but must be"),
        ("serial:/dev/no-such", "the response box at /dev/no-such cannot be opened"),
    ],
)
def test_a_box_that_is_not_there_is_refused(given: str, message: str) -> None:
    pytest.importorskip("serial")
    with pytest.raises(InputError) as error:
        open_boxes([given], {})
    assert message in str(error.value)


def test_buttons_must_stand_for_keys() -> None:
    with pytest.raises(InputError, match="must assign a key to each button"):
        keys_of("1:left")
    with pytest.raises(InputError, match="'lefft', but must name keys of a keyboard"):
        check_keys("1=lefft", {"left"})
