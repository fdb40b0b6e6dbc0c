"""Optics of the eye, with the interface of a lens, in light of any wavelength and at any moment.

Its focus depends on colour (chromatic aberration) and on time (microfluctuations of accommodation), each of which gives
two views. Accommodation and defocus are in dioptres, light in nanometres. Functions of an eye or a lens take
frequencies in cycles per radian; formulas for a pupil take cycles per degree, as in the literature: ``_cpd`` in the
name.
"""

import warnings
from importlib import import_module
from typing import Any

from focalgradient.eye.accommodation import Accommodation, Course, Stimulus, accommodate, target_course
from focalgradient.eye.age import (
    accommodation_amplitude,
    aged_light,
    lens_density,
    natural_pupil,
)
from focalgradient.eye.chromatic import REFERENCE_NM, chromatic_difference, chromatic_wavelength
from focalgradient.eye.chromatic_stimulus import ChromaticStimulus, chromatic_stimulus
from focalgradient.eye.colours import cone_images
from focalgradient.eye.cones import Cones
from focalgradient.eye.description import EyeDescription, read_eye
from focalgradient.eye.diffraction import cutoff_cpd, mean_eye_mtf, optical_transfer
from focalgradient.eye.fluctuation import Microfluctuations, Oscillation, growth
from focalgradient.eye.gaussian import GaussianFit, best_gaussian
from focalgradient.eye.light import (
    Band,
    Light,
    band_light,
    cone_fundamentals,
    illuminant,
    luminosity,
)
from focalgradient.eye.local_colour import ColouredCones, KnownSpectrum, LocalColours, SeenContrast, estimate_colours
from focalgradient.eye.measured import ZernikePopulation, osa_index, osa_order, read_zernike, resized_zernike
from focalgradient.eye.model_eye import Eye, TimeCourse
from focalgradient.eye.off_axis import SCHEMATIC, SchematicPeriphery, field_coma, field_foci, off_axis
from focalgradient.eye.peripheral_refraction import EMMETROPES, MYOPES, PeripheralRefraction
from focalgradient.eye.periphery import midget_density, resolved_cpd
from focalgradient.eye.photons import Photons
from focalgradient.eye.plant import Plant
from focalgradient.eye.population import Person, draw_people
from focalgradient.eye.prediction import Predictor
from focalgradient.eye.prior import EyePrior, learn_chromatic_scale, recover_eye_depth
from focalgradient.eye.protocol import EyeModel
from focalgradient.eye.pulse import Pulse, PulsedPlant
from focalgradient.eye.quality import ThroughFocus, contrast_sensitivity, image_quality, point_images
from focalgradient.eye.refraction import CORRECTIONS, Correction, Refraction
from focalgradient.eye.retinal_image import parts_needed, retinal_image
from focalgradient.eye.scatter import Scatter
from focalgradient.eye.score import score
from focalgradient.eye.spectral import SpectralBasis, SpectralPicture, band_picture
from focalgradient.eye.target import Target
from focalgradient.eye.target_motion import TargetMotion
from focalgradient.eye.track import Motion, Track, track
from focalgradient.eye.transfer import BlurName, blur_transfer, point_spread
from focalgradient.eye.typical import typical_aberrations
from focalgradient.eye.viewing import EXTREMES_S, ViewingConditions, compared_views
from focalgradient.eye.views import accommodation_views, band_views, cone_catches, eye_views
from focalgradient.eye.wavefront import Aberrations, zernike
from focalgradient.eye.zones import ZonedLens

__all__ = [
    "CORRECTIONS",
    "EMMETROPES",
    "EXTREMES_S",
    "MYOPES",
    "REFERENCE_NM",
    "SCHEMATIC",
    "Aberrations",
    "Accommodation",
    "Band",
    "BlurName",
    "ChromaticStimulus",
    "ColouredCones",
    "Cones",
    "Correction",
    "Course",
    "Eye",
    "EyeDescription",
    "EyeModel",
    "EyePrior",
    "GaussianFit",
    "KnownSpectrum",
    "Light",
    "LocalColours",
    "Microfluctuations",
    "Motion",
    "Oscillation",
    "PeripheralRefraction",
    "Person",
    "Photons",
    "Plant",
    "Predictor",
    "Pulse",
    "PulsedPlant",
    "Refraction",
    "Scatter",
    "SchematicPeriphery",
    "SeenContrast",
    "SpectralBasis",
    "SpectralPicture",
    "Stimulus",
    "Target",
    "TargetMotion",
    "ThroughFocus",
    "TimeCourse",
    "Track",
    "ViewingConditions",
    "ZernikePopulation",
    "ZonedLens",
    "accommodate",
    "accommodation_amplitude",
    "accommodation_views",
    "aged_light",
    "band_light",
    "band_picture",
    "band_views",
    "best_gaussian",
    "blur_transfer",
    "chromatic_difference",
    "chromatic_stimulus",
    "chromatic_wavelength",
    "compared_views",
    "cone_catches",
    "cone_fundamentals",
    "cone_images",
    "contrast_sensitivity",
    "cutoff_cpd",
    "draw_people",
    "estimate_colours",
    "eye_views",
    "field_coma",
    "field_foci",
    "growth",
    "illuminant",
    "image_quality",
    "learn_chromatic_scale",
    "lens_density",
    "luminosity",
    "mean_eye_mtf",
    "midget_density",
    "natural_pupil",
    "off_axis",
    "optical_transfer",
    "osa_index",
    "osa_order",
    "parts_needed",
    "point_images",
    "point_spread",
    "read_eye",
    "read_zernike",
    "recover_eye_depth",
    "resized_zernike",
    "resolved_cpd",
    "retinal_image",
    "score",
    "target_course",
    "track",
    "typical_aberrations",
    "zernike",
]

MOVED = (
    *("ConeMosaic", "FixationalMovements", "SpectralImage", "TwoEyes", "cone_density", "cone_nyquist_cpd"),
    *("read_isetbio", "retinal_spectra", "save_isetbio", "scene_spectra"),
)
"""Names that were here and are in `focalgradient.retina`."""


def __getattr__(name: str) -> Any:
    if name not in MOVED:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    text = f"{name} is now in focalgradient.retina; its name in focalgradient.eye goes in 0.3."
    warnings.warn(text, DeprecationWarning, stacklevel=2)
    return getattr(import_module("focalgradient.retina"), name)
