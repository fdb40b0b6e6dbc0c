"""Detection of a working Mitsuba variant, in a separate process because Mitsuba may crash."""

from __future__ import annotations

import subprocess
import sys
from functools import cache

__all__ = ["LLVM", "REMEDY", "SCALAR", "variant"]

LLVM, SCALAR = "llvm_ad_rgb", "scalar_rgb"

REMEDY = (
    "install it with 'pip install \"focalgradient[render]\"' and, on a bare Debian, "
    "'apt-get install libatomic1 libllvm19'"
)

# Renders a sphere: with an incompatible libLLVM, Mitsuba aborts here at the latest.
PROBE = """
import sys, mitsuba
mitsuba.set_variant(sys.argv[1])
film = {"type": "hdrfilm", "width": 4, "height": 4}
sensor = {"type": "perspective", "film": film}
ball = {"type": "sphere", "center": [0, 0, 3]}
scene = {"type": "scene", "sensor": sensor, "ball": ball, "light": {"type": "constant"}, "how": {"type": "path"}}
assert 0.1 < float(sum(mitsuba.render(mitsuba.load_dict(scene), spp=4).array) / 48) < 1.1
"""


@cache
def variant() -> str | None:
    """Return the fastest Mitsuba variant that works here (LLVM, else scalar); None if neither does."""
    for name in (LLVM, SCALAR):
        try:
            probe = subprocess.run([sys.executable, "-c", PROBE, name], capture_output=True, timeout=120, check=False)
        except subprocess.TimeoutExpired:
            continue
        if probe.returncode == 0:
            return name
    return None
