"""Dark squares on blank paper, photographed and stored as JPEG: paper far from any square claims no depth."""

from __future__ import annotations

import warnings

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from focalgradient import Lens, View, recover_depth
from focalgradient.errors import FocalGradientWarning
from focalgradient.photographs.images import srgb_to_linear
from focalgradient.psf import pixel_transfer, transfer

PIXEL, TILE, SIDE, GAP = 3.2e-4, 512, 24, 80
DISTANCE = 1.4


def views(quality: int) -> list[View]:
    """The squares at f/16 and f/4, focused at 0.85 m, with photon and read noise, in 8 bits."""
    place = np.arange(TILE) % GAP < SIDE
    paper = np.where(np.outer(place, place), 0.05, 0.8)
    down, right = np.fft.fftfreq(TILE)[:, None], np.fft.fftfreq(TILE)
    spectrum = np.fft.fft2(paper) * pixel_transfer(down, right)
    made = []
    for number, lens in enumerate(Lens(0.025, n, 0.85) for n in (16, 4)):
        blur = transfer(np.hypot(down, right), lens.blur_radius(DISTANCE) / PIXEL, "disc")
        light = np.fft.ifft2(spectrum * blur).real[60:360, 50:450]
        light += np.random.default_rng(number).standard_normal(light.shape) * np.sqrt(1e-5 + 3e-5 * light.clip(0))
        made.append(View(_stored(light, quality), lens, PIXEL))
    return made


def _stored(light: NDArray[np.float64], quality: int) -> NDArray[np.float32]:
    light = light.clip(0.0031308, 1)  # darker than paper and print ever are, sRGB is straight
    pixels = np.rint(255 * (1.055 * light ** (1 / 2.4) - 0.055)).astype(np.uint8)
    data = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return srgb_to_linear(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE) / 255).astype(np.float32)


@pytest.mark.parametrize("quality", [90, 95])
def test_blank_paper_in_jpeg_claims_no_depth(quality: int) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FocalGradientWarning)
        depth = recover_depth(views(quality), near=0.85)
    off = np.abs(depth.vergence - 1 / DISTANCE)[depth.valid] / depth.vergence_sd[depth.valid]
    assert depth.valid.mean() > 0.25  # 39 % of the frame lies within 1.6 windows of a square
    assert (off > 5).mean() < 0.005
    assert (off < 2).mean() > 0.92
