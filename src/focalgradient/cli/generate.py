"""Commands generated from typed functions.

A command is a function: its options are those of its parameters (`focalgradient.options`), its help is the docstring's
text. `Given` and `Made` add the parameters of the library's functions and classes as groups of options.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import click

from focalgradient.cli.program import FORCE_OPTION, JSON_OPTION
from focalgradient.options import File, Folder, Given, Made, options_named, sentences
from focalgradient.options.parameters import first_mark, hints_of, parameters_of, unmarked
from focalgradient.options.shapes import ShapedCommand

__all__ = ["Command", "File", "Folder", "Given", "Made", "command", "options_named", "sentences"]


class Command(ShapedCommand):
    """Command of a typed function, whose options are generated when they are needed."""

    def __init__(self, function: Callable[..., Any], name: str, short_help: str, last: Sequence[click.Option]) -> None:
        super().__init__(name, callback=self._run, short_help=short_help)
        self.function = function
        self.last = last

    @cached_property
    def _groups(self) -> dict[str, Given]:
        marked = {name: first_mark(unmarked(hint)[1], Given) for name, hint in hints_of(self.function).items()}
        return {name: group for name, group in marked.items() if group is not None}

    @cached_property
    def _by_parameter(self) -> dict[str, dict[str, list[click.Parameter]]]:
        """Options of each parameter of the function, by parameter of its group ("" without one)."""
        plain = parameters_of(self.function, Given(self.function), self._groups)
        return {
            name: self._groups[name].parameters() if name in self._groups else {"": found}
            for name, found in plain.items()
        }

    @cached_property
    def _own(self) -> list[click.Parameter]:
        found = [one for parts in self._by_parameter.values() for options in parts.values() for one in options]
        return [*found, *self.last]

    @property
    def params(self) -> list[click.Parameter]:
        """Arguments and options of the function's parameters."""
        return self._own

    @params.setter
    def params(self, _: object) -> None:
        """Ignore the value set by `click.Command`: the options are generated when needed."""

    @property
    def help(self) -> str:
        """The docstring without its parameters."""
        return (inspect.getdoc(self.function) or "").partition("\n\nParameters\n")[0]

    @help.setter
    def help(self, _: object) -> None:
        """Ignore the value set by `click.Command`, as for `params`."""

    def _run(self, **values: Any) -> Any:
        """Run the function with the values of the options."""
        given: dict[str, Any] = {}
        for name, parts in self._by_parameter.items():
            own = {part: values[str(options[0].name)] for part, options in parts.items() if options}
            given[name] = self._groups[name].value(own) if name in self._groups else own[""]
        first = [
            given.pop(one.name)
            for one in inspect.signature(self.function).parameters.values()
            if one.kind is one.POSITIONAL_ONLY
        ]
        return self.function(*first, **given)


def command(
    short_help: str, *options: click.Option, name: str | None = None, json: bool = True, force: bool = True
) -> Callable[[Callable[..., Any]], Command]:
    """Make a command of a typed function.

    Parameters
    ----------
    short_help
        Line in the list of commands.
    options
        Options that the function does not receive, such as ``--task-file``.
    name
        Name of the command. By default the function's, with hyphens.
    json, force
        Whether to add ``--json`` for `show`, and ``--force`` for `writable`.
    """

    def make(function: Callable[..., Any]) -> Command:
        called = name or str(getattr(function, "__name__", "")).replace("_", "-")
        return Command(function, called, short_help, [*options, *[FORCE_OPTION] * force, *[JSON_OPTION] * json])

    return make
