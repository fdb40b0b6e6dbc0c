"""How accurate depth is in ordinary rooms, measured and completed, and what blank surfaces beside texture are given.

    python benchmarks/rooms.py [ROOMS] [--rooms 2,4,6] [--focus 1.57] [--figure FILE.png] [--bound] [--peer]
        [--layers 6] [--first 0] [--rendered 75]

ROOMS is a folder with one folder a room: ``narrow.jpg`` and ``wide.jpg`` of one focus, and ``depth_mm.png`` of a depth
camera (16 bits, mm; 0 where none). A row gives the share of the pixels that are measured, the mean relative error of
distance, the share within a factor of 1.25, those within two and beyond five stated standard deviations, that within
two with what the focus differs by from room to room (``total_sd``), and z, 1.48 times the median error in stated
standard deviations (1 is honest, less is too wide); then the same of the completed map, in its classes. Scored is what
lies farther than 6 pixels from the depth camera's own jumps and on the side of focus that is searched (``--near``), as
two apertures cannot tell the sides apart. The rest is the mean relative error that is left of the measured pixels after
the constant change of vergence, which is a change of focus, that suits the room best, and after the best polynomial of
second order over the frame.

With ``--bound`` another row gives what the Cramer-Rao bound of `focalgradient.depth.limits` allows with the noise that
was found, the texture of the sharper view and the default window: the share of the scored pixels at which an unbiased
estimate could be valid, the mean relative error of such an estimate there, and the same bound over the pixels measured,
with the median error in multiples of it. It knows the texture and the blur's shape, which an estimate does not. With
``--peer`` a last row gives simple blur equalisation (`recover_depth.plain` in this folder) of the same, aligned views:
its mean relative error and share within a factor of 1.25 over all scored pixels, and over those measured here.

With ``--rendered`` each room is rendered from its own narrow photograph and map, by a camera that is exactly the one
stated, and stored as JPEG of that quality (0: as it is): what is lost then is lost to noise and compression, and not to
the camera or the map. The room is turned by 7 degrees and enlarged by 1.15, for the photograph's own blocks to lie off
the grid of the new ones.

Layers are rendered: a textured thing before a blank wall, and a blank thing before a textured wall, each with edges of
its own or none, lossless or in JPEG. A row gives what is claimed of the blank surface, and of that what lies beyond
five standard deviations; then the share of the frames and what lies within two standard deviations by class of the
completed map.
"""

from __future__ import annotations

import argparse
import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from recover_depth import Trial, plain
from scipy import ndimage
from stored_photographs import stored

from focalgradient import DepthMap, Lens, View, blur, recover_depth
from focalgradient.calibration import Field
from focalgradient.calibration.scenes import REPEAT
from focalgradient.depth.limits import texture_bound
from focalgradient.depth.noise import NoiseLaw, uneven_noise
from focalgradient.depth.registration import RegisteredViews
from focalgradient.depth.validity import LEAST_BLUR_SD, LEAST_SHARE
from focalgradient.photographs import read_photographs
from focalgradient.plotting import new_figure
from focalgradient.psf import transfer

FOCAL_LENGTH, PITCH, F_NUMBERS = 0.035, 36e-6, {"narrow.jpg": 8.0, "wide.jpg": 2.8}
JUMP, MARGIN = 0.05, 6
"""Relative change of distance from one pixel to the next that is a jump, and pixels about one that are not scored."""

LEAST_ABSOLUTE = 10
"""Iterations of reweighted least squares, for the least mean relative error."""

READ_NOISE = 0.003
"""Noise of rendered rooms at full brightness, about that found in the photographs."""

Array = NDArray[Any]
CLASSES = {2: "measured", 1: "near evidence", 0: "guessed"}


def room_views(folder: Path, focus: float) -> list[View]:
    photographs = read_photographs([folder / name for name in F_NUMBERS], "srgb")
    lenses = [Lens(FOCAL_LENGTH, number, focus, focus_tolerance=REPEAT * focus) for number in F_NUMBERS.values()]
    return [
        View(photo.luminance, lens, PITCH / lens.sensor_distance, mask=photo.mask)
        for photo, lens in zip(photographs, lenses, strict=True)
    ]


def truth(folder: Path, near: float) -> tuple[Array, Array]:
    """True distance (m), and the pixels that are scored."""
    distance = np.asarray(cv2.imread(str(folder / "depth_mm.png"), cv2.IMREAD_UNCHANGED), float) / 1000
    seen = np.where(distance > 0, distance, np.nan)
    jumps = np.zeros(distance.shape, np.bool_)
    for one, other in ((np.s_[1:, :], np.s_[:-1, :]), (np.s_[:, 1:], np.s_[:, :-1])):
        jump = np.abs(seen[one] - seen[other]) > JUMP * np.fmin(seen[one], seen[other])
        jumps[one] |= jump
        jumps[other] |= jump
    return distance, (distance > near) & (ndimage.distance_transform_edt(~jumps) > MARGIN)


def score(vergence: Array, sd: Array, total_sd: Array, distance: Array) -> list[float]:
    """Mean relative error, shares within a factor of 1.25, within 2 and beyond 5 sd, within 2 total sd, and z."""
    found = 1 / np.maximum(vergence, 1e-3)
    error = np.abs(vergence - 1 / distance)
    off = error / sd
    factor = np.maximum(found / distance, distance / found)
    return [
        float(np.mean(one))
        for one in (np.abs(found / distance - 1), factor < 1.25, off < 2, off > 5, error < 2 * total_sd)
    ] + [1.48 * float(np.median(off))]


def rows(depth: DepthMap, distance: Array, scored: Array) -> dict[str, list[float]]:
    """Share of what is scored and its scores, by class and over all."""
    if depth.evidence is None:
        return {}
    parts = {name: scored & (depth.evidence == number) for number, name in CLASSES.items()} | {"all": scored}
    return {
        name: [
            part.sum() / scored.sum(),
            *score(*(one[part].astype(float) for one in (depth.vergence, depth.vergence_sd, depth.total_sd, distance))),
        ]
        for name, part in parts.items()
        if part.any()
    }


def best_sd(views: Sequence[View], depth: DepthMap, vergence: Array) -> Array:
    """Bound on the standard deviation of vergence (D) at each pixel of true `vergence`, H x W."""
    registered = RegisteredViews.of(views, align=True)
    sharp, noise = np.asarray(registered.images[0], float), depth.details["noise"]
    if (stated := depth.details.get("noise_by_brightness")) is not None:
        sharp = sharp / uneven_noise(NoiseLaw(stated["share"], stated["brightness"], stated["by_contrast"]), registered)
    white = noise[0] * np.random.default_rng(0).standard_normal(sharp.shape)
    optics, angle, window = [view.optics for view in views], views[0].pixel_angle, depth.details["window_px"]
    low, high = depth.details["searched_vergence_D"]
    levels = np.linspace(low, high, 9)
    information = []
    for level in levels:
        of_both, of_noise = (
            texture_bound(one, optics, float(level), angle, noise=noise, window=window) ** -2.0
            for one in (sharp, white)
        )
        information.append(np.maximum(of_both - of_noise.mean(), 1e-12))
    place = (vergence - levels[0]) / (levels[1] - levels[0])
    at = [np.nan_to_num(place), *np.indices(vergence.shape)]
    logarithm = ndimage.map_coordinates(np.log(information), at, order=1, mode="nearest")
    return np.exp(-logarithm / 2)


def bound_line(name: str, views: Sequence[View], depth: DepthMap, distance: Array, scored: Array) -> list[float]:
    """Print what the bound allows in a room; return it."""
    vergence = 1 / distance
    sd = best_sd(views, depth, vergence)
    widest = max(views, key=lambda view: view.optics.aperture_diameter)
    slope = widest.optics.aperture_diameter / 2 / widest.pixel_angle
    radius = slope * np.abs(vergence - widest.optics.focus_vergence)
    possible = scored & (slope * sd <= np.maximum(LEAST_BLUR_SD, LEAST_SHARE * radius))
    measured = scored & depth.valid
    size = math.sqrt(2 / math.pi) * sd / vergence  # mean absolute value of a normal error
    off = np.abs(depth.vergence - vergence)[measured] / sd[measured] / 0.674  # the median's, in sd
    values = [
        possible.sum() / scored.sum(),
        float(size[possible].mean()) if possible.any() else math.nan,
        float(np.median(size[measured])) if measured.any() else math.nan,
        float(np.median(off)) if measured.any() else math.nan,
    ]
    print(
        f"{name:28}{values[0]:7.3f}{values[1]:9.4f}   over the measured, median: {values[2]:.4f}, "
        f"error / bound {values[3]:.1f}"
    )
    return values


def peer_line(name: str, views: Sequence[View], depth: DepthMap, distance: Array, scored: Array) -> list[float]:
    """Print what simple blur equalisation gives in a room; return it."""
    aligned = RegisteredViews.of(views, align=True)
    pair = [replace(view, image=image, mask=None) for view, image in zip(views, aligned.images, strict=True)]
    vergence = np.clip(plain(Trial(pair, distance, "disc")), *depth.details["searched_vergence_D"])
    values = []
    for part in (scored, scored & depth.valid):
        nothing = np.ones(int(part.sum()))
        values += score(vergence[part], nothing, nothing, distance[part])[:2] if part.any() else [math.nan] * 2
    print(f"{name:28}{1:7.3f}{values[0]:9.3f}{values[1]:8.3f}   over the measured: {values[2]:.3f}, {values[3]:.3f}")
    return values


def rest_line(name: str, depth: DepthMap, distance: Array, scored: Array) -> list[float]:
    """Print the mean relative error left after the best focus, and after the best smooth field; return both."""
    use = scored & depth.valid
    far, found = distance[use], depth.vergence[use]
    off = 1 - found * far  # relative error of distance, to first order
    x, y = (part[use] for part in np.broadcast_arrays(*Field.coordinates(depth.shape)))
    terms = far * np.concatenate([np.ones((1, len(off))), Field.terms(x, y)])
    values = []
    for some in (terms[:1], terms):
        fitted, left = np.zeros(len(off)), []
        for _ in range(LEAST_ABSOLUTE):
            inverse = np.maximum(found * far + fitted, 0.1)  # true over estimated distance
            left.append(float(np.mean(np.abs(1 / inverse - 1))))
            weight = 1 / np.sqrt(np.maximum(np.abs(off - fitted), 1e-3) * inverse)
            fitted = np.linalg.lstsq((some * weight).T, off * weight, rcond=None)[0] @ some
        values.append(min(left))
    print(f"{name:28}{'':7}{values[0]:9.3f}   after the best focus, {values[1]:.3f} after the best smooth field")
    return values


def line(name: str, values: Sequence[float]) -> str:
    share, error, factor, within, beyond, total, z = values
    return f"{name:28}{share:7.3f}{error:9.3f}{factor:8.3f}{within:8.3f}{beyond:9.4f}{total:12.3f}{z:7.2f}"


def rendered_room(
    views: Sequence[View], distance: Array, scored: Array, quality: int, seed: int
) -> tuple[list[View], Array, Array]:
    """Views of a room rendered by an ideal camera, with its distance and the pixels that are scored."""
    random = np.random.default_rng([seed, 42])
    hole = ndimage.distance_transform_edt(distance <= 0, return_distances=False, return_indices=True)
    whole = ndimage.median_filter(distance[tuple(hole)], 5)
    height, width = whole.shape
    move = cv2.getRotationMatrix2D((width / 2, height / 2), 7, 1.15)
    move[:, 2] = move[:, 2] + (3.3, 5.4)

    def moved(image: Array, how: int) -> Array:
        return np.asarray(cv2.warpAffine(image, move, (width, height), flags=how, borderMode=cv2.BORDER_REFLECT))

    sharp = moved(np.asarray(views[0].image, np.float32), cv2.INTER_LANCZOS4).clip(0)
    far_off = moved(whole, cv2.INTER_NEAREST)
    made = []
    for view in views:
        light = np.asarray(blur(sharp, far_off, view.optics, pixel_angle=view.pixel_angle).image, float)
        light += READ_NOISE * random.standard_normal(light.shape) * np.sqrt(light.clip(1e-3, 1))
        made.append(replace(view, image=_stored(light, quality), mask=None))
    return made, far_off, moved(scored.astype(np.uint8), cv2.INTER_NEAREST) > 0


def rooms(
    folders: Sequence[Path],
    focus: float,
    near: float,
    far: float,
    bound: bool = False,
    peer: bool = False,
    quality: int | None = None,
) -> dict[str, tuple[list[View], DepthMap, Array]]:
    """Depth of each room; prints its rows, and those pooled."""
    print(f"{'':28}{'share':>7}{'rel.err':>9}{'<1.25':>8}{'< 2 sd':>8}{'> 5 sd':>9}{'< 2 total':>12}{'z':>7}")
    found: dict[str, tuple[list[View], DepthMap, Array]] = {}
    pooled: dict[str, list[list[float]]] = {}
    best: list[list[float]] = []
    others: list[list[float]] = []
    rests: list[list[float]] = []
    refused = 0
    for folder in folders:
        distance, scored = truth(folder, near)
        views = room_views(folder, focus)
        if quality is not None:
            views, distance, scored = rendered_room(views, distance, scored, quality, len(found))
        depth = recover_depth(views, near=near, far=far, align=quality is None, dense=True)
        found[folder.name] = views, depth, distance
        if not scored.any():
            continue
        scores = rows(depth, distance, scored)
        refused += not scores
        for name, values in scores.items():
            pooled.setdefault(name, []).append(values)
        text = {name: scores[name] for name in ("measured", "all") if name in scores}
        print(
            "\n".join(line(f"{folder.name} {name}", values) for name, values in text.items())
            or f"{folder.name} rejected"
        )
        if "measured" in text:
            rests.append([scores["measured"][0], *rest_line(f"{folder.name} rest", depth, distance, scored)])
        if bound and "noise" in depth.details:
            best.append(bound_line(f"{folder.name} bound", views, depth, distance, scored))
        if peer:
            others.append(peer_line(f"{folder.name} simple", views, depth, distance, scored))
    for name, all_of_them in pooled.items():
        every = np.array(all_of_them)
        share = every[:, 0].sum() / (len(all_of_them) + (refused if name != "all" else 0))
        print(line(f"pooled {name}", [share, *np.average(every[:, 1:], axis=0, weights=every[:, 0])]))
    if rests:
        shares, *rest = np.transpose(rests)
        print("pooled rest: {:.3f}, {:.3f}".format(*np.average(rest, axis=1, weights=shares)))
    if others:
        print("mean simple: {:.3f}, {:.3f}; over the measured {:.3f}, {:.3f}".format(*np.nanmean(others, axis=0)))
    if best:
        print("mean bound: share {:.3f}, {:.4f}; over the measured {:.4f}, {:.1f}".format(*np.nanmean(best, axis=0)))
    print(f"rejected: {refused} of {len(folders)}")
    return found


def layers(seeds: Sequence[int]) -> Iterator[tuple[str, list[View], Array, Array]]:
    """Rendered layers: kind, views, true vergence, and the blank surface (H x W)."""
    lenses = [Lens(0.025, number, 0.85) for number in (11, 4)]
    side, pixel = 224, 3.2e-4
    frequency = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side))
    for seed in seeds:
        random = np.random.default_rng([seed, 42])
        near, far = random.uniform(0.95, 1.1), random.uniform(0.5, 0.8)  # D
        texture = np.fft.irfft2(np.fft.rfft2(random.standard_normal((side, side))) / np.maximum(frequency, 1 / side))
        texture = 0.35 * np.exp(0.35 * texture / texture.std())
        shape = ndimage.zoom(random.standard_normal((7, 7)), side / 7, order=3) > 0.3
        blank = np.full((side, side), random.uniform(0.2, 0.6)) + np.linspace(0, 0.05, side)
        for kind, front, back in (("textured before blank", texture, blank), ("blank before textured", blank, texture)):
            images = []
            for lens in lenses:
                blurs = [transfer(frequency, lens.blur_radius(1 / v) / pixel, "disc") for v in (near, far)]
                cover, light, behind = (
                    np.fft.irfft2(np.fft.rfft2(image) * blur, (side, side))
                    for image, blur in ((shape * 1.0, blurs[0]), (shape * front, blurs[0]), (back, blurs[1]))
                )
                images.append(light + (1 - cover) * behind)
            vergence = np.where(shape, near, far)
            surface = shape if front is blank else ~shape
            for quality in (0, 75):
                views = [
                    View(_stored(i + 0.003 * random.standard_normal(i.shape), quality), lens, pixel)
                    for i, lens in zip(images, lenses, strict=True)
                ]
                yield f"{kind}, {'JPEG 75' if quality else 'lossless'}", views, vergence, surface


def _stored(image: Array, quality: int) -> Array:
    return stored(image, quality) if quality else image.astype(np.float32)


def blank_surfaces(seeds: Sequence[int]) -> None:
    """What is claimed of blank surfaces beside texture, and of the whole of each frame."""
    print(f"\n{'layers':36}{'claimed':>9}{'> 5 sd':>9}{'blank: claimed':>16}{'> 5 sd':>9}{'all: < 2 sd':>13}")
    found: dict[str, list[tuple[float, ...]]] = {}
    completed: dict[str, dict[str, list[Array]]] = {}
    for kind, views, vergence, surface in layers(seeds):
        depth = recover_depth(views, near=0.87, dense=True)
        off = np.abs(depth.vergence - vergence) / depth.vergence_sd
        valid, blank = depth.valid, depth.valid & surface
        found.setdefault(kind, []).append(
            (
                valid.mean(),
                (off > 5)[valid].sum(),
                valid.sum(),
                blank.sum() / surface.sum(),
                (off > 5)[blank].sum(),
                blank.sum(),
                (off < 2).mean(),
            )
        )
        if depth.evidence is not None:
            for number, name in CLASSES.items():
                some = completed.setdefault(kind, {}).setdefault(name, [])
                some.append((off < 2)[depth.evidence == number])
    for kind, values in found.items():
        claimed, beyond, of, share, wrong, blanks, within = np.mean(values, axis=0)
        print(
            f"{kind:36}{claimed:9.3f}{beyond / max(of, 1):9.4f}{share:16.3f}{wrong / max(blanks, 1):9.4f}{within:13.3f}"
        )
    print(f"\n{'completed layers: share, < 2 sd':36}" + "".join(f"{name:>22}" for name in CLASSES.values()))
    for kind, parts in completed.items():
        print(f"{kind:36}" + _by_class(parts))
    print(f"{'all kinds':36}" + _by_class({n: [a for p in completed.values() for a in p[n]] for n in CLASSES.values()}))


def _by_class(parts: dict[str, list[Array]]) -> str:
    """Share of the pixels and what lies within two standard deviations, of each class."""
    joined = {name: np.concatenate(parts[name]) for name in CLASSES.values()}
    total = sum(one.size for one in joined.values())
    return "".join(
        f"{one.size / total:14.3f}{one.mean():8.3f}" if one.size else f"{'-':>22}" for one in joined.values()
    )


def draw(found: dict[str, tuple[list[View], DepthMap, Array]], path: Path) -> None:
    """Photograph, true, measured and completed depth and its uncertainty of up to six rooms."""
    some = dict(list(found.items())[:6])
    figure = new_figure(380.0, 56.0 * len(some), layout="constrained")
    axes = figure.subplots(len(some), 5, squeeze=False)
    for line_of, (views, depth, distance) in zip(axes, some.values(), strict=True):
        true = 1 / np.where(distance > 0, distance, np.nan)
        span: dict[str, Any] = {
            "vmin": np.nanpercentile(true, 2),
            "vmax": np.nanpercentile(true, 98),
            "cmap": "viridis",
        }
        light = np.clip(views[0].image, 0, 1) ** 0.45
        pictures: list[tuple[Array, dict[str, Any]]]
        pictures = [(light, {"cmap": "gray"}), (true, span), (np.where(depth.valid, depth.vergence, np.nan), span)]
        pictures += [(depth.vergence, span), (depth.vergence_sd, {"vmin": 0, "vmax": 0.2, "cmap": "magma"})]
        for ax, (picture, how) in zip(line_of, pictures, strict=True):
            drawn = ax.imshow(picture, **how)
            ax.set_xticks([])
            ax.set_yticks([])
        figure.colorbar(drawn, ax=line_of[-1], label="sd (D)")
        figure.colorbar(line_of[3].images[0], ax=line_of[3], label="vergence (D)")
    for ax, title in zip(axes[0], ("photograph, f/8", "true", "measured", "completed", "uncertainty"), strict=True):
        ax.set_title(title)
    figure.savefig(path, dpi=80)


def main() -> None:
    parser = argparse.ArgumentParser(description="depth in rooms")
    parser.add_argument("data", type=Path, nargs="?", help="folder with the rooms")
    parser.add_argument("--rooms", help="names of those to take, by commas")
    parser.add_argument("--focus", type=float, default=1.57, help="focus distance in metres")
    parser.add_argument("--near", type=float, default=1.6)
    parser.add_argument("--far", type=float, default=8.0)
    parser.add_argument("--figure", type=Path, help="draw the first six rooms here")
    parser.add_argument("--bound", action="store_true", help="also print what noise and texture allow")
    parser.add_argument("--peer", action="store_true", help="also print what simple blur equalisation gives")
    parser.add_argument(
        "--rendered", type=int, metavar="QUALITY", help="render the rooms, stored as JPEG of that quality"
    )
    parser.add_argument("--layers", type=int, default=4, help="number of seeds of rendered layers")
    parser.add_argument("--first", type=int, default=0, help="first of these seeds")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    if options.data is not None:
        names = options.rooms.split(",") if options.rooms else None
        folders = [
            one for one in sorted(options.data.iterdir()) if one.is_dir() and (names is None or one.name in names)
        ]
        asked = options.bound, options.peer, options.rendered
        found = rooms(folders, options.focus, options.near, options.far, *asked)
        if options.figure:
            draw(found, options.figure)
    if options.layers:
        blank_surfaces(range(options.first, options.first + options.layers))


if __name__ == "__main__":
    main()
