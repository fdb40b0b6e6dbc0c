"""Simulated observers: a trial in, a response out, the same records as a person's.

They look at the pictures themselves, as a display shows them, and know of a trial no more than a person does.
"""

from focalgradient.observers.answers import Seen, rate, watch
from focalgradient.observers.cube import Cubes, cubes, look_at_cube
from focalgradient.observers.experiment import check_pictures, simulate
from focalgradient.observers.look import Look, look_at
from focalgradient.observers.observer import OBSERVERS, Observer, observer_named
from focalgradient.observers.perception import perceived_depth, relief
from focalgradient.observers.pictures import cache_folder, looks, small_set

__all__ = [
    "OBSERVERS",
    "Cubes",
    "Look",
    "Observer",
    "Seen",
    "cache_folder",
    "check_pictures",
    "cubes",
    "look_at",
    "look_at_cube",
    "looks",
    "observer_named",
    "perceived_depth",
    "rate",
    "relief",
    "simulate",
    "small_set",
    "watch",
]
