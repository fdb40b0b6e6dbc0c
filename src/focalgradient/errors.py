"""Exceptions, warnings and validation of arguments, with messages in one sentence."""

from __future__ import annotations

import dataclasses
import difflib
import importlib.util
import inspect
import math
import re
import shlex
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache, partial, wraps
from types import UnionType
from typing import Annotated, Any, Literal, Protocol, TypeVar, Union, cast, get_args, get_origin

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Bounds",
    "FocalGradientWarning",
    "InputError",
    "check_arguments",
    "check_fields",
    "check_finite",
    "check_installed",
    "check_list",
    "check_number",
    "check_one_of",
    "check_seed",
    "checked",
    "described",
    "entries_as_options",
    "is_number",
    "located",
    "nearest",
    "one_line",
    "suggestion",
    "warn",
]


_OVERLONG_WORD = re.compile(r"(\S{100})\S{200,}(\S{100})")
"""Words of 400 letters or more, which are shortened in messages."""

MAX_QUOTED = 40
"""Maximum length, in characters, of a value quoted in a message."""


MAX_SEED = 2**62 - 1
"""Maximum random seed: seeds derived from it by addition still fit into 64 bits."""


Checked = TypeVar("Checked", bound=Callable[..., Any])


class InputError(ValueError):
    """Invalid input: one sentence names the fault, the expected value and the remedy."""


class FocalGradientWarning(UserWarning):
    """Warning about a result that is usable with the stated reservation."""


@contextmanager
def located(where: object) -> Iterator[None]:
    """Begin the message of an `InputError` raised inside the block with the place of the fault.

    >>> with located("camera.toml"):
    ...     raise InputError("blur_k is missing: give it.")
    Traceback (most recent call last):
    focalgradient.errors.InputError: camera.toml: blur_k is missing: give it.
    """
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}: {error}") from error


def warn(text: str) -> None:
    """Issue a `FocalGradientWarning` that points to the line outside of the package which led to it."""
    level, frame = 1, sys._getframe(0)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith(__package__):
        level, frame = level + 1, frame.f_back
    warnings.warn(text, FocalGradientWarning, stacklevel=level)


def check_number(
    name: str, value: Any, unit: str, *, least: float = -math.inf, positive: bool = False, finite: bool = True
) -> None:
    """Raise `InputError` unless `value` is a number that is finite, `positive` and `least` or more, as required.

    >>> check_number("pupil", float("nan"), "metres", positive=True)
    Traceback (most recent call last):
    focalgradient.errors.InputError: pupil is nan, but must be a positive finite number: give it in metres.
    """
    if is_number(value) and value >= least and (value > 0 or not positive) and not (finite and math.isinf(value)):
        return
    kind = f"a {'positive ' * positive}{'finite ' * finite}number"
    bound = "" if math.isinf(least) else f" of {least:g} or more"
    raise InputError(f"{name} is {described(value)}, but must be {kind}{bound}: give it in {unit}.")


def check_tolerance(name: str, value: Any) -> float:
    """Return `value`, a relative standard deviation; raise `InputError` unless it is a number from 0 to below 1.

    >>> check_tolerance("focus_tolerance", 5)
    Traceback (most recent call last):
    focalgradient.errors.InputError: focus_tolerance is 5, but must be a fraction from 0 to below 1, such as 0.05.
    """
    if not (is_number(value) and 0 <= value < 1):
        raise InputError(f"{name} is {described(value)}, but must be a fraction from 0 to below 1, such as 0.05.")
    return float(value)


def check_seed(seed: Any) -> None:
    """Validate a random seed: a non-negative integer of at most 62 bits.

    >>> check_seed(-1)
    Traceback (most recent call last):
    focalgradient.errors.InputError: seed is -1, but must be a whole number of 0 or more, of 62 bits at most.
    """
    if not (isinstance(seed, int) and 0 <= seed <= MAX_SEED):
        raise InputError(f"seed is {described(seed)}, but must be a whole number of 0 or more, of 62 bits at most.")


def one_line(sentence: object) -> str:
    r"""Return a message on one line, with overlong words (found only in damaged files) shortened.

    >>> one_line("a\\nb " + "x" * 9999).count("x")
    200
    """
    return _OVERLONG_WORD.sub(r"\1...\2", " ".join(str(sentence).split()))


def check_fields(record: object) -> None:
    """Validate the types of a dataclass's fields; call it first in ``__post_init__``.

    Numbers, strings, booleans, arrays, tuples of these, and classes are checked; None is accepted where declared.

    >>> from focalgradient.scenes import Mark
    >>> Mark("near", ("0.1", 0.0, 0.5))
    Traceback (most recent call last):
    focalgradient.errors.InputError: point is ('0.1', 0.0, 0.5), but must be 3 numbers.
    """
    check_arguments(type(record), {one.name: getattr(record, one.name) for one in dataclasses.fields(record)})  # type: ignore[arg-type]


def check_arguments(function: Callable[..., Any], given: Mapping[str, Any]) -> None:
    """Validate the arguments `given` to a function by the types, and the bounds beside them, of its parameters."""
    for name, (bounds, matches, expected) in _expectations(function).items():
        value = given[name]
        if bounds is not None and not (value is None and matches(None)):
            rows = isinstance(value, tuple | list) and matches(value)
            for number in value if rows else (value,):
                bounds.check(name, number)
        elif not matches(value):
            raise InputError(f"{name} is {described(value)}, but must be {expected}.")


def checked(function: Checked) -> Checked:
    """Decorate a function whose arguments are then validated by their types, and the bounds beside them.

    >>> @checked
    ... def halved(number: float) -> float:
    ...     return number / 2
    >>> halved("2")
    Traceback (most recent call last):
    focalgradient.errors.InputError: number is '2', but must be a number.
    """
    signature = inspect.signature(function)

    @wraps(function)
    def call(*args: Any, **given: Any) -> Any:
        bound = signature.bind(*args, **given)
        bound.apply_defaults()
        check_arguments(function, bound.arguments)
        return function(*args, **given)

    return cast(Checked, call)


class Bounds(Protocol):
    """Bounds beside a type, ``Annotated[float, bounds]``."""

    def check(self, name: str, value: Any) -> None:
        """Raise `InputError` unless `value`, that of the parameter `name`, is within the bounds."""


Expectation = tuple[Callable[[Any], bool], str]
"""Predicate that tests a value for a declared type, and the type's description in messages."""


@cache
def _expectations(kind: Any) -> dict[str, tuple[Bounds | None, Callable[[Any], bool], str]]:
    """Return bounds and expected type of each field or parameter, except those whose annotations cannot be checked."""
    names = vars(sys.modules[kind.__module__])
    hints = {one.name: one.type for one in dataclasses.fields(kind)} if isinstance(kind, type) else kind.__annotations__
    found = {}
    for name, written in hints.items():
        try:
            hint = eval(written, names) if isinstance(written, str) else written
        except NameError:  # imported only for type checking
            continue
        bounds, expectation = _bounds(hint), _expectation(hint)
        if name != "return" and (bounds or expectation) is not None:
            found[name] = (bounds, *(expectation or (partial(_is_none, type(None) in get_args(hint)), "")))
    return found


def _is_none(allowed: bool, value: Any) -> bool:
    return allowed and value is None


def _bounds(hint: Any) -> Bounds | None:
    """Return the bounds beside a type, or beside one of its alternatives."""
    if get_origin(hint) is Annotated:
        return next((one for one in hint.__metadata__ if callable(getattr(one, "check", None))), None)
    parts = get_args(hint) if get_origin(hint) in (Union, UnionType) else ()
    return next(filter(None, map(_bounds, parts)), None)


def _expectation(hint: Any) -> Expectation | None:
    if get_origin(hint) is Annotated:
        hint = get_args(hint)[0]
    parts = get_args(hint)
    if get_origin(hint) in (Union, UnionType):
        within = [_expectation(part) for part in parts]
        known = [one for one in within if one is not None]
        if len(known) < len(within):
            return None
        return lambda value: any(matches(value) for matches, _ in known), " or ".join(what for _, what in known)
    if get_origin(hint) is tuple:
        inner = _expectation(parts[0])
        if inner is None or len(set(parts) - {...}) > 1:
            return (lambda value: isinstance(value, Sequence) and not isinstance(value, str)), "a tuple"
        length = None if parts[-1] is ... else len(parts)
        return partial(_is_row, inner[0], length), f"{length} {inner[1].split(' ', 1)[-1]}s" if length else "a tuple"
    if get_origin(hint) in (list, Sequence):
        inner = _expectation(parts[0])
        return None if inner is None else (partial(_is_row, inner[0], None), f"a list, each {inner[1]}")
    if get_origin(hint) is Literal:
        return (lambda value: isinstance(value, str | int) and value in parts), (
            f"one of {', '.join(map(str, parts))}" if len(parts) > 2 else " or ".join(map(repr, parts))
        )
    if get_origin(hint) is np.ndarray or hint is np.ndarray:
        return (lambda value: isinstance(value, np.ndarray) and value.ndim > 0), "an array"
    simple: dict[Any, Expectation] = {
        float: (is_number, "a number"),
        int: (lambda value: isinstance(value, int | np.integer), "a whole number"),
        bool: (lambda value: isinstance(value, bool | np.bool_), "True or False"),
        str: (lambda value: isinstance(value, str), "a text"),
        None: (lambda value: value is None, "None"),
        type(None): (lambda value: value is None, "None"),
    }
    if hint in simple:
        return simple[hint]
    if isinstance(hint, type) and hint is not Any and not getattr(hint, "_is_protocol", False):
        return (lambda value: isinstance(value, hint)), f"of the class {hint.__name__}"
    return None


def _is_row(matches: Callable[[Any], bool], length: int | None, value: Any) -> bool:
    """Return whether a value is a sequence, of a given length or any, whose items all match."""
    if isinstance(value, str | bytes | Mapping | set) or not isinstance(value, Sequence | np.ndarray):
        return False
    if isinstance(value, np.ndarray) and value.ndim == 0:
        return False
    return length in (None, len(value)) and all(map(matches, value))


def is_number(value: Any) -> bool:
    """Return whether a value is a single real number.

    >>> is_number(2), is_number(np.float32(0.5)), is_number("2"), is_number([2]), is_number(None)
    (True, True, False, False, False)
    """
    if isinstance(value, str | bytes | list | tuple | dict):
        return False
    try:
        array = np.asarray(value)
    except Exception:  # a foreign object's conversion to an array may raise anything
        return False
    return array.ndim == 0 and array.dtype.kind in "iuf"


def check_finite(name: str, values: ArrayLike, unit: str) -> NDArray[np.float64]:
    """Return `values` as a float array; raise `InputError` unless all are finite numbers."""
    try:
        array = np.asarray(values, dtype=float)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise InputError(f"{name} is {described(values)}, but must contain numbers: give it in {unit}.") from error
    if not np.all(np.isfinite(array)):
        raise InputError(f"{name} contains NaN or infinite values, but must be finite: give it in {unit}.")
    return array


SIMILAR = 0.7
"""Minimum similarity (`difflib`) of a name that is suggested: .8 and more for slips; .67 for two lengths in mm."""


def nearest(given: Any, known: Iterable[str]) -> str | None:
    """Return the known name most similar to an unknown one, or None if none is similar.

    >>> nearest("depth-ratng", ["depth-rating", "necker"]), nearest(3, ["necker"])
    ('depth-rating', None)
    """
    close = difflib.get_close_matches(given.lower(), list(known), 1, SIMILAR) if isinstance(given, str) else []
    return next(iter(close), None)


def suggestion(given: Any, known: Iterable[str]) -> str:
    """Return the end of a message on an unknown name, which suggests the `nearest` known one.

    >>> suggestion("depth-ratng", ["depth-rating", "necker"]), suggestion(3, ["necker"])
    (': did you mean depth-rating?', '.')
    """
    found = nearest(given, known)
    return "." if found is None else f": did you mean {found}?"


def check_one_of(name: str, value: Any, known: Iterable[str]) -> None:
    """Raise `InputError` unless `value` is one of the `known` names, suggesting the most similar one.

    >>> check_one_of("task", "pinhle", ["necker", "pinhole"])
    Traceback (most recent call last):
    focalgradient.errors.InputError: task is 'pinhle', but must be one of necker, pinhole: did you mean pinhole?
    """
    names = list(known)
    if not (isinstance(value, str) and value in names):
        raise InputError(
            f"{name} is {described(value)}, but must be one of {', '.join(names)}{suggestion(value, names)}"
        )


def check_installed(what: str, extra: str, *modules: str) -> None:
    """Raise `InputError` if any of `modules` is not installed, naming the `extra` to install; import none of them.

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
    """Return `values` as a list; raise `InputError` unless it is a sequence, `what` being the items' description.

    >>> check_list("views", 3.0, "views")
    Traceback (most recent call last):
    focalgradient.errors.InputError: views is 3.0, but must be a list of views: put it in square brackets.
    """
    if isinstance(values, str | bytes | np.ndarray | Mapping) or not isinstance(values, Iterable):
        raise InputError(f"{name} is {described(values)}, but must be a list of {what}: put it in square brackets.")
    return list(values)


def described(value: Any) -> str:
    """Return a short description of any value for a message; short values are quoted as they are.

    >>> described(0.5), described("wide"), described(np.zeros((2, 3))), described([1] * 99), described(10**400)
    ('0.5', "'wide'", 'an array of shape (2, 3)', 'a list of 99', 'a whole number of more than 40 digits')
    """
    if isinstance(value, np.ndarray) and value.ndim:
        return f"an array of shape {value.shape}"
    if isinstance(value, np.generic | np.ndarray):
        return repr(value.item())
    if isinstance(value, int) and abs(value) >= 10**MAX_QUOTED:
        return f"a whole number of more than {MAX_QUOTED} digits"
    try:
        text = repr(value)
    except Exception:  # nested too deeply, or an object whose repr fails
        text = "\n"
    if len(text) <= MAX_QUOTED and "\n" not in text:
        return text
    if isinstance(value, str):
        return f"a text of {len(value)} letters"
    count = f" of {len(value)}" if isinstance(value, list | tuple | dict | set) else ""
    name = type(value).__name__
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}{count}"


_ENTRY = re.compile(r'\b(\w+)=(?:\{((?:"[^"]*": "[^"]*"(?:, )?)+)\}|\[((?:"[^"]*"(?:, )?)+)\])')
"""Pattern of a mapping or a list in the library's messages: columns={"rating": "NAME"}, by=["NAME"]."""


def entries_as_options(sentence: str) -> str:
    """Return a message of the library with options instead of entries of mappings and lists.

    >>> entries_as_options('choose with where={"phase": "main"}, or give by=["light level", "eye"].')
    "choose with --where phase=main, or give --by 'light level' --by eye."
    >>> entries_as_options('name them with columns={"rating": "NAME", "scene": "NAME"}.')
    'name them with --columns rating=NAME,scene=NAME.'
    >>> entries_as_options('give scale="ordinal".')
    'give --ordinal.'
    """

    def option(entry: re.Match[str]) -> str:
        pairs = re.findall(r'"([^"]*)": "([^"]*)"', entry[2] or "")
        values = [",".join(map("=".join, pairs))] if pairs else re.findall(r'"([^"]*)"', entry[3])
        return " ".join(f"--{entry[1]} {shlex.quote(value)}" for value in values)

    return _ENTRY.sub(option, sentence).replace('scale="ordinal"', "--ordinal")
