"""``focalgradient stimuli NAME``: a command for each function that draws a stimulus, generated from its parameters."""

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
"""Files made by `focalgradient.stimuli.drawn_files`, listed here without loading NumPy."""

ABOUT = f"""\
DIR/picture.png is the picture for the display, 8 bits; the .npy files are linear light with and without blur
(fractions of white), true distance (m) and true blur (standard deviation, arcmin); masks.npz has the regions; {SUMMARY}
has all parameters, what was controlled, and the source. Takes about a second; for a picture that fills a screen, up to
20 s. 'focalgradient stimuli set' combines such folders into a set for judging depth.
"""


def _listed(kind: Callable[[str], Any]) -> Callable[[click.Context, click.Parameter, Any], Any]:
    """Return an option's callback that splits comma-separated values into a tuple."""

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
    """Command for one function of `focalgradient.stimuli`, which is imported when its options are needed."""

    def __init__(self, name: str, short_help: str) -> None:
        super().__init__(name, callback=self._draw, short_help=short_help)

    @cached_property
    def function(self) -> Callable[..., Stimulus]:
        """Function that draws the stimulus."""
        from focalgradient import stimuli

        drawing: Callable[..., Stimulus] = getattr(stimuli, str(self.name).replace("-", "_"))
        return drawing

    @cached_property
    def _own(self) -> list[click.Parameter]:
        return [_OUT, *_options(self.function), *_DISPLAY]

    @property
    def params(self) -> list[click.Parameter]:
        """Options of the function's parameters and of the display."""
        return self._own

    @params.setter
    def params(self, _: object) -> None:
        """Ignore the value set by `click.Command`: the options are generated when needed."""

    @property
    def help(self) -> str:
        """First paragraph of the function's docstring, output files, and an example."""
        about = inspect.getdoc(self.function) or ""
        example = f"\b\nExample:\n  focalgradient stimuli {self.name} --out DIR --screen-width 53.1 --distance 0.57"
        return "\n\n".join([_plain(about.partition("\n\nParameters\n")[0]), ABOUT, example])

    @help.setter
    def help(self, _: object) -> None:
        """Ignore the value set by `click.Command`, as for `params`."""

    def _draw(self, out: Path, **given: Any) -> None:
        display = display_of(**{name: given.pop(name) for name in _SCREEN})
        if "psf" in given:
            given["psf"] = given["psf"].shape()
        known = inspect.signature(self.function).parameters
        if "pixels_per_degree" in known and given["pixels_per_degree"] is None:
            given["pixels_per_degree"] = display.pixels_per_degree
        # A one-word parameter stands for an option only at the beginning of a sentence.
        names = {name: _option(name) for name in known if "_" in name}
        names |= {f"{name} {verb}": f"{_option(name)} {verb}" for name in given for verb in ("is", "has")}
        _write(out, display, names, lambda: self.function(**given))


def _write(out: Path, display: Display, names: Mapping[str, str], draw: Callable[[], Stimulus]) -> None:
    """Draw a stimulus and write its files."""
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
        f"Largest sharpness: {one.controlled['sharpest']:.2g} of that allowed by its blur",
        f"Written: {printable(out)}",
    )


def _options(function: Callable[..., Any]) -> list[click.Parameter]:
    """Return an option for each parameter that can be given on the command line."""
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
    """Carry the options of a shape until they are moved to a command."""


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _kind(hint: Any) -> tuple[Any, bool]:
    """Return the option type for a parameter's type hint (None if unsupported), and whether it is optional."""
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
    """Return the description of each parameter in a docstring, by name."""
    part = about.partition("\nParameters\n")[2].partition("\n\nReturns\n")[0]
    found = {}
    for names, text in re.findall(r"^(\w[\w, ]*)\n((?:    .*\n?|\n)+)", part.partition("\n")[2], re.MULTILINE):
        for name in names.split(","):
            found[name.strip()] = _plain(" ".join(text.split()))
    return found


def _plain(text: str) -> str:
    """Return a docstring's text without code markup."""
    return re.sub(r"`+(\w+)`+", lambda match: match[1], text)


_OUT = click.Option(
    ["--out", "out"], required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the stimulus."
)

_DISPLAY = click.command()(display_options(force_option(json_option(lambda **_: None)))).params

_SCREEN = [str(option.name) for option in _DISPLAY if option.expose_value]


@click.command("replica", short_help="Draw the stimulus of a published experiment.")
@click.argument("paper", metavar="PAPER")
@click.option("--condition", metavar="NAME", help="Condition of the paper.  [default: its first]")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the stimulus.")
@display_options
@force_option
@json_option
def replica(paper: str, condition: str | None, out: Path, **screen: Any) -> None:
    """Draw the stimulus of a published experiment, by the key of PAPER in the bibliography.

    Keys: mather1996, marshall1996, mather2002, taylor2015, watson2011, held2010, vishwanath2010, maiello2017. An
    unknown condition raises an error that lists the known ones. Parameters that the paper's abstract or its authors'
    page do not state are our choices: stimulus.json lists those stated. Pixels are those of the display.

    Writes the files of 'focalgradient stimuli texture-border'. Takes about a second, or up to 20 s for large pictures.

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
    _Drawn("texture-border", "Draw a border between two textures, each with its blur."),
    _Drawn("blurred-edge", "Draw an edge with a pedestal of blur and an increment."),
    _Drawn("dead-leaves", "Draw dead leaves with a given number of blurs."),
    _Drawn("wide-field", "Draw a wide field, blurred at one eccentricity."),
    _Drawn("slanted-plane", "Draw a slanted plane through a lens."),
    _Drawn("corrugated-plane", "Draw a corrugated plane through a lens."),
    _Drawn("miniature", "Draw a large scene blurred like a small model."),
    _Drawn("fixated-cube", "Draw the Necker cube, in focus where it is fixated."),
    replica,
)
"""All commands that draw a stimulus."""
