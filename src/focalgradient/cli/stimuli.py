"""``focalgradient stimuli``: pictures and movies of the experiments."""

from __future__ import annotations

import math
from collections.abc import Iterable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from focalgradient.cli.drawn import DRAWN
from focalgradient.cli.necker import necker
from focalgradient.cli.options import (
    COUNT,
    DEPTH_FILE,
    SIDE,
    depth_file_options,
    display_of,
    display_options,
    options_named,
    picture_encoding_option,
    positive,
    shared_options,
    shared_work,
)
from focalgradient.cli.program import KEPT, announce, json_option, resumable, show, warnings_given, writable
from focalgradient.cli.through_optics import NAMED, read_picture_and_depth
from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.plausibility import given_as

if TYPE_CHECKING:
    from collections.abc import Callable

    from focalgradient.cli.options import Command
    from focalgradient.photographs import DepthPicture
    from focalgradient.stimuli import StimulusSet

__all__ = ["stimuli"]

SECONDS = {"path": 126 / (512**2 * 256), "cast": 20 / (512**2 * 256)}
"""Rendering time in s per scene, pixel and ray on two cores: 512 x 512 pixels with 256 rays took 126 s path traced."""

CONTROLS = {
    "mean_luminance_percent": "Difference of mean luminance between conditions of a scene: {:.2g} %",
    "shift_px": "Shift: {:.2g} px",
    "spectrum_percent": "Deviation of octave amplitude from the prediction by blur: {:.2g} %",
    "noise_steps": "Noise: {:.2g} 8-bit steps",
    "sharpest": "Largest sharpness: {:.2g} times that allowed by its blur",
}


def _field(text: str) -> Callable[[Command], Command]:
    """Return a decorator that adds --field, with the given help."""
    return click.option("--field", type=float, metavar="DEG", callback=positive(" of degrees", most=179), help=text)


@click.group(short_help="Make the pictures of the experiments.")
def stimuli() -> None:
    """Make the pictures and movies of the experiments."""


for command in (*DRAWN, necker):
    stimuli.add_command(command)


def _f_numbers(_: click.Context, option: click.Parameter, given: str) -> tuple[float, ...]:
    """Parse f-numbers in a list such as ``16,8,4``, with or without f/."""
    try:
        return tuple(float(part.strip().removeprefix("f/")) for part in given.split(","))
    except ValueError as error:
        raise InputError(f"--apertures is {given!r}, but must be f-numbers such as 16,8,4.") from error


@stimuli.command("depth-rating", short_help="Render pictures of scenes for judging depth.")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the set.")
@click.option(
    "--seed", type=int, metavar="N", help="Random seed: equal seeds give equal files; required without --picture."
)
@click.option("--scenes", type=COUNT, default=13, show_default=True, metavar="K", help="Number of scenes.")
@click.option(
    "--size", type=SIDE, default=512, show_default=True, metavar="PX", help="Width and height of the pictures."
)
@click.option(
    "--engine",
    type=click.Choice(["auto", "path", "shaded", "cast"]),
    default="auto",
    show_default=True,
    help="Renderer: path tracing, shading, ray casting (plain scenes); auto uses path tracing if Mitsuba is available.",
)
@click.option("--samples", type=COUNT, default=256, show_default=True, metavar="N", help="Rays per pixel.")
@click.option("--chromatic", is_flag=True, help="Include an eye's chromatic aberration of red, green and blue.")
@click.option(
    "--apertures",
    default="22,11,5.6",
    show_default=True,
    metavar="N,N,...",
    callback=_f_numbers,
    help="f-numbers of the lens; the pinhole is added.",
)
@click.option(
    "--picture",
    "pictures",
    type=click.Path(path_type=Path),
    multiple=True,
    metavar="FILE",
    help="Sharp photograph, instead of rendered scenes, with its --depth. Repeatable.",
)
@click.option(
    "--depth",
    "depths",
    type=click.Path(path_type=Path),
    multiple=True,
    metavar="FILE",
    help="Depth file of the photograph.",
)
@_field("Width of the photographs, in degrees at the camera.")
@depth_file_options
@picture_encoding_option
@shared_options
@display_options
@json_option
def depth_rating(
    out: Path,
    seed: int | None,
    scenes: int,
    size: int,
    engine: Any,
    samples: int,
    chromatic: bool,
    apertures: tuple[float, ...],
    pictures: tuple[Path, ...],
    depths: tuple[Path, ...],
    field: float | None,
    encoding: Any,
    workers: int | None,
    scheduler: str | None,
    **options: Any,
) -> None:
    """Make the pictures of the depth-rating experiment.

    Each scene is shown through a pinhole and through each of the --apertures, with its nearest and its farthest object
    in focus: as PNG for the display, as linear light (.npy), with its depth. DIR/manifest.json has every parameter,
    what was controlled, and every file's SHA-256; DIR/sheet.png shows all pictures side by side. After an interruption
    the same command continues; a finished set is verified.

    With --picture and --depth the scenes are photographs, named after their files: their nearest and farthest objects
    are found in the depth, and the blur of the lens is added. --field gives the visual angle of their pixels at the
    camera.

    Reads nothing, or the files of --picture and --depth, as for 'focalgradient blur'. A scene of 512 x 512 pixels and
    256 rays takes about 2 min on two cores with path tracing, and a few seconds with ray casting.

    \b
    Examples:
      focalgradient stimuli depth-rating --out pictures --seed 1 --screen-width 53.1 --distance 0.57
      focalgradient stimuli depth-rating --out mine --picture room.png --depth room.npy --field 30
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, ())
    _refuse_inside(out, (*pictures, *depths))
    depth_file = {name: options.pop(name) for name in DEPTH_FILE}
    depth_file |= {"field": field, "encoding": encoding}
    click.get_current_context().with_resource(given_as(NAMED))
    display = display_of(**options)
    from focalgradient.render.mitsuba_backend import variant
    from focalgradient.stimuli import make_depth_rating, make_from_photographs

    if pictures or depths:
        if len(pictures) != len(depths) or field is None:
            raise InputError("photographs need one --depth for each --picture, and --field: add the missing options.")
        if given := _given("seed", "scenes", "size", "engine", "samples", "chromatic"):
            raise InputError(f"{given} applies to rendered scenes: leave it out with --picture.")
        with warnings_given(), resumable(KEPT) as say, shared_work(workers, scheduler) as executor:
            photographs = _photographs(pictures, depths, depth_file)
            made = make_from_photographs(
                out,
                {name: (one.light, one.metres) for name, one in photographs.items()},
                pixel_angle=next(iter(photographs.values())).pixel_angle,
                apertures=apertures,
                display=display,
                executor=executor,
                progress=say,
            )
        _tell(made, out)
        return
    if given := _given("field", "encoding", *DEPTH_FILE):
        raise InputError(f"{given} applies to photographs: give --picture and --depth too, or leave it out.")
    if seed is None:
        raise InputError("--seed is missing: give a whole number, or photographs with --picture and --depth.")
    traced = engine == "path" or (engine == "auto" and variant() is not None)
    seconds = SECONDS["path" if traced else "cast"] * scenes * size**2 * samples
    begun = partial(announce, seconds, f"{scenes} scenes")
    with (
        warnings_given(),
        resumable(KEPT, begun) as say,
        options_named({"size is": "--size is"}),
        shared_work(workers, scheduler) as executor,
    ):
        made = make_depth_rating(
            out,
            seed=seed,
            scenes=scenes,
            size=size,
            display=display,
            engine=engine,
            samples=samples,
            chromatic=chromatic,
            apertures=apertures,
            executor=executor,
            progress=say,
        )
    _tell(made, out)


def _given(*names: str) -> str | None:
    """Return the first of these options that is given on the command line, as written there."""
    context = click.get_current_context()
    for name in names:
        if context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            return f"--{name.replace('_', '-')}"
    return None


def _photographs(
    pictures: tuple[Path, ...], depths: tuple[Path, ...], options: dict[str, Any]
) -> dict[str, DepthPicture]:
    """Return photographs with depth by file name."""
    found: dict[str, DepthPicture] = {}
    for picture, file in zip(pictures, depths, strict=True):
        if picture.stem in found:
            raise InputError(f"two pictures are named {picture.stem!r}, but names of scenes must differ: rename one.")
        found[picture.stem] = read_picture_and_depth(picture, file, options, [])
    return found


@stimuli.command("import", short_help="Import your own pictures as a set.")
@click.argument("folder", type=click.Path(path_type=Path), metavar="FOLDER")
@click.option(
    "--table",
    required=True,
    type=click.Path(path_type=Path),
    metavar="CSV",
    help="Table of the pictures' scenes and conditions: see above.",
)
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the set.")
@click.option(
    "--focal-length",
    default=50.0,
    show_default=True,
    metavar="MM",
    callback=positive(" of millimetres", most=1000),
    help="Focal length of the lens in mm: the diameter of f/N is focal length / N.",
)
@_field("Width of the pictures, in degrees at the camera: spectra and shifts are then measured too.")
@display_options
@json_option
def import_(folder: Path, table: Path, out: Path, focal_length: float, field: float | None, **display: Any) -> None:
    """Import the pictures in FOLDER as a set for depth rating.

    CSV has a row for each picture, with the columns file (in FOLDER), scene, aperture (pinhole, or an f-number such as
    f/5.6) and fixation (nearest, farthest or any name; empty for a pinhole that serves all). It may have x_px and y_px
    (position of the fixated object from the upper left corner), depth (a file in FOLDER with distances in metres) and
    focus_m; other columns are kept in the manifest. Pictures are 8-bit PNG, JPEG or TIFF files of equal size, with even
    width and height, and are shown unchanged.

    Mean luminance is compared with that of the scene's pinhole picture. With --field and the column depth, spectra and
    shifts are compared with those predicted by blurring the pinhole picture; pictures made by 'focalgradient blur' meet
    the limits of rendered sets.

    DIR/manifest.json has all results, and every file's SHA-256. After an interruption the same command continues. Takes
    about a second per picture.

    \b
    Example:
      focalgradient stimuli import photos --table photos/pictures.csv --out stimuli --screen-width 53.1
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, ())
    from focalgradient.stimuli import import_pictures

    with warnings_given(), resumable(KEPT) as say:
        made = import_pictures(
            folder,
            table,
            out,
            display=display_of(**display),
            focal_length=1e-3 * focal_length,
            field=None if field is None else math.radians(field),
            progress=say,
        )
    _tell(made, out)


@stimuli.command("set", short_help="Combine drawn stimuli into a set.")
@click.argument("folders", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="FOLDER...")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the set.")
@json_option
def set_(folders: tuple[Path, ...], out: Path) -> None:
    """Combine drawn stimuli, each the FOLDER written by a command such as 'stimuli dead-leaves', into a set.

    Each stimulus is a scene for depth rating, named after its folder: without blur ("pinhole"), and with blur, labelled
    by the f-number of its pupil at 50 mm; its only fixation, "focus", is the centre of the region in focus. All must
    have the same size, pupil and display. A stimulus that is anywhere sharper than its blur allows is rejected.

    DIR/manifest.json has every stimulus's parameters, what was controlled, and every file's SHA-256. After an
    interruption the same command continues; a finished set is verified. Takes about a second per picture.

    \b
    Example:
      focalgradient stimuli slanted-plane --out plane --screen-width 53.1
      focalgradient stimuli corrugated-plane --out waves --width-deg 12 --height-deg 12 --screen-width 53.1
      focalgradient stimuli set plane waves --out pictures
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, ())
    _refuse_inside(out, [folder / "stimulus.json" for folder in folders])
    from focalgradient.stimuli import make_from_stimuli, read_stimuli

    with options_named({"the same width, distance and": "the same --screen-width, --distance and"}):
        drawn, display = read_stimuli(folders)
    with warnings_given(), resumable(KEPT) as say:
        _tell(make_from_stimuli(out, drawn, display=display, progress=say), out)


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
