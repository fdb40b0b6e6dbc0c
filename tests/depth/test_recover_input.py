"""What recover_depth refuses, in one clear sentence each, before any work is done."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from blurred import PIXEL, lens

from focalgradient import InputError, View, recover_depth
from focalgradient.depth.edges.measure import measure_edges
from focalgradient.depth.equalise.patch import vergence_likelihood
from focalgradient.depth.limits import comparison_bound, natural_power
from focalgradient.depth.ratio.disparity import focal_disparity
from focalgradient.depth.ratio.table import DisparityTable
from focalgradient.depth.search import Search
from focalgradient.depth.spectra import spectral_difference
from focalgradient.render import Rendered

RANDOM = np.random.default_rng(0)
IMAGE = RANDOM.uniform(0.5, 1.5, (64, 80))
SHARP, WIDE = View(IMAGE, lens(16), PIXEL), View(IMAGE[::-1].copy(), lens(5.6), PIXEL)


def with_image(view: View, image: np.ndarray) -> View:
    return replace(view, image=image)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"views": []}, "0 views given, but method .equalise. needs 2 or more: add a view"),
        ({"views": [SHARP, with_image(WIDE, IMAGE[:, :-2])]}, "view 1 is 80 x 64 pixels but view 2 is 78 x 64"),
        (
            {"views": [with_image(v, v.image[:31, :40]) for v in (SHARP, WIDE)]},
            "views are 40 x 31 pixels, but at least 32",
        ),
        ({"views": [SHARP, with_image(WIDE, 0 * IMAGE)]}, "view 2 is black, but depth needs a lit scene"),
        ({"views": [SHARP, with_image(WIDE, 0 * IMAGE + 0.5)]}, "view 2 is constant, so that it shows no texture"),
        ({"views": [with_image(SHARP, np.minimum(IMAGE, 0.9)), WIDE]}, "view 1 is saturated over more than half"),
        ({"views": [SHARP, with_image(WIDE, IMAGE), SHARP][::2]}, "all views are blurred alike"),
        (
            {"views": [replace(SHARP, optics=lens(math.inf, f)) for f in (0.8, 1.2)]},
            "all views are blurred alike .*pinholes",
        ),
        ({"views": SHARP}, r"views is one View, but must be a list of View: give \[first, second\]"),
        ({"views": "views.toml"}, "views is a str, but must be a list of View"),
        (
            {"views": [IMAGE, IMAGE]},
            r"view 1 is a ndarray, but must be a View: give View\(image, optics, pixel_angle\)",
        ),
        (
            {"views": [SHARP, Rendered(WIDE, IMAGE)]},
            "view 2 is a Rendered, but must be a View: give its attribute view",
        ),
        ({"near": math.inf}, "near is infinite, but must be a finite distance"),
        ({"near": 2.0, "far": 1.0}, "near 2 m lies beyond far 1 m, .*exchange"),
        ({"window": 17.0}, "window is 17 pixels, but may be a quarter of the views' smaller side"),
        ({"noise": [0.1, 0.1, 0.1]}, r"noise is \[0\.1, 0\.1, 0\.1\].* each of the 2 views"),
    ],
)
def test_views_and_settings(change: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        recover_depth(**({"views": [SHARP, WIDE], "near": 0.85} | change))


@pytest.mark.filterwarnings("ignore:view 2 is displaced")  # views with nothing in common may seem to lie anywhere
@pytest.mark.filterwarnings("ignore:view 2 does not seem to show")
def test_views_that_do_not_overlap_in_brightness() -> None:
    """Saturation elsewhere in each view leaves hardly a pixel that both show."""
    one, other = IMAGE.copy(), WIDE.image.copy()
    one[:, :39] = other[:, 41:] = 2.0  # just less than half of each
    with pytest.raises(InputError, match=r"hardly a pixel is usable \(unsaturated, not masked\) in every view"):
        recover_depth([with_image(SHARP, one), with_image(WIDE, other)], near=0.85)


PIXELS, STORED = np.ones((64, 128), np.float32), np.ones((64, 128), np.uint8)
BOUND = {"vergence": 0.8, "pixel_angle": PIXEL, "power": natural_power(0.2, 32), "area": 400.0}


@pytest.mark.parametrize(
    ("refused", "said"),
    [
        (lambda: recover_depth([SHARP, replace(WIDE, optics=lens(5.6, 1.2))], method="ratio"), "at one focus"),
        (lambda: recover_depth([SHARP, WIDE, SHARP], method="ratio"), "takes 2 at most"),
        (lambda: comparison_bound([WIDE.optics], noise=0.01, **BOUND), "1 optics given, but views are compared from"),
        (lambda: measure_edges(PIXELS, fit="splines"), "splines"),
        (lambda: vergence_likelihood([SHARP, WIDE], [1.0], noise=0.1), "vergences must be a list of two"),
        (lambda: vergence_likelihood([with_image(SHARP, IMAGE[:32, :32])], [0, 1], noise=0.1), "give 40 x 40"),
        (lambda: vergence_likelihood([replace(SHARP, mask=IMAGE > 1)], [0, 1], noise=0.1), "a view has masked pixels"),
        (lambda: focal_disparity(PIXELS.astype(float), PIXELS), "float64"),
        (lambda: focal_disparity(PIXELS, PIXELS[:-4]), "must be alike"),
        (lambda: focal_disparity(STORED, STORED, levels=np.zeros(256)), "256 stored values"),
        (lambda: DisparityTable.of([lens(8), lens(8)], PIXEL), "both apertures are equal"),
        (lambda: DisparityTable.of([lens(8), lens(4)], PIXEL, bands=[3]), "bands is"),
        (lambda: Search.over([lens(16), lens(5.6)], PIXEL, None, 0.1), "larger than 16 pixels, .*: give both"),
        (lambda: Search.over([lens(16), lens(5.6)], PIXEL, 0.01, 0.011), "larger than 64 pixels, .*: focus nearer"),
        (lambda: spectral_difference(np.ones((40, 40)), np.ones((40, 41))), r"shapes \(40, 40\) and \(40, 41\)"),
    ],
)
def test_parts_of_the_methods(refused, said):
    with pytest.raises(InputError, match=said):
        refused()
