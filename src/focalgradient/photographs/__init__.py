"""Photographs: from image files and the optics that took them to views.

Names carry units here (``_mm``, ``_um``, ``_m``), as in users' files; internally everything is in SI units.
"""

from focalgradient.photographs.calibrating import TargetCalibration, calibrate_camera
from focalgradient.photographs.cameras import Calibrated, camera_toml, load_camera
from focalgradient.photographs.depth_pictures import (
    DepthPair,
    DepthPicture,
    depth_pairs,
    pixel_angle_of,
    read_depth_picture,
)
from focalgradient.photographs.depths import PhotographedDepth, depth_from_photographs, limits_beside_focus
from focalgradient.photographs.exif import GivenOptics, from_exif
from focalgradient.photographs.images import read_photograph, read_photographs
from focalgradient.photographs.known_scenes import KnownScenes, SceneCalibration, load_known_scenes, names_depth
from focalgradient.photographs.photograph import Photograph
from focalgradient.photographs.pictures import DepthUnit, Distances, Picture, picture_of, read_distances, read_picture
from focalgradient.photographs.raw import read_dual_pixel_raw
from focalgradient.photographs.settings import Camera, Settings, Shot, load_settings, make_views, read_views
from focalgradient.photographs.targets import Targets, load_targets
from focalgradient.srgb import srgb_to_linear

__all__ = [
    "Calibrated",
    "Camera",
    "DepthPair",
    "DepthPicture",
    "DepthUnit",
    "Distances",
    "GivenOptics",
    "KnownScenes",
    "Photograph",
    "PhotographedDepth",
    "Picture",
    "SceneCalibration",
    "Settings",
    "Shot",
    "TargetCalibration",
    "Targets",
    "calibrate_camera",
    "camera_toml",
    "depth_from_photographs",
    "depth_pairs",
    "from_exif",
    "limits_beside_focus",
    "load_camera",
    "load_known_scenes",
    "load_settings",
    "load_targets",
    "make_views",
    "names_depth",
    "picture_of",
    "pixel_angle_of",
    "read_depth_picture",
    "read_distances",
    "read_dual_pixel_raw",
    "read_photograph",
    "read_photographs",
    "read_picture",
    "read_views",
    "srgb_to_linear",
]
