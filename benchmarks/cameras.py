"""Calibration of real cameras from scenes of known depth, points, sheets, dual pixels, and an edge.

    python benchmarks/cameras.py DATA [--rooms N]

DATA is a folder with any of ``indoor_pairs`` (01/narrow.jpg, wide.jpg, depth_mm.png, ...), ``dual_pixel``
(sheet_0600_f4, scene1, ...) and ``edge_at_distances`` (50cm-A.png, ...); missing ones are skipped. Errors are of
vergence (D) unless stated otherwise; "within 2 sd" refers to `DepthMap.total_sd`.
"""

from __future__ import annotations

import argparse
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from focalgradient import DepthMap, FocalGradientWarning, Lens, View, recover_depth
from focalgradient.calibration import Priors, Reading, calibrate, calibrate_dual_pixel, measure_target, score_scene
from focalgradient.depth.common_error import with_known_points
from focalgradient.errors import InputError
from focalgradient.optics import DualPixel
from focalgradient.photographs import load_known_scenes, read_distances, read_photograph
from focalgradient.psf import Disc


def agreement(depth: DepthMap, distance: NDArray[np.floating]) -> str:
    """Format the agreement of one map with true distances (m; NaN or 0 where unknown)."""
    use = depth.valid & (distance > 0.3)
    if use.sum() < 100:
        return f"valid {depth.valid.mean():6.1%}  too few"
    off = depth.vergence[use] - 1 / distance[use]
    relative = np.abs(depth.distance[use] / distance[use] - 1)
    within = (np.abs(off) < 2 * depth.total_sd[use]).mean()
    slope = np.polyfit(1 / distance[use], depth.vergence[use], 1)[0] if np.ptp(distance[use]) > 0.1 else np.nan
    return (
        f"valid {depth.valid.mean():6.1%}  bias {np.median(off):+.3f}  median relative {np.median(relative):.3f}  "
        f"slope {slope:5.2f}  sd {np.median(depth.vergence_sd[use]):.3f} "
        f"common {np.median(depth.common_sd[use]):.3f}  "
        f"within 2 sd {within:6.1%}"
    )


def rooms(folder: Path, count: int) -> None:
    """Calibrate on half of the rooms, test on the other half; correct single rooms by one and two measured points."""
    names = sorted(path.name for path in folder.iterdir() if (path / "depth_mm.png").exists())[:count]
    text = "[camera]\nfocal_length_mm = 35\npixel_pitch_um = 36\n"
    for name in names:
        for image, number in (("narrow", 8), ("wide", 2.8)):
            text += f'[[view]]\nimage = "{folder / name / image}.jpg"\ndepth = "{folder / name}/depth_mm.png"\n'
            text += f"f_number = {number}\nfocus_distance_m = 1.7\n"
    with tempfile.TemporaryDirectory() as temporary:
        path = Path(temporary, "scenes.toml")
        path.write_text(text)
        known = load_known_scenes(path)
        scenes = [
            scene for shots in known.scenes if (scene := known.read(shots, Disc())) and scene.depth.valid.mean() > 0.01
        ]
    print(f"\nRooms: {len(scenes)} of {len(names)} give depth; focus marked 1.7 m")
    for title, part, rest in (
        ("all", scenes, []),
        ("even", scenes[::2], scenes[1::2]),
        ("odd", scenes[1::2], scenes[::2]),
    ):
        fit = known.fit(part, Disc())
        camera = fit.calibration
        focus = 1 / camera.focus[1.7] - camera.offset
        print(
            f"  {title:5} focus {focus:.3f} m, {camera.focus[1.7]:.3f} +- {camera.sd[-1]:.3f} D, f/2.8 is "
            f"f/{camera.f_numbers[2.8]:.2f}, scene to scene {fit.repeat:.3f} D"
        )
        scores = [score for one in rest if (score := score_scene(one, fit, [(8, 1.7), (2.8, 1.7)])) is not None]
        if scores:
            middle = {
                key: float(np.median([getattr(score, key) for score in scores]))
                for key in ("bias", "median_error", "mean_error", "within_2_sd")
            }
            print("        left out: " + ", ".join(f"{key} {value:.3f}" for key, value in middle.items()))
    rng = np.random.default_rng(0)
    rows: list[list[float]] = []
    for scene in scenes:
        lens = [Lens(0.035, number, 1.7, focus_tolerance=0.1, aperture_tolerance=0.05) for number in (8, 2.8)]
        views = [
            View(view.image, one, view.pixel_angle, mask=view.mask) for view, one in zip(scene.views, lens, strict=True)
        ]
        far = np.nanmedian(scene.distance) > 1.7
        with_limits = recover_depth(views, near=1.7 if far else None, far=None if far else 1.7, align=True)
        use = with_limits.valid & (scene.distance > 1.8 if far else scene.distance < 1.5)
        places = np.argwhere(use)
        if len(places) < 500:
            continue
        maps = [with_limits]
        for points in (1, 2):
            chosen = places[rng.choice(len(places), points, replace=False)]
            maps.append(with_known_points(with_limits, [(x, y, scene.distance[y, x]) for y, x in chosen.tolist()]))
        offs = [np.abs(one.vergence - 1 / scene.distance)[use] for one in maps]
        rows.append([float(np.median(off)) for off in offs])
        rows[-1] += [float((off < 2 * one.total_sd[use]).mean()) for off, one in zip(offs, maps, strict=True)]
    print("  measured points, taken at random: 0, 1, 2; medians over rooms of each room's median error and coverage")
    print("        " + "  ".join(f"{value:.3f}" for value in np.median(rows, axis=0)))


def dual_pixels(folder: Path) -> None:
    """Calibrate the halves on the sheet at 0.6 m, and estimate the depth of scenes."""
    lens = Lens(0.0496, 4, 0.947, focus_tolerance=0.05)  # marked 1 m, measured from the sensor
    angle = 46.9e-6 / lens.sensor_distance

    def views(name: str, optics: tuple[DualPixel, DualPixel]) -> list[View]:
        images = [read_photograph(folder / name / f"{half}.png") for half in "lr"]
        return [View(image.luminance, one, angle, mask=image.mask) for image, one in zip(images, optics, strict=True)]

    fit = calibrate_dual_pixel(views("sheet_0600_f4", DualPixel.pair(lens)), 0.6)
    field = " ".join(f"{value:+.2f}" for value in fit.left.field)
    print(f"\nDual pixels: asymmetry {fit.left.asymmetry:.3f}, field {field}, scatter {fit.scatter:.3f}")
    for path in sorted(folder.iterdir()):
        if not path.is_dir() or path.name.endswith("f20"):
            continue
        depth = recover_depth(views(path.name, (fit.left, fit.right)))
        distance = np.full(depth.shape, 0.6)
        if (path / "depth.png").exists():
            distance = read_distances(path / "depth.png", scale=10 / 255, fill=False).metres
            rows, columns = (np.arange(n) * m // n for n, m in zip(depth.shape, distance.shape, strict=True))
            distance = distance[rows[:, None], columns]
        print(f"  {path.name:14} {agreement(depth, distance)}")


def edges(folder: Path) -> None:
    """Predict the distance of one edge from the other two."""
    readings = []
    for path in sorted(folder.glob("*cm-*.png")):
        lens = Lens(0.018, 3.5, 0.25)
        blur = measure_target(View(read_photograph(path).luminance, lens, 4.7e-6 / lens.sensor_distance))
        readings.append(Reading(float(path.name.split("cm")[0]) / 100, 3.5, 0.25, *(4.7e-6 * part for part in blur)))
    print("\nAn edge, predicted from the other distances")
    for distance in sorted({one.distance for one in readings}):
        camera = calibrate([one for one in readings if one.distance != distance], 0.018, 4.7e-6, Priors(focus_sd=0.05))
        for one in readings:
            if one.distance == distance:
                found = camera.predict(one)
                off = found.vergence - 1 / (distance + camera.offset)
                print(f"  {distance:4.2f} m: {off:+.3f} D, stated {found.vergence_sd:.3f}")


def main() -> None:
    """Print the results of every available data set."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--rooms", type=int, default=20, help="how many rooms, of those in order")
    asked = parser.parse_args()
    warnings.simplefilter("ignore", FocalGradientWarning)
    parts: dict[str, Callable[[Path], None]] = {
        "dual_pixel": dual_pixels,
        "edge_at_distances": edges,
        "indoor_pairs": lambda folder: rooms(folder, asked.rooms),
    }
    for name, part in parts.items():
        if (asked.data / name).is_dir():
            try:
                part(asked.data / name)
            except InputError as error:
                print(f"{name}: {error}")


if __name__ == "__main__":
    main()
