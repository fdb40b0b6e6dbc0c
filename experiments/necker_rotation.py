"""Experiment 2, to copy and change: whether the turning Necker cube looks rigid, or wobbles.

One key is held while it looks rigid, another while it wobbles; every press and release is kept with its time. As it
stands it is `focalgradient run necker`.
"""

import sys
from dataclasses import replace

from focalgradient.dataset import Watched
from focalgradient.design import NeckerTrial
from focalgradient.lab import EXPERIMENTS, Sitting, run
from focalgradient.lab.necker import feedback, ready, show_cube


def trial(sitting: Sitting, trial: NeckerTrial) -> Watched:
    """Show one cube, and keep what is pressed; in practice, say how well the keys were held."""
    watched = show_cube(sitting, trial, before=lambda: ready(sitting, trial))
    if trial.phase == "practice":
        feedback(sitting, trial, watched)
    return watched


if __name__ == "__main__":
    sys.exit(run(replace(EXPERIMENTS["necker"], about=__doc__, trial=trial)))
