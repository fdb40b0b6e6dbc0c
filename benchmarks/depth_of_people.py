"""Depth of walls from what eyes with measured aberrations see: own optics known, or a mean eye's assumed.

    python benchmarks/depth_of_people.py [--eyes N] [FOLDER]

FOLDER holds mean_6mm.csv and covariance_6mm.csv of a population's Zernike coefficients (micrometres, in the OSA's
order, over 6 mm), as Thibos, Bradley & Hong (2002) give them. Without it a population of our own choice stands in:
independent coefficients about 0, of standard deviations that fall by half with each radial order.

Three walls in two kinds of views for an eye and a pupil, each by own and by mean optics: about a minute and a half of
processor time an eye.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from focalgradient import View, recover_depth
from focalgradient.eye import Eye, Oscillation, ZernikePopulation, accommodation_views, band_views, osa_order, score

PIXEL = np.radians(1 / 60)
FOCUS, SHAPE = 2.0, (112, 112)
PUPILS = (0.003, 0.005)
BEYOND = (-0.5, 0.3, 0.8)
"""Dioptres of the walls beyond focus."""


def population(folder: Path | None) -> ZernikePopulation:
    """The measured population, or the one that stands in for it."""
    if folder is not None:
        return ZernikePopulation.read(folder / "mean_6mm.csv", folder / "covariance_6mm.csv", 0.006)
    sd = np.array([0.0 if osa_order(j)[0] < 3 else 0.2 * 0.5 ** (osa_order(j)[0] - 3) for j in range(28)])
    return ZernikePopulation(np.zeros(28), np.diag(sd**2), 0.006)


def at_focus(coefficients: Sequence[float], pupil: float) -> Eye:
    """The eye of these coefficients, its lower orders corrected by spectacles, accommodated to FOCUS."""
    corrected = [0.0 if j < 6 else float(value) for j, value in enumerate(coefficients)]
    eye = Eye.from_zernike(corrected, pupil, measured_diameter=0.006)
    return replace(eye, accommodation=eye.accommodation + FOCUS - eye.focus_vergence)


def seen(kind: str, eye: Eye, distance: float, seed: int) -> list[View]:
    """The views of a wall, 1 % noise; bands' textures correlated at 0.95."""
    if kind == "bands":
        rendered = band_views(distance, eye, SHAPE, PIXEL, noise=0.01, correlation=0.95, seed=seed)
    else:
        times, course = [0.125, 0.375], Oscillation()
        rendered = accommodation_views(distance, eye, times, course, SHAPE, PIXEL, noise=0.01, seed=seed)
    return [one.view for one in rendered]


def assumed(views: Sequence[View], eye: Eye) -> list[View]:
    """The views as of another eye's aberrations."""
    other = [replace(v.optics, eye=replace(v.optics.eye, aberrations=eye.aberrations)) for v in views]  # type: ignore
    return [View(view.image, optics, view.pixel_angle) for view, optics in zip(views, other, strict=True)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--eyes", type=int, default=100)
    given = parser.parse_args()
    people = population(given.folder)
    print("pupil  views    optics  valid %  median error D  side right %   (medians over eyes and walls)", flush=True)
    for pupil in PUPILS:
        mean = at_focus(np.asarray(people.mean_um, float).tolist(), pupil)
        for kind in ("bands", "moments"):
            found: dict[str, list[dict[str, float]]] = {"own": [], "mean": []}
            for number in range(given.eyes):
                eye = at_focus(people.drawn(np.random.default_rng([1, number])).tolist(), pupil)
                for beyond in BEYOND:
                    distance = 1 / (FOCUS - beyond)
                    views = seen(kind, eye, distance, number)
                    for name, some in (("own", views), ("mean", assumed(views, mean))):
                        depth = recover_depth(some, near=0.3)
                        found[name].append(score(depth.vergence, depth.valid, np.full(SHAPE, distance), FOCUS))
            for name, scores in found.items():
                valid = 100 * np.median([one["valid"] for one in scores])
                error, side = (
                    np.median([one[key] for one in scores if one["valid"] > 0] or [np.nan])
                    for key in ("median_error_D", "side_right")
                )
                print(
                    f"{1e3 * pupil:g} mm   {kind:8} {name:6} {valid:7.0f} {error:14.3f} {100 * side:13.1f}", flush=True
                )


if __name__ == "__main__":
    main()
