"""Red and blue surfaces at one distance: what an eye that knows the spectrum reports, and one that does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient import View, recover_depth
from focalgradient.eye import (
    Cones,
    Eye,
    Oscillation,
    Photons,
    SpectralBasis,
    SpectralPicture,
    accommodation_views,
    band_views,
)
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style

SIDE, PIXEL, LIGHT = 112, np.radians(1 / 60), 200.0
VERGENCE, EYE = 1.6, Eye(0.004, 1.0)
COLOURS = (
    ("red", (0.75, 0.01, 0.01)),
    ("orange", (0.60, 0.25, 0.05)),
    ("grey", (0.40, 0.40, 0.40)),
    ("green", (0.10, 0.40, 0.10)),
    ("sky", (0.18, 0.30, 0.55)),
    ("blue", (0.005, 0.005, 0.75)),
)
"""Reflectance of the surfaces in linear sRGB."""

KINDS = ("moments", "bands")
KNOWN, WHITE = "spectrum estimated", "taken for white"


def texture(seed: int) -> NDArray[np.float64]:
    """A natural texture of mean 1."""
    radial = np.hypot(np.fft.fftfreq(SIDE)[:, None], np.fft.rfftfreq(SIDE))
    radial[0, 0] = np.inf
    white = np.fft.rfft2(np.random.default_rng(seed).standard_normal((SIDE, SIDE)))
    field = np.fft.irfft2(np.where(radial < 0.5, white, 0) / radial, (SIDE, SIDE))
    return np.asarray(1 + 0.2 * field / field.std())


def seen(kind: str, colour: tuple[float, ...], seed: int) -> list[View]:
    """What an eye sees of a surface."""
    picture = SpectralPicture.of_srgb(texture(seed)[..., None] * np.array(colour))
    scene, noise = (picture, np.full((SIDE, SIDE), 1 / VERGENCE)), Photons(LIGHT)
    if kind == "bands":
        rendered = band_views(scene, EYE, (SIDE, SIDE), PIXEL, noise=noise, seed=seed)
    else:
        course = Oscillation()
        rendered = accommodation_views(scene, EYE, (0.125, 0.375), course, (SIDE, SIDE), PIXEL, noise=noise, seed=seed)
    return [one.view for one in rendered]


def as_white(view: View) -> View:
    """The view as of a white surface."""
    cones = view.optics
    assert isinstance(cones, Cones)
    white = Cones.of(cones.eye, "S" if cones.light == "S" else "L+M", finest_cpd=cones.finest_cpd)
    return replace(view, optics=white)


def reported(views: list[View]) -> tuple[float, float]:
    """Median of the depth that is claimed (D, nearer than the surface), and of its standard deviation; else nan."""
    depth = recover_depth(views)
    if depth.valid.mean() < 0.05:
        return float("nan"), float("nan")
    return float(np.median(depth.vergence[depth.valid]) - VERGENCE), float(np.median(depth.vergence_sd[depth.valid]))


def _mean(values: list[float]) -> float:
    """Mean of the claimed values; nan if there are none."""
    claimed = [value for value in values if np.isfinite(value)]
    return float(np.mean(claimed)) if claimed else float("nan")


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    basis = SpectralBasis.of_srgb()
    focus = [basis.mixed("L+M", colour).difference() for _, colour in COLOURS]
    seeds = range(4 if full else 1)
    found: dict[str, dict[str, list[float]]] = {kind: {KNOWN: [], WHITE: []} for kind in KINDS}
    for number, (kind, (_, colour)) in enumerate((kind, one) for kind in KINDS for one in COLOURS):
        pairs = [(views, [as_white(view) for view in views]) for views in (seen(kind, colour, seed) for seed in seeds)]
        for name, each in ((KNOWN, [a for a, _ in pairs]), (WHITE, [b for _, b in pairs])):
            found[kind][name].append(_mean([reported(views)[0] for views in each]))
        if progress is not None:
            progress((number + 1) / (len(KINDS) * len(COLOURS)))
    span = max(focus) - min(focus)
    return Shown(
        title="Colour and depth: what an eye must know of the spectrum",
        caption=(
            f"Simulated: surfaces of one natural texture in six colours, all at {VERGENCE:g} D (D65, pupil 4 mm, 200 "
            "cd/m^2). Above: accommodation (at 580 nm, over the surface's vergence) of an eye that brings the contrast "
            f"of its L and M cones into focus: it differs by {span:.2f} D between red and blue. An eye that "
            "accommodates by depth, corrected for the spectrum, does not differ (dashed).",
            "Below: depth that the views give, nearer than the surface, of an eye focused at 1 D. An eye that takes "
            "all surfaces for white sees red ones nearer and blue ones farther; where it claims nothing, as its views "
            "contradict its optics, there is no mark. An eye that estimates the spectrum from the contrast of its own "
            "cones sees all at one depth. "
            "People's depth order of red and blue textures at one distance, with one eye and accommodation free, "
            "decides between the two: to be registered before it is measured.",
        ),
        figure=_draw(focus, found),
        summary={
            "accommodation_red_minus_blue_D": span,
            "reported_red_minus_blue_D": {
                f"{kind}, {name}": found[kind][name][0] - found[kind][name][-1]
                for kind in KINDS
                for name in found[kind]
            },
        },
        plotted={"colours": [name for name, _ in COLOURS], "accommodation_D": focus, "reported_D": found},
    )


def _draw(focus: list[float], found: dict[str, dict[str, list[float]]]) -> Figure:
    places = np.arange(len(COLOURS))
    looks = {KNOWN: (BLUE, "o"), WHITE: (ORANGE, "s")}
    swatches = [np.clip(np.array(colour) ** (1 / 2.2), 0, 1) for _, colour in COLOURS]
    with style():
        figure = new_figure(180, 110)
        grid = figure.add_gridspec(
            2, 2, height_ratios=(1, 1.3), hspace=0.45, left=0.1, right=0.98, top=0.93, bottom=0.1
        )
        above = figure.add_subplot(grid[0, :])
        above.axhline(0, color=GREY, linestyle="--", linewidth=0.8)
        above.plot(places, focus, color=GREY, linewidth=0.8, zorder=1)
        above.scatter(places, focus, c=swatches, s=60, edgecolor="black", linewidth=0.5, zorder=2)
        above.set(ylabel="response - demand (D)", title="Accommodation that focuses the L and M cones (predicted)")
        for number, kind in enumerate(KINDS):
            ax = figure.add_subplot(grid[1, number])
            ax.axhline(0, color=GREY, linestyle="--", linewidth=0.8)
            for name, (colour, marker) in looks.items():
                ax.plot(places, found[kind][name], color=colour, marker=marker, markersize=4, label=name)
            title = "two moments, L+M cones" if kind == "moments" else "L+M against S cones"
            ax.set(title=f"Depth by {title} (simulated)", ylim=(-0.6, 0.4))
            if number == 0:
                ax.set_ylabel("reported - true vergence (D)")
                ax.legend(fontsize=6, loc="lower left")
        for ax in figure.axes:
            ax.set_xticks(places, [name for name, _ in COLOURS], fontsize=6)
    return figure


if __name__ == "__main__":
    alone("colour_and_depth", make)
