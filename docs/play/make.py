"""Makes `data.js`, the numbers and pictures of the page: `python docs/play/make.py` (minutes; extras eye, render)."""

from __future__ import annotations

import base64
import io
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import correlate1d, laplace

from focalgradient import Lens
from focalgradient.depth.ratio.disparity import BRIGHTNESS, LEAST_DETAIL
from focalgradient.depth.ratio.energies import CLEAR_OF_NOISE
from focalgradient.design import DepthRatingDesign
from focalgradient.eye import Oscillation, band_light, chromatic_difference
from focalgradient.observers import encoded_stimuli, simulate
from focalgradient.parallel import processes
from focalgradient.render import cast
from focalgradient.report import analyse_ratings
from focalgradient.scenes import spheres
from focalgradient.srgb import linear_to_srgb, srgb_to_linear
from focalgradient.stimuli import StimulusSet
from focalgradient.stimuli.depth_rating import FIELD, FOCAL_LENGTH

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parents[1] / "analysis"))
from simulated import OBSERVERS, SEED, natural_pictures  # noqa: E402

SHAPE = (240, 320)
"""Height and width in pixels of the picture that the page blurs."""

SCENE_SEED = 3
"""Seed of the scene that the page blurs."""

PINHOLE = 1e6
"""f-number of a lens without blur."""

STANDARD, RATED = 0, 2
"""Index of the scene that is the standard of the ratings, and of the scene that is rated."""

RATED_SIZE = 256
"""Width in pixels of the pictures that are rated."""

K = 0.5
"""Sigma of the Gaussian per radius of the blur disc: that of the disc's second moment."""

RADII = np.linspace(0, 24, 193)
"""Blur radii in pixels of the table of detail."""


def text(picture: NDArray[np.uint8], kind: str, **how: Any) -> str:
    """Return a picture as a data address."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, kind, **how)
    return f"data:image/{kind};base64,{base64.b64encode(file.getvalue()).decode()}"


def scene_of() -> tuple[dict[str, Any], NDArray[np.floating]]:
    """Return spheres with 1/f texture as one PNG (red: pinhole picture in sRGB; green: vergence), and its light."""
    pixel_angle = FIELD / SHAPE[1]
    seen = cast(spheres(SCENE_SEED, field=FIELD), Lens(FOCAL_LENGTH, PINHOLE, 1.0), SHAPE, pixel_angle, samples=256)
    light = seen.view.image / np.percentile(seen.view.image, 99.9)
    most = float((1 / seen.distance).max())
    channels = [255 * linear_to_srgb(np.clip(light, 0, 1)), 255 / (most * seen.distance), 0 * light]
    values = np.rint(np.stack(channels, axis=-1)).astype(np.uint8)
    scene = {
        "png": text(values, "png", optimize=True),
        "width": SHAPE[1],
        "height": SHAPE[0],
        "vergence": most,
        "pixel_angle": pixel_angle,
        "focal_length": FOCAL_LENGTH,
    }
    return scene, srgb_to_linear(values[..., 0] / 255)


def detail_table(light: NDArray[np.floating]) -> list[float]:
    """Return the detail of the sharp picture after an even Gaussian blur of `RADII`, relative to none.

    Detail is the mean size of the Laplacian over 4 x 4 pixels, and of these the root mean square, as on the page.
    """
    place = np.arange(-24, 25)
    details = []
    for radius in RADII:
        sigma = max(K * radius, 0.1)
        kernel = np.exp(-(place**2) / (2 * sigma**2))
        blurred = light.astype(float)
        for axis in (0, 1):
            blurred = correlate1d(blurred, kernel / kernel.sum(), axis=axis, mode="reflect")
        squares = np.abs(laplace(blurred, mode="nearest")).reshape(SHAPE[0] // 4, 4, SHAPE[1] // 4, 4)
        details.append(float(np.sqrt(np.mean(squares.mean(axis=(1, 3)) ** 2))))
    return [round(detail / details[0], 6) for detail in details]


def curves(pictures: StimulusSet) -> dict[str, Any]:
    """Return simulated observers' mean ratings relative to the pinhole picture, and the rating scale's ends."""
    design = DepthRatingDesign(scenes=pictures.scenes[1:], standard_scene=pictures.scenes[0])
    with tempfile.TemporaryDirectory() as folder, processes(2) as pool:
        encoded = encoded_stimuli(pictures, pool)
        simulate(
            *(design, Path(folder, "data")),
            observers=OBSERVERS,
            seed=SEED,
            encoded=encoded,
            stimuli=pictures.folder,
            executor=pool,
        )
        result: Any = analyse_ratings(Path(folder, "data")).result
    means: dict[str, Any] = {}
    for mean in result.means:
        means.setdefault(mean.fixation, {})[mean.aperture] = [
            round(float(getattr(mean.ratio, name, 1.0)), 3) for name in ("estimate", "low", "high")
        ]
    return {"observers": OBSERVERS, "means": means, "scale": [design.least_rating, design.most_rating]}


def rated(folder: Path) -> dict[str, str]:
    """Return the pictures that are rated, by the stem of their file."""
    return {path.stem: picture_of(path) for path in sorted(folder.glob("*.png"))}


def marks(folder: Path, scene: str) -> dict[str, list[float]]:
    """Return the position of the object to look at, as shares of the picture's width, by fixation."""
    content = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    ends, width = content["scenes"][scene], content["parameters"]["picture_px"][0]
    return {end: [round(at / width, 4) for at in ends[end]["position_px"]] for end in ("nearest", "farthest")}


def picture_of(path: Path) -> str:
    """Return a picture of a set, reduced to `RATED_SIZE`."""
    reduced = Image.open(path).convert("RGB").resize((RATED_SIZE, RATED_SIZE), Image.Resampling.BOX)
    return text(np.asarray(reduced), "webp", quality=82, method=6)


def data() -> dict[str, Any]:
    """Return everything that the page shows but does not compute."""
    pictures = natural_pictures()
    folders = [Path(pictures.folder) / name for name in pictures.scenes]
    scene, light = scene_of()
    lights = {band: band_light(band, "D65") for band in ("L+M", "S")}
    return {
        "scene": scene,
        "k": K,
        "radii": [float(RADII[0]), float(RADII[-1]), len(RADII)],
        "detail": detail_table(light),
        "brightness": BRIGHTNESS,
        "least": LEAST_DETAIL,
        "clear": CLEAR_OF_NOISE,
        "chromatic": {
            band: round(float(np.average(chromatic_difference(light.wavelength_nm), weights=light.weight)), 4)
            for band, light in lights.items()
        },
        "oscillation": {"amplitude": Oscillation().amplitude, "frequency": Oscillation().frequency},
        "rating": {
            "standard": picture_of(folders[STANDARD] / "pinhole.png"),
            "pictures": rated(folders[RATED]),
            "marks": marks(Path(pictures.folder), folders[RATED].name),
            "simulated": curves(pictures),
        },
    }


if __name__ == "__main__":
    (HERE / "data.js").write_text(f"const PLAY = {json.dumps(data(), indent=0)};\n", encoding="utf-8")
    print(f"{(HERE / 'data.js').stat().st_size / 1000:.0f} kB")
