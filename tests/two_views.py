"""Two small pictures through two apertures with their settings file, for the command."""

from pathlib import Path

import cv2
import numpy as np
from scipy import ndimage

from focalgradient import Lens

TOML = """\
[camera]
focal_length_mm = 25.0
pixel_pitch_um = 8.0
[[view]]
image = "a.png"
f_number = 16
focus_distance_m = 0.85
[[view]]
image = "b.png"
f_number = 5.6
focus_distance_m = 0.85
"""
DISTANCE = 1.5


def texture(size: int = 96) -> np.ndarray:
    """A seeded 1/f texture of mean 0.5 and standard deviation 0.1."""
    rng = np.random.default_rng(3)
    f = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)[None])
    f[0, 0] = np.inf
    image = np.fft.irfft2(np.fft.rfft2(rng.standard_normal((size, size))) / f, (size, size))
    return 0.5 + 0.1 * image / image.std()


def picture(f_number: float, k: float = 0.5) -> np.ndarray:
    """The texture at DISTANCE, blurred as a Gaussian by an f_number of TOML's camera, 16 bits, 0.5 % noise."""
    lens = Lens(0.025, f_number, 0.85)
    sigma = k * float(lens.blur_radius(DISTANCE)) * lens.sensor_distance / 8e-6
    noise = 0.005 * np.random.default_rng(int(f_number)).standard_normal((96, 96))
    image = ndimage.gaussian_filter(texture(), sigma, mode="wrap") + noise
    return np.rint(65535 * np.clip(image, 0, 1)).astype(np.uint16)


def write(path: Path, pixels: np.ndarray) -> None:
    path.write_bytes(cv2.imencode(path.suffix, pixels)[1].tobytes())
