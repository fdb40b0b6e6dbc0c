"""Former name of `focalgradient.lab.devices.lenses`, which goes in 0.3."""

from __future__ import annotations

import warnings
from typing import Any

from focalgradient.lab.devices import lenses


def __getattr__(name: str) -> Any:
    if name not in lenses.__all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    said = "focalgradient.lab.lenses is now focalgradient.lab.devices.lenses; the old name goes in 0.3."
    warnings.warn(said, DeprecationWarning, stacklevel=2)
    return getattr(lenses, name)
