"""``focalgradient power``: how many subjects an experiment needs, by simulation of whole experiments."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from focalgradient.cli.options import positive, shared_options, shared_work
from focalgradient.cli.program import announce, force_option, json_option, resumable, show, writable, write_set
from focalgradient.errors import InputError
from focalgradient.files import printable

if TYPE_CHECKING:
    from focalgradient.power import AnyStudy

__all__ = ["power"]


SECONDS = {"depth-rating": 0.005, "necker": 0.012}
"""Seconds of one experiment for each of its subjects, on two cores: measured, 6 and 20 subjects."""


def _counts(_: click.Context, option: click.Parameter, given: str) -> tuple[int, ...]:
    """Numbers of subjects, as "6,10,20"."""
    try:
        counts = tuple(sorted({int(each) for each in given.split(",")}))
    except ValueError:
        counts = ()
    if not counts or counts[0] < 2 or counts[-1] > 1000:
        raise InputError(f"{option.opts[0]} is {given}, but must be whole numbers from 2 to 1000, like 6,10,20.")
    return counts


OF_RATINGS = ("far_effect", "between_scenes", "noise", "bound")
OF_CUBE = ("nonrigid", "between_levels")


@click.command(short_help="Simulate how many subjects an experiment needs.")
@click.argument("task", type=click.Choice(["depth-rating", "necker"]))
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the results.")
@click.option("--subjects", default="6,10,20", show_default=True, callback=_counts, help="Numbers of subjects.")
@click.option(
    "--effect",
    type=float,
    help="Near rise at the largest aperture, as a ratio; of the cube the ratio of the odds of the nonrigid reading "
    "with its gradient to those without.  [default: 1.3; of the cube 1.5]",
)
@click.option("--far-effect", type=float, help="Of ratings: far rise, 1 is none.  [default: 1]")
@click.option(
    "--between", type=float, help="SD over subjects of the log of each effect.  [default: 0.15; of the cube 0.3]"
)
@click.option(
    "--between-scenes",
    type=float,
    help="Of ratings: the same over scenes, which all subjects share.  [default: 0.05]",
)
@click.option("--noise", type=float, help="Of ratings: SD of the logarithm of one rating.  [default: 0.3]")
@click.option("--nonrigid", type=float, help="Of the cube: nonrigid share of time without a gradient.  [default: 0.2]")
@click.option(
    "--between-levels", type=float, help="Of the cube: SD over subjects of the log odds of that.  [default: 0.7]"
)
@click.option(
    "--lapses", type=float, help="Share of ratings, or of trials of the cube, that mean nothing.  [default: 0.01]"
)
@click.option(
    "--bound",
    type=float,
    callback=positive(),
    help="Of ratings: of equivalence, the smallest rise that would matter, as a ratio.  [default: 1.2]",
)
@click.option("--design", type=click.Path(path_type=Path), metavar="FILE", help="Design (TOML).  [default: its own]")
@click.option(
    "--experiments", type=click.IntRange(1, 1_000_000), default=1000, show_default=True, help="With each number."
)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True)
@shared_options
@force_option
@json_option
def power(
    task: str,
    out: Path,
    subjects: tuple[int, ...],
    design: Path | None,
    experiments: int,
    seed: int,
    workers: int | None,
    scheduler: str | None,
    **model: float | None,
) -> None:
    """Simulate whole experiments (depth-rating or necker), and count how many find the effect.

    Subjects are drawn from a statistical model, given by the options; each experiment goes through exclusions and
    tests by Holm's p, as a report does. Writes power.csv and the figure (PNG, PDF). Every experiment is kept in
    experiments.jsonl as soon as it is done: cut off, the same command goes on.

    Reads nothing but --design (TOML; 'focalgradient run depth-rating --print-design' writes one). A thousand
    experiments with each number of subjects, the default, take about 3 min on two cores; a hundred give shares to 5 %.

    \b
    Examples:
      focalgradient power depth-rating --subjects 6,10,20 --effect 1.3 --out power
      focalgradient power depth-rating --subjects 10 --experiments 100 --out quick
      focalgradient power necker --subjects 6,10,20 --effect 1.5 --out power
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.plotting.figures import as_files
    from focalgradient.plotting.subjects import power_figure
    from focalgradient.power import power as sum_up
    from focalgradient.power import run
    from focalgradient.statistics import as_table

    study = _study(task, design, seed, {name: value for name, value in model.items() if value is not None})
    writable(out, ["power.csv", "power.png", "power.pdf"], [] if design is None else [design])
    total = len(subjects) * experiments
    seconds = SECONDS[task] * experiments * sum(subjects)
    announce(seconds, f"{total} experiments")
    left = f"{printable(out / 'experiments.jsonl')} is kept; the same command goes on."
    with resumable(left) as say, shared_work(workers, scheduler, 2 * seconds) as executor:
        table = run(study, subjects, experiments, out / "experiments.jsonl", executor=executor, progress=say)
    found = sum_up(table)
    files = {f"power.{kind}": content for kind, content in as_files(power_figure(found)).items()}
    files["power.csv"] = as_table(found).assign(simulated=True).to_csv(index=False, lineterminator="\n").encode()
    write_set(out, files, "power.csv")
    lines = ["Simulated subjects, of a statistical model: share of experiments that find"]
    for name, meaning in study.tests.items():
        shares = ", ".join(
            f"{each.found[name]:.1%} ± {each.standard_error[name]:.1%} (N = {each.subjects})" for each in found
        )
        lines.append(f"  {meaning}: {shares}")
    if task == "necker":
        widths = ", ".join(f"{each.width:.1%} (N = {each.subjects})" for each in found)
        lines.append(f"Median 95 % interval of the change of the nonrigid share of time, its width: {widths}")
    else:
        widths = ", ".join(f"{each.width:.3f} (N = {each.subjects})" for each in found)
        lines.append(f"Median 95 % interval of the near rise, ratio of its ends: {widths}")
    written = [printable(out / name) for name in files]
    show({"simulated": True, "power": as_table(found).to_dict("records"), "written": written}, *lines)


def _study(task: str, design: Path | None, seed: int, given: dict[str, float]) -> AnyStudy:
    """What is to be simulated, of the options of the task that were given."""
    from focalgradient.design import DepthRatingDesign, NeckerDesign, load_design
    from focalgradient.power import CubeModel, CubeStudy, Model, Study
    from focalgradient.tasks import task_named

    others = OF_CUBE if task == "depth-rating" else OF_RATINGS
    if wrong := [name for name in given if name in others]:
        option = wrong[0].replace("_", "-")
        raise InputError(f"--{option} cannot go with {task}, which has no such thing: leave it out.")
    wanted = task.replace("-", "")
    shown = task_named(task).design() if design is None else load_design(design)
    if isinstance(shown, NeckerDesign) and task == "necker":
        return CubeStudy(CubeModel(**given), shown, seed)
    if isinstance(shown, DepthRatingDesign) and task == "depth-rating":
        bound = given.pop("bound", 1.2)
        return Study(Model(**given), shown, bound, seed)
    raise InputError(f"{design} is a design of {shown.task}, but must be one of {wanted}.")
