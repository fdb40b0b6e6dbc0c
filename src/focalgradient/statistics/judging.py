"""How each subject did, judged by what no hypothesis about blur predicts.

A subject to whom blur adds no depth must come through every measure as one to whom it adds much; else leaving subjects
out would make an effect.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from focalgradient.scales import Analysis
from focalgradient.statistics.criteria import Rules
from focalgradient.statistics.crossed import moments

__all__ = ["FEW", "FEW_STARTS", "SubjectQuality", "judged_observers", "judged_raters"]


@dataclass(frozen=True, slots=True)
class SubjectQuality:
    """How one subject did, in all trials as they came.

    Parameters
    ----------
    participant_id, trials
        Who, and how many trials without catch trials.
    catch_trials, catch_passed
        How many catch trials have a right answer, and the share passed; None without any.
    repeat_factor
        Spread of answers to one and the same picture, a geometric standard deviation; None where none was repeated, and
        where answers are not ratios.
    lapses
        Share of lapses; with the cube, of the time without a gradient in which no key or both were held. None where
        there are too few answers, and where answers are not ratios.
    too_fast, too_slow
        Trials outside the bounds of response time.
    dropped
        Trials with any dropped frame; None where none were counted.
    same_answer
        Share of the most frequent answer (of a choice: key) to pictures whose answers must differ whatever blur does;
        None where there are fewer than five such answers, and with the cube.
    first_press
        Share of answers left where the marker first stood, corrected for chance (Cohen's kappa); None where fewer than
        20 such places were recorded.
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


EXAMPLES = {"example-flat": -1, "example-deep": 1}
"""Drawings that look clearly flat or deep, and the side of the middle on which they are answered."""

FEW = 5
"""Minimum number of answers for the share of the most frequent one."""

MOST_ALIKE = 0.75
"""Largest share of catch trials whose right answers are alike: with more, an attentive subject who errs once would
reach the default limit of `Rules.same_answer`."""

FEW_STARTS = 8
"""Minimum number of recorded marker places: a choice, for scales on which chance hardly ever meets them."""

KAPPA_SE = 0.23
"""Largest standard error that chance may leave kappa: with two steps it asks for 20 places."""

TOLD_APART_P = 0.001
"""Level of the F test that scenes differ at the pinhole: our choice, as an error leaves out honest subjects."""

FELT = 1 / 3
"""Share of the other subjects' differences between scenes: who feels that much must answer scenes differently, else
nobody is judged by them. Our choice."""


def judged_raters(table: pd.DataFrame, rules: Rules, analysis: Analysis) -> list[SubjectQuality]:
    """Judge each subject of a table of depth ratings, in the order of their names."""
    catch = table["catch"].to_numpy(bool)
    off = np.full(len(table), math.nan)
    if analysis.ratios:
        off[~catch] = _unexpected(table[~catch])
    answers = {"catch": catch, "off": off, "rating": table["rating"].to_numpy(float)}
    answers["side"] = _right_side(table, analysis)
    answers["pinhole"] = (table["aperture_mm"] == 0).to_numpy(bool) & ~catch
    answers["picture"] = table.groupby(["scene", "aperture", "fixation"], sort=False).ngroup().to_numpy()
    answers["condition"] = table.groupby(["aperture", "fixation"], sort=False).ngroup().to_numpy()
    for name in ("response_time", "dropped_frames", "interval", "start"):
        if name in table:
            answers[name] = table[name].to_numpy(float)
    apart = _told_apart(table[answers["pinhole"]], analysis, rules)
    of_subject = {str(name): rows for name, rows in table.groupby("participant_id").indices.items()}
    return [
        _rater(name, {key: values[of_subject[name]] for key, values in answers.items()}, rules, analysis, apart)
        for name in sorted(of_subject)
    ]


def _unexpected(rows: pd.DataFrame) -> np.ndarray:
    """Absolute log of each answer over what was to be expected: of two expectations, the nearer.

    Both begin with the subject's median for the condition. One is corrected by what the picture adds for all subjects,
    the other by what its scene adds for this subject. So scenes that look deeper, or gain more by blur, make no lapses,
    and neither do subjects who do not see what most see.
    """
    own = ["participant_id", "aperture", "fixation"]
    corrections = [["participant_id", "scene"]]
    if rows["participant_id"].nunique() > 2:
        corrections.append(["scene", "aperture", "fixation"])
    logs = pd.Series(np.log(rows["rating"].to_numpy()), index=np.arange(len(rows)))
    condition = rows.groupby(own, sort=False).ngroup().to_numpy()
    found = []
    for correction in corrections:
        shown = rows.groupby(correction, sort=False).ngroup().to_numpy()
        off = logs.copy()
        for groups in (condition, shown, condition):
            off -= off.groupby(groups).transform("median")
        found.append(np.abs(off.to_numpy()))
    return np.min(found, axis=0)


def _right_side(table: pd.DataFrame, analysis: Analysis) -> np.ndarray:
    """Side of the middle on which a catch trial is answered rightly, 0 for near it; NaN where no answer is right.

    The standard is a pinhole picture: how a blurred picture of it should be rated depends on what blur does.
    """
    side = np.full(len(table), math.nan)
    if analysis.middle is None:
        return side
    catch, scene = table["catch"].to_numpy(bool), table["scene"].to_numpy(object)
    if analysis.standard_known:
        side[catch & (table["aperture_mm"] == 0).to_numpy(bool)] = 0
    for name, right in EXAMPLES.items():
        side[catch & (scene == name)] = right
    return side


def _told_apart(rows: pd.DataFrame, analysis: Analysis, rules: Rules) -> bool:
    """Whether scenes at the pinhole, where blur can do nothing, differ so much that every honest answer must differ.

    Judged by the subjects whose answers vary there: they must be the majority and agree on the scenes, and whoever
    feels only `FELT` of the differences must still give different answers in steps as theirs.
    """
    if rows.empty or analysis.binary:
        return False
    values = np.log(rows["rating"]) if analysis.ratios else rows["rating"].astype(float)
    rows = pd.DataFrame({"who": rows["participant_id"], "scene": rows["scene"], "answer": values})
    most = 1.0 if rules.same_answer is None else rules.same_answer
    own = rows.groupby("who")["answer"]
    shares = own.agg(lambda answers: answers.value_counts(normalize=True).iloc[0])
    varied = shares.index[shares <= most]
    cells = rows[rows["who"].isin(varied)].groupby(["who", "scene"])["answer"].mean().unstack()
    cells = cells.dropna(axis="columns")
    if 2 * len(varied) <= len(shares) or min(cells.shape) < 3:
        return False
    found, (subjects, scenes) = moments(cells.to_numpy()), cells.shape
    between, residual = float(found.scenes), float(found.residual)
    if stats.f.sf(between / max(residual, 1e-12), scenes - 1, (subjects - 1) * (scenes - 1)) >= TOLD_APART_P:
        return False
    step = float(np.median([np.diff(np.unique(own.get_group(who))).min() for who in varied]))
    felt = FELT * cells.mean().to_numpy()
    given = np.floor((felt[:, None] + np.linspace(0, step, 20, endpoint=False)) / step)  # wherever its steps lie
    return all(_largest_share(answers) <= most for answers in given.T)


def _rater(
    name: str, answers: Mapping[str, np.ndarray], rules: Rules, analysis: Analysis, apart: bool
) -> SubjectQuality:
    catch = answers["catch"]
    passed = _passed(answers["rating"], answers["side"], rules, analysis)
    rows = {key: values[~catch] for key, values in answers.items()}
    picture = np.unique(rows["picture"], return_inverse=True)[1]
    count = np.bincount(picture)
    freedom = len(picture) - len(count)
    judged = not np.isnan(rows["off"]).all()
    spread, lapses = None, None
    if freedom and judged:
        answer = np.log(rows["rating"])
        away = answer - (np.bincount(picture, answer) / np.maximum(count, 1))[picture]
        spread = math.exp(math.sqrt(float((away**2).sum()) / freedom))
    condition = np.unique(rows["condition"], return_inverse=True)[1]
    enough = np.bincount(condition)[condition] >= 3
    if enough.any() and judged:
        lapses = float((rows["off"] > math.log(rules.lapse_factor))[enough].mean())
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
        _most_frequent(answers, apart),
        _left_there(rows),
    )


def _passed(answer: np.ndarray, side: np.ndarray, rules: Rules, analysis: Analysis) -> np.ndarray:
    """Which of the catch trials that have a right answer are passed."""
    known = ~np.isnan(side)
    answer, side, middle = answer[known], side[known], analysis.middle or 0.0
    if analysis.ratios:
        near = (answer >= middle / rules.catch_factor) & (answer <= middle * rules.catch_factor)
    else:
        near = np.abs(answer - middle) <= 1
    return np.where(side < 0, answer < middle, np.where(side > 0, answer > middle, near))


def _most_frequent(answers: Mapping[str, np.ndarray], apart: bool) -> float | None:
    """Share of the most frequent answer where answers must differ: to catch trials, else to scenes at the pinhole."""
    given, right, interval = answers["rating"], answers["side"], answers.get("interval")
    if interval is not None and (interval > 0).all():  # keys, and those that are right
        given, right = np.where(given == 1, interval, 3 - interval), np.where(right > 0, interval, 3 - interval)
    caught = ~np.isnan(answers["side"])
    if caught.sum() >= FEW and _largest_share(right[caught]) <= MOST_ALIKE:
        return _largest_share(given[caught])
    if apart and answers["pinhole"].sum() >= FEW:
        return _largest_share(given[answers["pinhole"]])
    return None


def _largest_share(values: np.ndarray) -> float:
    return float(np.unique(values, return_counts=True)[1].max() / len(values))


def _left_there(rows: Mapping[str, np.ndarray]) -> float | None:
    """Agreement of answers with the places where the marker first stood, corrected for chance (Cohen 1960).

    Where there are few steps, honest answers agree with random places by chance.
    """
    start = rows.get("start", np.array([math.nan]))
    known = np.isfinite(start)
    if known.sum() < FEW_STARTS:
        return None
    answer, start = rows["rating"][known], start[known]
    same = np.abs(answer[:, None] - start) <= 1e-3 * np.abs(start)
    by_chance = float(same.mean())
    if by_chance >= 1 or by_chance > KAPPA_SE**2 * len(answer) * (1 - by_chance):
        return None
    return (float(same.diagonal().mean()) - by_chance) / (1 - by_chance)


def judged_observers(table: pd.DataFrame, rules: Rules) -> list[SubjectQuality]:
    """Judge each subject of a table of reports on the cube, in the order of their names."""
    return [_observer(str(name), rows, rules) for name, rows in table.groupby("participant_id")]


def _observer(name: str, rows: pd.DataFrame, rules: Rules) -> SubjectQuality:
    keys = [key for key in ("session", "trial") if key in rows]

    def time(of: pd.DataFrame, percept: str) -> pd.Series[float]:
        return of["duration"].where(of["percept"] == percept, 0.0).groupby([of[key] for key in keys]).sum()

    catch, rows = rows[rows["catch"]], rows[~rows["catch"]]
    nonrigid, rigid = time(catch, "nonrigid"), time(catch, "rigid")
    passed = nonrigid > rules.catch_share * (nonrigid + rigid)
    plain = rows[rows["gradient"] == "none"]  # with a gradient, how long no reading is reported may depend on it
    lasted = plain.groupby(keys)["trial_duration"].first()
    reported = time(plain, "rigid") + time(plain, "nonrigid")
    return SubjectQuality(
        name,
        len(rows.drop_duplicates(keys)),
        len(passed),
        float(passed.mean()) if len(passed) else None,
        None,
        1 - float(reported.sum() / lasted.sum()) if len(lasted) else None,
        0,
        0,
        int((rows.groupby(keys)["dropped_frames"].max() > 0).sum()) if "dropped_frames" in rows else None,
    )
