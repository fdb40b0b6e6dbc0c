"""``focalgradient stimuli necker``: the frames of the rotating cube."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from typing import Annotated, Any, Literal

from focalgradient.cli.generate import Folder, command, options_named
from focalgradient.cli.groups import Screen, Workers
from focalgradient.cli.program import KEPT, resumable, show, warnings_given, writable
from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.quantities import ARCMIN, DEGREES, MILLIMETRES, POSITIVE

__all__ = ["necker", "side"]


def side(option: str, given: str) -> int:
    """Parse the width and height of square pictures in pixels, given as one number; the library checks its range."""
    with suppress(ValueError):
        if int(given) <= 65_536:
            return int(given)
    digits = re.match(r"[0-9]{2,5}", given)
    nearest = max(min(int(digits[0]) if digits else 512, 65_536), 16)
    raise InputError(
        f"{option} is {given}, but must be one even number of pixels, for the width and the height: give {option} "
        f"{nearest + nearest % 2}."
    )


@command("Draw the rotating Necker cube, with and without blur.", force=False)
def necker(
    *,
    out: Folder,
    gradient: tuple[Literal["none", "rigid", "nonrigid"], ...] = (),
    size: Annotated[Any, side, "PX"] = 640,
    edge: Annotated[float, DEGREES.si] = math.radians(8),
    perspective: Annotated[float, POSITIVE, "P"] = 0.4,
    direction: Literal["right", "left"] = "right",
    speed: Annotated[float, POSITIVE.between(1e-3, 100), "T"] = 0.125,
    frame_rate: Annotated[float, POSITIVE.between(1, 1000), "HZ"] = 60.0,
    line_width: Annotated[float, ARCMIN.si] = math.radians(3 / 60),
    aperture: Annotated[float, MILLIMETRES.si] = 0.012,
    focus: Literal["near", "far"] = "near",
    workers: Workers,
    display: Screen,
) -> None:
    """Make the frames of the rotating Necker cube, and a video of each condition.

    DIR/none, DIR/rigid and DIR/nonrigid contain the frames of a quarter turn as PNG for the display; repeated, they
    form a seamless rotation. Lines have the same positions and emit the same light in all conditions. DIR/none.mp4 etc.
    show a whole turn for viewing: they are compressed, unlike the frames. DIR/manifest.json has every parameter, every
    file's SHA-256, and the deviation of each percept from a rigid shape. Reads nothing. Takes about 20 s on two cores.

    \b
    Example:
      focalgradient stimuli necker --out cube --gradient none --gradient nonrigid --screen-width 53.1

    Parameters
    ----------
    out
        Folder for the frames.
    gradient
        Depth with which the blur is consistent: none; the cube's; that of its depth reversal, which favours the
        nonrigid percept. Repeatable.  [default: all three]
    size
        Width and height of the frames.
    edge
        Visual angle of an edge.
    perspective
        Strength of perspective: edge of the cube / distance of its centre.
    direction
        Direction in which the near side moves.
    speed
        Turns per second.
    frame_rate
        Frames per second.
    line_width
        Full width at half maximum of a sharp line.
    aperture
        Strength of the gradient: the aperture of a lens half a metre from the cube.
    focus
        Which end of the cube is in focus.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, ())

    from focalgradient.scenes import NeckerCube
    from focalgradient.stimuli import GRADIENTS, make_necker

    cube = NeckerCube(size=edge, perspective=perspective, direction=direction, speed=speed, line_width=line_width)
    with (
        warnings_given(),
        resumable(KEPT) as say,
        options_named({"size is": "--size is"}),
        workers.shared() as executor,
    ):
        made = make_necker(
            out,
            cube,
            gradients=gradient or GRADIENTS,
            size=size,
            frame_rate=frame_rate,
            aperture=aperture,
            focus=focus,
            display=display,
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
