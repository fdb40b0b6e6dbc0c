"""Simulated observers, which respond to trials; their responses have the same form as a person's.

They process the displayed pictures, and receive no more information about a trial than a person does. In the adaptive
experiment they may instead have a known threshold, to be recovered.
"""

from focalgradient.observers.answers import EncodedPictures, rate, watch
from focalgradient.observers.compare import ObserverComparison, compare_observers, exceedance_probabilities
from focalgradient.observers.depth_order import DEPTH_ORDER_OBSERVERS, depth_order_observer
from focalgradient.observers.distances import DistanceOfFixated, Magnitude, RelativeLayout
from focalgradient.observers.encoding import EncodedStimulus, encode
from focalgradient.observers.experiment import simulate
from focalgradient.observers.intervals import SeenLevels, encoded_levels
from focalgradient.observers.likelihood import (
    AnswerModel,
    Answers,
    Choices,
    Durations,
    ObserverFit,
    PersonModel,
    Ratings,
    fit_observer,
    simulated_choices,
    simulated_ratings,
)
from focalgradient.observers.looking import Look, blur_threshold, look
from focalgradient.observers.observer import OBSERVERS, Observer, observer_named
from focalgradient.observers.perception import Percept, perceive, perceived_depth, relief
from focalgradient.observers.pictures import (
    cache_folder,
    check_pictures,
    encoded_stimuli,
    natural_set,
    seen_pictures,
    small_set,
)
from focalgradient.observers.questions import BlurDiscrimination, Choice, DepthOrder, FigureGround, Question
from focalgradient.observers.ratings import DepthExtent, DepthRating
from focalgradient.observers.rotation import EncodedCubes, encode_cube, encoded_cubes
from focalgradient.observers.slants import PerceivedSlant, Slant
from focalgradient.observers.thresholds import choose, known_threshold, right_share

__all__ = [
    "DEPTH_ORDER_OBSERVERS",
    "OBSERVERS",
    "AnswerModel",
    "Answers",
    "BlurDiscrimination",
    "Choice",
    "Choices",
    "DepthExtent",
    "DepthOrder",
    "DepthRating",
    "DistanceOfFixated",
    "Durations",
    "EncodedCubes",
    "EncodedPictures",
    "EncodedStimulus",
    "FigureGround",
    "Look",
    "Magnitude",
    "Observer",
    "ObserverComparison",
    "ObserverFit",
    "PerceivedSlant",
    "Percept",
    "PersonModel",
    "Question",
    "Ratings",
    "RelativeLayout",
    "SeenLevels",
    "Slant",
    "blur_threshold",
    "cache_folder",
    "check_pictures",
    "choose",
    "compare_observers",
    "depth_order_observer",
    "encode",
    "encode_cube",
    "encoded_cubes",
    "encoded_levels",
    "encoded_stimuli",
    "exceedance_probabilities",
    "fit_observer",
    "known_threshold",
    "look",
    "natural_set",
    "observer_named",
    "perceive",
    "perceived_depth",
    "rate",
    "relief",
    "right_share",
    "seen_pictures",
    "simulate",
    "simulated_choices",
    "simulated_ratings",
    "small_set",
    "watch",
]
