"""Depth of walls from views of eyes with measured aberrations, by estimators with more or less knowledge of the optics.

    python benchmarks/depth_of_people.py [--eyes N] [--distances N] [--workers N | --scheduler ADDRESS] [--out DIR]
        [FOLDER]

With --out, the results of each eye are stored in DIR, and the same command continues an interrupted run.

FOLDER contains mean_6mm.csv and covariance_6mm.csv of a population's Zernike coefficients (micrometres, in the OSA
order, over 6 mm), as in Thibos, Bradley & Hong (2002). Without it a substitute of our choice is used: independent
coefficients with mean 0 and standard deviations that halve with each radial order.

Each eye sees walls at several distances through pupils of 3 and 5 mm, in two wavebands, and at two moments. Depth is
estimated (a) with the eye's own optics, (b) with those of the mean eye, (c) with what an estimator has learned from its
own views of walls at known distances (`learned.py`). Sphere and cylinder are corrected, as by spectacles, and the eye's
accommodation is known to the estimator.

Also printed, for every eye: how well a single patch determines the side of focus, with the eye's odd aberrations only,
with its even ones only, with all, and with two wavebands.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np
from learned import Experience, learned_optics

sys.path.insert(0, str(Path(__file__).parents[1] / "analysis"))

from population import (
    CORRELATION,
    KINDS,
    NEAR,
    NOISE,
    PIXEL,
    PUPILS,
    Look,
    Row,
    at_focus,
    cones_of,
    drawn,
    population,
    read,
    seen,
    walls,
)

from focalgradient.errors import InputError
from focalgradient.eye import Cones, Eye
from focalgradient.eye.light import Band
from focalgradient.files import read_bytes, write_whole
from focalgradient.optics import Optics
from focalgradient.parallel import completed, shared

READERS = ("own", "mean", "learned")

KEPT: dict[str, Callable[[int, int], bool]] = {
    "odd aberrations": lambda n, m: n % 2 == 1,
    "even aberrations": lambda n, m: n % 2 == 0,
    "all aberrations": lambda n, m: True,
    "no aberrations": lambda n, m: False,
}


def measured(job: tuple[Look, Sequence[float]]) -> tuple[list[Row], Row, float]:
    """Score every estimator, kind of views and wall; add the evidence on the side of focus, and processor seconds.

    The job contains the eye and the coefficients of the mean eye.
    """
    began = process_time()
    look, mean = job
    eye = at_focus(look.coefficients, look.pupil)
    aberrations = at_focus(mean, look.pupil).aberrations
    rows: list[Row] = []
    for kind in KINDS:
        seed = 1000 * look.number
        cones = cones_of(kind, eye)
        experience = Experience.of(cones, PIXEL, 1 / NEAR, noise=NOISE, correlation=CORRELATION, seed=seed)
        readers: dict[str, Sequence[Optics]] = {
            "own": cones,
            "mean": [replace(one, eye=replace(one.eye, aberrations=aberrations)) for one in cones],
            "learned": learned_optics(experience, cones),
        }
        for place, beyond in enumerate(look.beyond):
            views = seen(cones, beyond, seed + 1 + place)
            for reader, taken in readers.items():
                about: Row = {"eye": look.number, "pupil_mm": 1e3 * look.pupil, "views": kind, "reader": reader}
                rows.append({**about, "beyond_D": beyond, **read(views, taken, beyond)})
    return rows, {"eye": look.number, "pupil_mm": 1e3 * look.pupil, **sides(eye)}, process_time() - began


def sides(eye: Eye, defocus: float = 0.5, side: int = 64) -> dict[str, float]:
    """Return the evidence (nats) in a patch of side x side arcmin for `defocus` beyond focus against the same nearer.

    It is the mean of the two Kullback-Leibler divergences of the retinal images of a natural texture with a relative SD
    of 0.2, with noise; 5 nats imply errors in about one patch of a thousand. Focus is defined as the maximum transfer
    of the eye with these aberrations.
    """
    down, right = np.fft.fftfreq(side)[:, None] / PIXEL, np.fft.rfftfreq(side) / PIXEL
    radius = np.hypot(down, right) * PIXEL
    radius[0, 0] = np.inf
    natural = np.where(radius < 0.5, 1 / radius**2, 0)
    twice = np.where(np.arange(natural.shape[1]) > 0, 2.0, 1.0)
    over_noise = natural * (0.2 / NOISE) ** 2 * side**2 / (natural * twice).sum()
    near, found = np.linspace(-0.4, 0.4, 17), {}
    for name, keeps in KEPT.items():
        one = replace(eye, aberrations=tuple(term for term in eye.aberrations if keeps(*term[:2])))
        alone = Cones.of(one, "L+M", wavelengths=1)
        passed = np.abs(alone.through_focus(down[::2], right[::2], alone.focus_vergence + near)).sum(axis=(1, 2))
        for colour, wavelengths in (("one wavelength", 1), ("daylight", 5), ("two bands", 5)):
            bands: tuple[Band, ...] = ("L+M", "S") if colour == "two bands" else ("L+M",)
            cones = [Cones.of(one, band, wavelengths=wavelengths) for band in bands]
            # near 0 the transfer is symmetric for odd aberrations, with its maximum exactly at 0
            best = cones[0].focus_vergence + near[passed.argmax()]
            seen = np.stack([cone.through_focus(down, right, best + defocus * np.array([-1, 1])) for cone in cones])
            covariance = np.einsum("alyx,blyx->lyxab", seen, seen.conj()) * over_noise[..., None, None]
            if len(bands) == 2:  # independent power of the bands
                covariance[..., 0, 1] *= CORRELATION
                covariance[..., 1, 0] *= CORRELATION
            first, second = covariance + np.eye(len(bands))
            apart = np.linalg.solve(first, second) + np.linalg.solve(second, first)
            nats = (apart.trace(axis1=-2, axis2=-1).real / 2 - len(bands)) * twice / 2
            found[f"{name}, {colour}"] = float(nats.sum())
    return found


def table(rows: Sequence[Row]) -> list[str]:
    """Return medians over eyes and walls for each pupil, kind of views and estimator."""
    lines = [
        "pupil  views    optics    valid %  median error D  side right %  within 2 sd %  |  all pixels: error D  "
        "side right %"
    ]
    for pupil in sorted({float(row["pupil_mm"]) for row in rows}):
        for kind in KINDS:
            for reader in READERS:
                some = [r for r in rows if (r["pupil_mm"], r["views"], r["reader"]) == (pupil, kind, reader)]
                claimed = [r for r in some if r["valid"]]

                def middle(name: str, of: Sequence[Row], how: object = np.median) -> float:
                    values = [float(row[name]) for row in of if not np.isnan(float(row[name]))]
                    return float(how(values)) if values else np.nan  # type: ignore

                lines.append(
                    f"{pupil:g} mm   {kind:8} {reader:8} {100 * middle('valid', some, np.mean):7.0f} "
                    f"{middle('median_error_D', claimed):14.3f} {100 * middle('side_right', claimed, np.mean):13.1f} "
                    f"{100 * middle('within_2_sd', claimed, np.mean):13.0f}"
                    f"  | {middle('unmasked_error_D', some):19.3f} {100 * middle('unmasked_side', some, np.mean):14.1f}"
                )
    return lines


def side_table(of: Sequence[Row]) -> list[str]:
    """Return medians over eyes of the evidence on the side of focus."""
    lines = ["pupil  what tells 0.5 D beyond focus from 0.5 D nearer     median nats  eyes above 5"]
    for pupil in sorted({float(row["pupil_mm"]) for row in of}):
        some = [row for row in of if row["pupil_mm"] == pupil]
        for name in some[0]:
            if name not in ("eye", "pupil_mm"):
                values = np.array([float(row[name]) for row in some])
                lines.append(f"{pupil:g} mm   {name:47} {np.median(values):12.2f} {100 * np.mean(values > 5):11.0f} %")
    return lines


def kept(file: Path | None, settings: Row) -> tuple[list[Row], list[Row], float]:
    """Read the rows, side evidence and processor seconds of an earlier run with the same settings from `file`."""
    if file is None or not file.exists():
        return [], [], 0.0
    before = json.loads(read_bytes(file))
    if before.get("settings") != settings:
        raise InputError(
            f"{file} holds results of another population or other walls: give the options it was made with, or "
            "another --out."
        )
    return before["rows"], before["sides"], before["seconds"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--eyes", type=int, default=100)
    parser.add_argument("--distances", type=int, default=20)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--scheduler")
    parser.add_argument("--out", type=Path, help="folder for people.json, which analysis/people.py draws")
    given = parser.parse_args()
    people = population(given.folder)
    mean = tuple(np.asarray(people.mean_um, float).tolist())
    beyond = walls(given.distances)
    jobs = [
        (Look(number, pupil, drawn(people, number), tuple(beyond.tolist())), mean)
        for number in range(given.eyes)
        for pupil in PUPILS
    ]
    made_of = hashlib.sha256(np.asarray(people.mean_um, float).tobytes() + np.asarray(people.covariance_um2).tobytes())
    settings: Row = {"population": made_of.hexdigest(), "beyond_D": " ".join(f"{one:.6g}" for one in beyond)}
    file = given.out and given.out / "people.json"
    rows, telling, seconds = kept(file, settings)
    done = {(row["eye"], row["pupil_mm"]) for row in telling}
    jobs = [job for job in jobs if (job[0].number, 1e3 * job[0].pupil) not in done]
    with shared(given.workers, given.scheduler) as executor:
        for number, (some, side, took) in completed(executor, measured, jobs):
            rows, telling, seconds = [*rows, *some], [*telling, side], seconds + took
            print(f"eye {jobs[number][0].number}, {1e3 * jobs[number][0].pupil:g} mm: {took:.0f} s", flush=True)
            if file is not None:
                file.parent.mkdir(parents=True, exist_ok=True)
                state = {"settings": settings, "rows": rows, "sides": telling, "seconds": seconds}
                write_whole(file, json.dumps(state).encode())
    print("\n".join([*table(rows), "", *side_table(telling)]))
    for pupil in PUPILS:
        eyes = len({row["eye"] for row in telling if row["pupil_mm"] == 1e3 * pupil})
        print(f"{eyes} eyes with {1e3 * pupil:g} mm, {len(beyond)} walls each")
    print(f"{seconds:.0f} s of processor time")


if __name__ == "__main__":
    main()
