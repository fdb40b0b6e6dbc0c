"""``focalgradient blur``: a sharp picture and its depth, imaged through a lens or an eye."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import click

import focalgradient as fg
from focalgradient.cli.generate import File, Folder, command
from focalgradient.cli.groups import SCREEN, gamma_of, screen_size
from focalgradient.cli.person import is_astigmatic
from focalgradient.cli.program import (
    announce,
    resumable,
    show,
    software_versions,
    summary_json,
    warnings_given,
    writable,
    write_set,
)
from focalgradient.cli.through_optics import DISTANCE, NAMED, LensOrEye, Read, read_picture_and_depth, settings_given
from focalgradient.depth.settings import AUTO
from focalgradient.errors import InputError
from focalgradient.files import printable, read_json
from focalgradient.options.shapes import ShapeAsked
from focalgradient.plausibility import given_as
from focalgradient.progress import part_of
from focalgradient.quantities import CENTIMETRES, METRES, POSITIVE

__all__ = ["blur"]

SETTINGS = "settings.json"
"""Settings of the frames in a folder: existing frames are kept only if they were made with the same settings."""

SECONDS_PER_MEGAPIXEL = 0.55
"""Computing time of one picture through one lens, in s per megapixel on two cores: 1920 x 1080 pixels in colour with a
blur of 15 pixels took 1.1 s (`benchmarks/blurred_pictures.py --speed`)."""


AUTOMATIC = ShapeAsked(AUTO, {})


def _names_of_foci(focus: Sequence[float], states: Mapping[str, Any]) -> list[str]:
    """Return the part of a file's name that states each focus: that asked for (m), or where an eye is focused instead.

    Raises `InputError` for two foci that an eye cannot tell apart.
    """
    names = [f"{metres}m" for metres in focus]
    for number, state in enumerate(states.get("eyes", [])):
        if not state["in_reach"]:
            names[number] = f"{state['focus_D']:.3f}D" if state["focus_m"] is None else f"{state['focus_m']:.3f}m"
    for number, name in enumerate(names):
        if (first := names.index(name)) < number:
            raise InputError(
                f"this eye cannot focus on {focus[first]:g} m and {focus[number]:g} m: both give focus at {name}, and "
                "the same picture; give one --focus."
            )
    return names


def _different(option: str, given: tuple[float, ...]) -> tuple[float, ...]:
    """Raise `InputError` for two distances that would have the same file name."""
    if len(set(given)) < len(given):
        raise InputError(f"{option} is given twice with the same distance: give each distance once.")
    return given


@command("Blur a picture of known depth as a lens or an eye would.")
def blur(
    picture: Path,
    depth: Path,
    /,
    *,
    out: Folder,
    optics: LensOrEye,
    focus: Annotated[tuple[float, ...], DISTANCE, _different],
    read: Read,
    psf: ShapeAsked = AUTOMATIC,
    chromatic: bool = False,
    illuminant: Annotated[str | None, "NAME"] = None,
    wavelengths: Annotated[int | None, click.IntRange(3, 81), "N"] = None,
    to_show: bool = False,
    display_file: Annotated[File | None, "--display"] = None,
    screen: Annotated[str, "WxH"] = "1920x1080",
    screen_width: Annotated[float | None, CENTIMETRES] = None,
    distance: Annotated[float | None, METRES] = None,
    gamma: Annotated[str, "G"] = "sRGB",
    white: Annotated[float, POSITIVE] = 1.0,
) -> None:
    """Image PICTURE through a lens or an eye, with DEPTH giving the distance of each pixel.

    PICTURE is a PNG, JPEG, TIFF, EXR or .npy file, sharp everywhere. DEPTH is a .npy, EXR, PFM or floating-point TIFF
    file, or an integer PNG with --depth-scale: distances in metres unless --depth-unit states another unit; or, of a
    flat picture, its distance in metres, such as 2. The optics are --f-number and --focal-length, or --pupil, or --eye;
    the size of a pixel is --field, or --pixel-pitch with a lens, or that of the display (--display, or --screen-width
    and --distance).

    For each --focus M the command writes DIR/blurred-M.png (--focus 3: blurred-3.0m.png) for the display and
    DIR/blurred-M.npy in linear light (an eye that cannot focus at M: M is its nearest possible focus); also
    DIR/distance.npy, the depth in metres with holes filled, and DIR/summary.json with all settings. Two folders instead
    of two files: every picture with the depth file of the same name, written to DIR/NAME-M.png and .npy. A video and a
    folder: each frame with one file of the folder, in order of name. After an interruption the same command continues.

    Takes about 1.2 s for 2 megapixels per focus on two cores, for an eye four times as long; more if blur exceeds 15
    pixels.

    \b
    EYE.toml:                          DISPLAY.toml:
      pupil_mm = 4.0                     size_px = [1920, 1080]
      chromatic_scale = 1.0              pixel_pitch_um = 276.7
      aberrations = [[2, 0, 0.1]]        distance_m = 0.57
                                         gamma = "sRGB"

    \b
    Examples:
      focalgradient blur demo/picture.png demo/distance.npy --out blurred --f-number 2.8 --focal-length 25 \\
        --focus 0.8 --focus 2.0 --field 6
      focalgradient blur demo/picture.png demo/distance.npy --out pentagon --f-number 2.8 --focal-length 25 \\
        --focus 0.8 --field 6 --psf polygon --blades 5
      focalgradient blur demo/picture.png demo/distance.npy --out seen --pupil 4 --focus 0.8 --field 3 --chromatic
      focalgradient blur demo/picture.png demo/distance.npy --out old --pupil 3 --refraction "-2.00 -0.75 x 180" \\
        --age 60 --focus 2 --field 3 --chromatic --illuminant A

    Parameters
    ----------
    out
        Folder for the results.
    focus
        Distance in focus, in metres, or inf. Repeatable.
    psf
        Shape of the blur; auto: a disc for a lens, the eye's own blur for an eye.
    chromatic
        Blur each waveband at its own focus, as in an eye.
    illuminant
        With --chromatic: surfaces under this illuminant (D65, A, LED-B1 or another by the CIE, or '3000 K') instead of
        a display.
    wavelengths
        With --chromatic: number of wavelength samples, each at its own focus.  [default: by pupil and distances]
    to_show
        With --chromatic: compute what a display at --focus must show to give the eye this retinal image in every
        waveband.
    display_file
        Display (TOML), instead of the following options.
    screen
        Width and height of the display in pixels.
    screen_width
        Width of the display, in centimetres.
    distance
        Distance from the eye to the display, in metres.
    gamma
        Gamma of the display, or sRGB.
    white
        Linear value shown at full display luminance.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    start = time.perf_counter()
    from focalgradient.eye.chromatic import REFERENCE_NM
    from focalgradient.stimuli.sets import npy

    click.get_current_context().with_resource(given_as(NAMED))
    pairs, several = fg.photographs.depth_pairs(picture, depth), depth.is_dir()
    stems = [pair.stem for pair in pairs] if several else ["blurred"]
    with warnings_given() as early:
        display, angle = _display(display_file, screen, screen_width, distance, gamma)
        lenses, shape = [optics.focused(1 / metres) for metres in focus], psf.shape_or_none()
        states = optics.states(lenses, [1 / metres for metres in focus])
        foci = _names_of_foci(focus, states)
        how: dict[str, Any] = {"chromatic": chromatic, "wavelengths": wavelengths, "illuminant": illuminant}
        how |= {"age": optics.person.age, "white": white}
        through = [
            fg.stimuli.Viewing(lens, shape, screen=metres if to_show else None, **how)
            for lens, metres in zip(lenses, focus, strict=True)
        ]
    names = [f"{stem}-{name}{end}" for stem in stems for name in foci for end in (".png", ".npy")]
    names.append(SETTINGS if several else "distance.npy")
    tables = [file for file in (optics.eye_file, display_file) if file is not None]
    inputs = [path for pair in pairs for path in pair[:2]]
    writable(out, [*names, "summary.json"], [picture, depth, *tables, *inputs])
    left = "finished pictures are kept; the same command continues." if several else "nothing was written."
    settings: dict[str, Any] = {"picture": printable(picture), "depth": printable(depth), "focus_m": list(focus)}
    settings |= settings_given("focus", "psf") | states
    settings |= {"psf": psf.name, "psf_parameters": {} if shape is None else shape.stated()}
    if several:
        _same_settings(out, settings)
    sizes: dict[str, Any] = {"focal_length": optics.focal_length, "pixel_angle": angle}
    found: list[dict[str, Any]] = []
    files: dict[str, bytes] = {}
    with warnings_given() as said, resumable(left) as say:
        frames = fg.stimuli.with_frames(pairs, picture if several and not picture.is_dir() else None)
        for number, (stem, (pair, frame)) in enumerate(zip(stems, frames, strict=True)):
            if several and all((out / f"{stem}-{name}.npy").exists() for name in foci):
                continue
            tell = part_of(say, number, len(pairs))
            tell(0.0, "reading")
            shown = read_picture_and_depth(pair.picture, pair.depth, lenses, **read, **sizes, frame=frame)
            ready = {f"{stem}-{name}": one.resolved(shown) for name, one in zip(foci, through, strict=True)}
            if not found:
                pictures = (len(pairs) - number) * sum(one.foci for one in ready.values())
                announce(SECONDS_PER_MEGAPIXEL * 1e-6 * shown.metres.size * pictures, f"{pictures} blurred pictures")
            files, facts = fg.stimuli.viewed_files(shown, ready, display, tell)
            found.append(facts)
            if several and not (out / SETTINGS).exists():
                write_set(out, {SETTINGS: summary_json(settings)}, SETTINGS, None)
            if several:
                write_set(out, files, next(reversed(files)), None)
            else:
                files["distance.npy"] = npy(shown.metres.astype("float32"))
    summary = {
        "settings": settings,
        "pictures": found,
        "warnings": [*early, *said],
        "versions": software_versions("numpy", "numba"),
        "seconds": time.perf_counter() - start,
    }
    last = {"summary.json": summary_json(summary)}
    where = " in the more blurred meridian" if any(map(is_astigmatic, states.get("eyes", []))) else ""
    where += f" at {REFERENCE_NM:g} nm" if chromatic else ""
    write_set(out, last if several else files | last, "summary.json", names)
    show(
        summary | {"written": [printable(out / name) for name in (*names, "summary.json")]},
        *optics.notes(states),
        *(
            f"Blur: radius up to {round(most, 6):.3g} px ({round(most * arcmin, 6):.3g} arcmin){where}, "
            f"{arcmin:.3g} arcmin per pixel"
            for most, arcmin in ((max(facts["largest_blur_px"]), facts["pixel_arcmin"]) for facts in found[:1])
        ),
        f"Written: {len(names) + 1} files in {printable(out)}",
    )


def _same_settings(out: Path, settings: dict[str, Any]) -> None:
    """Raise `InputError` if existing frames were made with other settings."""
    path = out / SETTINGS
    if not path.exists():
        return
    found, now = read_json(path, "the settings of earlier frames"), json.loads(summary_json(settings))
    if not isinstance(found, dict) or {**found, "written_by": None} != {**now, "written_by": None}:
        raise InputError(
            f"{printable(out)} contains frames made with other settings ({SETTINGS}): give another --out, or empty it."
        )


def _display(
    file: Path | None, screen: str, width_cm: float | None, distance: float | None, gamma: str
) -> tuple[fg.display.Display, float | None]:
    """Return the display that the pictures are for, and the angle (rad) of its pixels if it is known."""
    if file is not None:
        display = fg.display.Display.read(file)
    elif width_cm is None and distance is None:
        return fg.display.Display(gamma=gamma_of("--gamma", gamma)), None
    else:
        curve = gamma_of("--gamma", gamma)
        if width_cm is None or distance is None:
            raise InputError("--screen-width and --distance belong together: give both.")
        with given_as(SCREEN):
            display = fg.display.Display.of_width(
                1e-2 * width_cm, screen_size("--screen", screen), distance=distance, gamma=curve
            )
    return display, display.pixel_pitch / display.distance
