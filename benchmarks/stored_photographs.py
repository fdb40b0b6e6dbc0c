"""Accuracy and stated uncertainty of the default method on rendered flat sheets stored as 8-bit files, such as JPEG.

    python benchmarks/stored_photographs.py [--textures natural] [--distances 0.95 1.4] [--qualities 0 90] [--seeds 3]

Sheets with three textures (natural, amplitude 1/f; dark squares on paper; natural on the left half, blank on the
right), in focus at 0.85 m and seen at f/16 and f/4, with photon and read noise, are stored as JPEG, as 8-bit PNG (100)
or as linear light (0). Each row gives, over the seeds, the valid fraction of the frame, the model error tau by the
split-band test, the median error in dioptres, the median absolute error, the median SD, and the fractions of valid
pixels within two and beyond five SDs.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from focalgradient import Lens, View, recover_depth
from focalgradient.psf import pixel_transfer, transfer
from focalgradient.srgb import linear_to_srgb, srgb_to_linear

PIXEL, TILE = 3.2e-4, 512
LENSES = tuple(Lens(0.025, n, 0.85) for n in (16, 4))
TEXTURES = ("natural", "squares", "half")
STORED = (0, 100, 95, 90, 75)
"""JPEG qualities; 100 for 8-bit PNG, 0 for linear light."""


def paper(texture: str, seed: int) -> NDArray[np.float64]:
    """Return the reflectance of a sheet, TILE x TILE, periodic."""
    random = np.random.default_rng([seed, 7])
    frequency = np.hypot(np.fft.fftfreq(TILE)[:, None], np.fft.fftfreq(TILE))
    spectrum = np.fft.fft2(random.standard_normal((TILE, TILE))) / np.maximum(frequency, 1 / TILE)
    spectrum[0, 0] = 0
    natural = np.fft.ifft2(spectrum).real
    natural = np.clip(0.4 + 0.1 * natural / natural.std(), 0.02, 0.95)
    if texture == "natural":
        return natural
    if texture == "half":
        return np.where(np.arange(TILE) < TILE // 2 + 4, natural, 0.7)
    sheet = np.full((TILE, TILE), 0.8)
    for down, right in random.integers(0, TILE, (120, 2)):
        side = random.integers(4, 14)
        sheet[np.ix_(np.arange(down, down + side) % TILE, np.arange(right, right + side) % TILE)] = random.uniform(
            0.05, 0.5
        )
    return sheet


def views(texture: str, distance: float, quality: int, seed: int) -> list[View]:
    """Return views of the sheet at f/16 and f/4."""
    down, right = np.fft.fftfreq(TILE)[:, None], np.fft.fftfreq(TILE)
    spectrum = np.fft.fft2(paper(texture, seed)) * pixel_transfer(down, right)
    made = []
    for number, lens in enumerate(LENSES):
        blur = transfer(np.hypot(down, right), lens.blur_radius(distance) / PIXEL, "disc")
        light = np.fft.ifft2(spectrum * blur).real[60:360, 50:450]
        random = np.random.default_rng([seed, number])
        light += random.standard_normal(light.shape) * np.sqrt(1e-5 + 3e-5 * light.clip(0))
        made.append(View(stored(light, quality), lens, PIXEL))
    return made


def stored(light: NDArray[np.float64], quality: int) -> NDArray[np.float32]:
    """Return light after storage in a file of that quality."""
    if quality == 0:
        return light.astype(np.float32)
    pixels = np.rint(255 * linear_to_srgb(light.clip(0, 1))).astype(np.uint8)
    if quality < 100:
        pixels = cv2.imdecode(
            cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_GRAYSCALE
        )
    return srgb_to_linear(pixels / 255).astype(np.float32)


def rows(
    textures: tuple[str, ...], distances: tuple[float, ...], qualities: tuple[int, ...], seeds: int
) -> Iterator[str]:
    for texture in textures:
        for quality in qualities:
            for distance in distances:
                off, error, sd, valid, tau = [], [], [], [], []
                for seed in range(seeds):
                    depth = recover_depth(views(texture, distance, quality, seed), near=0.85)
                    at = depth.valid
                    valid.append(at.mean())
                    tau.append(depth.details["split_band"]["tau"])
                    error.append((depth.vergence - 1 / distance)[at])
                    sd.append(depth.vergence_sd[at])
                error, sd = np.concatenate(error), np.concatenate(sd)
                text = f"{texture:9}{quality:5}{distance:6.2f}{np.mean(valid):7.2f}{np.mean(tau):7.3f}"
                if len(error):
                    off = np.abs(error) / sd
                    text += f"{np.median(error):9.4f}{np.median(np.abs(error)):8.4f}{np.median(sd):8.4f}"
                    text += f"{(off < 2).mean():8.3f}{(off > 5).mean():8.4f}"
                yield text


def main() -> None:
    parser = argparse.ArgumentParser(description="the default method on stored photographs of sheets")
    parser.add_argument("--textures", nargs="+", choices=TEXTURES, default=TEXTURES)
    parser.add_argument("--distances", nargs="+", type=float, default=(0.88, 0.95, 1.1, 1.4))
    parser.add_argument("--qualities", nargs="+", type=int, default=STORED)
    parser.add_argument("--seeds", type=int, default=3)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    print(
        f"{'texture':9}{'file':>5}{'m':>6}{'valid':>7}{'tau':>7}{'bias D':>9}{'|error|':>8}{'sd':>8}"
        f"{'< 2 sd':>8}{'> 5 sd':>8}"
    )
    for row in rows(tuple(options.textures), tuple(options.distances), tuple(options.qualities), options.seeds):
        print(row, flush=True)


if __name__ == "__main__":
    main()
