"""How often f-numbers in the opposite order are noticed, and right ones doubted, in pairs of photographs of one focus.

python benchmarks/aperture_order.py SMALL.jpg LARGE.jpg [SMALL.jpg LARGE.jpg ...]

Each pair is given the photograph of the smaller aperture first, and is taken for f/8 and f/2.8 at 35 mm, focused at
1.57 m. A row states whether the order is contradicted as stated and reversed, and the same with aligned views.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

from photographs import photographed

from focalgradient import Lens
from focalgradient.depth.hypotheses import misordered_apertures
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.search import Search
from focalgradient.psf import Disc

LENSES = [Lens(0.035, number, 1.57) for number in (8, 2.8)]


def main() -> None:
    warnings.simplefilter("ignore")
    paths = [Path(name) for name in sys.argv[1:]]
    counts = [0, 0, 0, 0]
    for pair in zip(paths[::2], paths[1::2], strict=True):
        contradicted = []
        for align in (False, True):
            for lenses in (LENSES, LENSES[::-1]):
                views = photographed(pair, lenses, 36e-6, "srgb")
                search = Search.over(lenses, views[0].pixel_angle, None, None, Disc())
                contradicted.append(misordered_apertures(RegisteredViews.of(views, align), search) is not None)
        counts = [count + one for count, one in zip(counts, contradicted, strict=True)]
        print(
            f"{pair[0]}: stated {contradicted[0]}, reversed {contradicted[1]}; aligned {contradicted[2:]}", flush=True
        )
    print(f"{len(paths) // 2} pairs: stated {counts[0]} and {counts[2]}, reversed {counts[1]} and {counts[3]}")


if __name__ == "__main__":
    main()
