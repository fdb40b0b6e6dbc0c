"""Focus series for web pages: compressed planes, shaders, and the script that draws them."""

from __future__ import annotations

import base64
import re
import zlib
from importlib.resources import files
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.live.series import FocusSeries
from focalgradient.live.shader import Dialect, fragment_shader, texels_of

__all__ = ["packed", "page_script", "page_shaders"]

SCRIPTS = ("gl.js", "focus.js")
"""Modules of ``FocusView``, in the order in which they import one another."""


def packed(series: FocusSeries, *, srgb: bool = True) -> dict[str, Any]:
    """Return a series as accepted by the script's ``FocusView.load``, for JSON.

    Parameters
    ----------
    series
        The series.
    srgb
        Whether the display's encoding is sRGB; otherwise radiance is stored in 16 bits.

    Returns
    -------
    dict
        Size, vergences of the planes in dioptres, bits and gain of the values, and, compressed as text, the first plane
        and the differences between successive planes.

    Examples
    --------
    >>> flat = FocusSeries((0.0,), (np.full((1, 2), 0.5, np.float16),), np.ones((1, 2)), np.zeros((0, 2)))
    >>> found = packed(flat)
    >>> found["width"], found["height"], found["bits"], found["gain"]
    (2, 1, 8, 1.0)
    """
    texels = texels_of(series, srgb=srgb)
    numbers: NDArray[Any] = texels.values if texels.values.dtype == np.uint8 else texels.values.view(np.uint16)
    planar = np.moveaxis(numbers[..., :3], -1, 1)
    with np.errstate(over="ignore"):
        steps = np.concatenate([planar[:1], planar[1:] - planar[:-1]])  # modulo 256 or 65536, undone by addition
    height, width = series.distance.shape
    return {
        "width": width,
        "height": height,
        "vergences": list(series.vergences),
        "bits": 8 * numbers.itemsize,
        "gain": texels.gain,
        "data": base64.b64encode(zlib.compress(steps.astype(steps.dtype.newbyteorder("<")).tobytes(), 9)).decode(),
    }


def page_shaders() -> dict[str, str]:
    """Return the shader sources used by ``FocusView``, by name.

    >>> sorted(page_shaders())
    ['gamma', 'gamma_varies', 'srgb', 'srgb_varies']
    """
    return {
        name + end: fragment_shader(Dialect.PAGE, srgb=name == "srgb", varies=bool(end), lamp=True)
        for name, end in product(("srgb", "gamma"), ("", "_varies"))
    }


def page_script() -> str:
    """Return the JavaScript source of the class ``FocusView``, as a script that defines nothing else.

    >>> "class FocusView" in page_script()
    True
    """
    room = files("focalgradient.live")
    modules = "\n".join(room.joinpath(name).read_text(encoding="utf-8") for name in SCRIPTS)
    plain = re.sub(r"^(import .*\n|export )", "", modules, flags=re.MULTILINE)
    return f"const FocusView = (() => {{\n{plain}\nreturn FocusView;\n}})();\n"
