"""Measured wavefronts: order and signs against another library, other pupils against a fit, populations, draws."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from focalgradient import InputError
from focalgradient.eye import (
    Eye,
    ZernikePopulation,
    chromatic_difference,
    draw_people,
    osa_index,
    osa_order,
    point_spread,
    read_zernike,
    resized_zernike,
    zernike,
)
from focalgradient.eye.measured import zernike_terms

PRYSM = json.loads(Path(__file__).with_name("prysm_zernike.json").read_text(encoding="utf-8"))
EYES = Path(__file__).parents[2].parent / "shared" / "data" / "eyes"


def test_order_and_signs_are_those_of_another_library():
    x, y = np.array(PRYSM["places"]).T
    for term in PRYSM["terms"]:
        assert osa_order(term["index"]) == (term["n"], term["m"])
        assert osa_index(term["n"], term["m"]) == term["index"]
        assert zernike(term["n"], term["m"], x, y) == pytest.approx(np.array(term["values"]), abs=1e-8)


@given(st.lists(st.floats(-1, 1), min_size=1, max_size=36), st.floats(0.2, 1.0))
def test_a_smaller_pupil_has_the_same_wavefront(coefficients, share):
    rng = np.random.default_rng(1)
    place = np.sqrt(rng.uniform(size=40)) * np.exp(2j * np.pi * rng.uniform(size=40))

    def height(terms, at):
        return sum((c * zernike(n, m, at.real, at.imag) for n, m, c in terms), np.zeros(at.shape))

    terms = zernike_terms(coefficients)
    assert height(resized_zernike(terms, share), place) == pytest.approx(height(terms, share * place), abs=1e-9)


@pytest.mark.parametrize("nm", [450.0, 580.0, 740.0])
def test_defocus_becomes_vergence_in_focus_in_the_light_of_the_measurement(nm):
    um = 1.5 * 6**2 / (16 * np.sqrt(3))  # 1.5 D of myopia over 6 mm
    eye = Eye.from_zernike([0.3, 0.1, 0.1, 0, um], 0.004, measured_diameter=0.006, measured_nm=nm, accommodation=0.5)
    assert eye.in_light(nm).focus_vergence == pytest.approx(2.0)
    assert eye.focus_vergence == pytest.approx(2.0 + float(chromatic_difference(nm)))
    assert eye.aberrations == ()


def test_the_eye_spreads_light_as_its_wavefront_does():
    """Defocus as a term and as accommodation are one; so a point looks the same through both."""
    angles = np.arange(-8, 9) * 1e-4
    whole = [0, 0, 0, 0.1, 0.2, -0.05, 0.03, 0.08, -0.02, 0.04, 0, 0, 0.06]
    light = {"wavelength_nm": 580.0}
    given_ = Eye(0.005, 0.0, **light, aberrations=tuple((*osa_order(j), c) for j, c in enumerate(whole) if c))
    half_turn = point_spread(angles, angles, given_, 0.0)[::-1, ::-1]  # from the examiner's axes to the image's
    assert point_spread(angles, angles, Eye.from_zernike(whole, 0.005, **light), 0.0) == pytest.approx(
        half_turn, rel=1e-9
    )


@pytest.mark.parametrize("index", [7, 8])
def test_a_measured_eye_s_coma_points_where_its_rays_go(index):
    """The wave that leaves the eye is W(x, y) above the pupil, x to the examiner's right: rays go by minus its slope.

    So light from straight ahead that enters at (x, y) looks as if it came from the slope there, to the examiner's right
    and up where that is positive: to the left and up for the eye, which in an image are negative angles.
    """
    coefficients = [0.0] * index + [0.2]
    place = np.linspace(-1, 1, 401)
    x, y = np.meshgrid(place, place)
    seen = np.hypot(x, y) < 0.995
    wave = sum(c * zernike(*osa_order(j), x, y) for j, c in enumerate(coefficients))
    up, examiners_right = (slope[seen].mean() for slope in np.gradient(wave, place, place))  # um a radius of 2 mm
    angles = np.arange(-90, 91) * 5e-5
    light = point_spread(angles, angles, Eye.from_zernike(coefficients, 0.004), 0.0)
    row, column = (light.sum(axis=axis) @ angles / light.sum() for axis in (1, 0))
    assert max(up, examiners_right) > 0.5
    assert (row, column) == pytest.approx((-up * 1e-6 / 2e-3, -examiners_right * 1e-6 / 2e-3), rel=0.05, abs=1e-6)


def test_tables_of_each_kind_are_read(tmp_path):
    texts = {
        "one.csv": "coefficient\n0\n0\n0\n0.1\n-0.25\n",
        "two.txt": "# of a left eye\nj um\n4 -0.25\n3 0.1\n",
        "three.csv": "n;m;um\n2;0;-0.25\n2;-2;0.1\n",
        "four.csv": "# wavefront over 6 mm at 550 nm\nn;m;um\n2;0;-0.25\n2;-2;0.1\n",
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
        assert read_zernike(tmp_path / name) == (0.0, 0.0, 0.0, 0.1, -0.25)
    (tmp_path / "most.csv").write_text("0.1\n" * 231)
    assert read_zernike(tmp_path / "most.csv") == (0.1,) * 231


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "must have on each line"),
        ("1\n2 3\n", "must have on each line"),
        ("0.1\nx\n", "line 2"),
        ("3 1 0.1\n3 1 0.2\n", "there twice"),
        ("2 1 0.1\n", "no Zernike term 2, 1"),
        ("3 nan\n", "line 1: .* is not one, two or three numbers"),
        ("0.1\n" * 232, "more than 231"),
        ("# Noll's order\n0.1\n", "in Noll's order"),
        ("j coefficient in waves\n3 0.1\n", "in waves"),
        ("4 350\n", "no eye has more than 100 micrometres"),
        ("3 1 -25\n", "no eye has more than 20 micrometres"),
    ],
)
def test_what_is_no_table_is_refused_in_a_sentence(text, said, tmp_path):
    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=said):
        read_zernike(tmp_path / "t.csv")


def test_draws_have_the_population_s_mean_and_covariance():
    mixing = np.random.default_rng(3).standard_normal((7, 7)) / 10
    population = ZernikePopulation(np.linspace(-0.1, 0.2, 7), mixing @ mixing.T, 0.006)
    random = np.random.default_rng(5)
    drawn = np.array([population.drawn(random) for _ in range(6000)])
    assert drawn.mean(axis=0) == pytest.approx(np.linspace(-0.1, 0.2, 7), abs=0.01)
    assert np.cov(drawn.T) == pytest.approx(mixing @ mixing.T, abs=0.005)


def test_people_of_a_population_are_the_same_people_otherwise():
    population = ZernikePopulation(np.zeros(15), 0.01 * np.eye(15), 0.006)
    plain, real = draw_people(20, 1), draw_people(20, 1, aberrations=population)
    for one, other in zip(plain, real, strict=True):
        if one.eye.pupil_diameter <= 0.006:
            assert other.eye.pupil_diameter == one.eye.pupil_diameter
        assert (other.eye.chromatic_scale, other.fluctuation) == (one.eye.chromatic_scale, one.fluctuation)
        assert other.eye.pupil_diameter <= 0.006
        assert other.eye.aberrations
    with pytest.raises(InputError, match="draw smaller pupils"):
        draw_people(1, 1, pupil_diameter=(0.007, 0.001), aberrations=population)


@pytest.mark.skipif(not EYES.is_dir(), reason="the published population is not here: its licence is for research use")
def test_a_published_population_scaled_to_a_smaller_pupil_is_near_that_measured_there():
    wide = ZernikePopulation.read(EYES / "mean_6mm.csv", EYES / "covariance_6mm.csv", 0.006)
    narrow = ZernikePopulation.read(EYES / "mean_3mm.csv", EYES / "covariance_3mm.csv", 0.003)
    random = np.random.default_rng(1)

    def rms(population, orders):
        """Of the orders' coefficients over 3 mm, root of the mean square over people."""
        squares = []
        for _ in range(500):
            share = 0.003 / population.measured_diameter
            terms = resized_zernike(zernike_terms(population.drawn(random)), share)
            squares.append(sum(c**2 for n, _, c in terms if n in orders))
        return float(np.sqrt(np.mean(squares)))

    for orders in ((2,), (3,)):
        assert rms(wide, orders) == pytest.approx(rms(narrow, orders), rel=0.35)


PEOPLE = draw_people(1000, seed=1)


def test_chromatic_spans_are_spread_as_measured() -> None:
    """1.54 +- 0.39 D between 450 and 650 nm: what the eyes themselves say."""
    spans = [p.eye.in_light(450).focus_vergence - p.eye.in_light(650).focus_vergence for p in PEOPLE[:500]]
    assert np.mean(spans) == pytest.approx(1.54, abs=0.06)
    assert np.std(spans) == pytest.approx(0.39, abs=0.04)
    (least,) = draw_people(1, 0, chromatic_span=(0.31, 0.0))  # about the least that is accepted
    assert least.eye.chromatic_scale == pytest.approx(0.31 / float(chromatic_difference(650, 450)))
    assert spans[0] == pytest.approx(PEOPLE[0].eye.chromatic_scale * float(chromatic_difference(650, 450)))


def test_pupils_and_microfluctuations() -> None:
    pupils = np.array([person.eye.pupil_diameter for person in PEOPLE])
    rms = np.array([person.fluctuation.rms for person in PEOPLE])
    beta = np.array([person.fluctuation.beta for person in PEOPLE])
    assert (pupils.mean(), pupils.std()) == pytest.approx((4e-3, 0.8e-3), rel=0.05)
    assert pupils.min() >= 1.5e-3
    assert 0.1 <= rms.min() < 0.11
    assert 0.48 < rms.max() <= 0.5
    assert 1.1 <= beta.min() < 1.12
    assert 1.48 < beta.max() <= 1.5
    assert np.abs(np.corrcoef([pupils, rms, beta, [p.eye.chromatic_scale for p in PEOPLE]]) - np.eye(4)).max() < 0.08


def test_draws_are_those_of_their_seeds() -> None:
    assert draw_people(5, seed=1) == PEOPLE[:5]
    assert draw_people(5, seed=2) != PEOPLE[:5]
    assert len({person.fluctuation.seed for person in PEOPLE[:200]}) == 200
    other = draw_people(20, seed=1, pupil_diameter=(0.006, 0.0), rms=(0.2, 0.2))
    for changed, person in zip(other, PEOPLE, strict=False):
        assert changed.eye.pupil_diameter == 0.006
        assert changed.fluctuation.rms == pytest.approx(0.2)
        assert changed.eye.chromatic_scale == person.eye.chromatic_scale
        assert changed.fluctuation.beta == person.fluctuation.beta
