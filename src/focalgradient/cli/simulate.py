"""``focalgradient simulate``: an experiment with simulated observers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from focalgradient.cli.design_options import simulated_task, trials_option, with_trials
from focalgradient.cli.options import shared_options, shared_work
from focalgradient.cli.program import json_option, resumable, show, warnings_given
from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.tasks import task_named

__all__ = ["simulate"]

LEFT = "recorded answers are kept, and the same command continues."


@click.command(short_help="Run an experiment with simulated observers.")
@click.argument("experiment", callback=simulated_task)
@click.option("--observers", required=True, type=click.IntRange(1, 10_000), metavar="N", help="Number of observers.")
@click.option(
    "--seed", required=True, type=click.IntRange(0), metavar="S", help="Random seed: equal seeds give equal answers."
)
@click.option(
    "--out", required=True, type=click.Path(path_type=Path), metavar="DATASET", help="Folder of the data set."
)
@click.option(
    "--observer",
    default="default",
    show_default=True,
    metavar="NAME",
    help="default; ordinal (rates in 7 categories); or a control: blur-blind, opposite (interprets blur as nearness), "
    "guessing, lapsing.",
)
@click.option(
    "--stimuli",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder of the pictures shown; without it small ones are made once and cached.",
)
@shared_options
@click.option(
    "--design",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Design of the experiment, instead of the default one.",
)
@trials_option
@json_option
def simulate(
    experiment: str,
    observers: int,
    seed: int,
    out: Path,
    observer: str,
    stimuli: Path | None,
    workers: int | None,
    scheduler: str | None,
    design: Path | None,
    trials: Path | None,
) -> None:
    """Run EXPERIMENT (depth-rating, necker, blur-threshold or published) with simulated observers.

    The observers process the pictures as the display shows them, and answer like people; those of blur-threshold
    process the pictures of --stimuli, or without them have a known threshold. DATASET has the format of an experiment
    with people, marked as simulated. Existing observers are kept, so an interrupted run continues, and observers can be
    added. Intermediate results are cached in the user's cache folder, or in that of the environment variable
    FOCALGRADIENT_CACHE.

    Reads the pictures of --stimuli (a folder written by 'focalgradient stimuli'), or makes small ones, and a design
    (TOML; 'focalgradient run EXPERIMENT --print-design' writes one). Encoding the pictures takes about 1 s each on two
    cores, plus a few seconds for 20 observers.

    \b
    Examples:
      focalgradient simulate necker --observers 20 --seed 1 --out simulated
      focalgradient simulate depth-rating --observers 20 --seed 1 --stimuli pictures --out simulated
      focalgradient simulate blur-threshold --observers 8 --seed 1 --out thresholds
      focalgradient simulate blur-threshold --observers 8 --seed 1 --stimuli pictures --out seen
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    task = task_named(experiment)
    if task.no_pictures and stimuli is not None:
        raise InputError(f"--stimuli cannot go with {experiment}, {task.no_pictures}: leave it out.")
    from focalgradient.design import design_of
    from focalgradient.observers import observer_named
    from focalgradient.observers import simulate as simulated

    observer_named(observer)
    chosen = with_trials(design_of(task.name, design), trials)
    seconds = task.observer_s * observers
    with resumable(LEFT) as say, warnings_given(), shared_work(workers, scheduler, seconds) as executor:
        # The pictures are in a folder of this machine, which a scheduler's workers may not see.
        seen = task.seen(chosen, stimuli, executor if scheduler is None else None, say)
        who: dict[str, Any] = {"observers": observers, "seed": seed, "observer": observer}
        new = simulated(chosen, out, **who, **seen, executor=executor, progress=say)
    kept = f"; {observers - new} existed already" if new < observers else ""
    show(
        {"observer": observer, "new": new, "kept": observers - new, "written": printable(out)},
        f"Simulated observers ({observer}): {new}{kept}.",
        f"Written: {printable(out)}",
    )
