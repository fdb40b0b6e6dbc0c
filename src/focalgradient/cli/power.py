"""``focalgradient power``: how many subjects an experiment needs, by simulation of whole experiments."""

from __future__ import annotations

from pathlib import Path

import click

from focalgradient.cli.options import positive, shared_options, shared_work
from focalgradient.cli.program import announce, json_option, resumable, show, writable
from focalgradient.errors import InputError
from focalgradient.files import printable, replace_set

__all__ = ["power"]


SECONDS = 0.005
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


@click.command(short_help="Simulate how many subjects an experiment needs.")
@click.argument("task", type=click.Choice(["depth-rating"]))
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the results.")
@click.option("--subjects", default="6,10,20", show_default=True, callback=_counts, help="Numbers of subjects.")
@click.option(
    "--effect", type=float, default=1.3, show_default=True, help="Near rise at the largest aperture, as a ratio."
)
@click.option("--far-effect", type=float, default=1.0, show_default=True, help="Far rise: 1 is none.")
@click.option(
    "--between", type=float, default=0.15, show_default=True, help="SD over subjects of the log of each rise."
)
@click.option(
    "--between-scenes",
    type=float,
    default=0.05,
    show_default=True,
    help="The same over scenes, which all subjects share.",
)
@click.option("--noise", type=float, default=0.3, show_default=True, help="SD of the logarithm of one rating.")
@click.option("--lapses", type=float, default=0.01, show_default=True, help="Share of ratings that mean nothing.")
@click.option(
    "--bound",
    type=float,
    default=1.2,
    show_default=True,
    callback=positive(),
    help="Of equivalence: the smallest rise that would matter, as a ratio.",
)
@click.option("--design", type=click.Path(path_type=Path), metavar="FILE", help="Design (TOML).  [default: its own]")
@click.option(
    "--experiments", type=click.IntRange(1, 1_000_000), default=1000, show_default=True, help="With each number."
)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True)
@shared_options
@json_option
def power(
    task: str,
    out: Path,
    subjects: tuple[int, ...],
    effect: float,
    far_effect: float,
    between: float,
    between_scenes: float,
    noise: float,
    lapses: float,
    bound: float,
    design: Path | None,
    experiments: int,
    seed: int,
    workers: int | None,
    scheduler: str | None,
) -> None:
    """Simulate whole experiments, and count how many find the effect.

    Subjects are drawn from a statistical model, given by the options; each experiment goes through the whole
    analysis: exclusions, tests by Holm's p, equivalence. Writes power.csv and the figure (PNG, PDF). Every experiment
    is kept in experiments.jsonl as soon as it is done: cut off, the same command goes on.

    Reads nothing but --design (TOML; 'focalgradient run depth-rating --print-design' writes one). A thousand
    experiments with each number of subjects, the default, take about 3 min on two cores; a hundred give shares to 5 %.

    \b
    Examples:
      focalgradient power depth-rating --subjects 6,10,20 --effect 1.3 --out power
      focalgradient power depth-rating --subjects 10 --experiments 100 --out quick
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.design import DepthRatingDesign, load_design
    from focalgradient.plotting.subjects import as_files, power_figure
    from focalgradient.power import TESTS, Model, Study, run
    from focalgradient.power import power as sum_up
    from focalgradient.statistics import as_table

    shown = DepthRatingDesign() if design is None else load_design(design)
    if not isinstance(shown, DepthRatingDesign):
        raise InputError(f"{design} is a design of {shown.task}, but must be one of depthrating.")
    model = Model(
        effect=effect,
        far_effect=far_effect,
        between=between,
        between_scenes=between_scenes,
        noise=noise,
        lapses=lapses,
    )
    study = Study(model, shown, bound, seed)
    writable(out, ["experiments.jsonl", "power.csv", "power.png", "power.pdf"], [] if design is None else [design])
    total = len(subjects) * experiments
    announce(SECONDS * experiments * sum(subjects), f"{total} experiments")
    left = f"{printable(out / 'experiments.jsonl')} is kept; the same command goes on."
    with resumable(left) as say, shared_work(workers, scheduler) as executor:
        table = run(
            study,
            subjects,
            experiments,
            out / "experiments.jsonl",
            executor=executor,
            progress=lambda done: say(done / total, f"{done} of {total} experiments"),
        )
    found = sum_up(table)
    files = {f"power.{kind}": content for kind, content in as_files(power_figure(found)).items()}
    files["power.csv"] = as_table(found).assign(simulated=True).to_csv(index=False, lineterminator="\n").encode()
    replace_set(out, files, "power.csv")
    lines = ["Simulated subjects, of a statistical model: share of experiments that find"]
    for name, meaning in TESTS.items():
        shares = ", ".join(
            f"{each.found[name]:.1%} ± {each.standard_error[name]:.1%} (N = {each.subjects})" for each in found
        )
        lines.append(f"  {meaning}: {shares}")
    widths = ", ".join(f"{each.width:.3f} (N = {each.subjects})" for each in found)
    lines.append(f"Median 95 % interval of the near rise, ratio of its ends: {widths}")
    written = [printable(out / name) for name in files]
    show({"simulated": True, "power": as_table(found).to_dict("records"), "written": written}, *lines)
