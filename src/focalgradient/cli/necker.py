"""``focalgradient stimuli necker``: the frames of the rotating cube."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import click

from focalgradient.cli.options import (
    SIDE,
    display_of,
    display_options,
    options_named,
    positive,
    shared_options,
    shared_work,
)
from focalgradient.cli.program import KEPT, json_option, resumable, show, warnings_given, writable
from focalgradient.files import printable

__all__ = ["necker"]


@click.command("necker", short_help="Draw the rotating Necker cube, with and without blur.")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the frames.")
@click.option(
    "--gradient",
    "gradients",
    type=click.Choice(["none", "rigid", "nonrigid"]),
    multiple=True,
    help="Depth with which the blur is consistent: none; the cube's; that of its depth reversal, which favours the "
    "nonrigid percept. "
    "Repeatable.  [default: all three]",
)
@click.option("--size", type=SIDE, default=640, show_default=True, metavar="PX", help="Width and height of the frames.")
@click.option(
    "--edge",
    default=8.0,
    show_default=True,
    metavar="DEG",
    callback=positive(" of degrees"),
    help="Visual angle of an edge.",
)
@click.option(
    "--perspective",
    default=0.4,
    show_default=True,
    metavar="P",
    callback=positive(),
    help="Strength of perspective: edge of the cube / distance of its centre.",
)
@click.option(
    "--direction",
    type=click.Choice(["right", "left"]),
    default="right",
    show_default=True,
    help="Direction in which the near side moves.",
)
@click.option(
    "--speed",
    default=0.125,
    show_default=True,
    metavar="T",
    callback=positive(least=1e-3, most=100),
    help="Turns per second.",
)
@click.option(
    "--frame-rate",
    default=60.0,
    show_default=True,
    metavar="HZ",
    callback=positive(least=1, most=1000),
    help="Frames per second.",
)
@click.option(
    "--line-width",
    default=3.0,
    show_default=True,
    metavar="ARCMIN",
    callback=positive(" of arcmin"),
    help="Full width at half maximum of a sharp line.",
)
@click.option(
    "--aperture",
    default=12.0,
    show_default=True,
    metavar="MM",
    callback=positive(" of millimetres"),
    help="Strength of the gradient: the aperture of a lens half a metre from the cube.",
)
@click.option(
    "--focus",
    type=click.Choice(["near", "far"]),
    default="near",
    show_default=True,
    help="Which end of the cube is in focus.",
)
@shared_options
@display_options
@json_option
def necker(
    out: Path,
    gradients: tuple[Any, ...],
    size: int,
    edge: float,
    perspective: float,
    direction: Any,
    speed: float,
    frame_rate: float,
    line_width: float,
    aperture: float,
    focus: Any,
    workers: int | None,
    scheduler: str | None,
    **display: Any,
) -> None:
    """Make the frames of the rotating Necker cube, and a video of each condition.

    DIR/none, DIR/rigid and DIR/nonrigid contain the frames of a quarter turn as PNG for the display; repeated, they
    form a seamless rotation. Lines have the same positions and emit the same light in all conditions. DIR/none.mp4 etc.
    show a whole turn for viewing: they are compressed, unlike the frames. DIR/manifest.json has every parameter, every
    file's SHA-256, and the deviation of each percept from a rigid shape. Reads nothing. Takes about 20 s on two cores.

    \b
    Example:
      focalgradient stimuli necker --out cube --gradient none --gradient nonrigid --screen-width 53.1
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, ())

    from focalgradient.scenes import NeckerCube
    from focalgradient.stimuli import GRADIENTS, make_necker

    cube = NeckerCube(
        size=math.radians(edge),
        perspective=perspective,
        direction=direction,
        speed=speed,
        line_width=math.radians(line_width / 60),
    )
    with (
        warnings_given(),
        resumable(KEPT) as say,
        options_named({"size is": "--size is"}),
        shared_work(workers, scheduler) as executor,
    ):
        made = make_necker(
            out,
            cube,
            gradients=gradients or GRADIENTS,
            size=size,
            frame_rate=frame_rate,
            aperture=aperture * 1e-3,
            focus=focus,
            display=display_of(**display),
            executor=executor,
            progress=say,
        )
    departure = made["departure"]
    show(
        {
            "frames_of_a_quarter_turn": made["parameters"]["frames"],
            "conditions": list(made["conditions"]),
            "departure": departure,
            "written": printable(out),
        },
        f"Frames: {made['parameters']['frames']} in a quarter turn, {len(made['conditions'])} conditions",
        f"Departure from rigid: {departure['rigid']['whole']:.1%} turning {departure['rigid']['direction']}, "
        f"{departure['nonrigid']['whole']:.1%} turning {departure['nonrigid']['direction']}",
        f"Written: {printable(out)}",
    )
