"""Demonstration (template): depth with one eye through a pinhole, without it, and through a tube.

Unchanged, it is `focalgradient run pinhole`. What a trial shows, asks and records is described by its task
(`src/focalgradient/experiments/pinhole.py`): replace a method of `PinholeDemonstration` in a subclass, or add
steps to `trial`.
"""

import sys
from dataclasses import replace

from focalgradient.dataset import Rated
from focalgradient.design import PinholeTrial
from focalgradient.experiments.pinhole import PinholeDemonstration
from focalgradient.lab import Sitting, described_experiment, run, show_described

TASK = PinholeDemonstration()


def trial(sitting: Sitting, trial: PinholeTrial) -> Rated:
    """Let the participant look once, and ask for a rating."""
    answer: Rated = show_described(TASK, sitting, trial)
    return answer


if __name__ == "__main__":
    sys.exit(run(replace(described_experiment(TASK), about=__doc__, trial=trial)))
