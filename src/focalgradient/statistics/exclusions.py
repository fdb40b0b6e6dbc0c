"""Which answers to trust, by rules stated beforehand: what is left out is counted, and the data stay as they were.

No rule looks at the effect under study: to leave out people whose answers did not follow the blur would make an effect.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from focalgradient.errors import InputError
from focalgradient.statistics.cube import SHORTEST_BOTH
from focalgradient.statistics.tables import rating_table, report_table

__all__ = ["Exclusion", "Quality", "Rules", "SubjectQuality", "quality"]


@dataclass(frozen=True, slots=True)
class Rules:
    """Rules of exclusion; with None a rule is off: it is counted, but leaves nobody out.

    Parameters
    ----------
    response_time
        Shortest and longest time to answer, in seconds: a depth rating outside is left out.
    dropped_frames
        Most frames a trial may drop, more and it is left out.
    catch_factor
        A rating of the standard itself (a catch trial) passes within this factor of 1, the standard's own.
    catch_share
        A physically nonrigid cube (a catch trial) passes when it is seen so for this share of the time with a reading.
    catch_passed
        Least share of catch trials that a subject must pass.
    repeat_factor
        Largest spread (geometric standard deviation) of a subject's answers to one and the same picture.
    lapse_factor
        An answer farther than this factor from what the subject's other answers to that aperture and fixation, and all
        subjects' answers to that picture, let expect is a lapse: see `quality`.
    lapses
        Largest share of lapses; with the cube, of the time with no key or both held.
    shortest_both
        Both keys of the cube held for less than this, in seconds, is a change from one to the other and no report.
    fast
        Largest share of answers in less than the shortest response time.
    same_answer
        Largest share of answers that are one and the same, over all conditions; of a choice, with one and the same key.
    first_press
        Largest share of answers left where the first key had put the marker, at random.

    Raises
    ------
    InputError
        If a rule is out of range.
    """

    response_time: tuple[float, float] | None = (0.3, 60.0)
    dropped_frames: int | None = None
    catch_factor: float = 2.0
    catch_share: float = 0.5
    catch_passed: float | None = 0.7
    repeat_factor: float | None = 2.0
    lapse_factor: float = 3.0
    lapses: float | None = 0.2
    shortest_both: float = SHORTEST_BOTH
    fast: float | None = 0.2
    same_answer: float | None = 0.9
    first_press: float | None = 0.5

    def __post_init__(self) -> None:
        if self.response_time is not None and not 0 <= self.response_time[0] < self.response_time[1]:
            raise InputError(
                f"response_time is {self.response_time!r}, but must be a shortest and a longest time in seconds."
            )
        for name in ("catch_share", "catch_passed", "lapses", "fast", "same_answer", "first_press"):
            value = getattr(self, name)
            if value is not None and not 0 <= value <= 1:
                raise InputError(f"{name} is {value!r}, but must be a share from 0 to 1.")
        for name in ("catch_factor", "repeat_factor", "lapse_factor"):
            value = getattr(self, name)
            if value is not None and not value > 1:
                raise InputError(f"{name} is {value!r}, but must be a factor above 1.")
        if not 0 <= self.shortest_both < math.inf:
            raise InputError(f"shortest_both is {self.shortest_both!r}, but must be a time in seconds, 0 or more.")
        if self.dropped_frames is not None and self.dropped_frames < 0:
            raise InputError(f"dropped_frames is {self.dropped_frames!r}, but must be a number of frames, 0 or more.")


@dataclass(frozen=True, slots=True)
class SubjectQuality:
    """How one subject did, in all trials as they came.

    Parameters
    ----------
    participant_id, trials
        Who, and how many trials without catch trials.
    catch_trials, catch_passed
        How many catch trials, and the share passed; None without any.
    repeat_factor
        Spread of answers to one and the same picture, a geometric standard deviation; None where none was repeated, and
        with the cube.
    lapses
        Share of lapses; with the cube, of the time with no key or both held. None where there are too few answers.
    too_fast, too_slow
        Trials outside the bounds of response time.
    dropped
        Trials with any dropped frame; None where none were counted.
    same_answer
        Share of the most frequent answer; None with the cube, and of fewer than five answers.
    first_press
        Share of answers left where the marker first stood; None where that was not recorded.
    """

    participant_id: str
    trials: int
    catch_trials: int
    catch_passed: float | None
    repeat_factor: float | None
    lapses: float | None
    too_fast: int
    too_slow: int
    dropped: int | None
    same_answer: float | None = None
    first_press: float | None = None


@dataclass(frozen=True, slots=True)
class Exclusion:
    """What one rule left out: of one subject some trials, or all of them."""

    participant_id: str
    rule: str
    whole_subject: bool
    trials: int


@dataclass(frozen=True, slots=True)
class Quality:
    """How good the data are, and what was left out.

    Parameters
    ----------
    rules
        Those applied.
    subjects_before, subjects_after, trials_before, trials_after
        Counts without catch trials.
    subjects
        How each did.
    exclusions
        What each rule left out; a trial that several rules leave out counts with each.
    """

    rules: Rules
    subjects_before: int
    subjects_after: int
    trials_before: int
    trials_after: int
    subjects: tuple[SubjectQuality, ...]
    exclusions: tuple[Exclusion, ...]


def quality(
    table: pd.DataFrame, rules: Rules | None = None, scale: str = "ratio", middle: float = 1.0
) -> tuple[pd.DataFrame, Quality]:
    """Judge a table of depth ratings or of reports on the cube (known by the columns), and keep what the rules keep.

    Parameters
    ----------
    table
        What to judge.
    rules
        By which; None: the usual.
    scale
        What ratings are: "ratio", "ordinal", "bipolar" or "choice". Spread and lapses are judged where they have a
        logarithm.
    middle
        Of the scale: pictures that look clearly flatter are to be answered below it, those clearly deeper above.

    Returns
    -------
    tuple
        A new table of the rows kept, catch trials among them, and what was found. The one given is not changed.

    Notes
    -----
    Whether an answer is a lapse is judged after the subject's own median for the aperture and fixation, and what the
    picture adds to it for all subjects, are taken out.

    Raises
    ------
    InputError
        If the table is of neither kind, or cannot be read without guessing.

    Examples
    --------
    >>> table = pd.DataFrame({
    ...     "participant_id": "01", "trial": range(20), "scene": "room", "fixation": "nearest", "catch": False,
    ...     "aperture": ["pinhole", "f/11"] * 10, "aperture_mm": [0.0, 4.5] * 10, "rating": [1.0, 1.4, 1.1, 1.5] * 5,
    ...     "response_time": [0.1, *[1.2] * 19],
    ... })
    >>> kept, found = quality(table)
    >>> len(kept), found.exclusions[0].rule
    (19, 'answered in less than 0.3 s')
    """
    rules = rules or Rules()
    if "rating" in table:
        table = rating_table(table, scale)
        answers = _answers(table, scale)
        of_subject = {str(name): rows for name, rows in table.groupby("participant_id").indices.items()}
        subjects = [
            _rater(name, {key: values[of_subject[name]] for key, values in answers.items()}, rules, middle)
            for name in sorted(of_subject)
        ]
    elif "percept" in table:
        table = report_table(table)
        subjects = [_observer(str(name), rows, rules) for name, rows in table.groupby("participant_id")]
    else:
        raise InputError(
            "The table has neither a column rating nor a column percept: it must hold depth ratings or reports on the "
            "cube."
        )
    keep = pd.Series(True, index=np.arange(len(table)))
    exclusions = []
    number, names = pd.factorize(table["participant_id"].to_numpy(object), sort=True)
    for rule, wrong in _bad_trials(table, rules):
        for one in np.unique(number[wrong]):
            rows = table[wrong & (number == one)]
            exclusions.append(Exclusion(str(names[one]), rule, False, _count(rows)))
        keep &= ~wrong
    for subject in subjects:
        for rule in _bad_subject(subject, rules):
            exclusions.append(Exclusion(subject.participant_id, rule, True, subject.trials))
            keep &= names[number] != subject.participant_id
    kept = table[keep.to_numpy()]
    before, after = table[~table["catch"]], kept[~kept["catch"]]
    return kept, Quality(
        rules,
        before["participant_id"].nunique(),
        after["participant_id"].nunique(),
        _count(before),
        _count(after),
        tuple(subjects),
        tuple(exclusions),
    )


def _count(rows: pd.DataFrame) -> int:
    """Trials: with the cube a trial has many rows."""
    keys = [name for name in ("participant_id", "session", "trial") if name in rows]
    return len(rows[~rows["catch"]].drop_duplicates(keys))


def _bad_trials(table: pd.DataFrame, rules: Rules) -> list[tuple[str, np.ndarray]]:
    bad = []
    if rules.response_time is not None and "response_time" in table and "rating" in table:
        shortest, longest = rules.response_time
        times = table["response_time"].to_numpy(dtype=float)
        bad += [
            (f"answered in less than {shortest:g} s", times < shortest),
            (f"answered in more than {longest:g} s", times > longest),
        ]
    if rules.dropped_frames is not None and "dropped_frames" in table:
        dropped = table["dropped_frames"].to_numpy(dtype=float)
        bad.append((f"more than {rules.dropped_frames} dropped frames", dropped > rules.dropped_frames))
    return bad


def _bad_subject(subject: SubjectQuality, rules: Rules) -> list[str]:
    bad = []
    if rules.catch_passed is not None and (
        subject.catch_passed is not None and subject.catch_passed < rules.catch_passed
    ):
        bad.append(f"passed less than {rules.catch_passed:.0%} of the catch trials")
    if _exceeds(subject.repeat_factor, rules.repeat_factor):
        bad.append(f"answers to one picture spread by more than a factor {rules.repeat_factor:g}")
    if _exceeds(subject.lapses, rules.lapses):
        bad.append(f"more than {rules.lapses:.0%} lapses")
    if rules.fast is not None and subject.trials and subject.too_fast > rules.fast * subject.trials:
        bad.append(f"answered too fast in more than {rules.fast:.0%} of the trials")
    if _exceeds(subject.same_answer, rules.same_answer):
        bad.append(f"gave one and the same answer in more than {rules.same_answer:.0%} of the trials")
    if _exceeds(subject.first_press, rules.first_press):
        bad.append(f"left more than {rules.first_press:.0%} of the answers where the first key had put the marker")
    return bad


def _exceeds(value: float | None, most: float | None) -> bool:
    """Whether a value is above its rule; not where it could not be computed, or the rule is off."""
    return value is not None and most is not None and value > most


def _unexpected(rows: pd.DataFrame) -> np.ndarray:
    """Log of each answer over what was to be expected: the subject's median for the condition, corrected for the scene.

    The correction is the median of what is left over all subjects' answers to that picture; with fewer than three
    subjects over the subject's own answers to that scene. So scenes that look deeper, or gain more by blur, make no
    lapses.
    """
    condition = ["participant_id", "aperture", "fixation"]
    picture = ["scene", "aperture", "fixation"] if rows["participant_id"].nunique() > 2 else ["participant_id", "scene"]
    own = rows.groupby(condition, sort=False).ngroup().to_numpy()
    shown = rows.groupby(picture, sort=False).ngroup().to_numpy()
    off = pd.Series(np.log(rows["rating"].to_numpy()), index=np.arange(len(rows)))
    for groups in (own, shown, own):
        off -= off.groupby(groups).transform("median")
    return off.to_numpy()


def _answers(table: pd.DataFrame, scale: str) -> dict[str, np.ndarray]:
    """Columns of all ratings, by name; numbers of picture and condition, and how far off each answer is, among them."""
    catch = table["catch"].to_numpy(bool)
    off = np.full(len(table), math.nan)
    if scale not in ("bipolar", "choice"):
        off[~catch] = _unexpected(table[~catch])
    found = {"catch": catch, "off": off, "rating": table["rating"].to_numpy(float)}
    found["scene"] = table["scene"].to_numpy(object)
    found["picture"] = table.groupby(["scene", "aperture", "fixation"], sort=False).ngroup().to_numpy()
    found["condition"] = table.groupby(["aperture", "fixation"], sort=False).ngroup().to_numpy()
    for name in ("response_time", "dropped_frames", "interval", "start"):
        if name in table:
            found[name] = table[name].to_numpy(float)
    return found


def _rater(name: str, answers: Mapping[str, np.ndarray], rules: Rules, middle: float) -> SubjectQuality:
    catch = answers["catch"]
    passed = _passed(answers["rating"][catch], answers["scene"][catch], rules, middle)
    rows = {key: values[~catch] for key, values in answers.items()}
    picture = np.unique(rows["picture"], return_inverse=True)[1]
    count = np.bincount(picture)
    freedom = len(picture) - len(count)
    judged = not np.isnan(rows["off"]).all()
    spread, lapses = None, None
    if freedom and judged:
        answer = np.log(rows["rating"])
        apart = answer - (np.bincount(picture, answer) / np.maximum(count, 1))[picture]
        spread = math.exp(math.sqrt(float((apart**2).sum()) / freedom))
    condition = np.unique(rows["condition"], return_inverse=True)[1]
    enough = np.bincount(condition)[condition] >= 3
    if enough.any() and judged:
        lapses = float((np.abs(rows["off"]) > math.log(rules.lapse_factor))[enough].mean())
    shortest, longest = rules.response_time or (-math.inf, math.inf)
    times = rows.get("response_time", np.empty(0))
    return SubjectQuality(
        name,
        len(picture),
        len(passed),
        float(passed.mean()) if len(passed) else None,
        spread,
        lapses,
        int((times < shortest).sum()),
        int((times > longest).sum()),
        int((rows["dropped_frames"] > 0).sum()) if "dropped_frames" in rows else None,
        _most_frequent(rows),
        _left_there(rows),
    )


FEW = 5
"""Answers from which one can ask whether they are all the same."""


def _passed(answer: np.ndarray, scene: np.ndarray, rules: Rules, middle: float) -> np.ndarray:
    """Which catch trials are passed: examples on the right side of the middle, the standard near it."""
    flat, deep = (scene == name for name in ("example-flat", "example-deep"))
    if middle > 0:
        near = (answer >= middle / rules.catch_factor) & (answer <= middle * rules.catch_factor)
    else:
        near = np.abs(answer - middle) <= 1
    return np.where(flat, answer < middle, np.where(deep, answer > middle, near))


def _most_frequent(rows: Mapping[str, np.ndarray]) -> float | None:
    """Share of the most frequent answer over conditions that differ; of a choice, of the most frequent key."""
    answer, interval = rows["rating"], rows.get("interval")
    if interval is not None and (interval > 0).all():
        answer = np.where(answer == 1, interval, 3 - interval)
    if len(answer) < FEW or len(np.unique(rows["condition"])) < 2:
        return None
    return float(np.unique(answer, return_counts=True)[1].max() / len(answer))


def _left_there(rows: Mapping[str, np.ndarray]) -> float | None:
    start = rows.get("start", np.array([math.nan]))
    known = np.isfinite(start)
    if known.sum() < FEW:
        return None
    answer = rows["rating"]
    return float((np.abs(answer[known] - start[known]) <= 1e-3 * np.abs(start[known])).mean())


def _observer(name: str, rows: pd.DataFrame, rules: Rules) -> SubjectQuality:
    keys = [key for key in ("session", "trial") if key in rows]

    def time(of: pd.DataFrame, percept: str) -> pd.Series[float]:
        return of["duration"].where(of["percept"] == percept, 0.0).groupby([of[key] for key in keys]).sum()

    catch, rows = rows[rows["catch"]], rows[~rows["catch"]]
    nonrigid, rigid = time(catch, "nonrigid"), time(catch, "rigid")
    passed = nonrigid > rules.catch_share * (nonrigid + rigid)
    lasted = rows.groupby(keys)["trial_duration"].first()
    reported = time(rows, "rigid") + time(rows, "nonrigid")
    return SubjectQuality(
        name,
        len(lasted),
        len(passed),
        float(passed.mean()) if len(passed) else None,
        None,
        1 - float(reported.sum() / lasted.sum()) if len(lasted) else None,
        0,
        0,
        int((rows.groupby(keys)["dropped_frames"].max() > 0).sum()) if "dropped_frames" in rows else None,
    )
