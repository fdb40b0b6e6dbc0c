"""What recover_depth refuses, in one clear sentence each, before any work is done."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from blurred import PIXEL, lens

from focalgradient import InputError, View, recover_depth
from focalgradient.render import Rendered

RANDOM = np.random.default_rng(0)
IMAGE = RANDOM.uniform(0.5, 1.5, (64, 80))
SHARP, WIDE = View(IMAGE, lens(16), PIXEL), View(IMAGE[::-1].copy(), lens(5.6), PIXEL)


def with_image(view: View, image: np.ndarray) -> View:
    return replace(view, image=image)


@pytest.mark.parametrize(
    ("views", "said"),
    [
        ([], "0 views given, but method .equalise. needs 2 or more: add a view"),
        ([SHARP], "1 view given"),
        ([SHARP, with_image(WIDE, IMAGE[:, :-2])], "view 1 is 80 x 64 pixels but view 2 is 78 x 64"),
        ([SHARP, WIDE, with_image(WIDE, IMAGE[:-1])], "view 1 is 80 x 64 pixels but view 3 is 80 x 63"),
        ([with_image(v, v.image[:31, :40]) for v in (SHARP, WIDE)], "views are 40 x 31 pixels, but at least 32"),
        ([SHARP, with_image(WIDE, 0 * IMAGE)], "view 2 is black, but depth needs a lit scene"),
        ([with_image(SHARP, IMAGE - 2), WIDE], "view 1 is black"),
        ([SHARP, with_image(WIDE, 0 * IMAGE + 0.5)], "view 2 is constant, so that it shows no texture"),
        ([with_image(SHARP, np.minimum(IMAGE, 0.9)), WIDE], "view 1 is saturated over more than half"),
        ([SHARP, with_image(WIDE, IMAGE), SHARP][::2], "all views are blurred alike"),
        ([replace(SHARP, optics=lens(math.inf, f)) for f in (0.8, 1.2)], "all views are blurred alike .*pinholes"),
    ],
)
def test_views(views: list[View], said: str) -> None:
    with pytest.raises(InputError, match=said):
        recover_depth(views, near=0.85)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"near": math.inf}, "near is infinite, but must be a finite distance"),
        ({"near": 2.0, "far": 1.0}, "near 2 m lies beyond far 1 m, .*exchange"),
        ({"psf": "pillbox"}, "psf is 'pillbox', but must be one of auto, optics, disc, gaussian"),
        ({"window": 65.0}, r"window is 65\.0"),
        ({"window": 17.0}, "window is 17 pixels, but may be a quarter of the views' smaller side"),
        ({"noise": [0.1, 0.1, 0.1]}, r"noise is \[0\.1, 0\.1, 0\.1\].* each of the 2 views"),
        ({"noise": [0.1, math.nan]}, r"noise is \[0\.1, nan\]"),
        ({"false_alarm": 0.0}, r"false_alarm is 0\.0, but must be a probability between 0 and 1"),
        ({"method": ["ratio"]}, r"method is \['ratio'\], but must be one of"),
    ],
)
def test_settings(settings: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        recover_depth([SHARP, WIDE], **({"near": 0.85} | settings))


@pytest.mark.filterwarnings("ignore:view 2 is displaced")  # views with nothing in common may seem to lie anywhere
@pytest.mark.filterwarnings("ignore:view 2 does not seem to show")
def test_views_that_do_not_overlap_in_brightness() -> None:
    """Saturation elsewhere in each view leaves hardly a pixel that both show."""
    one, other = IMAGE.copy(), WIDE.image.copy()
    one[:, :39] = other[:, 41:] = 2.0  # just less than half of each
    with pytest.raises(InputError, match=r"hardly a pixel is usable \(unsaturated, not masked\) in every view"):
        recover_depth([with_image(SHARP, one), with_image(WIDE, other)], near=0.85)


@pytest.mark.parametrize(
    ("views", "said"),
    [
        (SHARP, r"views is one View, but must be a list of View: give \[first, second\]"),
        ("views.toml", "views is a str, but must be a list of View"),
        ([IMAGE, IMAGE], r"view 1 is a ndarray, but must be a View: give View\(image, optics, pixel_angle\)"),
        ([SHARP, Rendered(WIDE, IMAGE)], "view 2 is a Rendered, but must be a View: give its attribute view"),
    ],
)
def test_what_is_no_list_of_views(views: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        recover_depth(views)
