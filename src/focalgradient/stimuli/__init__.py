"""Sets of pictures and moving pictures that people judge, made for one display, with all that was controlled."""

from focalgradient.stimuli.cube_loops import GRADIENTS, make_necker, read_necker
from focalgradient.stimuli.depth_rating import APERTURES, FIXATIONS, make_depth_rating
from focalgradient.stimuli.imported import import_pictures
from focalgradient.stimuli.photograph import make_from_photographs
from focalgradient.stimuli.sets import Fixation, Picture, ShownScene, StimulusSet, Target, read_set

__all__ = [
    "APERTURES",
    "FIXATIONS",
    "GRADIENTS",
    "Fixation",
    "Picture",
    "ShownScene",
    "StimulusSet",
    "Target",
    "import_pictures",
    "make_depth_rating",
    "make_from_photographs",
    "make_necker",
    "read_necker",
    "read_set",
]
