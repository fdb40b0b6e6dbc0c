"""Whether the stated standard deviation of depth is that of its errors: scenes, fields, a sheet and rooms in one table.

    python benchmarks/uncertainty.py [DATA] [--only WORD ...] [--cache DIR] [--figure FILE.png]

A row gives the share of valid pixels and, of these, z (1.48 times the median error in stated standard deviations: 1 is
honest, less is too wide), the shares within two and beyond five of them, and the medians of error and standard
deviation in dioptres. The ray-traced scenes are `UNCERTAINTY` of `analysis/outline_scenes.py`. A field of focus that is
curved or tilted by so much in the corner, and a sheet of which only that it is flat is known, follow; a curved field,
and a pupil cut as beside the axis of a fast lens, are scored twice, by what pixels state each (``vergence_sd``) and
with what the frame shares (``total_sd``). Rows with a number in brackets are draws of fully textured surfaces, of which
that percentage should be valid (of corrupted pairs, of undamaged pixels). Of a scene that reaches beyond the search,
also given are the shares of that part that are claimed, and reported as nearer or farther.

DATA is a folder with any of ``canon_rf50_flat`` and ``indoor_pairs``: rooms are scored by ``vergence_sd``, each and
pooled, with what is left after the best focus and the best smooth field (`rooms.py`), and six are drawn in `--figure`.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

sys.path.insert(0, str(Path(__file__).parents[1] / "analysis"))

import rooms
from outline_scenes import (
    BACK,
    BACK_LIMIT,
    CLIP,
    FOCI,
    FRONT,
    FRONT_LIMIT,
    PIXEL,
    SEVERAL,
    SHAPE,
    UNCERTAINTY,
    Array,
    Case,
    Layer,
    half,
    recovered,
    score,
    texture,
    views_and_truth,
)
from photographs import photographed

from focalgradient import DepthMap, Lens, View, blur, recover_depth
from focalgradient.psf import transfer
from focalgradient.render import noisy

COLUMNS = {"valid": 1, "z": 2, "within_2_sd": 1, "beyond_5_sd": 2, "error_D": 4, "sd_D": 4}
"""Scores printed, with their decimals."""

FIELDS = {"curved by 0.06 D": (0.06, 0.0), "tilted by 0.06 D": (0.0, 0.06), "curved by 0.15 D": (0.15, 0.0)}
"""Change of focus at the corner: curvature and tilt (D)."""

NOISE = 0.0022
WALL = 1.0  # D
Mask = NDArray[np.bool_]
DRAWS = 2  # of each pair of views
HOT, SQUARE, SPOILT = (
    5e-4,
    32,
    4,
)  # share of pixels that are too bright; side (px) of what does not belong; px off these
CUT = 0.08  # tolerance of apertures of which so much of the radius may be cut off
MARGIN = 24  # px about its border that are not scored of a part outside the search


def row(name: str, depth: DepthMap, vergence: Array, counted: Mask | None = None) -> None:
    """Print one row over the `counted` pixels, or the whole frame."""
    found = score(depth, vergence, np.ones(vergence.shape, bool) if counted is None else counted)
    print(f"{name:36}" + "".join(f"{found.get(c, np.nan):9.{places}f}" for c, places in COLUMNS.items()), flush=True)


def walls(vergence: Array, lenses: Sequence[Lens], seed: int = 1) -> list[View]:
    """Views of a textured surface of `vergence` (H x W)."""
    edge = [(n - size) // 2 for n, size in zip(texture(seed, 1.0, SHAPE).shape, SHAPE, strict=True)]
    sharp = texture(seed, 1.0, SHAPE)[edge[0] : edge[0] + SHAPE[0], edge[1] : edge[1] + SHAPE[1]]
    views = [blur(sharp, 1 / vergence, lens, pixel_angle=PIXEL) for lens in lenses]
    return [noisy(view, NOISE, seed + number) for number, view in enumerate(views)]


def bracketed(vergence: float, lenses: Sequence[Lens], gains: Sequence[float], seed: int = 1) -> list[View]:
    """Views of a textured wall, each exposed by its gain.

    Blurred by the disc's transfer: of discs of less than 1.5 pixels `blur` has 10 to 40 % more variance, which biases
    depth by more than noise does here.
    """
    sharp = np.fft.fft2(texture(seed, 1.0, SHAPE))
    frequency = np.hypot(np.fft.fftfreq(sharp.shape[0])[:, None], np.fft.fftfreq(sharp.shape[1]))
    views = []
    for number, (lens, gain) in enumerate(zip(lenses, gains, strict=True)):
        disc = transfer(frequency, lens.blur_radius(1 / vergence) / PIXEL, "disc")
        image = gain * np.fft.ifft2(sharp * disc).real[: SHAPE[0], : SHAPE[1]]
        views.append(noisy(View(image.astype(np.float32), lens, PIXEL), NOISE, seed + number))
    return views


def fields() -> Iterator[tuple[str, list[View], Array]]:
    """A wall through lenses whose focus differs over the field: name, views, and the wall."""
    height, width = SHAPE
    y, x = np.meshgrid(*(np.arange(n) - (n - 1) / 2 for n in SHAPE), indexing="ij")
    corner = float(np.hypot(height - 1, width - 1)) / 2
    for kind, lenses in (("apertures", FRONT), ("three foci", SEVERAL[3])):
        for name, (curvature, tilt) in FIELDS.items():
            moved = WALL - curvature * (x**2 + y**2) / corner**2 - tilt * x * 2 / (width - 1)
            yield f"field {name}, {kind}", walls(moved, lenses), np.full(SHAPE, WALL)


def validity() -> Iterator[tuple[str, list[Case]]]:
    """Draws of fully textured surfaces, with the share of their pixels that should be valid in the name."""
    ways: list[tuple[tuple[Lens, ...], dict[str, float]]]
    ways = [(FOCI, {}), (FRONT, FRONT_LIMIT), (BACK, BACK_LIMIT)]
    cases: dict[str, list[Case]] = {}
    for number in range(DRAWS * len(ways)):
        lenses, limits = ways[number % len(ways)]
        random = np.random.default_rng([number, 61])
        angle, steep = random.uniform(0, 2 * np.pi), random.uniform(1e-3, 3e-3)
        slope = float(steep * np.cos(angle)), float(steep * np.sin(angle))
        slant = Case(lenses, (Layer(WALL, slope=slope),), 610 + number, 0.005, limits, (192, 256), 1024)
        step = (Layer(1.4, half(angle, float(random.uniform(-30, 30)))), Layer(0.8))
        draws = {
            "slants (97)": slant,
            "corrupted pairs (96)": slant,
            "steps (96)": replace(slant, layers=step),
            "pupils cut to .84": replace(
                slant, vignette=0.25, lenses=tuple(replace(one, aperture_tolerance=CUT) for one in lenses)
            ),
        }
        for name, case in draws.items():
            cases.setdefault(name, []).append(case)
    yield from cases.items()


def corrupted(views: Sequence[View], seed: int) -> tuple[list[View], Mask]:
    """Views of which the last has bright pixels and a square of another scene; and the pixels `SPOILT` px off these."""
    random, image = np.random.default_rng([seed, 62]), views[-1].image.copy()
    bad = random.random(image.shape) < HOT
    image[bad] = CLIP
    top, left = (int(random.integers(20, n - 20 - SQUARE)) for n in image.shape)
    place = np.s_[top : top + SQUARE, left : left + SQUARE]
    image[place] = image[place][::-1, ::-1]
    bad[place] = True
    return [*views[:-1], replace(views[-1], image=image)], ndimage.distance_transform_edt(~bad) > SPOILT


def valid_row(name: str, cases: Sequence[Case], cache: Path | None) -> None:
    """Print the scores of several draws, joined."""
    found, truths, counted = [], [], []
    for number, case in enumerate(cases):
        views, vergence = views_and_truth(f"{name.split(' (')[0]} {number}", case, cache)
        use = np.ones(vergence.shape, bool)
        if "corrupted" in name:
            views, use = corrupted(views, number)
        found.append(recovered(case, views, outlines=True)[0])
        truths.append(vergence)
        counted.append(use)
    for label, sd in ((name, "vergence_sd"), (f"    {'with the common part':32}", "total_sd")):
        if label == name or any(one.common_errors.any() for one in found):
            parts = ("vergence", sd, "valid", "side_known")
            joined = DepthMap(*(np.concatenate([getattr(one, part) for one in found]) for part in parts))
            row(label, joined, np.concatenate(truths), np.concatenate(counted))


def outside(name: str, views: Sequence[View], vergence: Array, near: float, far: float | None = None) -> None:
    """Print a scene of which a part lies outside the limits of the search (m)."""
    depth = recover_depth(views, near=near, far=far)
    row(name, depth, vergence)
    nearer, farther = vergence > 1 / near, vergence < (1 / far if far else 0.0)
    reported = np.zeros(SHAPE, np.int8) if depth.beyond is None else depth.beyond
    for side, part in ((1, nearer), (-1, farther)):
        if part.any():
            inner = ndimage.binary_erosion(part, iterations=MARGIN, border_value=1)
            print(
                f"{'':4}{'nearer' if side > 0 else 'farther'} part: {depth.valid[inner].mean():.1%} claimed, "
                f"{(reported[inner] == side).mean():.1%} reported"
            )
    print(f"{'':4}part within: {(reported[~nearer & ~farther] != 0).mean():.2%} reported as outside")


def main() -> None:
    parser = argparse.ArgumentParser(description="stated standard deviation against errors of depth")
    parser.add_argument("data", type=Path, nargs="?", help="folder with photographs")
    parser.add_argument("--only", nargs="*", default=[""], help="words of which a row's name contains one")
    parser.add_argument("--cache", type=Path, help="keep traced views here")
    parser.add_argument("--figure", type=Path, help="draw the first six rooms here")
    options = parser.parse_args()
    warnings.simplefilter("ignore")

    def is_asked(name: str) -> bool:
        return any(word in name for word in options.only)

    print(f"{'':36}" + "".join(f"{name:>9}" for name in ("valid %", "z", "< 2 sd %", "> 5 sd %", "error D", "sd D")))
    for name, case in UNCERTAINTY.items():
        if is_asked(name):
            views, vergence = views_and_truth(name, case, options.cache)
            row(name, recovered(case, views, outlines=True)[0], vergence)
    if is_asked("bracketing"):
        depth = recover_depth(bracketed(WALL, SEVERAL[3], (1.0, 0.5, 0.25)))
        row("bracketing, 3 exposures", depth, np.full(SHAPE, WALL))
    for name, views, vergence in fields():
        if is_asked(name):
            depth = recover_depth(views, near=None if "foci" in name else FRONT[0].focus_distance)
            row(name, depth, vergence)
            row(f"    {'with the common part':32}", replace(depth, vergence_sd=depth.total_sd), vergence)
    for name, cases in validity():
        if is_asked(name):
            valid_row(name, cases, options.cache)
    halves = [np.where(np.arange(SHAPE[1]) < SHAPE[1] // 2, v, WALL) for v in (1.5625, 0.35)]
    for kind, lenses in (("two foci", SEVERAL[2]), ("apertures", FRONT)):
        for name, profile, near, far in (("near", halves[0], 0.8, None), ("far", halves[1], 0.56, 1.5)):
            if is_asked(f"{name}, {kind}"):
                vergence = np.broadcast_to(profile, SHAPE)
                outside(f"{name}, {kind}", walls(vergence, lenses), vergence, near, far)
        if is_asked(f"near, three things, {kind}"):
            name = f"three things, {kind.replace('two', '2')}"
            outside(f"near, {name}", *views_and_truth(name, UNCERTAINTY[name], options.cache), 0.76)
    if options.data is None:
        return
    if is_asked("sheet") and (folder := options.data / "canon_rf50_flat").is_dir():
        pair = [Lens(0.0496, number, 0.945) for number in (20, 4)]
        views = photographed([folder / "f20.png", folder / "f4.png"], pair, 46.9e-6, "srgb")
        depth = recover_depth(views, near=0.3, far=0.945, align=True)
        middle = np.median(depth.vergence[depth.valid])
        row("sheet (about its median)", depth, np.full(depth.shape, middle))
    if is_asked("rooms") and (folder := options.data / "indoor_pairs").is_dir():
        found = rooms.rooms(sorted(one for one in folder.iterdir() if one.is_dir()), 1.57, 1.6, 8.0)
        if options.figure:
            rooms.draw(found, options.figure)


if __name__ == "__main__":
    main()
