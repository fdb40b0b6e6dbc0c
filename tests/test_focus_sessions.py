"""Sessions of focus by gaze are checked as others are: a whole one is valid, each damage is found."""

import gzip
from pathlib import Path

import pytest

from focalgradient.dataset import Files, Journal, begin_dataset, repair, validate
from focalgradient.dataset.bids import add_participant
from focalgradient.dataset.focus import Change, export_focus


@pytest.fixture
def session(tmp_path: Path) -> tuple[Path, Path]:
    """Journal and table of a session with three changes of focus."""
    root = tmp_path / "data"
    begin_dataset(root, "human")
    add_participant(root, "01", {"kind": "human"})
    files = Files(root, "gazefocus", "01")
    place = files.journal.with_name(files.journal.name.replace("_beh.", "_events."))
    about = {"task": "gazefocus", "participant": "01", "session": None}
    waits = [20.123456 + n for n in range(3)]
    changes = [Change(1.0 + n, n / 2, 10.0 * n, 20.0, n / 2, ms, ms * 60 / 1e3) for n, ms in enumerate(waits)]
    with Journal.begin(place, {"event": "begun", **about}) as journal:
        tracker = {"name": "mouse", "pixels_per_degree": 40.0, "window_px": [1024, 768], "picture_px": [300, 201]}
        screen = {"refresh_hz": 60.0, "frame_s": 1 / 60}
        journal.write({"event": "note", "kind": "eye tracker", **tracker, **screen})
        journal.write({"event": "note", "kind": "ready", "time": 0.5})
        for change in changes:
            journal.write({"event": "note", "kind": "focus", **change._asdict()})
            journal.write({"event": "note", "kind": "focus", "time": change.onset})
        journal.write({"event": "note", "kind": "gaze", "samples": [[0.1, 1.0, 2.0]]})
    export_focus(place)
    found = validate(root)
    assert (found.problems, found.sessions) == ((), 1)
    return place, files.beside("events.tsv")


def problems(place: Path) -> str:
    return " ".join(validate(next(one.parent for one in place.parents if one.name == "sourcedata")).problems)


def test_a_table_that_was_changed_cut_or_lost_is_found(session: tuple[Path, Path]) -> None:
    place, table = session
    whole = table.read_text()
    table.write_text(whole.replace("20.1235", "10.1235", 1))
    assert "in row 2, where latency_ms is '10.1235', but '20.1235' in the journal" in problems(place)
    table.write_text("\n".join(whole.splitlines()[:-1]) + "\n")
    assert "it differs from its journal, as row 4 is missing" in problems(place)
    table.write_text("onset\n")
    assert "it differs from its journal" in problems(place)
    table.unlink()
    assert "the session crashed" in problems(place)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('"ms": 21.623', '"ms": 11.623', "Latency differs from the journal"),
        ('"TaskName"', '"Note": 1, "TaskName"', "Note is not in the journal: use 'focalgradient repair'"),
        ("{", "[{", "is not valid JSON"),
    ],
)
def test_a_sidecar_that_was_changed_is_found(session: tuple[Path, Path], old: str, new: str, sentence: str) -> None:
    place, table = session
    path = table.with_suffix(".json")
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    assert sentence in problems(place)
    path.write_text("[1]")
    assert "is not a JSON object: use 'focalgradient repair'" in problems(place)
    path.unlink()
    assert f"{path} is missing" in problems(place)


@pytest.mark.parametrize("torn", [False, True])
def test_a_session_that_was_killed_is_repaired_with_its_samples(session: tuple[Path, Path], torn: bool) -> None:
    place, table = session
    root = next(one.parent for one in place.parents if one.name == "sourcedata")
    whole = {path.name: path.read_bytes() for path in table.parent.iterdir()}
    assert any(name.endswith("recording-eye1_physio.tsv.gz") for name in whole)
    for path in list(table.parent.iterdir()):
        path.unlink()  # they are written at the end, which a kill does not reach
    (root / "participants.tsv").write_text("participant_id\tkind\n")
    if torn:
        place.write_bytes(place.read_bytes() + b'{"event": "note", "kind": "ga')
    assert validate(root).problems
    made = repair(root)
    assert [one.problem for one in made] == [""]
    assert validate(root).problems == ()
    assert {path.name: path.read_bytes() for path in table.parent.iterdir()} == whole
    assert repair(root) == []  # nothing is left to repair
    samples = gzip.decompress(next(table.parent.glob("*_physio.tsv.gz")).read_bytes()).decode().split()
    assert [float(one) for one in samples[:3]] == [0.1, 1 + (1024 - 300) / 2, 2 + (768 - 201 - 1) / 2]
