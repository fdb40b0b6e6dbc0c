"""``focalgradient run``: an experiment with a participant, on this computer's screen."""

from __future__ import annotations

import click

import focalgradient as fg
from focalgradient.errors import check_one_of
from focalgradient.tasks import task_named

__all__ = ["run"]

GAZE = "gaze-focus"
"""Name of gaze-contingent focus, which has no task and no design."""


@click.command(
    short_help="Run an experiment with a person.",
    context_settings={"ignore_unknown_options": True, "allow_extra_args": True, "help_option_names": []},
    options_metavar="",
)
@click.argument("words", nargs=-1, type=click.UNPROCESSED, metavar="EXPERIMENT [OPTIONS]")
@click.pass_context
def run(context: click.Context, words: tuple[str, ...]) -> None:
    """Run EXPERIMENT (depth-rating, necker, pinhole or blur-threshold) with a person, in PsychoPy (extra lab).

    EXPERIMENT can also be a user-defined task, by its name if its package is installed, or by its Python file.

    gaze-focus shows a focus series contingent on gaze (eye trackers need the extra gaze).

    Answers are on disk before the next trial begins. Exit code 1: stopped before the end; the same command with
    --resume continues.

    \b
    Examples:
      focalgradient run depth-rating --pilot --stimuli pictures
      focalgradient run necker --participant 01 --monitor lab --data data
      focalgradient run necker --print-design > mine.toml
      focalgradient run blur-threshold --participant 01 --stimuli pictures
      focalgradient run my_task.py --pilot
      focalgradient run gaze-focus --series blurred --gaze mouse --windowed
      focalgradient run necker --help
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    name, *given = words or ("--help",)
    if name in ("-h", "--help"):
        click.echo(context.get_help())
        return

    program = f"{context.command_path} {name}"
    if name.endswith(".py"):
        name = task_named(name).called
    check_one_of("EXPERIMENT", name, [*fg.lab.EXPERIMENTS, GAZE])
    if name == GAZE:
        context.exit(fg.lab.gaze_focus.run(given, program=program))
    context.exit(fg.lab.run(fg.lab.EXPERIMENTS[name], given, program=program))
