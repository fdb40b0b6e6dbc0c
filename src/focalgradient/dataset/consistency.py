"""Consistency of one session with its design, journal and stimuli: each contradiction is a sentence."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import fields
from datetime import UTC, datetime, timedelta
from itertools import combinations
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.dataset.alike import differences
from focalgradient.dataset.answers import Chosen, Rated
from focalgradient.dataset.arrival import too_early
from focalgradient.dataset.bids import sidecar_of
from focalgradient.dataset.events import Event
from focalgradient.dataset.journal import Log
from focalgradient.dataset.read import SessionTable
from focalgradient.design import Design, Trial
from focalgradient.errors import InputError
from focalgradient.files import read_json
from focalgradient.files.columns import cell
from focalgradient.tasks import Rows, task_named

__all__ = [
    "check_choice",
    "check_rating",
    "is_age",
    "pictures_of",
    "wrong_choices",
    "wrong_journal",
    "wrong_percepts",
    "wrong_ratings",
    "wrong_rows",
    "wrong_sidecar",
]

ROUNDING_S = 1e-6
"""Rounding tolerance of recorded times, in s."""

FRAMES_S = 0.1
"""Tolerance in s by which a picture may be shorter than designed: three frames at 30 Hz."""

LONGEST_RATIO = 0.1
"""Tolerance by which late frames may prolong a cube's display, as a fraction, in addition to 1 s."""

SLOW_S, SLOW = 60.0, 100.0
"""Limits of a response time that no later trial bounds: implausible above both 60 s and 100 times the median. Seconds
recorded as milliseconds are a thousand times too long.
"""

MOST_FURTHER = 8
"""Maximum number of further columns of a picture that are used: more would make too many combinations."""

CLOCK_TOLERANCE = timedelta(days=1)
"""Maximum by which one computer's clock may be ahead of another's."""

EARLIEST = datetime(2026, 1, 1, tzinfo=UTC)
"""Year of the first version: an earlier date is that of a clock that was not set."""


def wrong_journal(log: Log, design: Design, trials: Sequence[Trial]) -> Iterator[str]:
    """Yield a sentence for each contradiction between a journal and its own design."""
    head = log.head
    yield from _wrong_dates([event["time"] for event in (head, *log.of("resumed"))])
    percepts = task_named(design.task).percepts
    wanted = design.keys_of(head["participant"]) if percepts else None  # type: ignore[union-attr]
    if head["keys"] != wanted:
        yield f"the keys are {head['keys']}, but the design gives this participant {wanted}."
    done = log.of("trial")
    recorded = [(event["phase"], event["trial"]) for event in done]
    again = [one for one, count in Counter(recorded).items() if count > 1]
    if again:
        yield f"{again[0][0]} trial {again[0][1]} occurs more than once: use 'focalgradient repair'."
    practice = [trial for trial in trials if trial.phase == "practice"]
    trained = {trial for phase, trial in recorded if phase == "practice"}
    main = any(phase == "main" for phase, _ in recorded)
    if main and len(trained) < len(practice):
        yield f"{len(practice) - len(trained)} of {len(practice)} practice trials of the design are missing."
    listed = {(trial.phase, trial.trial): trial for trial in trials}
    order = {key: place for place, key in enumerate(listed)}
    places = [order[key] for key in recorded if key in order]
    if places != sorted(places):
        yield "its trials are not in the order of the design."
    # Values chosen by an adaptive procedure are in the answer and in the trial shown.
    chosen = {field.name for field in fields(task_named(design.task).answer)}
    names = [field.name for field in fields(trials[0]) if field.name not in chosen]
    for event in done:
        trial = listed.get((event["phase"], event["trial"]))
        if trial is None:
            yield f"{event['phase']} trial {event['trial']} is not in the design."
            break
        # Earlier versions did not record all fields.
        other = next((name for name in names if name in event and event[name] != getattr(trial, name)), None)
        if other is not None:
            recorded, planned = event[other], getattr(trial, other)
            yield f"{event['phase']} trial {event['trial']}: {other} is {recorded!r}, but {planned!r} in the design."
            break
    if percepts:
        yield from _wrong_presses(done, head)
    yield from too_early(log, design, trials)


def _wrong_dates(texts: Sequence[str]) -> Iterator[str]:
    """Yield a sentence for each sitting whose date is impossible, given the date and time of each."""
    last = EARLIEST
    for text in texts:
        time = datetime.fromisoformat(text)
        if time > datetime.now(UTC) + CLOCK_TOLERANCE:
            wrong = "is in the future"
        elif time < EARLIEST:
            wrong = "is before the first version of this program"
        elif time < last - CLOCK_TOLERANCE:
            wrong = "is before the previous sitting"
        else:
            last = time
            continue
        yield f"a sitting is dated {text[:10]}, which {wrong}: check the clock of its computer."


def _wrong_presses(done: Sequence[Event], head: Event) -> Iterator[str]:
    keys = set(head["keys"].values())
    for event in done:
        for time, key, _ in event["presses"]:
            if key not in keys:
                yield f"trial {event['trial']}: the key {key!r} is not one of the design's."
                return
            if time > event["trial_duration"] + 1:
                yield f"trial {event['trial']}: a key was pressed {time:g} s after its start, when it was over."
                return


def wrong_sidecar(sidecar: Mapping[str, Any], log: Log) -> Iterator[str]:
    """Yield a sentence for each key in which a sidecar differs from the one derived from its journal."""
    yield from differences(sidecar, json.loads(json.dumps(sidecar_of(log))))


def wrong_rows(
    found: SessionTable, design: Design, trials: Sequence[Trial], pictures: Mapping[tuple[str, ...], str]
) -> Iterator[str]:
    """Yield a sentence for each contradiction between a table and its design, and for each impossible value.

    Parameters
    ----------
    found
        Session table with all its columns.
    design, trials
        Design and trials of the session, including practice.
    pictures
        File of each picture in the manifest, by scene, aperture and fixation.
    """
    columns, task = found.columns, task_named(found.files.task)
    first = np.ones(found.rows, bool)
    if task.percepts and found.rows:
        first[1:] = columns["trial"][1:] != columns["trial"][:-1]
    shown = {name: values[first] for name, values in columns.items()}
    planned = {trial.trial: trial for trial in trials if trial.phase == "main"}
    yield from _wrong_trials(shown, planned, {field.name for field in fields(task.answer)})
    yield from _wrong_order(task.onset, shown)
    yield from task.problems(Rows(columns, shown, design, planned, pictures))
    yield from _wrong_further(shown, design)
    if "response_time" in shown:
        none = shown["response_time"] <= 0
        if none.any():
            yield f"trial {shown['trial'][none][0]}: response_time is 0 s, which is impossible."
        yield from _too_close(shown, design)


def _wrong_further(shown: Mapping[str, NDArray[Any]], design: Any) -> Iterator[str]:
    """Yield a sentence for each further question of the design with an answer that it does not offer."""
    for name, one in design.also.items():
        for number, value in zip(shown["trial"].tolist(), shown.get(name, np.array([])).tolist(), strict=False):
            given = _as_number(value)
            if not one.least - ROUNDING_S <= given <= one.most + ROUNDING_S or (one.steps and given % 1):
                kind = "a whole number" if one.steps else "a number"
                yield f"trial {number}: {name} is {cell(value)}, but must be {kind} from {one.least:g} to {one.most:g}."
                break


def _as_number(value: Any) -> float:
    """Return the number of a cell, also of a column with a text in another cell; NaN if it is none."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


def check_rating(design: Any, answer: Rated) -> None:
    """Raise `InputError` for a rating outside its scale, or gaze data that the design does not record."""
    if not design.is_answer(answer.rating):
        least, most = design.bounds
        raise InputError(
            f"rating is {answer.rating:g}, but the scale of the design goes from {least:g} to {most:g}: give one "
            "of its answers."
        )
    gaze = getattr(design, "gaze", "none")
    if (gaze != "none") is not (answer.gaze_left is not None):
        raise InputError(f"gaze_left is {answer.gaze_left}, but gaze is {gaze!r} in the design: correct it.")


def check_choice(design: Any, trial: Any, answer: Chosen) -> None:
    """Raise `InputError` for a level that the design does not have, or an answer that contradicts itself."""
    if not design.is_level(answer.level):
        raise InputError(f"level is {answer.level:g}, but must be one of the design's levels.")
    if answer.correct is not (answer.answer == trial.interval):
        raise InputError(f"correct is {answer.correct}, which contradicts the answer: compare it with interval.")


Picture = Callable[[Rows, int], str | None]
"""Function that returns the file of the picture of a row's condition."""


def wrong_ratings(rows: Rows, picture: Picture) -> Iterator[str]:
    """Yield a sentence for each impossible rating, and each picture other than its condition's."""
    yield from _wrong_ratings(rows.shown, rows.design)
    yield from _wrong_pictures(rows, picture)


def wrong_choices(rows: Rows, picture: Picture) -> Iterator[str]:
    """Yield a sentence for each impossible interval choice, and each picture other than its condition's."""
    yield from _wrong_choices(rows.shown, rows.design)
    yield from _wrong_pictures(rows, picture)


def wrong_percepts(rows: Rows) -> Iterator[str]:
    """Yield a sentence for each impossible percept and Necker cube trial."""
    yield from _wrong_percepts(rows.columns)
    yield from _wrong_durations(rows.shown, rows.planned)


def _wrong_trials(
    shown: Mapping[str, NDArray[Any]], planned: Mapping[int, Trial], chosen: Container[str]
) -> Iterator[str]:
    numbers = shown["trial"].tolist()
    there = set(numbers)
    missing = [number for number in planned if number not in there]
    if missing:
        first = f"the first is {missing[0]}"
        yield f"{len(missing)} of {len(planned)} trials of the design are missing ({first}): resume the session."
    strange = [number for number in numbers if number not in planned]
    if strange:
        yield f"trial {strange[0]} is not in the design, which has {len(planned)}."
    if numbers != sorted(numbers):
        yield "the trials are not in the order in which they were shown."
    example = next(iter(planned.values()))
    for name in [name for name in shown if _planned(example, name) is not None and name not in chosen]:
        for number, value in zip(numbers, shown[name].tolist(), strict=True):
            if number in planned and value != (wanted := _planned(planned[number], name)):
                recorded, expected = cell(value), cell(wanted)
                if recorded != expected:
                    yield f"trial {number}: {name} is {recorded}, but {expected} in the design."
                    break


def _planned(trial: Trial, name: str) -> Any:
    """Return a trial's designed value of a column, including factors; None if it has none."""
    return getattr(trial, name, getattr(trial, "factors", {}).get(name))


def _wrong_order(onset: str, shown: Mapping[str, NDArray[Any]]) -> Iterator[str]:
    sittings = shown["sitting"]
    if (np.diff(sittings) < 0).any():
        yield "the sittings are not in order."
    back = (np.diff(shown[onset]) <= 0) & (np.diff(sittings) == 0)
    if back.any():
        yield f"trial {shown['trial'][1:][back][0]}: {onset} is not later than in the trial before it."


def _wrong_percepts(columns: Mapping[str, NDArray[Any]]) -> Iterator[str]:
    trial, onset = columns["trial"], columns["onset"]
    if not len(trial):
        return
    change = trial[1:] != trial[:-1]
    first, last = np.append(True, change), np.append(change, True)
    ends = onset + columns["duration"]
    start = np.where(first, 0.0, np.append(0.0, ends[:-1]))
    gap = (np.abs(onset - start) > ROUNDING_S) | (last & (np.abs(ends - columns["trial_duration"]) > ROUNDING_S))
    if gap.any():
        yield f"trial {trial[gap][0]}: its percepts do not fill the trial from its start to its end."
    none = columns["duration"] <= 0
    if none.any():
        yield f"trial {trial[none][0]}: a percept lasts 0 s, which is impossible."
    other = columns["censored"] != last
    if other.any():
        yield f"trial {trial[other][0]}: its last percept, and no other, must be censored."
    same = (columns["percept"][1:] == columns["percept"][:-1]) & ~change
    if same.any():
        yield f"trial {trial[1:][same][0]}: a percept is followed by the same percept."


def _wrong_durations(shown: Mapping[str, NDArray[Any]], planned: Mapping[int, Trial]) -> Iterator[str]:
    lasts = shown["trial_duration"]
    for number, seconds in zip(shown["trial"].tolist(), lasts.tolist(), strict=True):
        wanted = getattr(planned.get(number), "trial_s", None)
        if wanted is not None and not wanted - FRAMES_S <= seconds <= wanted * (1 + LONGEST_RATIO) + 1:
            yield f"trial {number}: trial_duration is {seconds:g} s, but the design shows it for {wanted:g} s."
            break
    close = (np.diff(shown["trial_onset"]) < lasts[:-1] - FRAMES_S) & (np.diff(shown["sitting"]) == 0)
    if close.any():
        yield f"trial {shown['trial'][1:][close][0]}: it begins before the previous trial has ended."


def _wrong_ratings(shown: Mapping[str, NDArray[Any]], design: Any) -> Iterator[str]:
    ratings = shown["rating"]
    least, most = design.bounds
    off = (ratings < least - ROUNDING_S) | (ratings > most + ROUNDING_S)
    if off.any():
        yield (
            f"trial {shown['trial'][off][0]}: rating is {ratings[off][0]:g}, but the scale of the design goes from "
            f"{least:g} to {most:g}."
        )
    elif (between := np.array([not design.is_answer(rating) for rating in ratings.tolist()], bool)).any():
        wrong = f"rating is {ratings[between][0]:g}, but the scale {design.response_scale.off}."
        yield f"trial {shown['trial'][between][0]}: {wrong}"
    if "start" in shown:
        with np.errstate(invalid="ignore"):
            away = (shown["start"] < least - ROUNDING_S) | (shown["start"] > most + ROUNDING_S)
        if away.any():
            yield f"trial {shown['trial'][away][0]}: start is {shown['start'][away][0]:g}, which is outside the scale."
    if "gaze_left" in shown:
        with np.errstate(invalid="ignore"):
            left = ~(shown["gaze_away"] <= design.gaze_within_deg)  # unknown counts as left
        other = left != shown["gaze_left"]
        if other.any():
            yield (
                f"trial {shown['trial'][other][0]}: gaze_left is {cell(bool(shown['gaze_left'][other][0]))}, but "
                f"gaze_away is {cell(float(shown['gaze_away'][other][0]))} and the design allows "
                f"{design.gaze_within_deg:g} degrees."
            )
    sure = shown["confidence"] > 1
    if sure.any():
        yield f"trial {shown['trial'][sure][0]}: confidence is {shown['confidence'][sure][0]:g}, but goes from 0 to 1."


def _wrong_choices(shown: Mapping[str, NDArray[Any]], design: Any) -> Iterator[str]:
    """Check levels and answers of an adaptive experiment."""
    for number, level, catch, interval, answer, correct in zip(
        *(shown[name].tolist() for name in ("trial", "level", "catch", "interval", "answer", "correct")), strict=True
    ):
        if not design.is_level(level):
            yield f"trial {number}: level is {level:g}, which is not one of the design's levels."
        elif catch and level != design.levels[-1]:
            yield f"trial {number}: level is {level:g}, but catch trials have the greatest, {design.levels[-1]:g}."
        elif answer not in (1, 2):
            yield f"trial {number}: answer is {answer}, but must be 1 or 2."
        elif correct is not (answer == interval):
            yield f"trial {number}: correct is {cell(correct)}, but the answer is {answer} and the interval {interval}."
        else:
            continue
        return


def _too_close(shown: Mapping[str, NDArray[Any]], design: Any) -> Iterator[str]:
    """Yield trials that begin before the previous picture and answer are complete, and implausible response times."""
    seconds = shown["response_time"]
    if not len(seconds):
        return
    lasts = np.full(len(seconds), design.shown_s)
    if "form" in shown:
        lasts[shown["form"] == "real"] = design.look_s
    onset, together = shown["onset"], np.diff(shown["sitting"]) == 0
    close = (np.diff(onset) < (lasts + seconds)[:-1] - FRAMES_S) & together
    if close.any():
        at = int(close.argmax())
        yield (
            f"trial {shown['trial'][at + 1]}: it begins {onset[at + 1] - onset[at]:g} s after the previous one, "
            f"whose picture and answer took {lasts[at] + seconds[at]:g} s."
        )
    usual = median(seconds.tolist())
    for at in np.flatnonzero(np.append(~together, True)):
        if seconds[at] > max(SLOW_S, SLOW * usual):
            more = f"{seconds[at] / usual:.0f} times the median" if usual > 0 else "and the median is 0"
            yield f"trial {shown['trial'][at]}: response_time is {seconds[at]:g} s, {more}."


def _wrong_pictures(rows: Rows, picture: Picture) -> Iterator[str]:
    if not rows.pictures:
        return
    for place, name in enumerate(rows.shown["stimulus"].tolist()):
        wanted = picture(rows, place)
        if name != wanted and not (name is None and wanted is None):
            yield (
                f"trial {rows.shown['trial'][place]}: its picture is {name or 'missing'}, but its condition's is "
                f"{wanted or 'none of the manifest'}."
            )
            return


def pictures_of(manifest: Path) -> dict[tuple[str, ...], str]:
    """Return the files of the pictures that a manifest lists; empty if it lists none.

    Keys are scene, aperture and fixation (the first of several that differ in further columns), and those three
    followed by any of the further columns, such as "light=dim".
    """
    files: dict[tuple[str, ...], str] = {}
    try:
        for one in read_json(manifest, "a manifest of stimuli").get("pictures", []):
            further = [f"{name}={level}" for name, level in sorted(one.get("further", {}).items())][:MOST_FURTHER]
            for count in range(len(further) + 1):
                for some in combinations(further, count):
                    files.setdefault((one["scene"], one["aperture"], one["fixation"], *some), one["png"])
    except (InputError, KeyError, TypeError, AttributeError):
        return {}
    return files


def is_age(age: Any) -> bool:
    """Return whether a cell is an age in years in BIDS notation: a number, "89+", or missing.

    >>> [is_age(age) for age in ("31", "89+", -1, float("nan"), "old")]
    [True, True, False, True, False]
    """
    text = str(age).strip()
    if text in ("nan", "n/a", "", "89+"):
        return True
    try:
        return 0 <= float(text) <= 130 and math.isfinite(float(text))
    except ValueError:
        return False
