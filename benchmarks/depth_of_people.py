"""Depth of walls from the views of eyes with measured aberrations, by estimators that know more or less of the optics.

    python benchmarks/depth_of_people.py [--eyes N] [--distances N] [--workers N | --scheduler ADDRESS] [--out DIR]
        [FOLDER]

With --out, every eye's result is kept in DIR as it is found, and the same command run again goes on where it stopped.

FOLDER holds mean_6mm.csv and covariance_6mm.csv of a population's Zernike coefficients (micrometres, in the OSA's
order, over 6 mm), as Thibos, Bradley & Hong (2002) give them. Without it a population of our own choice stands in:
independent coefficients about 0, of standard deviations that fall by half with each radial order.

Each eye sees walls at several distances through pupils of 3 and 5 mm, in two wavebands, and at two moments. Depth is
estimated (a) with the eye's own optics, (b) with the mean eye's in their place, (c) with what an estimator has learned
from its own views of walls at known distances (`learned.py`). The lower orders are corrected, as by spectacles, and
the eye's accommodation is known to it.

Also, of every eye: how well a single patch determines the side of focus, with the eye's odd aberrations only, with its
even ones only, with all, and with two wavebands.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time

import numpy as np
from learned import Experience, learned_optics

from focalgradient import View, recover_depth
from focalgradient.errors import InputError
from focalgradient.eye import (
    Cones,
    Eye,
    Oscillation,
    ZernikePopulation,
    accommodation_views,
    band_views,
    osa_order,
    score,
)
from focalgradient.eye.light import Band
from focalgradient.eye.retina import S_FINEST_CPD
from focalgradient.files import read_bytes, write_whole
from focalgradient.optics import Optics
from focalgradient.parallel import completed, shared

PIXEL = np.radians(1 / 60)
FOCUS, SHAPE, NEAR = 2.0, (112, 112), 0.3
PUPILS = (0.003, 0.005)
KINDS = ("bands", "moments")
MOMENTS = [0.125, 0.375]
"""Seconds: the extremes of an oscillation of 0.25 D at 2 Hz."""

READERS = ("own", "mean", "learned")
FARTHEST, NEAREST = -0.9, 1.2
"""Dioptres beyond focus between which walls stand."""

NOISE, CORRELATION = 0.01, 0.95
"""Standard deviation of a pixel's noise over the mean; of the bands' textures with each other's."""

KEPT: dict[str, Callable[[int, int], bool]] = {
    "odd aberrations": lambda n, m: n % 2 == 1,
    "even aberrations": lambda n, m: n % 2 == 0,
    "all aberrations": lambda n, m: True,
    "no aberrations": lambda n, m: False,
}


def population(folder: Path | None) -> ZernikePopulation:
    """The measured population, or the one that stands in for it."""
    if folder is not None:
        return ZernikePopulation.read(folder / "mean_6mm.csv", folder / "covariance_6mm.csv", 0.006)
    sd = np.array([0.0 if osa_order(j)[0] < 3 else 0.2 * 0.5 ** (osa_order(j)[0] - 3) for j in range(28)])
    return ZernikePopulation(np.zeros(28), np.diag(sd**2), 0.006)


def at_focus(coefficients: Sequence[float], pupil: float) -> Eye:
    """The eye of these coefficients, its lower orders corrected by spectacles, accommodated to FOCUS."""
    corrected = [0.0 if j < 6 else float(value) for j, value in enumerate(coefficients)]
    eye = Eye.from_zernike(corrected, pupil, measured_diameter=0.006)
    return replace(eye, accommodation=eye.accommodation + FOCUS - eye.focus_vergence)


def rendered(kind: str, eye: Eye, distance: float, seed: int) -> list[View]:
    """The views of a wall, with noise; bands' textures are correlated."""
    if kind == "bands":
        found = band_views(distance, eye, SHAPE, PIXEL, noise=NOISE, correlation=CORRELATION, seed=seed)
    else:
        found = accommodation_views(distance, eye, MOMENTS, Oscillation(), SHAPE, PIXEL, noise=NOISE, seed=seed)
    return [one.view for one in found]


@dataclass(frozen=True)
class Job:
    """One eye and pupil: its number, coefficients, those of the mean eye, and the walls' dioptres beyond focus."""

    number: int
    pupil: float
    coefficients: tuple[float, ...]
    mean: tuple[float, ...]
    beyond: tuple[float, ...]


Row = dict[str, float | str]


def measured(job: Job) -> tuple[list[Row], Row, float]:
    """Scores of every reader, kind of views and wall; what tells the side; processor seconds."""
    began = process_time()
    eye, mean = (at_focus(some, job.pupil) for some in (job.coefficients, job.mean))
    rows: list[Row] = []
    for kind in KINDS:
        seed = 1000 * job.number
        if kind == "bands":
            optics = [Cones.of(eye, "L+M"), Cones.of(eye, "S", finest_cpd=S_FINEST_CPD)]
        else:
            optics = [Cones.of(one, "L+M") for one in eye.through(MOMENTS, Oscillation())]
        of_mean = [replace(one, eye=replace(one.eye, aberrations=mean.aberrations)) for one in optics]
        experience = Experience.of(optics, PIXEL, 1 / NEAR, noise=NOISE, correlation=CORRELATION, seed=seed)
        readers: dict[str, Sequence[Optics]] = {
            "own": optics,
            "mean": of_mean,
            "learned": learned_optics(experience, optics),
        }
        for place, beyond in enumerate(job.beyond):
            distance = 1 / (FOCUS - beyond)
            views = rendered(kind, eye, distance, seed + 1 + place)
            for reader, taken in readers.items():
                some = [View(view.image, one, PIXEL) for view, one in zip(views, taken, strict=True)]
                depth = recover_depth(some, near=NEAR)
                found = score(depth.vergence, depth.valid, np.full(SHAPE, distance), FOCUS)
                # Where nothing is claimed, what would have been is stated apart.
                whole = score(depth.vergence, np.ones(SHAPE, bool), np.full(SHAPE, distance), FOCUS)
                about: Row = {"eye": job.number, "pupil_mm": 1e3 * job.pupil, "views": kind, "reader": reader}
                extra: Row = {"unmasked_error_D": whole["median_error_D"], "unmasked_side": whole["side_right"]}
                rows.append({**about, "beyond_D": beyond, **found, **extra})
    return rows, {"eye": job.number, "pupil_mm": 1e3 * job.pupil, **sides(eye)}, process_time() - began


def sides(eye: Eye, defocus: float = 0.5, side: int = 64) -> dict[str, float]:
    """How well a patch of side x side minutes of arc tells `defocus` beyond focus from as much nearer: nats.

    The mean of the two Kullback-Leibler divergences of what is seen: a natural texture of a standard deviation of 0.2
    of the mean, with noise. 5 nats leave an error in about one patch of a thousand. Focus is where the eye, of these
    aberrations, passes most.
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
            # About 0 the passed light is even where aberrations are odd, and its maximum exactly there.
            best = cones[0].focus_vergence + near[passed.argmax()]
            seen = np.stack([cone.through_focus(down, right, best + defocus * np.array([-1, 1])) for cone in cones])
            covariance = np.einsum("alyx,blyx->lyxab", seen, seen.conj()) * over_noise[..., None, None]
            if len(bands) == 2:  # what bands do not share
                covariance[..., 0, 1] *= CORRELATION
                covariance[..., 1, 0] *= CORRELATION
            first, second = covariance + np.eye(len(bands))
            apart = np.linalg.solve(first, second) + np.linalg.solve(second, first)
            nats = (apart.trace(axis1=-2, axis2=-1).real / 2 - len(bands)) * twice / 2
            found[f"{name}, {colour}"] = float(nats.sum())
    return found


def table(rows: Sequence[Row]) -> list[str]:
    """Medians over eyes and walls of each pupil, kind of views and reader."""
    lines = ["pupil  views    optics    valid %  median error D  side right %  |  all pixels: error D  side right %"]
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
                    f"{middle('median_error_D', claimed):14.3f} {100 * middle('side_right', claimed, np.mean):13.1f}"
                    f"  | {middle('unmasked_error_D', some):19.3f} {100 * middle('unmasked_side', some, np.mean):14.1f}"
                )
    return lines


def side_table(of: Sequence[Row]) -> list[str]:
    """Medians over eyes of what tells the side of focus."""
    lines = ["pupil  what tells 0.5 D beyond focus from 0.5 D nearer     median nats  eyes above 5"]
    for pupil in sorted({float(row["pupil_mm"]) for row in of}):
        some = [row for row in of if row["pupil_mm"] == pupil]
        for name in some[0]:
            if name not in ("eye", "pupil_mm"):
                values = np.array([float(row[name]) for row in some])
                lines.append(f"{pupil:g} mm   {name:47} {np.median(values):12.2f} {100 * np.mean(values > 5):11.0f} %")
    return lines


def kept(file: Path | None, settings: Row) -> tuple[list[Row], list[Row], float]:
    """What an earlier run of the same settings left in `file`: rows, what tells the side, processor seconds."""
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
    # None within a tenth of a dioptre of focus, where there is no side.
    beyond = np.linspace(FARTHEST, NEAREST, max(given.distances, 2) + 1 - max(given.distances, 2) % 2)
    beyond = beyond[np.abs(beyond) > 0.1][: given.distances]
    jobs = [
        Job(n, pupil, tuple(people.drawn(np.random.default_rng([1, n])).tolist()), mean, tuple(beyond.tolist()))
        for n in range(given.eyes)
        for pupil in PUPILS
    ]
    made_of = hashlib.sha256(np.asarray(people.mean_um, float).tobytes() + np.asarray(people.covariance_um2).tobytes())
    settings: Row = {"population": made_of.hexdigest(), "beyond_D": " ".join(f"{one:.6g}" for one in beyond)}
    file = given.out and given.out / "people.json"
    rows, telling, seconds = kept(file, settings)
    done = {(row["eye"], row["pupil_mm"]) for row in telling}
    jobs = [job for job in jobs if (job.number, 1e3 * job.pupil) not in done]
    with shared(given.workers, given.scheduler) as executor:
        for number, (some, side, took) in completed(executor, measured, jobs):
            rows, telling, seconds = [*rows, *some], [*telling, side], seconds + took
            print(f"eye {jobs[number].number}, {1e3 * jobs[number].pupil:g} mm: {took:.0f} s", flush=True)
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
