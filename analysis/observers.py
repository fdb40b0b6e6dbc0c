"""What a simulated observer sees: blur read from a picture beside the true blur, and the depth that it makes of it."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient.display import Display
from focalgradient.observers import OBSERVERS, EncodedStimulus, encode, perceived_depth, relief
from focalgradient.observers.perception import READ_PER_RADIUS
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style
from focalgradient.stimuli import StimulusSet, make_depth_rating

APERTURES = ("pinhole", "f/22", "f/11", "f/5.6")
FIXATIONS = ("nearest", "farthest")
GLANCES = 20
MOST_BLUR, MOST_DEPTH = 10.0, 0.4  # arcmin, D: ends of the scales of colour


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """A picture, what is true of it and what is seen in it; maps are rows x columns of places."""

    pixels: NDArray[np.uint8]
    fixation: tuple[float, float]
    look: EncodedStimulus
    shape: tuple[int, int]
    true_blur: NDArray[np.float64]
    read_blur: NDArray[np.float64]
    depth: NDArray[np.float64]


def see(stimuli: StimulusSet, aperture: str, fixation: str) -> Seen:
    """EncodedStimulus at a picture of a set's first scene, as the default observer does."""
    name = stimuli.scenes[0]
    picture, scene = stimuli.picture(name, aperture, fixation), stimuli.scene(name)
    target = scene.nearest if fixation == "nearest" else scene.farthest
    pixels = stimuli.pixels(picture)
    (look,) = encode(pixels, stimuli.display, [target.position_px], stimuli.depth(name))
    columns = round(np.sqrt(look.blur.size * pixels.shape[1] / pixels.shape[0]))
    shape = (look.blur.size // columns, columns)
    # The disc in the picture, from dioptres through the camera's pixels to arcmin on the display.
    radius = 0.5e-3 * picture.aperture_mm * np.abs(look.depth) / stimuli.manifest["parameters"]["pixel_angle_rad"]
    beyond = np.sqrt(np.maximum(look.blur**2 - look.fixated_blur**2, 0))
    depth = np.mean([perceived_depth(look, OBSERVERS["default"], np.random.default_rng(n)) for n in range(GLANCES)], 0)
    return Seen(
        pixels,
        target.position_px,
        look,
        shape,
        READ_PER_RADIUS * stimuli.display.arcmin(1.0) * radius.reshape(shape),
        beyond.reshape(shape),
        depth.reshape(shape),
    )


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    report = progress or (lambda share: None)
    with tempfile.TemporaryDirectory() as folder:
        how = {"size": 512, "samples": 256} if full else {"size": 256, "samples": 64, "engine": "cast"}
        display = Display(pixel_pitch=(0.25e-3 if full else 0.5e-3))
        stimuli = make_depth_rating(
            Path(folder), scenes=1, display=display, progress=lambda share, what: report(0.8 * share), **how
        )
        seen = {(f, end): see(stimuli, f, end) for end in FIXATIONS for f in APERTURES}
    report(0.9)
    increase = {
        name: {
            end: [
                float(np.mean([relief(seen[f, end].look, observer, np.random.default_rng(n)) for n in range(GLANCES)]))
                for f in APERTURES
            ]
            for end in FIXATIONS
        }
        for name, observer in OBSERVERS.items()
        if name in ("default", "blind", "opposite")
    }
    ratios = {
        name: {end: (np.array(values) / values[0]).tolist() for end, values in ends.items()}
        for name, ends in increase.items()
    }
    wide = {end: seen["f/5.6", end] for end in FIXATIONS}
    return Shown(
        title="What a simulated observer sees",
        caption=(
            "A picture taken at f/5.6, above with the nearest and below with the farthest object in focus (cross). "
            "True blur: from the depth of the scene and the aperture, which the observer is not told. Blur as "
            "read: from the picture’s pixels, through the eye’s own optics, by how much more the texture and the edges "
            "of a place are blurred than those of the fixated object.",
            "Perceived depth: dioptres by which a place encoded_stimuli farther than the fixated object. With the nearest "
            "object in focus what is more blurred is farther, as the observer takes it to be, and blur adds to the "
            "depth that the layout tells. With the farthest in focus the same belief puts the near things far: "
            "against the layout, so that blur is discounted and the depth is the layout’s alone.",
            "Right: how deep the picture encoded_stimuli, relative to the pinhole’s, to the default observer (filled), to one "
            "blind to blur (crosses), and to one that takes blurred for near (open). Simulated observers, without the "
            "noise of answers.",
        ),
        figure=_draw(wide, ratios),
        summary={
            f"correlation_of_blur_read_with_true_{end}": float(
                np.corrcoef(one.true_blur.ravel(), one.read_blur.ravel())[0, 1]
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
                for what in ("true_blur", "read_blur", "depth")
            },
        },
    )


def _draw(wide: dict[str, Seen], ratios: dict[str, dict[str, list[float]]]) -> Figure:
    with style():
        figure = new_figure(180, 78, layout="constrained")
        panels = figure.subplots(2, 5, gridspec_kw={"width_ratios": [1, 1, 1, 1, 1.15]})
        for row, (end, one) in enumerate(wide.items()):
            maps = (one.true_blur, one.read_blur, one.depth)
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
            for name, marker, colour in (("blind", "x", GREY), ("opposite", "o", ORANGE), ("default", "o", BLUE)):
                fill = "full" if name == "default" else "none"
                ax.plot(ratios[name][end], marker + "-", color=colour, fillstyle=fill, markersize=4, lw=1, label=name)
            ax.set(ylim=(0.8, 3), xticks=range(4), xlim=(-0.3, 3.3))
            ax.set_xticklabels(["pin-\nhole", "f/22", "f/11", "f/5.6"] if row else [])
        for ax, title in zip(
            panels[0],
            ("Picture at f/5.6", "True blur", "As read (arcmin)", "Perceived (D)", "Increase in depth"),
            strict=True,
        ):
            ax.set_title(title)
        panels[0, 4].legend(loc="upper left", fontsize=7, handlelength=1.5)
        panels[1, 4].text(0.03, 0.93, "simulated observers", transform=panels[1, 4].transAxes, color=GREY, va="top")
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("observers", make)
