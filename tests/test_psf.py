"""Blur transfers against integrals and Fourier transforms of the blurs themselves."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import quad

from focalgradient import InputError
from focalgradient.psf import (
    DISC_K,
    Annulus,
    Blend,
    Disc,
    Gaussian,
    Polygon,
    Psf,
    check_psf,
    disc_transfer,
    gaussian_transfer,
    names,
    parameter,
    pixel_transfer,
    psf_from,
    psf_of,
    shape_class,
    transfer,
)


def disc_by_quadrature(frequency: float, radius: float) -> float:
    """Fourier integral of the disc seen edge-on, whose chords are 2 sqrt(radius^2 - x^2) long: no Bessel function."""
    return quad(  # x = radius sin(t), for the ends to be smooth
        lambda t: 2 / np.pi * np.cos(t) ** 2 * np.cos(2 * np.pi * frequency * radius * np.sin(t)),
        *(-np.pi / 2, np.pi / 2),
        limit=200,
    )[0]


@pytest.mark.parametrize("radius", [0.3, 1.0, 7.5])
def test_disc_is_the_integral_over_its_chords(radius: float) -> None:
    frequency = np.concatenate([[0, 1e-7, 1e-5, 3e-5], np.linspace(0.001, 0.7, 40)])  # across the small-x series
    expected = [disc_by_quadrature(f, radius) for f in frequency]
    assert disc_transfer(frequency, radius) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("shape", [Disc(), Gaussian(), Blend(), Annulus(0.4)])
def test_the_edge_response_ends_within_its_reach(shape: Psf) -> None:
    assert shape.edge_response(np.array([shape.edge_reach, 2 * shape.edge_reach]), 1.0) == pytest.approx(1, abs=1e-6)


def test_the_reach_of_an_edge_is_computed_where_a_shape_states_none() -> None:
    """A Gaussian of sd .5 per radius is at 1 - 1e-6 after 4.7534 sd (tables of the normal distribution)."""
    reach = Psf.edge_reach.fget(Gaussian(k=0.5))  # type: ignore[attr-defined]
    assert 2.3767 <= reach <= 2.3767 + 0.008
    assert Psf.edge_reach.fget(Disc()) == pytest.approx(1, abs=0.004)  # type: ignore[attr-defined]
    wide = Psf.edge_reach.fget(Gaussian(k=2.0))  # type: ignore[attr-defined]
    assert 9.5068 <= wide <= 1.012 * 9.5068


@pytest.mark.parametrize("k", [1e-4, 3e-3])
def test_the_responses_of_a_nearly_sharp_blend_are_integrals_over_its_disc(k: float) -> None:
    """A Gaussian's average of the chords' lengths, and of the area beside them, over six standard deviations."""
    rest, shape = math.sqrt(1 - 4 * k**2), Blend(k)
    for place in (0.0, 0.4137, -0.9):
        nodes, weights = np.polynomial.legendre.leggauss(120)
        u = (place + 6 * k * nodes) / rest
        weights = 6 * weights * np.exp(-((6 * nodes) ** 2) / 2) / math.sqrt(2 * math.pi)
        chord = np.sqrt(1 - u**2)
        assert shape.line_response(place, 1.0) == pytest.approx(weights @ (2 * chord / np.pi / rest), abs=2e-5)
        assert shape.edge_response(place, 1.0) == pytest.approx(
            weights @ (0.5 + (u * chord + np.arcsin(u)) / np.pi), abs=2e-5
        )


def test_gaussian_is_the_fourier_transform_of_a_gaussian() -> None:
    sigma, side = 12.0, 512
    place = np.arange(side) - side // 2
    drawn = np.exp(-(place**2) / (2 * sigma**2))
    spectrum = np.fft.fft(np.fft.ifftshift(drawn / drawn.sum())).real
    frequency = np.abs(np.fft.fftfreq(side))
    assert gaussian_transfer(frequency, 30.0, k=sigma / 30) == pytest.approx(spectrum, abs=1e-9)


def test_k_is_the_second_moment_of_the_disc() -> None:
    """Per axis, by counting points of a disc; so that small blurs of both models act alike."""
    place = np.linspace(-1, 1, 1001)
    x, y = np.meshgrid(place, place)
    assert np.sqrt(np.mean(x[np.hypot(x, y) <= 1] ** 2)) == pytest.approx(DISC_K, rel=2e-3)
    low = np.linspace(0, 0.05, 6)  # cycles per radius
    assert gaussian_transfer(low, 1.0, DISC_K) == pytest.approx(disc_transfer(low, 1.0), abs=2e-4)


def test_gaussian_k_scales_the_radius() -> None:
    assert transfer(0.1, 4.0, "gaussian", k=1.0) == pytest.approx(float(transfer(0.1, 8.0, "gaussian", k=0.5)))
    assert transfer(0.1, 4.0, "disc", k=1.0) == transfer(0.1, 4.0, "disc", k=0.5)  # a disc has none


def test_pixel_averages_over_its_square() -> None:
    """Waves averaged over a unit square by a fine grid of points."""
    place = (np.arange(400) + 0.5) / 400 - 0.5
    for down, right in [(0.0, 0.0), (0.0, 0.5), (0.3, -0.2), (0.5, 0.5), (0.0, 1.0)]:
        wave = np.cos(2 * np.pi * (down * place[:, None] + right * place))
        assert pixel_transfer(down, right) == pytest.approx(wave.mean(), abs=1e-5)


SOME = [
    *(Gaussian(1.0), Gaussian(0.05), Blend(0.1), Blend(0.49), Blend(0.7), Annulus(0.0), Annulus(0.9)),
    *(Polygon(blades, rotation) for blades, rotation in ((3, 0.2), (4, 0.0), (7, -2.0), (64, 0.0))),
]


@pytest.mark.parametrize("name", names())
def test_every_registered_shape_passes_the_check(name: str) -> None:
    check_psf(name)
    shape = shape_class(name)
    assert shape.name == name
    assert len(shape.description) > 10


@pytest.mark.parametrize("shape", SOME, ids=str)
def test_shapes_pass_the_check_with_other_parameters_and_are_read_back(shape: Psf) -> None:
    check_psf(shape)
    back = psf_from({"shape": shape.name, **shape.stated()})
    assert back.stated() == shape.stated()
    assert type(back) is type(shape)


class Plain(Psf):
    """A Gaussian of sd 1, without an edge response."""

    def transfer(self, frequency, radius):
        return gaussian_transfer(frequency, radius, 1.0)


def plain(frequency, radius):
    return np.asarray(gaussian_transfer(frequency, radius, 1.0))


def table_is_missing(self, frequency, radius):
    raise KeyError("table")


@pytest.mark.parametrize(
    ("base", "changed", "said"),
    [
        (Plain, {"transfer": lambda self, f, r: 0.9 * plain(f, r)}, r"transfer is 0\.9 at frequency 0, but must be 1"),
        (Plain, {"transfer": lambda self, f, r: plain(f, np.asarray(r) ** 1.2)}, "derivative by the radius differs"),
        (Plain, {"transfer": lambda self, f, r: plain(f, np.asarray(r) + 0.2)}, "at radius 0 the transfer differs"),
        (Plain, {"transfer": lambda self, f, r: 0.5 + 0.5 * plain(f, r)}, r"at a radius of 1000 .* per unit is 0\.5"),
        (
            Psf,
            {"isotropic": True, "optical_transfer": lambda self, y, x, r: plain(np.hypot(y, 2 * np.asarray(x)), r)},
            "states isotropic = True, but its transfer differs",
        ),
        (
            Polygon,
            {"symmetric": True, "optical_transfer": lambda self, y, x, r: Polygon(5).optical_transfer(y, x, r)},
            "states symmetric = True, but its transfer has an imaginary part",
        ),
        (
            Plain,
            {
                "isotropic": False,
                "optical_transfer": lambda self, y, x, r: plain(np.hypot(y, x), r) * np.exp(0.3j * np.abs(x)),
            },
            "not the conjugate of that at f",
        ),
        (Disc, {"ends_sharply": False}, "states ends_sharply = False, but its transfer falls to -0"),
        (Disc, {"sd_per_radius": 0.6}, r"sd_per_radius is 0\.6, but by the transfer's curvature at 0 0\.5"),
        (
            Disc,
            {"edge_response": lambda self, at, r: Disc().edge_response(np.asarray(at) * 0.9, r)},
            "edge response differs from the integral of the point spread function",
        ),
        (
            Disc,
            {"line_response": lambda self, at, r: Disc().line_response(at, 1.0)},
            r"at radius 2\.5 the line response differs from the slope of the edge response",
        ),
        (Disc, {"radius_of": lambda self, sd: 1.01 * Disc().radius_of(sd)}, r"a radius of 3 becomes 3\.03"),
        (Disc, {"variance": lambda self, r: 1.01 * Disc().variance(r)}, "sd, variance and radius_of contradict"),
        (Disc, {"sd_per_radius": math.nan}, "sd_per_radius is nan, but must be positive and finite"),
        (
            Plain,
            {"transfer": lambda self, f, r: plain(f, r) * (1 + 40 * (np.asarray(f) * r) ** 2)},
            r"the transfer reaches 1\.\d+, but a non-negative point spread function has at most 1",
        ),
        (Plain, {"transfer": lambda self, f, r: np.ones(3)}, r"gives float64 of shape \(3,\), but numbers of shape"),
        (Plain, {"transfer": table_is_missing}, "raises KeyError"),
    ],
    ids=lambda value: "" if isinstance(value, dict) else str(value)[:30],
)
def test_the_check_names_what_is_wrong(base, changed, said) -> None:
    with pytest.raises(InputError, match=said):
        check_psf(type("Wrong", (base,), changed)())


@pytest.mark.parametrize(("blades", "rotation"), [(3, 0.2), (5, 0.3), (6, 0.1)])
def test_polygon_is_the_fourier_transform_of_a_drawn_polygon(blades: int, rotation: float) -> None:
    """Drawn as the half planes of its sides, finely, the first corner at `rotation` from right towards down."""
    side, fine = 512, 60
    y, x = np.mgrid[:side, :side] - side // 2
    reach = fine * np.sqrt(2 * np.pi / blades / np.sin(2 * np.pi / blades)) * np.cos(np.pi / blades)
    drawn = np.ones((side, side))
    for number in range(blades):
        normal = rotation + np.pi / blades + 2 * np.pi * number / blades
        drawn *= x * np.cos(normal) + y * np.sin(normal) <= reach
    assert drawn.sum() == pytest.approx(np.pi * fine**2, rel=5e-3)  # of the disc's area
    frequency = np.fft.fftfreq(side)
    off = np.fft.fft2(np.fft.ifftshift(drawn / drawn.sum()))
    off -= Polygon(blades, rotation).optical_transfer(frequency[:, None], frequency, fine)
    assert np.abs(off[np.hypot(frequency[:, None], frequency) < 2.5 / fine]).max() < 4e-3


def test_the_obstruction_is_taken_out_of_the_disc() -> None:
    place = np.linspace(-1, 1, 801)
    x, y = np.meshgrid(place, place)
    away = np.hypot(x, y)
    inside = (away <= 1) & (away >= 0.5)
    assert Annulus(0.5).sd_per_radius == pytest.approx(np.sqrt(np.mean(x[inside] ** 2)), rel=3e-3)
    assert Annulus(0.5).transfer(0.4, 1.0) == pytest.approx(np.mean(np.cos(2 * np.pi * 0.4 * x[inside])), abs=3e-3)


@dataclass(frozen=True)
class Softened(Psf):
    """A shape whose parameter lies between two bounds, neither of them included."""

    softness: float = parameter(0.5, "share of the radius", least=0.0, most=1.0, exclusive=True)
    transfer = Disc.transfer


@pytest.mark.parametrize(
    ("stated", "shape"),
    [
        ({"shape": "gaussian"}, Gaussian(0.4)),
        ({"shape": "gaussian", "k": 0.3}, Gaussian(0.3)),
        ({"shape": "polygon", "blades": 5}, Polygon(5)),
    ],
)
def test_a_camera_s_k_goes_to_shapes_of_a_file_that_have_one(stated: dict, shape: Psf) -> None:
    assert psf_from(stated, k=0.4) == shape
    assert psf_from({"shape": "gaussian"}) == Gaussian(0.5)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: psf_of("pillbox"), "psf is 'pillbox', but must be one of disc, gaussian, blend, annulus, polygon"),
        (lambda: psf_of(Disc), r"psf is the class Disc, but must be a shape of it: give Disc\(\)"),
        (lambda: psf_of(Disc(), 0.5), "k is given with psf a disc, which has its own parameters"),
        (lambda: psf_of("gaussian", -1), "k is -1, but must be a positive number, sigma / disc radius"),
        (lambda: Polygon(2), "blades is 2, but must be a whole number from 3 to 64"),
        (lambda: Annulus(1.0), r"obstruction is 1\.0, but must be a number from 0 to 0\.95"),
        (lambda: Polygon.of({"rotation_deg": 999}), "rotation_deg is 999, but must be a number from -360 to 360 deg"),
        (lambda: psf_from({"shape": "polygon", "edges": 5}), "has no parameter 'edges': it has blades, rotation_deg"),
        (lambda: psf_from({"blades": 5}), "psf has no shape"),
        (lambda: Softened(1.0), "softness is 1\\.0, but must be a number between 0 and 1"),
    ],
)
def test_what_is_no_shape_is_refused_by_name(make, said: str) -> None:
    with pytest.raises(InputError, match=said):
        make()
