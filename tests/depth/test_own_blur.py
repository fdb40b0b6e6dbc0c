"""Optics that offer a blur of their own, in every form: their blur is used, or refused by name, never a disc."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from judged import check
from shaped import PIXEL, filtered

from focalgradient import InputError, Lens, View, blur, recover_depth
from focalgradient.depth.limits import comparison_bound
from focalgradient.optics import own_blur
from focalgradient.psf import disc_transfer

TRUTH = 1.25
FORMS = ("transfer", "optical_transfer", "through_focus")


class Mirror:
    """A mirror lens: blur is a ring, whose hole is half as wide as its rim; `stretch` makes it oval."""

    aperture_diameter = 0.008

    def __init__(self, focus: float, stretch: float = 1.0) -> None:
        self.focus_vergence, self.stretch = 1 / focus, stretch

    def ring(self, radial, defocus):
        radius = self.aperture_diameter / 2 * np.abs(defocus)
        return (disc_transfer(radial, radius) - 0.25 * disc_transfer(radial, radius / 2)) / 0.75

    def oval(self, down, right, defocus):
        return self.ring(np.hypot(self.stretch * np.asarray(down), right), defocus)


def _transfer(self, frequency, vergence):
    return self.ring(np.asarray(frequency), self.focus_vergence - np.asarray(vergence))


def _optical_transfer(self, frequency_y, frequency_x, vergence):
    return self.oval(frequency_y, frequency_x, self.focus_vergence - vergence)


def _through_focus(self, frequency_y, frequency_x, vergences):
    down, right = np.broadcast_arrays(np.asarray(frequency_y), np.asarray(frequency_x))
    levels = np.asarray(vergences).reshape(-1, *(1,) * down.ndim)
    return self.oval(down, right, self.focus_vergence - levels)


METHODS = {"transfer": _transfer, "optical_transfer": _optical_transfer, "through_focus": _through_focus}
OFFERED = [some for count in (1, 2, 3) for some in itertools.combinations(FORMS, count)]
SINGLY = OFFERED[:3]


def kind(offered, isotropic) -> type[Mirror]:
    """A user's own class with these methods, that states `isotropic`, or does not where that is None."""
    stated = {} if isotropic is None else {"isotropic": isotropic}
    return type("MyMirror", (Mirror,), {name: METHODS[name] for name in offered} | stated)


def views(optics) -> list[View]:
    """A textured wall through `optics`."""
    return filtered(
        optics, lambda down, right, one: one.oval(down / PIXEL, right / PIXEL, one.focus_vergence - 1 / TRUTH)
    )


@pytest.mark.fast_cases(4)
@pytest.mark.parametrize("isotropic", [True, False, None])
@pytest.mark.parametrize("offered", SINGLY, ids="+".join)
def test_own_blur_in_any_form_gives_the_right_depth_or_is_refused(offered, isotropic) -> None:
    made = kind(offered, isotropic)
    if isotropic is False and offered == ("transfer",):
        with pytest.raises(InputError, match=r"MyMirror.*isotropic = False.*only `transfer`"):
            views([made(0.9), made(1.1)])
        return
    depth = recover_depth(views([made(0.9), made(1.1)]))
    assert depth.details["psf"] == "optics"
    check(depth, TRUTH, valid=0.5)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("offered", [("optical_transfer",), FORMS], ids="+".join)
def test_oval_blur_gives_the_right_depth(offered) -> None:
    made = kind(offered, False)
    check(recover_depth(views([made(0.9, 1.3), made(1.1, 1.3)]), psf="optics"), TRUTH, valid=0.5)


@pytest.mark.parametrize("method", ["spectra", "edges", "ratio"])
def test_methods_that_know_discs_refuse_other_blur_by_name(method) -> None:
    made = kind(("optical_transfer",), None)
    pair = views([made(0.9), made(0.9 if method == "ratio" else 1.1)])
    if method == "ratio":
        pair[0].optics.aperture_diameter = 0.002
    with pytest.raises(InputError, match=rf"MyMirror.*blur of their own, which method '{method}' cannot use"):
        recover_depth(pair, method=method)
    with pytest.raises(InputError, match=rf"'{method}' needs .*, which the optics' own blur does not give: use method"):
        recover_depth(pair, method=method, psf="optics")


def test_optics_without_a_blur_of_their_own_cannot_be_asked_for_it() -> None:
    made = kind((), True)
    pair = views([made(0.9), made(1.1)])
    assert own_blur(pair[0].optics) is None
    with pytest.raises(InputError, match="MyMirror"):
        recover_depth(pair, psf="optics")


def test_every_form_is_given_whichever_is_offered() -> None:
    frequency = np.linspace(0, 1500, 7)
    expected = kind(FORMS, True)(0.9)
    for offered in OFFERED:
        own = own_blur(kind(offered, True)(0.9))
        assert own.transfer(frequency, np.array([[0.5], [0.9]])) == pytest.approx(
            expected.transfer(frequency, np.array([[0.5], [0.9]]))
        )
        assert own.through_focus(frequency[:, None], frequency, [0.5, 0.9]) == pytest.approx(
            expected.through_focus(frequency[:, None], frequency, [0.5, 0.9])
        )


@pytest.mark.parametrize("offered", SINGLY, ids="+".join)
def test_pictures_are_blurred_by_own_blur(offered) -> None:
    point = np.full((64, 64), 0.01, np.float32)
    point[32, 32] = 10
    made = kind(offered, None)(0.9)
    spread = blur(point, np.full(point.shape, 1.8), made, pixel_angle=PIXEL).image
    assert spread[32, 32] < 0.5 * spread.max()  # a ring's middle is dark


def test_bounds_know_round_blur_and_refuse_other() -> None:
    asked = {"power": np.ones_like, "noise": 0.01, "area": 100.0}
    round_, disc = kind(("optical_transfer",), True), kind((), None)
    bounds = [comparison_bound([made(0.9), made(1.1)], 0.8, PIXEL, **asked) for made in (round_, disc)]
    assert abs(bounds[0] / bounds[1] - 1) > 0.02
    with pytest.raises(InputError, match="MyMirror is not isotropic"):
        comparison_bound([kind(("optical_transfer",), False)(f) for f in (0.9, 1.1)], 0.8, PIXEL, **asked)


def test_a_lens_is_a_disc_beside_own_blur() -> None:
    pair = views([kind(FORMS, True)(0.9), kind(FORMS, True)(1.1)])
    pinhole = Lens(0.025, np.inf, 1.0)
    sharp = views([kind(FORMS, True)(TRUTH)])[0]
    depth = recover_depth([View(sharp.image, pinhole, PIXEL), pair[1]], far=3.0, near=1.12)
    assert depth.details["psf"] == "optics"
