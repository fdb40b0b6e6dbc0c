"""Wrong inputs to an eye, on the command line and in Python: one clear sentence each, and no traceback."""

import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import run, sentence

from focalgradient import InputError, Lens, View
from focalgradient.eye import (
    Accommodation,
    Cones,
    Eye,
    EyeDescription,
    Light,
    LocalColours,
    Microfluctuations,
    Oscillation,
    Plant,
    SpectralBasis,
    SpectralPicture,
    Target,
    ZernikePopulation,
    ZonedLens,
    accommodate,
    band_light,
    band_picture,
    band_views,
    blur_transfer,
    chromatic_difference,
    chromatic_wavelength,
    cone_images,
    draw_people,
    image_quality,
    learn_chromatic_scale,
    off_axis,
    optical_transfer,
    recover_eye_depth,
    track,
)  # fmt: skip
from focalgradient.retina import ConeMosaic, FixationalMovements, scene_spectra
from focalgradient.scenes import Scene

EYE = Eye(0.004, 1.0)
NAN = float("nan")
NEAR = np.ones((8, 8))
SIX = SpectralBasis.of_reflectances(np.arange(400.0, 700.0, 10.0), np.ones((30, 6)))
VIEW = View(np.ones((64, 64)), Cones(EYE, "L+M", (580.0,)), 3e-4)

WRONG_OPTIONS = [
    ("--refraction", "-2.00 x 180", "sphere, cylinder and axis"),
    ("--refraction", "OD -2.00", "refraction is 'OD -2.00'"),
    ("--age", "0.5", "--age is 0.5.*from 1 to 120"),
    ("--age", "thirty", "'thirty'"),
    ("--pupil", "4mm", "'4mm'"),
    ("--zones", "bifocal", "--zones is 'bifocal'"),
    ("--correction", "spectacles", "--correction corrects the eye of --refraction"),
]


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
        line = sentence(run(*command, *pupil, option, value))
        assert re.search(said, line), line
    assert not Path("o").exists()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--through-focus", "--illuminant", "D66"], "illuminant is 'D66'"),
        (["--through-focus", "--accommodate", "step:1,2"], "leave out one"),
        (["--accommodate", "step:1,2", "--zones", "2:2"], "leave out"),
        (["--accommodate", "sine:nan,1,1"], "sine:MEAN,AMPLITUDE,HZ"),
        (["--accommodate", "none.csv"], "none.csv: No such file|none.csv cannot be read"),
        (["--through-focus", "--meridian", "nasal"], "--meridian is the side of --eccentricity"),
        (["--accommodate", "step:1,3", "--eccentricity", "5"], "--accommodate simulates the fovea"),
        (["plane", "--through-focus"], "leave out one"),
    ],
)
def test_eye_refuses_what_does_not_go_together(options, said):
    assert re.search(said, sentence(run("eye", "--out", "o", *options)))


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: Eye(), "pupil_diameter is missing.*refraction or age"),
        (lambda: Eye(0.004, 1.0, looking_at=1.0), "looking_at is given without a refraction or an age"),
        (lambda: Eye(0.004, 1.0, refraction="-2.00"), "accommodation and refraction are both given.*looking_at"),
        (lambda: Eye(age=30, looking_at=1.0, response=1.0), "looking_at and response both"),
        (lambda: Eye(0.004, age=30, luminance=10.0), "pupil_diameter and luminance both"),
        (lambda: Eye(age=60, response=2.0), "response is 2.*at an age of 60.*0.1 dioptres"),
        (lambda: Eye(refraction="-2", correction="glasses"), "correction is 'glasses'.*spectacles"),
        (lambda: chromatic_difference([550, NAN]), "NaN.*nanometres"),
        (lambda: Eye(0.004, 1.0, aberrations=5), "aberrations is 5"),
        (lambda: image_quality(Cones.of(EYE, "L+M"), [1, 0]), "sort them"),
        (lambda: image_quality(Cones.of(EYE, "L+M"), [0, 1], [-4]), "from -4 to -4, but must be 0 or more"),
        (lambda: LocalColours.known(SIX, [1.0] * 6, (8, 8)).lit_by(SpectralBasis.of_srgb()), "amounts of 6 components"),
        (lambda: accommodate(2.0, 1.0), "target is 2.0.*function of time"),
        (lambda: Accommodation(cue="colour"), "cue is 'colour', but must be one of bands, moments, both"),
        (lambda: Target(shape=(4, 4)), "at least 16 x 16"),
        (lambda: accommodate(lambda t: 9.0, 1.0), "the lens goes from 0 to 8 D only"),
        (lambda: accommodate(lambda t: 1.0, 0.01), "duration is 0.01 s, but the eye looks every 0.1 s"),
        (lambda: EyeDescription(correction="spectacles").eye(1.0, 0.004), "give refraction as well"),
        (lambda: EyeDescription(aberrations="typical").eye(1.0, 0.007), "up to 6 mm, but this one has 7"),
        (lambda: Eye(age=15), "age is 15.*pupil's diameter"),
        (lambda: EyeDescription(zones="2:2,1:0").eye(1.0, 0.004), "zones is '2:2,1:0'.*increase"),
        (lambda: cone_images(np.ones((4, 4, 2)), wavelength_nm=[500, 400]), "increase"),
        (lambda: chromatic_wavelength(1.0), "but visible light"),
        (lambda: cone_images(np.ones((4, 4))), "H x W x 3"),
        (lambda: optical_transfer(5.0, pupil_diameter=0.004, wavelength_nm=555e-9, defocus=0.0), "nanometres"),
        (lambda: Light(np.array([500.0, 600.0]), np.array([1.0])), "each wavelength of a list needs one weight"),
        (lambda: Light(np.array([500.0, 600.0]), np.array([-1.0, 2.0])), "weight holds negative or undefined values"),
        (lambda: band_light("S", "candle"), "illuminant is 'candle'"),
        (lambda: band_views((NEAR, NEAR), EYE, (8, 6), 3e-4), "shape"),
        (lambda: band_views((NEAR, NEAR), EYE, (8, 8), 3e-4, correlation=0.9), "correlation or gain"),
        (lambda: band_views(1.0, EYE, (64, 64), 3e-4, correlation=-1.5), "correlation is -1.5"),
        (lambda: band_views(-1.0, EYE, (64, 64), 3e-4), "scene is -1.0, .*a wall's distance"),
        (lambda: band_views(Scene(()), EYE, (64, 64), 3e-4), "no depth to see"),
        (lambda: draw_people(3, 0, pupil_diameter=(4.0, 0.8)), r"must be a mean between 0\.0015 and 0\.009"),
        (lambda: Cones.of(EYE, "S", model="gausian"), "model is 'gausian', but must be one of wave, disc, gaussian"),
        (lambda: Cones.of(EYE, "S", wavelengths=2.5), "count is 2.5, but must be a whole number"),
        (lambda: Cones(EYE, "L+M", ()), "wavelengths_nm is"),
        (lambda: blur_transfer(0, 5, Lens(0.05, np.inf, 1.0), 1.0), "a pinhole, whose diffraction has no bound"),
        (lambda: blur_transfer(0, 5, "lens", 1.0), "optics is 'lens', but must be a Lens, an Eye"),
        (lambda: Eye(0.003, 0.0, aberrations=((2, 0),)), r"holds \(2, 0\), but each term"),
        (lambda: Oscillation().at([0.0, 2.0, 1.0]), "each moment must be later than the one before"),
        (lambda: Microfluctuations(lowest=1.0), r"lowest is 1\.0, but must be above 0 and below 1 Hz"),
        (lambda: Microfluctuations(drift=0.1, lowest=0.003), r"drift goes from 0\.0033 Hz up to it"),
        (lambda: Eye.from_zernike([0, 0, 0, 0.1], 0.006, measured_diameter=0.004), "outside of the measured pupil"),
        (lambda: ZernikePopulation(np.zeros(4), -np.eye(4), 0.006), "covariance_um2"),
        (lambda: off_axis(EYE, 10.0, foci=(0.1,)), "foci is .*EMMETROPES, MYOPES, SCHEMATIC"),
        (lambda: Plant(rest=9.0), "rest is 9.0 D, but must not lie nearer than nearest"),
        (lambda: recover_eye_depth([View(np.ones((64, 64)), Lens(0.05, 4, 1.0), 3e-4)] * 2), "Cones"),
        (lambda: learn_chromatic_scale([[VIEW]]), "fixation 1 shows 1 waveband"),
        (lambda: SpectralBasis(np.arange(400.0, 500, 10), np.ones((9, 1)), np.ones(10)), "N x K"),
        (lambda: SpectralBasis(np.array([400.0, 410, 430]), np.ones((3, 1)), np.ones(3)), "even steps"),
        (lambda: band_picture(NEAR, NEAR, EYE, "S", pixel_angle=3e-4), "SpectralPicture"),
        (lambda: track([VIEW, VIEW], [0.0], noise=0.4), "views holds 2 and times 1"),
        (lambda: track([VIEW, VIEW], [1.0, 0.0], noise=0.4), "none before the last"),
        (lambda: ZonedLens((0.004, 0.002), (1.0, 0.0)), "diameters"),
        (lambda: FixationalMovements().at([-1.0, 0.0]), "the first time is -1"),
        (lambda: FixationalMovements().moved(np.ones(4), [0.0], pixel_angle=1e-3), "H x W"),
        (lambda: scene_spectra(NEAR, pixel_angle=1e-3), "picture is.*SpectralPicture.of"),
        (lambda: scene_spectra(SpectralPicture.of(-NEAR), pixel_angle=1e-3), "negative"),
        (lambda: ConeMosaic.over((24, 24), 3e-4, eccentricity_deg=60.0), "known to 60"),
        (lambda: ConeMosaic.over((24, 24), 3e-4).catch(np.ones((24, 23))), "shape"),
        (lambda: ConeMosaic.over((24, 24), 3e-4).image(np.ones(3)), "cones"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_a_function_says_what_was_expected(wrong, said):
    with pytest.raises(InputError, match=said) as caught:
        wrong()
    assert "\n" not in str(caught.value)
    assert str(caught.value).endswith(".")
