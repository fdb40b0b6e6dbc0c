"""How accurate the default method is on real photographs, and on walls whose blur has the assumed shape or another.

    python benchmarks/photographs.py DATA [--maps DIR]

DATA is a folder with any of ``canon_rf50_flat`` (f4.png, f20.png), ``printed_squares`` (50cm-f10-1.jpg, ...) and
``breakfast`` (breakfast_near.png, breakfast_far.png); what is absent is left out. A row gives the share of valid
pixels, the median vergence, its scatter over the frame (interquartile range / 1.35), the median standard deviation, the
share within two and beyond five of them (about the truth, or about the frame's median where only that it is flat is
known) and the model error tau by the split-band test. `--maps` draws the depth maps, to be looked at.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from focalgradient import DepthMap, Lens, View, recover_depth
from focalgradient.calibration import Priors, Reading, calibrate_pairs, fit_field, pair_blur
from focalgradient.errors import InputError
from focalgradient.photographs import read_photographs
from focalgradient.psf import PsfName, transfer

Map = tuple[list[View], DepthMap]

HEAD = f"{'case':44}{'valid':>6}{'median':>9}{'scatter':>9}{'sd':>8}{'< 2 sd':>8}{'> 5 sd':>8}{'tau':>7}"


def row(name: str, depth: DepthMap, truth: float | None = None, flat: bool = True) -> str:
    """One line of the table."""
    valid = depth.valid
    tau = depth.details["split_band"]["tau"]
    if valid.sum() < 100:
        return f"{name:44}{valid.mean():6.2f}  rejected{'':41}{tau:7.3f}"
    vergence, sd = depth.vergence[valid], depth.vergence_sd[valid]
    scatter = float(np.subtract(*np.percentile(vergence, [75, 25]))) / 1.35
    text = f"{name:44}{valid.mean():6.2f}{np.median(vergence):9.4f}{scatter:9.4f}{np.median(sd):8.4f}"
    off = np.abs(vergence - (np.median(vergence) if truth is None else truth)) / sd
    share = f"{(off < 2).mean():8.3f}{(off > 5).mean():8.3f}" if flat or truth is not None else f"{'':16}"
    return f"{text}{share}{tau:7.3f}"


def photographed(paths: Sequence[Path], lenses: Sequence[Lens], pitch: float, encoding: str) -> list[View]:
    photographs = read_photographs(paths, encoding)  # type: ignore[arg-type]
    return [
        View(photo.luminance, lens, pitch / lens.sensor_distance, mask=photo.mask)
        for photo, lens in zip(photographs, lenses, strict=True)
    ]


def halves(views: Sequence[View]) -> dict[str, list[View]]:
    """The left and right, upper and lower half of views."""
    height, width = views[0].shape
    parts: dict[str, tuple[slice, slice]] = {
        "left": np.s_[:, : width // 2],
        "right": np.s_[:, width // 2 :],
        "top": np.s_[: height // 2, :],
        "bottom": np.s_[height // 2 :, :],
    }
    return {
        name: [View(np.ascontiguousarray(view.image[part]), view.optics, view.pixel_angle) for view in views]
        for name, part in parts.items()
    }


def sheet(folder: Path) -> dict[str, Map]:
    """A flat sheet at f/4 and f/20, and how well one half of it predicts the other."""
    views = photographed(
        [folder / "f20.png", folder / "f4.png"], [Lens(0.0496, n, 0.945) for n in (20, 4)], 46.9e-6, "srgb"
    )
    maps: dict[str, Map] = {}
    for name, align in (("sheet", False), ("sheet, aligned", True)):
        maps[name] = views, recover_depth(views, near=0.3, far=0.945, align=align)
        print(row(f"{name} (about its median)", maps[name][1]))
    found = fit_field([maps["sheet, aligned"][1]], [views])
    print(
        f"  left-out parts of the frame scatter by {found.left:.3f} D about a polynomial, {found.left_without:.3f} D "
        f"about one number; {found.coverage:.3f} of their pixels within 2 sd"
    )
    per_dioptre = 0.0496 / 4 / 2 / views[1].pixel_angle
    radius = {name: pair_blur(part, (20, 4)).radius for name, part in halves(views).items()}
    for one, other in (("left", "right"), ("top", "bottom")):
        apart = abs(radius[one] - radius[other]) / per_dioptre
        print(f"  calibrated on the {one} half, the {other} half is off by {apart:.3f} D")
    return maps


def squares(folder: Path) -> dict[str, Map]:
    """Printed squares at two distances: depth by default, and exposures left out of a calibration from pairs."""
    pitch = 4.7e-6
    maps: dict[str, Map] = {}
    lenses = [Lens(0.018, n, 0.25) for n in (16, 10)]
    readings: dict[tuple[int, int], Reading] = {}
    for cm in (50, 150):
        for exposure in (1, 2, 3):
            paths = [folder / f"{cm}cm-f{n}-{exposure}.jpg" for n in (16, 10)]
            views = photographed(paths, lenses, pitch, "srgb")
            name = f"squares {cm} cm, exposure {exposure}"
            maps[name] = views, recover_depth(views, near=0.25, align=True)
            print(row(name, maps[name][1]))
            blur = pair_blur(views, (16, 10))
            readings[cm, exposure] = Reading(
                cm / 100, 10, None, 0.5 * blur.radius * pitch, 0.5 * blur.radius_sd * pitch
            )
    for left_out in (1, 2, 3):
        others = [reading for (_, exposure), reading in readings.items() if exposure != left_out]
        camera = calibrate_pairs(others, (10, 16), 0.018, pitch, Priors())
        for cm in (50, 150):
            found = camera.predict(readings[cm, left_out])
            error = found.vergence - 1 / (cm / 100 + camera.offset)
            stated = f"(sd {found.vergence_sd:.3f})"
            print(f"  calibrated without exposure {left_out}, {cm} cm is off by {error:+.3f} D {stated}")
    by_commands(folder)
    return maps


def by_commands(folder: Path) -> None:
    """Printed squares by `focalgradient calibrate` and `depth --method edges`: an exposure that was left out."""
    head = "[camera]\nfocal_length_mm = 18.0\npixel_pitch_um = 4.7\nencoding = 'srgb'\n"
    with tempfile.TemporaryDirectory() as scratch:
        text = head + "".join(
            f"[[view]]\nimage = '{folder.resolve()}/{cm}cm-f{n}-{e}.jpg'\ndistance_m = {cm / 100}\nf_number = {n}\n"
            for cm in (50, 150)
            for n in (10, 16)
            for e in (2, 3)
        )
        Path(scratch, "targets.toml").write_text(text)
        command("calibrate", f"{scratch}/targets.toml", "--out", f"{scratch}/camera.toml")
        for cm in (50, 150):
            command(
                *("depth", *(f"{folder}/{cm}cm-f{n}-1.jpg" for n in (16, 10)), "--f-number", "16", "--f-number", "10"),
                *("--method", "edges", "--align", "--near", "0.35", "--calibration", f"{scratch}/camera.toml"),
                *("--out", f"{scratch}/{cm}"),
            )
            depth = DepthMap.load(f"{scratch}/{cm}/depth.npz")
            error = (1 / depth.distance - 100 / cm)[depth.valid]
            covered = (np.abs(error) < 2 * depth.vergence_sd[depth.valid]).mean()
            print(f"  by edges, calibrated without exposure 1, {cm} cm is off by {np.median(error):+.3f} D", end="")
            print(f", {covered:.3f} within 2 sd")


def command(*words: str) -> None:
    subprocess.run([str(Path(sys.executable).parent / "focalgradient"), *words], check=True, capture_output=True)


def breakfast(folder: Path) -> dict[str, Map]:
    """Two focus distances of one aperture, telecentric; no dense truth."""
    lenses = [Lens(0.025, 8.3, focus) for focus in (0.869, 0.529)]
    photographs = read_photographs([folder / f"breakfast_{name}.png" for name in ("far", "near")], "linear")
    views = [View(p.luminance, lens, 25e-6 / 0.025, mask=p.mask) for p, lens in zip(photographs, lenses, strict=True)]
    depth = recover_depth(views)
    print(row("breakfast (no truth)", depth, flat=False))
    return {"breakfast": (views, depth)}


def wall(lenses: Sequence[Lens], distance: float, psf: PsfName, k: float, noise: float, seed: int) -> list[View]:
    """Views of a textured wall, by filtering."""
    pixel, size, margin = 3.2e-4, 448, 64
    frequency = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size))
    random = np.random.default_rng(seed)
    spectrum = np.fft.rfft2(random.standard_normal((size, size))) / np.maximum(frequency, 1 / size)
    spectrum[0, 0] = 0
    scale = 0.2 / np.fft.irfft2(spectrum).std()

    def image(lens: Lens) -> NDArray[np.float32]:
        blurred = spectrum * transfer(frequency, lens.blur_radius(distance) / pixel, psf, k)
        clean = 1 + scale * np.fft.irfft2(blurred)[margin:-margin, margin:-margin]
        return (clean + noise * random.standard_normal(clean.shape)).astype(np.float32)

    return [View(image(lens), lens, pixel) for lens in lenses]


def walls() -> None:
    """Right and wrong shapes of blur."""
    shapes: list[tuple[PsfName, float]] = [("disc", 0.5), ("gaussian", 0.5), ("blend", 0.35)]
    for real, k in shapes:
        for supposed in ("disc", "gaussian"):
            for distance in (1.05, 1.6):
                views = wall([Lens(0.025, n, 0.85) for n in (16, 4)], distance, real, k, 0.01, 1)
                depth = recover_depth(views, near=0.85, psf=supposed)
                print(row(f"wall at {distance:g} m, {real} as {supposed}", depth, 1 / distance))


def draw(maps: dict[str, Map], folder: Path) -> None:
    from focalgradient.plotting import depth_figure

    folder.mkdir(parents=True, exist_ok=True)
    for name, (views, depth) in maps.items():
        figure = depth_figure(views, depth, names=[f"{name}, view {n}" for n in range(1, len(views) + 1)])
        figure.savefig(folder / f"{name.replace(' ', '_').replace(',', '')}.png")


def main() -> None:
    parser = argparse.ArgumentParser(description="the default method on photographs")
    parser.add_argument("data", type=Path, help="folder with the photographs")
    parser.add_argument("--maps", type=Path, help="draw the depth maps here")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    print(HEAD)
    maps: dict[str, Map] = {}
    for name, case in (("canon_rf50_flat", sheet), ("printed_squares", squares), ("breakfast", breakfast)):
        if (options.data / name).is_dir():
            try:
                maps |= case(options.data / name)
            except InputError as error:
                print(f"{name}: {error}")
    walls()
    if options.maps:
        draw(maps, options.maps)


if __name__ == "__main__":
    main()
