"""Ray caster: each pixel is the mean over rays through points of the pixel and of the lens.

A ray leaves the aperture at (ax, ay, 0) and passes through the point of the plane of focus that is conjugate to its
sensor point. If that point is seen from the lens's centre in the direction (tx, ty, 1), and Vf is the focus vergence,

    x(z) = ax + z (tx - ax Vf),    y(z) = ay + z (ty - ay Vf).

In terms of vergence the equations also hold for focus at infinity (Vf = 0) and beyond (Vf < 0). Blur and occlusion
follow from ray geometry: no blur formula or convolution is used, so such views can test methods based on them.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor, as_completed
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_number, check_seed
from focalgradient.loops import compiled, inlined
from focalgradient.optics import Optics, check_optics
from focalgradient.parallel import cores
from focalgradient.progress import Progress, silent
from focalgradient.psf import Disc, Psf, psf_of
from focalgradient.quantities import Whole
from focalgradient.render.rendered import Rendered
from focalgradient.scenes.objects import Mesh, Plane, Scene, Sphere, check_scene
from focalgradient.scenes.texture import TILE
from focalgradient.view import View, check_pixel_angle, check_shape

__all__ = ["Rendered", "cast", "castable", "check_frame"]

RAY_SETS = 256  # number of ray sets, assigned to the pixels at random
ROWS_PER_TASK = 8  # rows per task


FIELDS = "sphere px py pz radius nx ny nz ux uy uz vx vy vz half_u half_v texel projected"
OBJECT = np.dtype([(name, np.float64) for name in FIELDS.split()])


def cast(
    scene: Scene,
    optics: Optics,
    shape: tuple[int, int],
    pixel_angle: float,
    *,
    samples: int = 64,
    seed: int = 0,
    place: float = 0.0,
    ahead: float = 0.0,
    psf: Psf | str = "disc",
    progress: Progress | None = None,
) -> Rendered:
    """Render a scene through a finite thin lens by ray casting.

    The sensor is a plane: pixel (row i, column j) of H x W looks in the direction
    ((j - (W-1)/2) pixel_angle + ahead, (i - (H-1)/2) pixel_angle, 1). A pixel's value is the mean over its square.

    Parameters
    ----------
    scene
        The scene to render.
    optics
        A `Lens`, or any object with an `aperture_diameter` (m) and a `focus_vergence` (D, any sign).
    shape
        Height and width in pixels.
    pixel_angle
        Angle in radians subtended by one pixel on the axis: pixel pitch / sensor distance.
    samples
        Rays per pixel; powers of 2 are best. With natural texture of contrast 0.2, sampling noise is about 0.3 % of the
        mean with 64 rays, or 0.1 % with 256, for blur discs 4 pixels in diameter, and 0.9 % or 0.3 % for 16 pixels.
    seed
        Random seed of the rays; with the same seed, two optics are sampled identically.
    place
        Position of the lens's centre in metres to the right of the origin. Its axis stays parallel to z.
    ahead
        Direction of the frame's centre as a tangent to the right, for a sensor shifted off the axis.
    psf
        Aperture shape, a `focalgradient.psf.Psf` or its name; rays are distributed like the shape's radiance.
    progress
        Callback that receives the fraction done, 0 to 1, and a short description.

    Raises
    ------
    InputError
        If the frame, pixel angle or number of samples is not positive, or the optics, place or ahead are not finite.

    Examples
    --------
    >>> from focalgradient import Lens
    >>> from focalgradient.scenes import slant
    >>> lens = Lens(focal_length=0.025, f_number=4, focus_distance=1.0)
    >>> rendered = cast(slant(1.0, 2.0, field=64 * 3e-4), lens, (48, 64), pixel_angle=3e-4, samples=16)
    >>> rendered.view.shape, rendered.distance[0, [0, -1]].round(2).tolist()
    ((48, 64), [1.0, 1.98])
    """
    check_scene(scene)
    check_frame(optics, shape, pixel_angle, samples, seed)
    if not castable(scene):
        raise InputError(
            "scene contains meshes or a sky, but the ray caster renders planes and spheres only: use engine 'shaded'."
        )
    check_number("place", place, "metres")
    check_number("ahead", ahead, "tangent of an angle")
    lens = optics.aperture_diameter / 2, optics.focus_vergence, place, ahead
    image, distance = cast_without(scene, None, lens, shape, pixel_angle, samples, seed, progress, psf_of(psf))
    return Rendered(View(image, optics, pixel_angle), distance)


def cast_without(
    scene: Scene,
    skipped: int | None,
    lens: tuple[float, float, float, float],
    shape: tuple[int, int],
    pixel_angle: float,
    samples: int,
    seed: int,
    progress: Progress | None = None,
    psf: Psf = Disc(),  # noqa: B008  it is frozen
) -> tuple[NDArray[np.float32], FloatArray]:
    """Return image and distance as in `cast`; rays pass through the `skipped` object, which still casts its shadow.

    `lens` holds the radius of its aperture (m), its focus (D), and `place` and `ahead` of `cast`.
    """
    sun = _unit(scene.sun or (0.0, 0.0, 0.0))
    world = _objects(scene), _textures(scene), sun, scene.ambient, scene.background
    rays, number = _patterns(samples, seed, psf), -1 if skipped is None else skipped
    image, distance = np.empty(shape, np.float32), np.empty(shape)

    def rows(start: int) -> None:
        shown = start, start + ROWS_PER_TASK, image, distance
        _cast_rows(world, rays, seed & 0xFFFFFFFF, lens, pixel_angle, number, *shown)

    starts = range(0, shape[0], ROWS_PER_TASK)
    with ThreadPoolExecutor(cores()) as pool:
        for done, future in enumerate(as_completed([pool.submit(rows, start) for start in starts]), 1):
            future.result()
            (progress or silent)(done / len(starts), "rendering")
    return image, distance


def check_frame(optics: Optics, shape: tuple[int, int], pixel_angle: float, samples: int, seed: int) -> None:
    """Validate the arguments that all renderers share."""
    check_shape(shape)
    check_optics(optics)
    check_pixel_angle(pixel_angle, optics)
    Whole(1, remedy="64 to 256 rays are usual").check("samples", samples)
    check_seed(seed)


def castable(scene: Scene) -> bool:
    """Return whether `cast` can render the scene: planes and spheres before a uniform background, in grey."""
    return scene.sky is None and not any(isinstance(thing, Mesh) for thing in scene.objects)


def _objects(scene: Scene) -> NDArray[np.void]:
    """Return the scene's objects as a structured array for the compiled kernel."""
    table = np.zeros(len(scene.objects), OBJECT)
    for row, thing in zip(table, scene.objects, strict=True):
        assert not isinstance(thing, Mesh)
        row["texel"], row["projected"] = thing.texture.texel, thing.texture.projected
        match thing:
            case Sphere():
                row["sphere"], row["radius"] = 1, thing.radius
                row["px"], row["py"], row["pz"] = thing.centre
            case Plane():
                row["px"], row["py"], row["pz"] = thing.point
                across, down, normal = thing.frame()
                row["nx"], row["ny"], row["nz"] = normal
                row["ux"], row["uy"], row["uz"] = across
                row["vx"], row["vy"], row["vz"] = down
                row["half_u"], row["half_v"] = np.array(thing.size) / 2
    return table


def _textures(scene: Scene) -> NDArray[np.float32]:
    return np.stack(
        [thing.texture.coefficients() for thing in scene.objects if not isinstance(thing, Mesh)]
        or [np.zeros((TILE, TILE), np.float32)]
    )


def _unit(vector: object) -> FloatArray:
    array = np.asarray(vector, dtype=float)
    return array / (np.linalg.norm(array) or 1.0)


@lru_cache(maxsize=4)
def _patterns(samples: int, seed: int, psf: Psf) -> FloatArray:
    """Return ray sets, PATTERNS x samples x 4: aperture position (x, y; blur radii) and pixel position (-1/2 to 1/2).

    All are one Owen-scrambled four-dimensional Sobol net, each under its own digital shift, which preserves the net
    property.
    """
    random = np.random.default_rng(seed)
    from scipy.stats import qmc  # deferred: slow to import

    net = qmc.Sobol(4, bits=30, rng=random).random_base2(math.ceil(math.log2(samples)))[:samples]
    shift = random.integers(2**30, size=(RAY_SETS, 1, 4))
    points = (((net * 2**30).astype(np.int64) ^ shift) + 0.5) / 2**30 - 0.5
    return np.concatenate([psf.points(points[..., :2]), points[..., 2:]], -1)


@inlined
def _spline(coefficients, u, v):  # type: ignore[no-untyped-def]
    """Return the periodic cubic spline at column u, row v."""
    j, i = math.floor(u), math.floor(v)
    s, t = u - j, v - i
    j, i = int(j), int(i)
    s1, t1 = 1 - s, 1 - t
    a0, a1, a2, a3 = s1**3, 4 - 6 * s**2 + 3 * s**3, 4 - 6 * s1**2 + 3 * s1**3, s**3
    b0, b1, b2, b3 = t1**3, 4 - 6 * t**2 + 3 * t**3, 4 - 6 * t1**2 + 3 * t1**3, t**3
    mask = TILE - 1
    j0, j1, j2, j3 = (j - 1) & mask, j & mask, (j + 1) & mask, (j + 2) & mask
    r0, r1, r2, r3 = (
        coefficients[(i - 1) & mask],
        coefficients[i & mask],
        coefficients[(i + 1) & mask],
        coefficients[(i + 2) & mask],
    )
    return (
        b0 * (a0 * r0[j0] + a1 * r0[j1] + a2 * r0[j2] + a3 * r0[j3])
        + b1 * (a0 * r1[j0] + a1 * r1[j1] + a2 * r1[j2] + a3 * r1[j3])
        + b2 * (a0 * r2[j0] + a1 * r2[j1] + a2 * r2[j2] + a3 * r2[j3])
        + b3 * (a0 * r3[j0] + a1 * r3[j1] + a2 * r3[j2] + a3 * r3[j3])
    ) / 36


@inlined
def _hit(objects, ox, oy, oz, dx, dy, dz, least, skipped):  # type: ignore[no-untyped-def]
    """Return parameter and index of the first object beyond `least` along a ray, except `skipped`; index -1: none."""
    first, which = np.inf, -1
    for index in range(objects.shape[0]):
        if index == skipped:
            continue
        thing = objects[index]
        qx, qy, qz = thing.px - ox, thing.py - oy, thing.pz - oz
        if thing.sphere:
            d2 = dx * dx + dy * dy + dz * dz
            along = qx * dx + qy * dy + qz * dz
            # The discriminant, computed from the ray's distance to the centre, avoids cancellation for distant small
            # spheres.
            cx, cy, cz = qx - along / d2 * dx, qy - along / d2 * dy, qz - along / d2 * dz
            inside = thing.radius**2 - (cx * cx + cy * cy + cz * cz)
            if inside < 0:
                continue
            far = (along - math.sqrt(inside * d2)) / d2
            if far <= least:
                continue
        else:
            toward = thing.nx * dx + thing.ny * dy + thing.nz * dz
            if toward == 0:
                continue
            far = (thing.nx * qx + thing.ny * qy + thing.nz * qz) / toward
            if far <= least or far >= first:
                continue
            hx, hy, hz = far * dx - qx, far * dy - qy, far * dz - qz
            if (
                abs(thing.ux * hx + thing.uy * hy + thing.uz * hz) > thing.half_u
                or abs(thing.vx * hx + thing.vy * hy + thing.vz * hz) > thing.half_v
            ):
                continue
        if far < first:
            first, which = far, index
    return first, which


@inlined
def _radiance(world, ox, oy, dx, dy, skipped):  # type: ignore[no-untyped-def]
    """Return the radiance along the ray from (ox, oy, 0) in direction (dx, dy, 1)."""
    objects, textures, sun, ambient, background = world
    z, which = _hit(objects, ox, oy, 0.0, dx, dy, 1.0, 0.0, skipped)
    if which < 0:
        return background
    thing = objects[which]
    x, y = ox + z * dx, oy + z * dy
    hx, hy, hz = x - thing.px, y - thing.py, z - thing.pz
    if thing.sphere:
        nx, ny, nz = hx / thing.radius, hy / thing.radius, hz / thing.radius
        # Lambert's azimuthal projection: equal-area, and singular only at the back of the sphere.
        stretch = thing.radius * math.sqrt(2 / max(1 - nz, 1e-12))
        u, v = stretch * nx, stretch * ny
    else:
        nx, ny, nz = thing.nx, thing.ny, thing.nz
        u, v = thing.ux * hx + thing.uy * hy + thing.uz * hz, thing.vx * hx + thing.vy * hy + thing.vz * hz
        if nx * dx + ny * dy + nz > 0:  # orient the normal towards the viewer
            nx, ny, nz = -nx, -ny, -nz
    if thing.projected:
        u, v = x / z, y / z
    value = _spline(textures[which], u / thing.texel, v / thing.texel)
    sx, sy, sz = sun
    if sx == 0 and sy == 0 and sz == 0:
        return value
    facing = nx * sx + ny * sy + nz * sz
    if facing <= 0 or _hit(objects, x, y, z, sx, sy, sz, 1e-6, -1)[1] >= 0:
        facing = 0.0
    return value * (ambient + (1 - ambient) * facing)


@compiled
def _cast_rows(world, rays, seed, lens, pixel, skipped, start, stop, image, distance):  # type: ignore[no-untyped-def]
    """Fill the rows `start` to `stop` of image and distance."""
    aperture, focus, place, ahead = lens
    height, width = image.shape
    samples = rays.shape[1]
    for i in range(start, min(stop, height)):
        for j in range(width):
            tx, ty = (j - (width - 1) / 2) * pixel + ahead, (i - (height - 1) / 2) * pixel
            distance[i, j] = _hit(world[0], place, 0.0, 0.0, tx, ty, 1.0, 0.0, skipped)[0]
            pattern = rays[_deal(i, j, seed)]
            total = 0.0
            for n in range(samples):
                ax, ay = aperture * pattern[n, 0], aperture * pattern[n, 1]
                dx = tx + pixel * pattern[n, 2] - ax * focus
                dy = ty + pixel * pattern[n, 3] - ay * focus
                total += _radiance(world, place + ax, ay, dx, dy, skipped)
            image[i, j] = total / samples


@inlined
def _deal(i, j, seed):  # type: ignore[no-untyped-def]
    """Return the index of the ray set for a pixel: a hash of its position (32-bit finaliser of MurmurHash3)."""
    h = (i * 0x1F123BB5 + j * 0x5F356495 + seed * 0x2545F491) & 0xFFFFFFFF
    h = ((h ^ (h >> 16)) * 0x85EBCA6B) & 0xFFFFFFFF
    h = ((h ^ (h >> 13)) * 0xC2B2AE35) & 0xFFFFFFFF
    return (h ^ (h >> 16)) % RAY_SETS
