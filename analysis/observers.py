"""Percepts of a simulated observer: estimated and true blur of a picture, and depth from blur."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone
from simulated import natural_pictures

from focalgradient.observers import OBSERVERS, EncodedStimulus, Observer, encode, perceived_depth, relief
from focalgradient.observers.perception import SD_PER_RADIUS
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style
from focalgradient.stimuli import StimulusSet

APERTURES = ("pinhole", "f/22", "f/11", "f/5.6")
FIXATIONS = ("nearest", "farthest")
FIXATED_TIMES = 20
SHOWN = ("default", "blur-blind", "opposite")
MOST_BLUR, MOST_DEPTH = 10.0, 0.4  # arcmin, D: ends of the colour scales


@dataclass(frozen=True, slots=True, eq=False)
class Perceived:
    """Picture, ground truth and percept; maps are rows x columns of places."""

    pixels: NDArray[np.uint8]
    fixation: tuple[float, float]
    encoded: EncodedStimulus
    shape: tuple[int, int]
    true_blur: NDArray[np.float64]
    estimated_blur: NDArray[np.float64]
    depth: NDArray[np.float64]


def perceive(stimuli: StimulusSet, aperture: str, fixation: str) -> Perceived:
    """Encode a picture of a set's second scene, and compute the default observer's percept."""
    name = stimuli.scenes[1]
    picture, scene = stimuli.picture(name, aperture, fixation), stimuli.scene(name)
    target = scene.nearest if fixation == "nearest" else scene.farthest
    pixels = stimuli.pixels(picture)
    (encoded,) = encode(pixels, stimuli.display, [target.position_px], stimuli.depth(name))
    columns = round(np.sqrt(encoded.blur.size * pixels.shape[1] / pixels.shape[0]))
    shape = (encoded.blur.size // columns, columns)
    # disc in the picture: from dioptres via the camera's pixels to arcmin on the display
    radius = 0.5e-3 * picture.aperture_mm * np.abs(encoded.depth) / stimuli.manifest["parameters"]["pixel_angle_rad"]
    beyond = np.sqrt(np.maximum(encoded.blur**2 - encoded.fixated_blur**2, 0))
    percepts = [perceived_depth(encoded, OBSERVERS["default"], np.random.default_rng(n)) for n in range(FIXATED_TIMES)]
    return Perceived(
        pixels,
        target.position_px,
        encoded,
        shape,
        SD_PER_RADIUS * stimuli.display.arcmin(1.0) * radius.reshape(shape),
        beyond.reshape(shape),
        np.mean(percepts, axis=0).reshape(shape),
    )


def _increase(seen: Mapping[tuple[str, str], Perceived], observer: Observer) -> dict[str, list[float]]:
    """Return the perceived depth of each picture relative to the pinhole, by fixation and aperture."""
    found = {}
    for end in FIXATIONS:
        depth = [
            np.mean([relief(seen[f, end].encoded, observer, np.random.default_rng(n)) for n in range(FIXATED_TIMES)])
            for f in APERTURES
        ]
        found[end] = (np.array(depth) / depth[0]).tolist()
    return found


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    stimuli = natural_pictures(lambda share, what: report(0.8 * share))
    seen = {(f, end): perceive(stimuli, f, end) for end in FIXATIONS for f in APERTURES}
    report(0.9)
    ratios = {name: _increase(seen, OBSERVERS[name]) for name in OBSERVERS if name in SHOWN}
    wide = {end: seen["f/5.6", end] for end in FIXATIONS}
    return Shown(
        title="What a simulated observer sees",
        caption=(
            "A picture taken at f/5.6, above with the nearest and below with the farthest object in focus (cross). "
            "True blur: from the depth of the scene and the aperture, which the observer does not know. Estimated: "
            "from the picture’s pixels, through the eye’s own optics, by how much more the texture and the edges of a "
            "place are blurred than those of the fixated object.",
            "Perceived depth: dioptres by which a place looks farther than the mean. Its relief is that of the "
            "layout, which is an assumption: it is taken from the true depth of the scene. Its amplitude is perceived: "
            "with the nearest object in focus the observer’s prior takes the more blurred for farther, and blur adds "
            "depth. With the farthest in focus the same prior puts the near things far, against the layout. Such blur "
            "is discounted, which is another assumption; because of it nothing changes there.",
            "Right: how deep the picture looks, relative to the pinhole’s, to the default observer (filled), to a "
            "blur-blind control (crosses), and to one that takes blurred for near (open). Simulated observers, without "
            "the noise of answers.",
        ),
        figure=_draw(wide, ratios),
        summary={
            f"correlation_of_estimated_with_true_blur_{end}": float(
                np.corrcoef(one.true_blur.ravel(), one.estimated_blur.ravel())[0, 1]
            )
            for end, one in wide.items()
        }
        | {
            f"increase_at_f/5.6_{name}_{end}": values[-1]
            for name, ends in ratios.items()
            for end, values in ends.items()
        },
        plotted={
            "aperture": list(APERTURES),
            "increase": ratios,
            **{
                f"{what}_{end}": getattr(one, what)
                for end, one in wide.items()
                for what in ("true_blur", "estimated_blur", "depth")
            },
        },
    )


def _draw(wide: dict[str, Perceived], ratios: dict[str, dict[str, list[float]]]) -> Figure:
    with style():
        figure = new_figure(180, 78, layout="constrained")
        panels = figure.subplots(2, 5, gridspec_kw={"width_ratios": [1, 1, 1, 1, 1.15]})
        for row, (end, one) in enumerate(wide.items()):
            maps = (one.true_blur, one.estimated_blur, one.depth)
            panels[row, 0].imshow(one.pixels)
            panels[row, 0].plot(*one.fixation, "+", color=ORANGE, markersize=7, markeredgewidth=1.2)
            for ax, values in zip(panels[row, 1:4], maps, strict=True):
                depth = values is one.depth
                drawn = ax.imshow(
                    values,
                    cmap="cividis" if depth else "magma",
                    vmin=-MOST_DEPTH if depth else 0,
                    vmax=MOST_DEPTH if depth else MOST_BLUR,
                )
                if ax is not panels[row, 1]:
                    figure.colorbar(drawn, ax=ax, shrink=0.8, aspect=12, extend="both" if depth else "max")
            for ax in panels[row, :4]:
                ax.set(xticks=[], yticks=[])
                ax.spines[:].set_visible(False)
            panels[row, 0].set_ylabel(f"{end} in focus")
            ax = panels[row, 4]
            ax.axhline(1, color=GREY, linewidth=0.6, linestyle=(0, (4, 4)))
            for side, name, marker, colour in (
                *((-0.12, "blur-blind", "x", GREY), (0.12, "opposite", "s", ORANGE), (0.0, "default", "o", BLUE)),
            ):  # side by side, as some coincide
                places = np.arange(len(APERTURES)) + side
                fill = "full" if name == "default" else "none"
                ax.plot(places, ratios[name][end], marker + "-", color=colour, fillstyle=fill, ms=4, lw=0.8, label=name)
            ax.set(ylim=(0.8, 3), xticks=range(4), xlim=(-0.3, 3.3))
            ax.set_xticklabels(["pin-\nhole", "f/22", "f/11", "f/5.6"] if row else [])
        for ax, title in zip(
            panels[0],
            ("Picture at f/5.6", "True (arcmin)", "Estimated (arcmin)", "Perceived (D)", "Increase in depth"),
            strict=True,
        ):
            ax.set_title(title)
        panels[0, 4].legend(loc="upper left", fontsize=7, handlelength=1.5)
        panels[1, 4].text(0.03, 0.93, "simulated observers", transform=panels[1, 4].transAxes, color=GREY, va="top")
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("observers", make)
