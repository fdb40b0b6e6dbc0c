"""Ordinary user errors with `focalgradient depth`: which lead to a wrong depth map, and which without a warning.

    python benchmarks/depth_slips.py [--only WORD] [--seed 1]

A slanted plane of natural texture, from 0.9 m to 2.2 m, is photographed with two apertures and with two foci. Then one
error at a time is introduced: in a unit, an order, a file, by an editor, by camera movement. The command is run as by a
user. Outcomes: *refused* (exit code 2), *rejected* (less than 2 % of the pixels valid), *right* (at least 85 % of the
claimed distances within two stated SDs and at most 3 % beyond five, or the median error below 1 %), otherwise *wrong*,
with a warning that the correct photographs do not cause, or *silent*. Errors that blur cannot reveal (a common scale of
all apertures, a common shift of all foci) are marked.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from reruns import run_command
from scipy import ndimage

from focalgradient import Lens, cast
from focalgradient.psf import transfer
from focalgradient.scenes import slant
from focalgradient.srgb import linear_to_srgb, srgb_to_linear

Picture = NDArray[np.float64]

HEIGHT, WIDTH, MARGIN = 240, 320, 24
FOCAL, PITCH = 25.0, 8.0
"""Focal length (mm) and pixel pitch (um) of the camera."""

NOISE = 0.004
"""Noise standard deviation relative to the brightest pixel."""

SETUPS = {"two apertures": ((16.0, 0.85), (5.6, 0.85)), "two foci": ((5.6, 0.85), (5.6, 1.5))}
"""f-number and focus distance (m) of each photograph."""


@dataclass(frozen=True)
class Given:
    """Input of the command: pictures (linear, 0 to 1), and stated values."""

    pictures: tuple[Picture, ...]
    f_numbers: tuple[float, ...]
    foci: tuple[float, ...]
    truth: Picture
    focal: float = FOCAL
    pitch: float = PITCH
    near: float | None = 0.85
    far: float | None = None
    options: tuple[str, ...] = ()
    encodings: tuple[str, ...] = ("linear", "linear")
    stated_encoding: str | None = "linear"
    bits: int = 16
    quality: int | None = None


Slip = Callable[[Given], Given]
SLIPS: dict[str, Slip] = {}
UNSEEN: set[str] = set()
"""Errors after which the views are exactly those of another scene or camera, which blur cannot reveal."""


def slip(name: str, *, unseen: bool = False) -> Callable[[Slip], Slip]:
    def register(make: Slip) -> Slip:
        SLIPS[name] = make
        if unseen:
            UNSEEN.add(name)
        return make

    return register


def stated(name: str, change: Callable[[Given], dict[str, object]], *, unseen: bool = False) -> None:
    """Register an error in stated values, as the fields that it changes."""
    slip(name, unseen=unseen)(lambda given: replace(given, **change(given)))  # type: ignore[arg-type]


def edited(name: str, edit: Callable[[Picture], Picture], which: Sequence[int] = (1,)) -> None:
    """Register a change of the pictures `which`."""

    def make(given: Given) -> Given:
        changed = [edit(one) if n in which else one for n, one in enumerate(given.pictures)]
        return replace(given, pictures=tuple(changed))

    slip(name)(make)


def _scaled(values: Sequence[float], factor: float) -> tuple[float, ...]:
    return tuple(factor * value for value in values)


# Stated values of the camera
stated("nothing", lambda g: {})
stated("focal length in metres", lambda g: {"focal": g.focal / 1e3})
stated("focal length in centimetres", lambda g: {"focal": g.focal / 10})
stated("focal length of small film (x 1.5)", lambda g: {"focal": g.focal * 1.5}, unseen=True)
stated("focal length of another lens (50 mm)", lambda g: {"focal": 50.0}, unseen=True)
stated("focal length rounded (24 mm)", lambda g: {"focal": 24.0}, unseen=True)
stated("pixel pitch in millimetres", lambda g: {"pitch": g.pitch / 1e3})
stated("pixel pitch in nanometres", lambda g: {"pitch": g.pitch * 1e3})
stated("pixel pitch twice", lambda g: {"pitch": g.pitch * 2}, unseen=True)
stated("pixel pitch half", lambda g: {"pitch": g.pitch / 2}, unseen=True)
stated("focus in millimetres", lambda g: {"foci": _scaled(g.foci, 1e3)})
stated("focus in centimetres", lambda g: {"foci": _scaled(g.foci, 1e2)})
stated("focus in feet", lambda g: {"foci": _scaled(g.foci, 3.281)}, unseen=True)
stated("focus in dioptres", lambda g: {"foci": tuple(1 / f for f in g.foci)}, unseen=True)
stated("focus 5 % off", lambda g: {"foci": _scaled(g.foci, 1.05)}, unseen=True)
stated("focus 20 % off", lambda g: {"foci": _scaled(g.foci, 1.2)}, unseen=True)
stated("focus of one view 10 % off", lambda g: {"foci": (g.foci[0], g.foci[1] * 1.1)})
stated("focus of one view in millimetres", lambda g: {"foci": (g.foci[0], g.foci[1] * 1e3)})
stated("foci in reverse order", lambda g: {"foci": g.foci[::-1]}, unseen=True)
stated("f-numbers in reverse order", lambda g: {"f_numbers": g.f_numbers[::-1]})
stated("one third of a stop in one view", lambda g: {"f_numbers": (g.f_numbers[0], g.f_numbers[1] * 2 ** (1 / 6))})
stated("one stop in one view", lambda g: {"f_numbers": (g.f_numbers[0], g.f_numbers[1] * 2**0.5)})
stated("two stops in one view", lambda g: {"f_numbers": (g.f_numbers[0], g.f_numbers[1] * 2)})
stated("one stop in both views", lambda g: {"f_numbers": _scaled(g.f_numbers, 2**0.5)}, unseen=True)
stated("diameter (mm) for f-number", lambda g: {"f_numbers": tuple(g.focal / n for n in g.f_numbers)}, unseen=True)
stated("all f-numbers alike", lambda g: {"f_numbers": g.f_numbers[:1] * 2})
stated("all foci alike", lambda g: {"foci": g.foci[:1] * 2})
stated("f-numbers and foci exchanged", lambda g: {"f_numbers": g.foci, "foci": g.f_numbers})
stated("telecentric, but it is not", lambda g: {"options": ("--telecentric",)}, unseen=True)
stated("distances from the sensor", lambda g: {"options": ("--distances-from", "sensor")}, unseen=True)
stated("near in millimetres", lambda g: {"near": 850.0, "far": None})
stated("near in centimetres", lambda g: {"near": 85.0, "far": None})
stated("far in centimetres", lambda g: {"far": 220.0})
stated("far before most of the scene", lambda g: {"far": 1.1})
stated("near beyond most of the scene", lambda g: {"near": 1.8})
stated("near and far beyond the scene", lambda g: {"near": 3.0, "far": 8.0})
stated("the other side of focus", lambda g: {"near": 0.4, "far": 0.85}, unseen=True)
stated("no limits", lambda g: {"near": None})

# Encoding of light
stated("sRGB read as linear", lambda g: {"encodings": ("srgb", "srgb")})
stated("linear read as sRGB", lambda g: {"stated_encoding": "srgb"})
stated("one view sRGB, read as linear", lambda g: {"encodings": ("linear", "srgb")})
stated("power law 1/2.2 read as linear", lambda g: {"encodings": ("power", "power")})
stated("contrast raised by an editor", lambda g: {"encodings": ("curve", "curve")})
stated("8 bits, nothing stated, linear", lambda g: {"bits": 8, "stated_encoding": None})
stated("8 bits, linear", lambda g: {"bits": 8})
stated("JPEG 90", lambda g: {"bits": 8, "quality": 90, "encodings": ("srgb",) * 2, "stated_encoding": "srgb"})
stated("JPEG 75", lambda g: {"bits": 8, "quality": 75, "encodings": ("srgb",) * 2, "stated_encoding": "srgb"})
stated("JPEG 40", lambda g: {"bits": 8, "quality": 40, "encodings": ("srgb",) * 2, "stated_encoding": "srgb"})


def _noisy(sd: float, seed: int) -> Callable[[Picture], Picture]:
    return lambda picture: picture + sd * np.random.default_rng([seed, 11]).standard_normal(picture.shape)


def _shift(down: float, right: float) -> Callable[[Picture], Picture]:
    return lambda picture: ndimage.shift(picture, (down, right), order=3, mode="reflect")


def _about_centre(picture: Picture, degrees: float = 0.0, scale: float = 1.0) -> Picture:
    height, width = picture.shape
    matrix = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), degrees, scale)
    turned = cv2.warpAffine(picture, matrix, (width, height), flags=cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REFLECT)
    return np.asarray(turned, float)


def _resized(picture: Picture, width: int, height: int, interpolation: int) -> Picture:
    return np.asarray(cv2.resize(picture, (width, height), interpolation=interpolation), float)


def _eight(picture: Picture) -> NDArray[np.uint8]:
    return np.rint(255 * np.clip(picture, 0, 1)).astype(np.uint8)


def _denoised(picture: Picture) -> Picture:
    """Denoise by non-local means in the encoding of a file, with unchanged mean light."""
    stored = _eight(np.asarray(linear_to_srgb(np.clip(picture, 0, 1)), float))
    light = np.asarray(srgb_to_linear(np.asarray(cv2.fastNlMeansDenoising(stored, h=6), float) / 255), float)
    return light * (picture.mean() / light.mean())


def _smoothed(picture: Picture) -> Picture:
    return cv2.bilateralFilter(picture.astype(np.float32), 5, 0.03, 1.5).astype(float)


def _sharpened(picture: Picture) -> Picture:
    return picture + 0.8 * (picture - ndimage.gaussian_filter(picture, 1.0))


def _enlarged(picture: Picture) -> Picture:
    small = _resized(picture, WIDTH // 2, HEIGHT // 2, cv2.INTER_AREA)
    return _resized(small, picture.shape[1], picture.shape[0], cv2.INTER_CUBIC)


def _moved(length: int) -> Callable[[Picture], Picture]:
    return lambda picture: ndimage.uniform_filter1d(picture, length, axis=1, mode="reflect")


def _otherwise_blurred(shape: str) -> Slip:
    """Return an error in which the more blurred view has another blur shape, of the size that follows from distance."""

    def make(given: Given) -> Given:
        return replace(
            given, pictures=tuple(_shaped(shape, n, f) for n, f in zip(given.f_numbers, given.foci, strict=True))
        )

    return make


# Camera and photographer
edited("displaced by 0.3 pixels", _shift(0.0, 0.3))
edited("displaced by 1 pixel", _shift(0.7, 0.7))
edited("displaced by 3 pixels", _shift(2.0, 2.2))
edited("displaced by 10 pixels", _shift(6.0, 8.0))
edited("rotated by 0.3 degrees", lambda p: _about_centre(p, 0.3))
edited("rotated by 1 degree", lambda p: _about_centre(p, 1.0))
edited("upside down", lambda p: p[::-1, ::-1])
edited("mirrored", lambda p: p[:, ::-1])
edited("magnified by 1 %", lambda p: _about_centre(p, scale=1.01))
edited("magnified by 5 %", lambda p: _about_centre(p, scale=1.05))
edited("moved by 3 pixels in the first exposure", _moved(3), (0,))
edited("moved by 3 pixels in the second exposure", _moved(3))
edited("moved by 5 pixels in both exposures", _moved(5), (0, 1))
edited("twice the exposure time in one view", lambda p: p * 0.5)
edited("light from the side in one view", lambda p: p * np.linspace(0.7, 1.2, p.shape[1]))
edited("a shadow in one view", lambda p: p * (1 - 0.4 * ndimage.gaussian_filter(_patch(p.shape), 12)))
edited("vignetting in one view", lambda p: p * (1 - 0.3 * _radius(p.shape) ** 2))
edited("one view clipped", lambda p: np.minimum(p * 1.8, 1.0))
edited("one view nearly black", lambda p: p * 0.02)
edited("black level of 5 % in one view", lambda p: p + 0.05)
edited("black level of 5 % in both views", lambda p: p + 0.05, (0, 1))
edited("ISO of one view (noise 3 %)", _noisy(0.03, 1), (0,))
edited("ISO of the other view (noise 3 %)", _noisy(0.03, 2))
edited("noise of 3 % in both views", lambda p: _noisy(0.03, int(1e6 * p.mean()))(p), (0, 1))
edited("hot pixels", lambda p: np.where(np.random.default_rng(3).random(p.shape) < 5e-4, 1.0, p), (0, 1))
edited("flicker in bands", lambda p: p * (1 + 0.05 * np.sin(np.arange(p.shape[0]) / 7))[:, None])
edited("dust on the sensor", lambda p: p * (1 - 0.3 * (_spots(p.shape))), (0, 1))
edited("a thing moved", lambda p: np.where(_patch(p.shape) > 0, np.roll(p, 6, 1), p))
edited("another scene", lambda p: np.rot90(np.rot90(p))[::-1])
slip("one picture twice")(lambda g: replace(g, pictures=(g.pictures[0], g.pictures[0].copy())))
slip("the other picture twice")(lambda g: replace(g, pictures=(g.pictures[1], g.pictures[1].copy())))
for _shape in ("gaussian", "annulus", "hexagon", "half disc"):
    slip(f"blur: {_shape}")(_otherwise_blurred(_shape))

# Editing
edited("one view denoised", _denoised)
edited("both views denoised", _denoised, (0, 1))
edited("one view smoothed (bilateral)", _smoothed)
edited("one view sharpened", _sharpened)
edited("both views sharpened", _sharpened, (0, 1))
edited("one view by the median of 3 x 3", lambda p: ndimage.median_filter(p, 3))
edited("one view enlarged from half size", _enlarged)
edited("both views enlarged from half size", _enlarged, (0, 1))
edited("local contrast of one view raised", lambda p: _local_contrast(p))


@slip("both views reduced to half", unseen=True)
def _reduced(given: Given) -> Given:
    small = [_resized(one, WIDTH // 2, HEIGHT // 2, cv2.INTER_AREA) for one in given.pictures]
    return replace(given, pictures=tuple(small), truth=given.truth[::2, ::2])


@slip("both views cropped (nothing wrong)")
def _cropped(given: Given) -> Given:
    part = np.s_[20:200, 30:250]
    return replace(given, pictures=tuple(one[part] for one in given.pictures), truth=given.truth[part])


@slip("one view cropped and enlarged again")
def _one_cropped(given: Given) -> Given:
    part = _resized(given.pictures[1][12:-12, 16:-16], WIDTH, HEIGHT, cv2.INTER_CUBIC)
    return replace(given, pictures=(given.pictures[0], part))


@slip("colour filters interpolated")
def _interpolated(given: Given) -> Given:
    changed = []
    for one in given.pictures:
        colour = cv2.cvtColor(_sixteen(one), cv2.COLOR_BayerBG2BGR)
        changed.append(colour @ np.array([0.0722, 0.7152, 0.2126]) / 65535)
    return replace(given, pictures=tuple(changed))


def _sixteen(picture: Picture) -> NDArray[np.uint16]:
    return np.rint(65535 * np.clip(picture, 0, 1)).astype(np.uint16)


def _patch(shape: tuple[int, ...]) -> Picture:
    patch = np.zeros(shape)
    patch[shape[0] // 3 : shape[0] * 2 // 3, shape[1] // 3 : shape[1] * 2 // 3] = 1
    return patch


def _radius(shape: tuple[int, ...]) -> Picture:
    down, right = np.meshgrid(np.linspace(-1, 1, shape[0]), np.linspace(-1, 1, shape[1]), indexing="ij")
    return np.hypot(down, right) / np.sqrt(2)


def _spots(shape: tuple[int, ...]) -> Picture:
    seeds = (np.random.default_rng(5).random(shape) < 3e-4).astype(float)
    return np.clip(ndimage.gaussian_filter(seeds, 2.0) * 25, 0, 1)


def _local_contrast(picture: Picture) -> Picture:
    return cv2.createCLAHE(2.0, (8, 8)).apply(_sixteen(picture)) / 65535


# The photographs
def _angle(focus: float) -> float:
    return PITCH * 1e-6 / Lens(FOCAL / 1e3, 8.0, focus).sensor_distance


@cache
def _rendered(f_number: float, focus: float, seed: int = 1) -> tuple[Picture, Picture]:
    """Return a linear noise-free picture and distances (m), both with a margin."""
    shape = (HEIGHT + 2 * MARGIN, WIDTH + 2 * MARGIN)
    scene = slant(0.9, 2.2, field=WIDTH * _angle(0.85), seed=seed)
    made = cast(scene, Lens(FOCAL / 1e3, f_number, focus), shape, _angle(focus), samples=256, seed=seed)
    return made.view.image.astype(float), made.distance


def _inner(picture: Picture) -> Picture:
    return picture[MARGIN:-MARGIN, MARGIN:-MARGIN]


_SEED = 1


def _with_noise(light: Picture, number: int) -> Picture:
    return light + NOISE * np.random.default_rng([_SEED, number, 3]).standard_normal(light.shape)


@cache
def _top() -> float:
    return float(_rendered(16.0, 0.85, _SEED)[0].max() * 1.25)


def photographs(setup: str) -> Given:
    """Return correct photographs with correct stated values."""
    shots = SETUPS[setup]
    made = [_rendered(f_number, focus, _SEED) for f_number, focus in shots]
    pictures = [_with_noise(_inner(light) / _top(), n) for n, (light, _) in enumerate(made)]
    f_numbers, foci = zip(*shots, strict=True)
    return Given(tuple(pictures), f_numbers, foci, _inner(made[0][1]))


def _kernel(shape: str, radius: float) -> Picture:
    """Return a point spread function on 41 x 41 pixels; `radius` of the annulus is its outer radius."""
    fine, side = 5, 41
    at = (np.arange(side * fine) - (side * fine - 1) / 2) / fine
    down, right = np.meshgrid(at, at, indexing="ij")
    away = np.hypot(down, right)
    if shape == "annulus":
        inside = (away <= radius) & (away >= 0.45 * radius)
    elif shape == "half disc":
        inside = (away <= radius) & (right >= -0.35 * radius)
    else:
        angle = np.mod(np.arctan2(down, right), np.pi / 3) - np.pi / 6
        # equal in area to the disc: the f-number of a stopped-down lens defines the area
        inside = away * np.cos(angle) <= radius * np.sqrt(np.pi / (6 * np.tan(np.pi / 6)))
    light = inside.reshape(side, fine, side, fine).mean((1, 3))
    total = light.sum()
    if total == 0 or radius < 0.3:
        light = np.zeros((side, side))
        light[side // 2, side // 2] = total = 1.0
    return light / total


def _shaped(shape: str, f_number: float, focus: float) -> Picture:
    """Return a photograph with another blur shape: strips of equal distance, each blurred as a whole."""
    sharp, distance = _rendered(1e4, focus, _SEED)
    lens = Lens(FOCAL / 1e3, f_number, focus)
    radius = lens.blur_radius(distance) / _angle(focus)
    levels = np.arange(0.0, radius.max() + 0.5, 0.25)
    made = np.zeros((len(levels), *sharp.shape))
    for n, level in enumerate(levels):
        if shape == "gaussian":
            frequency = np.hypot(np.fft.fftfreq(sharp.shape[0])[:, None], np.fft.rfftfreq(sharp.shape[1]))
            passed = transfer(frequency, level, "gaussian")
            made[n] = np.fft.irfft2(np.fft.rfft2(sharp) * passed, sharp.shape)
        else:
            made[n] = cv2.filter2D(sharp, -1, _kernel(shape, level), borderType=cv2.BORDER_REFLECT)
    place = np.clip(radius / 0.25, 0, len(levels) - 1)
    lower = np.minimum(place.astype(int), len(levels) - 2)
    share, (down, right) = place - lower, np.indices(sharp.shape)
    blurred = (1 - share) * made[lower, down, right] + share * made[lower + 1, down, right]
    return _with_noise(_inner(blurred) / _top(), int(10 * f_number + 100 * focus))


# The command
def _encoded(picture: Picture, encoding: str) -> Picture:
    light = np.clip(picture, 0, 1)
    if encoding == "srgb":
        return np.asarray(linear_to_srgb(light))
    if encoding == "power":
        return light ** (1 / 2.2)
    if encoding == "curve":
        light = np.asarray(linear_to_srgb(light))
        return light + 0.12 * np.sin(2 * np.pi * (light - 0.5)) / 1.5
    return light


@dataclass(frozen=True)
class Outcome:
    """Result of the command."""

    kind: str
    text: str
    warnings: tuple[str, ...] = ()


def run(given: Given, folder: Path, known: Sequence[str] = ()) -> Outcome:
    """Run the command on the given input; `known` are the warnings that correct photographs also cause."""
    files = []
    for n, (picture, encoding) in enumerate(zip(given.pictures, given.encodings, strict=True)):
        stored = _encoded(picture, encoding)
        pixels = _sixteen(stored) if given.bits == 16 else _eight(stored)
        files.append(folder / (f"{n}.jpg" if given.quality else f"{n}.png"))
        cv2.imwrite(str(files[-1]), pixels, [cv2.IMWRITE_JPEG_QUALITY, given.quality] if given.quality else [])
    args = ["depth", *map(str, files), "--out", str(folder / "out"), "--json"]
    args += ["--focal-length", f"{given.focal:g}", "--pixel-pitch", f"{given.pitch:g}", *given.options]
    for f_number, focus in zip(given.f_numbers, given.foci, strict=True):
        args += ["--f-number", f"{f_number:.6g}", "--focus-distance", f"{focus:.6g}"]
    for name, value in (("--near", given.near), ("--far", given.far), ("--encoding", given.stated_encoding)):
        args += [] if value is None else [name, f"{value}"]
    try:
        code, _, errors = run_command(*args)
    except Exception as crash:  # a traceback is a possible outcome
        return Outcome("FAILED", repr(crash))
    if code == 2:
        return Outcome("refused", errors.strip().splitlines()[-1])
    given_warnings = [str(w) for w in json.loads((folder / "out" / "summary.json").read_text()).get("warnings", [])]
    new = tuple(w for w in given_warnings if w not in known)
    with np.load(folder / "out" / "depth.npz") as saved:
        valid, distance, sd = saved["valid"], saved["distance"], saved["vergence_sd"]
        vergence = saved["vergence"]
    share = float(valid.mean())
    if share < 0.02:
        return Outcome("rejected", f"{share:.1%} valid", new)
    off = np.abs(vergence - 1 / given.truth)[valid] / sd[valid]
    error = float(np.median(np.abs(distance / given.truth - 1)[valid]))
    within, beyond = float((off < 2).mean()), float((off > 5).mean())
    text = f"{share:.0%} valid, median error {error:.1%}, within 2 sd {within:.2f}, beyond 5 sd {beyond:.3f}"
    if (within >= 0.85 and beyond <= 0.03) or error < 0.01:
        return Outcome("right", text, new)
    return Outcome("warned" if new else "silent", text, new)


def main() -> None:
    global _SEED
    parser = argparse.ArgumentParser(description="ordinary slips of `focalgradient depth`")
    parser.add_argument("--only", default="", help="run only slips whose name has this in it")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    _SEED = options.seed
    counts: Counter[str] = Counter()
    print("| slip | setup | outcome | figures | warnings |\n|---|---|---|---|---|")
    for setup in SETUPS:
        with tempfile.TemporaryDirectory() as folder:
            known = run(photographs(setup), Path(folder)).warnings
        for name, make in SLIPS.items():
            if options.only not in name:
                continue
            with tempfile.TemporaryDirectory() as folder:
                outcome = run(make(photographs(setup)), Path(folder), known)
            kind = outcome.kind
            if kind in ("silent", "warned") and name in UNSEEN:
                kind += " (unseen)"
            counts[kind] += 1
            print(f"| {name} | {setup} | {kind} | {outcome.text} | {'; '.join(outcome.warnings)[:160]} |", flush=True)
    print("\n" + ", ".join(f"{kind}: {count}" for kind, count in sorted(counts.items())))
    sys.exit(0)


if __name__ == "__main__":
    main()
