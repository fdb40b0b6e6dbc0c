"""Pictures of the depth-rating experiment: one scene in all conditions, and the controlled variables."""

from __future__ import annotations

import tempfile
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from report import Progress, Shown, alone

from focalgradient.plotting import BLUE, GREEN, GREY, ORANGE, new_figure, style
from focalgradient.plotting.contact_sheet import draw_picture
from focalgradient.render.mitsuba_backend import variant
from focalgradient.stimuli import APERTURES, FIXATIONS, StimulusSet, make_depth_rating

SEED = 1
COLOURS = {"f/22": GREEN, "f/11": BLUE, "f/5.6": ORANGE}
MARKERS = {"nearest": "o", "farthest": "s"}
SCENE = "spheres-00"


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    size, samples = (512, 256) if full else (160, 25)
    engine: Literal["path", "cast"] = "path" if variant() else "cast"
    with tempfile.TemporaryDirectory() as folder:
        made = make_depth_rating(
            folder,
            seed=SEED,
            scenes=1,
            size=size,
            samples=samples,
            engine=engine,
            progress=lambda share, what: report(0.95 * share),
        )
        figure = _draw(made)
    controls = made.manifest["controls"]
    shown = made.scene(SCENE)
    ratios = {stem: one["spectrum"] for stem, one in controls["scenes"][SCENE]["pictures"].items() if stem != "pinhole"}
    largest = {end: made.picture(SCENE, "f/5.6", end).blur_arcmin[1] for end in FIXATIONS}
    natural = "Natural scenes" if engine == "path" else "Scenes of plain spheres"
    return Shown(
        title="Pictures for judging depth",
        caption=(
            f"{natural}, rendered through a pinhole and three apertures of a 50 mm lens, with the nearest or the "
            "farthest object in focus (rings): one of the scenes of the experiment. Camera, exposure and light are the "
            "same in all pictures; only the blur differs.",
            f"Below, left: diameter of the blur disc on a display seen from {made.display.distance:g} m, by distance, "
            "from the nearest object (circle) to the farthest (square).",
            "Below, right: how far blur alone accounts for the pictures. The pinhole picture was blurred by tracing a "
            "lens’s rays through the relief of its depth, and amplitudes of the rendered pictures were divided by "
            "those of this prediction, in octaves of spatial frequency, noise taken out. The prediction "
            "lacks what an edge hides from the pinhole. The band is the limit within which a set is called controlled.",
        ),
        figure=figure,
        summary={
            "distance_of_the_nearest_and_the_farthest_object_m": [shown.nearest.distance_m, shown.farthest.distance_m],
            "largest_blur_at_f5.6_nearest_in_focus_arcmin": largest["nearest"],
            "largest_blur_at_f5.6_farthest_in_focus_arcmin": largest["farthest"],
            "largest_change_of_mean_luminance_percent": controls["mean_luminance_percent"]["worst"],
            "largest_shift_against_the_prediction_px": controls["shift_px"]["worst"],
            "largest_difference_of_amplitude_from_the_prediction_percent": controls["spectrum_percent"]["worst"],
            "noise_in_steps_of_8_bits": controls["noise_steps"]["worst"],
            "limit_of_noise_in_steps_of_8_bits": controls["noise_steps"]["limit"],
            "controls_not_met": ", ".join(name for name, one in _controls(made).items() if not one["met"]) or "none",
        },
        plotted={"amplitude_over_predicted": ratios},
    )


def _controls(made: StimulusSet) -> dict[str, dict[str, Any]]:
    """Return the controlled variables of the set, each with its worst value, its limit, and whether that is met."""
    return {name: one for name, one in made.manifest["controls"].items() if isinstance(one, dict) and "met" in one}


def _draw(made: StimulusSet) -> Figure:
    with style():
        figure = new_figure(180, 158, layout="constrained")
        grid = figure.add_gridspec(2, 1, height_ratios=(100, 58))
        above, below = figure.add_subfigure(grid[0]), figure.add_subfigure(grid[1])
        panels = above.subplots(2, len(APERTURES))
        for row, end in zip(panels, FIXATIONS, strict=True):
            place = made.scene(SCENE).target(end).position_px
            for ax, aperture in zip(row, APERTURES, strict=True):
                draw_picture(ax, made.pixels(made.picture(SCENE, aperture, end)), [place])
            row[0].set_ylabel(f"{end} in focus")
        for ax, aperture in zip(panels[0], APERTURES, strict=True):
            ax.set_title(aperture)
        left, right = below.subplots(1, 2)
        _blur(left, made)
        _amplitude(right, made)
        figure.draw_without_rendering()
    return figure


def _blur(ax: Axes, made: StimulusSet) -> Axes:
    """Draw blur on the display by distance."""
    shown = made.scene(SCENE)
    ends = shown.nearest.distance_m, shown.farthest.distance_m
    distance = np.geomspace(*ends, 200)
    pixel_angle = made.manifest["parameters"]["pixel_angle_rad"]
    for aperture, colour in COLOURS.items():
        for end, line in (("nearest", "-"), ("farthest", (0, (3, 2)))):
            one = made.picture(SCENE, aperture, end)
            pixels = one.aperture_mm * 1e-3 * np.abs(1 / one.focus_m - 1 / distance) / pixel_angle
            blur = made.display.arcmin(1.0) * pixels
            ax.plot(distance, blur, color=colour, linestyle=line)
            ax.plot([one.focus_m], [0], MARKERS[end], color=GREY, markersize=4, clip_on=False)
            if end == "nearest":
                ax.text(1.06 * ends[1], blur[-1], aperture, color=colour, va="center", clip_on=False)
    ax.set(xscale="log", xlim=ends, ylim=(0, None), xlabel="distance (m)", ylabel="blur on the display (arcmin)")
    ticks = [tick for tick in (0.5, 0.7, 1, 1.5, 2, 3, 4, 5) if ends[0] <= tick <= ends[1]]
    ax.set_xticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    ax.set_xticks([], minor=True)
    ax.set_title("Solid: nearest in focus; dashed: farthest")
    return ax


def _amplitude(ax: Axes, made: StimulusSet) -> Axes:
    """Draw the ratio of measured to predicted amplitudes by spatial frequency on the display."""
    controls = made.manifest["controls"]
    limit = controls["spectrum_percent"]["limit"] / 100
    ax.axhspan(1 - limit, 1 + limit, color="#e8e8e8", linewidth=0, zorder=0)
    ax.axhline(1, color=GREY, linewidth=0.7, zorder=0)
    for aperture, colour in COLOURS.items():
        for end, marker in MARKERS.items():
            ratio = controls["scenes"][SCENE]["pictures"][f"{aperture.replace('/', '')}-{end}"]["spectrum"]
            # centre of each octave, from half a cycle per pixel down
            frequency = made.display.pixels_per_degree * 0.5 / 2 ** (np.arange(len(ratio)) + 0.5)
            label = f"{aperture}, {end}"
            ax.plot(frequency, ratio, marker=marker, color=colour, markersize=4, linewidth=0.8, label=label)
    ax.set(xscale="log", ylim=(0.8, 1.2), xlabel="cycles per degree on the display")
    ax.set_ylabel("amplitude / predicted")
    ax.minorticks_off()
    ax.set_xticks(frequency, labels=[f"{one:.2g}" for one in frequency])
    ax.set_title("The blur accounts for the spectra")
    noise = controls["noise_steps"]
    ax.text(
        *(0.02, 0.97, f"noise: {noise['worst']:.2g} steps of 8 bits, limit {noise['limit']:g}"),
        transform=ax.transAxes,
        va="top",
        color=GREY if noise["met"] else ORANGE,
    )
    if not noise["met"]:
        ax.text(0.02, 0.89, "NOT met: few rays, for a quick figure", transform=ax.transAxes, va="top", color=ORANGE)
    ax.legend(ncols=2, loc="lower center", fontsize=6.5, columnspacing=1.0)
    return ax


if __name__ == "__main__":
    alone("stimulus_sheet", make)
