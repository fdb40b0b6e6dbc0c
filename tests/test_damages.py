"""Damages made by hand to tables, journals, sidecars and participants, alone and together: none passes `validate`."""

import hashlib
import json
import re
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from damaging import (
    cell,
    drop_row,
    each,
    forged,
    head,
    journal,
    lines,
    manifest,
    noted,
    people,
    put,
    renamed,
    retold,
    sidecar,
    sitting_of,
    table,
    text,
    told,
)
from killing import DESIGNS, answer_of
from recorded import edit

from focalgradient.dataset import Apparatus, Press, Rated, Session, Watched, read_dataset, repair, validate
from focalgradient.dataset.alike import REMEDY
from focalgradient.design import DepthRatingDesign, NeckerDesign, Pinhole
from focalgradient.errors import InputError

APPARATUS = Apparatus("seconds from the start of the sitting", refresh_hz=60.0)
RATING = DepthRatingDesign(
    scenes=["a", "b"], apertures=["pinhole", "f/5.6"], repetitions=1, catch_trials=1, practice_trials=2
)
CUBE = NeckerDesign(strengths_mm=[4.0], practice_trials=1, trial_s=10.0, repetitions=1)
LOOKS = Pinhole(scenes=["a"], repetitions=1)


def file_of(scene: str, aperture: str, fixation: str) -> str:
    return f"{scene}/{aperture.replace('/', '')}-{fixation}.png"


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """Three raters, two who watched cubes, and one who took part in the demonstration."""
    pictures = tmp_path_factory.mktemp("pictures")
    entries = [
        {"scene": scene, "aperture": aperture, "fixation": end, "png": file_of(scene, aperture, end)}
        for scene in ("a", "b", "spheres-00")
        for aperture in ("pinhole", "f/5.6")
        for end in ("nearest", "farthest")
    ]
    for entry in entries:
        path = pictures / entry["png"]
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(entry["png"].encode())
    files = {entry["png"]: hashlib.sha256(entry["png"].encode()).hexdigest() for entry in entries}
    (pictures / "manifest.json").write_text(json.dumps({"files": files, "pictures": entries}))
    root = tmp_path_factory.mktemp("made") / "data"
    for label in ("01", "02", "03"):
        about = {"age": 30}
        with Session.begin(root, RATING, label, apparatus=APPARATUS, stimuli=pictures, about=about) as session:
            for number, trial in enumerate(session.remaining()):
                drawn = trial.scene.startswith("example-")
                shown = None if drawn else file_of(trial.scene, trial.aperture, trial.fixation)
                session.record(
                    trial, Rated(onset=20.0 * number, rating=1.25, response_time=1.5 + number / 8, stimulus=shown)
                )
    for label in ("01", "02"):
        with Session.begin(root, CUBE, label, apparatus=APPARATUS) as session:
            for number, trial in enumerate(session.remaining()):
                presses = [Press(1.0, "f", True), Press(4.0, "f", False), Press(4.5, "j", True)]
                session.record(trial, Watched(onset=60.0 * number, presses=presses, trial_duration=10.016))
    with Session.begin(root, LOOKS, "01", apparatus=APPARATUS) as session:
        for number, trial in enumerate(session.remaining()):
            session.record(trial, Rated(onset=30.0 * number, rating=1.0, response_time=2.0))
    return root


@pytest.fixture
def data(made, tmp_path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "data"))


DAMAGES = {
    # Tables alone.
    "rating changed": (cell(4, "rating", "2.0"), "differs from its journal"),
    "rating 0": (cell(4, "rating", "0"), r"row 4: rating is '0', but must be a number above 0"),
    "rating no number": (cell(4, "rating", "good"), "row 4: rating is 'good'"),
    "rating infinite": (cell(4, "rating", "inf"), "row 4: rating is 'inf'"),
    "rating missing": (cell(4, "rating", "n/a"), "row 4: rating is 'n/a'"),
    "trial too large a number": (cell(4, "trial", "1e300"), "row 4: trial is .1e300."),
    "time 0": (cell(4, "response_time", "0"), "in row 4, where response_time is '0', but "),
    "scene missing": (cell(4, "scene", "n/a"), "row 4: scene is 'n/a', but must be a text"),
    "trial doubled": (cell(4, "trial", "2"), "row 4: its trial is also in a row above"),
    "row lost": (drop_row, "in row 5, where trial is '5', but '4' in the journal"),
    "unknown picture": (cell(4, "stimulus", "dog.png"), r"its picture dog\.png is not in"),
    "frames below 0": (cell(4, "dropped_frames", "-1"), "row 4: dropped_frames is '-1'"),
    "half a frame": (cell(4, "dropped_frames", "0.5"), "row 4: .* a whole number of 0"),
    "unknown level": (cell(4, "fixation", "near"), "row 4: fixation is 'near', .* one of nearest"),
    "unknown aperture": (cell(4, "aperture", "f22"), "row 4: aperture is 'f22', but"),
    "no truth": (cell(4, "catch", "yes"), "row 4: catch is 'yes', but must be true or"),
    "cell gone": (
        lambda root: table(root).write_text(table(root).read_text().rpartition("\t")[0] + "\n"),
        r"row \d+: there are \d+ cells, but",
    ),
    "sidecar a list": (lambda root: sidecar(root).write_text("[]"), "beh.json does not contain the design"),
    "column lost": (cell(1, "rating", "score"), "the column rating is missing"),
    "not UTF-8": (lambda root: table(root).write_bytes(b"trial\trating\xff\n"), "is not text in UTF-8"),
    "table lost": (lambda root: table(root).unlink(), "has no table"),
    "percept changed": (cell(2, "percept", "both", "necker"), "differs from its journal"),
    # Journals alone.
    "line changed": (text(b'"rating": 1.25', b'"rating": 1.75'), "line 6 was changed after it was written"),
    "line lost": (lines(lambda found: found.pop(5)), "lines before line 6 are missing, or were changed or moved"),
    "line doubled": (lines(lambda found: found.insert(5, found[5])), "line 7, main trial 3: it occurs more than once"),
    "line torn": (text(b'"rating"', b"\n"), "line 6 is damaged, which a crash of the program does not explain"),
    "line without chain": (
        lines(lambda found: found.append(b'{"event": "note", "kind": "break"}\n')),
        "was added or changed after the session: it has no chain",
    ),
    "chain removed": (
        lambda root: (
            journal(root).write_bytes(re.sub(rb', "chain": \[[^]]*\]\}', b"}", journal(root).read_bytes())),
            retold(lambda told: told.pop("Journal"))(root),
        ),
        "line 1 was added or changed after the session: it has no chain",
    ),
    "end lost": (lines(lambda found: found.pop()), "differs from its journal"),
    "half a character": (text(b'"scene": "', b'"scene": "\\ud800'), "line 6 is damaged, which a crash of the program"),
    "phase lost": (text(b'"phase": "main", ', b""), "line 6: phase is missing, but must be practice or main"),
    "onset lost": (text(b'"onset"', b'"offset"'), "line 6: onset is missing, but must be a number of 0 or more"),
    "rating beyond floats": (text(b"1.25", b"9" * 400), "line 6: rating is 9+, but must be"),
    "presses lost": (text(b'"presses"', b'"pressed"', task="necker"), "line 6: presses is missing"),
    "presses of ratings": (
        text(b'"rating"', b'"presses": [[1]], "rating"'),
        "line 6: presses is .*, but must be absent in a trial in which no keys are held",
    ),
    "press damaged": (text(b"[1.0, ", b"[null, ", task="necker"), "line 6: presses has .None, .*, but must be a list"),
    "presses not in order": (text(b"[1.0, ", b"[8.0, ", task="necker"), "line 6: presses is .*, but must be a list"),
    "head of another": (text(b'"participant": "01"', b'"participant": "04"', 0), "belongs to a participant, session"),
    "head without design": (text(b'"design"', b'"plan"', 0), "line 1: design is missing"),
    "head lost": (lines(lambda found: found.pop(0)), "does not start with the first line of a journal"),
    "journal lost": (lambda root: journal(root).unlink(), "has no journal to compare it with: restore sourcedata"),
    "journal emptied": (lambda root: journal(root).write_bytes(b""), "does not start with the first line of a journal"),
    "journal of zeros": (lambda root: journal(root).write_bytes(bytes(900)), "does not start with the first line of"),
    "journal nested": (
        lines(lambda found: found.insert(3, b'{"event": ' + b"[" * 200_000 + b"\n")),
        "line 4 is damaged, which a crash",
    ),
    "journal copied": (
        lambda root: shutil.copy(journal(root), journal(root).with_name(f"{journal(root).stem} (1).jsonl")),
        "does not have the name of a journal: move it out of",
    ),
    "journal moved": (
        lambda root: journal(root).rename(root / "sourcedata" / journal(root).name),
        "is not in the folder that its name requires",
    ),
    # Sidecars alone.
    "another seed told": (told("Seed", 3), "Seed differs from the journal"),
    "another design told": (told("Design", RATING.model_dump(mode="json") | {"picture_s": 9.0}), "Design differs from"),
    "simulated or not": (told("Simulated", True), r"Simulated disagrees with dataset_description\.json: restore"),
    "a key added": (retold(lambda told: told.update(Note="x")), "Note is not in the journal: move it"),
    "keys added": (retold(lambda told: told.update(A=1, B=2)), "A, B are not in the journal"),
    "a key removed": (retold(lambda told: told.pop("Keys")), "Keys differs from the journal"),
    "a seed that is true": (told("Seed", True), "Seed differs from the journal"),
    "a level's words": (
        retold(lambda told: told["catch"].update(Levels={"true": "x"}), "depthrating"),
        "catch differs from the journal",
    ),
    "a design's number that is true": (
        retold(lambda told: told["Design"].update(repetitions=True)),
        "repetitions is true, but must be a whole number",
    ),
    "a key that stands twice": (
        lambda root: sidecar(root).write_text(sidecar(root).read_text().replace("{", '{"Seed": 3,', 1)),
        "the key 'Seed' occurs twice",
    ),
    "sidecar lost": (lambda root: sidecar(root).unlink(), "beh.json cannot be read"),
    "sidecar nested": (lambda root: sidecar(root).write_text("[" * 200_000), "nested too deeply|is not valid JSON"),
    # All together, with a chain, a table and a sidecar that fit.
    "all: off the scale": (forged(put(3, rating=40.0)), "trial 3: rating is 40, but the scale of the design goes"),
    "all: times in ms": (forged(each("response_time", lambda event: 1500.0)), "whose picture and answer took 1503.5 s"),
    "all: time 0": (forged(put(3, response_time=0.0)), "trial 3: response_time is 0 s"),
    "all: too close": (forged(each("onset", lambda event: event["onset"] / 10)), "it begins 2 s after the previous"),
    "all: another picture": (forged(put(3, stimulus="a/pinhole-farthest.png")), "trial 3: its picture is a/pinhole-"),
    "all: another condition": (forged(put(3, scene="c")), "main trial 3: scene is 'c', but"),
    "all: no practice": (forged(lambda events: events.__delitem__(slice(1, 3))), "2 of 2 practice trials of"),
    "all: doubled": (forged(lambda events: events.insert(7, dict(events[6]))), "occurs more than once"),
    "all: to come": (forged(head(time="2999-01-01T00:00:00+00:00")), "a sitting is dated 2999-01-01, which is"),
    "all: a clock that was not set": (
        forged(head(time="1970-01-01T00:00:00+00:00")),
        "a sitting is dated 1970-01-01, which is before the first version of this program: check the clock",
    ),
    "all: a clock that went back": (
        forged(
            lambda events: events.insert(5, {"event": "resumed", **sitting_of(events[0], "2026-01-02T00:00:00+00:00")})
        ),
        "a sitting is dated 2026-01-02, which is before",
    ),
    "all: another seed": (forged(head(design=RATING.model_dump(mode="json") | {"seed": 2})), "seed differ from those"),
    "all: other pictures": (forged(head(stimuli=None)), "it names pictures, but not their manifest"),
    "all: simulated": (forged(head(kind="simulated")), "its kind is simulated, but dataset_description.json says"),
    "all: other keys": (
        forged(head(keys={"rigid": "j", "nonrigid": "f"}), "necker"),
        "the keys are .*, but the design gives this participant",
    ),
    "all: unknown key": (forged(put(3, presses=[[1.0, "q", True]]), "necker"), "trial 3: the key 'q' is not one"),
    "all: cube above its longest": (
        forged(put(3, trial_duration=12.01), "necker"),
        "trial 3: trial_duration is 12.01 s",
    ),
    "all: presses in ms": (forged(put(3, presses=[[1000.0, "f", True]]), "necker"), "a key was pressed 1000 s after"),
    "all: cubes too close": (
        forged(each("onset", lambda event: event["onset"] / 10), "necker"),
        "it begins 6 s after the previous one, whose picture and answer took 10.016 s",
    ),
    "all: looks too close": (forged(each("onset", lambda event: event["onset"] / 5), "pinhole"), "it begins 6 s after"),
    "all: no pictures stated": (forged(lambda events: events[0].pop("stimuli")), "line 1: stimuli is missing"),
    "all: age in a list": (forged(head(about=[30])), r"line 1: about is \[30\], but must be a table"),
    "all: triggers without codes": (forged(noted(3, "triggers", ports=[])), "line 4: markers is missing, but must be"),
    "all: a round in words": (forged(noted(3, "practice", round="last", passed=False)), "line 4: round is 'last', but"),
    "all: a value beyond floats": (
        text(b'"rating"', b'"extra": {"clear": {"value": 1e999}}, "rating"'),
        "line 6: extra is .*, but must be a table of values",
    ),
    "all: a value beyond its scale": (forged(put(3, start=40.0)), "line 6, main trial 3: start is 40, but the scale"),
    "all: gaze that no tracker recorded": (
        forged(put(3, gaze_left=True, gaze_away=2.0)),
        "line 6, main trial 3: gaze_left is True, but gaze is 'none' in the design: restore the journal",
    ),
    "all: a trial shown that is not in the design": (
        forged(noted(3, "exposure", phase="main", trial=99, round=1)),
        "line 4, main trial 99: it is not in the design: restore the journal",
    ),
    "all: one exposure twice": (
        forged(lambda events: [noted(3, "exposure", phase="main", trial=1, exposure="a1")(events) for _ in range(2)]),
        "line 5, main trial 1: the exposure 'a1' occurs more",
    ),
    "all: a value named as a key of sidecars": (
        forged(put(3, extra={"Seed": {"value": 1.0}})),
        "line 6, main trial 3: 'Seed' is a reserved name in data sets: restore the journal",
    ),
    "all: one value in two kinds": (
        forged(lambda events: [put(n, extra={"clear": {"value": one}})(events) for n, one in ((3, 1.0), (4, "high"))]),
        "line 7, main trial 4: clear was noted as a number",
    ),
    "all: an event of no kind": (
        forged(lambda events: events.insert(3, {"event": "party"})),
        "line 4: event is 'party', but must be one of begun, resumed, trial, note, repaired",
    ),
    "all: confidence that was not asked for": (
        forged(put(3, confidence=0.5)),
        r"line 6, main trial 3: confidence is 0\.5, but the design does not ask for it",
    ),
    "all: a distance that no tracker measured": (
        forged(put(3, gaze_away=0.5)),
        "line 6, main trial 3: gaze_away is 0.5, but gaze is 'none' in the design: restore the journal",
    ),
    "all: a refresh rate below 0": (
        forged(lambda events: events[0]["apparatus"].update(refresh_hz=-60.0)),
        r"line 1: apparatus: refresh_hz is -60\.0, but must be a positive",
    ),
    # Participants, manifest and description.
    "age below 0": (people("\t30\t", "\t-3\t"), r"row 2: age is -3, but must be a number of years"),
    "row doubled": (people("sub-02\t", "sub-01\thuman\t30\tn/a\tn/a\nsub-02\t"), "sub-01 occurs 2 times"),
    "row lost, too": (people("sub-02\thuman\t30\tn/a\tn/a\n", ""), "sub-02 is missing: add a row, with its kind"),
    "kind unknown": (people("human", "robot"), "row 2: kind is 'robot', but must be one of human, simulated"),
    "kind changed": (people("human", "simulated"), r"sub-01 is simulated, but dataset_description\.json says human"),
    "one number twice": (renamed, "sub-01 and sub-1 are the same number, and had the same trial order"),
    "people not UTF-8": (
        lambda root: (root / "participants.tsv").write_bytes(b"participant_id\tkind\nsub-01\t\xff\n"),
        "participants.tsv is not text",
    ),
    "manifest changed": (
        lambda root: manifest(root).write_text(manifest(root).read_text() + " "),
        "has changed since the session: restore it",
    ),
    "manifest lost": (lambda root: manifest(root).unlink(), "manifest-.* cannot be read"),
}


def test_the_data_are_valid_before_they_are_damaged(made):
    assert validate(made).problems == ()


@pytest.mark.parametrize("name", DAMAGES)
def test_no_damage_passes(data, name):
    is_seen(data, *DAMAGES[name])


def is_seen(data: Path, damage: Callable[[Path], object], sentence: str) -> None:
    damage(data)
    problems = validate(data).problems
    with pytest.raises(AssertionError, match=sentence):
        raise AssertionError(" | ".join(problems))
    assert not any("\n" in problem for problem in problems)
    for attempt in (lambda: read_dataset(data, damaged="leave out"), lambda: repair(data), lambda: validate(data)):
        with suppress(InputError):  # one sentence, and never anything else
            attempt()


OWN = {
    "answer changed": (cell(4, "rating", "2.0", "guesses"), "differs from its journal"),
    "note changed": (cell(4, "noted", "7.5", "guesses"), "differs from its journal"),
    "column lost": (cell(1, "rating", "score", "guesses"), "the column rating is missing"),
    "line changed": (text(b'"rating": 1.5', b'"rating": 2.5', task="guesses"), "was changed after it was written"),
    "a note's words": (told("noted", {"Description": "Age."}, "guesses"), "noted differs from the journal"),
    "all: another condition": (forged(put(3, dots=9), "guesses"), "trial 3: dots is 9, but"),
    "all: one lost": (forged(lambda events: events.__delitem__(3), "guesses"), "of 18 trials of the design are miss"),
}


@pytest.fixture(scope="module")
def own(tmp_path_factory) -> Path:
    """Two who answered an own task."""
    root, design = tmp_path_factory.mktemp("own"), DESIGNS["own"]
    for label in ("01", "02"):
        with Session.begin(root, design, label, apparatus=APPARATUS) as session:
            for number, trial in enumerate(session.remaining()):
                session.record(trial, answer_of(design, onset=20.0 * number, rating=1.5, response_time=2.0))
    assert validate(root).problems == ()
    return root


@pytest.mark.slow
@pytest.mark.parametrize("name", OWN)
def test_no_damage_of_an_own_task_passes(own, tmp_path, name):
    is_seen(Path(shutil.copytree(own, tmp_path / "data")), *OWN[name])


def test_wording_of_another_version_may_differ_but_not_values(data):
    forged(lambda events: events[0]["versions"].update(focalgradient="0.0.1"))(data)
    retold(lambda told: told["rating"].update(Description="How deep it looked."))(data)
    assert validate(data).problems == ()
    retold(lambda told: told["rating"].update(Maximum=9.0))(data)
    (problem,) = validate(data).problems
    assert problem.endswith("rating differs from the journal: " + REMEDY)


def test_all_damages_of_one_data_set_are_listed_at_once(data):
    chosen = ["rating 0", "time 0", "another seed told", "presses lost", "age below 0", "manifest changed"]
    for name in chosen:
        DAMAGES[name][0](data)
    with pytest.raises(AssertionError) as listed:
        raise AssertionError(" | ".join(validate(data).problems))
    for sentence in ("rating is '0'", "Seed differ", "presses is missing", "age is -3", "has changed since the sess"):
        assert listed.match(sentence)


@pytest.mark.parametrize(
    ("given", "told", "steps"),
    [(99.0, "99.0", False), (-0.5, "-0.5", True), (None, "n/a", True), (2.5, "2.5", True), (2.5, "2.5", False)],
)
def test_further_answers_off_their_scale_are_seen(given, told, steps, tmp_path):
    asked = {"question": "How clear?", "least": 0, "most": 4, "steps": steps}
    design = Pinhole.model_validate({"scenes": ["a"], "repetitions": 1, "also": {"clear": asked}})
    with Session.begin(tmp_path / "data", design, "01", apparatus=APPARATUS) as session:
        for number, trial in enumerate(session.remaining()):
            clear = given if number == 2 else 3.0
            answer = {"onset": 30.0 * number, "rating": 1.0, "response_time": 2.0, "clear": clear}
            session.record(trial, Rated(**answer))
    right = not steps and given == 2.5
    kind = "a whole number" if steps else "a number"
    sentence = f"trial 3: clear is {told}, but must be {kind} from 0 to 4: compare the journal with a copy"
    problems = validate(tmp_path / "data").problems
    assert any(sentence in problem for problem in problems) is not right, problems


def test_others_are_read_where_one_session_is_damaged(data):
    edit(table(data, "02"), 4, "trial", "2")
    edit(table(data, "02"), 5, "rating", "0")
    found = read_dataset(data, damaged="leave out")
    assert set(found.depth_rating["participant_id"]) == {"sub-01", "sub-03"}
    assert len(found.problems) == 2
    assert all("sub-02_task-depthrating" in problem for problem in found.problems)
    assert set(found.necker["participant_id"]) == {"sub-01", "sub-02"}
    found = validate(data)
    assert all("sub-02" in problem for problem in found.problems)
    cubes = read_dataset(data, ["necker"]).necker.groupby(["participant_id", "trial"]).ngroups
    assert found.trials == cubes + 6 + 2 * 9
