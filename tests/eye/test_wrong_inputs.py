"""Wrong inputs to an eye, on the command line and in Python: one clear sentence each, and no traceback."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from focalgradient import InputError
from focalgradient.cli import main
from focalgradient.eye import (
    CORRECTIONS,
    Accommodation,
    Cones,
    Eye,
    Refraction,
    Scatter,
    SpectralBasis,
    Stimulus,
    ZonedLens,
    accommodate,
    accommodation_amplitude,
    aged_light,
    band_light,
    chromatic_difference,
    chromatic_stimulus,
    draw_people,
    image_quality,
    lens_density,
    natural_pupil,
    off_axis,
    optical_transfer,
    resized_zernike,
    typical_aberrations,
)
from focalgradient.eye.refraction import focus_of
from focalgradient.retina import TwoEyes

EYE = Eye(0.004, 1.0)
NAN = float("nan")
GREY, NEAR = np.full((8, 8, 3), 0.5), np.ones((8, 8))

WRONG_OPTIONS = [
    ("--refraction", "", "refraction is ''"),
    ("--refraction", "-2.00 x 180", "sphere, cylinder and axis"),
    ("--refraction", "OD -2.00", "refraction is 'OD -2.00'"),
    ("--age", "0.5", "--age is 0.5.*from 1 to 120"),
    ("--age", "thirty", "'thirty'"),
    ("--pupil", "4mm", "'4mm'"),
    ("--zones", "bifocal", "--zones is 'bifocal'"),
    ("--correction", "spectacles", "--correction corrects the eye of --refraction"),
]


def refused(*command: str) -> str:
    """The only line that a refused command writes."""
    result = CliRunner().invoke(main, list(command))
    assert result.exit_code == 2, result.output
    (line,) = result.stderr.strip().splitlines()
    assert line.startswith("Error: ")
    return line


@pytest.mark.parametrize(("option", "value", "said"), WRONG_OPTIONS)
def test_eye_and_blur_refuse_it_in_one_sentence(option, value, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cv2.imwrite("p.png", np.full((8, 8, 3), 99, np.uint8))
    np.save("d.npy", NEAR)
    pupil = [] if option in ("--pupil", "--luminance") else ["--pupil", "4"]
    for command in (
        ["eye", "--through-focus", "--out", "o"],
        ["blur", "p.png", "d.npy", "--focus", "1", "--field", "1", "--out", "o"],
    ):
        line = refused(*command, *pupil, option, value)
        assert re.search(said, line), line
    assert not Path("o").exists()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--through-focus", "--illuminant", "D66"], "illuminant is 'D66'"),
        (["--through-focus", "--illuminant", "nan K"], "black body of 1000 to 25000 K"),
        (["--through-focus", "--accommodation", "nan"], "--accommodation is nan"),
        (["--through-focus", "--age", "19", "--luminance", "9"], "20 to 83 years: give --pupil"),
        (["--through-focus", "--accommodate", "step:1,2"], "leave out one"),
        (["--accommodate", "step:1,2", "--zones", "2:2"], "leave out"),
        (["--accommodate", "sine:nan,1,1"], "sine:MEAN,AMPLITUDE,HZ"),
    ],
)
def test_eye_refuses_what_does_not_go_together(options, said):
    assert re.search(said, refused("eye", "--out", "o", *options))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: accommodation_amplitude(500), "age is 500"),
        (lambda: lens_density(550, NAN), "age is nan"),
        (lambda: lens_density("green", 30), "wavelength_nm is 'green'"),
        (lambda: aged_light(band_light("S", "D65"), 1e300), "age is 1e"),
        (lambda: SpectralBasis.of_display().through_lens(-1), "age is -1"),
        (lambda: Scatter(age=NAN), "age is nan"),
        (lambda: natural_pupil("dim"), "luminance is 'dim'"),
        (lambda: Eye(), "pupil_diameter is missing.*refraction or age"),
        (lambda: Eye(0.004), "accommodation is missing.*refraction or age"),
        (lambda: Eye(accommodation=1.0), "pupil_diameter is missing"),
        (lambda: Eye(0.004, 1.0, looking_at=1.0), "looking_at is given without a refraction or an age"),
        (lambda: Eye(luminance=10.0), "luminance is given without"),
        (lambda: Eye(0.004, 1.0, response=np.array([1.0, 2.0])), "response is given without"),
        (lambda: Eye(age=30, looking_at=np.array([1.0, 2.0])), "looking_at is"),
        (lambda: Eye(0.004, 1.0, correction="spectacles"), "correction is given without"),
        (lambda: Eye(0.004, 1.0, refraction="-2.00"), "accommodation and refraction are both given.*looking_at"),
        (lambda: Eye(0.004, 1.0, age=30), "accommodation and age are both given.*response"),
        (lambda: Eye(age=30, looking_at=1.0, response=1.0), "looking_at and response both"),
        (lambda: Eye(0.004, age=30, luminance=10.0), "pupil_diameter and luminance both"),
        (lambda: Eye(0.004, age=30, field_deg=10.0), "pupil_diameter and field_deg both"),
        (lambda: Eye(age=60, response=2.0), "response is 2.*at an age of 60.*0.1 dioptres"),
        (lambda: Eye(age=15), "age is 15.*pupil's diameter"),
        (lambda: Eye(4.0, age=30), "pupil_diameter is 4"),
        (lambda: Eye(age=30, aberrations=5), "aberrations is 5"),
        (lambda: Eye(age=[30]), "age is"),
        (lambda: Eye(age=300, pupil_diameter=0.004), "age is 300"),
        (lambda: Eye(refraction=3), "refraction is 3"),
        (lambda: Eye(refraction="-2", correction="glasses"), "correction is 'glasses'.*spectacles"),
        (lambda: Eye(refraction="-2", correction=-2.0), "correction is -2"),
        (lambda: Eye(refraction="-2", looking_at=NAN), "looking_at is nan"),
        (lambda: Eye(refraction="-2", response=-3.0), "response is -3"),
        (lambda: focus_of("-2", 0.0, CORRECTIONS["none"]), "refraction is '-2'"),
        (lambda: Refraction(1.0, NAN), "cylinder is nan"),
        (lambda: Eye(4, 1.0), "pupil_diameter is 4"),
        (lambda: Eye(0.004, 1.0, 2000), "380 and 780"),
        (lambda: EYE.in_light(None), "wavelength_nm is None"),
        (lambda: chromatic_difference([550, NAN]), "380 and 780"),
        (lambda: optical_transfer(5.0, pupil_diameter=0.004, wavelength_nm=-550, defocus=0.0), "wavelength_nm"),
        (lambda: Stimulus(light_nm="red"), "light_nm is 'red'"),
        (lambda: Eye.from_zernike("x", 0.004), "coefficients_um is 'x'"),
        (lambda: Eye(0.004, 1.0, aberrations=5), "aberrations is 5"),
        (lambda: Eye(0.004, 1.0, aberrations=((5, 0, 0.1),)), "no Zernike term"),
        (lambda: Eye(0.004, 1.0, lens="bifocal"), "lens is 'bifocal'"),
        (lambda: ZonedLens((2.0,), (1.0,)), "metres and dioptres"),
        (lambda: resized_zernike(((4, 0, 0.1),), None), "share is None"),
        (lambda: typical_aberrations(4), "pupil_diameter is 4"),
        (lambda: draw_people(1, 0, pupil_diameter=("4", 0)), "pupil_diameter is"),
        (lambda: Cones.of("eye", "L+M"), "eye is 'eye'"),
        (lambda: Cones.of(EYE, "X"), "X"),
        (lambda: off_axis("eye", 20.0), "eye is 'eye'"),
        (lambda: off_axis(EYE, 200.0), "eccentricity_deg is 200"),
        (lambda: image_quality(EYE, [0, 1]), "cones is"),
        (lambda: image_quality(Cones.of(EYE, "L+M"), [1, 0]), "sort them"),
        (lambda: image_quality(Cones.of(EYE, "L+M"), [0, 1], [-4]), "frequency_cpd goes down to -4"),
        (lambda: TwoEyes.of("right"), "right is 'right'"),
        (lambda: TwoEyes.of(EYE).convergence("near"), "vergence is 'near'"),
        (lambda: Accommodation(fluctuation=3), "fluctuation is 3"),
        (lambda: accommodate(2.0, 1.0), "target is 2.0.*function of time"),
        (lambda: accommodate(lambda t: NAN, 1.0), "target contains NaN"),
        (lambda: accommodate(lambda t: 2.0, 1.0, EYE), "eye is"),
        (lambda: accommodate(lambda t: 2.0, 1.0, None, "white"), "stimulus is 'white'"),
        (lambda: accommodate(lambda t: 2.0, 1.0, seed=-1), "seed is -1"),
        (lambda: chromatic_stimulus(GREY, NEAR, EYE, screen=1.0, pixel_angle=0), "pixel_angle is 0"),
        (lambda: chromatic_stimulus(GREY, NEAR, EYE, screen=1.0, pixel_angle=3e-4, basis="D65"), "basis is 'D65'"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_a_function_says_what_was_expected(wrong, said):
    with pytest.raises(InputError, match=said) as caught:
        wrong()
    assert "\n" not in str(caught.value)
    assert str(caught.value).endswith(".")
