"""Stimuli that give a flat display the retinal image of real depth, and the accuracy of that image."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient.eye import ChromaticStimulus, Eye, chromatic_stimulus
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style

SIDE, PIXEL, SCREEN = 96, np.radians(1 / 60), 1.0
BEYOND = (-1.0, -0.5, 0.0, 0.5, 0.9)
"""Vergence of the scene relative to the display, in dioptres beyond it."""

CONES = ("L", "M", "S")


def picture() -> NDArray[np.float64]:
    """Return white and coloured letter bars on a natural texture."""
    random = np.random.default_rng(1)
    radius = np.hypot(np.fft.fftfreq(SIDE)[:, None], np.fft.fftfreq(SIDE))
    radius[0, 0] = 1
    texture = np.fft.ifft2(np.fft.fft2(random.standard_normal((SIDE, SIDE))) / radius).real
    image = np.repeat((0.45 + 0.12 * texture / texture.std())[..., None], 3, axis=2)
    for number, colour in enumerate(((0.9, 0.9, 0.9), (0.05, 0.05, 0.05), (0.9, 0.3, 0.2), (0.2, 0.4, 0.9))):
        image[12:84, 12 + 20 * number : 20 + 20 * number] = colour
    return np.clip(image, 0, 1)


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    eye = Eye(0.004, 1 / SCREEN)
    found = []
    for number, beyond in enumerate(BEYOND):
        distance = np.full((SIDE, SIDE), 1 / (1 / SCREEN - beyond))
        found.append(chromatic_stimulus(picture(), distance, eye, screen=SCREEN, pixel_angle=PIXEL))
        if progress is not None:
            progress((number + 1) / len(BEYOND))
    residuals = {name: [list(getattr(one, name)) for one in found] for name in ("residual", "scene_shown", "alike")}
    return Shown(
        title="What to show for the retinal image of real depth",
        caption=(
            "A display at 1 m, on which an eye (pupil 4 mm) is focused, and a scene nearer or beyond it. Above: what "
            "the display must show (`eye.chromatic_stimulus`). Below: the root mean square of the remaining "
            "difference between the retinal images, of that and of two simpler pictures, as a share of white. L and M "
            "cones get the scene's image to half a hundredth of white or better. S cones cannot get that of things "
            "nearer than the display, as the eye blurs the display's blue more than the scene's.",
        ),
        figure=_draw(found, residuals),
        summary={"residual": {f"{x:+g} D": one.residual for x, one in zip(BEYOND, found, strict=True)}},
        plotted={"beyond_D": list(BEYOND), **residuals},
    )


def _draw(found: list[ChromaticStimulus], residuals: dict[str, list[list[float]]]) -> Figure:
    looks = {
        "residual": (BLUE, "o", "found"),
        "scene_shown": (ORANGE, "s", "the scene's retinal image"),
        "alike": (GREY, "^", "blur alike in all colours"),
    }
    with style():
        figure = new_figure(180, 105)
        grid = figure.add_gridspec(
            2, 15, height_ratios=(1, 1.2), hspace=0.35, top=0.93, left=0.08, right=0.98, bottom=0.13
        )
        for number, (beyond, one) in enumerate(zip(BEYOND, found, strict=True)):
            ax = figure.add_subplot(grid[0, 3 * number : 3 * number + 3])
            ax.imshow(np.clip(one.shown, 0, 1) ** (1 / 2.2), interpolation="nearest")
            ax.set(xticks=[], yticks=[])
            ax.set_title(
                f"{abs(beyond):g} D {'beyond' if beyond > 0 else 'nearer'}" if beyond else "at the display", fontsize=8
            )
        axes = [figure.add_subplot(grid[1, 5 * n : 5 * n + 4]) for n in range(3)]
        for n, (ax, cone) in enumerate(zip(axes, CONES, strict=True)):
            for name, (colour, mark, words) in looks.items():
                ax.plot(BEYOND, np.array(residuals[name])[:, n], color=colour, marker=mark, markersize=4, label=words)
            ax.set(
                yscale="log",
                ylim=(2e-5, 0.3),
                xticks=(-1, -0.5, 0, 0.5, 1),
                title=f"{cone} cones",
                xlabel="scene beyond the display (D)",
            )
        axes[0].set_ylabel("residual (share of white)")
        axes[0].legend(fontsize=6, loc="lower left")
    return figure


if __name__ == "__main__":
    alone("chromatic_stimuli", make)
