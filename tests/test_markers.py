"""Markers: codes by name and condition, the ports that they are sent to, and the table of events that BIDS has."""

from __future__ import annotations

import json
import os
import sys
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from focalgradient.dataset import Apparatus, Rated, Session, bids_problems, repair, validate
from focalgradient.dataset.markers import MARKERS, Codes, read_codes
from focalgradient.design import DepthRatingDesign
from focalgradient.errors import InputError
from focalgradient.lab.devices.triggers import HEADER, open_triggers
from focalgradient.lab.options import TriggerOptions

CODES = """
pulse_ms = 20
[codes]
picture = 64
flash = {code = 100, about = "A flash beside the picture.", hed = "Sensory-event, Visual-presentation"}

[[condition]]
code = 111
aperture = "pinhole"
"""


def codes(folder: Path, text: str = CODES) -> Path:
    (folder / "codes.toml").write_text(text)
    return folder / "codes.toml"


def test_codes_of_earlier_recordings_keep_their_meaning() -> None:
    assert [marker.code for marker in MARKERS.values()] == [*range(1, 19), *range(20, 26), 30, 40, 41, 50, 51, 52, 60]


def test_codes_follow_name_and_condition(tmp_path: Path) -> None:
    found = read_codes(codes(tmp_path))
    assert found.of("picture") == found.of("picture", {"aperture": "f/22"}) == 64
    assert found.of("picture", {"aperture": "pinhole", "trial": 3}) == 111
    assert (found.of("flash"), found.of("mask"), found.pulse_ms) == (100, MARKERS["mask"].code, 20)
    assert Codes.recorded(json.loads(json.dumps(found.entry()))).of("picture", {"aperture": "pinhole"}) == 111
    with pytest.raises(InputError, match="'never' has no code: add it"):
        found.of("never")
    least = read_codes(codes(tmp_path, CODES.replace("[codes]", "[codes]\nsitting = 65").replace("111", "1")))
    assert least.of("picture", {"aperture": "pinhole"}) == 1


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[codes]\npicture = 256", "codes: picture: code is 256, but must be a whole number from 1 to 255"),
        ("[codes]\nflash = 15", "mask and flash share the code 15: give each its own"),
        ("[[condition]]\nevent = 'x'\ncode = 90\na = 1", "'x', which has no code"),
        ("[codes]\nflash = {code = 100, tags = 'x'}", "codes: flash: tags is not a known key: use code, about, hed"),
        ("[[condition]]\ncode = 90", "a condition of 'picture' names no level"),
        ("[codes", "codes.toml"),
    ],
)
def test_wrong_codes_are_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        read_codes(codes(tmp_path, text))
    assert message in str(error.value)


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo terminals")
def test_a_serial_port_and_a_file_get_every_code_and_the_pulse_ends(tmp_path: Path) -> None:
    pytest.importorskip("serial")
    device, port = os.openpty()
    codes_of = {"sitting": 1, "picture": 111}
    given = [f"serial:{os.ttyname(port)}:9600", f"file:{tmp_path / 'markers.tsv'}"]
    for _ in range(2):  # a session that is resumed goes on in the same file
        triggers = open_triggers(TriggerOptions(triggers=tuple(given), codes=codes(tmp_path)))
        for seconds, name, trial in ((1.5, "sitting", None), (2.25, "picture", {"aperture": "pinhole", "trial": 3})):
            for one in triggers.ports:
                triggers.send(one, name, time.monotonic(), seconds, trial)
            assert os.read(device, 1) + os.read(device, 1) == bytes([codes_of[name], 0])  # waits for the pulse's end
        triggers.close()
        assert os.read(device, 1) == b"\0"
    lines = (tmp_path / "markers.tsv").read_text().splitlines()
    assert lines[0] == HEADER
    assert lines[1:3] == lines[3:]
    assert lines[1:3] == ["1.500000\t1\tsitting\tn/a", '2.250000\t111\tpicture\t{"aperture": "pinhole", "trial": 3}']
    os.close(device)
    os.close(port)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Linux's driver")
def test_a_parallel_port_gets_code_and_zero_by_the_requests_of_its_driver(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import fcntl

    asked: list[tuple[int, bytes]] = []
    monkeypatch.setattr(fcntl, "ioctl", lambda port, request, data=b"": asked.append((request, data)))
    (tmp_path / "parport0").touch()
    triggers = open_triggers(TriggerOptions(triggers=(f"parallel:{tmp_path / 'parport0'}",)))
    triggers.send(triggers.ports[0], "picture", time.monotonic(), 1.0, None)
    deadline = time.monotonic() + 10
    while len(asked) < 3 and time.monotonic() < deadline:
        time.sleep(0.005)
    triggers.close()
    # PPCLAIM, PPWDATA, PPRELEASE of linux/ppdev.h: _IO('p', 0x8b), _IOW('p', 0x86, unsigned char), _IO('p', 0x8c)
    claim, write, release = ord("p") << 8 | 0x8B, 1 << 30 | 1 << 16 | ord("p") << 8 | 0x86, ord("p") << 8 | 0x8C
    assert asked == [(claim, b""), (write, b"\x0b"), (write, b"\x00"), (write, b"\x00"), (release, b"")]


def test_a_stream_of_lsl_has_the_condition_and_the_time_of_the_event() -> None:
    pylsl = pytest.importorskip("pylsl")
    triggers = open_triggers(TriggerOptions(triggers=("lsl:fg-test",)))
    inlet = pylsl.StreamInlet(pylsl.resolve_byprop("name", "fg-test", timeout=10)[0])
    inlet.open_stream(timeout=10)
    at, clock = time.monotonic() - 0.5, pylsl.local_clock()
    triggers.send(triggers.ports[0], "picture", at, 1.0, {"aperture": "pinhole"})
    sample, stamp = inlet.pull_sample(timeout=10)
    assert json.loads(sample[0]) == {"code": 11, "name": "picture", "trial": {"aperture": "pinhole"}}
    assert stamp == pytest.approx(clock - 0.5, abs=0.1)
    triggers.close()


@pytest.mark.parametrize(
    ("port", "message"),
    [
        ("usb", "--triggers is 'usb', but must begin with parallel, serial, lsl, file"),
        ("file:here.txt", "here.txt exists and is not a marker file: give --triggers another file"),
        ("file:.", "is not a marker file"),
        ("serial", "names no port: give it"),
        (
            "parallel:/dev/no-such",
            "the parallel port /dev/no-such for triggers cannot be opened (No such file or directory)",
        ),
    ],
)
def test_a_port_that_is_not_there_is_refused_in_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, port: str, message: str
) -> None:
    if port.startswith("serial"):
        pytest.importorskip("serial")
    if port.startswith("parallel") and not sys.platform.startswith("linux"):
        pytest.skip("Linux's driver")
    monkeypatch.chdir(tmp_path)
    Path("here.txt").write_text("diary")
    with pytest.raises(InputError) as error:
        open_triggers(TriggerOptions(triggers=(port,)))
    assert message in str(error.value)
    assert Path("here.txt").read_text() == "diary"


@pytest.mark.parametrize(
    ("source", "given"),
    [
        ("code, name, seconds", (11, "picture", 1.0)),
        ("code, name, seconds, trial", (11, "picture", 1.0, {"a": 1})),
    ],
)
def test_a_function_of_one_s_own_gets_the_condition_where_it_takes_one(
    tmp_path: Path, source: str, given: tuple[object, ...]
) -> None:
    (tmp_path / "mine.py").write_text(f"got = []\ndef mark({source}): got.append(({source}))\n")
    triggers = open_triggers(TriggerOptions(markers=tmp_path / "mine.py"))
    triggers.send(triggers.ports[0], "picture", 0.0, 1.0, {"a": 1})
    assert triggers.ports[0]._function.__globals__["got"] == [given]


BEGAN = datetime(2026, 3, 1, 9, tzinfo=UTC)
DESIGN = DepthRatingDesign(
    scenes=("a",), apertures=("pinhole", "f/22"), repetitions=1, catch_trials=0, practice_trials=1, break_every=0
)


def recorded(root: Path, found: Codes, cut: int | None) -> Session:
    """A session, or its rest, whose pictures were marked: four events a trial, of which two are in it."""
    apparatus = Apparatus("seconds", (1024, 768), (0.5, 0.375), 0.57)
    try:
        session = Session.begin(root, DESIGN, "01", apparatus=apparatus, time=BEGAN)
    except InputError:
        session = Session.resume(root, "depthrating", "01", apparatus=apparatus, time=BEGAN + timedelta(hours=1))
    with session:
        session.note("triggers", ports=["serial"], **found.entry())
        for number, trial in enumerate(session.remaining()):
            if number == cut:
                break
            at = 10.0 * number
            events = [("break", at, 0.0), ("flash", at + 1, 0.0), ("picture", at + 2, 0.0), ("unknown", at + 3, 0.0)]
            shown = {"phase": trial.phase, "trial": trial.trial, "aperture": trial.aperture, "lure": None, "at": [1, 2]}
            about = {"phase": trial.phase, "trial": trial.trial, "condition": shown}
            session.note("events", **about, events=events, first=2, failures=[])
            session.record(trial, Rated(onset=at + 2, rating=1.0, response_time=1.0))
    return session


@pytest.fixture
def events(tmp_path: Path) -> Path:
    """The table of events of a session in two sittings, an hour apart."""
    found = read_codes(codes(tmp_path))
    recorded(tmp_path / "data", found, 2)
    recorded(tmp_path / "data", found, None)
    return tmp_path / "data/sub-01/beh/sub-01_task-depthrating_events.tsv"


def test_the_table_of_events_has_codes_conditions_and_times_of_one_clock(events: Path) -> None:
    names, *rows = (line.split("\t") for line in events.read_text().splitlines())
    table = [dict(zip(names, row, strict=True)) for row in rows]
    pictures = [row for row in table if row["trial_type"] == "picture"]
    assert len(pictures) == len(DESIGN.trials("01")) == len(table) / 4
    for number, (row, trial) in enumerate(zip(pictures, DESIGN.trials("01"), strict=True)):
        assert (row["aperture"], row["phase"], row["trial"]) == (trial.aperture, trial.phase, str(trial.trial))
        assert row["value"] == ("111" if trial.aperture == "pinhole" else "64")
        assert (row["lure"], row["at"]) == ("n/a", "[1, 2]")
        assert float(row["onset"]) == (10 * number + 2 if number < 2 else 3600 + 10 * (number - 2) + 2)
    assert {row["value"] for row in table if row["trial_type"] == "unknown"} == {"n/a"}
    assert {row["trial"] for row in table if row["trial_type"] == "break"} == {"n/a"}
    assert [row["sitting"] for row in pictures] == ["1", "1", *["2"] * (len(pictures) - 2)]
    assert json.loads(events.with_suffix(".json").read_text())["trial_type"]["HED"]["flash"].startswith("Sensory-event")


@pytest.mark.slow
def test_a_table_of_events_is_valid_until_it_is_changed_and_once_it_is_repaired(events: Path, tmp_path: Path) -> None:
    assert validate(tmp_path / "data").problems == ()
    assert bids_problems(tmp_path / "data") == []  # which checks the HED tags
    events.write_text(events.read_text().replace("111", "112", 1))
    assert any(events.name in problem for problem in validate(tmp_path / "data").problems)
    assert repair(tmp_path / "data")
    assert validate(tmp_path / "data").problems == ()
