"""Depth of coloured walls, as people's eyes see them: bias, coverage and side of focus, by texture, light and person.

    python benchmarks/coloured_walls.py [--kinds bands moments both] [--pupils MM ...] [--foci D ...]
        [--vergences D ...] [--textures NAME ...] [--files PICTURE ...] [--lights NAME ...] [--people SCALE ...]
        [--knowledge exact learnt people none] [--shapes wall step sphere] [--side PIXELS] [--seed N]
        [--fraction ROWS [--beside-grey]] [--out FILE.csv]

A surface stands before an eye; its reflectance at each pixel is a spectrum (grey; linear sRGB by the basis of Mallett
and Yuksel 2019), in the light of an illuminant. Its views have the photon noise of 200 cd/m^2. Bands: what the L and M,
and the S cones see. Moments: two views of the L and M cones, 0.5 D apart in focus. Both: two bands at two moments.
Textures are simulated (natural, in one colour, or of colours that vary) or photographs (scikit-image's, decoded); your
own pictures are added with --files. People's chromatic aberration is a multiple of the mean. A light is an illuminant,
a black body such as "3000 K", or "display": the texture is shown on a display.

--fraction measures a fraction of the grid instead of the whole: ROWS surfaces, among which each level of each factor
occurs equally often, independently of the others. Each stands up to 2 D from the focus, and has a texture and noise of
its own seed (--seed and more). It prints a table by each factor. --beside-grey measures a grey texture in the place of
each surface as well, and prints the tables again of those where it is valid in 70 % or more. With --out each row is
written when it is measured; rows that the file has already are not measured again.

What the estimator knows of the eye: "exact", its chromatic aberration; "learnt", what three fixations of a grey surface
by both cues show of it; "people", that of people in general (SD 25 %), marginalised; "none": the mean eye before white
surfaces, as if nothing were coloured. The light is known.

A line states, over all distances, pupils and foci of a texture, light and person: the share of valid pixels; of these
the median error (D) over walls that are valid in 5 % or more, the median stated standard deviation (D), the shares
within 2 and beyond 5 standard deviations and the share on the right side of the focus (of surfaces 0.1 D and more away
from it).
"""

from __future__ import annotations

import argparse
import csv
import itertools
import warnings
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from skimage import data, io

from focalgradient import DepthMap, FocalGradientWarning, View, recover_depth
from focalgradient.eye import (
    Cones,
    Eye,
    EyePrior,
    Oscillation,
    Photons,
    SpectralBasis,
    SpectralPicture,
    eye_views,
    learn_chromatic_scale,
    recover_eye_depth,
)
from focalgradient.eye.cones import S_FINEST_CPD

PIXEL, LIGHT = np.radians(1 / 60), 200.0
PAIR = (0.125, 0.375)
"""Seconds: the extremes of an oscillation of 0.5 D at 2 Hz."""

KINDS = ("bands", "moments", "both")
LIGHTS = ("D65", "A", "LED-B1")
PEOPLE = (0.8, 1.0, 1.25)
COLOURS = {
    "grey": ((0.5, 0.5, 0.5), 0.0),
    "red": ((0.7, 0.1, 0.08), 0.0),
    "green": ((0.1, 0.4, 0.1), 0.0),
    "blue": ((0.08, 0.12, 0.6), 0.0),
    "brown": ((0.3, 0.15, 0.06), 0.1),
    "skin": ((0.6, 0.35, 0.25), 0.1),
    "foliage": ((0.15, 0.25, 0.05), 0.2),
    "sky": ((0.2, 0.4, 0.7), 0.1),
    "random": ((0.4, 0.4, 0.4), 0.5),
}
"""Reflectance in linear sRGB, and the contrast of a texture of each component's own over the common one."""

PHOTOGRAPHS = ("coffee", "chelsea", "retina", "rocket")
HELD_COLOURS = {
    "orange": ((0.6, 0.25, 0.05), 0.15),
    "violet": ((0.3, 0.1, 0.5), 0.0),
    "turquoise": ((0.1, 0.45, 0.4), 0.3),
    "mixed": ((0.25, 0.4, 0.3), 0.8),
}
HELD_PHOTOGRAPHS = ("astronaut", "immunohistochemistry")
"""Textures on which no rule of the method was chosen."""

FRACTION = {
    "light": ("D65", "A", "3000 K", "LED-B1", "display"),
    "person": (0.8, 1.0, 1.25),
    "pupil_mm": (2.0, 3.0, 4.0, 5.0, 7.0),
    "vergence_D": (0.0, 0.5, 1.0, 2.0, 3.0, 4.5, 6.0),
}
"""Levels of a fraction of the grid, beside kinds and textures."""

FARTHEST = 2.0
"""Dioptres from the focus to the farthest surface of a fraction."""
FIXATIONS = (0.6, -0.5, 1.0)
"""Dioptres of the grey surfaces that a person's aberration is learnt from, nearer than the focus."""

GREY = 0.7
"""Share of valid pixels of a grey surface from which a coloured one in its place is compared with it."""

CLAIMED = 0.05
"""Share of valid pixels from which a surface counts as claimed."""

COLUMNS = ("kind", "texture", "light", "person", "knowledge", "shape", "pupil_mm", "focus_D", "vergence_D", "seed")
MEASURES = ("valid", "error_D", "sd_D", "in2", "beyond5", "side")
Row = dict[str, float | str]


def natural(side: int, seed: int) -> NDArray[np.float64]:
    """A texture of 1 / f amplitude, of standard deviation 1."""
    radial = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side))
    radial[0, 0] = np.inf
    white = np.fft.rfft2(np.random.default_rng(seed).standard_normal((side, side)))
    field = np.fft.irfft2(np.where(radial < 0.5, white, 0) / radial, (side, side))
    return np.asarray(field / field.std())


def photograph(image: NDArray[np.uint8], side: int) -> NDArray[np.float64]:
    """The middle of a picture, decoded (sRGB), reduced to about `side` pixels."""
    encoded = image[..., :3] / 255.0
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    factor = max(1, int(min(linear.shape[:2]) / (1.3 * side)))
    rows, columns = (n // factor for n in linear.shape[:2])
    small = linear[: rows * factor, : columns * factor].reshape(rows, factor, columns, factor, 3).mean(axis=(1, 3))
    if min(small.shape[:2]) < side:
        raise SystemExit(f"a picture has {min(image.shape[:2])} pixels at its smaller side, but needs {side} or more.")
    top, left = ((n - side) // 2 for n in small.shape[:2])
    return np.asarray(small[top : top + side, left : left + side])


@lru_cache(maxsize=64)
def texture(name: str, side: int, seed: int = 0) -> NDArray[np.float64]:
    """Reflectance in linear sRGB, side x side x 3; a simulated texture of this `seed`."""
    every = COLOURS | HELD_COLOURS
    if name in every:
        colour, own = every[name]
        number = list(every).index(name) + 100_000 * seed
        common = natural(side, number)[..., None]
        others = np.stack([natural(side, 1000 + 10 * number + one) for one in range(3)], axis=-1)
        return np.clip(np.array(colour) * (1 + 0.2 * (common + own * others)), 0.005, None)
    image = io.imread(name) if Path(name).exists() else getattr(data, name)()
    return photograph(image, side)


def vergences(shape: str, vergence: float, side: int) -> NDArray[np.float64]:
    """Vergence at each pixel: a wall, two walls half a dioptre apart, or a ball half a dioptre before a wall."""
    whole = np.full((side, side), vergence)
    if shape == "step":
        whole[:, side // 2 :] += 0.5
    if shape == "sphere":
        radius = np.hypot(*(np.mgrid[:side, :side] - (side - 1) / 2)) / (0.35 * side)
        whole += np.where(radius < 1, 0.25 + 0.25 * np.sqrt(np.clip(1 - radius**2, 0, None)), 0)
    return whole


def picture_of(name: str, light: str, side: int, seed: int = 0) -> SpectralPicture:
    """The texture in a light, or on a display."""
    if light == "display":
        return SpectralPicture(texture(name, side, seed), SpectralBasis.of_display())
    return SpectralPicture.of_srgb(texture(name, side, seed), light)


def cones_of(eye: Eye, kind: str) -> list[Cones]:
    moments = [eye] if kind == "bands" else eye.through(PAIR, Oscillation())
    cones = [Cones.of(one, "L+M") for one in moments]
    if kind != "moments":
        cones += [Cones.of(one, "S", finest_cpd=S_FINEST_CPD) for one in moments]
    return cones


def views_of(eye: Eye, kind: str, picture: SpectralPicture, vergence: NDArray[np.float64], seed: int) -> list[View]:
    with np.errstate(divide="ignore"):
        distance = 1 / vergence
    seen = eye_views((picture, distance), cones_of(eye, kind), picture.shape, PIXEL, noise=Photons(LIGHT), seed=seed)
    return [one.view for one in seen]


@lru_cache(maxsize=256)
def learnt(person: float, mm: float, focus: float, light: str, side: int) -> EyePrior:
    """What three fixations of a grey surface show of a person's chromatic aberration."""
    picture = picture_of("grey", light, side, 999)
    eye = Eye(1e-3 * mm, focus, chromatic_scale=person)
    series = [
        views_of(eye, "both", picture, np.full((side, side), max(0.0, focus + more)), seed)
        for seed, more in enumerate(FIXATIONS)
    ]
    return learn_chromatic_scale(series)


def depth_of(views: list[View], knowledge: str, known: EyePrior) -> DepthMap:
    if knowledge == "none":
        return recover_depth([replace(view, optics=_mean_eye(view.optics)) for view in views])
    return recover_eye_depth(views, known)


def _mean_eye(cones: Any) -> Cones:
    """The cones of the mean eye before white surfaces."""
    eye = replace(cones.eye, chromatic_scale=1.0)
    return Cones.of(eye, cones.light, finest_cpd=cones.finest_cpd)


def measured(
    kind: str,
    name: str,
    light: str,
    person: float,
    knowledge: str,
    cell: tuple[str, float, float, float],
    side: int,
    seed: int = 0,
) -> Row:
    """One surface: shares and medians over its valid pixels."""
    shape, mm, focus, vergence = cell
    eye = Eye(1e-3 * mm, focus, chromatic_scale=person)
    true = vergences(shape, vergence, side)
    picture = picture_of(name, light, side, seed)
    views = views_of(eye, kind, picture, true, seed=int(1000 * vergence + 10 * mm) + 100_000 * seed)
    known = EyePrior(person, 0.0)
    if knowledge == "people":
        known = EyePrior()
    elif knowledge == "learnt":
        known = learnt(person, mm, focus, light, side)
    row: Row = dict(zip(COLUMNS, (kind, name, light, person, knowledge, *cell, seed), strict=True))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FocalGradientWarning)
        depth = depth_of(views, knowledge, known)
    valid = float(depth.valid.mean())
    row["valid"] = valid
    if valid >= CLAIMED:
        error, sd = (depth.vergence - true)[depth.valid], depth.vergence_sd[depth.valid]
        away = (np.abs(true - focus) > 0.1)[depth.valid]
        right = (np.sign(depth.vergence - focus) == np.sign(true - focus))[depth.valid]
        row |= {"error_D": float(np.median(error)), "sd_D": float(np.median(sd))}
        row["in2"] = float(np.mean(np.abs(error) <= 2 * sd))
        row["beyond5"] = float(np.mean(np.abs(error) > 5 * sd))
        if away.any():
            row["side"] = float(right[away].mean())
    return row


def fraction(given: argparse.Namespace) -> list[tuple[Any, ...]]:
    """Arguments of `measured` of a fraction of the grid: each level of each factor occurs equally often."""
    random, count = np.random.default_rng(given.seed), given.fraction

    def drawn(levels: Any) -> list[Any]:
        return [levels[i] for i in random.permutation(np.arange(count) % len(levels))]

    names = (*given.textures, *HELD_COLOURS, *HELD_PHOTOGRAPHS, *given.files)
    factors = drawn(given.kinds), drawn(names), *(drawn(levels) for levels in FRACTION.values())
    apart = FARTHEST * (2 * random.permutation((np.arange(count) + 0.5) / count) - 1)
    rows = []
    for number, (kind, name, light, person, mm, vergence) in enumerate(zip(*factors, strict=True)):
        # A focus beyond infinity is mirrored.
        focus = round(float(vergence - apart[number] if vergence > apart[number] else vergence + apart[number]), 3)
        knowledge, shape = (levels[number % len(levels)] for levels in (given.knowledge, given.shapes))
        cell = shape, mm, focus, vergence
        rows.append((kind, name, light, person, knowledge, cell, given.side, given.seed + number))
    return rows


def in_grey(arguments: tuple[Any, ...]) -> tuple[Any, ...]:
    """Arguments of `measured` of a grey surface in the place of another."""
    kind, _, *rest = arguments
    return kind, "grey", *rest


def key(row: Row) -> tuple[str, ...]:
    """What a row is of, as its file has it."""
    return tuple(str(row[name]) for name in COLUMNS)


def read(path: Path | None) -> dict[tuple[str, ...], Row]:
    """Rows that a file has already."""
    if path is None or not path.exists():
        return {}
    with path.open(newline="") as file:
        rows = [{n: v if n in COLUMNS else float(v) for n, v in one.items() if v != ""} for one in csv.DictReader(file)]
    return {key(row): row for row in rows}


def once(done: dict[tuple[str, ...], Row], path: Path | None, arguments: tuple[Any, ...]) -> Row:
    """The row of these arguments of `measured`: as the file has it, or measured and written there."""
    *first, cell, _, seed = arguments
    wanted = tuple(str(one) for one in (*first, *cell, seed))
    if wanted not in done:
        done[wanted] = measured(*arguments)
        if path is not None:
            new = not path.exists()
            with path.open("a", newline="") as file:
                writer = csv.DictWriter(file, (*COLUMNS, *MEASURES))
                if new:
                    writer.writeheader()
                writer.writerow(done[wanted])
    return done[wanted]


HEADER = "valid %    bias D     sd D  in 2 %  >5 sd %  side %  claimed"


def line(rows: list[Row]) -> str:
    """Measures of some rows, as `HEADER` names them."""
    claimed = [row for row in rows if "sd_D" in row]
    weight = np.array([float(row["valid"]) for row in claimed])

    def share(name: str) -> float:
        return 100 * np.average([float(r[name]) for r in claimed], weights=weight) if claimed else np.nan

    errors, sds = ([float(row[n]) for row in claimed] or [np.nan] for n in ("error_D", "sd_D"))
    sides = [float(row["side"]) for row in claimed if "side" in row] or [np.nan]
    valid = 100 * np.mean([float(row["valid"]) for row in rows])
    return (
        f"{valid:7.1f} {np.median(errors):+9.3f} {np.median(sds):8.3f} {share('in2'):7.1f} {share('beyond5'):8.2f} "
        f"{100 * np.mean(sides):7.1f}  {len(claimed)} of {len(rows)}"
    )


def by_factor(rows: list[Row]) -> list[str]:
    """A table for each factor: a line for each kind and level."""
    lines = []
    for factor in ("kind", "texture", *FRACTION):
        names = ("kind",) if factor == "kind" else ("kind", factor)
        lines.append(f"{'kind':8} {'' if factor == 'kind' else factor:20} {HEADER}")
        for level in sorted({tuple(str(row[n]) for n in names) for row in rows}):
            some = [row for row in rows if tuple(str(row[n]) for n in names) == level]
            lines.append(
                f"{level[0]:8} {Path((*level, '')[1]).stem if factor == 'texture' else (*level, '')[1]:20} {line(some)}"
            )
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", nargs="+", default=KINDS, choices=KINDS)
    parser.add_argument("--pupils", nargs="+", type=float, default=(2.0, 3.0, 4.0, 5.0, 7.0))
    parser.add_argument("--foci", nargs="+", type=float, default=(0.5, 1.5, 4.0))
    parser.add_argument("--vergences", nargs="+", type=float, default=tuple(np.arange(0, 6.5, 0.5).tolist()))
    parser.add_argument("--textures", nargs="*", default=(*COLOURS, *PHOTOGRAPHS))
    parser.add_argument("--files", nargs="*", default=(), help="pictures of your own, beside the textures")
    parser.add_argument("--lights", nargs="+", default=LIGHTS)
    parser.add_argument("--people", nargs="+", type=float, default=PEOPLE, help="scales of chromatic aberration")
    parser.add_argument("--knowledge", nargs="+", default=("learnt",), choices=("exact", "learnt", "people", "none"))
    parser.add_argument("--shapes", nargs="+", default=("wall",), choices=("wall", "step", "sphere"))
    parser.add_argument("--side", type=int, default=160)
    parser.add_argument("--seed", type=int, default=0, help="of simulated textures and noise; the first of a fraction")
    parser.add_argument("--fraction", type=int, metavar="ROWS", help="number of surfaces, instead of the grid")
    parser.add_argument("--beside-grey", action="store_true", help="of a fraction: a grey surface in each place, too")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    done = read(given.out)
    if given.fraction is not None:
        drawn = fraction(given)
        rows = [once(done, given.out, arguments) for arguments in drawn]
        print("\n".join(by_factor(rows)))
        if given.beside_grey:
            greys = [once(done, given.out, in_grey(arguments)) for arguments in drawn]
            some = [row for row, grey in zip(rows, greys, strict=True) if float(grey["valid"]) >= GREY]
            print(f"Where grey is valid in {GREY:.0%} or more:")
            print("\n".join(by_factor(some)))
        return
    whole = itertools.product(given.kinds, given.knowledge, (*given.textures, *given.files), given.lights, given.people)
    print(f"{'kind':8} {'knows':7} {'texture':9} {'light':7} person  {HEADER}", flush=True)
    for kind, knowledge, name, light, person in whole:
        cells = itertools.product(given.shapes, given.pupils, given.foci, given.vergences)
        here = [
            once(done, given.out, (kind, name, light, person, knowledge, cell, given.side, given.seed))
            for cell in cells
        ]
        print(f"{kind:8} {knowledge:7} {Path(name).stem:9} {light:7} {person:6g}  {line(here)}", flush=True)


if __name__ == "__main__":
    main()
