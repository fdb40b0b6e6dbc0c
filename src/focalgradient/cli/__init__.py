"""Command-line interface.

Invalid input is reported in one sentence on standard error, with exit code 2. Results are computed first, written to
temporary files, and moved into place together. Slow modules are imported only by the commands that need them.
"""

from typing import Any

import click

from focalgradient import __citation__, __version__
from focalgradient.cli.blur import blur
from focalgradient.cli.calibrate import calibrate
from focalgradient.cli.collect import collect
from focalgradient.cli.demo import demo
from focalgradient.cli.depth import depth
from focalgradient.cli.doctor import doctor
from focalgradient.cli.eye import eye
from focalgradient.cli.focus_series import focus_series
from focalgradient.cli.power import power
from focalgradient.cli.program import Program
from focalgradient.cli.repair import repair
from focalgradient.cli.report import report
from focalgradient.cli.run import run
from focalgradient.cli.serve import serve
from focalgradient.cli.simulate import simulate
from focalgradient.cli.stereo import stereo
from focalgradient.cli.stimuli import stimuli
from focalgradient.cli.stream import stream
from focalgradient.cli.trials import trials
from focalgradient.cli.validate import validate
from focalgradient.cli.withdraw import withdraw

__all__ = ["main"]


def _cite(context: click.Context, parameter: click.Parameter, wanted: Any) -> None:
    """Print the citation and exit, if `wanted`."""
    if wanted:
        click.echo(__citation__, nl=False)
        context.exit()


@click.group(
    "focalgradient", cls=Program, no_args_is_help=False, context_settings={"help_option_names": ["-h", "--help"]}
)
@click.version_option(__version__, message="%(prog)s %(version)s", prog_name="focalgradient")
@click.option(
    "--cite",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_cite,
    help="Print how to cite the software and the paper (BibTeX), and exit.",
)
def main() -> None:
    """Depth from blur: the focal gradient as a source of depth (after Pentland 1987).

    \b
    Units, in every command: distances in metres; pixel pitch in micrometres; focal lengths and pupils in millimetres;
    the width of a screen in centimetres; visual angles in degrees; vergence and focus in dioptres (1 / metres).

    \b
    First steps:
      focalgradient demo --out demo                       examples of every file, and a first depth map
      focalgradient depth demo/views.toml --out results   the same for photographs of your own
    """  # noqa: D301  click's marker against rewrapping is a literal backspace


for command in (
    *(blur, calibrate, collect, demo, depth, doctor, eye, focus_series, power, repair),
    *(report, run, serve, simulate, stereo, stimuli, stream, trials, validate, withdraw),
):
    main.add_command(command)
