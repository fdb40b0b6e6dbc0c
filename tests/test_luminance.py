"""A photometer's table: read, fitted, and what is wrong with it said in one sentence."""

import numpy as np
import pytest

from focalgradient.errors import InputError
from focalgradient.lab.devices import photometer
from focalgradient.luminance import fit_luminance, read_luminance

LEVELS = np.arange(0, 256, 15.0)


def test_the_standard_curve_is_found_from_noisy_measurements():
    chance = np.random.default_rng(4)
    true = {"red": (1.9, 21.0), "green": (2.2, 70.0), "blue": (2.5, 9.0), "grey": (2.2, 100.0)}
    measured = {
        gun: (0.3 + white * (LEVELS / 255) ** gamma) * (1 + 0.005 * chance.standard_normal(LEVELS.size))
        for gun, (gamma, white) in true.items()
    }
    found = fit_luminance(LEVELS, measured)
    for gun, (gamma, white) in true.items():
        assert found.curves[gun].gamma == pytest.approx(gamma, abs=0.05)
        assert found.curves[gun].white == pytest.approx(0.3 + white, rel=0.01)
    assert found.unequal == pytest.approx(0.6, abs=0.06)
    assert found.additivity == pytest.approx(0.0, abs=0.02)
    assert max(curve.deviation for curve in found.curves.values()) < 0.02


def test_the_light_of_black_counts_once_in_the_sum_of_the_guns():
    whites = {"red": 20.0, "green": 70.0, "blue": 10.0, "grey": 100.0}
    found = fit_luminance(LEVELS, {gun: 5 + white * (LEVELS / 255) ** 2.2 for gun, white in whites.items()})
    assert found.additivity == pytest.approx(0.0, abs=1e-6)


def test_the_curve_of_srgb_is_no_power_and_is_told_by_its_deviation():
    from focalgradient.display import Display

    found = fit_luminance(LEVELS, {"grey": 80 * Display().decode(LEVELS)})
    assert found.grey.gamma == pytest.approx(2.2, abs=0.1)
    assert 0.001 < found.grey.deviation < 0.02


@pytest.mark.parametrize(
    ("extra", "said"),
    [
        *(([one], "levels must span 0 to 255") for one in (-20.0, np.nan, 256.0)),
        ([], "19 luminances, but there are 18"),
    ],
)
def test_each_level_from_0_to_255_has_a_luminance(extra, said):
    with pytest.raises(InputError, match=said):
        fit_luminance(np.append(LEVELS, extra), {"grey": np.ones(LEVELS.size + 1)})


def test_a_linear_display_has_gamma_one_and_shares_are_read(tmp_path):
    rows = "\n".join(f"{share:.1f},{50 * share:.3f}" for share in np.linspace(0, 1, 11))
    (tmp_path / "a.csv").write_text("Level,Grey\n" + rows + "\n")
    found = read_luminance(tmp_path / "a.csv")
    assert found.grey.gamma == pytest.approx(1.0, abs=1e-3)
    assert found.additivity is None
    assert found.unequal == 0.0


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("grey\n1\n", "has no column level: give the columns level, red, green, blue and grey"),
        ("", "has no column level"),
        ("level,grey\n0,-1\n", "row 2: grey is '-1', but must be a number of 0 or more"),
        ("level,grey\n0,1\n300,2\n", "levels must span 0 to 255, or 0 to 1, with both ends included"),
        ("level,grey\n0,9\n50,5\n100,4\n200,3\n255,2\n", "grey is not brighter at the maximum level than at 0"),
    ],
)
def test_wrong_tables_are_refused_in_one_sentence(text, sentence, tmp_path):
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError) as caught:
        read_luminance(tmp_path / "a.csv")
    assert sentence in str(caught.value)
    assert str(caught.value).count("\n") == 0


@pytest.mark.parametrize(
    ("device", "sentence"),
    [
        ("LS100", "must be one of CS100A, LS100, PR650"),
        ("spyder:COM3", "must be one of CS100A, LS100, PR650"),
        ("S470:COM3", "pip install psychopy-gammasci"),
    ],
)
def test_a_photometer_that_cannot_be_opened_is_one_sentence(device, sentence):
    with pytest.raises(InputError) as caught:
        photometer.open_photometer(device)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("given", [-1, None, float("nan")])
def test_a_reading_that_fails_is_tried_again_and_named_where_it_goes_on_failing(given):
    shown = []

    class Failing:
        fails = 2

        def getLum(self):
            if len(shown) == 4 and self.fails:
                self.fails -= 1
                return given
            return shown[-1][0] / 10

    assert photometer.measure(shown.append, Failing())["red"][3] == 5.1
    shown.clear()
    Failing.fails = 3
    with pytest.raises(InputError, match=r"at red 51, but must give a luminance"):
        photometer.measure(shown.append, Failing())
