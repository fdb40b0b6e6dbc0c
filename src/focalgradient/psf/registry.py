"""Registry of blur shapes by name, including those that other installed packages add."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from focalgradient.errors import InputError, described
from focalgradient.psf.shape import Psf
from focalgradient.psf.shapes import Annulus, Blend, Disc, Gaussian, Polygon

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = ["GROUP", "SHAPES", "names", "psf_from", "psf_of", "shape_class"]

SHAPES: dict[str, type[Psf]] = {one.name: one for one in (Disc, Gaussian, Blend, Annulus, Polygon)}
"""The shapes of this package, by name."""

GROUP = "focalgradient.psf"
"""Entry-point group by which installed packages add shapes: name = "package.module:Class"."""


@cache
def _added() -> dict[str, EntryPoint]:
    """Return the entry points of other installed packages' shapes by name, without loading them."""
    from importlib.metadata import entry_points  # deferred to keep `import focalgradient` light

    return {one.name: one for one in entry_points(group=GROUP) if one.name not in SHAPES}


def names() -> list[str]:
    """Return the names of all shapes, with those of other installed packages last.

    >>> names()[:5]
    ['disc', 'gaussian', 'blend', 'annulus', 'polygon']
    """
    return [*SHAPES, *sorted(_added())]


def shape_class(name: str, others: tuple[str, ...] = (), called: str = "psf") -> type[Psf]:
    """Return the shape class called `name`; `others` are further names that the caller accepts.

    Raises
    ------
    InputError
        If there is no shape of this name, or the package that adds it cannot be loaded.
    """
    if name in SHAPES:
        return SHAPES[name]
    entry = _added().get(name)
    if entry is None:
        raise InputError(
            f"{called} is {described(name)}, but must be one of {', '.join([*others, *names()])}, or a Psf."
        )
    try:
        made = entry.load()
    except Exception as error:
        raise InputError(
            f"psf {name!r} of {_package(entry)} cannot be loaded ({type(error).__name__}: {error}): repair or "
            "remove it."
        ) from error
    if not (isinstance(made, type) and issubclass(made, Psf)):
        raise InputError(f"psf {name!r} of {_package(entry)} is {described(made)}, but must be a subclass of Psf.")
    return made


def _package(entry: EntryPoint) -> str:
    return f"package {entry.dist.name}" if entry.dist is not None else entry.value


def psf_of(psf: Any, k: float | None = None, others: tuple[str, ...] = (), called: str = "psf") -> Psf:
    """Return the shape for a public function's argument: the shape itself, or the named one with default parameters.

    Parameters
    ----------
    psf
        A shape, or its name.
    k
        sigma / disc radius of a shape that is given by name and has this parameter; None: its default.
    others
        Further names that the caller accepts, for the message.
    called
        Name of the caller's parameter, for the message.

    Raises
    ------
    InputError
        If there is no such shape, `k` is out of range, or `k` is given together with a shape instance.

    Examples
    --------
    >>> psf_of("gaussian", k=0.4)
    Gaussian(k=0.4)
    >>> psf_of("pillbox")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    focalgradient.errors.InputError: psf is 'pillbox', but must be one of disc, gaussian, blend, annulus, polygon...
    """
    if isinstance(psf, Psf):
        if k is not None:
            raise InputError(f"k is given with psf {psf}, which has its own parameters: leave k out.")
        return psf
    if isinstance(psf, type) and issubclass(psf, Psf):
        raise InputError(f"psf is the class {psf.__name__}, but must be a shape of it: give {psf.__name__}().")
    if not isinstance(psf, str):
        known = ", ".join([*others, *names()])
        raise InputError(f"{called} is {described(psf)}, but must be a Psf or one of {known}.")
    shape = shape_class(psf, others, called)
    keys = [one.key for one in shape.parameters()]
    if k is not None:
        _check_k(k)
    return shape.of({"k": k} if k is not None and "k" in keys else {})


def _check_k(k: Any) -> None:
    """Validate `k` even for a shape without it: callers pass a calibrated camera's k with any shape."""
    Gaussian.parameters()[0].check(k)


def psf_from(stated: str | Mapping[str, Any], k: float | None = None) -> Psf:
    """Return the shape stated in a file: a name, or a table with `shape` and its parameters (see `Psf.stated`).

    >>> psf_from({"shape": "polygon", "blades": 5})
    Polygon(blades=5, rotation=0.0)
    """
    if isinstance(stated, str):
        return psf_of(stated, k)
    values = dict(stated)
    name = values.pop("shape", None)
    if not isinstance(name, str):
        raise InputError('psf has no shape: give a name, or a table such as {shape = "polygon", blades = 6}.')
    shape = shape_class(name)
    if k is not None and "k" in [one.key for one in shape.parameters()]:
        values = {"k": k} | values
    return shape.of(values)
