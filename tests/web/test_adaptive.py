"""Own tasks in a browser whose trials depend on the answers so far, that are adjusted, or that phones take part in."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from participant import Participant, client_of, make_set, study
from test_revealed import THRESHOLD

sys.path.insert(0, str(Path(__file__).parents[1] / "experiments"))
from headless import PROGRAMS

from focalgradient.dataset import read_dataset, read_journal, validate
from focalgradient.design import Procedure, answers_of
from focalgradient.tasks import task_named

SHORT = 'task = "blurdiscrimination"\nask = []\nrepetitions = 3\npedestals_arcmin = [1.0]\n'


def staircase() -> Any:
    task_named(str(PROGRAMS / "blur_discrimination.py"))
    return sys.modules["blur_discrimination"].STAIRCASE


def answered(someone: Participant, number: int, right: bool) -> Any:
    """Answer the next trial of two ways; `interval` of the page is 1, so that rating 1 is the first way."""
    trial = someone.trials[number]
    message = someone.message(trial, number)
    made = task_named("blurdiscrimination").design(ask=(), repetitions=3, pedestals_arcmin=(1.0,)).trials("001")[number]
    first = (made.interval == 1) is right
    message["answer"] |= {"rating": None, "chosen": 1 if first else 2, "start": None}
    return someone.ask("answer", **message)


def test_the_server_chooses_each_trial_by_the_answers_before_it(tmp_path: Path) -> None:
    stairs = staircase()
    served = study(tmp_path, SHORT)
    shown, given = [], []
    with client_of(served) as client:
        someone = Participant(client)
        assert someone.begin().status_code == 200
        for number, right in enumerate((True, True, True, False, True, True)):
            key = {name: someone.trials[number][name] for name in ("phase", "trial")}
            later = {**key, "trial": key["trial"] + 1}
            assert someone.ask("next", **later).status_code == 409  # not before this one is answered
            found = someone.ask("next", **key)
            assert found.status_code == 200
            assert found.json() == someone.ask("next", **key).json(), "asked again, it is the same"
            shown.append([one["url"] for one in found.json()["trials"][0]["intervals"]])
            assert someone.picture(shown[-1][0]).startswith(b"\x89PNG")
            given.append(right)
            assert answered(someone, number, right).status_code == 200
    assert validate(tmp_path / "data").problems == ()
    (table,) = (one for one in read_dataset(tmp_path / "data").tables.values() if len(one))
    recorded = [{"phase": "main", "catch": False, **one} for one in table.to_dict("records")]
    assert [one["correct"] for one in recorded] == given
    levels = [stairs.level(answers_of(recorded[:number])) for number in range(6)]
    assert [one["level"] for one in recorded] == pytest.approx(levels)
    assert len({*levels}) >= 3
    for urls, row in zip(shown, table["shown_sha256"], strict=True):
        assert len(set(urls)) == len(row.split())


STEPS_SHOWN = ("mark", "picture", "picture", "question")
STEPS = """
[also.seen]
question = "How clear was it?"
least = 1
most = 4
steps = true
"""


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"rating": 1.7, "chosen": None}, "rating is 1.7, which lies between two answers: send one of them."),
        ({"rating": 0.0, "chosen": None}, "rating is 0, but must be from 1 to 2: send a value on the scale."),
        ({"also": {"seen": 2.5}}, "seen is 2.5, which lies between two answers: send one of them."),
        ({"also": {"seen": 5}}, "seen is 5, but must be from 1 to 4: send a value on the scale."),
        ({"also": {"seen": 3, "seen_start": 9}}, "seen_start is 9, but must be from 1 to 4: "),
        ({"also": {}}, "seen is missing: send exactly the responses asked for."),
    ],
)
def test_an_answer_that_the_page_does_not_offer_is_refused(
    changed: dict[str, Any], sentence: str, tmp_path: Path
) -> None:
    staircase()
    with client_of(study(tmp_path, SHORT + STEPS)) as client:
        someone = Participant(client)
        someone.begin()
        message = someone.message(someone.trials[0], 0)
        message["answer"] |= {"rating": None, "chosen": 1, "start": None, "also": {"seen": 3}} | changed
        refused = someone.ask("answer", **message)
        assert refused.status_code == 400
        assert refused.json()["error"].startswith(sentence)
        message["answer"] |= {"rating": None, "chosen": 1, "also": {"seen": 3, "seen_start": 2}}
        assert someone.ask("answer", **message).status_code == 200
    (event,) = read_journal(next((tmp_path / "data").rglob("*.jsonl"))).of("trial")
    assert {name: event["extra"][name]["value"] for name in ("seen", "seen_start")} == {"seen": 3, "seen_start": 2}


def test_blur_thresholds_follow_their_answers_in_the_browser_as_in_the_laboratory(tmp_path: Path) -> None:
    make_set(tmp_path / "set", ["spheres-01"], size=(120, 90))
    made = study(tmp_path, THRESHOLD.replace("level_steps = 9", "level_steps = 15"), stimuli=tmp_path / "set")
    shown = [{"event": name, "stamps": [100.0 * n, 100.0 * n + 16]} for n, name in enumerate(STEPS_SHOWN)]
    with client_of(made) as client:
        someone = Participant(client)
        someone.begin()
        for number, trial in enumerate(made.design.trials("001")):
            parts = someone.entry(number)["intervals"]
            assert [(one["event"], one["mark_seconds"]) for one in parts] == [
                ("picture", made.design.mark_s),
                ("picture", 0.0),
            ]
            files = {someone.picture(one["url"]) for one in parts}
            assert len(files) == 2
            assert len({*map(len, files)}) == 1, "files of one size tell nothing about their interval"
            message = someone.message(someone.trials[number], number)
            chosen = trial.interval if trial.trial != 2 else 3 - trial.interval
            message["answer"] |= {"rating": None, "start": None, "chosen": chosen, "frames": {"shown": shown}}
            assert someone.ask("answer", **message).status_code == 200
    assert validate(tmp_path / "data", tmp_path / "set").problems == ()
    table = read_dataset(tmp_path / "data").blur_threshold
    counted = table[~table["catch"]]
    procedure = Procedure(made.design)
    for level, right in zip(counted["level"], counted["correct"], strict=True):
        assert level == pytest.approx(procedure.level())
        procedure.learn([*procedure.learnt, (level, bool(right))])
    assert counted["level"].nunique() > 2
    assert {*table["stimulus"]} == {"spheres-01/pinhole.png"}
    events = pd.read_csv(next((tmp_path / "data").rglob("*_events.tsv")), sep="\t")
    first = [row["trial_type"] for _, row in events.iterrows() if row["trial_type"] in ("picture", "reference")][::2]
    assert first == [{1: "picture", 2: "reference"}[trial.interval] for trial in made.design.trials("001")]
