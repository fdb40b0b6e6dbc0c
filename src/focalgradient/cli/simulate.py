"""``focalgradient simulate``: an experiment with simulated observers."""

from __future__ import annotations

from typing import Annotated, Any

import click

import focalgradient as fg
from focalgradient.cli.design_options import simulated_task, with_trials
from focalgradient.cli.generate import File, Folder, command
from focalgradient.cli.groups import Workers
from focalgradient.cli.program import resumable, show, warnings_given
from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.tasks import task_named

__all__ = ["simulate"]

LEFT = "recorded answers are kept, and the same command continues."


@command("Run an experiment with simulated observers.", force=False)
def simulate(
    experiment: Annotated[str, simulated_task],
    /,
    *,
    observers: Annotated[int, click.IntRange(1, 10_000), "N"],
    seed: Annotated[int, click.IntRange(0), "S"],
    out: Annotated[Folder, "DATASET"],
    observer: Annotated[str, "NAME"] = "default",
    stimuli: Folder | None = None,
    workers: Workers,
    design: File | None = None,
    trials: File | None = None,
) -> None:
    """Run EXPERIMENT (depth-rating, necker, blur-threshold, published or a task's .py file) with simulated observers.

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

    Parameters
    ----------
    observers
        Number of observers.
    seed
        Random seed: equal seeds give equal answers.
    out
        Folder of the data set.
    observer
        default; ordinal (rates in 7 categories); or a control: blur-blind, opposite (interprets blur as nearness),
        guessing, lapsing.
    stimuli
        Folder of the pictures shown; without it small ones are made once and cached.
    design
        Design of the experiment, instead of the default one.
    trials
        List of trials instead of the design's own (CSV or XLSX), in the format of 'focalgradient trials'.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    task = task_named(experiment)
    if task.no_pictures and stimuli is not None:
        raise InputError(f"--stimuli cannot go with {experiment}, {task.no_pictures}: leave it out.")
    from focalgradient.observers.sessions import seen

    fg.observers.observer_named(observer)
    chosen = with_trials(fg.design.design_of(task.name, design), trials)
    with resumable(LEFT) as say, warnings_given(), workers.shared(task.observer_s * observers) as executor:
        # The pictures are in a folder of this machine, which a scheduler's workers may not see.
        stimuli_seen = seen(task, chosen, stimuli, executor if workers.scheduler is None else None, say)
        who: dict[str, Any] = {"observers": observers, "seed": seed, "observer": observer}
        new = fg.observers.simulate(chosen, out, **who, **stimuli_seen, executor=executor, progress=say)
    kept = f"; {observers - new} existed already" if new < observers else ""
    show(
        {"observer": observer, "new": new, "kept": observers - new, "written": printable(out)},
        f"Simulated observers ({observer}): {new}{kept}.",
        f"Written: {printable(out)}",
    )
