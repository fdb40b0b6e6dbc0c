"""What focalgradient says when it is given something it cannot use."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "FocalGradientWarning",
    "InputError",
    "check_finite",
    "check_installed",
    "check_list",
    "check_number",
    "check_seed",
    "described",
    "is_number",
]


class InputError(ValueError):
    """Bad input: the message names what was wrong, what was expected and the remedy, in one sentence."""


class FocalGradientWarning(UserWarning):
    """A result that can be used, with something about it that the user should know."""


def check_number(
    name: str, value: Any, unit: str, *, least: float = -math.inf, positive: bool = False, finite: bool = True
) -> None:
    """Refuse what is no number, NaN, not finite (unless `finite` is False), below `least`, or not `positive`.

    >>> check_number("pupil", float("nan"), "metres", positive=True)
    Traceback (most recent call last):
    focalgradient.errors.InputError: pupil is nan, but must be a positive finite number: give it in metres.
    """
    if is_number(value) and value >= least and (value > 0 or not positive) and not (finite and math.isinf(value)):
        return
    kind = f"a {'positive ' * positive}{'finite ' * finite}number"
    bound = "" if math.isinf(least) else f" of {least:g} or more"
    raise InputError(f"{name} is {described(value)}, but must be {kind}{bound}: give it in {unit}.")


def check_seed(seed: Any) -> None:
    """Refuse what no generator of random numbers begins from.

    >>> check_seed(-1)
    Traceback (most recent call last):
    focalgradient.errors.InputError: seed is -1, but must be a whole number of 0 or more.
    """
    if not (isinstance(seed, int) and seed >= 0):
        raise InputError(f"seed is {described(seed)}, but must be a whole number of 0 or more.")


def is_number(value: Any) -> bool:
    """Whether this is one real number.

    >>> is_number(2), is_number(np.float32(0.5)), is_number("2"), is_number([2]), is_number(None)
    (True, True, False, False, False)
    """
    return np.ndim(value) == 0 and np.asarray(value).dtype.kind in "iuf"


def check_finite(name: str, values: ArrayLike, unit: str) -> NDArray[np.float64]:
    """`values` as an array, refused unless all are finite numbers."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} is {described(values)}, but must hold numbers: give it in {unit}.") from error
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} holds NaN or infinite values, but must be finite: give it in {unit}.")
    return array


def check_installed(what: str, extra: str, *modules: str) -> None:
    """Refuse where one of `modules` is missing; `what` needs them, and the extra brings them. None is imported.

    >>> check_installed("a picture", "eye", "numpy", "no_such")
    Traceback (most recent call last):
    focalgradient.errors.InputError: a picture needs no_such, which is not installed: pip install 'focalgradient[eye]'.
    """
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    if missing:
        are = "is" if len(missing) == 1 else "are"
        raise InputError(
            f"{what} needs {', '.join(missing)}, which {are} not installed: pip install 'focalgradient[{extra}]'."
        )


def check_list(name: str, values: Any, what: str) -> list[Any]:
    """`values` as a list, refused unless it is a list or another sequence; `what` it should hold stands in the message.

    >>> check_list("views", 3.0, "views")
    Traceback (most recent call last):
    focalgradient.errors.InputError: views is 3.0, but must be a list of views: put it in square brackets.
    """
    if isinstance(values, str | bytes | np.ndarray | Mapping) or not isinstance(values, Iterable):
        raise InputError(f"{name} is {described(values)}, but must be a list of {what}: put it in square brackets.")
    return list(values)


def described(value: Any) -> str:
    """A few words for a value of any kind, for a message: the value itself where it is short.

    >>> described(0.5), described("wide"), described(np.zeros((2, 3))), described([1] * 99)
    ('0.5', "'wide'", 'an array of shape (2, 3)', 'a list of 99')
    """
    if isinstance(value, np.ndarray) and value.ndim:
        return f"an array of shape {value.shape}"
    if isinstance(value, np.generic | np.ndarray):
        return repr(value.item())
    text = repr(value)
    if len(text) <= 40 and "\n" not in text:
        return text
    count = f" of {len(value)}" if isinstance(value, list | tuple | dict | set) else ""
    name = type(value).__name__
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}{count}"
