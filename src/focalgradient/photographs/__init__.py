"""Photographs: image files and the optics that took them, in; views, out.

Units stand in the names here (``_mm``, ``_um``, ``_m``), as people write them; behind this door all is SI.
"""

from focalgradient.photographs.exif import from_exif
from focalgradient.photographs.images import Photograph, read_photograph, read_photographs, srgb_to_linear
from focalgradient.photographs.settings import Camera, Settings, Shot, load_settings, make_views, read_views

__all__ = [
    "Camera",
    "Photograph",
    "Settings",
    "Shot",
    "from_exif",
    "load_settings",
    "make_views",
    "read_photograph",
    "read_photographs",
    "read_views",
    "srgb_to_linear",
]
