"""The image in the eyes of different people against the distance of what they look at."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from report import Progress, Shown, alone

from focalgradient.eye import Cones, Eye, ZonedLens, image_quality, off_axis, typical_aberrations
from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style

PUPIL = 0.004
"""Diameter of every pupil in metres."""

YOUNG, OLD = 25.0, 60.0
"""Ages in years of the eyes that accommodate and of the presbyopic ones."""

SHOWN = (0.0, 1.0, 2.5)
"""Vergences in dioptres of the points whose spread is drawn."""

CPD = 8.0
"""Spatial frequency in cycles per degree of the modulation transfer that is drawn."""

SIDE, MINUTES = 128, 0.25
"""Pixels across a point spread, and minutes of arc of each."""

GAP = 0.02
"""Distance in dioptres of the two vergences at which an eye's quality is computed: the first is the one that counts."""

person = partial(Eye, PUPIL)


@dataclass(frozen=True)
class Subject:
    """An eye by name: `looking` gives it as it accommodates, within its range, to a vergence in dioptres."""

    name: str
    looking: Callable[[float], Eye]


def _worn(vergence: float) -> Eye:
    return person(refraction="-2.00", age=YOUNG, looking_at=vergence, correction="spectacles")


def _bifocal(vergence: float) -> Eye:
    lens = ZonedLens((0.002, 0.008), (2.5, 0.0))
    return person(age=OLD, looking_at=vergence, lens=lens)


def _typical(vergence: float) -> Eye:
    return person(age=YOUNG, looking_at=vergence, aberrations=typical_aberrations(PUPIL))


SUBJECTS = (
    Subject("emmetrope, 25 years", lambda vergence: person(age=YOUNG, looking_at=vergence)),
    Subject("typical aberrations", _typical),
    Subject("myope, −2 D, uncorrected", lambda vergence: person(refraction="-2.00", age=YOUNG, looking_at=vergence)),
    Subject("myope, in spectacles", _worn),
    Subject(
        "astigmat, −1.50 × 30", lambda vergence: person(refraction="plano -1.50 x 30", age=YOUNG, looking_at=vergence)
    ),
    Subject("presbyope, 60 years", lambda vergence: person(age=OLD, looking_at=vergence)),
    Subject("60 years, bifocal +2.5 D", _bifocal),
    Subject(
        "emmetrope, 20° nasal field",
        lambda vergence: off_axis(person(age=YOUNG, looking_at=vergence), 20.0, "nasal", coma=True),
    ),
)


def seen(subject: Subject, vergence: float) -> Cones:
    """Return the optics of an eye that accommodates to `vergence` (D), weighted by luminance in daylight."""
    return Cones.of(subject.looking(vergence), "luminance")


def quality(subject: Subject, vergences: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the visual Strehl ratio and the modulation transfer at `CPD` of targets at each of `vergences` (D)."""
    found = [image_quality(seen(subject, v), [v, v + GAP], [CPD]) for v in vergences.tolist()]
    return np.array([one.visual_strehl[0] for one in found]), np.array([one.mtf[0, 0] for one in found])


def point_spread(subject: Subject, vergence: float) -> NDArray[np.float64]:
    """Return the image of a point at `vergence` (D) over SIDE x SIDE pixels, with a sum of 1."""
    step = math.radians(MINUTES / 60)
    down, right = np.fft.fftfreq(SIDE, step)[:, None], np.fft.rfftfreq(SIDE, step)[None]
    return np.fft.fftshift(np.fft.irfft2(seen(subject, vergence).optical_transfer(down, right, vergence), (SIDE, SIDE)))


def make(*, full: bool = False, progress: Progress | None = None) -> Shown:
    vergences = np.asarray(np.arange(0, 4.001, 0.125 if full else 0.5), dtype=np.float64)
    strehl, modulation, spreads = {}, {}, {}
    for number, subject in enumerate(SUBJECTS):
        strehl[subject.name], modulation[subject.name] = quality(subject, vergences)
        spreads[subject.name] = [point_spread(subject, vergence) for vergence in SHOWN]
        if progress is not None:
            progress((number + 1) / len(SUBJECTS))
    return Shown(
        title="The image in different people's eyes",
        caption=(
            f"Simulated eyes with a pupil of {1e3 * PUPIL:g} mm in daylight. Each accommodates to what it looks at, as "
            f"far as its age ({YOUNG:g}, or {OLD:g} years for the presbyopic eyes) and its refraction let it. Left: "
            "image of a point at three distances (square root of the light, each with its own maximum). Right: visual "
            f"Strehl ratio, and modulation transfer at {CPD:g} cycles per degree averaged over all directions, against "
            "the vergence of the target.",
            "The uncorrected myope sees well only nearer than 0.5 m, and the presbyope only far away. The bifocal lens "
            "has 2.5 D more in its inner 2 mm: it gives two distances, each at a lower quality.",
        ),
        figure=draw(vergences, strehl, modulation, spreads),
        summary={
            f"visual Strehl ratio at {v:g} D": {
                name: float(np.interp(v, vergences, one)) for name, one in strehl.items()
            }
            for v in SHOWN
        },
        plotted={"vergence_D": vergences, "visual_strehl": strehl, f"mtf_{CPD:g}_cpd": modulation},
    )


def draw(
    vergences: NDArray[np.float64],
    strehl: dict[str, NDArray[np.float64]],
    modulation: dict[str, NDArray[np.float64]],
    spreads: dict[str, list[NDArray[np.float64]]],
) -> Figure:
    """Draw a row for each eye: point spreads at `SHOWN`, then quality against the target's vergence (D)."""
    half = SIDE * MINUTES / 2
    with style():
        figure = new_figure(190, 24 * len(strehl) + 14, layout="constrained")
        axes = figure.subplots(len(strehl), len(SHOWN) + 1, width_ratios=[1] * len(SHOWN) + [3])
        for number, (row, name) in enumerate(zip(axes, strehl, strict=True)):
            for ax, vergence, spread in zip(row, SHOWN, spreads[name], strict=False):
                light = np.sqrt(np.clip(spread / spread.max(), 0, 1))
                ax.imshow(light, cmap="gray", extent=(-half, half, half, -half))
                ax.set(xticks=[], yticks=[])
                if not number:
                    ax.set_title("far" if not vergence else f"{100 / vergence:g} cm")
            row[0].set_ylabel(name.replace(", ", "\n"), rotation=0, ha="right", va="center")
            row[-1].plot(vergences, strehl[name], color=BLUE, label="visual Strehl ratio")
            row[-1].plot(vergences, modulation[name], color=ORANGE, label=f"modulation, {CPD:g} c/deg")
            row[-1].set(xlim=(vergences[0], vergences[-1]), ylim=(0, 1), yticks=[0, 0.5, 1])
            if number < len(strehl) - 1:
                row[-1].set_xticklabels([])
        axes[0, -1].legend(loc="lower center", bbox_to_anchor=(0.5, 1), ncols=2, fontsize=6)
        axes[-1, -1].set_xlabel("vergence of the target (D)")
        axes[-1, 0].set_xlabel(f"{2 * half:g} arcmin across")
        figure.suptitle("Simulated eyes: image of a point, and its quality by distance")
        for ax in axes[:, -1]:
            ax.grid(color=GREY, linewidth=0.3)
        figure.draw_without_rendering()
    return figure


if __name__ == "__main__":
    alone("eyes", make)
