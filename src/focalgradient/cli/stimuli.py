"""``focalgradient stimuli``: the pictures and moving pictures of the experiments."""

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
from focalgradient.cli.options import (
    DEPTH_FILE,
    depth_file_options,
    display_of,
    display_options,
    picture_encoding_option,
    positive,
    read_depth_file,
    shared_options,
    shared_work,
)
from focalgradient.cli.program import announce, json_option, resumable, show, warnings_given, writable
from focalgradient.errors import InputError
from focalgradient.files import printable

if TYPE_CHECKING:
    from collections.abc import Callable

    from focalgradient.cli.options import Command
    from focalgradient.display import Display
    from focalgradient.stimuli import Stimulus, StimulusSet

__all__ = ["stimuli"]

COUNT = click.IntRange(max=65_536)
"""A whole number of scenes, pixels or rays; `make_depth_rating` and `make_necker` know how many there may be."""

SECONDS = {"path": 126 / (512**2 * 256), "cast": 20 / (512**2 * 256)}
"""Seconds a scene, pixel and ray on two cores: 512 x 512 pixels with 256 rays took 126 s path traced."""

LEFT = "finished files are valid, and the same command goes on from them."

CONTROLS = {
    "mean_luminance_percent": "Mean luminance, between conditions of a scene: {:.2g} %",
    "shift_px": "Shift: {:.2g} px",
    "spectrum_percent": "Amplitude in an octave, from what blur predicts: {:.2g} %",
    "noise_steps": "Noise: {:.2g} steps of 8 bits",
    "sharpest": "Sharpest place: {:.2g} times what its blur allows",
}


def _field(text: str) -> Callable[[Command], Command]:
    """The option --field, with this help."""
    return click.option("--field", type=float, metavar="DEG", callback=positive(" of degrees", most=179), help=text)


@click.group(short_help="Make the pictures of the experiments.")
def stimuli() -> None:
    """Make the pictures and moving pictures of the experiments."""


for drawn in DRAWN:
    stimuli.add_command(drawn)


def _f_numbers(_: click.Context, option: click.Parameter, given: str) -> tuple[float, ...]:
    """Make f-numbers of a list like ``16,8,4``, with or without f/."""
    try:
        return tuple(float(part.strip().removeprefix("f/")) for part in given.split(","))
    except ValueError as error:
        raise InputError(f"--apertures is {given!r}, but must be f-numbers like 16,8,4.") from error


@stimuli.command("depth-rating", short_help="Pictures of scenes for judging depth.")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the set.")
@click.option("--seed", type=int, metavar="N", help="The same seed gives the same files; needed without --picture.")
@click.option("--scenes", type=COUNT, default=13, show_default=True, metavar="K", help="Number of scenes.")
@click.option(
    "--size", type=COUNT, default=512, show_default=True, metavar="PX", help="Width and height of the pictures."
)
@click.option(
    "--engine",
    type=click.Choice(["auto", "path", "shaded", "cast"]),
    default="auto",
    show_default=True,
    help="What renders them: path traced, shaded, ray cast (plain scenes); auto path traces where Mitsuba runs.",
)
@click.option("--samples", type=COUNT, default=256, show_default=True, metavar="N", help="Rays a pixel.")
@click.option("--chromatic", is_flag=True, help="Focus red, green and blue as an eye does.")
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
    help="A sharp photograph, in place of our scenes; as many as wanted, each with its --depth.",
)
@click.option(
    "--depth",
    "depths",
    type=click.Path(path_type=Path),
    multiple=True,
    metavar="FILE",
    help="Distance of every pixel of the photograph.",
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

    Each scene through a pinhole and through each of the --apertures, with its nearest and its farthest object in focus:
    as PNG for the display, as linear light (.npy), with its depth. DIR/manifest.json has every parameter, what was
    controlled, and every file's SHA-256; DIR/sheet.png shows all pictures side by side. Interrupted, the same command
    goes on where it was; a finished set is verified.

    With --picture and --depth the scenes are photographs, named as their files are: their nearest and farthest things
    are found in the depth, and the blur of the lens is put in. --field gives the size of their pixels at the camera.

    Reads nothing, or the files of --picture and --depth, which are those of 'focalgradient blur'. A scene of 512 x 512
    pixels and 256 rays takes about 2 min on two cores, path traced, and some seconds ray cast.

    \b
    Examples:
      focalgradient stimuli depth-rating --out pictures --seed 1 --screen-width 53.1 --distance 0.57
      focalgradient stimuli depth-rating --out mine --picture room.png --depth room.npy --field 30
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, ())
    _refuse_inside(out, (*pictures, *depths))
    depth_file = {name: options.pop(name) for name in DEPTH_FILE}
    display = display_of(**options)
    from focalgradient.render.mitsuba_backend import variant
    from focalgradient.stimuli import make_depth_rating, make_from_photographs

    if pictures or depths:
        if len(pictures) != len(depths) or field is None:
            raise InputError("photographs need as many --depth as --picture, and --field: give what is missing.")
        if given := _given("seed", "scenes", "size", "engine", "samples", "chromatic"):
            raise InputError(f"{given} is for scenes of ours: leave it out with --picture.")
        with warnings_given(), resumable(LEFT) as say, shared_work(workers, scheduler) as executor:
            photographs, angle = _photographs(pictures, depths, field, encoding, depth_file)
            made = make_from_photographs(
                out,
                photographs,
                pixel_angle=angle,
                apertures=apertures,
                display=display,
                executor=executor,
                progress=say,
            )
        _tell(made, out)
        return
    if given := _given("field", "encoding", *DEPTH_FILE):
        raise InputError(f"{given} is for photographs: give --picture and --depth too, or leave it out.")
    if seed is None:
        raise InputError("--seed is missing: give a whole number, or photographs by --picture and --depth.")
    traced = engine == "path" or (engine == "auto" and variant() is not None)
    seconds = SECONDS["path" if traced else "cast"] * scenes * size**2 * samples
    begun = partial(announce, seconds, f"{scenes} scenes")
    with warnings_given(), resumable(LEFT, begun) as say, shared_work(workers, scheduler) as executor:
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
    """The first of these options that the command line gives, as it is written there."""
    context = click.get_current_context()
    for name in names:
        if context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            return f"--{name.replace('_', '-')}"
    return None


def _photographs(
    pictures: tuple[Path, ...], depths: tuple[Path, ...], field: float, encoding: Any, depth_file: dict[str, Any]
) -> tuple[dict[str, Any], float]:
    """Light and distances of photographs, by the names of their files, and the radians of a pixel."""
    from focalgradient.photographs.pictures import read_picture

    found: dict[str, Any] = {}
    angle = 0.0
    for picture, file in zip(pictures, depths, strict=True):
        if picture.stem in found:
            raise InputError(f"two pictures are named {picture.stem!r}, which names the scene: rename one.")
        light = read_picture(picture, encoding).light
        angle = 2 * math.tan(math.radians(field) / 2) / light.shape[1]
        found[picture.stem] = (light, read_depth_file(file, depth_file, angle).metres)
    return found, angle


@stimuli.command("import", short_help="A set made of pictures of your own.")
@click.argument("folder", type=click.Path(path_type=Path), metavar="FOLDER")
@click.option(
    "--table", required=True, type=click.Path(path_type=Path), metavar="CSV", help="What each picture shows: see above."
)
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the set.")
@click.option(
    "--focal-length",
    default=50.0,
    show_default=True,
    metavar="MM",
    callback=positive(" of millimetres", most=1000),
    help="Of the lens: f/N is a diameter of it / N.",
)
@_field("Width of the pictures, in degrees at the camera: then spectra and shifts are measured, too.")
@display_options
@json_option
def import_(folder: Path, table: Path, out: Path, focal_length: float, field: float | None, **display: Any) -> None:
    """Make a set for depth rating of the pictures in FOLDER.

    CSV has a row for each picture, with the columns file (in FOLDER), scene, aperture (pinhole, or an f-number like
    f/5.6) and fixation (nearest, farthest or any name; empty for a pinhole that serves all). It may have x_px and y_px
    (where the fixated object is, from the upper left corner), depth (a file in FOLDER with distances in metres) and
    focus_m; other columns are kept in the manifest. Pictures are 8-bit PNG, JPEG or TIFF files of one size, with even
    width and height, and are shown with the values they have.

    Mean luminance is compared with the scene's pinhole picture. With --field, and the column depth, so are spectra and
    shifts, against what the blur of the lens makes of the pinhole picture: pictures that 'focalgradient blur' made keep
    the limits of our own.

    DIR/manifest.json has all of it, and every file's SHA-256. Interrupted, the same command goes on where it was.
    Takes about a second a picture.

    \b
    Example:
      focalgradient stimuli import photos --table photos/pictures.csv --out stimuli --screen-width 53.1
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, ())
    from focalgradient.stimuli import import_pictures

    with warnings_given(), resumable(LEFT) as say:
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


@stimuli.command("set", short_help="A set made of drawn stimuli.")
@click.argument("folders", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="FOLDER...")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the set.")
@json_option
def set_(folders: tuple[Path, ...], out: Path) -> None:
    """Make a set for depth rating of drawn stimuli, each a FOLDER that such a command as 'stimuli dead-leaves' wrote.

    Each is a scene, named as its folder is: without blur ("pinhole"), and with it, as through the f-number of its pupil
    at 50 mm; its one fixation, "focus", is the middle of what is in focus. All must have one size, one pupil and one
    display. A stimulus that is sharper somewhere than its blur allows is refused.

    DIR/manifest.json has every stimulus's parameters, what was controlled, and every file's SHA-256. Interrupted, the
    same command goes on where it was; a finished set is verified. Takes about a second a picture.

    \b
    Example:
      focalgradient stimuli slanted-plane --out plane --screen-width 53.1
      focalgradient stimuli corrugated-plane --out waves --width-deg 12 --height-deg 12 --screen-width 53.1
      focalgradient stimuli set plane waves --out pictures
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, ())
    _refuse_inside(out, [folder / "stimulus.json" for folder in folders])
    from focalgradient.stimuli import make_from_stimuli, read_stimulus

    drawn: dict[str, Stimulus] = {}
    displays: dict[str, Display] = {}
    for folder in folders:
        name = folder.resolve().name
        if name in drawn:
            raise InputError(f"two folders are named {name!r}, which names the scene: rename one.")
        drawn[name], displays[name] = read_stimulus(folder)
        first = next(iter(displays))
        if displays[name] != displays[first]:
            raise InputError(
                f"{name} is drawn for another display than {first}: draw all with the same --screen-width, --distance "
                "and other options of the display."
            )
    with warnings_given(), resumable(LEFT) as say:
        _tell(make_from_stimuli(out, drawn, display=displays[first], progress=say), out)


def _refuse_inside(out: Path, inputs: Iterable[Path]) -> None:
    """Refuse inputs in the folder of the set: a file that is made might take their place."""
    for path in inputs:
        inside = False
        with suppress(OSError, ValueError, RuntimeError):  # said when it is opened
            inside = out.resolve() in path.resolve().parents
        if inside:
            raise InputError(
                f"{printable(path)} lies in --out {printable(out)}, where the set is made: choose another --out."
            )


def _tell(made: StimulusSet, out: Path) -> None:
    """Print what a finished set has, what was controlled in it, and what a design says to show it."""
    controls = {name: made.manifest["controls"][name] for name in CONTROLS if name in made.manifest["controls"]}
    pictures = len({one.png for one in made.pictures})
    show(
        {
            "scenes": list(made.scenes),
            "pictures": pictures,
            "controls": {name: {key: one[key] for key in ("worst", "limit", "met")} for name, one in controls.items()},
            "written": printable(out),
        },
        f"Scenes: {len(made.scenes)}",
        f"Pictures: {pictures}",
        *(
            f"{CONTROLS[name].format(one['worst'])} at most (limit {one['limit']:g}){'' if one['met'] else ': NOT met'}"
            for name, one in controls.items()
        ),
        f"Written: {printable(out)}",
    )


class _Gradients(click.Choice[str]):
    """The names of the gradients, and the old one of the nonrigid."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return super().convert("nonrigid" if value == "reversed" else value, param, ctx)


@stimuli.command("necker", short_help="The rotating Necker cube, with and without a focal gradient.")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the frames.")
@click.option(
    "--gradient",
    "gradients",
    type=_Gradients(["none", "rigid", "nonrigid"]),
    multiple=True,
    help="Whose depth the blur has: none; the cube's; the depth-reversed shape's, which favours the nonrigid reading. "
    "Once for each.  [default: all three]",
)
@click.option(
    "--size", type=COUNT, default=640, show_default=True, metavar="PX", help="Width and height of the frames."
)
@click.option(
    "--edge", default=8.0, show_default=True, metavar="DEG", callback=positive(" of degrees"), help="Size of an edge."
)
@click.option(
    "--perspective",
    default=0.4,
    show_default=True,
    metavar="P",
    callback=positive(),
    help="Strength of perspective: edge of the cube / distance of its centre.",
)
@click.option(
    "--direction",
    type=click.Choice(["right", "left"]),
    default="right",
    show_default=True,
    help="Where the near side moves.",
)
@click.option(
    "--speed",
    default=0.125,
    show_default=True,
    metavar="T",
    callback=positive(least=1e-3, most=100),
    help="Turns a second.",
)
@click.option(
    "--frame-rate",
    default=60.0,
    show_default=True,
    metavar="HZ",
    callback=positive(least=1, most=1000),
    help="Frames a second.",
)
@click.option(
    "--line-width",
    default=3.0,
    show_default=True,
    metavar="ARCMIN",
    callback=positive(" of arcmin"),
    help="Full width at half maximum of a sharp line.",
)
@click.option(
    "--aperture",
    default=12.0,
    show_default=True,
    metavar="MM",
    callback=positive(" of millimetres"),
    help="Strength of the gradient: the aperture of a lens half a metre from the cube.",
)
@click.option(
    "--focus", type=click.Choice(["near", "far"]), default="near", show_default=True, help="Which end is sharp."
)
@shared_options
@display_options
@json_option
def necker(
    out: Path,
    gradients: tuple[Any, ...],
    size: int,
    edge: float,
    perspective: float,
    direction: Any,
    speed: float,
    frame_rate: float,
    line_width: float,
    aperture: float,
    focus: Any,
    workers: int | None,
    scheduler: str | None,
    **display: Any,
) -> None:
    """Make the frames of the rotating Necker cube, and a video of each condition.

    DIR/none, DIR/rigid and DIR/nonrigid hold the frames of a quarter turn as PNG, for the display: shown again and
    again they make a turning without a seam. The lines lie in the same places under all conditions and give off the
    same light. DIR/none.mp4 and its like show a whole turn, to look at: they are compressed, which the frames are not.
    DIR/manifest.json has every parameter, every file's SHA-256, and how far each reading is from a rigid shape.
    Reads nothing. Takes about 20 s on two cores.

    \b
    Example:
      focalgradient stimuli necker --out cube --gradient none --gradient nonrigid --screen-width 53.1
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    writable(out, ())

    from focalgradient.scenes import NeckerCube
    from focalgradient.stimuli import GRADIENTS, make_necker

    cube = NeckerCube(
        size=math.radians(edge),
        perspective=perspective,
        direction=direction,
        speed=speed,
        line_width=math.radians(line_width / 60),
    )
    with warnings_given(), resumable(LEFT) as say, shared_work(workers, scheduler) as executor:
        made = make_necker(
            out,
            cube,
            gradients=gradients or GRADIENTS,
            size=size,
            frame_rate=frame_rate,
            aperture=aperture * 1e-3,
            focus=focus,
            display=display_of(**display),
            executor=executor,
            progress=say,
        )
    departure = made["departure"]
    show(
        {
            "frames_of_a_quarter_turn": made["parameters"]["frames"],
            "conditions": list(made["conditions"]),
            "departure": departure,
            "written": printable(out),
        },
        f"Frames: {made['parameters']['frames']} in a quarter turn, {len(made['conditions'])} conditions",
        f"Departure from rigid: {departure['rigid']['whole']:.1%} turning {departure['rigid']['direction']}, "
        f"{departure['nonrigid']['whole']:.1%} turning {departure['nonrigid']['direction']}",
        f"Written: {printable(out)}",
    )
