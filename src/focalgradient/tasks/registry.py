"""Registry of tasks: built-in, registered, and declared by installed packages."""

from __future__ import annotations

import importlib
import inspect
import os
import re
import sys
from collections.abc import Mapping
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, TypeVar

from focalgradient.errors import InputError, check_one_of, described
from focalgradient.tasks.base import Task

__all__ = ["FILES", "GROUP", "OURS", "is_task", "load_file", "register", "task_named", "task_names", "unknown_task"]

GROUP = "focalgradient.tasks"
"""Entry-point group by which installed packages declare tasks: name of the task = "module:Class"."""

OURS: Mapping[str, str] = {
    "depthrating": "focalgradient.experiments.depth_rating:DepthRating",
    "necker": "focalgradient.experiments.necker:NeckerRotation",
    "pinhole": "focalgradient.experiments.pinhole:PinholeDemonstration",
    "blurthreshold": "focalgradient.experiments.blur_threshold:BlurThreshold",
    "published": "focalgradient.published.task:PublishedTask",
}
"""Built-in tasks, in the notation of entry points."""

FILES = "FOCALGRADIENT_TASKS"
"""Environment variable that lists Python files of tasks, separated as in PATH; `task_named` adds a file to it, so that
worker processes also load it.
"""

LABEL = re.compile(r"[A-Za-z0-9]+")

_REGISTERED: dict[str, Task] = {}

Class = TypeVar("Class", bound=type[Task])


def register(task: Class) -> Class:
    """Register a task for this process; also usable as a decorator.

    Raises
    ------
    InputError
        If it is not a complete subclass of `Task`, its name is not a label or is taken, or its design has no defaults.

    Examples
    --------
    >>> type(task_named("depth-rating")).__name__
    'DepthRating'
    """
    if not (inspect.isclass(task) and issubclass(task, Task)):
        raise InputError(f"a task must be a class derived from Task, got {described(task)}.")
    if missing := [name for name in ("answer", "design", "trial") if not hasattr(task, name)]:
        raise InputError(f"the task {task.__name__} lacks {', '.join(missing)}: define it in the class.")
    name = getattr(task, "name", "")
    if not (isinstance(name, str) and LABEL.fullmatch(name)):
        raise InputError(f"name of the task {task.__name__} is {described(name)}, but must be letters and digits.")
    known = _REGISTERED.get(name)
    if (known is not None and type(known) is not task) or (
        known is None and OURS.get(name, _path(task)) != _path(task)
    ):
        raise InputError(f"there is a task {name!r} already: give {task.__name__} another name.")
    if known is None:
        made = task()
        if name not in OURS:
            _check_defaults(made)
        _REGISTERED[name] = made
    return task


def _check_defaults(task: Task) -> None:
    """Raise `InputError` unless the task's design can be made without settings, as for a template of a design."""
    try:
        task.design()
    except InputError:
        raise
    except ValueError as error:
        first = ": ".join(line.partition("[")[0].strip() for line in str(error).splitlines()[1:3])
        raise InputError(
            f"the design of the task {task.name!r} cannot be made without settings ({first}): give each a valid "
            "default."
        ) from error


def _path(task: type[Task]) -> str:
    return f"{task.__module__}:{task.__qualname__}"


def _load(name: str, path: str) -> None:
    module, _, attribute = path.partition(":")
    try:
        register(getattr(importlib.import_module(module), attribute))
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"the task {name!r} cannot be loaded from {path} ({error!r}): repair its package.") from error


def load_file(path: str | os.PathLike[str]) -> Task:
    """Load a Python file and return the task that it registers.

    Raises
    ------
    InputError
        If it cannot be run, has the name of another module, or does not register exactly one task.
    """
    file = Path(path).resolve()
    if not file.is_file():
        raise InputError(f"{path} does not exist: give the Python file of a task.")
    if str(file.parent) not in sys.path:
        sys.path.insert(0, str(file.parent))  # worker processes inherit this path
    try:
        module = importlib.import_module(file.stem)
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        raise InputError(f"{path} cannot be run ({error!r}): correct it.") from error
    if Path(module.__file__ or "").resolve() != file:
        raise InputError(f"{path} has the name of another module, {module.__name__}: give it another name.")
    found = [task for task in _REGISTERED.values() if type(task).__module__ == file.stem]
    if len(found) != 1:
        raise InputError(
            f"{path} registers {len(found)} tasks, but must register one: write @register above its class."
        )
    listed = [one for one in os.environ.get(FILES, "").split(os.pathsep) if one]
    if str(file) not in listed:
        os.environ[FILES] = os.pathsep.join([*listed, str(file)])
    return found[0]


def _declared() -> dict[str, str]:
    """Return the paths of declared tasks that are not yet loaded, by name."""
    for file in filter(None, os.environ.get(FILES, "").split(os.pathsep)):
        load_file(file)
    declared = {point.name: point.value for point in entry_points(group=GROUP)}
    return {name: path for name, path in {**declared, **OURS}.items() if name not in _REGISTERED}


def task_names() -> tuple[str, ...]:
    """Return the labels of all tasks, built-in ones first.

    >>> task_names()[:4]
    ('depthrating', 'necker', 'pinhole', 'blurthreshold')
    """
    return tuple(dict.fromkeys([*OURS, *_REGISTERED, *sorted(_declared())]))


def is_task(name: Any) -> bool:
    """Return whether a task with that label exists."""
    if not isinstance(name, str):
        return False
    # _REGISTERED is checked twice, because _declared() loads files that register their tasks.
    return name in _REGISTERED or name in OURS or name in _declared() or name in _REGISTERED


def unknown_task(name: str, command: str = "report") -> str:
    """Return the remedy for recorded data of an unknown task, completing "a task".

    >>> unknown_task("mine")[:40]
    "'mine' that is unknown here: install its"
    """
    remedy = "install its package, or name its file as in 'focalgradient report data --task-file my_task.py'."
    return f"{name!r} that is unknown here: {remedy.replace('report', command)}"


def task_named(name: str) -> Task:
    """Return the task with a given label, command-line name, or Python file (``my_task.py``).

    Raises
    ------
    InputError
        If the name is unknown (the message lists all names), or a declared task cannot be loaded.

    Examples
    --------
    >>> task_named("blur-threshold").name
    'blurthreshold'
    """
    if isinstance(name, str) and name.endswith(".py"):
        return load_file(name)
    if isinstance(name, str) and name not in _REGISTERED:
        path = OURS.get(name) or _declared().get(name)
        if path is not None:
            _load(name, path)
    if isinstance(name, str) and name in _REGISTERED:
        return _REGISTERED[name]
    known = {task.called: task for task in map(task_named, task_names())}
    check_one_of("task", name, known)
    return known[name]
