"""Eyes described by a person's data or by a file, the conditions they see in, and the views they compare."""

import math
from pathlib import Path

import numpy as np
import pytest

from focalgradient import InputError
from focalgradient.eye import (
    EMMETROPES,
    MYOPES,
    Cones,
    Eye,
    EyeDescription,
    ViewingConditions,
    compared_views,
    image_quality,
    off_axis,
    point_images,
    read_eye,
    resolved_cpd,
)


@pytest.mark.parametrize(
    ("refraction", "people"), [(None, EMMETROPES), ("+1", EMMETROPES), ("-0.49", EMMETROPES), ("-0.50", MYOPES)]
)
def test_the_periphery_is_that_of_the_group(refraction, people):
    assert EyeDescription(refraction=refraction).periphery is people


def test_a_measured_eye_is_read_from_its_file(tmp_path: Path):
    terms = [0, 0, 0, 0, 0.5, 0, 0, 0.2]
    (tmp_path / "terms.csv").write_text("2,0,0.5\n3,-1,0.2\n", encoding="utf-8")
    path = tmp_path / "eye.toml"
    path.write_text('pupil_mm = 4.0\nzernike = "terms.csv"\nmeasured_mm = 6.0\n', encoding="utf-8")
    measured = Eye.from_zernike(terms, 0.004, measured_diameter=0.006)
    assert read_eye(path, 1.5).aberrations == pytest.approx(np.array(measured.aberrations))
    assert read_eye(path, 1.5).focus_vergence == 1.5  # its defocus is corrected
    path.write_text("pupil_mm = 40\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"eye\.toml: pupil_mm is 40 mm, but must be from 0\.1 to 9 mm"):
        read_eye(path, 1.5)


def test_conditions_change_the_light_the_optics_and_the_resolution():
    eye, fovea = Eye(0.003, 1.0), ViewingConditions()
    aside = ViewingConditions(eccentricity_deg=20.0, meridian="nasal")
    assert fovea.off_axis(eye) is eye
    assert aside.off_axis(eye, MYOPES) == off_axis(eye, 20.0, "nasal", foci=MYOPES, coma=True)
    assert fovea.cones(eye, "L+M") == Cones.of(eye, "L+M")
    assert aside.cones(eye, "L+M").finest_cpd == resolved_cpd(20.0, "nasal")
    assert aside.cones(eye, "luminance").finest_cpd == math.inf
    old = ViewingConditions(age=80, scatter=True)
    assert old.light("S").difference() > fovea.light("S").difference()  # the lens absorbs the shortest wavelengths
    assert old.cones(eye, "S").transfer(np.degrees(3.0), 1.0) < fovea.cones(eye, "S").transfer(np.degrees(3.0), 1.0)


def test_views_differ_in_band_and_moment():
    eye = Eye(0.004, 1.0)
    seen = {cue: compared_views(0.8, eye, cue, (64, 64), math.radians(1 / 60)) for cue in ("bands", "moments")}
    focus = {cue: [one.view.optics.focus_vergence for one in views.values()] for cue, views in seen.items()}
    assert [*seen["bands"]] == ["L+M", "S"]
    assert focus["bands"][1] - focus["bands"][0] == pytest.approx(0.8, abs=0.1)
    assert focus["moments"][0] - focus["moments"][1] == pytest.approx(0.5)  # 0.25 D to either side


def test_the_range_of_image_quality_covers_the_zones_of_a_lens():
    eye = EyeDescription(zones="2:3,8:0").eye(0.0, 0.0035)
    cones = Cones(eye, "luminance", (580.0,))
    assert image_quality(cones).vergences[[0, -1]] == pytest.approx([-2.0, 5.0])
    images = point_images(cones, 0.0)
    assert [*images] == [0, 0.75, 1.5, 2.25, 3.0]
    assert max(images, key=lambda change: images[change].max()) in (0, 3)
