"""Depth through blur of any shape: polygons as well as discs, both sides of focus, and refusals by name."""

from __future__ import annotations

import numpy as np
import pytest
from judged import check, covered
from shaped import FOCI, FROM_ONE_FOCUS, walls

from focalgradient import InputError, recover_depth
from focalgradient.calibration import pair_blur
from focalgradient.depth.edges import measure_edges
from focalgradient.depth.limits import comparison_bound
from focalgradient.psf import Annulus, Blend, Disc, Polygon, Psf, gaussian_transfer


class MyPsf(Psf):
    """A Gaussian of a user's own."""

    ends_sharply = False

    def transfer(self, frequency, radius):
        return gaussian_transfer(frequency, radius, 0.45)


@pytest.mark.slow
@pytest.mark.parametrize(("blades", "rotation", "distance"), [(5, 0.2, 0.9), (6, 0.3, 1.25)])
def test_polygons_are_as_good_as_discs(blades: int, rotation: float, distance: float) -> None:
    """On either side of the mean focus, 0.5 % noise: the error is at most 1.3 times a disc's, and the sd covers it."""
    errors = []
    for shape in (Disc(), Polygon(blades, rotation)):
        depth = recover_depth(walls(shape, FOCI, distance, seed=7), psf=shape)
        errors.append(np.median(np.abs(depth.vergence - 1 / distance)[depth.valid]))
        assert depth.valid.mean() > 0.95
        assert 0.9 <= covered(depth, distance) <= 0.995
    assert errors[1] < 1.3 * errors[0]


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(("blades", "distance"), [(5, 0.65), (3, 1.2)])
def test_odd_blades_tell_the_side_from_two_apertures_of_one_focus(blades: int, distance: float) -> None:
    shape = Polygon(blades, 0.2)
    depth = recover_depth(walls(shape, FROM_ONE_FOCUS, distance, seed=2), psf=shape)
    check(depth, distance, rel=0.005)
    assert depth.side_known[depth.valid].all()
    assert depth.details["side"] == "estimated from the views"
    assert (depth.details["psf"], depth.details["psf_parameters"]["blades"]) == ("polygon", blades)


@pytest.mark.filterwarnings("ignore:the views share one plane of focus")
def test_even_blades_leave_the_side_open() -> None:
    depth = recover_depth(walls(Polygon(6), FROM_ONE_FOCUS, 1.2, seed=2), psf="polygon")
    assert np.median(depth.distance[depth.valid]) == pytest.approx(1.2, rel=0.005)
    assert not depth.side_known.any()


@pytest.mark.parametrize(
    ("shape", "method"), [(MyPsf(), "equalise"), (Annulus(0.35), "spectra"), (Blend(0.3), "ratio"), (MyPsf(), "ratio")]
)
def test_a_round_shape_works_with_every_method_that_compares_views(shape: Psf, method) -> None:
    depth = recover_depth(walls(shape, FROM_ONE_FOCUS, 1.2), psf=shape, method=method, near=0.85)
    assert np.median(depth.distance[depth.valid]) == pytest.approx(1.2, rel=0.01)
    assert depth.details["psf"] == shape.name


@pytest.mark.parametrize(
    ("shape", "method", "said"),
    [
        (MyPsf(), "edges", "method 'edges' needs the edge response, which MyPsf does not give: use method 'equalise'"),
        (Polygon(5), "ratio", "needs isotropic blur, which polygon does not give: use method"),
    ],
)
def test_what_a_method_cannot_use_is_refused_by_name(shape: Psf, method, said: str) -> None:
    with pytest.raises(InputError, match=said):
        recover_depth(walls(Disc(), FROM_ONE_FOCUS, 1.2), psf=shape, method=method, near=0.85)


@pytest.mark.parametrize("shape", [Blend(0.3), Annulus(0.4)], ids=lambda shape: shape.name)
def test_edges_are_measured_by_the_edge_response_of_any_round_shape(shape: Psf) -> None:
    """A step across a row, 0.3 % noise: the radius that it was blurred by, to 2 %; of another shape it is off."""
    random, radius = np.random.default_rng(0), 6.0
    fine = shape.edge_response((np.arange(96 * 8) + 0.5) / 8 - 48.3, radius).reshape(96, 8).mean(axis=1)  # over pixels
    image = 0.2 + 0.5 * fine + 0.003 * random.standard_normal((64, 96))
    edges = measure_edges(image, psf=shape, k=None)
    assert edges.valid.mean() > 0.9
    assert np.median(edges.radius[edges.valid]) == pytest.approx(radius, rel=0.02)


def test_bounds_and_pairs_know_shapes() -> None:
    asked = {"power": np.ones_like, "noise": 0.01, "area": 100.0}
    bounds = [comparison_bound(FROM_ONE_FOCUS, 0.8, 3.2e-4, psf=shape, **asked) for shape in (Disc(), Annulus(0.5))]
    assert abs(bounds[0] / bounds[1] - 1) > 0.01
    with pytest.raises(InputError, match=r"polygon .* is not isotropic"):
        comparison_bound(FROM_ONE_FOCUS, 0.8, 3.2e-4, psf="polygon", **asked)
    pair = walls(Annulus(0.4), FROM_ONE_FOCUS, 1.2)
    expected = float(FROM_ONE_FOCUS[1].blur_radius(1.2)) / 3.2e-4
    assert pair_blur(pair, [16, 4], Annulus(0.4)).radius == pytest.approx(expected, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("distance", [0.65, 1.2])
def test_a_sheet_gives_the_blur_of_a_pentagon_on_either_side_of_focus(distance: float) -> None:
    shape = Polygon(5, 0.2)
    expected = float(FROM_ONE_FOCUS[1].blur_radius(distance)) / 3.2e-4
    assert pair_blur(walls(shape, FROM_ONE_FOCUS, distance), [16, 4], shape).radius == pytest.approx(expected, rel=0.01)
