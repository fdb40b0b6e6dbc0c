"""Threshold of blur (template): the smallest increase in blur that is noticed, or that makes a picture look deeper.

Unchanged, it is `focalgradient run blur-threshold`. What a trial shows, asks and records is described by its task
(`src/focalgradient/experiments/blur_threshold.py`): replace a method of `BlurThreshold` in a subclass, or add
steps to `trial`.
"""

import sys
from dataclasses import replace

from focalgradient.dataset import Chosen
from focalgradient.design import BlurTrial
from focalgradient.experiments.blur_threshold import BlurThreshold
from focalgradient.lab import Sitting, described_experiment, run, show_described

TASK = BlurThreshold()


def trial(sitting: Sitting, trial: BlurTrial) -> Chosen:
    """Show a scene in two intervals, and ask for the more blurred, or the deeper, one."""
    answer: Chosen = show_described(TASK, sitting, trial)
    return answer


if __name__ == "__main__":
    sys.exit(run(replace(described_experiment(TASK), about=__doc__, trial=trial)))
