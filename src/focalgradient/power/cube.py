"""Power of experiment 2: reports of simulated subjects on the turning cube, judged and analysed.

Rigid and nonrigid readings take turns, each for a log-normally distributed time that is correlated with the one before.
The log odds of the time in which the nonrigid one is reported are the subject's own without a gradient; a gradient that
favours it adds the subject's shift times its strength over the largest, and one that favours the rigid reading takes as
much away.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
import pandas as pd
from numpy.random import SeedSequence, default_rng

from focalgradient.design import NeckerDesign, NeckerTrial
from focalgradient.errors import InputError, check_fields
from focalgradient.power.checks import check_lapses, check_spreads
from focalgradient.power.study import AnyStudy, model_of
from focalgradient.statistics import Effect, NotComputed, quality
from focalgradient.statistics.means import family, holm, paired_effect
from focalgradient.statistics.records import ALPHA

__all__ = ["CubeModel", "CubeStudy", "cube_experiment", "quick_cube_power", "simulated_reports"]

CUBE_TESTS = {
    "nonrigid_longer": "nonrigid gradient: nonrigid for longer",
    "nonrigid_shorter": "rigid gradient: nonrigid for less long",
}
"""What is counted, and what it means: at the largest strength, by Holm's p over all gradients and strengths."""

ANALYSIS = 3
"""Number of the analysis, stated in the file of experiments: those of another are not gone on with."""

UNAMBIGUOUS = 4.0
"""Log odds of the nonrigid reading of a catch trial, whose shape is nonrigid beyond doubt."""

ROWS = ("trial", "gradient", "strength", "catch", "onset", "duration", "percept", "censored", "trial_duration")


@dataclass(frozen=True, slots=True, kw_only=True)
class CubeModel:
    """Simulated subjects of experiment 2; docs/power.md gives the source of each number.

    Parameters
    ----------
    effect
        Ratio of the odds of the nonrigid reading (its time over that of the rigid one) with a gradient that favours it,
        at the largest strength, to those without a gradient. A gradient that favours the rigid reading divides them.
    between
        Standard deviation over subjects of the logarithm of that ratio.
    nonrigid
        Share of the time, of that with either reading, that is nonrigid without a gradient, for the median subject.
    between_levels
        Standard deviation over subjects of the log odds without a gradient.
    dominance, between_dominances, duration_spread
        Geometric mean over people of the mean time (s) that a reading lasts at even odds, the standard deviation of its
        logarithm over people, and the standard deviation of a person's own log durations.
    serial
        Correlation of a log duration with that of the reading before it in the trial.
    first_ratio
        Median duration of the first reading of a trial over that of later ones, for the same reading. The first one is
        the preferred one more often than not, and so lasts longer in the mean; 22 people have no more than that.
    lapses
        Share of trials that are answered without looking, at even odds.

    Raises
    ------
    InputError
        If a number is out of range.
    """

    effect: float = 1.5
    between: float = 0.3
    nonrigid: float = 0.2
    between_levels: float = 0.7
    dominance: float = 5.2
    between_dominances: float = 0.54
    duration_spread: float = 0.8
    serial: float = 0.24
    first_ratio: float = 1.0
    lapses: float = 0.01

    def __post_init__(self) -> None:
        check_fields(self)
        if not 0.01 <= self.effect <= 100:
            raise InputError(
                f"effect is {self.effect!r}, but must be a ratio of odds from 0.01 to 100: 1 is no effect."
            )
        check_spreads(self, "between", "between_levels", "between_dominances")
        if not 0.001 <= self.nonrigid <= 0.999:  # beyond, less than a video frame of a trial is left of one reading
            raise InputError(f"nonrigid is {self.nonrigid!r}, but must be a share from 0.001 to 0.999, like 0.2.")
        for name, least, most in (
            ("dominance", 0.5, 100.0),
            ("duration_spread", 0.05, 3.0),
            ("serial", -0.9, 0.9),
            ("first_ratio", 0.1, 10.0),
        ):
            value = getattr(self, name)
            if not least <= value <= most:
                raise InputError(f"{name} is {value!r}, but must be a number from {least:g} to {most:g}.")
        check_lapses(self.lapses)


@dataclass(frozen=True, slots=True)
class CubeStudy(AnyStudy):
    """What is simulated of experiment 2.

    Parameters
    ----------
    model
        How subjects answer.
    design
        What they are shown.
    seed
        Of all chance.

    Raises
    ------
    InputError
        If the design lacks what is tested.
    """

    model: CubeModel
    design: NeckerDesign
    seed: int = 1

    seconds: ClassVar[float] = 0.012
    width_label: ClassVar[str] = "95 % interval of the change of the nonrigid share: width"

    @classmethod
    def of(cls, design: NeckerDesign, assumed: Mapping[str, float], seed: int) -> CubeStudy:
        """Make the study of the numbers that were given: see `focalgradient.tasks.Task.study`."""
        return cls(model_of(CubeModel, assumed, design.task), design, seed)

    def __post_init__(self) -> None:
        check_fields(self)
        if "none" not in self.design.gradients or len(self.design.gradients) < 2:
            raise InputError("The design needs trials without a gradient and with one: there is nothing to compare.")

    def settings(self) -> dict[str, object]:
        """Return all of it, as a file may hold it."""
        stated = {"seed": self.seed, "model": dataclasses.asdict(self.model), "analysis": ANALYSIS}
        return stated | {"design": self.design.model_dump(mode="json"), "simulated": True}

    @property
    def tests(self) -> Mapping[str, str]:
        gradients = {"nonrigid": "nonrigid_longer", "rigid": "nonrigid_shorter"}
        return {name: CUBE_TESTS[name] for gradient, name in gradients.items() if gradient in self.design.gradients}

    @property
    def widths(self) -> tuple[str, str]:
        return "nonrigid gradient", "rigid gradient"

    @property
    def spreads(self) -> tuple[str, ...]:
        return "between", "between_levels", "between_dominances"

    def table(self, subjects: int, rng: np.random.Generator) -> pd.DataFrame:
        return simulated_reports(self.design, subjects, self.model, rng)

    def outcome(self, table: pd.DataFrame) -> dict[str, float | None]:
        return cube_outcome(self, table)

    def primary(self, table: pd.DataFrame) -> Effect | NotComputed:
        gradient = "nonrigid" if "nonrigid" in self.design.gradients else "rigid"
        changes = _changes(table)[gradient, max(self.design.strengths_mm)].dropna().to_numpy(dtype=float)
        return paired_effect(changes, "t")

    def without_effect(self) -> CubeStudy:
        return dataclasses.replace(self, model=dataclasses.replace(self.model, effect=1.0))

    def experiment(self, subjects: int, number: int) -> dict[str, float | None]:
        """One experiment: see `cube_experiment`."""
        return cube_experiment(self, subjects, number)


@cache
def _trials(design_json: str, participant: str) -> tuple[NeckerTrial, ...]:
    """The trials that count; making a list takes longer than simulating it."""
    design = NeckerDesign.model_validate_json(design_json)
    return tuple(trial for trial in design.trials(participant) if trial.phase == "main")


def simulated_reports(design: NeckerDesign, subjects: int, model: CubeModel, rng: np.random.Generator) -> pd.DataFrame:
    """Reports of simulated subjects, in the columns that a data set has: a row a report.

    Parameters
    ----------
    design
        What they are shown.
    subjects
        How many.
    model
        How they answer.
    rng
        Source of chance.

    Examples
    --------
    >>> table = simulated_reports(NeckerDesign(), 2, CubeModel(), default_rng(1))
    >>> table["trial"].nunique(), sorted(table["percept"].unique())
    (21, ['nonrigid', 'rigid'])
    """
    text = design.model_dump_json()
    signs = {"none": 0.0, "rigid": -1.0, "nonrigid": 1.0}
    tables = []
    for number in range(1, subjects + 1):
        level = math.log(model.nonrigid / (1 - model.nonrigid)) + rng.normal(0, model.between_levels)
        shift = rng.normal(math.log(model.effect), model.between)
        dominance = model.dominance * math.exp(rng.normal(0, model.between_dominances))
        rows: list[tuple[object, ...]] = []
        for trial in _trials(text, f"{number:02}"):
            odds = level + signs[trial.gradient] * shift * trial.strength / max(design.strengths_mm)
            if trial.catch:
                odds = UNAMBIGUOUS
            if rng.random() < model.lapses:
                odds = 0.0
            for onset, lasts, percept in _reports(trial.trial_s, odds, dominance, model, rng):
                cut = onset + lasts >= trial.trial_s
                rows.append(
                    (
                        trial.trial,
                        trial.gradient,
                        trial.strength,
                        trial.catch,
                        onset,
                        lasts,
                        percept,
                        cut,
                        trial.trial_s,
                    )
                )
        table = pd.DataFrame(rows, columns=list(ROWS))
        tables.append(table.assign(participant_id=f"sub-{number:02}", session="", kind="simulated", dropped_frames=0))
    return pd.concat(tables, ignore_index=True)


def _reports(
    duration: float, odds: float, dominance: float, model: CubeModel, rng: np.random.Generator
) -> list[tuple[float, float, str]]:
    """Onset, duration and reading of each report, till the trial ends: but for the first, times are as exp(odds)."""
    percepts, spread = ("rigid", "nonrigid"), model.duration_spread
    means = (dominance * math.exp(-odds / 2), dominance * math.exp(odds / 2))
    now, percept = 0.0, int(rng.random() < 1 / (1 + math.exp(-odds)))
    factor, residual, kept = model.first_ratio, rng.standard_normal(), math.sqrt(1 - model.serial**2)
    reports = []
    while now < duration:
        lasts = max(factor * means[percept] * math.exp(spread * residual - spread**2 / 2), 1e-3)
        reports.append((now, min(lasts, duration - now), percepts[percept]))
        now, percept, factor = now + lasts, 1 - percept, 1.0
        residual = model.serial * residual + kept * rng.standard_normal()
    return reports


def cube_experiment(study: CubeStudy, subjects: int, number: int) -> dict[str, float | None]:
    """One experiment through the whole chain: reports, quality, the tests of the shares of time.

    Parameters
    ----------
    study
        What is simulated.
    subjects
        How many take part.
    number
        Of the experiment: another number, other subjects.

    Returns
    -------
    dict
        For each of the study's tests 1.0 if it came out, else 0.0; `width` and `far_width`, of the 95 % intervals of
        the changes of the nonrigid share by the gradients of the nonrigid and of the rigid reading at the largest
        strength, None where there is none; and `left_out`, subjects that quality left out.
    """
    return study.outcome(study.table(subjects, study.stream(subjects, number)))


def cube_outcome(study: CubeStudy, table: pd.DataFrame) -> dict[str, float | None]:
    """Judge and analyse reports: see `cube_experiment`."""
    kept, found = quality(table)
    outcome: dict[str, float | None] = dict.fromkeys(study.tests, 0.0) | {"width": None, "far_width": None}
    outcome["left_out"] = float(found.subjects_before - found.subjects_after)
    if not found.subjects_after:
        return outcome
    changed = _changes(kept)
    changes = {condition: changed[condition].dropna().to_numpy(dtype=float) for condition in changed}
    effects = dict(zip(changes, family(paired_effect(one, "t") for one in changes.values()), strict=True))
    largest = max(study.design.strengths_mm)
    for gradient, sign, name, width in (
        ("nonrigid", 1, "nonrigid_longer", "width"),
        ("rigid", -1, "nonrigid_shorter", "far_width"),
    ):
        effect = effects.get((gradient, largest))
        if isinstance(effect, Effect):
            outcome[width] = effect.high - effect.low
            outcome[name] = float(effect.p_holm is not None and effect.p_holm < ALPHA and sign * effect.estimate > 0)
    return outcome


def quick_cube_power(
    study: CubeStudy, subjects: Sequence[int], experiments: int = 2000, people: int = 400
) -> dict[int, dict[str, float]]:
    """Power of the study's tests for several numbers of subjects, from one pool of simulated people; nobody left out.

    Parameters
    ----------
    study
        What is simulated.
    subjects
        How many take part in an experiment.
    experiments
        How many are drawn from the pool for each number: 2000 give a share to .011, one standard error at .5.
    people
        In the pool, whose reports are simulated once.

    Returns
    -------
    dict
        For each number of subjects the share of experiments in which each test comes out.

    Examples
    --------
    >>> design = NeckerDesign(strengths_mm=(4.0,), repetitions=1)
    >>> found = quick_cube_power(CubeStudy(CubeModel(effect=4.0, between=0.1), design), [10], 200, 60)
    >>> found[10]["nonrigid_longer"] > 0.8
    True
    """
    from scipy import stats

    rng = default_rng(SeedSequence([study.seed, people, experiments]))
    pool = _changes(simulated_reports(study.design, people, study.model, rng)).dropna()
    conditions: list[object] = list(pool.columns)
    largest = max(study.design.strengths_mm)
    found = {}
    for number in subjects:
        own = pool.to_numpy(dtype=float)[rng.integers(len(pool), size=(experiments, number))]
        t = own.mean(axis=1) / (own.std(axis=1, ddof=1) / math.sqrt(number))
        corrected = holm(2 * stats.t.sf(np.abs(t), number - 1)) < ALPHA
        place = {"nonrigid_longer": ("nonrigid", largest), "nonrigid_shorter": ("rigid", largest)}
        sign = {"nonrigid_longer": 1, "nonrigid_shorter": -1}
        columns = {test: conditions.index(place[test]) for test in study.tests}
        found[number] = {
            test: float((corrected[:, column] & (sign[test] * t[:, column] > 0)).mean())
            for test, column in columns.items()
        }
    return found


def _changes(table: pd.DataFrame) -> pd.DataFrame:
    """Each subject's change of the nonrigid share of time by each gradient, as `statistics.necker` has them.

    A row a subject, a column a gradient and strength; NaN where neither reading was reported.
    """
    rows = table[~table["catch"]]
    times = rows.groupby(["participant_id", "gradient", "strength", "percept"])["duration"].sum().unstack(fill_value=0)
    times = times.reindex(columns=["rigid", "nonrigid"], fill_value=0.0)
    share = times["nonrigid"] / times.sum(axis=1)
    conditions = sorted({(str(gradient), float(strength)) for _, gradient, strength in share.index.tolist()})
    own = {(gradient, strength): share.xs((gradient, strength), level=(1, 2)) for gradient, strength in conditions}
    return pd.DataFrame(
        {condition: rows - own["none", 0.0] for condition, rows in own.items() if condition[0] != "none"}
    )
