"""``focalgradient eye``: what an eye sees: depth of a scene from blur, image quality through focus, accommodation."""

from __future__ import annotations

import math
import os
import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from focalgradient.cli.blur_eye import eye_of
from focalgradient.cli.options import options_named, positive, shared_options, shared_work
from focalgradient.cli.person import description_of, has_natural_pupil, is_person, person_options
from focalgradient.cli.program import (
    announce,
    force_option,
    json_option,
    nothing_valid,
    progress,
    resumable,
    show,
    software_versions,
    summary_json,
    warnings_given,
    writable,
    write_set,
)
from focalgradient.errors import InputError, check_one_of
from focalgradient.files import printable

if TYPE_CHECKING:
    from focalgradient.eye import Eye, Viewing
    from focalgradient.eye.accommodation import Cue

__all__ = ["eye"]

PIXEL_ANGLE = math.radians(1 / 60)
"""Pixel angle in radians: a minute of arc, about the resolution of the fovea."""

SHAPE = (192, 256)
PUPIL_MM = 4.0
"""Default diameter of the pupil in mm: usual in daylight, a choice."""

FRAMES = 16
"""Number of frames of the film, over one period of half a second."""

NOISE, CORRELATION = 0.01, 0.95
SAMPLES = 64
PUPIL_MM_RANGE, FARTHEST = (0.1, 9.0), 40.0
"""Diameters in mm and maximum eccentricity in degrees, as `focalgradient.eye.ranges` and `focalgradient.eye.off_axis`,
without importing them."""

NAMES = ("spheres", "slant", "step", "plane")
"""Names of `focalgradient.scenes.SCENES_IN_DEPTH`, without importing them."""

STAGES = 8
SECONDS_PER_SECOND = 0.5
"""Computing time per second of a course, on two cores."""

CUES: dict[str, Cue] = {"bands": "bands", "oscillation": "moments", "both": "both"}
"""Depth cue by the name of the views."""

UNITS = {"refraction": "", "correction": "", "age": " years", "aberrations": "", "zones": "", "eye": ""}
"""Settings that the title of a figure states, and their units."""


def _within(low: float, high: float, bounds: str) -> Callable[[click.Context, click.Parameter, float | None], Any]:
    """Return an option's callback that raises `InputError` unless a number lies from `low` to `high`."""

    def check(_: click.Context, option: click.Parameter, given: float | None) -> float | None:
        if given is not None and not low <= given <= high:
            raise InputError(f"{option.opts[0]} is {given:g}, but must be {bounds.format(low, high)}.")
        return given

    return check


def _known(_: click.Context, __: click.Parameter, scene: str | None) -> str | None:
    if scene is not None and scene not in NAMES and (Path(scene).suffix or os.path.exists(scene)):
        raise InputError(
            f"SCENE is {scene!r}, but must be one of {', '.join(NAMES)}: give a picture of known depth to "
            "'focalgradient blur', and photographs that differ in aperture or focus to 'focalgradient depth'."
        )
    if scene is not None:
        check_one_of("SCENE", scene, NAMES)
    return scene


@click.command(short_help="Estimate depth from blur as an eye could.")
@click.argument("scene", metavar="[SCENE]", required=False, callback=_known)
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the results.")
@click.option(
    "--pupil",
    type=float,
    metavar="MM",
    callback=_within(*PUPIL_MM_RANGE, "from {:g} to {:g}: give the diameter in millimetres"),
    help="Pupil diameter (mm).  [default: 4, or natural by age]",
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
    callback=_within(0, FARTHEST, "between {:g} and {:g} degrees"),
    help="Degrees from the fovea: mean refraction and astigmatism there of emmetropes or, by --refraction, of myopes, "
    "and coma; a scene is resolved as by ganglion cells there.",
)
@click.option(
    "--meridian",
    type=click.Choice(["temporal", "nasal"]),
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
    callback=_within(0, 10, "between {:g} and {:g} dioptres"),
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
    given = {"pupil": pupil, "eye_file": eye_file, **person}
    if eccentricity is None and meridian is not None:
        raise InputError("--meridian is the side of --eccentricity: give --eccentricity as well.")
    for name, is_given in (("--accommodate", accommodate is not None), ("--through-focus", is_through_focus)):
        if scene is not None and is_given:
            raise InputError(f"SCENE {scene!r} and {name} are both given: leave out one.")
    if accommodate is not None:
        if is_through_focus:
            raise InputError("--accommodate and --through-focus are both given: leave out one.")
        if is_person(person) or illuminant != "D65" or eye_file is not None or eccentricity is not None or scatter:
            raise InputError(
                "--accommodate simulates the fovea of a young eye without glasses in daylight: leave out --refraction, "
                "--correction, --age, --luminance, --aberrations, --zones, --eye, --eccentricity, --scatter and "
                "--illuminant."
            )
        _accommodate(accommodate, out, PUPIL_MM if pupil is None else pupil, CUES[views], seed)
        return
    if scene is None and not is_through_focus:
        raise InputError(
            f"SCENE is missing: give one of {', '.join(NAMES)}, or --accommodate TARGET, or --through-focus."
        )
    if eye_file is not None and (pupil is not None or is_person(person)):
        raise InputError(
            "--eye describes the whole eye: leave out --pupil, --refraction, --correction, --age, --luminance, "
            "--aberrations and --zones."
        )
    if pupil is None and not has_natural_pupil(person):
        given["pupil"] = PUPIL_MM
    settings: dict[str, Any] = {"pupil_mm": pupil, "accommodation_D": accommodation, "illuminant": illuminant}
    settings |= {name: value for name, value in person.items() if value is not None}
    settings |= {} if eye_file is None else {"eye": eye_file.name}
    place: dict[str, Any] = (
        {} if eccentricity is None else {"eccentricity_deg": eccentricity, "meridian": meridian or "temporal"}
    )
    settings |= place | ({"scatter": True} if scatter else {})

    def subject() -> tuple[Eye, Viewing]:
        from focalgradient.eye import Viewing

        viewing = Viewing(illuminant, person["age"], scatter, **place)
        seeing = viewing.off_axis(eye_of(given, accommodation), description_of(person).periphery)
        settings["pupil_mm"] = 1e3 * seeing.pupil_diameter
        return seeing, viewing

    if scene is None:
        _through_focus(subject, out, settings)
    else:
        settings |= {"scene": scene, "views": views, "amplitude_D": amplitude, "seed": seed}
        _depth(scene, subject, out, settings, workers, scheduler)


def _depth(
    name: str,
    subject: Callable[[], tuple[Eye, Viewing]],
    out: Path,
    settings: dict[str, Any],
    workers: int | None,
    scheduler: str | None,
) -> None:
    """Recover the depth of a scene from the views of an eye, and write the results."""
    start = time.perf_counter()
    writable(out, ("views.png", "focus.png", "oscillation.mp4", "depth.npz", "summary.json"))
    seed, cue = settings["seed"], CUES[settings["views"]]
    with progress(STAGES) as say, warnings_given() as given, shared_work(workers, scheduler) as executor:
        say("forming the views")
        from focalgradient import recover_depth
        from focalgradient.eye import EXTREMES_S, Oscillation, accommodation_views, compared_views, score
        from focalgradient.eye.retina import S_FINEST_CPD
        from focalgradient.plotting.eye import eye_depth_figure, focus_figure
        from focalgradient.scenes import scene_about
        from focalgradient.video import write_light

        (seeing, viewing), course = subject(), Oscillation(settings["amplitude_D"])
        scene = scene_about(name, settings["accommodation_D"], field=SHAPE[1] * PIXEL_ANGLE, seed=seed)
        how: dict[str, Any] = {"seed": seed, "executor": executor}
        seen = compared_views(
            *(scene, seeing, cue, SHAPE, PIXEL_ANGLE),
            viewing=viewing,
            course=course,
            correlation=CORRELATION,
            noise=NOISE,
            samples=SAMPLES,
            **how,
        )
        named = {name: one.view for name, one in seen.items()}
        result = recover_depth([*named.values()], progress=lambda share, words: say(words))
        say("filming")
        moments = (np.arange(FRAMES) / FRAMES / 2).tolist()
        film = accommodation_views(scene, seeing, moments, course, SHAPE, PIXEL_ANGLE, wavelengths=1, samples=32, **how)
        say("drawing")
        truth = next(iter(seen.values())).distance
        figure = eye_depth_figure(named, result, truth)
        times = np.linspace(0, 1, 201)
        focus = {
            band: seeing.accommodation + course.at(times) - viewing.light(band).difference() for band in ("L+M", "S")
        }
        drawn = focus_figure(times, focus, () if cue == "bands" else EXTREMES_S)
        found = score(result.vergence, result.valid, truth, seeing.accommodation)
    assumed = {"pixel_arcmin": 1.0, "noise_of_mean": NOISE, "texture_correlation_of_bands": CORRELATION}
    rejected = result.details.get("rejected")
    side = f"Side of focus right: {found['side_right']:.1%}" if found["side_right"] >= 0 else "All is in focus."
    _write(
        out,
        {
            "views.png": figure.savefig,
            "focus.png": drawn.savefig,
            "oscillation.mp4": lambda path: write_light(
                path, [one.view.image for one in film], 2 * FRAMES / 8, repeated=4
            ),
            "depth.npz": result.save,
        },
        {
            "settings": settings | assumed | {"s_cones_resolve_cycles_per_degree": S_FINEST_CPD},
            "focus_D": [view.optics.focus_vergence for view in named.values()],
            "found": found,
            "details": result.details,
            "warnings": given,
        },
        start,
        *([] if rejected else [f"Median error: {found['median_error_D']:.3g} D", side]),
        f"Valid pixels: {found['valid']:.1%}",
    )
    nothing_valid(rejected)


def _through_focus(subject: Callable[[], tuple[Eye, Viewing]], out: Path, settings: dict[str, Any]) -> None:
    """Write the image quality of an eye in white light against the target's vergence."""
    start = time.perf_counter()
    writable(out, ("through_focus.png", "through_focus.csv", "summary.json"))
    with warnings_given() as given:
        from focalgradient.eye import image_quality, point_images
        from focalgradient.eye.quality import PIXEL_ANGLE as POINT_ANGLE
        from focalgradient.plotting.eye import through_focus_figure

        seeing, viewing = subject()
        cones = viewing.cones(seeing, "luminance")
        quality = image_quality(cones)
        images = point_images(cones, quality.best)
        figure = through_focus_figure(quality, images, POINT_ANGLE, _stated(settings))
    found = {"focus_D": cones.focus_vergence, **quality.summary()}
    _write(
        out,
        {"through_focus.png": figure.savefig, "through_focus.csv": quality.to_csv().encode()},
        {"settings": settings, "found": found, "warnings": given},
        start,
        f"Best focus: {found['best_D']:.2f} D, visual Strehl ratio {found['visual_strehl']:.2f}",
        f"Depth of focus (80 % of it): {'at least ' * quality.is_cut_off()}{found['depth_of_focus_D']:.2f} D",
    )


def _accommodate(target: str, out: Path, pupil_mm: float, cue: Cue, seed: int) -> None:
    """Simulate accommodation to a target, and write the results."""
    start = time.perf_counter()
    from focalgradient.eye import Accommodation, Target, TargetMotion
    from focalgradient.eye import accommodate as simulated
    from focalgradient.eye.ranges import warn_if_artificial

    with options_named({"motion": "--accommodate"}):
        motion = TargetMotion.parse(target)
    writable(out, ("course.csv", "course.png", "retina.mp4", "summary.json"), [motion.file] if motion.file else [])
    seconds = SECONDS_PER_SECOND * motion.duration
    with (
        resumable("nothing was written.", lambda: announce(seconds, "Accommodating")) as say,
        warnings_given() as given,
    ):
        say(0.0, "accommodating")
        from focalgradient.plotting.eye import accommodation_figure
        from focalgradient.video import write_frames

        warn_if_artificial(1e-3 * pupil_mm)
        eye = Accommodation(cue=cue, pupil_diameter=1e-3 * pupil_mm)
        course = simulated(
            motion.at, motion.duration, eye, seed=seed, progress=lambda share, words: say(0.9 * share, words)
        )
        say(0.9, "drawing")
        figure = accommodation_figure(course, motion.at, motion.title)
        film = Target(contrast=0.35).film(course.target, course.accommodation, eye.pupil_diameter, texture=seed)
    settings = {
        "target": motion.text,
        "seconds": motion.duration,
        "pupil_mm": pupil_mm,
        "cue": cue,
        "seed": seed,
        "plant": asdict(eye.plant),
        "pulse": asdict(eye.pulse) if eye.pulse else None,
        "noise_of_mean": eye.noise,
        "moments_per_second": eye.rate,
    }
    found = course.summary()
    _write(
        out,
        {
            "course.csv": course.to_csv().encode(),
            "course.png": figure.savefig,
            "retina.mp4": lambda path: write_frames(path, film, eye.rate),
        },
        {"settings": settings, "found": found, "warnings": given},
        start,
        f"Lag over the last two seconds: {found['lag_D']:.2f} D",
        f"Error of the estimate, root mean square: {found['estimate_rms_error_D']:.2f} D; "
        f"within two stated standard deviations: {found['estimate_within_2_sd']:.0%}",
    )


def _write(
    out: Path,
    files: Mapping[str, bytes | Callable[[Path], object]],
    record: Mapping[str, Any],
    start: float,
    *lines: str,
) -> None:
    """Write the files and the summary of a simulation that began at `start`, and print the lines."""
    summary = {"simulated": True, **record, "versions": software_versions("numpy", "scipy")}
    content = summary_json(summary | {"seconds": time.perf_counter() - start})
    write_set(out, {**files, "summary.json": content}, "summary.json")
    written = [printable(out / name) for name in (*files, "summary.json")]
    show(summary | {"written": written}, *lines, f"Written: {', '.join(written)}")


def _stated(settings: Mapping[str, Any]) -> Sequence[str]:
    """Return the settings of the eye that the title states."""
    stated = [f"pupil {settings['pupil_mm']:.1f} mm", f"light {settings['illuminant']}"]
    stated.append(f"looking at {settings['accommodation_D']:g} D")
    for name, unit in UNITS.items():
        if (value := settings.get(name)) is not None:
            words = f"{value:g}{unit}" if isinstance(value, float) else re.sub(r"-(?=\d)", "−", str(value))
            stated.append(f"{name} {words}")
    if "eccentricity_deg" in settings:
        stated.append(f"at {settings['eccentricity_deg']:g}° in the {settings['meridian']} field")
    return [*stated, "scatter CIE"] if settings.get("scatter") else stated
