"""Experiment 2 (template): whether a rotating Necker cube looks rigid or wobbles.

Unchanged, it is `focalgradient run necker`. What a trial shows, asks and records is described by its task
(`src/focalgradient/experiments/necker.py`): replace a method of `NeckerRotation` in a subclass, or add
steps to `trial`.
"""

import sys
from dataclasses import replace

from focalgradient.dataset import Watched
from focalgradient.design import NeckerTrial
from focalgradient.experiments.necker import NeckerRotation
from focalgradient.lab import Sitting, described_experiment, run, show_described

TASK = NeckerRotation()


def trial(sitting: Sitting, trial: NeckerTrial) -> Watched:
    """Show one cube, and record the keys held."""
    answer: Watched = show_described(TASK, sitting, trial)
    return answer


if __name__ == "__main__":
    sys.exit(run(replace(described_experiment(TASK), about=__doc__, trial=trial)))
