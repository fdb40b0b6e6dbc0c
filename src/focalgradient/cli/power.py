"""``focalgradient power``: power analysis by simulation of whole experiments."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

import click

import focalgradient as fg
from focalgradient.cli.design_options import simulated_task
from focalgradient.cli.generate import File, Folder, Made, command, options_named, sentences
from focalgradient.cli.groups import Workers
from focalgradient.cli.program import announce, resumable, show, writable, write_set
from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.quantities import POSITIVE
from focalgradient.tasks import task_named

if TYPE_CHECKING:
    import pandas as pd

    from focalgradient.power import Study

__all__ = ["power"]


def _counts(option: str, given: str) -> tuple[int, ...]:
    """Parse numbers of subjects, such as "6,10,20"."""
    try:
        counts = tuple(sorted({int(each) for each in given.split(",")}))
    except ValueError:
        counts = ()
    if not counts or counts[0] < 2 or counts[-1] > 1000:
        raise InputError(f"{option} is {given}, but must be whole numbers from 2 to 1000, such as 6,10,20.")
    return counts


@dataclass(frozen=True)
class Model:
    """Statistical model of the subjects, as options; `focalgradient.power` has the models and their ranges.

    Parameters
    ----------
    effect
        Ratings: near depth effect at the largest aperture, as a ratio; for steps, visual-analogue scales and choices
        the odds ratio of a higher answer; cube: odds ratio of the nonrigid percept with its gradient to without.
        [default: 1.3; odds ratios 3; cube 1.5]
    far_effect
        Ratings: far depth effect; 1 means none.  [default: 1]
    between
        SD over subjects of the log of each effect (thresholds: of the log threshold).  [default: 0.15; steps,
        visual-analogue scales and choices 1; cube 0.3; thresholds 0.4]
    between_scenes
        Ratings: SD over scenes, common to all subjects.  [default: 0.05; steps, visual-analogue scales and choices 0.5]
    noise
        Ratio scales: SD of the log of a single rating.  [default: 0.3]
    nonrigid
        Cube: proportion of time of the nonrigid percept without a gradient.  [default: 0.2]
    between_levels
        Cube: SD over subjects of the log odds of --nonrigid.  [default: 0.7]
    lapses
        Lapse rate of ratings, or of trials of the cube.  [default: 0.01]
    bound
        Ratio scales: equivalence bound, the smallest relevant effect as a ratio; thresholds: the factor within which
        the mean must be known.  [default: 1.2]
    """

    effect: Annotated[float | None, "FACTOR"] = None
    far_effect: Annotated[float | None, "FACTOR"] = None
    between: Annotated[float | None, "SD"] = None
    between_scenes: Annotated[float | None, "SD"] = None
    noise: Annotated[float | None, "SD"] = None
    nonrigid: Annotated[float | None, "SHARE"] = None
    between_levels: Annotated[float | None, "SD"] = None
    lapses: Annotated[float | None, "SHARE"] = None
    bound: Annotated[float | None, POSITIVE, "FACTOR"] = None

    def given(self) -> dict[str, Any]:
        """Return the parameters that were given."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@command("Simulate how many subjects an experiment needs.")
def power(
    task: Annotated[str, simulated_task],
    /,
    *,
    out: Folder,
    subjects: Annotated[Sequence[int], _counts, "N,..."] = (6, 10, 20),
    model: Annotated[Model, Made(Model)],
    sensitivity: bool = False,
    design: File | None = None,
    experiments: Annotated[int, click.IntRange(1, 1_000_000), "N"] = 1000,
    seed: Annotated[int, click.IntRange(0), "N"] = 1,
    workers: Workers,
) -> None:
    """Simulate whole experiments of TASK, and count how many find the effect.

    TASK is depth-rating (on the response scale of its design), necker, blur-threshold, or a user-defined task, given by
    its name or Python file. Subjects are drawn from a statistical model given by the options, or are a user-defined
    task's simulated observers; each experiment is analysed with exclusions and tests as in a report. For
    thresholds, which are estimated, the precision is evaluated. Writes power.csv and the figure (PNG, PDF). Every
    experiment is saved in experiments.jsonl as soon as it is complete: after an interruption the same command
    continues.

    Reads only --design (TOML; 'focalgradient run depth-rating --print-design' writes one). The default of a thousand
    experiments for each number of subjects takes about 3 min on two cores, with steps about 10 min; a hundred give
    proportions to 5 %.

    \b
    Examples:
      focalgradient power depth-rating --subjects 6,10,20 --effect 1.3 --out power
      focalgradient power depth-rating --subjects 10 --experiments 100 --out quick
      focalgradient power necker --subjects 6,10,20 --effect 1.5 --out power

    Parameters
    ----------
    out
        Folder for the results.
    subjects
        Numbers of subjects.
    sensitivity
        Also compute the power with each assumed SD halved and doubled, from a fifth of the experiments each.
    design
        Design (TOML).  [default: that of TASK]
    experiments
        Number of experiments for each number of subjects.
    seed
        Random seed.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.plotting.figures import as_files
    from focalgradient.plotting.power import power_figure

    named, given = task_named(task), model.given()
    with options_named(sentences({name: f"--{name.replace('_', '-')}" for name in given})):
        study = fg.power.study_of(named, fg.design.design_of(named.name, design), given, seed)
    extra = ["sensitivity.csv"] if sensitivity else []
    writable(out, ["power.csv", "power.png", "power.pdf", *extra], [] if design is None else [design])
    total = len(subjects) * experiments
    seconds = study.model.seconds(study.design) * experiments * sum(subjects)
    announce(seconds + study.model.setup_seconds(), f"{total} experiments")
    left = f"{printable(out / 'experiments.jsonl')} is kept; the same command continues."
    with resumable(left) as say, workers.shared(2 * seconds) as executor:
        table = fg.power.run(study, subjects, experiments, out / "experiments.jsonl", executor=executor, progress=say)
        few = max(experiments // 5, 1)
        varied = fg.power.sensitivity(study, subjects, few, executor=executor) if sensitivity else None
    found = fg.power.power(table, logs=study.model.logs)
    drawn = fg.power.running.drawn(found, study)
    files = {f"power.{kind}": content for kind, content in as_files(power_figure(**drawn)).items()}
    files["power.csv"] = _csv(fg.statistics.as_table(found))
    if varied is not None:
        files["sensitivity.csv"] = _csv(varied)
    write_set(out, files, "power.csv")
    lines = [f"Simulated {study.model.kind}: proportion of experiments that find"]
    for name, meaning in study.tests.items():
        lines.append(f"  {meaning}: {_shares({one.subjects: one.found[name] for one in found}, experiments)}")
    if len(study.tests) > 1:
        lines.append(f"  all tests: {_shares({one.subjects: one.joint for one in found}, experiments)}")
    lines.append("In brackets: 95 % intervals (Wilson) for this number of simulated experiments.")
    notes = _notes(found, study)
    lines += notes
    if any(math.isfinite(one.width) for one in found):
        widths = ", ".join(f"{one.width:.3f} (N = {one.subjects})" for one in found)
        lines.append(f"Median {study.model.width_label} ({study.widths[0]}): {widths}")
    if varied is not None:
        lines += [
            f"With {one.assumed} times {one.factor:g}, N = {one.subjects}: all tests {one.power:.1%}"
            for one in varied[varied["test"] == "joint"].itertuples()
        ]
    written = [printable(out / name) for name in files]
    records = fg.statistics.as_table(found).to_dict("records")
    show({"simulated": True, "power": records, "notes": notes, "written": written}, *lines)


def _notes(found: Sequence[fg.power.Power], study: Study) -> list[str]:
    """Return notes on simulated observers of a task: which tests show no effect, and whether people do not differ."""
    if not isinstance(study.model, fg.power.Observers):
        return []
    none = fg.power.running.without_effect(found, study)
    notes = [
        f"Note: no effect in the simulated observers (power not above 5 %): {'; '.join(none)}. If you expect one, "
        "state it in the task's method 'simulated'."
    ] * bool(none)
    if study.model.are_alike(study.design):
        notes.append(
            "Note: the simulated people do not differ, which makes power too high: use a field of 'observer', such as "
            "observer.scale, in the task's method 'simulated'."
        )
    return notes


def _csv(table: pd.DataFrame) -> bytes:
    return bytes(table.assign(simulated=True).to_csv(index=False, lineterminator="\n").encode())


def _shares(shares: Mapping[int, float], experiments: int) -> str:
    """Return power by number of subjects with its interval, and the numbers for a power of .80 and .90."""
    parts = []
    for count, share in shares.items():
        low, high = fg.power.share_interval(share, experiments)
        parts.append(f"{share:.1%} [{low:.1%}, {high:.1%}] (N = {count})")
    needed = []
    for power in (0.8, 0.9):
        number = fg.power.subjects_needed(shares, power)
        if number is None:
            number_text = f"N <= {min(shares)}" if shares[max(shares)] >= power else f"N > {max(shares)}"
        else:
            number_text = f"N = {number}"
        needed.append(f"{number_text} for .{power * 100:.0f}")
    return f"{', '.join(parts)}; by interpolation {', '.join(needed)}"
