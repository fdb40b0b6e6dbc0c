"""The parts of an eye beside other libraries and other published equations (`published_reference.py`)."""

import json
from pathlib import Path

import numpy as np
import pytest

from focalgradient.eye import Scatter, chromatic_difference, field_foci, lens_density, natural_pupil
from focalgradient.retina import cone_density

REFERENCE = json.loads(Path(__file__).with_name("published_reference.json").read_text(encoding="utf-8"))
AGE_OF_FUNDAMENTALS = 32
SAME_PLACE = {"superior": "inferior", "inferior": "superior", "nasal": "temporal", "temporal": "nasal"}
"""Side of the visual field that falls on a side of the retina."""


def test_pupils_of_luxpy():
    found = [
        natural_pupil(row["luminance"], age=row["age"], field_deg=row["field_deg"], eyes=row["eyes"])
        for row in REFERENCE["pupils"]
    ]
    assert 1e3 * np.array(found) == pytest.approx([row["mm"] for row in REFERENCE["pupils"]], abs=5e-4)


def test_lenses_of_the_cone_fundamentals():
    """CIE 170-1 at 32 years, and its ageing: another model, of other data. Two piecewise linear growths with age."""
    density = {(row["age"], row["nm"]): row["density"] for row in REFERENCE["lenses"]}
    nm = np.array([410, 420, 430, 440, 450, 460, 480, 500])
    young = np.array([density[AGE_OF_FUNDAMENTALS, one] for one in nm])
    assert lens_density(nm, AGE_OF_FUNDAMENTALS) == pytest.approx(young, rel=0.13)
    for age in (20, 80):
        theirs = np.array([density[age, one] for one in nm]) - young
        ours = lens_density(nm, age) - lens_density(nm, AGE_OF_FUNDAMENTALS)
        assert ours == pytest.approx(theirs, rel=0.35)
    theirs = np.array([density[60, one] for one in nm]) - young  # a line from 20 to 60 years, where ours is a square
    assert np.all(lens_density(nm, 60) - lens_density(nm, AGE_OF_FUNDAMENTALS) < 1.8 * theirs)


def test_chromatic_difference_of_atchison_and_smith():
    """Two fits of two collections of data: 0.03 D apart from 450 to 650 nm, 0.07 D at 400 nm."""
    for row in REFERENCE["chromatic"]:
        allowed = 0.03 if 450 <= row["nm"] <= 650 else 0.07
        assert float(chromatic_difference(row["nm"])) == pytest.approx(row["D"], abs=allowed)


def test_glare_of_the_total_equation():
    """The general equation is a short form: within 30 % from 0.1 to 90 degrees; mean ratio within 8 %."""
    ratio = np.array(
        [float(Scatter(row["age"], row["pigment"]).veil(row["degrees"])) / row["veil"] for row in REFERENCE["glare"]]
    )
    assert np.all((ratio > 0.7) & (ratio < 1.3))
    assert abs(np.log(ratio).mean()) < 0.08


def test_cones_of_song_et_al():
    """Other people, counted in living eyes: within 25 % from 0.18 to 2.16 mm; mean ratio within 5 %."""
    ratio = []
    for row in REFERENCE["cones"]:
        mm = row["mm"]
        deg = 3.556 * mm + 0.05993 * mm**2 - 0.007358 * mm**3 + 0.0003027 * mm**4  # Drasdo & Fowler (1974)
        square_mm = 0.0752 + 5.846e-5 * deg - 1.064e-5 * deg**2 + 4.116e-8 * deg**3
        ratio.append(float(cone_density(deg, SAME_PLACE[row["side"]])) / (1e3 * row["thousands"] * square_mm))
    assert np.all((np.array(ratio) > 0.8) & (np.array(ratio) < 1.25))
    assert abs(np.log(ratio).mean()) < 0.05


def test_foci_of_rays_that_visisipy_traces():
    """It takes the oblique beam in the pupil to be round, which moves the tangential focus at large angles."""
    for row in REFERENCE["off_axis"]:
        tangential, sagittal = field_foci(row["degrees"])
        assert sagittal == pytest.approx(row["sagittal"], abs=0.04 if row["degrees"] <= 30 else 0.13)
        if row["degrees"] <= 20:
            assert tangential == pytest.approx(row["tangential"], abs=0.04)
