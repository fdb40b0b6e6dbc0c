"""Stimuli: pictures as arrays with depth and blur, and sets of pictures and movies in folders, with control measures.

A drawing function returns a `Stimulus` (picture, true depth and true blur); ``make_...`` writes a set for one display.
"""

from focalgradient.stimuli.blurred_scene import blurred_scene
from focalgradient.stimuli.borders import blurred_edge, texture_border
from focalgradient.stimuli.cube_loops import GRADIENTS, make_necker, read_necker
from focalgradient.stimuli.depth_rating import APERTURES, make_depth_rating
from focalgradient.stimuli.drawn_files import read_stimuli, read_stimulus
from focalgradient.stimuli.drawn_set import make_from_stimuli
from focalgradient.stimuli.films import frames
from focalgradient.stimuli.fixated_cube import fixated_cube
from focalgradient.stimuli.imported import import_pictures
from focalgradient.stimuli.leaves import dead_leaves
from focalgradient.stimuli.manifest import Fixation, Picture, Target
from focalgradient.stimuli.papers import PAPERS, Paper, replica
from focalgradient.stimuli.photograph import make_from_photographs
from focalgradient.stimuli.sets import FIXATIONS, ShownScene, StimulusSet, read_set
from focalgradient.stimuli.sharpness import sharpness
from focalgradient.stimuli.stimulus import Stimulus, depth_of_blur
from focalgradient.stimuli.surfaces import corrugated_plane, miniature, slanted_plane
from focalgradient.stimuli.trial_list import TrialList, trial_list
from focalgradient.stimuli.viewing import Seen, Viewing, viewed_files, with_frames
from focalgradient.stimuli.wide_field import wide_field

__all__ = [
    "APERTURES",
    "FIXATIONS",
    "GRADIENTS",
    "PAPERS",
    "Fixation",
    "Paper",
    "Picture",
    "Seen",
    "ShownScene",
    "Stimulus",
    "StimulusSet",
    "Target",
    "TrialList",
    "Viewing",
    "blurred_edge",
    "blurred_scene",
    "corrugated_plane",
    "dead_leaves",
    "depth_of_blur",
    "fixated_cube",
    "frames",
    "import_pictures",
    "make_depth_rating",
    "make_from_photographs",
    "make_from_stimuli",
    "make_necker",
    "miniature",
    "read_necker",
    "read_set",
    "read_stimuli",
    "read_stimulus",
    "replica",
    "sharpness",
    "slanted_plane",
    "texture_border",
    "trial_list",
    "viewed_files",
    "wide_field",
    "with_frames",
]
