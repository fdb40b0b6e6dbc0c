"""Mitsuba backend: scene conversion, a lens focused by vergence, and deterministic shading.

Mitsuba's own lens is focused by a distance in metres, so it cannot focus at infinity or beyond. `Dioptres` follows the
ray caster: a ray leaves the aperture at a in direction t - a Vf, for any sign of the focus vergence Vf.

The radiance along a ray is found in one of two ways. Path tracing follows it from surface to surface, sampling the sun
at each surface and the sky by escaping rays: for pictures to be viewed. Shading stops at the first surface that is not
a mirror and returns albedo x (ambient + sun, unless in shadow), as the ray caster does: its only noise is that of the
lens samples, and it serves for measurement.
"""

from __future__ import annotations

import math
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.optics import Optics
from focalgradient.progress import Progress
from focalgradient.render.mitsuba_backend import SCALAR
from focalgradient.scenes.objects import Mesh, Plane, Scene, Sphere
from focalgradient.scenes.texture import TILE

__all__ = ["halves", "has_mirrors", "trace"]

RAYS_PER_PASS = 2**24  # maximum number of rays per pass
MAX_REFLECTIONS = 4  # maximum number of mirror reflections per ray
MAX_SCATTERINGS = 4  # maximum number of diffuse scatterings per path: the remainder is below 1 %
INFINITE_PLANE_SIZE = 100.0  # substitute size of an infinite plane, in distances of its anchor point


def halves(
    scene: Scene,
    optics: Optics,
    shape: tuple[int, int],
    pixel_angle: float,
    *,
    traced: bool,
    samples: int,
    seed: int,
    variant: str,
    progress: Progress,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return two independent pictures of a scene, H x W x 3, with half the samples each; path `traced`, or shaded."""
    mi, _ = _mitsuba(variant)
    world = _world(scene, variant)
    sensor = _sensor(optics, shape, pixel_angle, variant)
    integrator = _integrator(scene, traced, variant)
    half = max(1, samples // 2)
    each = 1 << int(math.log2(max(1, min(half, RAYS_PER_PASS // (shape[0] * shape[1])))))
    passes = -(-half // each)
    pictures = np.zeros((2, *shape, 3))
    for index in range(2 * passes):
        # Widely separated seeds, so that calls with neighbouring seeds share none.
        render_seed = (seed * 0x9E3779B1 + index) & 0xFFFFFFFF
        if variant == SCALAR:
            picture = np.array(mi.render(world, sensor=sensor, integrator=integrator, spp=each, seed=render_seed))
            picture = picture.reshape(*shape, 4)
            picture = picture[..., :3] + (scene.background if scene.sky is None else 0) * (1 - picture[..., 3:])
        else:
            picture = _averaged(world, sensor, integrator, shape, each, render_seed, variant)
        pictures[index % 2] += picture / passes
        progress((index + 1) / (2 * passes), "rendering")
    first, second = pictures.astype(np.float32)
    return first, second


def _averaged(
    world: Any, sensor: Any, integrator: Any, shape: tuple[int, int], samples: int, seed: int, variant: str
) -> NDArray[np.floating]:
    """Return the mean radiance, H x W x 3, of `samples` rays per pixel, reproducible to the last bit.

    Mitsuba's own film adds contributions in the order of its threads, with varying rounding.
    """
    mi, dr = _mitsuba(variant)
    height, width = shape
    sampler = sensor.sampler()
    sampler.set_sample_count(samples)
    samples = sampler.sample_count()  # rounded up by the sampler, which arranges samples in a grid
    sampler.set_samples_per_wavefront(samples)
    sampler.seed(seed, height * width * samples)
    pixel = dr.arange(mi.UInt32, height * width * samples) // dr.opaque(mi.UInt32, samples)
    row = pixel // dr.opaque(mi.UInt32, width)
    corner = mi.Point2f(pixel - row * width, row)
    place = (corner + sampler.next_2d()) / mi.Point2f(*(dr.opaque(mi.Float, side) for side in (width, height)))
    ray, _ = sensor.sample_ray(0.0, 0.0, place, sampler.next_2d())
    light, _, _ = integrator.sample(world, sampler, ray)
    dr.eval(light)  # evaluate the three channels together
    sums = dr.block_sum(light, samples, mode="evaluated")
    return np.array(sums).T.reshape(height, width, 3) / samples


def trace(
    scene: Scene, origins: FloatArray, directions: FloatArray, *, follow: bool, variant: str
) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
    """Trace rays (n x 3 each) to the first surface, or, if they `follow` mirrors, to the first that is not a mirror.

    Returns the end points, n x 3, or the last direction of rays that hit nothing; the surface normal there, or that
    direction again; and the number of mirrors met, or -1 - that number for rays that hit nothing.
    """
    mi, _ = _mitsuba(variant)
    world = _world(scene, variant)
    turns = MAX_REFLECTIONS if follow and has_mirrors(scene) else 0
    if variant != SCALAR:
        ray = mi.Ray3f(mi.Point3f(origins.T), mi.Vector3f(directions.T))
        ends = [np.array(part) for part in _follow(world, ray, turns, variant)]
        return ends[0].T.astype(float), ends[1].T.astype(float), ends[2].astype(np.int64)
    points, normals, met = np.empty(origins.shape), np.empty(origins.shape), np.empty(len(origins), np.int64)
    for index, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        ray = mi.Ray3f(mi.Point3f(origin), mi.Vector3f(direction))
        points[index], normals[index], met[index] = _follow(world, ray, turns, variant)
    return points, normals, met


def _follow(world: Any, ray: Any, turns: int, variant: str) -> tuple[Any, Any, Any]:
    mi, dr = _mitsuba(variant)
    met, going = mi.Int32(0), mi.Bool(True)
    point, normal, ended = mi.Point3f(0), mi.Normal3f(0), mi.Int32(0)
    ray = mi.Ray3f(ray.o, dr.normalize(ray.d))
    for turn in range(turns + 1):
        si = world.ray_intersect(ray, going)
        hit = going & si.is_valid()
        mirror = _is_mirror(mi, si, hit) & (turn < turns)
        stop, lost = (
            hit ^ mirror,
            going ^ hit,
        )  # ^ instead of ~, which is wrong for the Python booleans of scalar variants
        # Evaluated along the ray, which is more accurate than the surface's own point on large surfaces.
        point = dr.select(stop, ray(si.t), dr.select(lost, mi.Point3f(ray.d), point))
        normal = dr.select(stop, si.n, dr.select(lost, mi.Normal3f(ray.d), normal))
        ended = dr.select(stop, met, dr.select(lost, -1 - met, ended))
        going = hit & mirror
        if turn == turns or (variant == SCALAR and not going):
            break
        ray = si.spawn_ray(ray.d - 2 * dr.dot(ray.d, si.sh_frame.n) * si.sh_frame.n)  # reflected
        met = dr.select(going, met + 1, met)
    return point, normal, ended


def _is_mirror(mi: Any, si: Any, hit: Any) -> Any:
    # In scalar variants there is no surface to query where nothing is hit.
    return False if hit is False else hit & mi.has_flag(si.bsdf().flags(), mi.BSDFFlags.Delta)


def has_mirrors(scene: Scene) -> bool:
    """Return whether any object of the scene is a mirror."""
    return any(isinstance(thing, Mesh) and thing.mirror for thing in scene.objects)


def _mitsuba(variant: str) -> tuple[Any, Any]:
    """Return Mitsuba with the variant set and the package's plugins registered, and Dr.Jit."""
    import drjit as dr
    import mitsuba as mi

    if mi.variant() != variant:
        mi.set_variant(variant)
    mi.set_log_level(mi.LogLevel.Error)
    _parts(mi, dr, variant)
    return mi, dr


@lru_cache(maxsize=2)
def _world(scene: Scene, variant: str) -> Any:
    """Return the scene converted to Mitsuba's format."""
    mi, dr = _mitsuba(variant)
    world: dict[str, Any] = {"type": "scene"}
    for index, thing in enumerate(scene.objects):
        world[f"object{index}"] = _mesh(mi, thing) if isinstance(thing, Mesh) else _solid(mi, dr, thing, variant)
    if scene.sky is not None:
        bitmap = mi.Bitmap(np.ascontiguousarray(scene.sky.radiance, np.float32))
        around = mi.ScalarTransform4f().rotate([0, 0, 1], 180)
        world["sky"] = {"type": "envmap", "bitmap": bitmap, "to_world": around}
    else:
        world["sky"] = {"type": "constant", "radiance": 1.0 if scene.sun is None else scene.ambient}
    if scene.sun is not None:
        light = [math.pi * (1 - scene.ambient) * colour for colour in scene.tint]
        down = [-float(part) for part in scene.sun]
        world["sun"] = {"type": "directional", "direction": down, "irradiance": {"type": "rgb", "value": light}}
    return mi.load_dict(world)


def _mesh(mi: Any, mesh: Mesh) -> Any:
    bitmap = mi.Bitmap(np.ascontiguousarray(mesh.paint, np.float32))
    paint = {"type": "bitmap", "bitmap": bitmap, "raw": True}
    bare = (
        {"type": "conductor", "specular_reflectance": paint}
        if mesh.mirror
        else {"type": "diffuse", "reflectance": paint}
    )
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict({"type": "twosided", "bare": bare})
    made = mi.Mesh("mesh", len(mesh.vertices), len(mesh.faces), properties, mesh.smooth, True)
    fields = mi.traverse(made)
    fields["vertex_positions"] = np.ascontiguousarray(mesh.vertices, np.float32).ravel()
    fields["faces"] = np.ascontiguousarray(mesh.faces, np.uint32).ravel()
    fields["vertex_texcoords"] = np.ascontiguousarray(mesh.uv, np.float32).ravel()
    fields.update()
    return made


def _solid(mi: Any, dr: Any, thing: Plane | Sphere, variant: str) -> dict[str, Any]:
    skin = _parts(mi, dr, variant)["Skin"](mi.Properties())
    skin.lay(thing)
    bsdf = {"type": "twosided", "bare": {"type": "diffuse", "reflectance": skin}}
    if isinstance(thing, Sphere):
        return {"type": "sphere", "center": list(map(float, thing.centre)), "radius": float(thing.radius), "bsdf": bsdf}
    across, down, normal = thing.frame()
    far = INFINITE_PLANE_SIZE * float(np.linalg.norm(thing.point))
    sides = [min(size, far) / 2 for size in thing.size]
    # Mitsuba's rectangle spans -1 to 1 in x and y, and faces z.
    matrix = np.eye(4)
    matrix[:3] = np.stack([across * sides[0], down * sides[1], -normal, np.asarray(thing.point, float)], axis=1)
    return {"type": "rectangle", "to_world": mi.ScalarTransform4f(matrix), "bsdf": bsdf}


def _sensor(optics: Optics, shape: tuple[int, int], pixel_angle: float, variant: str) -> Any:
    mi, _ = _mitsuba(variant)
    height, width = shape
    film = {
        "type": "hdrfilm",
        "width": width,
        "height": height,
        "rfilter": {"type": "box"},
        "pixel_format": "rgba",
        "component_format": "float32",
    }
    lens = {"film": film, "sampler": {"type": "multijitter", "sample_count": 4}}
    aperture, focus = float(optics.aperture_diameter) / 2, float(optics.focus_vergence)
    if variant == SCALAR and aperture > 0 and focus > 1e-3:
        # Mitsuba's own lens is correct for a plane of focus in front of it, and much faster than a Python call per ray.
        fov = math.degrees(2 * math.atan(width * pixel_angle / 2))
        turned = mi.ScalarTransform4f().look_at([0, 0, 0], [0, 0, 1], [0, -1, 0])
        kind = {"type": "thinlens", "aperture_radius": aperture, "focus_distance": 1 / focus, "near_clip": 1e-3}
        return mi.load_dict({**kind, **lens, "fov": fov, "fov_axis": "x", "to_world": turned})
    return mi.load_dict(
        {"type": "dioptres", "aperture_radius": aperture, "focus_vergence": focus, "pixel_angle": pixel_angle, **lens}
    )


def _integrator(scene: Scene, traced: bool, variant: str) -> Any:
    mi, dr = _mitsuba(variant)
    if traced and variant == SCALAR:  # Mitsuba's own is a hundred times as fast as a Python call per ray
        depth = MAX_SCATTERINGS + 1 + (MAX_REFLECTIONS if has_mirrors(scene) else 0)
        return mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": depth, "hide_emitters": scene.sky is None})
    light = _parts(mi, dr, variant)["Light"](mi.Properties())
    light.of(scene, traced)
    return light


@cache
def _parts(mi: Any, dr: Any, variant: str) -> dict[str, Any]:
    """Return the package's sensor, texture and integrator, as classes of Mitsuba's current variant."""
    mi.register_sensor("dioptres", _sensor_class(dr))
    return {"Skin": _texture_class(dr), "Light": _integrator_class(dr, variant)}


def _sensor_class(dr: Any) -> Any:
    import mitsuba as mi

    class Dioptres(mi.Sensor):
        """A thin lens focused at any vergence."""

        def __init__(self, props: Any) -> None:
            super().__init__(props)
            # Opaque, so that one compiled program serves every lens.
            self.radius = dr.opaque(mi.Float, props["aperture_radius"])
            self.focus = dr.opaque(mi.Float, props["focus_vergence"])
            self.extent = [dr.opaque(mi.Float, float(side) * props["pixel_angle"]) for side in self.film().size()]
            self.m_needs_sample_3 = True

        def sample_ray(self, time: Any, wavelength: Any, place: Any, lens: Any, active: Any = True) -> Any:
            waves, weight = self.sample_wavelengths(dr.zeros(mi.SurfaceInteraction3f), wavelength, active)
            a = mi.warp.square_to_uniform_disk_concentric(lens) * self.radius
            across = (place.x - 0.5) * self.extent[0] - a.x * self.focus
            down = (place.y - 0.5) * self.extent[1] - a.y * self.focus
            return mi.Ray3f(mi.Point3f(a.x, a.y, 0), dr.normalize(mi.Vector3f(across, down, 1)), time, waves), weight

        def sample_ray_differential(self, time: Any, wavelength: Any, place: Any, lens: Any, active: Any = True) -> Any:
            ray, weight = self.sample_ray(time, wavelength, place, lens, active)
            return mi.RayDifferential3f(ray), weight

        def bbox(self) -> Any:
            return mi.ScalarBoundingBox3f(mi.ScalarPoint3f(0))

        def to_string(self) -> str:
            return f"Dioptres[{self.focus} D]"

    return Dioptres


def _texture_class(dr: Any) -> Any:
    import mitsuba as mi

    class Skin(mi.Texture):
        """The texture of a plane or sphere, mapped exactly as by the ray caster."""

        thing: Plane | Sphere

        def lay(self, thing: Plane | Sphere) -> None:
            texture = thing.texture
            self.thing, self.scale, self.projected = thing, 1 / (texture.texel * TILE), texture.projected
            tile = mi.TensorXf(np.ascontiguousarray(texture.coefficients()[..., None]))
            spline: Any = mi.Texture2f
            self.tile = spline(tile, use_accel=False, wrap_mode=dr.WrapMode.Repeat)
            self.average = texture.mean

        def place(self, point: Any) -> Any:
            if self.projected:
                return mi.Point2f(point.x / point.z, point.y / point.z)
            if isinstance(self.thing, Sphere):
                n = (point - mi.Point3f(*map(float, self.thing.centre))) / self.thing.radius
                stretch = self.thing.radius * dr.sqrt(2 / dr.maximum(1 - n.z, 1e-6))
                return mi.Point2f(stretch * n.x, stretch * n.y)
            across, down, _ = self.thing.frame()
            h = point - mi.Point3f(*map(float, self.thing.point))
            return mi.Point2f(dr.dot(mi.Vector3f(*across.tolist()), h), dr.dot(mi.Vector3f(*down.tolist()), h))

        def eval_1(self, si: Any, active: Any = True) -> Any:
            at = self.place(si.p) * self.scale + 0.5 / TILE
            return self.tile.eval_cubic(at - dr.floor(at), active)[0]

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(self.eval_1(si, active))

        def mean(self) -> Any:
            return mi.Float(self.average)

        def to_string(self) -> str:
            return "Skin[]"

    return Skin


def _integrator_class(dr: Any, variant: str) -> Any:
    import mitsuba as mi

    class Light(mi.SamplingIntegrator):
        """Integrator that returns the radiance along a ray, shaded or path traced."""

        def of(self, scene: Scene, traced: bool) -> None:
            self.sun = None if scene.sun is None else (np.array(scene.sun) / np.linalg.norm(scene.sun)).tolist()
            self.tint, self.traced = list(map(float, scene.tint)), traced
            self.ambient = 1.0 if scene.sun is None else scene.ambient
            self.sky, self.background = scene.sky is not None, scene.background
            self.mirrors = has_mirrors(scene)
            self.surfaces = (MAX_SCATTERINGS if traced else 1) + (MAX_REFLECTIONS if self.mirrors else 0)

        def sample(self, world: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> Any:
            ray, going = mi.Ray3f(ray), mi.Bool(active)
            direct = mi.Bool(True)  # seen by the camera directly or via mirrors
            seen, share = mi.Color3f(0), mi.Color3f(1)
            for surface in range(self.surfaces + 1):
                si = world.ray_intersect(ray, mi.RayFlags.All, surface == 0, going)
                hit = going & si.is_valid()
                lost = going ^ hit
                seen += dr.select(lost, share * self.beyond(world, si, lost, direct), 0)
                if surface == self.surfaces or (variant == SCALAR and not hit):
                    break
                bsdf = si.bsdf()
                mirror = _is_mirror(mi, si, hit) if self.mirrors else mi.Bool(False)
                plain = hit ^ mirror
                albedo, side = bsdf.eval_diffuse_reflectance(si, plain), dr.select(si.wi.z < 0, -1.0, 1.0)
                if self.sun is not None:
                    seen += dr.select(plain, share * albedo * self.sunlight(world, si, side, plain, surface == 0), 0)
                going = hit if self.traced else mirror
                if not self.traced:
                    seen += dr.select(plain, share * albedo * self.ambient, 0)
                if variant == SCALAR and not going:
                    break
                way, weight = mi.Vector3f(0, 0, 1), albedo
                if self.traced:
                    way = mi.warp.square_to_cosine_hemisphere(sampler.next_2d(plain)) * side
                    direct &= mirror
                if self.mirrors:
                    onward, reflected = bsdf.sample(mi.BSDFContext(), si, 0.5, mi.Point2f(0.5), mirror)
                    way, weight = dr.select(mirror, onward.wo, way), dr.select(mirror, reflected, weight)
                share = dr.select(going, share * weight, share)
                ray = si.spawn_ray(si.to_world(way))
            return seen, mi.Bool(True), []

        def beyond(self, world: Any, si: Any, lost: Any, direct: Any) -> Any:
            """Return the radiance of rays that hit nothing: the sky, or the background where seen directly."""
            if self.sky:
                return world.environment().eval(si, lost)
            return mi.Color3f(dr.select(direct, self.background, self.ambient))

        def sunlight(self, world: Any, si: Any, side: Any, plain: Any, first: bool) -> Any:
            """Return the direct sunlight on a surface, relative to a surface that faces the sun."""
            assert self.sun is not None
            sun, tint = mi.Vector3f(*self.sun), mi.Color3f(*self.tint)
            cosine = dr.dot(si.sh_frame.n, sun) * side
            lit = plain & (cosine > 0)
            lit ^= lit & world.ray_test(si.spawn_ray(sun), first, lit)
            return dr.select(lit, (1 - self.ambient) * cosine, 0) * tint

        def to_string(self) -> str:
            return "Light[]"

    return Light
