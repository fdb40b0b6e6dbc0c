"""Options of a command line, from the parameters of typed functions and classes.

Positional-only parameters are arguments, the others options. Types and
defaults come from the signature, help from the docstring's section "Parameters", which comes last, and units and bounds
from `focalgradient.quantities`. `Given` and `Made` add the parameters of the library's functions and classes as groups
of options.

The type of a parameter determines its option:

- ``bool``: a flag; ``Literal``: a choice; ``int``, ``float``, ``str``, ``Path``: a value;
- ``tuple[float, ...]``, ``Sequence[float]``: a repeatable option, or an argument of any number of values;
- `ShapeAsked`, or a union with `Psf`: the shape of the blur, with the options of its parameters.

``Annotated`` adds the placeholder in the help ("DIR"), the option's name if it is not the parameter's ("--eye"), a
`Quantity`, a type of click, or a function that receives the option's name and the value and returns what the command
receives; for a type that click does not know, and for a ``Sequence``, the value is the text.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from types import FunctionType, MappingProxyType, UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

import click

from focalgradient.errors import InputError
from focalgradient.options.messages import clause_of, options_named, sentences
from focalgradient.options.shapes import ShapeAsked, shape_parameters
from focalgradient.psf import Psf
from focalgradient.quantities import Quantity

__all__ = ["File", "Folder", "Given", "Made", "first_mark", "hints_of", "parameters_of", "parsed", "unmarked"]

Folder = Annotated[Path, "DIR"]
File = Annotated[Path, "FILE"]

_ENTRIES = re.compile(r"^(\w[\w, ]*)\n((?:    .*\n?|\n)+)", re.MULTILINE)
"""Pattern of parameters and their description in a docstring."""

Mark = TypeVar("Mark")
Record = TypeVar("Record")


@dataclass(frozen=True)
class Given:
    """Parameters of a function or class as options, whose values a command receives as a dictionary by parameter.

    Parameters
    ----------
    target
        Function or class, or "module:name", which is imported when its options are needed.
    options
        Names of options that differ from their parameters', such as {"size_px": "--screen"}.
    only
        Parameters that become options. By default all whose type a command line can give.
    prefix
        Text before each option's help.
    commas
        Whether a sequence is one value with commas, instead of a repeatable option.
    """

    target: Callable[..., Any] | str
    options: Mapping[str, str] = field(default_factory=dict)
    only: Sequence[str] = ()
    prefix: str = ""
    commas: bool = False

    def function(self) -> Callable[..., Any]:
        """Return the function or class."""
        if not isinstance(self.target, str):
            return self.target
        module, _, name = self.target.partition(":")
        loaded: Callable[..., Any] = getattr(import_module(module), name)
        return loaded

    def parameters(self) -> dict[str, list[click.Parameter]]:
        """Return the options of each parameter."""
        return parameters_of(self.function(), self)

    def value(self, given: dict[str, Any]) -> Any:
        """Return what the command receives, for values by parameter."""
        return given


@dataclass(frozen=True)
class Made(Given):
    """The same as `Given`, for a command that receives what the function or class returns for the values."""

    def value(self, given: dict[str, Any]) -> Any:
        """Return the function's result for values by parameter; messages name options."""
        with options_named(sentences({name: self.options.get(name, _option(name)) for name in given})):
            return self.function()(**given)


def parameters_of(
    function: Callable[..., Any], how: Given, groups: Mapping[str, object] = MappingProxyType({})
) -> dict[str, list[click.Parameter]]:
    """Return the options of each parameter of a function; none for those that are `groups`."""
    texts, hints = _texts(function), hints_of(function)
    if unknown := {*how.only, *how.options} - {*hints}:
        raise TypeError(f"{function} has no parameter {', '.join(sorted(unknown))}.")
    parameters: dict[str, list[click.Parameter]] = {}
    for parameter in inspect.signature(function).parameters.values():
        name, hint = parameter.name, hints[parameter.name]
        if how.only and name not in how.only:
            continue
        if name in groups:
            parameters[name] = []
            continue
        option = how.options.get(name, _option(name))
        text = re.sub(
            r"\b\w+_\w+\b",
            lambda word: how.options.get(word[0], _option(word[0])) if word[0] in hints else word[0],
            f"{how.prefix}{texts.get(name, '')}",
        )
        if ShapeAsked is hint or Psf in get_args(hint):
            default = parameter.default
            parameters[name] = [*shape_parameters(text, default.name if isinstance(default, ShapeAsked) else default)]
        elif (made := _made(hint, option, text, parameter, how.commas)) is not None:
            parameters[name] = [made]
        elif how.only or parameter.default is parameter.empty:
            raise TypeError(f"{name} of {function} is {hint}, which a command line cannot give.")
    return parameters


def _made(hint: Any, option: str, text: str, parameter: inspect.Parameter, commas: bool) -> click.Parameter | None:
    """Return the option or argument of one parameter; None if a command line cannot give its type."""
    plain, marks = unmarked(hint)
    several = get_origin(plain) is Sequence or (get_origin(plain) is tuple and get_args(plain)[1:] == (...,))
    kind = get_args(plain)[0] if several else plain
    quantity, reader = first_mark(marks, Quantity), first_mark(marks, FunctionType)
    if get_origin(plain) is Sequence and (commas or reader is not None):
        several, kind, reader = False, str, reader or _listed(kind)
    given = first_mark(marks, click.ParamType) or _click_type(kind, reader is not None)
    if given is None:
        return None
    words = [mark for mark in reversed(marks) if isinstance(mark, str)]
    option = next((word for word in words if word.startswith("--")), option)
    unit = quantity.symbol.upper() if quantity is not None else ""
    how: dict[str, Any] = {
        "type": given,
        "required": parameter.default is parameter.empty,
        "metavar": next((word for word in words if not word.startswith("--")), unit or None),
        "callback": None if quantity is None and reader is None else _checked(quantity, reader),
        **_default(parameter.default, quantity, several),
    }
    if parameter.kind is parameter.POSITIONAL_ONLY:
        return click.Argument([parameter.name], nargs=-1 if several else 1, **how)
    names = [option, option.removeprefix("--").replace("-", "_")]
    if kind is bool:
        return click.Option(names, is_flag=True, help=text)
    return click.Option(names, multiple=several, show_default="default" in how, help=text, **how)


def _default(given: Any, quantity: Quantity | None, several: bool) -> dict[str, Any]:
    """Return a default as users state it, if it is one other than None and an empty tuple."""
    if given in (inspect.Parameter.empty, None, ()):
        return {}
    parts = given if isinstance(given, tuple) else (given,)
    if quantity is not None and quantity.scale != 1:
        # Without the rounding of the division.
        parts = tuple(float(f"{part * quantity.parts / quantity.scale:.12g}") for part in parts)
    if several:
        return {"default": parts}
    words = [f"{part:g}" if isinstance(part, float) else str(part) for part in parts]
    return {"default": ",".join(words) if isinstance(given, tuple) else parts[0]}


def _click_type(kind: Any, read: bool) -> click.ParamType[Any] | None:
    """Return click's type of a value; text for a type that only a function of the command reads."""
    if get_origin(kind) is Literal:
        return click.Choice([str(value) for value in get_args(kind)])
    known: dict[Any, click.ParamType[Any]] = {float: click.FLOAT, int: click.INT, str: click.STRING, bool: click.BOOL}
    return known.get(kind) or (click.Path(path_type=Path) if kind is Path else click.STRING if read else None)


def unmarked(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    """Return a type without None, and what ``Annotated`` adds to it."""
    marks: tuple[Any, ...] = ()
    while True:
        if get_origin(hint) is Annotated:
            hint, marks = get_args(hint)[0], (*hint.__metadata__, *marks)
        elif get_origin(hint) in (Union, UnionType) and type(None) in get_args(hint):
            rest = [part for part in get_args(hint) if part is not type(None)]
            if len(rest) > 1:
                return hint, marks
            hint = rest[0]
        else:
            return hint, marks


def first_mark(marks: Sequence[Any], kind: type[Mark]) -> Mark | None:
    """Return the outermost mark of a kind; None without one."""
    return next((mark for mark in reversed(marks) if isinstance(mark, kind)), None)


def hints_of(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the type of each parameter; None for types that its module imports for type checkers only."""
    names = vars(sys.modules[function.__module__])
    hints = {}
    for name, parameter in inspect.signature(function).parameters.items():
        hints[name] = parameter.annotation
        if isinstance(parameter.annotation, str):
            try:
                hints[name] = eval(parameter.annotation, names)
            except NameError:
                hints[name] = None
    return hints


def _checked(quantity: Quantity | None, reader: Callable[[str, Any], Any] | None) -> Callable[..., Any]:
    """Return an option's callback that checks a quantity and reads a value."""

    def check(_: click.Context, option: click.Parameter, given: Any) -> Any:
        called = option.opts[0] if isinstance(option, click.Option) else option.human_readable_name
        if given is not None and reader is not None:
            given = reader(called, given)
        if given is None or quantity is None:
            return given
        if isinstance(given, tuple):
            return tuple(quantity.value(value, called) for value in given)
        return quantity.value(given, called)

    return check


def _listed(kind: Callable[[str], Any]) -> Any:
    """Return a reader of values separated by commas."""

    def split(option: str, given: str) -> tuple[Any, ...]:
        try:
            return tuple(kind(part.strip()) for part in given.split(",") if part.strip())
        except ValueError as error:
            what = "numbers like 0,2.5" if kind is float else "names with commas"
            raise InputError(f"{option} is {given!r}, but must be {what}.") from error

    return split


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _texts(function: Callable[..., Any]) -> dict[str, str]:
    """Return the description of each parameter in a docstring, of a class also in those of its bases, by name."""
    documents = map(inspect.getdoc, reversed(inspect.getmro(function)) if inspect.isclass(function) else (function,))
    sections = [(text or "").partition("\nParameters\n----------\n")[2] for text in documents]
    texts = {}
    for names, text in [
        entry for section in sections for entry in _ENTRIES.findall(re.split(r"\n\n\w+\n---", section)[0])
    ]:
        for name in names.split(","):
            texts[name.strip()] = re.sub(r"`+(\w+)`+", r"\1", _wrapped(text)).replace(" [default", "  [default")
    return texts


def _wrapped(text: str) -> str:
    r"""Join the lines of each paragraph, except of one that begins with click's mark against that, a line of \\b.

    >>> _wrapped("a\n  b\n\n\\b\nc\n  d")
    'a b\n\n\x08\nc\nd'
    """
    paragraphs = [[line.strip() for line in paragraph.splitlines()] for paragraph in re.split(r"\n\s*\n", text.strip())]
    return "\n\n".join(
        "\n".join(["\b", *lines[1:]]) if lines[0] in ("\b", r"\b") else " ".join(" ".join(lines).split())
        for lines in paragraphs
    )


def parsed(kind: type[Record], given: Sequence[str], *, program: str, about: str) -> Record:
    """Parse a command line into the fields of a class; ``--help`` prints them and exits.

    Parameters
    ----------
    kind
        Class whose parameters are the options.
    given
        Words of the command line.
    program, about
        Name and description of the program, for its help.

    Raises
    ------
    InputError
        If an option is unknown, missing or invalid.
    """
    options = Given(kind, only=[*inspect.signature(kind).parameters]).parameters()
    command = click.Command(
        program,
        params=[option for group in options.values() for option in group],
        help=about,
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    try:
        with command.make_context(program, [*given]) as context:
            return kind(**{name: context.params[str(group[0].name)] for name, group in options.items()})
    except click.exceptions.Exit as done:
        sys.exit(done.exit_code)
    except click.UsageError as error:
        raise InputError(f"{clause_of(error)}: see --help.") from error
