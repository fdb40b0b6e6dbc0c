"""What lies behind the optics of an eye: cones, gaze, retinal spectra for ISETBio, and the two eyes of a person."""

from focalgradient.retina.cone_density import cone_density, cone_nyquist_cpd
from focalgradient.retina.fixation import FixationalMovements
from focalgradient.retina.isetbio import SpectralImage, read_isetbio, save_isetbio
from focalgradient.retina.mosaic import ConeMosaic
from focalgradient.retina.spectral_image import retinal_spectra, scene_spectra
from focalgradient.retina.two_eyes import TwoEyes

__all__ = [
    "ConeMosaic",
    "FixationalMovements",
    "SpectralImage",
    "TwoEyes",
    "cone_density",
    "cone_nyquist_cpd",
    "read_isetbio",
    "retinal_spectra",
    "save_isetbio",
    "scene_spectra",
]
