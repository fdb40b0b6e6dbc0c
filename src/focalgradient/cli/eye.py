"""``focalgradient eye``: depth of a scene as an eye could see it, by colour, by fluctuations of focus, or by both."""

from __future__ import annotations

import math
import os
import platform
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click
import numpy as np

from focalgradient.cli.blur_eye import eye_of_file
from focalgradient.cli.options import positive, shared_options, shared_work
from focalgradient.cli.person import eye_off_axis, has_natural_pupil, is_person, person_eye, person_options
from focalgradient.cli.program import (
    force_option,
    json_option,
    nothing_valid,
    progress,
    show,
    summary_json,
    warnings_given,
    writable,
    write_set,
)
from focalgradient.errors import InputError, check_one_of
from focalgradient.files import printable

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from focalgradient.depth import DepthMap
    from focalgradient.eye import Band, Cones, Eye, Light, TimeCourse
    from focalgradient.eye.accommodation import Cue
    from focalgradient.render import Rendered
    from focalgradient.scenes import Scene

__all__ = ["eye"]

PIXEL_ANGLE = math.radians(1 / 60)
"""Pixel angle in radians: a minute of arc, about the resolution of the fovea."""

SHAPE = (192, 256)
VIEW_TIMES_S = (0.125, 0.375)
"""Times of the two views in seconds: the extremes of an oscillation at 2 Hz, 250 ms apart."""

PUPIL_MM = 4.0
"""Default diameter of the pupil in mm: usual in daylight, a choice."""

FRAMES = 16
"""Number of frames of the film, over one period of half a second."""

NOISE, CORRELATION = 0.01, 0.95
ASSUMED = {"pixel_arcmin": 1.0, "noise_of_mean": NOISE, "texture_correlation_of_bands": CORRELATION}
SAMPLES = 64
NAMES = ("spheres", "slant", "step", "plane")
MERIDIANS = ("temporal", "nasal")
"""Sides of the visual field in which people's refraction was measured."""
FARTHEST = 40.0
"""Maximum eccentricity in degrees, as `focalgradient.eye.off_axis.FARTHEST`, without importing it."""
STAGES = 8
CUES: dict[str, Cue] = {"bands": "bands", "oscillation": "moments", "both": "both"}
"""Depth cue of an accommodating eye, by the name of the views."""

FILES = ("views.png", "focus.png", "oscillation.mp4", "depth.npz", "summary.json")


def _pupil(_: click.Context, __: click.Parameter, given: float | None) -> float | None:
    if given is None:
        return None
    from focalgradient.eye.ranges import LARGEST_PUPIL, SMALLEST_PUPIL

    smallest, largest = 1e3 * SMALLEST_PUPIL, 1e3 * LARGEST_PUPIL
    if not smallest <= given <= largest:
        raise InputError(
            f"--pupil is {given:g}, but must be from {smallest:g} to {largest:g}: give the diameter in millimetres."
        )
    return given


def _accommodation(_: click.Context, __: click.Parameter, given: float) -> float:
    if not 0 <= given <= 10:
        raise InputError(f"--accommodation is {given:g}, but must be between 0 and 10 dioptres.")
    return given


def _eccentricity(_: click.Context, __: click.Parameter, given: float | None) -> float | None:
    if given is not None and not 0 <= given <= FARTHEST:
        raise InputError(f"--eccentricity is {given:g}, but must be between 0 and {FARTHEST:g} degrees.")
    return given


def _known(_: click.Context, __: click.Parameter, scene: str | None) -> str | None:
    if scene is None or scene in NAMES:
        return scene
    if Path(scene).suffix or os.path.exists(scene):
        raise InputError(
            f"SCENE is {scene!r}, but must be one of {', '.join(NAMES)}: give a picture of known depth to "
            "'focalgradient blur', and photographs that differ in aperture or focus to 'focalgradient depth'."
        )
    check_one_of("SCENE", scene, NAMES)
    return scene


@click.command(short_help="Estimate depth from blur as an eye could.")
@click.argument("scene", metavar="[SCENE]", required=False, callback=_known)
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the results.")
@click.option(
    "--pupil", type=float, metavar="MM", callback=_pupil, help="Pupil diameter (mm).  [default: 4, or natural by age]"
)
@person_options
@click.option(
    "--illuminant",
    default="D65",
    show_default=True,
    metavar="NAME",
    help='Illuminant of the scene: D65, A, E, LED-B1 or another by the CIE, or a black body such as "3000 K".',
)
@click.option(
    "--eye",
    "eye_file",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help='Instead of --pupil: a measured eye (TOML), with pupil_mm and zernike = "TABLE.csv" or aberrations.',
)
@click.option(
    "--eccentricity",
    type=float,
    metavar="DEG",
    callback=_eccentricity,
    help="Degrees from the fovea: mean refraction and astigmatism there of emmetropes or, by --refraction, of myopes, "
    "and coma; a scene is resolved as by ganglion cells there.",
)
@click.option(
    "--meridian",
    type=click.Choice(MERIDIANS),
    help="Side of the visual field for --eccentricity.  [default: temporal]",
)
@click.option(
    "--scatter",
    is_flag=True,
    help="Include the light scattered in the eye (CIE 146:2002), by --age if given, otherwise of 25 years.",
)
@click.option(
    "--accommodation",
    type=float,
    default=1.0,
    show_default=True,
    metavar="D",
    callback=_accommodation,
    help="Vergence in dioptres (1 / distance in m) that the eye focuses, as far as --refraction and --age allow.",
)
@click.option(
    "--views",
    type=click.Choice(["bands", "oscillation", "both"]),
    default="bands",
    show_default=True,
    help="Views: bands, L and M cones and S cones at one moment; oscillation, L and M cones at two moments; or both.",
)
@click.option(
    "--amplitude",
    type=float,
    default=0.25,
    show_default=True,
    metavar="D",
    callback=positive(" of dioptres"),
    help="Amplitude of the oscillation of focus, in dioptres: from the mean to an extreme.",
)
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, metavar="N", help="Random seed of scene and noise."
)
@click.option(
    "--accommodate",
    metavar="TARGET",
    help="Instead of SCENE: the eye focuses a target by its own estimate of depth. TARGET is step:FROM,TO[,SECOND] "
    "or sine:MEAN,AMPLITUDE,HZ in dioptres, or a CSV file of time,dioptres.",
)
@click.option(
    "--through-focus",
    "is_through_focus",
    is_flag=True,
    help="Instead of SCENE: modulation transfer, visual Strehl ratio and point-spread functions by the target's "
    "vergence.",
)
@shared_options
@force_option
@json_option
def eye(
    scene: str | None,
    out: Path,
    pupil: float | None,
    accommodation: float,
    views: str,
    amplitude: float,
    seed: int,
    accommodate: str | None,
    illuminant: str,
    is_through_focus: bool,
    eye_file: Path | None,
    eccentricity: float | None,
    meridian: str | None,
    scatter: bool,
    workers: int | None,
    scheduler: str | None,
    **person: Any,
) -> None:
    """See the depth of SCENE (spheres, slant, step or plane) as an eye could from blur alone.

    The scene is blurred by waves, with diffraction, in as many wavelengths for each cone class as the pupil needs (5 to
    15), with 1 % noise. S cones resolve 10 cycles per degree, and their texture has a correlation of 0.95 with the
    others'. Depth is then recovered from these views alone. Takes about 20 s on two cores.

    Writes DIR/views.png (views, true and recovered depth, error), DIR/focus.png (focus over time), DIR/oscillation.mp4,
    DIR/depth.npz (distance, vergence, vergence_sd, valid) and DIR/summary.json.

    The eye can be a person's: --refraction "-2.00 -0.75 x 180" with or without --correction, --age 60, --luminance 10;
    or a measured one (--eye FILE). It sees with its fovea, or --eccentricity degrees from it.

    With --through-focus, no SCENE is given. Writes DIR/through_focus.png, DIR/through_focus.csv and DIR/summary.json,
    in some seconds.

    With --accommodate, the eye focuses a textured target instead of a SCENE, by an estimate of its vergence from two
    wavebands (--views bands), from one waveband at several moments (oscillation) or from both. Writes DIR/course.csv
    (time, target, accommodation, estimate and its standard deviation), DIR/course.png, DIR/retina.mp4 (retinal image in
    colour) and DIR/summary.json. 10 s of the course take about 5 s.

    \b
    Examples:
      focalgradient eye --through-focus --refraction "-2.00 -0.75 x 180" --age 30 --out results
      focalgradient eye --through-focus --pupil 4 --eccentricity 20 --meridian nasal --out periphery
      focalgradient eye spheres --out results --views both --pupil 4 --accommodation 1
      focalgradient eye --accommodate step:1,3 --views both --out results
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    start = time.perf_counter()
    if pupil is None and not has_natural_pupil(person) and eye_file is None:
        pupil = PUPIL_MM
    given_place = _Place.of(eccentricity, meridian)
    if accommodate is not None:
        if scene is not None:
            raise InputError(f"SCENE {scene!r} and --accommodate are both given: leave out one.")
        if is_through_focus:
            raise InputError("--accommodate and --through-focus are both given: leave out one.")
        if is_person(person) or illuminant != "D65" or eye_file is not None or given_place is not None or scatter:
            raise InputError(
                "--accommodate simulates the fovea of a young eye without glasses in daylight: leave out --refraction, "
                "--correction, --age, --luminance, --aberrations, --zones, --eye, --eccentricity, --scatter and "
                "--illuminant."
            )
        from focalgradient.cli.accommodate import accommodate as follow

        follow(accommodate, out, pupil or PUPIL_MM, CUES[views], seed)
        return
    light = _Light(illuminant, person["age"], scatter, given_place)
    settings: dict[str, Any] = {"pupil_mm": pupil, "accommodation_D": accommodation, "illuminant": illuminant}
    settings |= {name: value for name, value in person.items() if value is not None}
    if eye_file is not None:
        settings["eye"] = eye_file.name
    if given_place is not None:
        settings |= {"eccentricity_deg": given_place.eccentricity, "meridian": given_place.meridian}
    if scatter:
        settings["scatter"] = True
    if is_through_focus:
        if scene is not None:
            raise InputError(f"SCENE {scene!r} and --through-focus are both given: leave out one.")
        from focalgradient.cli.through_focus import through_focus

        subject = _subject(person, pupil, eye_file, given_place, accommodation)
        settings["pupil_mm"] = 1e3 * subject.pupil_diameter
        through_focus(light.cones(subject, "luminance"), out, settings)
        return
    if scene is None:
        raise InputError(
            f"SCENE is missing: give one of {', '.join(NAMES)}, or --accommodate TARGET, or --through-focus."
        )
    writable(out, FILES)
    with progress(STAGES) as say, warnings_given() as given, shared_work(workers, scheduler) as executor:
        say("forming the views")
        from focalgradient import recover_depth
        from focalgradient.eye import Oscillation, score

        subject = _subject(person, pupil, eye_file, given_place, accommodation)
        course = Oscillation(amplitude)
        world = _scene(scene, seed, accommodation)
        names, cones, seen = _views(world, subject, course, views, seed, light, executor)
        result = recover_depth([one.view for one in seen], progress=lambda share, words: say(words))
        say("filming")
        film = _film(world, subject, course, seed, executor)
        say("drawing")
        figure = _views_figure(seen, names, result)
        focus = _focus_figure(course, subject.accommodation, light, None if views == "bands" else VIEW_TIMES_S)
        found = score(result.vergence, result.valid, seen[0].distance, subject.accommodation)

    settings |= {
        "scene": scene,
        "pupil_mm": 1e3 * subject.pupil_diameter,
        "views": views,
        "amplitude_D": amplitude,
        "seed": seed,
    }
    summary = _summary(settings, cones, found, result.details, given)
    writers: dict[str, bytes | Callable[[Path], object]] = {
        "views.png": figure.savefig,
        "focus.png": focus.savefig,
        "oscillation.mp4": lambda path: _write_film(path, film),
        "depth.npz": result.save,
        "summary.json": summary_json(summary | {"seconds": time.perf_counter() - start}),
    }
    write_set(out, writers, "summary.json")
    written = [printable(out / name) for name in writers]
    rejected = result.details.get("rejected")
    side = f"Side of focus right: {found['side_right']:.1%}" if found["side_right"] >= 0 else "All is in focus."
    show(
        summary | {"written": written},
        *([] if rejected else [f"Median error: {found['median_error_D']:.3g} D", side]),
        f"Valid pixels: {found['valid']:.1%}",
        f"Written: {', '.join(written)}",
    )
    nothing_valid(rejected)


def _views(
    world: Scene, subject: Any, course: TimeCourse, views: str, seed: int, light: _Light, executor: Executor | None
) -> tuple[list[str], list[Cones], list[Rendered]]:
    """Return the view in each band and at each moment: its name, the cones, and the view."""
    from focalgradient.eye import eye_views

    moments = {"": subject}
    if views != "bands":
        eyes = subject.through(VIEW_TIMES_S, course)
        moments = {f" at {1e3 * t:.0f} ms": one for t, one in zip(VIEW_TIMES_S, eyes, strict=True)}
    bands: tuple[Band, ...] = ("L+M",) if views == "oscillation" else ("L+M", "S")
    cones = {f"{band}{moment}": light.cones(one, band) for moment, one in moments.items() for band in bands}
    how: dict[str, Any] = {"noise": NOISE, "correlation": CORRELATION, "samples": SAMPLES, "seed": seed}
    seen = eye_views(world, [*cones.values()], SHAPE, PIXEL_ANGLE, executor=executor, **how)
    return [*cones], [*cones.values()], seen


@dataclass(frozen=True)
class _Place:
    """Place in the visual field: degrees from the fovea, and the side."""

    eccentricity: float
    meridian: Literal["temporal", "nasal"]

    @classmethod
    def of(cls, eccentricity: float | None, meridian: str | None) -> _Place | None:
        """Return the place of the options; None at the fovea."""
        if eccentricity is None:
            if meridian is not None:
                raise InputError("--meridian is the side of --eccentricity: give --eccentricity as well.")
            return None
        return cls(eccentricity, "nasal" if meridian == "nasal" else "temporal")


def _subject(
    person: dict[str, Any], pupil: float | None, file: Path | None, place: _Place | None, accommodation: float
) -> Eye:
    """Return the eye of the options, as it is at the place in its field."""
    if file is None:
        subject = person_eye(person, pupil, accommodation)
    elif pupil is not None or is_person(person):
        raise InputError(
            "--eye describes the whole eye: leave out --pupil, --refraction, --correction, --age, --luminance, "
            "--aberrations and --zones."
        )
    else:
        subject = eye_of_file(file, accommodation)
    return subject if place is None else eye_off_axis(subject, person, place.eccentricity, place.meridian)


@dataclass(frozen=True)
class _Light:
    """Light of the scene as transmitted by a lens of an `age` (years; None: that of the cone fundamentals).

    `scatter` adds the light scattered in the eye, and `place` is that of the cones.
    """

    illuminant: str
    age: float | None
    scatter: bool
    place: _Place | None

    def of(self, band: Band) -> Light:
        from focalgradient.eye import aged_light, band_light

        caught = band_light(band, self.illuminant)
        return caught if self.age is None else aged_light(caught, self.age)

    def cones(self, subject: Any, band: Band) -> Cones:
        from focalgradient.eye import Cones, Scatter, resolved_cpd
        from focalgradient.eye.retina import S_FINEST_CPD

        finest = S_FINEST_CPD if band == "S" else math.inf
        if self.place is not None and band != "luminance":  # image quality is that of the optics
            finest = min(finest, float(resolved_cpd(self.place.eccentricity, self.place.meridian)))
        cones = Cones.in_light(subject, band, self.of(band), finest_cpd=finest)
        if not self.scatter:
            return cones
        return replace(cones, scatter=Scatter() if self.age is None else Scatter(self.age))


def _scene(name: str, seed: int, fixation: float) -> Scene:
    """Return the scene of that name, centred on the fixation."""
    from focalgradient.scenes import plane, slant, spheres, step

    field = SHAPE[1] * PIXEL_ANGLE
    nearer, farther = 1 / (fixation + 0.8), 1 / max(fixation - 0.6, 0.1)
    if name == "slant":
        return slant(nearer, farther, field, seed=seed)
    if name == "step":
        return step(nearer, farther, seed=seed)
    return plane(farther, seed=seed) if name == "plane" else spheres(seed, field=field)


def _summary(
    settings: dict[str, Any],
    cones: list[Cones],
    found: dict[str, float],
    details: Mapping[str, Any],
    warnings: list[str],
) -> dict[str, Any]:
    """Return the summary, except for the computing time."""
    from focalgradient.eye.retina import S_FINEST_CPD

    return {
        "simulated": True,
        "settings": settings | ASSUMED | {"s_cones_resolve_cycles_per_degree": S_FINEST_CPD},
        "focus_D": [one.focus_vergence for one in cones],
        "found": found,
        "details": details,
        "warnings": warnings,
        "versions": {name: version(name) for name in ("focalgradient", "numpy", "scipy")}
        | {"python": platform.python_version()},
    }


def _film(world: Scene, subject: Any, course: TimeCourse, seed: int, executor: Executor | None) -> list[Rendered]:
    from focalgradient.eye import accommodation_views

    times = (np.arange(FRAMES) / FRAMES / 2).tolist()
    return accommodation_views(
        world, subject, times, course, SHAPE, PIXEL_ANGLE, wavelengths=1, samples=32, seed=seed, executor=executor
    )


def _write_film(path: Path, film: list[Rendered]) -> None:
    """Write one period of the oscillation, repeated four times at an eighth of its speed."""
    from focalgradient.video import Scale, VideoFile

    white = float(np.percentile([one.view.image for one in film], 99.7))
    ticks = tuple((value, f"{value:g}") for value in (0.0, 0.5, 1.0))
    file = VideoFile(path, 2 * FRAMES / 8, SHAPE, Scale(0.0, 1.0, ticks, "light"))
    try:
        for one in film * 4:
            file.write((one.view.image / white) ** (1 / 2.2), np.ones(SHAPE, np.bool_))
    finally:
        file.close()


def _views_figure(seen: list[Rendered], names: list[str], result: DepthMap) -> Any:
    """Draw the views, true and recovered depth, and the error."""
    from focalgradient.plotting import depth_figure

    truth = seen[0].distance
    finite = np.where(np.isfinite(truth), truth, np.nan)
    figure = depth_figure([one.view for one in seen], result, names=names, truth=finite)
    figure.text(0.99, 0.005, "a simulated eye", ha="right", va="bottom", fontsize=8)
    return figure


def _focus_figure(course: TimeCourse, accommodation: float, light: _Light, moments: tuple[float, ...] | None) -> Any:
    """Draw the focus of each cone class over a second, and the times of the views."""
    from focalgradient.plotting import BLUE, GREY, ORANGE, new_figure, style

    times = np.linspace(0, 1, 201)
    with style():
        figure = new_figure(120, 62, layout="constrained")
        ax = figure.subplots()
        colours: dict[Band, str] = {"L+M": ORANGE, "S": BLUE}
        for band, colour in colours.items():
            focus = accommodation + course.at(times) - light.of(band).difference()
            ax.plot(1e3 * times, focus, color=colour)
            ax.text(1010, focus[-1], f"{band} cones", color=colour, va="center")
        for moment in moments or ():
            ax.axvline(1e3 * moment, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
        if moments:
            between = accommodation - sum(light.of(band).difference() for band in colours) / 2
            ax.text(1e3 * moments[1] + 12, between, "the views’ moments", color=GREY, va="center")
        ax.set(xlim=(0, 1000), xlabel="time (ms)", ylabel="vergence in focus (D)")
        ax.set_title("Focus of a simulated eye")
        figure.draw_without_rendering()
    return figure
