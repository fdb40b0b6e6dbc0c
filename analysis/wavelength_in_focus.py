"""Wavelength in focus for a mixture of red and blue light, if accommodation follows depth, luminance or colour."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient.depth.equalise.patch import vergence_likelihood
from focalgradient.eye import Cones, Eye, SpectralBasis, Target
from focalgradient.eye.chromatic import chromatic_wavelength
from focalgradient.eye.light import Band
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style

SHARES = (0.0, 0.05, 0.15, 0.3, 0.5, 0.7, 0.85, 0.95, 1.0)
"""Fraction of the display's blue light in the mixture, relative to the amounts in the display's white."""

VERGENCE, PUPIL = 2.0, 0.004  # vergence of the target (D), and pupil diameter (m)
FOCUS = np.linspace(-1.4, 0.6, 81)
"""Candidate accommodation (at 580 nm) relative to the target's vergence, in dioptres."""

CPD = np.geomspace(1.0, 20.0, 40)
"""Spatial frequencies (cycles per degree) over which contrast is summed, logarithmically spaced."""

NOISE = 0.1  # noise of the views, relative to their mean
GRID = np.arange(0.0, 4.0001, 0.02)
DEPTH, COLOUR, LUMINANCE = "depth, taken for white", "colour-opponent contrast", "luminance contrast"
BANDS: tuple[Band, ...] = ("L+M", "S")


@dataclass(frozen=True)
class Mixture:
    """Cone excitation by a mixture of red and blue light."""

    share: float

    @property
    def amounts(self) -> tuple[float, float, float]:
        """Amounts of the display's red, green and blue light."""
        return (1 - self.share, 0.0, self.share)

    def cones(self, band: Band, focus: float = VERGENCE) -> Cones:
        """Return the cones of an eye accommodated to `focus` (D, at 580 nm), in this light."""
        light = SpectralBasis.of_display().mixed(band, self.amounts)
        finest = 10.0 if band == "S" else math.inf
        return Cones.in_light(Eye(PUPIL, focus), band, light, wavelengths=11, finest_cpd=finest)

    def contrast(self, band: Band) -> NDArray[np.float64]:
        """Return the band's contrast for a pattern of this light relative to white, at each focus and frequency."""
        caught = float(SpectralBasis.of_display().catch(band) @ np.array(self.amounts))
        seen = self.cones(band)
        return np.asarray(caught * seen.transfer(np.degrees(CPD), VERGENCE - FOCUS[:, None]))


def by_luminance(mixture: Mixture) -> float:
    """Return the focus relative to the target's vergence (D) that maximises the contrast of L and M cones together."""
    return _best(mixture.contrast("L+M"))


def by_colour(mixture: Mixture) -> float:
    """Focus that gives the most contrast of L and M cones against S cones, each relative to white."""
    return _best(mixture.contrast("L+M") - mixture.contrast("S"))


def by_depth(mixture: Mixture, seeds: int = 4) -> float:
    """Focus where an estimate from both bands, all light taken for white, finds the target in focus."""
    misses = []
    for focus in FOCUS[::4]:
        own = [mixture.cones(band, VERGENCE + focus) for band in BANDS]
        white = [
            Cones.of(Eye(PUPIL, VERGENCE + focus), band, finest_cpd=own[n].finest_cpd) for n, band in enumerate(BANDS)
        ]
        found = np.zeros(GRID.size)
        for seed in range(seeds):
            random = np.random.default_rng(seed)
            views = Target(correlation=0.95).views(
                own, VERGENCE, noise=NOISE, random=random, texture=seed, seen_as=white
            )
            found += vergence_likelihood(views, GRID, noise=NOISE, correlation=0.95, wraps=True)
        misses.append(GRID[found.argmax()] - (VERGENCE + focus))
    return _root(FOCUS[::4], np.array(misses))


def _best(contrast: NDArray[np.float64]) -> float:
    """Return the focus with the largest sum of squared contrast."""
    return float(FOCUS[np.sum(contrast**2, axis=1).argmax()])


def _root(focus: NDArray[np.float64], misses: NDArray[np.float64]) -> float:
    """Return the stable focus of accommodation that follows `misses`: their falling zero crossing; NaN if none."""
    falls = np.flatnonzero((misses[:-1] > 0) & (misses[1:] <= 0))
    if not falls.size:
        return math.nan
    at = falls[np.argmin(np.abs(focus[falls]))]
    return float(focus[at] + (focus[at + 1] - focus[at]) * misses[at] / (misses[at] - misses[at + 1]))


RULES = {DEPTH: by_depth, COLOUR: by_colour, LUMINANCE: by_luminance}


def wavelength(focus: float) -> float:
    """Return the wavelength (nm) in focus if the eye accommodates by `focus` (D) more than the target's vergence."""
    return float(chromatic_wavelength(focus)) if math.isfinite(focus) else math.nan


def measure(*, seeds: int = 4, progress: Progress | None = None) -> dict[str, list[float]]:
    """Return the wavelength in focus (nm) by each rule, for each of `SHARES`."""
    found: dict[str, list[float]] = {DEPTH: [], COLOUR: [], LUMINANCE: []}
    for number, share in enumerate(SHARES):
        mixture = Mixture(share)
        found[DEPTH].append(wavelength(by_depth(mixture, seeds)))
        found[COLOUR].append(wavelength(by_colour(mixture)))
        found[LUMINANCE].append(wavelength(by_luminance(mixture)))
        if progress is not None:
            progress((number + 1) / len(SHARES))
    return found


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    found = measure(seeds=12 if full else 4, progress=progress)
    return Shown(
        title="The wavelength in focus of a mixture of red and blue light",
        caption=(
            f"Predicted, of a simulated eye (pupil {1e3 * PUPIL:g} mm): a pattern in a mixture of a display's red and "
            "blue light lies at one distance. Accommodation leaves one wavelength in focus: the one where the estimate "
            "of depth from L+M and S cones, which takes all light for white, equals the eye's own focus; the one that "
            "gives L and M cones the most contrast (luminance); or the one that gives the most contrast of L and M "
            "against S cones, each over its response to white (colour-opponent). An estimate that knows the spectrum "
            "leaves 580 nm in focus, whatever the mixture. Of several foci at which estimates settle, the nearest to "
            "the target is taken.",
            "Chin et al. measured accommodation to lights of many compositions and found it guided by a colour-"
            "opponent channel rather than by acuity. Their abstract alone was read; the mixtures, the channel's "
            "weights and its frequencies here are our choices, and none was fitted.",
        ),
        figure=_draw(found),
        summary={
            f"wavelength_nm, {name}": {f"blue {s:g}": v for s, v in zip(SHARES, values, strict=True)}
            for name, values in found.items()
        },
        plotted={"blue_share": SHARES} | found,
    )


def _draw(found: dict[str, list[float]]) -> Figure:
    looks = {DEPTH: (BLUE, "o"), COLOUR: (ORANGE, "s"), LUMINANCE: ("black", "^")}
    with style():
        figure = new_figure(110, 75, layout="constrained")
        ax = figure.subplots()
        ax.axhline(580, color=GREY, linestyle="--", linewidth=0.8, label="depth, spectrum known")
        for name, (colour, marker) in looks.items():
            ax.plot(SHARES, found[name], color=colour, marker=marker, markersize=4, label=name)
        ax.set(xlabel="blue light in the mixture (share of white's)", ylabel="wavelength in focus (nm), predicted")
        ax.set_ylim(425, 665)
        ax.legend(fontsize=6, loc="upper right")
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("wavelength_in_focus", make)
