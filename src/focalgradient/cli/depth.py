"""``focalgradient depth``: depth from views that differ in aperture, focus, or both."""

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
    with_options,
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
"""Number of stages of the progress bar: reading, the four of `recover_depth`, drawing."""


FROM_EXIF = {
    "focal_length_mm": "--focal-length MM",
    "f_numbers": "--f-number N",
    "focus_distances_m": "--focus-distance M",
    "pixel_pitch_um": "--pixel-pitch UM",
    "sensor_to_front_mm": "--sensor-to-front MM",
    "distances_from": "--distances-from",
    "focus_from": "--focus-from",
}
"""Parameters of `focalgradient.photographs.from_exif`, and the corresponding options."""

SECONDS = {"equalise": 5.0, "spectra": 9.0, "ratio": 0.5, "edges": 10.0, "autofocus": 0.7}
"""Processor time of two views in s per megapixel, measured at 1280 x 960 pixels with two apertures and two foci."""

BYTES_PER_PIXEL = 200
"""Memory of depth in bytes per pixel, apart from the images: 190 measured, with the default method and two views."""


OTHERS = dict.fromkeys((".csv", ".tsv", ".xlsx"), "report") | dict.fromkeys((".mp4", ".mov", ".mkv", ".avi"), "stream")
"""Commands for files that are not photographs, by extension."""

POINT_OPTIONS = {"focus_tolerance, aperture_tolerance": "--focus-tolerance, --f-number-tolerance"}
"""Parameters named in messages on measured points, and the corresponding options."""


def _photographs(_: click.Context, __: click.Parameter, given: tuple[Path, ...]) -> tuple[Path, ...]:
    """Raise `InputError` for a single file that belongs to another command: an argument's callback."""
    if len(given) == 1 and (command := OTHERS.get(given[0].suffix.lower())):
        raise InputError(
            f"{printable(given[0])} is one file, but not a photograph: give it to 'focalgradient {command}'."
        )
    return given


def _known_points(_: click.Context, option: click.Parameter, given: Sequence[str]) -> list[KnownPoint]:
    """Parse points X,Y=M, as an option's callback."""
    found = []
    for text in given:
        place, distance = text.partition("=")[::2]
        try:
            x, y = (float(part) for part in place.split(","))
            found.append((x, y, float(distance)))
        except ValueError as error:
            raise InputError(
                f"--at is {printable(text)}, but must be a column, a row and a distance in metres, such as "
                "320,200=2.31."
            ) from error
    return checked_points(found)


@click.command(cls=ShapedCommand, short_help="Recover depth from views that differ in aperture or focus.")
@click.argument(
    "inputs",
    nargs=-1,
    required=True,
    type=click.Path(path_type=Path),
    metavar="VIEWS.toml ... | A.jpg B.jpg ...",
    callback=_photographs,
)
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the results.")
@click.option(
    "--method",
    type=click.Choice(list(METHODS)),
    default="equalise",
    show_default=True,
    help="Method of measuring blur: see above.",
)
@click.option(
    "--at",
    multiple=True,
    metavar="X,Y=M",
    callback=_known_points,
    help="Point of measured distance: column and row in pixels of the first view, and distance in metres. Corrects "
    "the focus, with two or more points also the scale of the apertures, within their tolerance. Repeatable.",
)
@limit_options
@shape_options(
    "Shape of the blur; auto: a disc, or as measured by --calibration. For a gaussian or a blend, blur_k in "
    "[camera] is its k."
)
@click.option(
    "--align",
    is_flag=True,
    help="Remove shift and scale between the views before comparing them; crop views of unequal size to their common "
    "part.",
)
@click.option(
    "--dense",
    is_flag=True,
    help="Complete vergence where it is not valid, with a standard deviation that includes the interpolation error.",
)
@click.option(
    "--calibration",
    type=click.Path(path_type=Path),
    metavar="CAMERA.toml",
    help="Camera measured by `focalgradient calibrate`; f-number and focus distance are then marks on the lens.",
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

    The views and their optics are named in a settings file; or they are photographs whose focal length, f-number, focus
    distance and pixel pitch are read from EXIF unless options marked * give them.

    Writes DIR/depth.npz, DIR/depth.png and DIR/summary.json. The arrays have one value per pixel of the first view:
    distance (m), vergence (dioptres), valid, and two standard deviations in dioptres: vergence_sd for errors that
    differ between pixels, and common_sd for errors common to the frame, such as that of the focus. Pixels that are not
    valid have no usable estimate; with --dense they have a completed one, and `evidence` is 2 where depth is measured,
    1 near such pixels and 0 where it is extrapolated. With --method autofocus `beyond` is -1 at or beyond the far
    focus, 1 at or nearer than the near focus.

    \b
    Methods and their uses:
      equalise   two or more views of anything with texture. The default.
      edges      one or more views: printed squares, cards and other hard edges on blank surfaces, where the default
                 finds no texture. Depth along the edges only.
      spectra    two or more views: the paper's regression on the spectra of patches, for comparison.
      ratio      two apertures at one focus: fast, with errors of a few per cent. For video see 'stream'.
      autofocus  three or more foci: the sharpest of a stack. The most accurate with ten or more images.

    Several settings files, one per frame, each get a subfolder of DIR, named after the file, or after its folder if
    several files have the same name. The workers of a --scheduler must see the same files under the same paths.

    Two views that differ only in aperture do not determine on which side of the focus a point lies: limit the search to
    one side with --near or --far, or change the focus too.

    Takes about 3 s per megapixel (edges: 8 s) on two cores, after a few seconds of start-up.

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
      encoding = "linear"        # or "srgb"; may be omitted if the files state it
      telecentric = false
      focus_tolerance = 0.1      # relative standard deviation of the focus distances; may be omitted
      f_number_tolerance = 0.05  # the same for a common factor of all f-numbers
      calibration = "CAMERA.toml"  # may be omitted; gives everything above, and the focus if it has only one
      [[view]]                   # one such table per view, at least two
      image = "view0.png"        # relative to this file: PNG, TIFF, JPEG or .npy
      f_number = 16
      focus_distance_m = 0.85
      flat = "flat0.png"         # may be omitted: a blank, evenly lit surface, to correct vignetting
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
    """Yield the files named in settings files; invalid settings files raise when their frame is processed."""
    from focalgradient.photographs import load_camera, load_settings

    calibrated = None
    if calibration is not None:
        with suppress(InputError):
            calibrated = load_camera(calibration)
    for path in (one for one in inputs if one.suffix.lower() == ".toml"):
        with suppress(InputError):
            yield from load_settings(path, calibrated).files


def _recovered(frame: Frame, given: list[str], say: Callable[[str], object]) -> Recovered:
    """Recover the depth of one frame; `given` are the warnings issued so far."""
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
    require(BYTES_PER_PIXEL * pixels, f"depth of {pixels / 1e6:.3g} million pixels", "crop or reduce the images")

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
        with options_named(POINT_OPTIONS):
            result = with_known_points(result, options["at"])
    say("drawing")
    drawn = result
    if "rejected" in result.details:
        drawn = replace(result, details={**result.details, "rejected": with_options(result.details["rejected"])})
    figure = depth_figure(views, drawn, names=[printable(photograph.path.name) for photograph in photographs])
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
    """Return depth relative to the entrance pupil, as in the optics."""
    from focalgradient import recover_depth

    near, far = limits
    return recover_depth(
        views,
        method=options["method"],
        near=near,
        far=far,
        psf=psf,
        align=options["align"] or settings.relative,  # the effect of focus on magnification is then unknown
        dense=options["dense"],
        progress=lambda share, words: say(words),
    )


def _limits(settings: Settings, options: Mapping[str, Any], offset: float) -> tuple[float | None, float | None]:
    """Return near and far limits (m) from the entrance pupil; `offset` is its distance from the user's plane."""
    near, far = (None if options[end] is None else options[end] + offset for end in ("near_m", "far_m"))
    return _beside_focus(near, far, settings)


def _compared_with_the_other_encoding(
    result: DepthMap,
    views: Sequence[View],
    photographs: Sequence[Photograph],
    options: Mapping[str, Any],
    limits: tuple[float | None, float | None],
) -> DepthMap:
    """Add the change of depth under the other encoding to `result`, if the files do not state their encoding."""
    from focalgradient.photographs.other_encoding import encoding_difference

    kinds = {photograph.encoding for photograph in photographs}
    if len(kinds) > 1 or not all(photo.assumed for photo in photographs) or options["method"] != "equalise":
        return result
    found = encoding_difference(views, result, photographs[0].encoding, *limits, options["align"])
    return result if found is None else replace(result, details=result.details | {"encoding_difference_D": found})


def _referred(result: DepthMap, views: Sequence[View], settings: Settings, offset: float) -> DepthMap:
    """Refer `result` to the user's plane of distances, and apply the calibration if a camera is given."""
    from focalgradient.calibration import apply_calibration

    if settings.relative:
        return _place_in_stack(result, len(views))
    if settings.calibration is None:
        return replace(result, offset=offset, plane=settings.plane)
    marks = [(shot.f_number, shot.focus_distance_m) for shot in settings.shots]
    return apply_calibration(result, views, settings.calibration, marks, offset, settings.plane)


def _place_in_stack(result: DepthMap, count: int) -> DepthMap:
    """Return a map of ordinal depth: `vergence` is 1 at the first photograph's focus, and 2 at the last one's."""
    warnings.warn(
        "no focus distance is known (give --focus-distance once for each photograph), so only the order of depth "
        f"is estimated: vergence is 1 at the focus of the first photograph and 2 at that of the last of {count}, "
        "assumed "
        "to be evenly spaced; distance is not estimated.",
        FocalGradientWarning,
        stacklevel=1,
    )
    return replace(result, details=result.details | {"order_only": count}, plane="no plane: order only")


def _shape(asked: ShapeAsked, method: MethodName, settings: Settings) -> BlurSource:
    """Return the blur shape that was requested, or else calibrated; raise if the method cannot use it."""
    camera = settings.calibration
    source = asked.source(settings.given_k(asked.name))
    if source is not AUTO or camera is None:
        return source
    if camera.psf is None:
        return (
            Gaussian(camera.k) if method == "edges" else AUTO
        )  # the model with which the target's edges were measured
    if method == "edges":
        warnings.warn(
            "the camera was calibrated by equalising, which does not measure the blur along edges: depth by edges may "
            "err by more than is stated; calibrate it by edges, too (focalgradient calibrate --method edges).",
            FocalGradientWarning,
            stacklevel=1,
        )
    return camera.psf


def _beside_focus(near: float | None, far: float | None, settings: Settings) -> tuple[float | None, float | None]:
    """Return limits (m from the pupil) next to a calibrated focus: a limit at the marked focus selects that side of it.

    The calibrated focus differs slightly from its mark, so a limit at the mark would leave both sides open.
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
        what = f"{printable(inputs[0])} is one file"
        if inputs[0].is_dir():
            what = f"{printable(inputs[0])} is {'a' if any(inputs[0].iterdir()) else 'an empty'} folder"
        raise InputError(
            f"{what}, but depth needs at least {least} photographs, or a settings file whose name ends in .toml: give "
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
