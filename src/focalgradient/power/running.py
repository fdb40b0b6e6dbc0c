"""Execution of simulated experiments, saved to a file one by one, and summary of their results."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pandas as pd

from focalgradient.errors import InputError
from focalgradient.files import parse_json, printable, read_bytes, write_whole
from focalgradient.parallel import completed
from focalgradient.power.study import Study
from focalgradient.progress import Progress
from focalgradient.statistics.records import ALPHA

__all__ = [
    "Power",
    "drawn",
    "experiment",
    "power",
    "run",
    "run_here",
    "share_interval",
    "subjects_needed",
    "without_effect",
]

KEPT = ("subjects", "number", "width", "far_width", "left_out")
"""Columns of an experiment other than its tests."""


@dataclass(frozen=True, slots=True)
class Power:
    """Results of experiments with the same number of subjects.

    Parameters
    ----------
    subjects, experiments
        Number of subjects and of experiments.
    found
        Proportion of experiments in which each of the study's tests was significant; tests not computed count as not
        significant.
    standard_error
        Standard error of these proportions, due to the number of experiments, with two experiments more of either
        outcome (Agresti and Coull, 1998), so that it is not 0 where all or none of a few experiments are significant.
    joint, joint_error
        Proportion in which all tests were significant (power of all hypotheses together), and its standard error.
    width
        Median width of the 95 % confidence interval of the primary test (described by `Study.widths`), as the ratio
        of its limits if the study uses logarithms; NaN without one.
    far_width
        The same for another test.
    left_out
        Mean number of subjects excluded by the quality criteria.
    """

    subjects: int
    experiments: int
    found: Mapping[str, float]
    standard_error: Mapping[str, float]
    joint: float
    joint_error: float
    width: float
    far_width: float
    left_out: float


def run(
    study: Study,
    subjects: Sequence[int],
    experiments: int,
    file: Path,
    *,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """Simulate the experiments that a file does not contain yet, saving each as soon as it is complete.

    Parameters
    ----------
    study
        Power study.
    subjects, experiments
        Numbers of subjects; and number of experiments for each of them.
    file
        File of experiments, one line of JSON each, after a line that states the study. An interrupted run is continued.
    executor
        Executor of the simulations, without influence on the results. None: this process.
    progress
        Called with the fraction completed, 0 to 1, and a text on the number of experiments.

    Returns
    -------
    DataFrame
        One row per experiment, in order.

    Raises
    ------
    InputError
        If the file contains another study.
    """
    done = _begun(study, file)
    wanted = [(count, number) for number in range(experiments) for count in sorted(set(subjects))]
    missing = [task for task in wanted if task not in done]

    def tell(finished: int) -> None:
        if progress is not None:
            progress(finished / len(wanted), f"{finished} of {len(wanted)} experiments")

    tell(len(wanted) - len(missing))
    jobs = [(study, *task) for task in missing]
    with file.open("a", encoding="utf-8") as lines:
        for finished, (job, outcome) in enumerate(
            completed(executor, experiment, jobs), len(wanted) - len(missing) + 1
        ):
            count, number = missing[job]
            done[count, number] = outcome
            lines.write(json.dumps({"subjects": count, "number": number} | outcome) + "\n")
            lines.flush()
            tell(finished)
    rows = [{"subjects": count, "number": number} | done[count, number] for count, number in sorted(wanted)]
    return pd.DataFrame(rows)


def run_here(study: Study, subjects: Sequence[int], experiments: int, progress: Progress | None = None) -> pd.DataFrame:
    """Simulate experiments in this process without a file; return one row per experiment, as `run` does."""
    wanted = [(count, number) for count in sorted(set(subjects)) for number in range(experiments)]
    rows: list[dict[str, Any]] = []
    for count, number in wanted:
        if progress is not None:
            progress(len(rows) / len(wanted), f"power: {len(rows)} of {len(wanted)} experiments")
        rows.append({"subjects": count, "number": number} | study.experiment(count, number))
    return pd.DataFrame(rows)


def _begun(study: Study, file: Path) -> dict[tuple[int, int], dict[str, float | None]]:
    """Read the file's experiments, creating it if missing; truncated or damaged lines are removed and run again."""
    head = json.dumps({"focalgradient": version("focalgradient")} | study.settings())
    text = read_bytes(file, "experiments.jsonl").decode("utf-8", "replace") if file.exists() else ""
    first, *lines = text.split("\n")
    if text and first != head:
        raise InputError(
            f"{printable(file)} contains experiments with another effect, design, bound, seed or version, or is "
            "damaged: "
            "give another folder."
        )
    rows = {line: row for line in lines if (row := _row(line, study.tests)) is not None}
    whole = "".join(f"{line}\n" for line in (head, *rows))
    if text != whole:
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                f"{printable(file.parent)} cannot be created ({error.strerror}): give another folder."
            ) from error
        write_whole(file, whole.encode())
    return {(int(row.pop("subjects") or 0), int(row.pop("number") or 0)): row for row in rows.values()}


def _row(line: str, tests: Mapping[str, str]) -> dict[str, float | None] | None:
    """Parse a line of an experiment; None if it is incomplete."""
    try:
        row = parse_json(line, "a line")
    except InputError:
        return None
    if not isinstance(row, dict) or set(row) != {*KEPT, *tests}:
        return None
    numbers = {name: value for name, value in row.items() if value is not None or name not in ("width", "far_width")}
    return row if all(type(value) in (int, float) for value in numbers.values()) else None


def experiment(task: tuple[Study, int, int]) -> dict[str, float | None]:
    """Simulate and analyse an experiment of a study, with a number of subjects and its own number."""
    study, subjects, number = task
    return study.experiment(subjects, number)


def power(experiments: pd.DataFrame, *, logs: bool = True) -> list[Power]:
    """Summarise experiments by number of subjects.

    Parameters
    ----------
    experiments
        One row per experiment, with `subjects` and the results of `Study.outcome`.
    logs
        Whether widths are logarithms, to be reported as ratios: `People.logs`.

    Examples
    --------
    >>> rows = [{"subjects": 6, "left_out": 0, "near_rise": one, "far_equivalent": 0, "interaction": 1,
    ...          "width": 0.1, "far_width": 0.1} for one in (0, 1, 1, 1)]
    >>> power(pd.DataFrame(rows))[0].found["near_rise"]
    0.75
    """
    tests = [name for name in experiments if name not in KEPT]
    summed = []
    for subjects, rows in experiments.groupby("subjects"):
        found = {str(name): float(rows[name].mean()) for name in tests}
        error = {name: _error(share, len(rows)) for name, share in found.items()}
        joint = float((rows[tests] == 1).all(axis=1).mean())
        medians = [float(rows[name].astype(float).median()) for name in ("width", "far_width")]
        width, far = (math.exp(one) for one in medians) if logs else medians
        left_out = float(rows["left_out"].mean())
        shares = (found, error, joint, _error(joint, len(rows)))
        summed.append(Power(int(str(subjects)), len(rows), *shares, width, far, left_out))
    return summed


def _error(share: float, experiments: int) -> float:
    more = (share * experiments + 2) / (experiments + 4)
    return math.sqrt(more * (1 - more) / (experiments + 4))


def subjects_needed(shares: Mapping[int, float], power: float) -> int | None:
    """Interpolate the number of subjects from which on a power is reached; None if it is not within those simulated.

    Between the largest simulated number of subjects below the power and the next, power is taken as linear.

    Parameters
    ----------
    shares
        Power by number of subjects.
    power
        Power to be reached.

    Examples
    --------
    >>> subjects_needed({6: 0.5, 10: 0.9, 20: 1.0}, 0.8)
    9
    """
    counts = sorted(shares)
    below = [number for number, count in enumerate(counts) if shares[count] < power]
    if not below or below[-1] == len(counts) - 1:
        return None
    low, high = counts[below[-1] : below[-1] + 2]
    part = (power - shares[low]) / (shares[high] - shares[low])
    return math.ceil(round(low + part * (high - low), 9))


def share_interval(share: float, experiments: int) -> tuple[float, float]:
    """Return the 95 % interval (Wilson) of a proportion of simulated experiments.

    >>> low, high = share_interval(1.0, 100)
    >>> round(low, 3), high
    (0.963, 1.0)
    """
    from statsmodels.stats.proportion import proportion_confint  # type: ignore[import-untyped]

    low, high = proportion_confint(share * experiments, experiments, method="wilson")
    return float(low), float(high)


def without_effect(found: Sequence[Power], study: Study) -> list[str]:
    """Return the tests of effects whose power exceeds .05 at no number of subjects: their people do not differ."""
    return [
        study.tests[name]
        for name, claim in study.claims.items()
        if claim.factor is None and all(share_interval(one.found[name], one.experiments)[0] <= ALPHA for one in found)
    ]


def drawn(found: Sequence[Power], study: Study) -> dict[str, Any]:
    """Return what `focalgradient.plotting.power.power_figure` draws of experiments."""
    powers = {meaning: [one.found[name] for one in found] for name, meaning in study.tests.items()}
    if len(powers) > 1:
        powers["all tests"] = [one.joint for one in found]
    shares = {
        meaning: [(share, *share_interval(share, one.experiments)) for share, one in zip(own, found, strict=True)]
        for meaning, own in powers.items()
    }
    widths = {
        label: [getattr(one, name) for one in found]
        for name, label in zip(("width", "far_width"), study.widths, strict=True)
    }
    model = study.model
    return {
        "subjects": [one.subjects for one in found],
        "shares": shares,
        "widths": widths,
        "width_label": model.width_label,
        "logs": model.logs,
        "share_label": "power (%)"
        if all(claim.factor is None for claim in study.claims.values())
        else "experiments (%)",
    }
