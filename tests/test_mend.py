"""Damaged sessions made readable, and participants removed: what is kept, what is left out, and that it is said."""

import errno
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from recorded import edit

from focalgradient.cli.program import Program
from focalgradient.cli.repair import repair as repair_command
from focalgradient.cli.validate import validate as validate_command
from focalgradient.cli.withdraw import withdraw as withdraw_command
from focalgradient.dataset import (
    VALIDATOR,
    Apparatus,
    Rated,
    Session,
    bids_problems,
    read_dataset,
    read_journal,
    repair,
    validate,
    withdraw,
)
from focalgradient.dataset import withdrawal as withdrawal_module
from focalgradient.dataset.journal import whole_lines
from focalgradient.design import Pinhole
from focalgradient.errors import InputError
from focalgradient.files import staged

DESIGN = Pinhole(scenes=["a"], repetitions=1)
APPARATUS = Apparatus("seconds from the start of the sitting")


def run(*args: object) -> Result:
    commands = [repair_command, withdraw_command, validate_command]
    return CliRunner().invoke(Program("focalgradient", commands=commands), list(map(str, args)))


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    root = tmp_path_factory.mktemp("made") / "data"
    for label in ("07", "08", "1"):
        with Session.begin(root, DESIGN, label, apparatus=APPARATUS, about={"age": 20 + int(label)}) as session:
            for number, trial in enumerate(session.remaining()):
                session.record(trial, Rated(onset=30.0 * number, rating=1 + number / 10, response_time=2.0))
    return root


@pytest.fixture
def data(made, tmp_path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "data"))


def journal(root: Path, label: str = "07") -> Path:
    return root / "sourcedata" / f"sub-{label}" / "beh" / f"sub-{label}_task-pinhole_beh.jsonl"


def table(root: Path, label: str = "07") -> Path:
    return root / f"sub-{label}" / "beh" / f"sub-{label}_task-pinhole_beh.tsv"


def lines_of(path: Path) -> list[bytes]:
    return path.read_bytes().splitlines(keepends=True)


def trials(root: Path, label: str = "07") -> list[int]:
    rows = read_dataset(root).pinhole
    return rows[rows["participant_id"] == f"sub-{label}"]["trial"].tolist()


def test_notes_about_a_trial_do_not_stand_for_it(tmp_path):
    """A laboratory's session notes the events of each trial before its answer."""
    with Session.begin(tmp_path / "data", DESIGN, "07", apparatus=APPARATUS) as session:
        for number, trial in enumerate(session.remaining()):
            session.note("events", phase=trial.phase, trial=trial.trial, events=[])
            session.record(trial, Rated(onset=30.0 * number, rating=1 + number / 10, response_time=2.0))
    before = table(tmp_path / "data").read_bytes()
    assert repair(tmp_path / "data") == []
    assert run("repair", tmp_path / "data").output == "Nothing needs repair.\n"
    assert validate(tmp_path / "data").problems == ()
    lines = lines_of(journal(tmp_path / "data"))
    journal(tmp_path / "data").write_bytes(b"".join([*lines[:4], b"not a line\n", *lines[4:]]))
    (mended,) = repair(tmp_path / "data")
    assert mended.done[0] == "Line 5, which cannot be used."
    assert len([one for one in mended.done if one.startswith("Line")]) == 1
    assert validate(tmp_path / "data").problems == ()
    assert table(tmp_path / "data").read_bytes() == before


def test_a_session_that_two_programs_doubled_is_repaired(data):
    events = [json.loads(line) for line in lines_of(journal(data))]
    for event in events:
        del event["chain"]
    journal(data).write_bytes(whole_lines([*events[:4], {**events[0], "event": "resumed"}, *events[3:]]))
    table(data).unlink()
    assert any("occurs more than once" in problem for problem in validate(data).problems)
    before = journal(data).read_bytes()
    result = run("repair", data)
    assert result.exit_code == 0
    assert "Line 6, main trial 3: it occurs more than once." in result.output
    kept = journal(data).with_name(journal(data).name + ".original")
    assert kept.read_bytes() == before
    assert trials(data) == [1, 2, 3, 4, 5, 6]
    assert validate(data).problems == ()
    assert any(re.search(r"was repaired on \d{4}-\d\d-\d\d: .*Line 6", note) for note in validate(data).notes)
    assert json.loads(table(data).with_suffix(".json").read_text())["Repaired"][0]["original"] == kept.name
    assert not bids_problems(data)
    assert repair(data) == []


def test_damaged_lines_are_left_out_and_the_rest_is_read(data):
    found = lines_of(journal(data))
    found[2] = found[2].replace(b'"onset"', b'"offset"')
    found[4] = found[4][:40] + b"\n"
    found[5] = found[5].replace(b'"rating": 1.4', b'"rating": 3.9')
    journal(data).write_bytes(b"".join(found))
    with pytest.raises(InputError, match="line 3: onset is missing"):
        read_journal(journal(data))
    (done,) = repair(data)
    assert done.done[:3] == (
        "Line 3, which cannot be used.",
        "Line 5, which cannot be used.",
        "Line 6, main trial 5, which was changed after it was written.",
    )
    ends = [path.name.rpartition("_beh")[2] for path in done.originals]
    assert ends == [".jsonl.original", ".json.original", ".tsv.original"]
    assert trials(data) == [1, 3, 6]
    said = read_journal(journal(data)).of("repaired")[0]["found"]
    assert len(said) >= 3
    assert all("line " in sentence and "restore" not in sentence for sentence in said), said
    assert [problem for problem in validate(data).problems if "sub-07" not in problem] == []
    assert any("3 of 6 trials of the design are missing" in problem for problem in validate(data).problems)


def test_a_table_changed_by_hand_is_made_anew_and_kept_and_one_cut_off_completed(data):
    whole = table(data).read_bytes()
    edit(table(data), 3, "rating", "2.0")
    changed = table(data).read_bytes()
    (done,) = repair(data)
    assert done.done == (f"{table(data).name} differed from the journal, and was written again.",)
    assert done.originals[0].read_bytes() == changed
    table(data).write_bytes(whole[:-1])
    assert any("differs from its journal" in problem for problem in validate(data).problems)
    (done,) = repair(data)
    assert (done.done, done.originals) == ((f"{table(data).name} was not complete, and was written again.",), ())
    assert table(data).read_bytes() == whole
    assert validate(data).problems == ()


def test_what_cannot_be_repaired_is_named_and_the_others_are_repaired(data):
    journal(data, "08").write_bytes(b"nothing\n")
    edit(table(data), 3, "rating", "2.0")
    with Session.begin(data, DESIGN, "20", apparatus=APPARATUS):
        result = run("repair", data)
    assert result.exit_code == 1
    assert "sub-08_task-pinhole_beh.jsonl does not start with the first line of a journal" in result.output
    assert "sub-20_task-pinhole_beh.jsonl is being recorded by another program" in result.output
    assert "Repaired: " in result.output


@pytest.mark.parametrize("command", [repair, lambda root: withdraw(root, "07")])
def test_what_a_killed_run_left_half_done_goes(data, command):
    with subprocess.Popen([sys.executable, "-c", "pass"]) as process:
        process.wait()
    with staged(data) as folder:
        mine = folder.name
    hidden = [
        place / re.sub(rf"-{os.getpid()}-", f"-{process.pid}-", mine) for place in (data, data / "sub-07" / "beh")
    ]
    for one in hidden:
        one.mkdir()
        (one / "participants.tsv").write_text("participant_id\tage\nsub-07\t31\n")
    command(data)
    assert not [one for one in hidden if one.exists()]


def test_who_withdraws_is_named_nowhere(data):
    edit(table(data), 3, "rating", "2.0")
    repair(data)
    (data / "phenotype").mkdir()
    (data / "phenotype" / "acuity.tsv").write_text("participant_id\tlogmar\nsub-07\t0.1\nsub-08\t0.0\n")
    (data / "phenotype" / "pairs.tsv").write_text("pair\tone\tother\n1\tsub-07\tsub-08\n2\tsub-08\tsub-09\n")
    (data / "derivatives" / "sub-07").mkdir(parents=True)
    (data / "derivatives" / "report.html").write_text("<td>sub-07</td>")
    (data / "derivatives" / "results of sub-07.tsv").write_text("rating\n1.2\n")
    others = {path: path.read_bytes() for path in data.rglob("sub-08*") if path.is_file()}
    result = run("withdraw", data, "sub-07")
    assert result.exit_code == 0, result.output
    assert result.output.endswith("sub-07 is withdrawn.\n")
    assert f"Still names sub-07: {data / 'derivatives' / 'report.html'}" in result.output
    copied = data / "derivatives" / "results of sub-07.tsv"
    assert f"Still names sub-07: {copied}: remove it, or make it again." in result.output
    (data / "derivatives" / "report.html").unlink()
    copied.unlink()
    assert not list(data.rglob("*sub-07*"))
    left = [path for path in data.rglob("*") if path.is_file() and b"sub-07" in path.read_bytes()]
    assert left == []
    assert json.loads((data / "dataset_description.json").read_text())["Withdrawn"] == [None]
    assert {path: path.read_bytes() for path in others} == others
    assert (data / "phenotype" / "acuity.tsv").read_text() == "participant_id\tlogmar\nsub-08\t0.0\n"
    found = validate(data)
    assert found.problems == ()
    assert "1 participant withdrew; the data were removed." in found.notes
    again = run("withdraw", data, "07")
    assert again.exit_code == 2
    assert "has no participant sub-07: give a label of participants.tsv" in again.output


def test_sub_1_is_not_sub_10_and_a_session_that_runs_is_not_removed(data):
    with Session.begin(data, DESIGN, "10", apparatus=APPARATUS):
        with pytest.raises(InputError, match="is being recorded by another program"):
            withdraw(data, "10")
        withdraw(data, "1")
    assert set(read_dataset(data).participants["participant_id"]) == {"sub-07", "sub-08", "sub-10"}
    assert journal(data, "10").exists()
    with pytest.raises(InputError, match=r"participant label is '\.\./07'"):
        withdraw(data, "../07")
    with pytest.raises(InputError, match="has no participant sub-99: give a label of participants"):
        withdraw(data, "99")


@pytest.mark.parametrize("cut_off_at", [1, 2, 3, 4, 5])
def test_a_repair_that_was_cut_off_ends_as_one_that_was_not(data, tmp_path, monkeypatch, cut_off_at):
    lines = lines_of(journal(data))
    journal(data).write_bytes(b"".join([*lines[:3], lines[3][:20] + b"\n", *lines[4:]]))
    edit(table(data, "08"), 2, "rating", "1.05")
    other = shutil.copytree(data, tmp_path / "other")
    repair(other)

    calls, move = iter(range(1, 100)), os.replace

    def killed(source, place, **more):
        if next(calls) == cut_off_at:
            raise KeyboardInterrupt
        move(source, place, **more)

    monkeypatch.setattr(os, "replace", killed)
    with pytest.raises(KeyboardInterrupt):
        repair(data)
    monkeypatch.setattr(os, "replace", move)
    repair(data)
    repair(data)
    said = [[one.replace(str(root), "") for one in validate(root).problems] for root in (data, other)]
    assert said[0] == said[1]
    files = [{path.relative_to(root): path for path in root.rglob("*") if path.is_file()} for root in (data, other)]
    assert files[0].keys() == files[1].keys()
    alike = [name for name in files[0] if name.suffix in (".tsv", ".original")]  # others hold the time of the repair
    assert alike
    for name in alike:
        assert files[0][name].read_bytes() == files[1][name].read_bytes(), name


def test_a_byte_order_mark_is_removed_from_a_journal(data):
    path = journal(data)
    whole = path.read_bytes()
    path.write_bytes(b"\xef\xbb\xbf" + whole)
    assert any("byte order mark" in problem for problem in validate(data).problems)
    (done,) = repair(data)
    assert not done.problem
    assert path.read_bytes().startswith(b"{")
    assert len(read_journal(path).of("trial")) == len(whole.split(b'"event": "trial"')) - 1
    assert not any("byte order mark" in problem for problem in validate(data).problems)
    assert repair(data) == []


def test_a_withdrawal_on_a_full_disk_is_completed_by_the_next(data, monkeypatch):
    with monkeypatch.context() as full:
        full.setattr(withdrawal_module, "create_whole", _refuse)
        result = run("withdraw", data, "sub-07", "--yes")
    assert result.exit_code == 2
    assert "make room on the disk" in str(result.output)
    assert "withdraw the participant again" in str(result.output)
    assert "resumed" not in str(result.output)
    assert run("withdraw", data, "sub-07", "--yes").exit_code == 0
    assert not journal(data).exists()


def _refuse(path, *_args, **_options):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))


@pytest.mark.skipif(sys.platform != "linux", reason="file names are bytes on Linux only")
def test_the_standard_is_checked_under_a_path_that_is_not_utf_8(data, tmp_path):
    if shutil.which(VALIDATOR, path=str(Path(sys.executable).parent)) is None:
        pytest.skip("bids-validator-deno is not installed")
    place = Path(os.fsdecode(os.fsencode(tmp_path) + b"/d\xff"))
    data.rename(place)
    assert bids_problems(place) == []
