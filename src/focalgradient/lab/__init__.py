"""Laboratory experiments in a PsychoPy window: stimulus display, responses and sessions.

An `Experiment` has the parts specific to one experiment; `run` takes a participant through it. `EXPERIMENTS` maps the
names that ``focalgradient run`` accepts to the experiments of all registered tasks. No other subpackage imports
PsychoPy (extra ``lab``), and it is imported only when a window is opened.
"""

from collections.abc import Iterator, Mapping

from focalgradient.lab import gaze_focus
from focalgradient.lab.adjusting import adjust
from focalgradient.lab.described import described_experiment, show_described
from focalgradient.lab.experiment import EVENTS, GREY, Again, Experiment, Quit, Sitting
from focalgradient.lab.forms import form, pages, respond
from focalgradient.lab.questions import Given, ask, ask_which
from focalgradient.lab.running import run
from focalgradient.scales import Scale, Steps
from focalgradient.tasks import task_named, task_names

__all__ = [
    "EVENTS",
    "EXPERIMENTS",
    "GREY",
    "Again",
    "Experiment",
    "Given",
    "Quit",
    "Scale",
    "Sitting",
    "Steps",
    "adjust",
    "ask",
    "ask_which",
    "described_experiment",
    "form",
    "gaze_focus",
    "pages",
    "respond",
    "run",
    "show_described",
]


class _Experiments(Mapping[str, Experiment]):
    """Mapping from names to the experiments of all registered tasks, each constructed on access."""

    def __getitem__(self, name: str) -> Experiment:
        return described_experiment(task_named(name))

    def __iter__(self) -> Iterator[str]:
        return (task_named(name).called for name in task_names())

    def __len__(self) -> int:
        return len(task_names())


EXPERIMENTS: Mapping[str, Experiment] = _Experiments()
"""Experiments by the names that ``focalgradient run`` accepts."""
