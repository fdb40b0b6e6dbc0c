"""Options for the shape of the blur, generated from the parameters of the shapes."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import click

from focalgradient.depth.settings import AUTO, SOURCES, BlurSource
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.psf import Parameter, Psf, names, shape_class
from focalgradient.psf.registry import SHAPES

__all__ = ["AUTO_SHAPE", "ShapeAsked", "ShapedCommand", "shape_parameters"]

PREFIX = "psf_parameter_"
"""Prefix of these options' values among a command's parameters, before `ShapedCommand` collects them."""


@dataclass(frozen=True, slots=True)
class ShapeAsked:
    """Shape of the blur that a user requested: its name, and the parameters given."""

    name: str
    values: Mapping[str, float]

    def source(self) -> BlurSource:
        """Return the shape, or "auto".

        Raises
        ------
        InputError
            If a parameter belongs to another shape, or is out of range.
        """
        if self.name in SOURCES:
            self._refuse_others(())
            return self.name
        return self.shape()

    def stated(self) -> str | dict[str, Any]:
        """Return the name, or a table of the shape and the parameters given; raise `InputError` as `source`."""
        self.source()
        return {"shape": self.name, **self.values} if self.values else self.name

    def shape_or_none(self) -> Psf | None:
        """Return the shape, or None for "auto"."""
        source = self.source()
        return source if isinstance(source, Psf) else None

    def shape(self) -> Psf:
        """Return the shape, for a command without "auto"."""
        shape = shape_class(self.name)
        known = {parameter.key: parameter for parameter in shape.parameters()}
        self._refuse_others(known)
        for key, value in self.values.items():
            known[key].check(value, f"--{_option(known[key])}")
        return shape.of(self.values)

    def _refuse_others(self, known: Iterable[str]) -> None:
        for key in self.values:
            if key not in known:
                whose = [name for name in names() if key in [parameter.key for parameter in _parameters(name)]]
                option = next(_option(parameter) for parameter in _parameters(whose[0]) if parameter.key == key)
                raise InputError(
                    f"--{option} belongs to psf {' or '.join(whose)}, but --psf is {self.name}: give --psf {whose[0]}."
                )


AUTO_SHAPE = ShapeAsked(AUTO, {})
"""No shape requested."""


class ShapedCommand(click.Command):
    """Command with the options of `shape_parameters`, which its function receives as a `ShapeAsked` named psf."""

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Return the parameters, including those of shapes that other installed packages add."""
        given = super().get_params(ctx)
        if all(parameter.name != "psf" for parameter in given):
            return given
        opts = {opt for parameter in given for opt in parameter.opts}
        given_names = {parameter.name for parameter in given}
        more = [
            parameter
            for parameter in _parameter_options(set(names()) - set(SHAPES), opts)
            if parameter.name not in given_names
        ]
        place = 1 + max(
            (n for n, parameter in enumerate(given) if (parameter.name or "").startswith(PREFIX)), default=-1
        )
        return [*given[:place], *more, *given[place:]]

    def invoke(self, ctx: click.Context) -> Any:
        """Collect the shape's parameters, and run the command."""
        if "psf" not in ctx.params:
            return super().invoke(ctx)
        given = {name: ctx.params.pop(name) for name in list(ctx.params) if name.startswith(PREFIX)}
        values = {name.removeprefix(PREFIX): value for name, value in given.items() if value is not None}
        ctx.params["psf"] = ShapeAsked(ctx.params["psf"], values)
        return super().invoke(ctx)


class _ShapeName(click.Choice[str]):
    """Name of a shape, or "auto"; shapes of other packages are looked up only when needed."""

    case_sensitive = True

    def __init__(self, auto: bool) -> None:
        self.auto = auto

    @property
    def choices(self) -> tuple[str, ...]:  # type: ignore[override]
        """Names known at present."""
        return (*[AUTO] * self.auto, *names())


def shape_parameters(help: str, default: str = AUTO) -> list[click.Parameter]:
    """Return ``--psf``, and an option for each parameter of a shape, for a `ShapedCommand`."""
    kind = _ShapeName(default == AUTO)
    psf = click.Option(["--psf"], type=kind, default=default, show_default=True, help=help)
    return [psf, *_parameter_options(SHAPES, set())]


def _parameters(name: str) -> tuple[Parameter, ...]:
    """Return the parameters of a shape; none if it belongs to a package that cannot be loaded."""
    try:
        shape: type[Psf] = shape_class(name)
    except InputError as error:
        warnings.warn(str(error), FocalGradientWarning, stacklevel=2)
        return ()
    return shape.parameters()


def _option(parameter: Parameter) -> str:
    return parameter.name.replace("_", "-")


def _parameter_options(shapes: Iterable[str], taken: set[str]) -> list[click.Option]:
    """Return an option for each parameter of the `shapes`, shared between them; `taken` are other options' names."""
    users: dict[str, list[tuple[str, Parameter]]] = {}
    for name in sorted(shapes, key=names().index):
        for parameter in _parameters(name):
            users.setdefault(parameter.key, []).append((name, parameter))
    options = []
    for key, shared in users.items():
        parameter = shared[0][1]
        whose = " or ".join(name for name, _ in shared)
        defaults = ", ".join(dict.fromkeys(f"{user.default:g}" for _, user in shared))
        unit = f" ({parameter.unit})" if parameter.unit else ""
        option = f"--{_option(parameter)}"
        options.append(
            click.Option(
                [f"--psf-{_option(parameter)}" if option in taken else option, f"{PREFIX}{key}"],
                type=int if parameter.whole else float,
                metavar=parameter.unit.upper() or ("N" if parameter.whole else "X"),
                help=f"For psf {whose}: {parameter.help}{unit}.  [default: {defaults}]",
            )
        )
    return options
