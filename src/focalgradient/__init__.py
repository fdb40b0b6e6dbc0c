"""focalgradient: depth from blur, for cameras, eyes and experiments (after Pentland 1987).

``import focalgradient as fg`` provides `fg.Lens`, `fg.Eye`, `fg.View`, `fg.cast`, `fg.recover_depth` and the other
names below, and every subpackage as `fg.eye`, `fg.render`, `fg.scenes`, `fg.plotting`, ... A subpackage, with the
heavier libraries that it needs, is imported on first access. (`fg.render` is the subpackage; its function is
`fg.render.render`.)
"""

from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

from focalgradient.citation import bibtex
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.optics import DualPixel, Lens
from focalgradient.paper import paper_distance
from focalgradient.view import View

if TYPE_CHECKING:
    from focalgradient import binocular as binocular
    from focalgradient import calibration as calibration
    from focalgradient import citation as citation
    from focalgradient import dataset as dataset
    from focalgradient import depth as depth
    from focalgradient import design as design
    from focalgradient import display as display
    from focalgradient import errors as errors
    from focalgradient import examples as examples
    from focalgradient import eye as eye
    from focalgradient import files as files
    from focalgradient import lab as lab
    from focalgradient import live as live
    from focalgradient import memory as memory
    from focalgradient import observers as observers
    from focalgradient import optics as optics
    from focalgradient import paper as paper
    from focalgradient import parallel as parallel
    from focalgradient import photographs as photographs
    from focalgradient import plotting as plotting
    from focalgradient import power as power
    from focalgradient import progress as progress
    from focalgradient import psf as psf
    from focalgradient import published as published
    from focalgradient import render as render
    from focalgradient import report as report
    from focalgradient import retina as retina
    from focalgradient import scenes as scenes
    from focalgradient import statistics as statistics
    from focalgradient import stimuli as stimuli
    from focalgradient import tables as tables
    from focalgradient import video as video
    from focalgradient import view as view
    from focalgradient.binocular import stereo
    from focalgradient.depth import DepthMap, recover_depth
    from focalgradient.eye import Eye
    from focalgradient.live import FocusSeries
    from focalgradient.render import Rendered, blur, cast, render_bands, render_series
    from focalgradient.video import read_movie, save_movie

__version__ = "0.1.0"
__citation__ = bibtex(__version__)
__all__ = [
    "DepthMap",
    "DualPixel",
    "Eye",
    "FocalGradientWarning",
    "FocusSeries",
    "InputError",
    "Lens",
    "Rendered",
    "View",
    "blur",
    "cast",
    "paper_distance",
    "read_movie",
    "recover_depth",
    "render_bands",
    "render_series",
    "save_movie",
    "stereo",
]

_HOMES = {
    "DepthMap": "depth",
    "Eye": "eye",
    "FocusSeries": "live",
    "recover_depth": "depth",
    "stereo": "binocular",
    **dict.fromkeys(["Rendered", "blur", "cast", "render_bands", "render_series"], "render"),
    **dict.fromkeys(["read_movie", "save_movie"], "video"),
}
"""Subpackage that defines each lazily imported name."""


_ROOMS = {module.name for module in iter_modules(__path__)} - {"cli"}  # the command line is not part of the library


def __getattr__(name: str) -> Any:
    """Import a subpackage, or a name from its subpackage, on first access."""
    if name in _ROOMS:
        return import_module(f"{__name__}.{name}")
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return all names and subpackages, imported or not."""
    return sorted({*globals(), *__all__, *_ROOMS})
