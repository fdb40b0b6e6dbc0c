"""Tasks: one class each, used by the laboratory, the browser, the files, the simulation and the report.

A custom task is one class derived from `Task` in one file, registered by `register` or by an entry point of the group
"focalgradient.tasks". Built-in tasks are registered in the same way.
"""

from focalgradient.files.columns import Column
from focalgradient.tasks.adjustment import Adjustment, Refocused
from focalgradient.tasks.base import Response, Task
from focalgradient.tasks.check import check_task
from focalgradient.tasks.noted import Noted
from focalgradient.tasks.registry import is_task, register, task_named, task_names, unknown_task
from focalgradient.tasks.steps import Look, Step

__all__ = [
    "Adjustment",
    "Column",
    "Look",
    "Noted",
    "Refocused",
    "Response",
    "Step",
    "Task",
    "check_task",
    "is_task",
    "register",
    "task_named",
    "task_names",
    "unknown_task",
]
