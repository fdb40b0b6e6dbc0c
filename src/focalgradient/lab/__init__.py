"""The experiments with people: windows, keys, questions, sessions. The only room that imports PsychoPy.

An `Experiment` says what is particular to one; `run` takes a participant through it. The three of the paper, and
the adaptive one of a threshold of blur, are `EXPERIMENTS`, by the names that ``focalgradient run`` knows. PsychoPy
(extra ``lab``) is imported when a window opens.
"""

from focalgradient.lab import blur_threshold, depth_rating, gaze_focus, necker, pinhole
from focalgradient.lab.experiment import EVENTS, GREY, Again, Experiment, Quit, Sitting
from focalgradient.lab.forms import form, pages
from focalgradient.lab.questions import Given, ask, ask_which
from focalgradient.lab.running import run
from focalgradient.scales import Scale, Steps

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
    "ask",
    "ask_which",
    "blur_threshold",
    "depth_rating",
    "form",
    "gaze_focus",
    "necker",
    "pages",
    "pinhole",
    "run",
]

EXPERIMENTS = {
    "depth-rating": depth_rating.DEPTH_RATING,
    "necker": necker.NECKER,
    "pinhole": pinhole.PINHOLE,
    "blur-threshold": blur_threshold.BLUR_THRESHOLD,
}
"""By the names that the command line knows."""
