"""``focalgradient stimuli necker``: the frames of the rotating cube."""

from __future__ import annotations

import re
from contextlib import suppress
from typing import Annotated, Any

import focalgradient as fg
from focalgradient.cli.generate import Folder, Given, Made, command, options_named
from focalgradient.cli.groups import Screen, Workers
from focalgradient.cli.program import KEPT, resumable, show, warnings_given, writable
from focalgradient.errors import InputError
from focalgradient.files import printable

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
    how: Annotated[
        dict[str, Any],
        Given(
            "focalgradient.stimuli:make_necker",
            {"gradients": "--gradient"},
            only=("gradients", "frame_rate", "aperture", "focus"),
        ),
    ],
    cube: Annotated[
        Any,
        Made(
            "focalgradient.scenes:NeckerCube",
            {"size": "--edge"},
            only=("size", "perspective", "direction", "speed", "line_width"),
        ),
    ],
    size: Annotated[Any, side, "PX"] = 640,
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
    size
        Width and height of the frames.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, ())

    with (
        warnings_given(),
        resumable(KEPT) as say,
        options_named({"size is": "--size is"}),
        workers.shared() as executor,
    ):
        made = fg.stimuli.make_necker(
            out,
            cube,
            size=size,
            **how,
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
