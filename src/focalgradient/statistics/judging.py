"""Data quality of each subject, measured only by quantities about which hypotheses on blur make no prediction.

A subject for whom blur adds no depth must pass every measure as easily as one for whom it adds much; otherwise
exclusions would create an effect.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from focalgradient.analyses import Analysis
from focalgradient.statistics.criteria import Rules
from focalgradient.statistics.crossed import moments

__all__ = ["MIN_ANSWERS", "MIN_STARTS", "SubjectQuality", "judged_observers", "judged_raters"]


@dataclass(frozen=True, slots=True)
class SubjectQuality:
    """Quality measures of one subject, over all trials before exclusions.

    Parameters
    ----------
    participant_id, trials
        Participant, and number of trials without catch trials.
    catch_trials, catch_passed
        Number of catch trials with a correct answer, and the proportion passed; None without any.
    repeat_factor
        Geometric standard deviation of answers to the same picture; None without repetitions, or if answers are not
        ratios.
    lapses
        Proportion of lapses; for the cube, of the time without a gradient with no key or both keys held. None with too
        few answers, or if answers are not ratios.
    too_fast, too_slow
        Number of trials outside the response-time limits.
    dropped
        Number of trials with dropped frames; None if not recorded.
    same_answer
        Proportion of the most frequent answer (for choices: key) to pictures whose answers must differ regardless of
        blur; None with fewer than five such answers, and for the cube.
    first_press
        Proportion of answers left at the starting position of the marker, corrected for chance (Cohen's kappa); None
        with fewer than 8 recorded positions, or more where chance agreement is frequent (about 20 with two steps).
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

    @property
    def fast(self) -> float | None:
        """Proportion of trials answered too fast; None without trials."""
        return self.too_fast / self.trials if self.trials else None


EXAMPLES = {"example-flat": -1, "example-deep": 1}
"""Side of the scale's middle on which each catch drawing is answered correctly: flat (-1) or deep (1)."""

MIN_ANSWERS = 5
"""Minimum number of answers for the share of the most frequent one."""

MAX_SAME_CORRECT = 0.75
"""Maximum proportion of catch trials with the same correct answer: with more, a single error of an attentive subject
would reach the default limit of `Rules.same_answer`.
"""

MIN_STARTS = 8
"""Minimum number of recorded marker positions, for scales on which chance agreement is rare (our choice)."""

KAPPA_SE = 0.23
"""Maximum standard error of kappa from chance agreement: with two steps it requires 20 positions."""

SCENE_TEST_LEVEL = 0.001
"""Level of the F test that scenes differ at the pinhole; strict, as an error excludes honest subjects (our choice)."""

PERCEIVED_FRACTION = 1 / 3
"""Fraction of the other subjects' scene differences at which a subject must still answer scenes differently; otherwise
the rule is not applied (our choice).
"""


def judged_raters(table: pd.DataFrame, rules: Rules, analysis: Analysis) -> list[SubjectQuality]:
    """Assess each subject of a table of depth ratings, in alphabetical order."""
    catch = table["catch"].to_numpy(bool)
    off = np.full(len(table), math.nan)
    if analysis.ratios:
        off[~catch] = _deviations(table[~catch])
    answers = {"catch": catch, "off": off, "rating": table["rating"].to_numpy(float)}
    answers["side"] = _right_side(table, analysis)
    answers["pinhole"] = (table["aperture_mm"] == 0).to_numpy(bool) & ~catch
    answers["picture"] = table.groupby(["scene", "aperture", "fixation"], sort=False).ngroup().to_numpy()
    answers["condition"] = table.groupby(["aperture", "fixation"], sort=False).ngroup().to_numpy()
    for name in ("response_time", "dropped_frames", "interval", "start"):
        if name in table:
            answers[name] = table[name].to_numpy(float)
    apart = _scenes_differ(table[answers["pinhole"]], analysis, rules)
    of_subject = {str(name): rows for name, rows in table.groupby("participant_id").indices.items()}
    return [
        _rater(name, {key: values[of_subject[name]] for key, values in answers.items()}, rules, analysis, apart)
        for name in sorted(of_subject)
    ]


def _deviations(rows: pd.DataFrame) -> np.ndarray:
    """Return the absolute log ratio of each answer to the closer of two predictions.

    Both start from the subject's median for the condition. One is corrected for the picture over all subjects, the
    other for the scene within this subject. Thus neither deeper scenes, nor scenes that gain more from blur, nor
    subjects who differ from the majority produce lapses.
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
    """Return the side of the middle of a correct catch answer (0: near it); NaN if no answer is correct.

    The standard is a pinhole picture: the correct rating of a blurred version depends on the effect of blur.
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


def _scenes_differ(rows: pd.DataFrame, analysis: Analysis, rules: Rules) -> bool:
    """Return whether scenes at the pinhole differ so much that every honest observer must answer differently.

    This is decided by the subjects whose answers vary there: they must be the majority and agree on the scenes, and a
    subject who perceives only `PERCEIVED_FRACTION` of the differences must still give different answers on their steps.
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
    if stats.f.sf(between / max(residual, 1e-12), scenes - 1, (subjects - 1) * (scenes - 1)) >= SCENE_TEST_LEVEL:
        return False
    step = float(np.median([np.diff(np.unique(own.get_group(who))).min() for who in varied]))
    felt = PERCEIVED_FRACTION * cells.mean().to_numpy()
    given = np.floor((felt[:, None] + np.linspace(0, step, 20, endpoint=False)) / step)  # for any offset of the steps
    return all(_largest_share(answers) <= most for answers in given.T)


def _rater(
    name: str, answers: Mapping[str, np.ndarray], rules: Rules, analysis: Analysis, apart: bool
) -> SubjectQuality:
    catch = answers["catch"]
    passed = _passed(answers["rating"], answers["side"], rules, analysis)
    rows = {key: values[~catch] for key, values in answers.items()}
    picture = np.unique(rows["picture"], return_inverse=True)[1]
    count = np.bincount(picture)
    within_df = len(picture) - len(count)
    judged = not np.isnan(rows["off"]).all()
    spread, lapses = None, None
    if within_df and judged:
        answer = np.log(rows["rating"])
        away = answer - (np.bincount(picture, answer) / np.maximum(count, 1))[picture]
        spread = math.exp(math.sqrt(float((away**2).sum()) / within_df))
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
        _start_agreement(rows),
    )


def _passed(answer: np.ndarray, side: np.ndarray, rules: Rules, analysis: Analysis) -> np.ndarray:
    """Return which catch trials with a correct answer are passed."""
    known = ~np.isnan(side)
    answer, side, middle = answer[known], side[known], analysis.middle or 0.0
    if analysis.ratios:
        near = (answer >= middle / rules.catch_factor) & (answer <= middle * rules.catch_factor)
    else:
        near = np.abs(answer - middle) <= 1
    return np.where(side < 0, answer < middle, np.where(side > 0, answer > middle, near))


def _most_frequent(answers: Mapping[str, np.ndarray], apart: bool) -> float | None:
    """Return the proportion of the most frequent answer to catch trials, else to scenes at the pinhole."""
    given, right, interval = answers["rating"], answers["side"], answers.get("interval")
    if interval is not None and (interval > 0).all():  # keys pressed, and correct keys
        given, right = np.where(given == 1, interval, 3 - interval), np.where(right > 0, interval, 3 - interval)
    caught = ~np.isnan(answers["side"])
    if caught.sum() >= MIN_ANSWERS and _largest_share(right[caught]) <= MAX_SAME_CORRECT:
        return _largest_share(given[caught])
    if apart and answers["pinhole"].sum() >= MIN_ANSWERS:
        return _largest_share(given[answers["pinhole"]])
    return None


def _largest_share(values: np.ndarray) -> float:
    return float(np.unique(values, return_counts=True)[1].max() / len(values))


def _start_agreement(rows: Mapping[str, np.ndarray]) -> float | None:
    """Return the chance-corrected agreement (Cohen 1960) between answers and starting positions of the marker.

    With few steps, honest answers agree with random positions by chance.
    """
    start = rows.get("start", np.array([math.nan]))
    known = np.isfinite(start)
    if known.sum() < MIN_STARTS:
        return None
    answer, start = rows["rating"][known], start[known]
    same = np.abs(answer[:, None] - start) <= 1e-3 * np.abs(start)
    by_chance = float(same.mean())
    if by_chance >= 1 or by_chance > KAPPA_SE**2 * len(answer) * (1 - by_chance):
        return None
    return (float(same.diagonal().mean()) - by_chance) / (1 - by_chance)


def judged_observers(table: pd.DataFrame, rules: Rules) -> list[SubjectQuality]:
    """Assess each subject of a table of reports on the cube, in alphabetical order."""
    return [_observer(str(name), rows, rules) for name, rows in table.groupby("participant_id")]


def _observer(name: str, rows: pd.DataFrame, rules: Rules) -> SubjectQuality:
    keys = [key for key in ("session", "trial") if key in rows]

    def time(of: pd.DataFrame, percept: str) -> pd.Series[float]:
        return of["duration"].where(of["percept"] == percept, 0.0).groupby([of[key] for key in keys]).sum()

    catch, rows = rows[rows["catch"]], rows[~rows["catch"]]
    nonrigid, rigid = time(catch, "nonrigid"), time(catch, "rigid")
    passed = nonrigid > rules.catch_share * (nonrigid + rigid)
    plain = rows[rows["gradient"] == "none"]  # with a gradient, time without a report may depend on it
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
