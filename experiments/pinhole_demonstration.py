"""The demonstration, to copy and change: depth with one eye through a pinhole, without it, and through a tube.

Each block begins with a page and the standard. In the real world the participant is guided; in pictures, the pinhole
and the tube show the same round field. As it stands it is `focalgradient run pinhole`.
"""

import sys
from dataclasses import replace

from focalgradient.dataset import Rated
from focalgradient.design import PinholeTrial
from focalgradient.lab import EXPERIMENTS, Sitting, run
from focalgradient.lab.pinhole import ask_depth, begin_block, look, show_picture


def trial(sitting: Sitting, trial: PinholeTrial) -> Rated:
    """Let the participant look once, and ask."""
    begin_block(sitting, trial)
    if trial.form == "real":
        onset, picture = look(sitting, trial.viewing), None
    else:
        onset, picture = show_picture(sitting, trial.viewing, trial.scene)
    depth = ask_depth(sitting)
    return Rated(onset=onset, rating=depth.value, response_time=depth.seconds, stimulus=picture)


if __name__ == "__main__":
    sys.exit(run(replace(EXPERIMENTS["pinhole"], about=__doc__, trial=trial)))
