"""Lenses against geometry: rays, similar triangles and hand-worked numbers, never the vergence formula they use."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from focalgradient import FocalGradientWarning, InputError, Lens, View, recover_depth
from focalgradient.optics import DualPixel, capabilities, check_optics
from focalgradient.optics.protocol import Mixture

FOCAL = st.floats(0.004, 0.2)
NUMBER = st.floats(0.95, 45)
FOCUS = st.floats(0.25, 50)
DISTANCE = st.floats(0.25, 1000)


def image_distance(distance: float, focal_length: float) -> float:
    """Where a thin lens images a point, Newton's way: (u - F) (v - F) = F^2."""
    return focal_length + focal_length**2 / (distance - focal_length)


def test_sign_conventions() -> None:
    """Distance grows in front of the lens, vergence falls with it, and defocus is positive beyond focus."""
    lens = Lens(focal_length=0.05, f_number=2, focus_distance=1.0)
    nearer, beyond = 0.8, 1.25
    assert lens.focus_vergence == 1.0
    assert lens.defocus(beyond) == pytest.approx(+0.2)
    assert lens.defocus(nearer) == pytest.approx(-0.25)
    assert (lens.blur_radius([nearer, beyond]) > 0).all()  # a radius has no sign
    assert lens.distance_from_blur(1e-3, "nearer") < 1.0 < lens.distance_from_blur(1e-3, "beyond")
    assert lens.sensor_distance > lens.focal_length  # focus comes closer as the sensor moves away


@given(focal_length=FOCAL, focus=FOCUS)
def test_sensor_stands_where_the_plane_of_focus_is_imaged(focal_length: float, focus: float) -> None:
    assume(focus > focal_length)
    sensor = Lens(focal_length, 4, focus).sensor_distance
    assert sensor == pytest.approx(image_distance(focus, focal_length))
    assert 1 / focus + 1 / sensor == pytest.approx(1 / focal_length)  # Eq. 12


@given(focal_length=FOCAL, f_number=NUMBER, focus=FOCUS, distance=DISTANCE)
def test_blur_by_similar_triangles(focal_length: float, f_number: float, focus: float, distance: float) -> None:
    """The cone of light from the aperture's rim to the image point is cut by the sensor in a disc."""
    assume(min(focus, distance) > 1.01 * focal_length)
    lens = Lens(focal_length, f_number, focus)
    image = image_distance(distance, focal_length)
    on_sensor = focal_length / f_number / 2 * abs(lens.sensor_distance - image) / image
    assert lens.blur_radius(distance) * lens.sensor_distance == pytest.approx(on_sensor, rel=1e-6, abs=1e-12)


def test_infinity() -> None:
    """Focus at infinity puts the sensor at F, and only infinity is sharp; focus at H blurs H/2 and infinity alike."""
    far = Lens(focal_length=0.025, f_number=4, focus_distance=math.inf)
    assert far.sensor_distance == far.focal_length
    assert far.focus_vergence == 0
    assert far.blur_radius(math.inf) == 0
    assert (far.defocus([0.5, 10.0]) < 0).all()  # everything lies nearer than focus
    hyperfocal = Lens(focal_length=0.025, f_number=4, focus_distance=6.0)
    assert hyperfocal.blur_radius(3.0) == pytest.approx(float(hyperfocal.blur_radius(math.inf)))
    assert hyperfocal.distance_from_blur(hyperfocal.blur_radius(math.inf), "beyond") == math.inf
    assert math.isnan(hyperfocal.distance_from_blur(1.01 * hyperfocal.blur_radius(math.inf), "beyond"))
    assert math.isnan(hyperfocal.distance_from_blur(math.inf, "beyond"))
    assert hyperfocal.distance_from_blur(math.inf, "nearer") == 0  # the limit at the lens, where blur has no bound


def test_pinhole() -> None:
    pinhole = Lens(focal_length=0.025, f_number=math.inf, focus_distance=1.0)
    assert pinhole.aperture_diameter == 0
    assert not pinhole.blur_radius([0.1, 1.0, math.inf]).any()
    with pytest.raises(InputError, match="a pinhole has no blur"):
        pinhole.distance_from_blur(0.001, "beyond")


@given(focal_length=FOCAL, f_number=NUMBER, focus=FOCUS, distance=DISTANCE)
def test_distance_comes_back_on_its_own_side(
    focal_length: float, f_number: float, focus: float, distance: float
) -> None:
    assume(focus > 1.01 * focal_length)
    assume(abs(1 / focus - 1 / distance) > 1e-4)
    lens = Lens(focal_length, f_number, focus)
    side, other = ("beyond", "nearer") if distance > focus else ("nearer", "beyond")
    blur = lens.blur_radius(distance)
    assert lens.distance_from_blur(blur, side) == pytest.approx(distance, rel=1e-6)
    mirror = lens.distance_from_blur(blur, other)
    if np.isfinite(mirror):  # the other point that blurs alike lies across the plane of focus
        assert (mirror - focus) * (distance - focus) < 0
        assert lens.blur_radius(mirror) == pytest.approx(float(blur), rel=1e-6)


def test_error_of_distance_of_fig_2() -> None:
    """2 % of blur, focus at 2 m: the paper's dD = 0.02 D |D/2 - 1|, so 0.8 m at 10 m, 2 cm at 1 m, none at focus."""
    lens = Lens(focal_length=0.05, f_number=2, focus_distance=2.0)
    distance = np.array([0.5, 1.0, 2.0, 4.0, 10.0])
    blur, step = lens.blur_radius(distance), 1e-5
    side = ["nearer", "nearer", "beyond", "beyond", "beyond"]
    moved = [float(lens.distance_from_blur(b * (1 + step), s)) for b, s in zip(blur, side, strict=True)]
    error = 0.02 / step * np.abs(np.array(moved) - distance)
    assert error == pytest.approx([0.0075, 0.01, 0.0, 0.08, 0.8], rel=1e-3, abs=1e-9)


LENS = Lens(0.025, 4, 1.0)


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: Lens(0.0, 4, 1.0), r"focal_length is 0\.0, but .*metres"),
        (lambda: Lens(0.025, 4, 0.025), r"focus_distance 0\.025 m lies within the focal length 0\.025 m"),
        (lambda: Lens(50, 2, 1000), "focal_length is 50 m, longer than any camera's: give it in metres, 0.05 for 50"),
        (lambda: Lens(0.05, 2, 1.0, math.nan), r"residual_blur_variance is nan, .* finite number: give it in rad\^2"),
        (lambda: LENS.defocus([1.0, math.nan]), "distance contains values that are not positive"),
        (lambda: LENS.blur_radius(0.0), "distance contains values that are not positive"),
        (lambda: LENS.distance_from_blur([1e-3, math.nan], "beyond"), "radius contains negative or NaN values"),
        (lambda: LENS.distance_from_blur(1e-3, "far"), "side is 'far', but must be 'beyond' or 'nearer'"),
        (lambda: LENS.refocused(math.nan), r"must be 0 D \(infinity\) or more"),
    ],
)
def test_the_impossible_is_refused(ask, said: str) -> None:
    with pytest.raises(InputError, match=said):
        ask()


def test_infinity_and_no_farther_is_reached_by_blur_and_by_focus() -> None:
    """Whatever the lens: rounding leaves no distance of millions of metres, nor one beyond infinity."""
    for f_number in (1.4, 2.8, 5.6, 7.3, 11.0):
        for focus in np.geomspace(0.3, 30, 97):
            lens = Lens(0.05, f_number, float(focus))
            assert lens.distance_from_blur(lens.blur_radius(np.inf), "beyond") == np.inf, (f_number, focus)
    lens = Lens(0.05, 2, 1.0)
    assert lens.refocused(0.0).focus_distance == math.inf
    assert lens.refocused(0.5).aperture_diameter == lens.aperture_diameter


class Round:
    """A Gaussian's blur, alike on both sides."""

    aperture_diameter, focus_vergence = 0.006, 1.0

    def transfer(self, frequency, vergence):
        return np.exp(-2 * (np.pi * 0.0015 * (np.asarray(vergence) - 1) * np.asarray(frequency)) ** 2)

    def optical_transfer(self, frequency_y, frequency_x, vergence):
        return Round.transfer(self, np.hypot(frequency_y, frequency_x), vergence)


class OneTransfer:
    """The same blur, stated for all directions at once."""

    aperture_diameter, focus_vergence, isotropic = 0.006, 1.0, True
    transfer = Round.transfer


def oval(turn: float):
    """Return a transfer twice as wide along one direction as across it."""

    def optical_transfer(self, frequency_y, frequency_x, vergence):
        along = np.cos(turn) * frequency_x + np.sin(turn) * frequency_y
        across = np.cos(turn) * frequency_y - np.sin(turn) * frequency_x
        return Round().transfer(np.hypot(along, 2 * across), vergence)

    return optical_transfer


def made(**changed) -> Round:
    return type("Own", (Round,), changed)()


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"tells_side": "yes"}, "tells_side of Own is 'yes', but must be True or False"),
        ({"light": 550}, "light of Own is 550, but must be the waveband's name"),
        ({"residual_blur_variance": math.nan}, "residual_blur_variance of Own is nan"),
        ({"aperture_diameter": -0.001}, "must be finite and the aperture 0 or more"),
        ({"focus_vergence": math.nan}, "must be finite and the aperture 0 or more"),
        ({"isotropic": False, "tells_side": True}, "Own states tells_side = True, but its blur .* same on both sides"),
        ({"isotropic": True, "transfer": None, "optical_transfer": oval(np.pi / 4)}, "Own is declared isotropic, but"),
        (
            {"isotropic": True, "transfer": lambda self, f, v: Round().transfer(2 * np.asarray(f), v)},
            "`transfer` of Own differs from its `optical_transfer` by",
        ),
        (
            {
                "isotropic": False,
                "optical_transfer": lambda self, y, x, v: np.exp(1e-3j * np.hypot(y, x)) * Round().transfer(x, v),
            },
            "at -f is not the conjugate of that at f",
        ),
        (
            {
                "isotropic": False,
                "through_focus": lambda self, y, x, vs: np.stack([Round().optical_transfer(2 * y, x, v) for v in vs]),
            },
            "`.*` of Own differs from its `.*` by",
        ),
    ],
)
def test_optics_that_are_not_what_they_state_are_refused_by_name(changed, said) -> None:
    with pytest.raises(InputError, match=said):
        check_optics(made(**changed), vergences=[0.6, 1.5], frequency=800.0)


def test_the_sides_of_focus_are_compared_at_the_vergences_that_are_asked() -> None:
    """Here they differ within 1 D of focus alone."""

    def one_sided(self, y, x, vergence):
        return Round().optical_transfer(np.multiply(y, 1 + (0 < vergence - 1 < 1)), x, vergence)

    own = made(isotropic=False, tells_side=True, optical_transfer=one_sided)
    check_optics(own, vergences=[0.6, 1.5], frequency=800.0)
    with pytest.raises(InputError, match="same on both sides"):
        check_optics(own, vergences=[3.0], frequency=800.0)


@pytest.mark.parametrize(
    "optics", [DualPixel(Lens(0.05, 4, 1.0), 0.3), OneTransfer()], ids=["dual pixel", "transfer only"]
)
def test_blur_at_several_vergences_is_that_at_each(optics) -> None:
    y, x = np.meshgrid(np.linspace(-300, 300, 3), np.linspace(-200, 400, 4), indexing="ij")
    blur, levels = capabilities(optics).blur, [0.5, 1.0, 1.7]
    together = blur.through_focus(y, x, levels)
    assert together.shape == (3, *y.shape)
    for one, level in zip(together, levels, strict=True):
        np.testing.assert_allclose(one, blur.optical_transfer(y, x, level), atol=1e-12)


def test_a_transfer_for_all_directions_is_a_mean_where_blur_differs_between_them() -> None:
    own = made(isotropic=False, optical_transfer=lambda self, y, x, v: Round().optical_transfer(2 * y, x, v))
    check_optics(own, vergences=[0.6, 1.5], frequency=800.0)
    with pytest.raises(InputError, match="the blur of Own is not isotropic"):
        capabilities(own).blur.transfer([100.0], [1.2])


def test_shares_of_a_mixture_sum_to_one_at_each_pixel() -> None:
    lenses = (Lens(0.05, 2, 1.0), Lens(0.05, 2, 1.5))
    assert Mixture(lenses, np.full((2, 4, 5), 0.5), np.zeros((4, 5))).gain == 1.0
    for count, share, shape, said in (
        (2, 0.6, (4, 5), "shares do not sum to 1"),
        (3, 1 / 3, (4, 5), "C x H x W for the 2 optics"),
        (2, 0.5, (5, 4), r"focus_sd \(5, 4\)"),
    ):
        with pytest.raises(InputError, match=said):
            Mixture(lenses, np.full((count, 4, 5), share), np.zeros(shape))


def test_what_optics_state_is_read_once() -> None:
    check_optics(made(isotropic=True), vergences=[0.6, 1.5], frequency=800.0)
    stated = capabilities(made(isotropic=True, light="green", tells_side=False, residual_blur_variance=1e-8))
    assert stated.forms_views
    assert (stated.isotropic, stated.waveband, stated.uniform, stated.field_sd) == (True, "green", True, 0)
    lens = capabilities(Lens(0.05, 2, 1.0, residual_blur_variance=1e-8))
    assert (lens.blur, lens.forms_views, lens.residual_blur_variance) == (None, False, 1e-8)
    ideal = capabilities(Lens(0.05, 2, 1.0))
    assert ideal.residual_blur_variance == ideal.focus_tolerance == ideal.aperture_tolerance == 0
    with pytest.raises(InputError, match="only one of vergences and frequency"):
        check_optics(Lens(0.05, 2, 1.0), frequency=10.0)
    bare = type("Bare", (), {"aperture_diameter": 0.01, "focus_vergence": 1.0, "tells_side": True})
    with pytest.raises(InputError, match="Bare states tells_side = True, but implements no blur model"):
        capabilities(bare())


def test_depth_is_refused_through_optics_whose_blur_varies_over_the_field() -> None:
    views = [View(np.eye(64) + 1, made(isotropic=True, uniform=False, focus_vergence=f), 3e-4) for f in (0.8, 1.2)]
    with pytest.raises(InputError, match="the blur of Own varies over the field"):
        recover_depth(views)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ((4.2, 1.8, 1000.0), r"focal_length is 4\.2 m: if millimetres are meant, give 0\.0042"),
        ((0.05, 0.025, 1.0), r"f_number is 0\.025, below the 0\.5 .* if it is the aperture's diameter"),
    ],
)
def test_what_is_more_likely_a_slip_is_warned_of(values: tuple[float, float, float], said: str) -> None:
    with pytest.warns(FocalGradientWarning, match=said) as caught:
        Lens(*values)
    assert caught[0].filename == __file__
