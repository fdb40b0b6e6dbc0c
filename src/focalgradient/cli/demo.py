"""``focalgradient demo``: a folder with one small example of every input of the other commands."""

from __future__ import annotations

import click

import focalgradient as fg
from focalgradient.cli.depth import depth
from focalgradient.cli.generate import Folder, command
from focalgradient.cli.program import resumable, show, writable, write_set

__all__ = ["demo"]

RELIABILITY = (
    "Reliability: distances are accurate to about twice the stated uncertainty where the map is not hatched; "
    "near occlusion boundaries 7 % have larger errors."
)


@command("Write a folder of examples for every command.")
def demo(*, out: Folder) -> None:
    """Write a small example of every input of the other commands, and make a first depth map.

    The pictures are ray cast: two photographs with their settings file, a target for calibration, a photograph of cards
    with hard edges, a video that alternates between two apertures, and a picture with its distances. The table of
    ratings is simulated. DIR/README.txt describes each file and its true values.

    Takes about 15 s; half a minute the first time, when the program is compiled.

    \b
    Example:
      focalgradient demo --out demo
      focalgradient depth demo/views.toml --out mine

    Parameters
    ----------
    out
        Folder for the examples.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, fg.examples.EXAMPLE_FILES)
    with fg.examples.depth_compiling(), resumable("") as say:
        files = fg.examples.example_files(say)
        write_set(out, files, "views.toml")
        say(1.0, "compiling, the first time")
    show(
        None,  # the result is that of depth
        f"Written: {len(files)} files in {out}; README.txt describes each.",
        f"Now: focalgradient depth {out / 'views.toml'} --out {out / 'depth'}",
    )
    words = [str(out / "views.toml"), "--out", str(out / "depth")]
    with depth.make_context("depth", words, parent=click.get_current_context()) as inner:
        depth.invoke(inner)
    show(None, f"Look at {out / 'depth' / 'depth.png'}. {RELIABILITY}")
