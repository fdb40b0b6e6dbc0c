"""Which frames the default method refuses, warns of or claims: sound ones, and ones with a fault; with an ROC curve.

    python benchmarks/refusal.py [--seeds 3]

Flat sheets of natural texture, seen by two apertures or two foci, stored as light or as 8-bit files. Sound frames are
read with their own optics. Of others one thing is wrong that a user may get wrong: frames that must be refused; frames
that may be claimed if the stated uncertainty covers; and frames whose fault a flat sheet cannot show, as it looks the
same as a sheet elsewhere. A row gives, for a kind of frame, how many there are; the share that is refused (less than
1 % of the frame valid), or claimed with a warning; the share of the frames that is claimed; and of what is claimed the
share beyond five stated standard deviations of the truth. The ROC curve moves the share of the texture that the model
must explain for a frame to be claimed: how many of the frames that must be refused are, against how many sound ones.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from photographs import wall
from stored_photographs import LENSES, PIXEL, stored, views

from focalgradient import Lens, View, recover_depth
from focalgradient.depth.equalise.signal import EXPLAINED
from focalgradient.srgb import linear_to_srgb

FOCI = (Lens(0.025, 5.6, 0.85), Lens(0.025, 5.6, 1.4))
REFUSED = 0.01
"""Share of the frame below which a frame counts as refused."""

DISTANCES = (0.95, 1.1, 1.4)


@dataclass(frozen=True)
class Frame:
    """Views of a flat sheet as a user gives them, and its distance."""

    kind: str
    group: Literal["sound", "refuse", "cover", "unseen"]
    views: Sequence[View]
    distance: float
    near: float | None


def shown(images: Sequence[View], optics: Sequence[Lens]) -> list[View]:
    return [replace(view, optics=lens) for view, lens in zip(images, optics, strict=True)]


def shifted(view: View, pixels: int) -> View:
    return replace(view, image=np.roll(view.image, (pixels, pixels), (0, 1)))


def brightened(view: View) -> View:
    """A view whose file was taken for linear, but is sRGB."""
    return replace(view, image=linear_to_srgb(np.clip(view.image, 0, 1)).astype(np.float32))


def again(view: View, seed: int) -> View:
    """The same picture with noise of its own, as a lens whose aperture did not move takes it."""
    noise = np.random.default_rng(seed).standard_normal(view.image.shape)
    return replace(view, image=(view.image + 0.004 * noise).astype(np.float32))


def blank(seed: int, quality: int) -> list[View]:
    """A sheet without texture in JPEG: what is seen is the compression's."""
    random = np.random.default_rng(seed)
    light = 0.5 + np.linspace(0, 0.1, 400) + 0.006 * random.standard_normal((2, 300, 400))
    return [View(stored(one, quality), lens, PIXEL) for one, lens in zip(light, LENSES, strict=True)]


def frames(seeds: int) -> Iterator[Frame]:
    half, swapped = (LENSES[0], Lens(0.025, 8, 0.85)), LENSES[::-1]
    for seed in range(seeds):
        for quality in (75, 90, 95):
            yield Frame("blank sheet in JPEG", "refuse", blank(seed, quality), 1.1, 0.85)
        for distance in DISTANCES:
            for quality in (0, 95, 100):
                yield Frame("sound: apertures", "sound", views("natural", distance, quality, seed), distance, 0.85)
            pair, other = (views("natural", distance, 100, one) for one in (seed, seed + 100))
            foci = wall(FOCI, distance, "disc", 0.5, 0.01, seed)
            yield Frame("sound: foci", "sound", foci, distance, None)
            yield Frame(
                "sound: foci, 3 % noise", "sound", wall(FOCI, distance, "disc", 0.5, 0.03, seed), distance, None
            )
            yield Frame("apertures in the wrong order", "refuse", shown(pair, swapped), distance, 0.85)
            yield Frame("foci in the wrong order", "unseen", shown(foci, FOCI[::-1]), distance, None)
            yield Frame("f/8 stated for f/4", "unseen", shown(pair, half), distance, 0.85)
            yield Frame(
                "aperture that did not move", "refuse", shown([pair[0], again(pair[0], seed)], LENSES), distance, 0.85
            )
            yield Frame("views of two scenes", "refuse", [pair[0], other[1]], distance, 0.85)
            yield Frame("moved by 4 pixels", "refuse", [pair[0], shifted(pair[1], 4)], distance, 0.85)
            yield Frame("sRGB taken for linear", "cover", [brightened(one) for one in pair], distance, 0.85)
            yield Frame(
                "gaussian blur as disc", "cover", wall(LENSES, distance, "gaussian", 0.5, 0.01, seed), distance, 0.85
            )
            squares = views("squares", distance, 95, seed)
            yield Frame("printed squares in JPEG 95", "cover", squares, distance, 0.85)


@dataclass(frozen=True)
class Outcome:
    """What the default method makes of a frame."""

    frame: Frame
    explained: float
    valid: float
    warned: bool
    beyond: NDArray[np.bool_]


def outcome(frame: Frame) -> Outcome:
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        depth = recover_depth(frame.views, near=frame.near)
    off = np.abs(depth.vergence - 1 / frame.distance)[depth.valid] / depth.vergence_sd[depth.valid]
    explained = float(depth.details["share_of_texture_explained"])
    if explained >= EXPLAINED and not depth.valid.any():
        explained = 0.0  # refused for another reason, whatever the threshold
    return Outcome(frame, explained, float(depth.valid.mean()), bool(said), off > 5)


def curve(outcomes: Sequence[Outcome]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Thresholds of what must be explained, and the share of sound frames, and of those to be refused, below each."""
    judged = [one.explained for one in outcomes if one.frame.group in ("sound", "refuse")]
    thresholds = np.concatenate([[0.0], np.sort(judged) + 1e-9])
    sound, faulty = (
        np.array([one.explained for one in outcomes if one.frame.group == group]) for group in ("sound", "refuse")
    )
    return thresholds, *(np.mean(some[:, None] < thresholds, axis=0) for some in (sound, faulty))


def table(outcomes: Sequence[Outcome], say: Callable[[str], None] = print) -> None:
    say(f"{'':8}{'frames':32}{'n':>4}{'refused':>9}{'warned':>8}{'claimed':>9}{'beyond 5 sd':>13}")
    for kind in dict.fromkeys(one.frame.kind for one in outcomes):
        some = [one for one in outcomes if one.frame.kind == kind]
        beyond = np.concatenate([one.beyond for one in some])
        refused = np.mean([one.valid < REFUSED for one in some])
        warned = np.mean([one.warned and one.valid >= REFUSED for one in some])
        wrong = f"{beyond.mean():13.3f}" if beyond.size else f"{'-':>13}"
        claimed = np.mean([one.valid for one in some])
        shares = f"{refused:9.2f}{warned:8.2f}{claimed:9.2f}{wrong}"
        say(f"{some[0].frame.group:8}{kind:32}{len(some):4}{shares}")


def main() -> None:
    parser = argparse.ArgumentParser(description="what the default method refuses")
    parser.add_argument("--seeds", type=int, default=3)
    options = parser.parse_args()
    outcomes = [outcome(frame) for frame in frames(options.seeds)]
    outcomes.sort(key=lambda one: ("sound", "refuse", "cover", "unseen").index(one.frame.group))
    table(outcomes)
    thresholds, sound, faulty = curve(outcomes)
    print(f"\n{'must be explained':>18}{'sound refused':>15}{'others refused':>16}")
    for share in (0.3, EXPLAINED, 0.7, 0.8, 0.9, 0.95, 0.99):
        at = np.searchsorted(thresholds, share) - 1
        print(f"{share:18.2f}{sound[at]:15.2f}{faulty[at]:16.2f}")
    print(f"area under the ROC curve {np.trapezoid(faulty, sound):.3f}")


if __name__ == "__main__":
    main()
