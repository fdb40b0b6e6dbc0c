"""``focalgradient demo``: a folder with one small example of every input of the other commands."""

from __future__ import annotations

import io
import math
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from focalgradient.cli.depth import depth
from focalgradient.cli.program import force_option, json_option, progress, show, writable, write_set

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from focalgradient.scenes import Scene
    from focalgradient.view import View

__all__ = ["demo"]

FOCAL_LENGTH_MM, PITCH_UM = 25.0, 8.0
STOPS = (5.6, 16.0)
FOCUS_M = 0.85
"""The camera of all demo pictures: a thin lens of 25 mm, 8 um pixels, focused at 0.85 m unless a file states otherwise.
"""

FOCI_M = (0.8, 1.6)
"""Focus of the two photographs in m: nearer and farther than the middle of the scene, which resolves the side of focus.
"""

TARGETS_M = (0.45, 0.65, 1.5)
"""Distances of the target in m: three, to determine the offset; its blur radius is 2 to 8 pixels at f/5.6."""

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

VIEWS_TOML = """\
# Two photographs of one scene, focused at different distances.
[camera]
focal_length_mm = 25.0
pixel_pitch_um = 8.0
focus_tolerance = 0.0      # these photographs are ray cast: their optics are exact
f_number_tolerance = 0.0   # leave both out for marks on a lens
encoding = "srgb"         # 8-bit files; "linear" for raw converted without a tone curve

[[view]]
image = "near.png"        # relative to this file
f_number = 5.6
focus_distance_m = 0.8

[[view]]
image = "far.png"
f_number = 5.6
focus_distance_m = 1.6
"""

TARGETS_HEAD = """\
# A sheet with hard edges, photographed at three distances through each aperture, without touching the focus.
[camera]
focal_length_mm = 25.0
pixel_pitch_um = 8.0
encoding = "srgb"
offset_sd_m = 0.02        # how well the place of the lens's centre is known beforehand
distance_sd_m = 0.002     # of each measured distance
f_number_tolerance = 0.07
"""

CAMERA = Path(__file__).with_name("demo_camera.toml")
"""Result of `focalgradient calibrate` for the targets, stored because computing it takes half a minute the first time.
"""

README = """\
A folder of examples, made by `focalgradient demo`. Nothing here was photographed or answered by a person:
the pictures are ray cast, the ratings are drawn at random from a model.

near.png, far.png, views.toml   two photographs, focused at 0.8 m and 1.6 m, and their settings
depth/                          the depth that they give: depth.png, depth.npz, summary.json
targets.toml, target_*.png      a target at 0.45, 0.65 and 1.5 m, at f/5.6 and f/16, for `focalgradient calibrate`
camera.toml                     what `focalgradient calibrate targets.toml` makes of them
cards.png                       dark cards at 1, 1.25 and 1.7 m before a white wall, at f/5.6
video.mkv                       24 frames of a turning plane; even frames at f/16, odd frames at f/5.6
picture.png, distance.npy       a picture all in focus, and its distances in metres, for `focalgradient blur`
ratings.csv                     SIMULATED ratings of depth, 16 subjects, effect 1.3 with the nearest object in focus

The true camera: a thin lens of 25 mm at f/5.6 or f/16, 8 um pixels, focused at 0.85 m unless said otherwise.
A thin lens magnifies more the nearer its focus: near.png shows the scene 0.2 % larger and far.png 1.4 % smaller than
picture.png and distance.npy, which have a focus at 0.85 m. The distances in depth/ are on the pixels of near.png.
"""

RELIABILITY = (
    "Reliability: distances are accurate to about twice the stated uncertainty where the map is not hatched; "
    "near occlusion boundaries 7 % have larger errors."
)


@click.command(short_help="Write a folder of examples for every command.")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the examples.")
@force_option
@json_option
@click.pass_context
def demo(context: click.Context, out: Path) -> None:
    """Write a small example of every input of the other commands, and make a first depth map.

    The pictures are ray cast: two photographs with their settings file, a target for calibration, a photograph of cards
    with hard edges, a video that alternates between two apertures, and a picture with its distances. The table of
    ratings is simulated. DIR/README.txt describes each file and its true values.

    Takes about 15 s; half a minute the first time, when the program is compiled.

    \b
    Example:
      focalgradient demo --out demo
      focalgradient depth demo/views.toml --out mine
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    targets = {f"target_{m}m_f{stop:g}.png": (m, stop) for m in TARGETS_M for stop in STOPS}
    names = ("near.png", "far.png", "views.toml", "cards.png", "video.mkv", "picture.png", "distance.npy")
    writable(out, [*names, *targets, "targets.toml", "ratings.csv", "camera.toml", "README.txt"])
    with _compiled_meanwhile(), progress(7) as say:
        say("two photographs")
        files: dict[str, bytes | Callable[[Path], object]] = {"README.txt": README.encode(), **_photographs()}
        files["views.toml"] = VIEWS_TOML.encode()
        say("a target")
        for seed, (name, (metres, stop)) in enumerate(targets.items()):
            files[name] = _png(_view(_target(metres), SMALL, stop, FOCUS_M, seed=seed))
        files["targets.toml"] = _targets_toml(targets).encode()
        say("cards")
        files["cards.png"] = _png(_view(_cards(), SMALL, STOPS[0], FOCUS_M))
        say("a video")
        frames = _frames()
        files["video.mkv"] = lambda path: _write_video(path, frames)
        say("a picture and its distances")
        files |= _picture()
        say("ratings")
        files["ratings.csv"] = _ratings()
        files["camera.toml"] = CAMERA.read_bytes()
        write_set(out, files, "views.toml")
        say("compiling, the first time")
    show(
        None,  # the result is that of depth
        f"Written: {len(files)} files in {out}; README.txt describes each.",
        f"Now: focalgradient depth {out / 'views.toml'} --out {out / 'depth'}",
    )
    words = [str(out / "views.toml"), "--out", str(out / "depth")]
    with depth.make_context("depth", words, parent=context) as inner:
        depth.invoke(inner)
    show(None, f"Look at {out / 'depth' / 'depth.png'}. {RELIABILITY}")


@contextmanager
def _compiled_meanwhile() -> Iterator[None]:
    """Compile the code of depth in a parallel process: on first use, compilation is half of the work.

    On exit the process is awaited. It writes only the cache of compiled code.
    """
    command = [sys.executable, "-P", "-c", "from focalgradient.cli.demo import compile_depth; compile_depth()"]
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=quiet, stderr=quiet) as beside:
        try:
            yield
            beside.wait()
        finally:
            beside.kill()


def compile_depth() -> None:
    """Compile the code of a depth map from two photographs, by computing a small one.

    The process ends when its parent closes its standard input.
    """
    threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
    from scipy import ndimage

    from focalgradient import Lens, View, recover_depth

    texture = np.random.default_rng(0).uniform(0.1, 0.9, (96, 128))
    views = []
    for focus, sharp in zip(FOCI_M, (slice(64), slice(64, None)), strict=True):
        image = ndimage.gaussian_filter(texture, 2.0)
        image[:, sharp] = ndimage.gaussian_filter(texture, 0.3)[:, sharp]
        lens = Lens(1e-3 * FOCAL_LENGTH_MM, STOPS[0], focus)
        views.append(View(image, lens, 1e-6 * PITCH_UM / lens.sensor_distance))
    recover_depth(views)


def _view(scene: Scene, shape: tuple[int, int], stop: float, focus: float, *, rays: int = 64, seed: int = 0) -> View:
    """Return the scene as photographed by the camera, with noise."""
    from focalgradient import Lens
    from focalgradient.render import cast, noisy

    lens = Lens(1e-3 * FOCAL_LENGTH_MM, stop, focus)
    return noisy(cast(scene, lens, shape, 1e-6 * PITCH_UM / lens.sensor_distance, samples=rays).view, NOISE, seed)


def _shown(view: View) -> NDArray[np.uint8]:
    """Return 8-bit sRGB values of a view."""
    from focalgradient.display import Display

    return Display(gamma="sRGB").encode(view.image)


def _png(view: View) -> bytes:
    from focalgradient.photographs.pictures import png_of

    return png_of(_shown(view))


def _field(focus: float) -> float:
    """Return the width of the larger pictures, as a tangent."""
    from focalgradient import Lens

    return SHAPE[1] * 1e-6 * PITCH_UM / Lens(1e-3 * FOCAL_LENGTH_MM, STOPS[0], focus).sensor_distance


def _photographs() -> dict[str, bytes]:
    """Return photographs of spheres in front of a wall, focused near and far."""
    from focalgradient.scenes import spheres

    scene = spheres(3, field=_field(FOCI_M[0]))
    return {
        name: _png(_view(scene, SHAPE, STOPS[0], focus, seed=seed))
        for seed, (name, focus) in enumerate(zip(("near.png", "far.png"), FOCI_M, strict=True))
    }


def _target(z: float) -> Scene:
    """Return a white sheet with a large and a small dark square, of equal angular size at every distance."""
    from focalgradient.scenes.objects import Scene

    return Scene((_wall(z), _card(-0.0093, 0.0014, 0.0272, z), _card(-0.0301, 0.0009, 0.0031, z)))


def _cards() -> Scene:
    """Return three dark cards in front of a white wall."""
    from focalgradient.scenes.objects import Scene

    places = zip((-0.019, 0.0, 0.019), CARDS_M, strict=True)
    return Scene((_wall(2.5), *(_card(x, 0.0, 0.0125, z) for x, z in places)))


def _wall(z: float) -> Any:
    from focalgradient.scenes.objects import Plane
    from focalgradient.scenes.texture import Texture

    return Plane((0.0, 0.0, z), (0.0, 0.0, -1.0), Texture(mean=0.7, contrast=0.0))


def _card(x: float, y: float, side: float, z: float) -> Any:
    """Return a dark square at distance `z`, slightly in front of it; position and size are tangents."""
    from focalgradient.scenes.objects import Plane
    from focalgradient.scenes.texture import Texture

    near = z * (1 - 1e-5)
    return Plane((x * z, y * z, near), (0.0, 0.0, -1.0), Texture(mean=0.05, contrast=0.0), size=(side * z, side * z))


def _targets_toml(targets: dict[str, tuple[float, float]]) -> str:
    views = [
        f'\n[[view]]\nimage = "{name}"\ndistance_m = {metres}\nf_number = {stop:g}\nfocus_distance_m = {FOCUS_M}\n'
        for name, (metres, stop) in targets.items()
    ]
    return TARGETS_HEAD + "".join(views)


def _frames() -> list[NDArray[np.uint8]]:
    """Return frames of a plane that rotates around its centre, alternating between both apertures."""
    from focalgradient.scenes import slant

    middle, half = (sum(1 / m for m in SLANT_M) / 2, (1 / SLANT_M[0] - 1 / SLANT_M[1]) / 2)
    field = _field(FOCUS_M) * SMALL[1] / SHAPE[1]
    frames = []
    for n in range(FRAMES):
        turned = half * math.cos(math.pi * n / (FRAMES - 1))
        scene = slant(1 / (middle + turned), 1 / (middle - turned), field, seed=1)
        frames.append(_shown(_view(scene, SMALL, STOPS[(n + 1) % 2], FOCUS_M, rays=128, seed=n)))
    return frames


def _write_video(path: Path, frames: list[NDArray[np.uint8]]) -> None:
    from focalgradient.video import write_frames

    write_frames(path, frames, FPS)


def _picture() -> dict[str, bytes]:
    """Return the spheres through a pinhole, and the distance of each pixel."""
    from focalgradient import Lens
    from focalgradient.render import cast
    from focalgradient.scenes import spheres

    pinhole = Lens(1e-3 * FOCAL_LENGTH_MM, 1000.0, FOCUS_M)
    seen = cast(spheres(3, field=_field(FOCI_M[0])), pinhole, SHAPE, _field(FOCUS_M) / SHAPE[1], samples=64)
    buffer = io.BytesIO()
    np.save(buffer, seen.distance.astype(np.float32))
    return {"picture.png": _png(seen.view), "distance.npy": buffer.getvalue()}


def _ratings() -> bytes:
    """Return simulated ratings, with the columns of a user's own table."""
    from focalgradient.design import DepthRatingDesign
    from focalgradient.power import Model, simulated_ratings

    table = simulated_ratings(DepthRatingDesign(), SUBJECTS, Model(effect=EFFECT), np.random.default_rng(1))
    names = {"participant_id": "subject", "aperture": "aperture", "fixation": "focus", "scene": "scene"}
    own = table[~table["catch"].astype(bool)][[*names, "rating"]].rename(columns=names).round({"rating": 3})
    return own.assign(kind="simulated").to_csv(index=False, lineterminator="\n").encode()
