"""``focalgradient depth``: depth from views that differ in aperture, in focus, or in both."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from focalgradient.cli.depth_summary import printed, summary_of
from focalgradient.cli.frames import NAMES, Frame, Recovered, by_worker, folders, recover_frames
from focalgradient.cli.options import GIVEN, limit_options, optics_options, options_named, shared_options, shared_work
from focalgradient.cli.program import (
    announce,
    force_option,
    json_option,
    nothing_valid,
    progress,
    show,
    summary_json,
    warnings_given,
    writable,
)
from focalgradient.cli.shapes import ShapeAsked, ShapedCommand, shape_options
from focalgradient.depth.known_points import KnownPoint, checked_points, with_known_points
from focalgradient.depth.recover import METHODS, MethodName
from focalgradient.depth.settings import AUTO, BlurSource
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.files import printable, refuse_overwriting
from focalgradient.memory import require
from focalgradient.plausibility import given_as
from focalgradient.psf import Gaussian

if TYPE_CHECKING:
    from focalgradient.depth.depth_map import DepthMap
    from focalgradient.photographs import Photograph, Settings
    from focalgradient.view import View

__all__ = ["depth"]

STAGES = 6
"""Stages that the progress bar counts: reading, the four of `recover_depth`, drawing."""


FROM_EXIF = {
    "focal_length_mm": "--focal-length MM",
    "f_numbers": "--f-number N",
    "focus_distances_m": "--focus-distance M",
    "pixel_pitch_um": "--pixel-pitch UM",
    "sensor_to_front_mm": "--sensor-to-front MM",
    "distances_from": "--distances-from",
    "focus_from": "--focus-from",
}
"""Parameters of `focalgradient.photographs.from_exif` and the options that give them."""

SECONDS = {"equalise": 5.0, "spectra": 9.0, "ratio": 0.5, "edges": 10.0, "autofocus": 0.7}
"""Seconds a megapixel of two views: processor time measured at 1280 x 960 pixels, of two apertures and of two foci."""

NEEDED = 200
"""Bytes a pixel that depth takes beside the images: 190 measured, by the default method of two views."""


OF_POINTS = {"focus_tolerance, aperture_tolerance": "--focus-tolerance, --f-number-tolerance"}
"""Parameters that refusals of measured points name, and the options that give them."""


def _known_points(_: click.Context, option: click.Parameter, given: Sequence[str]) -> list[KnownPoint]:
    """Points of X,Y=M, as an option's callback."""
    found = []
    for text in given:
        place, distance = text.partition("=")[::2]
        try:
            x, y = (float(part) for part in place.split(","))
            found.append((x, y, float(distance)))
        except ValueError as error:
            raise InputError(
                f"--at is {printable(text)}, but must be a column, a row and a distance in metres, as 320,200=2.31."
            ) from error
    return checked_points(found)


@click.command(cls=ShapedCommand, short_help="Recover depth from views that differ in aperture or focus.")
@click.argument(
    "inputs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="VIEWS.toml ... | A.jpg B.jpg ..."
)
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the results.")
@click.option(
    "--method",
    type=click.Choice(list(METHODS)),
    default="equalise",
    show_default=True,
    help="How blur is measured: see above.",
)
@click.option(
    "--at",
    multiple=True,
    metavar="X,Y=M",
    callback=_known_points,
    help="A point whose distance was measured: its column and row in pixels of the first view, and metres. Corrects "
    "the focus, from two points on the scale of the apertures too, within their tolerance. May be given again.",
)
@limit_options
@shape_options(
    "Shape of the blur: auto is a disc, or as the --calibration measured it. For a gaussian or a blend, blur_k in "
    "[camera] is its k."
)
@click.option(
    "--align",
    is_flag=True,
    help="Remove shift and scale between the views before comparing them; crop views of unequal size to what all show.",
)
@click.option(
    "--dense",
    is_flag=True,
    help="Complete vergence where it is not valid, with a standard deviation that says how far it is guessed.",
)
@click.option(
    "--calibration",
    type=click.Path(path_type=Path),
    metavar="CAMERA.toml",
    help="The camera as `focalgradient calibrate` measured it; f-number and focus distance are then marks on the lens.",
)
@optics_options
@shared_options
@force_option
@json_option
def depth(
    inputs: tuple[Path, ...],
    out: Path,
    method: MethodName,
    near: float | None,
    far: float | None,
    at: list[KnownPoint],
    psf: ShapeAsked,
    align: bool,
    dense: bool,
    calibration: Path | None,
    workers: int | None,
    scheduler: str | None,
    **optics: Any,
) -> None:
    """Recover depth from two or more views that differ in aperture, in focus, or both.

    The views are named, with their optics, in a settings file; or they are photographs, whose focal length, f-number,
    distance of focus and pixel pitch are read from EXIF where the options marked * do not give them.

    Writes DIR/depth.npz, DIR/depth.png and DIR/summary.json. The arrays, one value a pixel of the first view: distance
    (m), vergence (dioptres), valid, and two standard deviations in dioptres: vergence_sd of what differs between
    pixels, and common_sd of what the whole frame shares, as the focus. Pixels that are not valid have no estimate that
    can be used; with --dense they have a completed one, and `evidence` is 2 where depth is measured, 1 near there and
    0 where it is guessed. With --method autofocus `beyond` is -1 at or beyond the farthest focus, 1 at or nearer than
    the nearest.

    \b
    Methods, and when each is right:
      equalise   two or more views of anything with texture. The default.
      edges      one view or more: printed squares, cards and other hard edges on blank surfaces, where the default
                 finds no texture. Depth along the edges only.
      spectra    two or more views: the paper's regression on the spectra of patches, to compare with.
      ratio      two apertures at one focus: fast, with errors of some per cent. For video see 'stream'.
      autofocus  three or more foci: the sharpest of a stack. With ten or more images the most exact of all.

    Of several settings files, one for each frame, each gets such a folder of its own in DIR, named as the file, or as
    its folder where several files have one name. The workers of a --scheduler must see the same files under the same
    paths.

    Two views that differ only in aperture leave open on which side of the focus a point lies: limit the search with
    --near or --far to one side, or change the focus too.

    Takes about 3 s a megapixel (edges: 8 s) on two cores, after some seconds to start.

    \b
    Examples:
      focalgradient depth demo/views.toml --out results
      focalgradient depth VIEWS.toml --out results --near 0.9 --far 2.2
      focalgradient depth f16.jpg f4.jpg --out results --focus-distance 0.85
      focalgradient depth VIEWS.toml --out results --at 320,200=2.31 --at 90,400=1.45
      focalgradient depth frame01.toml frame02.toml frame03.toml --out results --workers 4

    \b
    VIEWS.toml:
      [camera]
      focal_length_mm = 25.0
      pixel_pitch_um = 8.0
      encoding = "linear"        # or "srgb"; may be left out where the files say it
      telecentric = false
      focus_tolerance = 0.1      # standard deviation of the focus distances as a share; may be left out
      f_number_tolerance = 0.05  # the same of a factor of all f-numbers
      calibration = "CAMERA.toml"  # may be left out; gives all that is above, and the focus if there is but one
      [[view]]                   # one such table for each view, two or more
      image = "view0.png"        # relative to this file: PNG, TIFF, JPEG or .npy
      f_number = 16
      focus_distance_m = 0.85
      flat = "flat0.png"         # may be left out: a blank, evenly lit surface, to divide out vignetting
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    if near is not None and far is not None and near >= far:
        raise InputError(f"--near {near:g} lies beyond or at --far {far:g}: give --near the smaller distance.")
    options: dict[str, Any] = {"method": method, "near_m": near, "far_m": far, "psf": psf, "align": align, "at": at}
    options["dense"] = dense
    read = [*inputs, *([] if calibration is None else [calibration]), *_files_of(inputs, calibration)]
    if len(inputs) > 1 and all(path.suffix.lower() == ".toml" for path in inputs):
        frames = {
            name: Frame((path,), optics, calibration, options, out / name).absolute()
            for name, path in zip(folders(inputs), inputs, strict=True)
        }
        for frame in frames.values():
            writable(frame.out, NAMES, read)
        recover_frames(_recovered, frames, out, shared_work(workers, scheduler, SECONDS[method] * len(frames)))
        return
    writable(out, NAMES, read)
    with progress(STAGES) as say, warnings_given() as given, shared_work(workers, scheduler) as executor:
        frame = Frame(inputs, optics, calibration, options, out)
        if executor is None:
            found = _recovered(frame, given, say)
        else:
            found = executor.submit(by_worker, _recovered, frame.absolute()).result()
            found.give_warnings()
    found.write(out)
    written = [out / name for name in NAMES]
    show(
        {**found.summary, "written": [printable(path) for path in written]},
        found.middle,
        f"Valid pixels: {found.valid:.1%}",
        f"Written: {', '.join(str(path) for path in written)}",
    )
    nothing_valid(found.rejected)


def _files_of(inputs: Sequence[Path], calibration: Path | None) -> Iterator[Path]:
    """What settings files name; where one is wrong, that is said when its frame has its turn."""
    from focalgradient.photographs import load_camera, load_settings

    calibrated = None
    if calibration is not None:
        with suppress(InputError):
            calibrated = load_camera(calibration)
    for path in (one for one in inputs if one.suffix.lower() == ".toml"):
        with suppress(InputError):
            yield from load_settings(path, calibrated).files


def _recovered(frame: Frame, given: list[str], say: Callable[[str], object]) -> Recovered:
    """Recover the depth of one frame; `given` are the warnings that were given by then."""
    from focalgradient.photographs.settings import GIVEN as KEYS

    with given_as({**GIVEN, **(KEYS if frame.inputs[0].suffix.lower() == ".toml" else {})}):
        return _made(frame, given, say)


def _made(frame: Frame, given: list[str], say: Callable[[str], object]) -> Recovered:
    start = time.perf_counter()
    method, options = frame.options["method"], frame.options
    say("reading the views")
    settings, photographs = _read(frame.inputs, frame.optics, frame.calibration, method, options["align"])
    refuse_overwriting(settings.files, [frame.out / name for name in NAMES])
    pixels = photographs[0].luminance.size
    announce(SECONDS[method] * 1e-6 * pixels * len(photographs) / 2, f"depth of {pixels / 1e6:.3g} megapixels")
    require(NEEDED * pixels, f"depth of {pixels / 1e6:.3g} million pixels", "crop or reduce the images")

    from focalgradient.photographs import make_views
    from focalgradient.plotting import depth_figure

    views = make_views(settings, photographs)
    with options_named(FROM_EXIF if frame.inputs[0].suffix.lower() != ".toml" else {}):
        offset = settings.offset
    psf, limits = _shape(options["psf"], method, settings), _limits(settings, options, offset)
    result = _estimated(views, settings, options, psf, limits, say)
    result = _compared_with_the_other_encoding(result, views, photographs, options, limits)
    result = _referred(result, views, settings, offset)
    if options["at"]:
        with options_named(OF_POINTS):
            result = with_known_points(result, options["at"])
    say("drawing")
    figure = depth_figure(views, result, names=[printable(photograph.path.name) for photograph in photographs])
    options = {**options, **{name: result.details.get(name) for name in ("psf", "psf_parameters")}}
    summary = summary_of(settings, views, photographs, options, result, given)
    summary |= {"seconds": time.perf_counter() - start}
    files: dict[str, bytes | Callable[[Path], object]] = {
        "depth.npz": result.save,
        "depth.png": figure.savefig,
        "summary.json": summary_json(summary),
    }
    return Recovered(files, summary, [], middle=printed(settings, result, summary, len(photographs)))


def _estimated(
    views: Sequence[View],
    settings: Settings,
    options: Mapping[str, Any],
    psf: BlurSource,
    limits: tuple[float | None, float | None],
    say: Callable[[str], object],
) -> DepthMap:
    """Depth as counted from the entrance pupil, as the optics count."""
    from focalgradient import recover_depth

    near, far = limits
    return recover_depth(
        views,
        method=options["method"],
        near=near,
        far=far,
        psf=psf,
        align=options["align"] or settings.relative,  # what focus does to magnification is not known then
        dense=options["dense"],
        progress=lambda share, words: say(words),
    )


def _limits(settings: Settings, options: Mapping[str, Any], offset: float) -> tuple[float | None, float | None]:
    """Nearest and farthest distance (m) from the entrance pupil; the user's count from a plane `offset` before it."""
    near, far = (None if options[end] is None else options[end] + offset for end in ("near_m", "far_m"))
    return _beside_focus(near, far, settings)


def _compared_with_the_other_encoding(
    result: DepthMap,
    views: Sequence[View],
    photographs: Sequence[Photograph],
    options: Mapping[str, Any],
    limits: tuple[float | None, float | None],
) -> DepthMap:
    """`result` with how depth would differ were the files of the other encoding, where nobody says which they are."""
    from focalgradient.photographs.other_encoding import encoding_difference

    kinds = {photograph.encoding for photograph in photographs}
    if len(kinds) > 1 or not all(photo.assumed for photo in photographs) or options["method"] != "equalise":
        return result
    found = encoding_difference(views, result, photographs[0].encoding, *limits, options["align"])
    return result if found is None else replace(result, details=result.details | {"encoding_difference_D": found})


def _referred(result: DepthMap, views: Sequence[View], settings: Settings, offset: float) -> DepthMap:
    """`result` with distances from the plane that the user counts from, calibrated where a camera is given."""
    from focalgradient.calibration import apply_calibration

    if settings.relative:
        return _place_in_stack(result, len(views))
    if settings.calibration is None:
        return replace(result, offset=offset, plane=settings.plane)
    marks = [(shot.f_number, shot.focus_distance_m) for shot in settings.shots]
    return apply_calibration(result, views, settings.calibration, marks, offset, settings.plane)


def _place_in_stack(result: DepthMap, count: int) -> DepthMap:
    """A map of which only the order is known: `vergence` is 1 at the first photograph's focus, 2 at the last's."""
    warnings.warn(
        "no focus distance is known (give --focus-distance once for each photograph), so that only the order of depth "
        f"results: vergence 1 stands for the focus of the first photograph, 2 for that of the last of {count}, taken "
        "to be evenly spaced; distance is left out.",
        FocalGradientWarning,
        stacklevel=1,
    )
    return replace(result, details=result.details | {"order_only": count}, plane="no plane: order only")


def _shape(asked: ShapeAsked, method: MethodName, settings: Settings) -> BlurSource:
    """The shape of blur: as asked for, else as the camera was calibrated; methods that cannot use it refuse it."""
    camera = settings.calibration
    source = asked.source(settings.given_k(asked.name))
    if source is not AUTO or camera is None:
        return source
    if camera.psf is None:
        return Gaussian(camera.k) if method == "edges" else AUTO  # as the edges of the target were measured
    if method == "edges":
        warnings.warn(
            "the camera was calibrated by equalising, which does not measure the blur along edges: depth by edges may "
            "err by more than is stated; calibrate it by edges, too (focalgradient calibrate --method edges).",
            FocalGradientWarning,
            stacklevel=1,
        )
    return camera.psf


def _beside_focus(near: float | None, far: float | None, settings: Settings) -> tuple[float | None, float | None]:
    """Limits (m, from the pupil) beside one calibrated focus: a limit at the focus, as marked, means that side of it.

    The calibrated focus is not quite where its mark says, so that a limit at the mark would leave both sides open.
    """
    camera = settings.calibration
    foci = {lens.focus_distance for lens in settings.lenses()}
    if camera is None or len(foci) > 1:
        return near, far
    focus = foci.pop()
    error = max(2 * float(camera.sd[-1]), 0.02 / focus)  # D
    if near is not None and far is not None and near < focus < far:
        inside = [abs(1 / limit - 1 / focus) for limit in (near, far)]
        if min(inside) > error or min(inside) > 0.25 * max(inside):
            return near, far
        return (focus, far) if inside[0] < inside[1] else (near, focus)
    if far is not None and near is None and far > focus and 1 / focus - 1 / far < error:
        far = focus
    if near is not None and far is None and near < focus and 1 / near - 1 / focus < error:
        near = focus
    return near, far


def _read(
    inputs: Sequence[Path], optics: Mapping[str, Any], calibration: Path | None, method: MethodName, align: bool
) -> tuple[Settings, list[Photograph]]:
    from focalgradient.photographs import from_exif, load_camera, load_settings, read_photographs

    least = METHODS[method].least
    calibrated = None if calibration is None else load_camera(calibration)
    tables = [path for path in inputs if path.suffix.lower() == ".toml"]
    if tables:
        if len(inputs) > 1:
            raise InputError(f"{tables[0]} is a settings file, which names its images itself: give it alone.")
        if given := [name for name, value in optics.items() if value not in (None, False, ())]:
            option = given[0].removesuffix("s").replace("_", "-")
            raise InputError(f"--{option} cannot go with {tables[0]}, which gives the optics itself: set it there.")
        settings = load_settings(tables[0], calibrated)
        images, flats = [shot.image for shot in settings.shots], [shot.flat for shot in settings.shots]
        return settings, read_photographs(images, settings.camera.encoding, flats, crop=align)
    if len(inputs) < least:
        what = f"{printable(inputs[0])} is {'a folder' if inputs[0].is_dir() else 'one file'}"
        raise InputError(
            f"{what}, but depth needs {least} or more photographs, or a settings file whose name ends in .toml: give "
            "these, or --method edges for one photograph of sharp edges."
        )
    encoding = optics["encoding"] or (None if calibrated is None else calibrated.sensor.encoding)
    photographs = read_photographs(inputs, encoding, crop=align)
    with options_named(FROM_EXIF):
        settings = from_exif(
            inputs,
            focal_length_mm=optics["focal_length"],
            f_numbers=optics["f_numbers"],
            focus_distances_m=optics["focus_distances"],
            pixel_pitch_um=optics["pixel_pitch"],
            encoding=encoding,
            telecentric=optics["telecentric"],
            distances_from=optics["distances_from"],
            focus_from=optics["focus_from"],
            sensor_to_pupil_mm=optics["sensor_to_pupil"],
            sensor_to_front_mm=optics["sensor_to_front"],
            focus_tolerance=optics["focus_tolerance"],
            f_number_tolerance=optics["f_number_tolerance"],
            calibrated=calibrated,
            least=least,
            order_only=method == "autofocus",
        )
    return settings, photographs
