"""The registry of tasks: ours, registered ones, and those that installed packages declare."""

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

from focalgradient.errors import InputError, described
from focalgradient.tasks.base import Task

__all__ = ["FILES", "GROUP", "OURS", "is_task", "load_file", "register", "task_named", "task_names", "unknown_task"]

GROUP = "focalgradient.tasks"
"""Group of entry points by which an installed package declares tasks: name of the task = "module:Class"."""

OURS: Mapping[str, str] = {
    "depthrating": "focalgradient.tasks.depth_rating:DepthRating",
    "necker": "focalgradient.tasks.necker:NeckerRotation",
    "pinhole": "focalgradient.tasks.pinhole:PinholeDemonstration",
    "blurthreshold": "focalgradient.tasks.blur_threshold:BlurThreshold",
    "published": "focalgradient.published.task:PublishedTask",
}
"""The tasks of this package, as an installed package declares its own."""

FILES = "FOCALGRADIENT_TASKS"
"""Environment variable with Python files that register tasks, apart as in PATH; a file that `task_named` is given is
added to it, so that workers know it too."""

LABEL = re.compile(r"[A-Za-z0-9]+")

_REGISTERED: dict[str, Task] = {}

Class = TypeVar("Class", bound=type[Task])


def register(task: Class) -> Class:
    """Register a task for this process; as a decorator, too.

    Raises
    ------
    InputError
        If it is no complete class of a task, its name is no label, or another has it.

    Examples
    --------
    >>> type(task_named("depth-rating")).__name__
    'DepthRating'
    """
    if not (inspect.isclass(task) and issubclass(task, Task)):
        raise InputError(f"a task must be a class derived from Task, got {described(task)}.")
    if inspect.isabstract(task):
        missing = ", ".join(sorted(task.__abstractmethods__))
        raise InputError(f"the task {task.__name__} lacks {missing}: define it in the class.")
    name = getattr(task, "name", "")
    if not (isinstance(name, str) and LABEL.fullmatch(name)):
        raise InputError(f"name of the task {task.__name__} is {described(name)}, but must be letters and digits.")
    known = _REGISTERED.get(name)
    if (known is not None and type(known) is not task) or (
        known is None and OURS.get(name, _path(task)) != _path(task)
    ):
        raise InputError(f"there is a task {name!r} already: give {task.__name__} another name.")
    if known is None:
        _REGISTERED[name] = task()
    return task


def _path(task: type[Task]) -> str:
    return f"{task.__module__}:{task.__qualname__}"


def _load(name: str, path: str) -> None:
    module, _, attribute = path.partition(":")
    try:
        register(getattr(importlib.import_module(module), attribute))
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"the task {name!r} cannot be loaded from {path} ({error!r}): mend its package.") from error


def load_file(path: str | os.PathLike[str]) -> Task:
    """Return the task that a Python file registers.

    Raises
    ------
    InputError
        If it cannot be run, has the name of another module, or registers no task or several.
    """
    file = Path(path).resolve()
    if not file.is_file():
        raise InputError(f"{path} is not there: give the Python file of a task.")
    if str(file.parent) not in sys.path:
        sys.path.insert(0, str(file.parent))  # so that workers, which have the same path, can import it
    try:
        module = importlib.import_module(file.stem)
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{path} cannot be run ({error!r}): mend it.") from error
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
    """Paths of all tasks that are declared and not loaded yet, by name."""
    for file in filter(None, os.environ.get(FILES, "").split(os.pathsep)):
        load_file(file)
    declared = {point.name: point.value for point in entry_points(group=GROUP)}
    return {name: path for name, path in {**declared, **OURS}.items() if name not in _REGISTERED}


def task_names() -> tuple[str, ...]:
    """Return the labels of all tasks, ours first.

    >>> task_names()[:4]
    ('depthrating', 'necker', 'pinhole', 'blurthreshold')
    """
    return tuple(dict.fromkeys([*OURS, *_REGISTERED, *sorted(_declared())]))


def is_task(name: Any) -> bool:
    """Return whether there is a task of that label."""
    if not isinstance(name, str):
        return False
    # Registered is asked twice: what is declared loads the files that are named, and these register their tasks.
    return name in _REGISTERED or name in OURS or name in _declared() or name in _REGISTERED


def unknown_task(name: str) -> str:
    """Say what to do about a task of recorded data that is not known here, after "a task".

    >>> unknown_task("mine")
    "'mine' that is not known here: install its package, or name its file as in 'focalgradient report data --task-file \
my_task.py'."
    """
    return (
        f"{name!r} that is not known here: install its package, or name its file as in 'focalgradient report data "
        "--task-file my_task.py'."
    )


def task_named(name: str) -> Task:
    """Return the task of a label, of a name on the command line, or of a Python file (``my_task.py``).

    Raises
    ------
    InputError
        If there is none: those that exist are listed. Or if what a package declares cannot be loaded.

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
    for label in task_names() if isinstance(name, str) else ():
        if (found := task_named(label)).called == name:
            return found
    raise InputError(f"task is {described(name)}, but must be one of {', '.join(map(repr, task_names()))}.")
