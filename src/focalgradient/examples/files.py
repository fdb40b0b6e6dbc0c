"""Contents of the example files: pictures by the ray caster of the scenes that the settings files describe."""

from __future__ import annotations

import io
import math
import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from focalgradient.design import DepthRatingDesign
from focalgradient.display import Display
from focalgradient.optics import Lens
from focalgradient.photographs.pictures import png_of
from focalgradient.power import Model, simulated_ratings
from focalgradient.progress import Progress
from focalgradient.render import cast, noisy
from focalgradient.scenes import Plane, Scene, Texture, slant, spheres
from focalgradient.video import write_frames
from focalgradient.view import View

__all__ = ["CARDS_M", "EFFECT", "EXAMPLE_FILES", "FOCUS_M", "FRAMES", "STOPS", "example_files"]

FOLDER = Path(__file__).parent
"""Folder of the texts, among them the settings files, which state the optics and distances of the photographs. The
camera is what ``focalgradient calibrate`` makes of the targets, stored because that takes half a minute the first time.
"""

TEXTS = ("README.txt", "views.toml", "targets.toml", "camera.toml")

FOCAL_LENGTH, PIXEL_PITCH = 0.025, 8e-6
STOPS = (5.6, 16.0)
FOCUS_M = 0.85
"""Camera of all pictures: a thin lens of 25 mm, 8 um pixels, focused at 0.85 m unless a settings file states otherwise.
"""

CARDS_M = (1.0, 1.25, 1.7)
"""Distances in m of the dark cards in the photograph of hard edges, left to right; the wall behind them is at 2.5 m."""

SHAPE, SMALL = (240, 320), (144, 192)
FRAMES, FPS = 24, 12.0
SLANT_M = (0.95, 2.0)
"""Distances in m of the two edges of the plane in the video, which rotates until they have exchanged places."""

NOISE = 0.003
"""Standard deviation of the sensor's noise as a fraction of white: that of a camera at base sensitivity."""

SUBJECTS, EFFECT = 16, 1.3
"""Number of simulated subjects in the ratings table, and ratio of their ratings at the largest aperture to the pinhole:
16 subjects find the effect in 99.7 % of 2000 experiments (`focalgradient.power.quick_power`), 8 in 83 %.
"""

Content = bytes | Callable[[Path], object]


def _shots(name: str) -> list[dict[str, Any]]:
    """Return the photographs listed in a settings file."""
    shots: list[dict[str, Any]] = tomllib.loads((FOLDER / name).read_text("utf-8"))["view"]
    return shots


EXAMPLE_FILES = (
    *TEXTS,
    *(shot["image"] for name in ("views.toml", "targets.toml") for shot in _shots(name)),
    *("cards.png", "video.mkv", "picture.png", "distance.npy", "ratings.csv"),
)
"""Names of the example files."""


def example_files(progress: Progress | None = None) -> dict[str, Content]:
    """Make the example files; ``README.txt`` among them describes each, with its true values.

    Parameters
    ----------
    progress
        Called at each stage with the fraction done and a description.

    Returns
    -------
    dict
        Content by name: bytes, or a function that writes to a given path, as `focalgradient.files.replace_set` takes
        it. The names are those of `EXAMPLE_FILES`.

    Examples
    --------
    >>> len(EXAMPLE_FILES), EXAMPLE_FILES[4]
    (17, 'near.png')
    """
    say = progress or (lambda share, what: None)
    made: dict[str, Content] = {name: (FOLDER / name).read_bytes() for name in TEXTS}
    stages: dict[str, Callable[[], dict[str, Content]]] = {
        "two photographs": _photographs,
        "a target": _targets,
        "cards": _cards,
        "a video": _video,
        "a picture and its distances": _picture,
        "ratings": _ratings,
    }
    for done, (stage, make) in enumerate(stages.items()):
        say(done / len(stages), stage)
        made |= make()
    return made


def _pixel_angle(lens: Lens) -> float:
    return PIXEL_PITCH / lens.sensor_distance


def _photographed(
    scene: Scene, shape: tuple[int, int], stop: float, focus: float = FOCUS_M, *, rays: int = 64, seed: int = 0
) -> View:
    """Return the scene as photographed by the camera, with noise."""
    lens = Lens(FOCAL_LENGTH, stop, focus)
    return noisy(cast(scene, lens, shape, _pixel_angle(lens), samples=rays).view, NOISE, seed)


def _png(view: View) -> bytes:
    return png_of(Display().encode(view.image))


def _spheres() -> Scene:
    """Return spheres in front of a wall that fill the frame of the nearer photograph."""
    nearest = _shots("views.toml")[0]["focus_distance_m"]
    return spheres(3, field=SHAPE[1] * _pixel_angle(Lens(FOCAL_LENGTH, STOPS[0], nearest)))


def _photographs() -> dict[str, Content]:
    """Return photographs of the spheres, focused near and far, which resolves the side of focus."""
    scene = _spheres()
    return {
        shot["image"]: _png(_photographed(scene, SHAPE, shot["f_number"], shot["focus_distance_m"], seed=seed))
        for seed, shot in enumerate(_shots("views.toml"))
    }


def _targets() -> dict[str, Content]:
    """Return photographs of a white sheet with a large and a small dark square, alike in angle at every distance."""
    found: dict[str, Content] = {}
    for seed, shot in enumerate(_shots("targets.toml")):
        z = shot["distance_m"]
        sheet = Scene((_wall(z), _card(-0.0093, 0.0014, 0.0272, z), _card(-0.0301, 0.0009, 0.0031, z)))
        view = _photographed(sheet, SMALL, shot["f_number"], shot["focus_distance_m"], seed=seed)
        found[shot["image"]] = _png(view)
    return found


def _cards() -> dict[str, Content]:
    """Return a photograph of three dark cards in front of a white wall."""
    places = zip((-0.019, 0.0, 0.019), CARDS_M, strict=True)
    scene = Scene((_wall(2.5), *(_card(x, 0.0, 0.0125, z) for x, z in places)))
    return {"cards.png": _png(_photographed(scene, SMALL, STOPS[0]))}


def _wall(z: float) -> Plane:
    return Plane((0.0, 0.0, z), (0.0, 0.0, -1.0), Texture(mean=0.7, contrast=0.0))


def _card(x: float, y: float, side: float, z: float) -> Plane:
    """Return a dark square at distance `z`, slightly in front of it; position and size are tangents."""
    near = z * (1 - 1e-5)
    return Plane((x * z, y * z, near), (0.0, 0.0, -1.0), Texture(mean=0.05, contrast=0.0), size=(side * z, side * z))


def _video() -> dict[str, Content]:
    """Return a video of a plane that rotates around its centre, alternating between both apertures."""
    middle, half = (sum(1 / m for m in SLANT_M) / 2, (1 / SLANT_M[0] - 1 / SLANT_M[1]) / 2)
    field = SMALL[1] * _pixel_angle(Lens(FOCAL_LENGTH, STOPS[0], FOCUS_M))
    frames = []
    for n in range(FRAMES):
        turned = half * math.cos(math.pi * n / (FRAMES - 1))
        scene = slant(1 / (middle + turned), 1 / (middle - turned), field, seed=1)
        view = _photographed(scene, SMALL, STOPS[(n + 1) % 2], rays=128, seed=n)
        frames.append(Display().encode(view.image))
    return {"video.mkv": partial(write_frames, frames=frames, fps=FPS)}


def _picture() -> dict[str, Content]:
    """Return the spheres through a pinhole, and the distance of each pixel."""
    pinhole = Lens(FOCAL_LENGTH, 1000.0, FOCUS_M)
    seen = cast(_spheres(), pinhole, SHAPE, _pixel_angle(pinhole), samples=64)
    buffer = io.BytesIO()
    np.save(buffer, seen.distance.astype(np.float32))
    return {"picture.png": _png(seen.view), "distance.npy": buffer.getvalue()}


def _ratings() -> dict[str, Content]:
    """Return simulated ratings, with the columns of a user's own table."""
    table = simulated_ratings(DepthRatingDesign(), SUBJECTS, Model(effect=EFFECT), np.random.default_rng(1))
    names = {"participant_id": "subject", "aperture": "aperture", "fixation": "focus", "scene": "scene"}
    own = table[~table["catch"].astype(bool)][[*names, "rating"]].rename(columns=names).round({"rating": 3})
    return {"ratings.csv": own.assign(kind="simulated").to_csv(index=False, lineterminator="\n").encode()}
