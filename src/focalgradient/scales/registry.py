"""Registry of response scales: built-in, registered, and declared by installed packages."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from importlib.metadata import entry_points
from typing import Any, TypeVar

from focalgradient.errors import InputError, described
from focalgradient.scales.base import ResponseScale
from focalgradient.scales.ratio import Ratio
from focalgradient.scales.signed import SignedComparison
from focalgradient.scales.steps import OrdinalScale
from focalgradient.scales.two_intervals import TwoIntervals
from focalgradient.scales.visual_analogue import VisualAnalogue

__all__ = ["GROUP", "register", "scale_class", "scale_names", "scale_of"]

GROUP = "focalgradient.scales"
"""Entry-point group by which installed packages declare scales: name of the scale = "module:Class"."""

_REGISTERED: dict[str, type[ResponseScale]] = {}

Class = TypeVar("Class", bound=type[ResponseScale])


def register(scale: Class) -> Class:
    """Register a response scale for this process; also usable as a decorator.

    Raises
    ------
    InputError
        If it is not a complete subclass of `ResponseScale`, or its name is taken.

    Examples
    --------
    >>> register(Ratio).name
    'ratio'
    """
    if not (inspect.isclass(scale) and issubclass(scale, ResponseScale)):
        raise InputError(f"a response scale must be a class derived from ResponseScale, got {described(scale)}.")
    if inspect.isabstract(scale) or not getattr(scale, "name", ""):
        missing = ", ".join(sorted(getattr(scale, "__abstractmethods__", ()))) or "name"
        raise InputError(f"the response scale {scale.__name__} lacks {missing}: define it in the class.")
    if _REGISTERED.setdefault(scale.name, scale) is not scale:
        raise InputError(f"there is a response scale {scale.name!r} already: give {scale.__name__} another name.")
    return scale


for _own in (Ratio, OrdinalScale, SignedComparison, TwoIntervals, VisualAnalogue):
    register(_own)


def scale_names() -> tuple[str, ...]:
    """Return the names of all scales: built-in ones first, then those registered or declared by installed packages.

    >>> scale_names()[:5]
    ('ratio', 'steps', 'bipolar', 'choice', 'visual-analogue')
    """
    declared = sorted(point.name for point in entry_points(group=GROUP))
    return tuple(dict.fromkeys([*_REGISTERED, *declared]))


def scale_class(name: str) -> type[ResponseScale]:
    """Return the class of the scale with a given name.

    Raises
    ------
    InputError
        If the name is unknown (the message lists all names), or a declared class cannot be loaded.

    Examples
    --------
    >>> scale_class("bipolar").__name__
    'SignedComparison'
    """
    if isinstance(name, str) and name not in _REGISTERED:
        for point in entry_points(group=GROUP, name=name):
            try:
                loaded = point.load()
            except Exception as error:
                raise InputError(
                    f"scale is {name!r}, but {point.value} of its package cannot be loaded ({error!r}): repair the "
                    "package."
                ) from error
            if register(loaded).name != name:
                raise InputError(
                    f"scale is {name!r}, but {point.value} is named {loaded.name!r}: give one name to both."
                )
            break
    if not (isinstance(name, str) and name in _REGISTERED):
        known = ", ".join(map(repr, scale_names()))
        raise InputError(f"scale is {described(name)}, but must be one of {known}.")
    return _REGISTERED[name]


def scale_of(settings: Mapping[str, Any]) -> ResponseScale:
    """Create the response scale from the settings of a design, a journal or a sidecar.

    Designs of early versions name no scale: they used ratios.

    Raises
    ------
    InputError
        If the scale is unknown or a setting is invalid.

    Examples
    --------
    >>> scale_of({"scale": "steps", "steps": 5}).bounds
    (1.0, 5.0)
    """
    return scale_class(settings.get("scale", Ratio.name)).of(settings)
