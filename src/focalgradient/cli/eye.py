"""``focalgradient eye``: what an eye sees: depth of a scene from blur, image quality through focus, accommodation."""

from __future__ import annotations

import math
import os
import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import click
import numpy as np

import focalgradient as fg
from focalgradient.cli.generate import File, Folder, command, options_named
from focalgradient.cli.groups import Work, Workers
from focalgradient.cli.person import Person, eye_notes, eye_of, eye_state
from focalgradient.cli.program import (
    announce,
    nothing_valid,
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
from focalgradient.quantities import DIOPTRES

if TYPE_CHECKING:
    from focalgradient.eye import Eye, TargetMotion, ViewingConditions
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
NAMES = ("spheres", "slant", "step", "plane")
"""Names of `focalgradient.scenes.SCENES_IN_DEPTH`, without importing them."""

SECONDS_PER_SECOND = 0.5
"""Computing time per second of a course, on two cores."""

CUES: dict[str, Cue] = {"bands": "bands", "oscillation": "moments", "both": "both"}
"""Depth cue by the name of the views."""

UNITS = {"refraction": "", "correction": "", "age": " years", "aberrations": "", "zones": "", "eye": ""}
"""Settings that the title of a figure states, and their units."""

SCENE_FILES = ("views.png", "focus.png", "oscillation.mp4", "depth.npz", "summary.json")
COURSE_FILES = ("course.csv", "course.png", "retina.mp4", "summary.json")
QUALITY_FILES = ("through_focus.png", "through_focus.csv", "summary.json")


@dataclass(frozen=True)
class _Result:
    """Contents of the files, entries of the summary, and lines printed."""

    files: Mapping[str, bytes | Callable[[Path], object]]
    record: Mapping[str, Any]
    lines: Sequence[str]


def _within(low: float, high: float, bounds: str) -> Callable[[str, float], float]:
    """Return a function that raises `InputError` unless an option's number lies from `low` to `high`."""

    def check(option: str, given: float) -> float:
        if not low <= given <= high:
            raise InputError(f"{option} is {given:g}, but must be {bounds}.")
        return given

    return check


pupil_mm = _within(0.1, 9, "from 0.1 to 9: give the diameter in millimetres")
vergence = _within(0, 10, "between 0 and 10 dioptres")
degrees = _within(0, 40, "between 0 and 40 degrees")


def known(_: str, scene: str) -> str:
    """Raise `InputError` unless a scene is one of `NAMES`."""
    if scene not in NAMES and (Path(scene).suffix or os.path.exists(scene)):
        raise InputError(
            f"SCENE is {scene!r}, but must be one of {', '.join(NAMES)}: give a picture of known depth to "
            "'focalgradient blur', and photographs that differ in aperture or focus to 'focalgradient depth'."
        )
    check_one_of("SCENE", scene, NAMES)
    return scene


@command("Estimate depth from blur as an eye could.")
def eye(
    scene: Annotated[str | None, known, "[SCENE]"] = None,
    /,
    *,
    out: Folder,
    pupil: Annotated[float | None, pupil_mm, "MM"] = None,
    person: Person,
    illuminant: Annotated[str, "NAME"] = "D65",
    eye_file: Annotated[File | None, "--eye"] = None,
    eccentricity: Annotated[float | None, degrees, "DEG"] = None,
    meridian: Literal["temporal", "nasal"] | None = None,
    scatter: bool = False,
    accommodation: Annotated[float, vergence, "D"] = 1.0,
    views: Literal["bands", "oscillation", "both"] = "bands",
    amplitude: Annotated[float, DIOPTRES] = 0.25,
    seed: Annotated[int, click.IntRange(0), "N"] = 0,
    accommodate: Annotated[str | None, "TARGET"] = None,
    is_through_focus: Annotated[bool, "--through-focus"] = False,
    workers: Workers,
) -> None:
    """See the depth of SCENE (spheres, slant, step or plane) as an eye could from blur alone.

    The scene is blurred by waves, with diffraction, in as many wavelengths for each cone class as the pupil needs (5 to
    15), with 1 % noise. S cones resolve 10 cycles per degree; the pattern that they see has a correlation of 0.95
    with that of the other cones. Depth is then recovered from these views alone. Takes about 20 s on two cores.

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

    Parameters
    ----------
    out
        Folder for the results.
    pupil
        Pupil diameter (mm).  [default: 4, or natural by age]
    illuminant
        Illuminant of the scene: D65, A, E, LED-B1 or another by the CIE, or a black body such as "3000 K".
    eye_file
        Instead of --pupil: a measured eye (TOML), with pupil_mm and zernike = "TABLE.csv" or aberrations.
    eccentricity
        Degrees from the fovea: mean refraction and astigmatism there of emmetropes or, by --refraction, of myopes, and
        coma; a scene is resolved as by ganglion cells there.
    meridian
        Side of the visual field for --eccentricity.  [default: temporal]
    scatter
        Include the light scattered in the eye (CIE 146:2002), by --age if given, otherwise of 25 years.
    accommodation
        Vergence in dioptres (1 / distance in m) that the eye focuses, as far as --refraction and --age allow.
    views
        Views: bands (L and M cones, and S cones, at one moment), oscillation (L and M cones at two moments), or both.
    amplitude
        Amplitude of the oscillation of focus, in dioptres: from the mean to an extreme.
    seed
        Random seed of scene and noise.
    accommodate
        Instead of SCENE: the eye focuses a target by its own estimate of depth. TARGET is step:FROM,TO[,SECOND] or
        sine:MEAN,AMPLITUDE,HZ in dioptres, or a CSV file of time,dioptres.
    is_through_focus
        Instead of SCENE: modulation transfer, visual Strehl ratio and point-spread functions by the target's vergence.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    start = time.perf_counter()
    if eccentricity is None and meridian is not None:
        raise InputError("--meridian is the side of --eccentricity: give --eccentricity as well.")
    modes = [f"SCENE {scene!r}"] * (scene is not None) + ["--accommodate"] * (accommodate is not None)
    modes += ["--through-focus"] * is_through_focus
    if len(modes) > 1:
        raise InputError(f"{modes[0]} and {modes[1]} are both given: leave out one.")
    if not modes:
        raise InputError(
            f"SCENE is missing: give one of {', '.join(NAMES)}, or --accommodate TARGET, or --through-focus."
        )
    if accommodate is not None and (
        not person.is_empty or illuminant != "D65" or eye_file is not None or eccentricity is not None or scatter
    ):
        raise InputError(
            "--accommodate simulates the fovea of a young eye without glasses in daylight: leave out --refraction, "
            "--correction, --age, --luminance, --aberrations, --zones, --eye, --eccentricity, --scatter and "
            "--illuminant."
        )
    if eye_file is not None and (pupil is not None or not person.is_empty):
        raise InputError(
            "--eye describes the whole eye: leave out --pupil, --refraction, --correction, --age, --luminance, "
            "--aberrations and --zones."
        )
    if pupil is None and not person.has_natural_pupil:
        pupil = PUPIL_MM
    with warnings_given() as given:
        if accommodate is not None:
            with options_named({"motion": "--accommodate"}):
                motion = fg.eye.TargetMotion.parse(accommodate)
            writable(out, COURSE_FILES, [motion.file] if motion.file else [])
            result = _accommodate(motion, pupil or PUPIL_MM, CUES[views], seed)
        else:
            writable(out, QUALITY_FILES if scene is None else SCENE_FILES)
            place: dict[str, Any] = {"eccentricity_deg": eccentricity, "meridian": meridian or "temporal"}
            conditions = fg.eye.ViewingConditions(illuminant, person.age, scatter, **place)
            looking = eye_of(person, eye_file, pupil, accommodation)
            seeing = conditions.off_axis(looking, person.periphery)
            settings: dict[str, Any] = {"pupil_mm": 1e3 * seeing.pupil_diameter, "accommodation_D": accommodation}
            settings |= {"eyes": [eye_state(person, looking, accommodation)]}
            settings |= {"illuminant": illuminant}
            settings |= {name: value for name, value in asdict(person).items() if value is not None}
            settings |= {} if eye_file is None else {"eye": eye_file.name}
            settings |= {} if eccentricity is None else place
            settings |= {"scatter": True} if scatter else {}
            if scene is None:
                result = _through_focus(seeing, conditions, settings)
            else:
                settings |= {"scene": scene, "views": views, "amplitude_D": amplitude, "seed": seed}
                result = _depth(seeing, conditions, settings, workers)
    versions = software_versions("numpy", "scipy")
    summary = {"simulated": True, **result.record, "warnings": given, "versions": versions}
    content = summary_json(summary | {"seconds": time.perf_counter() - start})
    write_set(out, {**result.files, "summary.json": content}, "summary.json")
    written = [printable(out / name) for name in (*result.files, "summary.json")]
    notes = eye_notes(result.record["settings"].get("eyes", []))
    show(summary | {"written": written}, *notes, *result.lines, f"Written: {', '.join(written)}")
    nothing_valid(result.record.get("details", {}).get("rejected"))


def _depth(seeing: Eye, conditions: ViewingConditions, settings: Mapping[str, Any], workers: Work) -> _Result:
    """Recover the depth of a scene from the views of an eye."""
    seed, cue = settings["seed"], CUES[settings["views"]]
    with resumable("") as say, workers.shared() as executor:
        say(0.0, "forming the views")
        from focalgradient.eye.cones import S_FINEST_CPD
        from focalgradient.plotting.eye import eye_depth_figure, focus_figure

        course, field = fg.eye.Oscillation(settings["amplitude_D"]), SHAPE[1] * PIXEL_ANGLE
        scene = fg.scenes.scene_about(settings["scene"], settings["accommodation_D"], field=field, seed=seed)
        frame: dict[str, Any] = {"shape": SHAPE, "pixel_angle": PIXEL_ANGLE, "seed": seed, "executor": executor}
        assumed: dict[str, Any] = {"correlation": CORRELATION, "noise": NOISE, "samples": SAMPLES}
        seen = fg.eye.compared_views(scene, seeing, cue, conditions=conditions, course=course, **assumed, **frame)
        named = {name: one.view for name, one in seen.items()}
        result = fg.recover_depth([*named.values()], progress=lambda share, words: say(0.2 + 0.6 * share, words))
        say(0.8, "filming")
        moments = (np.arange(FRAMES) / FRAMES / 2).tolist()
        film = fg.eye.accommodation_views(scene, seeing, moments, course, wavelengths=1, samples=32, **frame)
        say(0.9, "drawing")
        truth = next(iter(seen.values())).distance
        figure = eye_depth_figure(named, result, truth)
        times = np.linspace(0, 1, 201)
        mean = {band: seeing.accommodation - conditions.light(band).difference() for band in ("L+M", "S")}
        focus = {band: value + course.at(times) for band, value in mean.items()}
        focus_drawn = focus_figure(times, focus, () if cue == "bands" else fg.eye.EXTREMES_S)
        found = fg.eye.score(result.vergence, result.valid, truth, seeing.accommodation)

    def write_film(path: Path) -> None:
        fg.video.write_light(path, [one.view.image for one in film], 2 * FRAMES / 8, repeated=4)

    side = f"Side of focus right: {found['side_right']:.1%}" if found["side_right"] >= 0 else "All is in focus."
    error = [] if result.details.get("rejected") else [f"Median error: {found['median_error_D']:.3g} D", side]
    stated = {"pixel_arcmin": 1.0, "noise_of_mean": NOISE, "texture_correlation_of_bands": CORRELATION}
    return _Result(
        {
            "views.png": figure.savefig,
            "focus.png": focus_drawn.savefig,
            "oscillation.mp4": write_film,
            "depth.npz": result.save,
        },
        {
            "settings": {**settings, **stated, "s_cones_resolve_cycles_per_degree": S_FINEST_CPD},
            "focus_D": [view.optics.focus_vergence for view in named.values()],
            "found": found,
            "details": result.details,
        },
        [*error, f"Valid pixels: {found['valid']:.1%}"],
    )


def _through_focus(seeing: Eye, conditions: ViewingConditions, settings: Mapping[str, Any]) -> _Result:
    """Compute the image quality of an eye in white light against the target's vergence."""
    from focalgradient.eye.quality import PIXEL_ANGLE as POINT_ANGLE
    from focalgradient.plotting.eye import through_focus_figure

    cones = conditions.cones(seeing, "luminance")
    quality = fg.eye.image_quality(cones)
    figure = through_focus_figure(quality, fg.eye.point_images(cones, quality.best), POINT_ANGLE, _stated(settings))
    ranges = quality.ranges_of_focus()
    found = {"focus_D": cones.focus_vergence, **quality.summary(), "depth_of_focus_ranges_D": ranges}
    separate = ", ".join(f"{least:.2f} to {most:.2f} D" for least, most in ranges)
    return _Result(
        {"through_focus.png": figure.savefig, "through_focus.csv": quality.to_csv().encode()},
        {"settings": settings, "found": found},
        [
            f"Best focus in white light: {found['best_D']:.2f} D, visual Strehl ratio {found['visual_strehl']:.2f}",
            f"Depth of focus (80 % of it): {'at least ' * quality.is_cut_off()}{found['depth_of_focus_D']:.2f} D"
            + f", in {len(ranges)} separate ranges: {separate}" * (len(ranges) > 1),
        ],
    )


def _accommodate(motion: TargetMotion, pupil: float, cue: Cue, seed: int) -> _Result:
    """Simulate accommodation to a target."""
    seconds = SECONDS_PER_SECOND * motion.duration
    with resumable("nothing was written.", lambda: announce(seconds, "Accommodating")) as say:
        say(0.0, "accommodating")
        from focalgradient.eye.ranges import warn_if_artificial
        from focalgradient.plotting.eye import accommodation_figure

        warn_if_artificial(1e-3 * pupil)
        eye = fg.eye.Accommodation(cue=cue, pupil_diameter=1e-3 * pupil)
        course = fg.eye.accommodate(
            motion.at, motion.duration, eye, seed=seed, progress=lambda share, words: say(0.9 * share, words)
        )
        say(0.9, "drawing")
        figure = accommodation_figure(course, motion.at, motion.title)
        film = fg.eye.Target(contrast=0.35).film(course.target, course.accommodation, eye.pupil_diameter, texture=seed)
    settings = {
        "target": motion.text,
        "seconds": motion.duration,
        "pupil_mm": pupil,
        "cue": cue,
        "seed": seed,
        "plant": asdict(eye.plant),
        "pulse": asdict(eye.pulse) if eye.pulse else None,
        "noise_of_mean": eye.noise,
        "moments_per_second": eye.rate,
    }
    found = course.summary()
    return _Result(
        {
            "course.csv": course.to_csv().encode(),
            "course.png": figure.savefig,
            "retina.mp4": lambda path: fg.video.write_frames(path, film, eye.rate),
        },
        {"settings": settings, "found": found},
        [
            f"Lag over the last two seconds: {found['lag_D']:.2f} D",
            f"Error of the estimate, root mean square: {found['estimate_rms_error_D']:.2f} D; "
            f"within two stated standard deviations: {found['estimate_within_2_sd']:.0%}",
        ],
    )


def _stated(settings: Mapping[str, Any]) -> Sequence[str]:
    """Return the settings of the eye that the title states."""
    stated = [f"pupil {settings['pupil_mm']:.1f} mm", f"light {settings['illuminant']}"]
    stated.append(f"looking at {settings['accommodation_D']:g} D")
    stated += [f"focused at {state['focus_D']:.2f} D" for state in settings["eyes"] if not state["in_reach"]]
    for name, unit in UNITS.items():
        if (value := settings.get(name)) is not None:
            words = f"{value:g}{unit}" if isinstance(value, float) else re.sub(r"-(?=\d)", "−", str(value))
            stated.append(f"{name} {words}")
    if "eccentricity_deg" in settings:
        stated.append(f"at {settings['eccentricity_deg']:g}° in the {settings['meridian']} field")
    return [*stated, "scatter CIE"] if settings.get("scatter") else stated
