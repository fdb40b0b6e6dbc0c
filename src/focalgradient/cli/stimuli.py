"""``focalgradient stimuli``: pictures and movies of the experiments."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import click

import focalgradient as fg
from focalgradient.cli.drawn import DRAWN
from focalgradient.cli.generate import File, Folder, command, options_named
from focalgradient.cli.groups import Screen, Workers
from focalgradient.cli.necker import necker, side
from focalgradient.cli.program import KEPT, announce, given_option, resumable, show, warnings_given, writable
from focalgradient.cli.through_optics import NAMED, Stored, read_picture_and_depth
from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.plausibility import given_as
from focalgradient.quantities import DEGREES, MILLIMETRES

if TYPE_CHECKING:
    from focalgradient.stimuli import StimulusSet

__all__ = ["stimuli"]

COUNT = click.IntRange(max=65_536)
"""Number of scenes or rays; `focalgradient.stimuli` checks its range."""

FIELD = DEGREES.between(1e-6, 179)
"""Width of a picture as a visual angle."""

SECONDS = {"path": 126 / (512**2 * 256), "cast": 20 / (512**2 * 256)}
"""Rendering time in s per scene, pixel and ray on two cores: 512 x 512 pixels with 256 rays took 126 s path traced."""

CONTROLS = {
    "mean_luminance_percent": "Difference of mean luminance between conditions of a scene: {:.2g} %",
    "shift_px": "Shift: {:.2g} px",
    "spectrum_percent": "Deviation of octave amplitude from the prediction by blur: {:.2g} %",
    "noise_steps": "Noise: {:.2g} 8-bit steps",
    "sharpest": "Largest sharpness: {:.2g} times that allowed by its blur",
}


@click.group(short_help="Make the pictures of the experiments.")
def stimuli() -> None:
    """Make the pictures and movies of the experiments."""


def _f_numbers(option: str, given: str) -> tuple[float, ...]:
    """Parse f-numbers in a list such as ``16,8,4``, with or without f/."""
    try:
        return tuple(float(part.strip().removeprefix("f/")) for part in given.split(","))
    except ValueError as error:
        raise InputError(f"{option} is {given!r}, but must be f-numbers such as 16,8,4.") from error


@command("Render pictures of scenes for judging depth.", force=False)
def depth_rating(
    *,
    out: Folder,
    seed: Annotated[int | None, "N"] = None,
    scenes: Annotated[int, COUNT, "K"] = 13,
    size: Annotated[Any, side, "PX"] = 512,
    engine: Literal["auto", "path", "shaded", "cast"] = "auto",
    samples: Annotated[int, COUNT, "N"] = 256,
    chromatic: bool = False,
    apertures: Annotated[Sequence[float], _f_numbers, "N,N,..."] = (22.0, 11.0, 5.6),
    picture: Annotated[tuple[Path, ...], "FILE"] = (),
    depth: Annotated[tuple[Path, ...], "FILE"] = (),
    field: Annotated[float | None, FIELD] = None,
    stored: Stored,
    workers: Workers,
    display: Screen,
) -> None:
    """Make the pictures of the depth-rating experiment.

    Each scene is shown through a pinhole and through each of the --apertures, with its nearest and its farthest object
    in focus: as PNG for the display, as linear light (.npy), with its depth. DIR/manifest.json has every parameter,
    the measured controls, and every file's SHA-256; DIR/sheet.png shows all pictures side by side. After an
    interruption the same command continues; a finished set is verified.

    With --picture and --depth the scenes are photographs, named after their files: their nearest and farthest objects
    are found in the depth, and the blur of the lens is added. --field gives the visual angle of their pixels at the
    camera.

    Reads nothing, or the files of --picture and --depth, as for 'focalgradient blur'. A scene of 512 x 512 pixels and
    256 rays takes about 2 min on two cores with path tracing, and a few seconds with ray casting.

    \b
    Examples:
      focalgradient stimuli depth-rating --out pictures --seed 1 --screen-width 53.1 --distance 0.57
      focalgradient stimuli depth-rating --out mine --picture room.png --depth room.npy --field 30

    Parameters
    ----------
    out
        Folder for the set.
    seed
        Random seed: equal seeds give equal files; required without --picture.
    scenes
        Number of scenes.
    size
        Width and height of the pictures.
    engine
        Renderer: path tracing, shading, ray casting (plain scenes); auto uses path tracing if Mitsuba is available.
    samples
        Rays per pixel.
    chromatic
        Include an eye's chromatic aberration of red, green and blue.
    apertures
        f-numbers of the lens; the pinhole is added.
    picture
        Sharp photograph, instead of rendered scenes, with its --depth. Repeatable.
    depth
        Depth file of the photograph.
    field
        Width of the photographs, in degrees at the camera.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, ())
    _refuse_inside(out, (*picture, *depth))
    from focalgradient.render.mitsuba_backend import variant

    how: dict[str, Any] = {"apertures": apertures, "display": display}
    if picture or depth:
        if len(picture) != len(depth) or field is None:
            raise InputError("photographs need one --depth for each --picture, and --field: add the missing options.")
        if given := given_option("seed", "scenes", "size", "engine", "samples", "chromatic"):
            raise InputError(f"{given} applies to rendered scenes: leave it out with --picture.")
        with given_as(NAMED), warnings_given(), resumable(KEPT) as say, workers.shared() as executor:
            photographs = {}
            for one, other in zip(picture, depth, strict=True):
                if one.stem in photographs:
                    raise InputError(
                        f"two pictures are named {one.stem!r}, but names of scenes must differ: rename one."
                    )
                shown = read_picture_and_depth(one, other, field=field, **stored)
                photographs[one.stem] = (shown.light, shown.metres)
            how |= {"pixel_angle": shown.pixel_angle, "executor": executor, "progress": say}
            _tell(fg.stimuli.make_from_photographs(out, photographs, **how), out)
        return
    if given := given_option("field", "encoding", "depth_unit", "depth_scale", "baseline", "disparity_offset"):
        raise InputError(f"{given} applies to photographs: give --picture and --depth too, or leave it out.")
    if seed is None:
        raise InputError("--seed is missing: give a whole number, or photographs with --picture and --depth.")
    traced = engine == "path" or (engine == "auto" and variant() is not None)
    seconds = SECONDS["path" if traced else "cast"] * scenes * size**2 * samples
    begun = partial(announce, seconds, f"{scenes} scenes")
    how |= {"seed": seed, "scenes": scenes, "size": size, "engine": engine, "samples": samples, "chromatic": chromatic}
    with (
        warnings_given(),
        resumable(KEPT, begun) as say,
        options_named({"size is": "--size is"}),
        workers.shared() as executor,
    ):
        made = fg.stimuli.make_depth_rating(out, **how, executor=executor, progress=say)
    _tell(made, out)


@command("Import your own pictures as a set.", name="import", force=False)
def import_(
    folder: Path,
    /,
    *,
    table: Annotated[File, "CSV"],
    out: Folder,
    focal_length: Annotated[float, MILLIMETRES.between(1e-6, 1000).si] = 0.05,
    field: Annotated[float | None, FIELD.si] = None,
    display: Screen,
) -> None:
    """Import the pictures in FOLDER as a set for depth rating.

    CSV has a row for each picture, with the columns file (in FOLDER), scene, aperture (pinhole, or an f-number such as
    f/5.6) and fixation (nearest, farthest or any name; empty for a pinhole that serves all). It may have x_px and y_px
    (position of the fixated object from the upper left corner), depth (a file in FOLDER with distances in metres) and
    focus_m; other columns are kept in the manifest. Pictures are 8-bit PNG, JPEG or TIFF files of equal size, with even
    width and height, and are shown unchanged.

    Mean luminance is compared with that of the scene's pinhole picture. With --field and the column depth, spectra and
    shifts are compared with those predicted by blurring the pinhole picture. Pictures made by 'focalgradient blur' meet
    the limits of rendered sets if the depth map is exact at occlusion boundaries.

    DIR/manifest.json has all results, and every file's SHA-256. After an interruption the same command continues. Takes
    about a second per picture.

    \b
    Example:
      focalgradient stimuli import photos --table photos/pictures.csv --out stimuli --screen-width 53.1

    Parameters
    ----------
    table
        Table of the pictures' scenes and conditions: see above.
    out
        Folder for the set.
    focal_length
        Focal length of the lens in mm: the diameter of f/N is focal length / N.
    field
        Width of the pictures, in degrees at the camera: spectra and shifts are then measured too.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, ())

    with warnings_given(), resumable(KEPT) as say:
        how: dict[str, Any] = {"display": display, "focal_length": focal_length, "field": field}
        _tell(fg.stimuli.import_pictures(folder, table, out, **how, progress=say), out)


@command("Combine drawn stimuli into a set.", name="set", force=False)
def set_(folders: Annotated[tuple[Path, ...], "FOLDER..."], /, *, out: Folder) -> None:
    """Combine drawn stimuli, each the FOLDER written by a command such as 'stimuli dead-leaves', into a set.

    Each stimulus is a scene for depth rating, named after its folder: without blur ("pinhole"), and with blur, labelled
    by the f-number of its pupil at 50 mm; its only fixation, "focus", is the centre of the region in focus. All must
    have the same size, pupil and display. A stimulus that is anywhere sharper than its blur allows is rejected.

    DIR/manifest.json has every stimulus's parameters, the measured controls, and every file's SHA-256. After an
    interruption the same command continues; a finished set is verified. Takes about a second per picture.

    \b
    Example:
      focalgradient stimuli slanted-plane --out plane --screen-width 53.1
      focalgradient stimuli corrugated-plane --out waves --width-deg 12 --height-deg 12 --screen-width 53.1
      focalgradient stimuli set plane waves --out pictures

    Parameters
    ----------
    out
        Folder for the set.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, ())
    _refuse_inside(out, [folder / "stimulus.json" for folder in folders])

    with options_named({"the same width, distance and": "the same --screen-width, --distance and"}):
        drawn, display = fg.stimuli.read_stimuli(folders)
    with warnings_given(), resumable(KEPT) as say:
        _tell(fg.stimuli.make_from_stimuli(out, drawn, display=display, progress=say), out)


def _refuse_inside(out: Path, inputs: Iterable[Path]) -> None:
    """Raise `InputError` for inputs in the set's folder, because output files might overwrite them."""
    for path in inputs:
        inside = False
        with suppress(OSError, ValueError, RuntimeError):  # reported when it is opened
            inside = out.resolve() in path.resolve().parents
        if inside:
            raise InputError(
                f"{printable(path)} is in --out {printable(out)}, to which the set is written: choose another --out."
            )


def _tell(made: StimulusSet, out: Path) -> None:
    """Print the contents of a finished set, and the values of its controls."""
    found = made.summary()
    show(
        found | {"written": printable(out)},
        f"Scenes: {len(made.scenes)}",
        f"Pictures: {found['pictures']}",
        *(
            f"{CONTROLS[name].format(one['worst'])} at most (limit {one['limit']:g}){'' if one['met'] else ': NOT met'}"
            for name, one in found["controls"].items()
        ),
        f"Written: {printable(out)}",
    )


for made in (*DRAWN, necker, depth_rating, import_, set_):
    stimuli.add_command(made)
