"""Files for and from others: ISETBio's structures, and aberrometers' tables."""

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from focalgradient import InputError
from focalgradient.eye import Eye, SpectralPicture, illuminant, lens_density, luminosity, read_zernike
from focalgradient.retina import SpectralImage, read_isetbio, retinal_spectra, save_isetbio, scene_spectra


def image(**changes) -> SpectralImage:
    energy = np.random.default_rng(1).random((4, 6, 3))
    given = {"energy": energy, "wavelength_nm": np.array([450.0, 550.0, 650.0]), "field_deg": 2.0, "distance": 0.57}
    return SpectralImage(**{**given, **changes})


@pytest.mark.parametrize("is_retinal", [False, True])
def test_there_and_back(tmp_path, is_retinal):
    save_isetbio(tmp_path / "one.mat", image(is_retinal=is_retinal))
    back = read_isetbio(tmp_path / "one.mat")
    assert back.energy == pytest.approx(image().energy)
    assert back.wavelength_nm.tolist() == [450.0, 550.0, 650.0]
    assert (back.field_deg, back.distance, back.is_retinal) == (2.0, 0.57, is_retinal)


def test_the_file_has_the_structure_of_isetbio(tmp_path):
    """Photons of 1 W/sr/m^2/nm at 555 nm: 2.794e18; wave a column; the type of each structure."""
    save_isetbio(tmp_path / "scene.mat", image(energy=np.ones((2, 2, 1)), wavelength_nm=np.array([555.0])))
    scene = loadmat(tmp_path / "scene.mat", squeeze_me=True, struct_as_record=False)["scene"]
    assert scene.type == "scene"
    assert scene.data.photons == pytest.approx(np.full((2, 2), 2.794e18), rel=1e-3)
    save_isetbio(tmp_path / "oi.mat", image(is_retinal=True))
    raw = loadmat(tmp_path / "oi.mat")["oi"]
    assert raw["spectrum"][0, 0]["wave"][0, 0].shape == (3, 1)
    assert str(raw["type"][0, 0][0]) == "opticalimage"
    focal_length = raw["optics"][0, 0]["focalLength"][0, 0].item()
    assert focal_length * np.radians(1) == pytest.approx(300e-6, rel=1e-3)  # ISETBio's human optics


def test_what_is_no_scene_is_refused(tmp_path):
    savemat(tmp_path / "other.mat", {"x": 1.0})
    with pytest.raises(InputError, match="no scene or oi"):
        read_isetbio(tmp_path / "other.mat")
    (tmp_path / "text.mat").write_text("scene")
    with pytest.raises(InputError, match="MATLAB file"):
        read_isetbio(tmp_path / "text.mat")
    for change, sentence in (
        ({"energy": -np.ones((2, 2, 3))}, "negative"),
        ({"wavelength_nm": np.array([450.0, 550.0])}, "H x W x N"),
    ):
        with pytest.raises(InputError, match=sentence):
            image(**change)


@pytest.mark.parametrize(
    "text",
    [
        "Patient: 17\nPupil diameter: 6.0 mm\nZ(2,0) = 0.30 µm\nZ(4,0) = 0.05 µm\nRMS: 0.304\n",
        "Z[2, 0]; 0.30\nZ[4, 0]; 0.05\n",
        "C4\t0.30\nC12\t0.05\n",
        "Z 2 0 0.30\nZ 4 0 0.05\n",
        "Z_2^0: 0,30\nZ_4^0: 0,05\n",
        "C4 0,30\nC12 0,05\n",
        "Z 2 0, 0.30\nZ 4 0, 0.05\n",
        "Z(2,0) .30\nZ(4,0) .05\n",
    ],
)
def test_tables_as_aberrometers_name_terms(tmp_path, text):
    (tmp_path / "eye.txt").write_text(text, encoding="utf-8")
    found = read_zernike(tmp_path / "eye.txt")
    assert (found[4], found[12], len(found)) == (0.3, 0.05, 13)


def test_coefficients_of_matlab_files(tmp_path):
    values = [0.0, 0.0, 0.0, 0.1, 0.3]
    savemat(tmp_path / "vector.mat", {"zcoeffs": values})
    savemat(tmp_path / "wvf.mat", {"wvf": {"zcoeffs": values, "measpupil": 8.0}})
    for name in ("vector", "wvf"):
        assert read_zernike(tmp_path / f"{name}.mat") == pytest.approx(values)
    savemat(tmp_path / "none.mat", {"x": 1.0})
    with pytest.raises(InputError, match="no vector zcoeffs"):
        read_zernike(tmp_path / "none.mat")


def test_a_scene_has_the_spectra_of_its_surfaces_in_its_light():
    """Red over white at each wavelength is the reflectance, and the luminance of white that of the argument."""
    picture = SpectralPicture.of_srgb([[[1.0, 1.0, 1.0], [0.8, 0.1, 0.1]]], "A")
    scene = scene_spectra(picture, pixel_angle=np.radians(0.1), distance=0.57, luminance=40.0)
    assert scene.wavelength_nm.tolist() == list(range(400, 701, 10))
    assert scene.energy[0, 0] / scene.energy[0, 0, 16] == pytest.approx(
        illuminant(scene.wavelength_nm, "A") / illuminant(560, "A"), rel=1e-3
    )
    red = scene.energy[0, 1] / scene.energy[0, 0]
    assert red[22] > 0.75 > 0.2 > red[5]  # at 620 and at 450 nm
    fine = scene_spectra(picture, pixel_angle=1e-3, luminance=40.0, wavelength_nm=np.arange(390, 781, 1.0))
    assert 683 * luminosity(fine.wavelength_nm) @ fine.energy[0, 0] == pytest.approx(40.0, rel=1e-3)
    assert (scene.field_deg, scene.distance, scene.is_retinal) == (pytest.approx(0.2, rel=1e-4), 0.57, False)


def test_a_retinal_image_is_blurred_in_the_focus_of_each_wavelength(tmp_path):
    """A grating at 1 m, in focus at 580 nm: each wavelength keeps the contrast of the eye's transfer; and the file."""
    angle, eye = np.radians(0.5 / 60), Eye(0.003, 1.0)
    wave = np.tile(0.5 + 0.4 * np.cos(2 * np.pi * np.arange(96) / 12), (48, 1))  # 10 cycles per degree
    picture, nm = SpectralPicture.of(wave, "E"), [450.0, 580.0, 650.0]
    seen = retinal_spectra(picture, np.ones(wave.shape), eye, pixel_angle=angle, wavelength_nm=nm)
    line = seen.energy[24, 36:60]
    contrast = 2 * abs(np.exp(2j * np.pi * np.arange(24) / 12) @ line) / line.sum(axis=0) / 0.8
    expected = [float(abs(eye.in_light(one).optical_transfer(0.0, np.degrees(10.0), 1.0))) for one in nm]
    assert contrast == pytest.approx(expected, abs=0.02)
    assert expected[0] < 0.5 < expected[1]
    old = retinal_spectra(picture, np.ones(wave.shape), eye, pixel_angle=angle, wavelength_nm=nm, age=70)
    ratio = 10 ** (lens_density(nm, 32) - lens_density(nm, 70))
    assert old.energy.sum(axis=(0, 1)) / seen.energy.sum(axis=(0, 1)) == pytest.approx(ratio)
    save_isetbio(tmp_path / "oi.mat", seen)
    back = read_isetbio(tmp_path / "oi.mat")
    assert back.is_retinal
    assert back.energy == pytest.approx(seen.energy)
