"""Depth and its rating by looking: on a flat layout, of pictures of a scene, and the same as in an experiment."""

from dataclasses import replace

import numpy as np
import pytest

from focalgradient.display import Display
from focalgradient.observers import OBSERVERS, DepthExtent, DepthRating, RelativeLayout, relief
from focalgradient.render.rendered import LUMINANCE
from focalgradient.stimuli import texture_border

DEFAULT = OBSERVERS["default"]
DISPLAY = Display()


def halves(left, right):
    size = {"width_deg": 8, "height_deg": 8, "pixels_per_degree": DISPLAY.pixels_per_degree}
    return texture_border(left_blur_arcmin=left, right_blur_arcmin=right, border="straight", **size).picture


@pytest.mark.slow
def test_ratings_by_looking_are_those_of_the_experiment(stimuli, encoded):
    """Fig. 3 by `look`: up with the near in focus, level with the far, and otherwise without the mechanism."""
    scene = stimuli.scenes[1]

    def looked(name, end, aperture):
        x, y = position = stimuli.scene(scene).target(end).position_px
        metres = stimuli.depth(scene)
        how = DepthExtent(RelativeLayout(metres, expected_m=float(metres[int(y), int(x)])), position)
        wide, sharp = (
            stimuli.display.decode(stimuli.pixels(stimuli.picture(scene, f, end))) @ np.array(LUMINANCE)
            for f in (aperture, "pinhole")
        )
        return OBSERVERS[name].look(wide, stimuli.display, DepthRating(sharp, how)).median

    near, far = (looked("default", end, "f/5.6") for end in ("nearest", "farthest"))
    assert near > 1.2
    assert far == pytest.approx(1, abs=0.05)
    assert looked("blur-blind", "nearest", "f/5.6") == pytest.approx(1, abs=0.02)
    assert looked("opposite", "nearest", "f/5.6") < 1.05
    depths = [
        np.median([relief(encoded[scene, f, "nearest"][1], DEFAULT, np.random.default_rng(n)) for n in range(40)])
        for f in ("f/5.6", "pinhole")
    ]
    assert near == pytest.approx(depths[0] / depths[1], rel=0.05)


@pytest.mark.slow
def test_ratings_have_the_observers_scale_and_scatter():
    sharp, blurred = halves(1, 1), halves(1, 4)
    plain = DEFAULT.look(blurred, DISPLAY, DepthRating(sharp))
    steep = replace(DEFAULT, scale=2.0, scatter=0.3).look(blurred, DISPLAY, DepthRating(sharp))
    assert steep.median == pytest.approx(plain.median**2, rel=1e-6)
    assert steep.log_sd**2 - 0.3**2 == pytest.approx(4 * (plain.log_sd**2 - DEFAULT.scatter**2), rel=1e-6)
    assert DEFAULT.look(sharp, DISPLAY, DepthRating(sharp)).median == pytest.approx(1)
    assert OBSERVERS["guessing"].look(blurred, DISPLAY, DepthRating(sharp)).median == 1
