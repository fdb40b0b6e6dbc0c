"""Commands generated from typed functions: what the signature, its units and the docstring make of the command line."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import click
from click.testing import CliRunner, Result

from focalgradient.cli.generate import Folder, Made, command
from focalgradient.errors import InputError
from focalgradient.quantities import METRES, MICROMETRES, MILLIMETRES


@dataclass(frozen=True)
class Lens:
    """A lens.

    Parameters
    ----------
    focal_length
        Focal length, for a sensor of pixel_pitch.
    pixel_pitch
        Pixel pitch.
    side, name
        Of the focus.

    Raises
    ------
    InputError
        If it is too long.
    """

    focal_length: Annotated[float, MILLIMETRES.si]
    pixel_pitch: Annotated[float | None, MICROMETRES.si] = 2e-6
    side: Literal["near", "far"] = "near"
    name: str | None = None

    def __post_init__(self) -> None:
        if self.focal_length > 1:
            raise InputError(f"focal_length is {self.focal_length:g}, but side is {self.side}, so it is long.")


def run(made: click.Command, *words: str) -> Result:
    """Run a command; an `InputError` is the result's exception."""
    return CliRunner().invoke(made, words)


def received(made: click.Command, *words: str) -> str:
    result = run(made, *words)
    assert result.exception is None, (result.output, result.exception)
    return result.stdout.strip()


def test_types_and_defaults_come_from_the_signature_and_help_from_the_docstring():
    @command("Short.", json=False, force=False)
    def try_out(
        paths: tuple[Path, ...],
        word: str = "w",
        /,
        *,
        out: Annotated[Folder, "DATASET"],
        number: int = 3,
        kind: Literal["a", "b"] | None = None,
        flag: bool = False,
        several: tuple[float, ...] = (),
        distance: Annotated[float | None, METRES, "--at"] = None,
    ) -> None:
        """Try it out.

        \b
        Example:
          try-out

        Parameters
        ----------
        out
            Where to,
            in two lines.  [default: none]
        number
            Of `paths`, by out_of and several.
        """
        click.echo(repr((paths, word, out, number, kind, flag, several, distance)))

    words = ["a", "b", "--out", "o", "--kind", "b", "--flag", "--several", "1", "--several", "2", "--at", "4"]
    assert eval(received(try_out, *words), {"PosixPath": Path, "WindowsPath": Path}) == (
        (Path("a"),),
        "b",
        Path("o"),
        3,
        "b",
        True,
        (1.0, 2.0),
        4.0,
    )
    assert (try_out.name, try_out.short_help) == ("try-out", "Short.")
    told = " ".join(run(try_out, "--help").stdout.split())
    assert "PATHS... [WORD]" in told
    assert "Example: try-out" in told
    assert "Parameters" not in told
    assert "--out DATASET Where to, in two lines. [default: none] [required]" in told
    assert "Of paths, by out_of and several. [default: 3]" in told
    assert "--at M" in told
    assert run(try_out, "a", "--out", "o", "--kind", "c").exit_code == 2


def test_a_parameter_in_si_units_is_given_in_the_unit_of_its_kind():
    @command("Short.")
    def show_lens(*, lens: Annotated[Lens, Made(Lens)]) -> None:
        """Show."""
        click.echo(f"{lens.focal_length!r} {lens.pixel_pitch!r} {lens.side} {lens.name}")

    assert received(show_lens, "--focal-length", "50") == "0.05 2e-06 near None"
    told = " ".join(run(show_lens, "--help").stdout.split())
    assert "--focal-length MM Focal length, for a sensor of --pixel-pitch. [required]" in told
    assert "[default: 2.0]" in told
    assert "--side [near|far] Of the focus. [default: near]" in told


def test_messages_of_the_library_name_options():
    @command("Short.")
    def show_lens(*, lens: Annotated[Lens, Made(Lens, {"focal_length": "--efl"})]) -> None:
        """Show."""

    message = str(run(show_lens, "--efl", "2000").exception)
    assert message == "--efl is 2, but --side is near, so it is long."
    message = str(run(show_lens, "--efl", "0").exception)
    assert message == "--efl is 0, but must be a positive number of millimetres."
    message = str(run(show_lens, "--efl", "1e10").exception)
    assert message == "--efl is 1e+10, but must be a number of millimetres from 1e-06 to 1e+09."
