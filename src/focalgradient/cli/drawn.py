"""``focalgradient stimuli NAME``: a command for each function that draws a stimulus, made from its parameters."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Any, Literal, Union, get_args, get_origin, get_type_hints

import click

from focalgradient.cli.options import display_of, display_options, options_named
from focalgradient.cli.program import force_option, json_option, show, summary_json, warnings_given, writable, write_set
from focalgradient.cli.shapes import ShapedCommand, shape_options
from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.psf import Psf

if TYPE_CHECKING:
    from focalgradient.display import Display
    from focalgradient.stimuli import Stimulus

__all__ = ["DRAWN"]

SUMMARY = "stimulus.json"

FILES = ("picture.png", "picture.npy", "sharp.npy", "depth.npy", "blur.npy", "masks.npz", SUMMARY)
"""What `focalgradient.stimuli.drawn_files` makes, here without NumPy."""

ABOUT = f"""\
DIR/picture.png is the picture for the display, 8 bits; the .npy files are linear light with and without blur (shares
of white), true distance (m) and true blur (standard deviation, arcmin); masks.npz has the regions; {SUMMARY} has every
parameter, what was controlled and the source. Takes about a second; for a picture that fills a screen, up to 20 s.
'focalgradient stimuli set' makes a set for judging depth of such folders.
"""


def _listed(kind: Callable[[str], Any]) -> Callable[[click.Context, click.Parameter, Any], Any]:
    """Make a tuple, as an option's callback, of values with commas between them."""

    def split(_: click.Context, option: click.Parameter, given: Any) -> Any:
        if not isinstance(given, str):
            return given
        try:
            return tuple(kind(part.strip()) for part in given.split(",") if part.strip())
        except ValueError as error:
            what = "numbers like 0,2.5" if kind is float else "names with commas"
            raise InputError(f"{option.opts[0]} is {given!r}, but must be {what}.") from error

    return split


class _Drawn(ShapedCommand):
    """The command of one function of `focalgradient.stimuli`, which is loaded when its options are needed."""

    def __init__(self, name: str, short_help: str) -> None:
        super().__init__(name, callback=self._draw, short_help=short_help)

    @cached_property
    def function(self) -> Callable[..., Stimulus]:
        """What draws the stimulus."""
        from focalgradient import stimuli

        drawing: Callable[..., Stimulus] = getattr(stimuli, str(self.name).replace("-", "_"))
        return drawing

    @cached_property
    def _own(self) -> list[click.Parameter]:
        return [_OUT, *_options(self.function), *_DISPLAY]

    @property
    def params(self) -> list[click.Parameter]:
        """The options, of the function's parameters and of the display."""
        return self._own

    @params.setter
    def params(self, _: object) -> None:
        """Leave out what `click.Command` sets: the options are made when they are needed."""

    @property
    def help(self) -> str:
        """The function's first paragraph, what is written, and an example."""
        about = inspect.getdoc(self.function) or ""
        example = f"\b\nExample:\n  focalgradient stimuli {self.name} --out DIR --screen-width 53.1 --distance 0.57"
        return "\n\n".join([_plain(about.partition("\n\nParameters\n")[0]), ABOUT, example])

    @help.setter
    def help(self, _: object) -> None:
        """Leave out what `click.Command` sets, as of `params`."""

    def _draw(self, out: Path, **given: Any) -> None:
        display = display_of(**{name: given.pop(name) for name in _SCREEN})
        if "psf" in given:
            given["psf"] = given["psf"].shape()
        known = inspect.signature(self.function).parameters
        if "pixels_per_degree" in known and given["pixels_per_degree"] is None:
            given["pixels_per_degree"] = display.pixels_per_degree
        # A parameter of one plain word is an option only where a sentence begins with it.
        names = {name: _option(name) for name in known if "_" in name}
        names |= {f"{name} {verb}": f"{_option(name)} {verb}" for name in given for verb in ("is", "has")}
        _write(out, display, names, lambda: self.function(**given))


def _write(out: Path, display: Display, names: Mapping[str, str], draw: Callable[[], Stimulus]) -> None:
    """Draw a stimulus and write it."""
    writable(out, FILES)
    from focalgradient.stimuli.drawn_files import stimulus_files

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
        f"Sharpest place: {one.controlled['sharpest']:.2g} of what its blur allows",
        f"Written: {printable(out)}",
    )


def _options(function: Callable[..., Any]) -> list[click.Parameter]:
    """An option for each parameter that a command line can give."""
    texts = _texts(inspect.getdoc(function) or "")
    hints = get_type_hints(function)
    made: list[click.Parameter] = []
    for name, parameter in inspect.signature(function).parameters.items():
        if Psf in get_args(hints[name]):
            shaped = click.command()(shape_options(f"{texts[name].partition(',')[0]}.", parameter.default)(_nothing))
            made += shaped.params
            continue
        kind, optional = _kind(hints[name])
        if kind is None:
            continue
        default = None if optional or name == "pixels_per_degree" else parameter.default
        text = texts.get(name, "")
        if name == "pixels_per_degree":
            text += "  [default: the display's]"
        elif optional:
            text += "  [default: none]"
        else:
            shown = ",".join(f"{one:g}" for one in default) if isinstance(default, tuple) else str(default)
            text += f"  [default: {shown or 'none'}]"
        several = get_args(hints[name]) if get_origin(hints[name]) is Sequence else ()
        made.append(
            click.Option(
                [_option(name), name],
                type=kind,
                default=default,
                callback=_listed(several[0]) if several else None,
                metavar=None if isinstance(kind, click.Choice) else name.rpartition("_")[2].upper(),
                help=text,
            )
        )
    return made


def _nothing() -> None:
    """Bear the options of a shape until they are moved to a command."""


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _kind(hint: Any) -> tuple[Any, bool]:
    """The type of option for a parameter of this type, None where there is none; and whether it may be left out."""
    optional = get_origin(hint) in (Union, UnionType) and type(None) in get_args(hint)
    if optional:
        rest = [part for part in get_args(hint) if part is not type(None)]
        hint = rest[0] if len(rest) == 1 else None
    if get_origin(hint) is Literal:
        return click.Choice([str(value) for value in get_args(hint)]), optional
    if get_origin(hint) is Sequence:
        return click.UNPROCESSED, optional
    return {float: click.FLOAT, int: click.INT, str: click.STRING}.get(hint), optional


def _texts(about: str) -> dict[str, str]:
    """What a docstring says of each parameter, by its name."""
    part = about.partition("\nParameters\n")[2].partition("\n\nReturns\n")[0]
    found = {}
    for names, text in re.findall(r"^(\w[\w, ]*)\n((?:    .*\n?|\n)+)", part.partition("\n")[2], re.MULTILINE):
        for name in names.split(","):
            found[name.strip()] = _plain(" ".join(text.split()))
    return found


def _plain(text: str) -> str:
    """A docstring's text without marks of code, and with options for parameters."""
    return re.sub(r"`+(\w+)`+", lambda match: match[1], text)


_OUT = click.Option(
    ["--out", "out"], required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the stimulus."
)

_DISPLAY = click.command()(display_options(force_option(json_option(lambda **_: None)))).params

_SCREEN = [str(option.name) for option in _DISPLAY if option.expose_value]


@click.command("replica", short_help="The stimulus of a published experiment.")
@click.argument("paper", metavar="PAPER")
@click.option("--condition", metavar="NAME", help="Of the paper.  [default: its first]")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the stimulus.")
@display_options
@force_option
@json_option
def replica(paper: str, condition: str | None, out: Path, **screen: Any) -> None:
    """Draw the stimulus of a published experiment, by the key of PAPER in the bibliography.

    Keys: mather1996, marshall1996, mather2002, taylor2015, watson2011, held2010, vishwanath2010, maiello2017. An
    unknown condition is answered by the list of those known. Parameters that the paper's abstract or its authors' page
    does not state are ours: stimulus.json lists those stated. Pixels are those of the display.

    Writes the files of 'focalgradient stimuli texture-border'. Takes about a second, and up to 20 s for large pictures.

    \b
    Example:
      focalgradient stimuli replica mather2002 --condition "left sharp, blurred border" --out border --screen-width 53.1
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    display = display_of(**screen)

    def draw() -> Stimulus:
        from focalgradient import stimuli

        return stimuli.replica(paper, condition, pixels_per_degree=display.pixels_per_degree)

    _write(out, display, {}, draw)


DRAWN: tuple[click.Command, ...] = (
    _Drawn("texture-border", "A border between two textures, each with its blur."),
    _Drawn("blurred-edge", "An edge with a pedestal of blur and an increment."),
    _Drawn("dead-leaves", "Dead leaves with a given number of blurs."),
    _Drawn("wide-field", "A wide field, blurred at one eccentricity."),
    _Drawn("slanted-plane", "A slanted plane through a lens."),
    _Drawn("corrugated-plane", "A corrugated plane through a lens."),
    _Drawn("miniature", "A large scene blurred as a small model."),
    _Drawn("fixated-cube", "The Necker cube, in focus where it is fixated."),
    replica,
)
"""A command for each."""
