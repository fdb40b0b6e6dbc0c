"""Tasks: one class each, which the laboratory, the browser, the files, the simulation and the report ask.

A task of one's own is one class derived from `Task` in one file, found by `register` or by an entry point of the group
"focalgradient.tasks". Ours are registered in the same way.
"""

from focalgradient.tasks.adjustment import Adjustment, Refocused
from focalgradient.tasks.base import Response, Rows, Task
from focalgradient.tasks.columns import Column
from focalgradient.tasks.noted import Noted
from focalgradient.tasks.registry import is_task, register, task_named, task_names, unknown_task

__all__ = [
    "Adjustment",
    "Column",
    "Noted",
    "Refocused",
    "Response",
    "Rows",
    "Task",
    "is_task",
    "register",
    "task_named",
    "task_names",
    "unknown_task",
]
