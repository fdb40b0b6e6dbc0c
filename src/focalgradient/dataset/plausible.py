"""Values that the recorder takes, but that no session can have: dates, times, missing trials, other pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from itertools import combinations, pairwise
from pathlib import Path
from statistics import median
from typing import Any

from focalgradient.dataset.arrival import too_early
from focalgradient.dataset.events import Event
from focalgradient.dataset.journal import Log
from focalgradient.dataset.times import trials_with_times
from focalgradient.design import Design, Trial
from focalgradient.errors import InputError
from focalgradient.files import read_json
from focalgradient.files.columns import cell
from focalgradient.tasks import task_named
from focalgradient.tasks.noted import EXTRA

__all__ = ["implausible", "is_age", "missing_trials", "pictures_of"]

FRAMES_S = 0.1
"""Tolerance in s by which a picture may be shorter than designed: three frames at 30 Hz."""

LONGEST_RATIO = 0.1
"""Tolerance by which late frames may prolong a cube's display, as a fraction, in addition to 1 s."""

SLOW_S, SLOW = 60.0, 100.0
"""Limits of a response time that no later trial bounds: implausible above both 60 s and 100 times the median. Seconds
recorded as milliseconds are a thousand times too long.
"""

ROUNDING = 1e-6
"""Rounding tolerance of answers."""

MOST_FURTHER = 8
"""Maximum number of further columns of a picture that are used: more would make too many combinations."""

CLOCK_TOLERANCE = timedelta(days=1)
"""Maximum by which one computer's clock may be ahead of another's."""

EARLIEST = datetime(2026, 1, 1, tzinfo=UTC)
"""Year of the first version: an earlier date is that of a clock that was not set."""

NO_PICTURE: tuple[str, str, str, Mapping[str, str]] = ("", "", "", {})
"""Picture of a trial that shows none of the set, which no manifest lists."""

LEAVE_OUT = "compare the journal with a copy, or leave the session out."


def missing_trials(recorded: Sequence[tuple[str, int]], planned: Sequence[Trial]) -> Iterator[str]:
    """Yield a sentence on the trials of the design that are missing, and one if those recorded are out of order.

    Trials are recorded by phase and number.
    """
    order = {(trial.phase, trial.trial): place for place, trial in enumerate(planned)}
    begun = any(phase == "main" for phase, _ in recorded)
    for phase, name, remedy in (("practice", "practice trials", LEAVE_OUT), ("main", "trials", "resume the session.")):
        wanted = [turn for turn in order if turn[0] == phase]
        missing = [turn for turn in wanted if turn not in {*recorded}]
        if missing and (begun or phase == "main"):
            yield (
                f"{len(missing)} of {len(wanted)} {name} of the design are missing (the first is {missing[0][1]}): "
                f"{remedy}"
            )
    places = [order[turn] for turn in recorded if turn in order]
    if places != sorted(places):
        yield f"its trials are not in the order of the design: {LEAVE_OUT}"


def implausible(
    log: Log, design: Any, planned: Sequence[Trial], pictures: Mapping[tuple[str, ...], str]
) -> Iterator[str]:
    """Yield a sentence for each implausible date, time, further answer, key and picture of a session.

    Parameters
    ----------
    log
        Journal of the session.
    design, planned
        Design and trials of the session, including practice.
    pictures
        File of each picture in the manifest, by scene, aperture and fixation.
    """
    yield from _wrong_dates([event["time"] for event in (log.head, *log.of("resumed"))])
    yield from too_early(log, design, planned)
    shown = [(sitting, event) for sitting, event, _ in trials_with_times(log)]
    main = {trial.trial: trial for trial in planned if trial.phase == "main"}
    found = [
        *_wrong_times(shown, design),
        *_wrong_further(shown, design),
        *_wrong_pictures(shown, design, main, pictures),
    ]
    if task_named(design.task).percepts:
        found += _wrong_presses(log, design, main)
    yield from (f"{what}: {LEAVE_OUT}" for what in found)


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


def _wrong_times(shown: Sequence[tuple[int, Event]], design: Any) -> Iterator[str]:
    """Yield problems of trials that begin before the one before has ended, and with response times."""
    picture_s = design.shown_s
    for (sitting, one), (other, later) in pairwise(shown):
        since = later["onset"] - one["onset"]
        lasted = design.look_s if one.get("form") == "real" else picture_s
        seconds = one["trial_duration"] if "trial_duration" in one else lasted + one.get("response_time", 0.0)
        if sitting == other and (since < seconds - FRAMES_S or since <= 0):
            begins = f"it begins {since:.6g} s after the previous one"
            yield f"trial {later['trial']}: {begins}, whose picture and answer took {seconds:.6g} s"
            break
    times = [event.get("response_time") for _, event in shown]
    answered = [seconds for seconds in times if seconds is not None]
    usual = median(answered) if answered else 0.0
    for place, ((sitting, event), seconds) in enumerate(zip(shown, times, strict=True)):
        last = place == len(shown) - 1 or shown[place + 1][0] != sitting
        if seconds is not None and seconds <= 0:
            yield f"trial {event['trial']}: response_time is 0 s, which is impossible"
            break
        if seconds is not None and last and seconds > max(SLOW_S, SLOW * usual):
            more = f"{seconds / usual:.0f} times the median" if usual > 0 else "and the median is 0"
            yield f"trial {event['trial']}: response_time is {seconds:g} s, {more}"


def _wrong_presses(log: Log, design: Any, planned: Mapping[int, Trial]) -> Iterator[str]:
    wanted = design.keys_of(log.head["participant"])
    if log.head["keys"] != wanted:
        yield f"the keys are {log.head['keys']}, but the design gives this participant {wanted}"
    for event in log.of("trial"):
        for time, key, _ in event["presses"]:
            if key not in wanted.values():
                yield f"trial {event['trial']}: the key {key!r} is not one of the design's"
                return
            if time > event["trial_duration"] + 1:
                yield f"trial {event['trial']}: a key was pressed {time:g} s after its start, when it was over"
                return
        seconds = getattr(planned.get(event["trial"]), "trial_s", None)
        if event["phase"] == "main" and seconds is not None:
            lasted, longest = event["trial_duration"], seconds * (1 + LONGEST_RATIO) + 1
            if not seconds - FRAMES_S <= lasted <= longest:
                shown = f"the design shows it for {seconds:g} s"
                yield f"trial {event['trial']}: trial_duration is {lasted:g} s, but {shown}"
                return


def _wrong_further(shown: Sequence[tuple[int, Event]], design: Design) -> Iterator[str]:
    """Yield a problem for each further question of the design with an answer that it does not offer."""
    for name, asked in design.also.items():
        given = [(event["trial"], event.get(EXTRA, {}).get(name, {"value": event.get(name)})) for _, event in shown]
        answers = [(number, noted["value"]) for number, noted in given]
        for number, value in answers if any(value is not None for _, value in answers) else ():
            within = isinstance(value, int | float) and asked.least - ROUNDING <= value <= asked.most + ROUNDING
            if not within or (asked.steps and value % 1):
                kind = "a whole number" if asked.steps else "a number"
                limits = f"{kind} from {asked.least:g} to {asked.most:g}"
                yield f"trial {number}: {name} is {cell(value)}, but must be {limits}"
                break


def _wrong_pictures(
    shown: Sequence[tuple[int, Event]],
    design: Any,
    planned: Mapping[int, Trial],
    pictures: Mapping[tuple[str, ...], str],
) -> Iterator[str]:
    task = task_named(design.task)
    if task.pictured is None or not pictures:
        return
    for _, event in shown:
        if event["trial"] not in planned:
            continue  # reported by the replay
        scene, aperture, fixation, levels = task.pictured(design, planned[event["trial"]]).get("picture", NO_PICTURE)
        key = scene, aperture, fixation, *(f"{factor}={level}" for factor, level in sorted(levels.items()))
        name, wanted = event.get("stimulus"), pictures.get(key)
        if name != wanted:
            other = wanted or "none of the manifest"
            yield f"trial {event['trial']}: its picture is {name or 'missing'}, but its condition's is {other}"
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
