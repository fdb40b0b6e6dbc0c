"""focalgradient: depth from blur, for cameras, eyes and experiments (after Pentland 1987).

``import focalgradient as fg`` gives `fg.Lens`, `fg.Eye`, `fg.View`, `fg.cast`, `fg.recover_depth` and the other names
below, and every room of the package as `fg.eye`, `fg.render`, `fg.scenes`, `fg.plotting`, ... A room, with the heavier
libraries that it needs, is loaded when it is first touched. (`fg.render` is the room; its function is
`fg.render.render`.)
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from focalgradient.depth import DepthMap, recover_depth
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.optics import Lens
from focalgradient.paper import paper_distance
from focalgradient.view import View

if TYPE_CHECKING:
    from focalgradient import (
        calibration,
        dataset,
        depth,
        design,
        display,
        errors,
        eye,
        files,
        lab,
        observers,
        optics,
        paper,
        photographs,
        plotting,
        power,
        progress,
        psf,
        render,
        report,
        scenes,
        statistics,
        stimuli,
        tables,
        video,
        view,
    )
    from focalgradient.eye import Eye
    from focalgradient.render import Rendered, cast, render_bands, render_series

__version__ = "0.1.0"
__all__ = [
    "DepthMap",
    "Eye",
    "FocalGradientWarning",
    "InputError",
    "Lens",
    "Rendered",
    "View",
    "calibration",
    "cast",
    "dataset",
    "depth",
    "design",
    "display",
    "errors",
    "eye",
    "files",
    "lab",
    "observers",
    "optics",
    "paper",
    "paper_distance",
    "photographs",
    "plotting",
    "power",
    "progress",
    "psf",
    "recover_depth",
    "render",
    "render_bands",
    "render_series",
    "report",
    "scenes",
    "statistics",
    "stimuli",
    "tables",
    "video",
    "view",
]

_HOMES = {"Eye": "eye", "Rendered": "render", "cast": "render", "render_bands": "render", "render_series": "render"}
"""The room of each name that is loaded when it is first touched."""


def __getattr__(name: str) -> Any:
    """Load a room, or a name from its room, when it is first touched."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name not in _HOMES:
        return import_module(f"{__name__}.{name}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the names and the rooms, loaded or not."""
    return sorted({*globals(), *__all__})
