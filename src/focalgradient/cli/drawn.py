"""``focalgradient stimuli NAME``: a command for each function that draws a stimulus, generated from its parameters."""

# Annotations are evaluated, not postponed: those of `_drawn` depend on its parameters.
import inspect
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any

import click

import focalgradient as fg
from focalgradient.cli.generate import Command, Folder, Given, command, options_named, sentences
from focalgradient.cli.groups import Screen
from focalgradient.cli.program import (
    FORCE_OPTION,
    JSON_OPTION,
    show,
    summary_json,
    warnings_given,
    writable,
    write_set,
)
from focalgradient.files import printable

if TYPE_CHECKING:
    from focalgradient.stimuli import Stimulus

__all__ = ["DRAWN"]

ABOUT = """\
DIR/picture.png is the picture for the display, 8 bits; the .npy files are linear light with and without blur
(fractions of white), true distance (m) and true blur (standard deviation, arcmin); masks.npz has the regions;
stimulus.json has all parameters, the controls, and the source. Takes about a second; for a picture that fills a
screen, up to 20 s. 'focalgradient stimuli set' combines such folders into a set for judging depth.
"""


class _Drawing(Given):
    """Parameters of a function of `focalgradient.stimuli`, with the unit in their names as placeholder."""

    def parameters(self) -> dict[str, list[click.Parameter]]:
        """Return the options of each parameter."""
        found = super().parameters()
        for name, (option, *_) in found.items():
            assert isinstance(option, click.Option)
            text = option.help or ""
            if name == "psf":
                option.help = f"{text.partition(',')[0]}."
                continue
            if not isinstance(option.type, click.Choice):
                option.metavar = name.rpartition("_")[2].upper()
            if name == "pixels_per_degree":
                option.default, option.show_default = None, False
                option.help = f"{text}  [default: the display's]"
            elif not option.show_default:
                option.help = f"{text}  [default: none]"
        return found


class _Drawn(Command):
    """Command with the help of the function that draws the stimulus."""

    drawing: _Drawing

    @property
    def help(self) -> str:
        """First paragraphs of the function's docstring, output files, and an example."""
        about = (inspect.getdoc(self.drawing.function()) or "").partition("\n\nParameters\n")[0]
        example = f"\b\nExample:\n  focalgradient stimuli {self.name} --out DIR --screen-width 53.1 --distance 0.57"
        return "\n\n".join([re.sub(r"`+(\w+)`+", r"\1", about), ABOUT, example])

    @help.setter
    def help(self, _: object) -> None:
        """Ignore the value set by `click.Command`."""


def _drawn(name: str, short_help: str) -> Command:
    """Return the command that draws one stimulus."""
    drawing = _Drawing(f"focalgradient.stimuli:{name.replace('-', '_')}", commas=True)

    def draw(*, out: Folder, given: Annotated[dict[str, Any], drawing], display: Screen) -> None:
        """Draw the stimulus.

        Parameters
        ----------
        out
            Folder for the stimulus.
        """
        if "psf" in given:
            given["psf"] = given["psf"].shape()
        if given.get("pixels_per_degree", 0) is None:
            given["pixels_per_degree"] = display.pixels_per_degree
        given = {one: value for one, value in given.items() if value is not None}
        names = sentences({one: f"--{one.replace('_', '-')}" for one in given})
        _write(out, display, names, lambda: drawing.function()(**given))

    made = _Drawn(draw, name, short_help, [FORCE_OPTION, JSON_OPTION])
    made.drawing = drawing
    return made


def _write(out: Folder, display: Screen, names: Mapping[str, str], draw: Callable[[], "Stimulus"]) -> None:
    """Draw a stimulus and write its files."""
    from focalgradient.stimuli.drawn_files import FILES, SUMMARY, stimulus_files

    writable(out, FILES)

    with warnings_given(), options_named(names):
        one = draw()
    files, summary = stimulus_files(one, display)
    write_set(out, {**files, SUMMARY: summary_json(summary)}, SUMMARY)
    width, height = summary["picture_px"]
    depth = summary["depth_m"]
    low, high = summary["blur_arcmin"]
    show(
        {**summary, "written": printable(out)},
        f"Picture: {width} x {height} px, {display.degrees(width):.3g} x {display.degrees(height):.3g} degrees",
        f"Blur: {low:.3g} to {high:.3g} arcmin",
        *([f"Depth: {depth[0]:.3g} to {depth[1]:.3g} m"] if depth else []),
        f"Largest sharpness: {one.controlled['sharpest']:.2g} of that allowed by its blur",
        f"Written: {printable(out)}",
    )


@command("Draw the stimulus of a published experiment.")
def replica(paper: str, /, *, condition: Annotated[str | None, "NAME"] = None, out: Folder, display: Screen) -> None:
    """Draw the stimulus of a published experiment, by the key of PAPER in the bibliography.

    Keys: mather1996, marshall1996, mather2002, taylor2015, watson2011, held2010, vishwanath2010, maiello2017. An
    unknown condition raises an error that lists the known ones. Parameters that the paper's abstract or its authors'
    page do not state are our choices: stimulus.json lists those stated. Pixels are those of the display.

    Writes the files of 'focalgradient stimuli texture-border'. Takes about a second, or up to 20 s for large pictures.

    \b
    Example:
      focalgradient stimuli replica mather2002 --condition "left sharp, blurred border" --out border --screen-width 53.1

    Parameters
    ----------
    condition
        Condition of the paper.  [default: its first]
    out
        Folder for the stimulus.
    """  # noqa: D301  click's mark against rewrapping is a real backspace

    def draw() -> "Stimulus":
        return fg.stimuli.replica(paper, condition, pixels_per_degree=display.pixels_per_degree)

    _write(out, display, {}, draw)


DRAWN: tuple[click.Command, ...] = (
    _drawn("texture-border", "Draw a border between two textures, each with its blur."),
    _drawn("blurred-edge", "Draw an edge with a pedestal of blur and an increment."),
    _drawn("dead-leaves", "Draw dead leaves with a given number of blurs."),
    _drawn("wide-field", "Draw a wide field, blurred at one eccentricity."),
    _drawn("slanted-plane", "Draw a slanted plane through a lens."),
    _drawn("corrugated-plane", "Draw a corrugated plane through a lens."),
    _drawn("miniature", "Draw a large scene blurred like a small model."),
    _drawn("fixated-cube", "Draw the Necker cube, in focus where it is fixated."),
    replica,
)
"""All commands that draw a stimulus."""
