"""Experiment 1 (template): rated depth of a picture by aperture and fixated object.

Unchanged, it is `focalgradient run depth-rating`. What a trial shows, asks and records is described by its task
(`src/focalgradient/experiments/depth_rating.py`): replace a method of `DepthRating` in a subclass, or add
steps to `trial`.
"""

import sys
from dataclasses import replace

from focalgradient.dataset import Rated
from focalgradient.design import DepthTrial
from focalgradient.experiments.depth_rating import DepthRating
from focalgradient.lab import Sitting, described_experiment, run, show_described

TASK = DepthRating()


def trial(sitting: Sitting, trial: DepthTrial) -> Rated:
    """Show one picture, and ask how three-dimensional it looked."""
    answer: Rated = show_described(TASK, sitting, trial)
    return answer


if __name__ == "__main__":
    sys.exit(run(replace(described_experiment(TASK), about=__doc__, trial=trial)))
