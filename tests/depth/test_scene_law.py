"""The law of scenes, against photographs of other people."""

from itertools import pairwise

import numpy as np
from skimage import data

from focalgradient.depth.filters import SCENE_SLOPE

SCENES = ("camera", "astronaut", "coffee", "chelsea", "stereo_motorcycle", "rocket", "brick", "gravel", "grass")
EDGES = np.geomspace(0.02, 0.3, 12)  # cycles per pixel


def slope(name: str) -> float:
    """Return the exponent with which the power of a photograph falls, from rings under a Hann window."""
    picture = getattr(data, name)()
    picture = np.asarray(picture[0] if isinstance(picture, tuple) else picture, float)
    grey = ((picture if picture.ndim == 2 else picture.mean(axis=2)) / 255) ** 2.2
    side = min(grey.shape)
    grey = grey[:side, :side] - grey[:side, :side].mean()
    power = np.abs(np.fft.fft2(grey * np.outer(np.hanning(side), np.hanning(side)))) ** 2
    radius = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.fftfreq(side))
    rings = [power[(low <= radius) & (radius < high)].mean() for low, high in pairwise(EDGES)]
    return -float(np.polyfit(np.log(np.sqrt(EDGES[1:] * EDGES[:-1])), np.log(rings), 1)[0])


def test_power_falls_no_faster_than_in_photographs_which_lenses_soften() -> None:
    slopes = sorted(map(slope, SCENES))
    assert slopes[0] < SCENE_SLOPE < np.median(slopes) < SCENE_SLOPE + 0.6
