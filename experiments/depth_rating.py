"""Experiment 1, to copy and change: how three-dimensional a picture looks, by its aperture and by what is fixated.

Each trial shows a mark on the object to be fixated, then the picture, then asks how three-dimensional it looked as a
ratio to the standard, a pinhole picture that counts as 1. As it stands it is `focalgradient run depth-rating`.
"""

import sys
from dataclasses import replace

from focalgradient.dataset import Rated
from focalgradient.design import DepthTrial
from focalgradient.lab import EXPERIMENTS, Sitting, run
from focalgradient.lab.depth_rating import ask_confidence, ask_depth, gaze_fields, show_picture, show_standard


def trial(sitting: Sitting, trial: DepthTrial) -> Rated:
    """Show one picture and ask. `sitting.screen` has what is needed to show something else (`text`, `play`, `wait`)."""
    if trial.standard_before:
        show_standard(sitting)
    onset, file = show_picture(sitting, trial)
    depth = ask_depth(sitting, trial)
    confidence = ask_confidence(sitting)
    return Rated(
        onset=onset,
        rating=depth.value,
        response_time=depth.seconds,
        confidence=confidence,
        stimulus=file,
        start=depth.start,
        **gaze_fields(sitting),
    )


if __name__ == "__main__":
    sys.exit(run(replace(EXPERIMENTS["depth-rating"], about=__doc__, trial=trial)))
