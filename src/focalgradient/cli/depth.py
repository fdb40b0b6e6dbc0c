"""``focalgradient depth``: depth from views that differ in aperture, focus, or both."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import focalgradient as fg
from focalgradient.cli.frames import NAMES, Frame, Recovered, by_worker, folders, recover_frames
from focalgradient.cli.generate import Folder, command, options_named
from focalgradient.cli.groups import GIVEN, Limits, Optics, Workers
from focalgradient.cli.program import (
    announce,
    nothing_valid,
    resumable,
    show,
    summary_json,
    warnings_given,
    with_options,
    writable,
)
from focalgradient.depth.common_error import KnownPoint, checked_points
from focalgradient.depth.settings import MethodName
from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.files.cells import as_number
from focalgradient.options.shapes import AUTO_SHAPE, ShapeAsked
from focalgradient.plausibility import given_as
from focalgradient.progress import Progress

__all__ = ["depth"]

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

POINT_OPTIONS = {"focus_tolerance, aperture_tolerance": "--focus-tolerance, --f-number-tolerance"}
"""Parameters named in messages on measured points, and the corresponding options."""

SECONDS = {"equalise": 5.0, "spectra": 9.0, "ratio": 0.5, "edges": 10.0, "autofocus": 0.7, "dual-pixels": 3.0}
"""Processor time of two views in s per megapixel, measured at 1280 x 960 pixels with two apertures and two foci."""

OTHERS = dict.fromkeys((".csv", ".tsv", ".xlsx"), "report") | dict.fromkeys((".mp4", ".mov", ".mkv", ".avi"), "stream")
"""Commands for files that are not photographs, by extension."""


def _photographs(_: str, given: tuple[Path, ...]) -> tuple[Path, ...]:
    """Raise `InputError` for a single file that belongs to another command."""
    if len(given) == 1 and (command := OTHERS.get(given[0].suffix.lower())):
        raise InputError(
            f"{printable(given[0])} is one file, but not a photograph: give it to 'focalgradient {command}'."
        )
    return given


def _known_points(given: tuple[str, ...]) -> list[KnownPoint]:
    """Parse points X,Y=M."""
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


@command("Recover depth from views that differ in aperture or focus.")
def depth(
    inputs: Annotated[tuple[Path, ...], _photographs, "VIEWS.toml ... | A.jpg B.jpg ..."],
    /,
    *,
    out: Folder,
    method: MethodName = "equalise",
    at: Annotated[tuple[str, ...], "X,Y=M"] = (),
    limits: Limits,
    psf: ShapeAsked = AUTO_SHAPE,
    align: bool = False,
    dense: bool = False,
    calibration: Annotated[Path | None, "CAMERA.toml"] = None,
    optics: Optics,
    workers: Workers,
) -> None:
    """Recover depth from two or more views that differ in aperture, in focus, or both.

    The views and their optics are named in a settings file; or they are photographs whose focal length, f-number, focus
    distance and pixel pitch are read from EXIF unless options marked * give them.

    Writes DIR/depth.npz, DIR/depth.png and DIR/summary.json. The arrays have one value per pixel of the first view:
    distance (m), vergence (dioptres), valid, and two standard deviations in dioptres: vergence_sd for errors that
    differ between pixels, and common_sd for errors common to the frame, such as that of the focus. Pixels that are not
    valid have no usable estimate; with --dense they have a completed one, and `evidence` is 2 where depth is measured,
    1 close to that and 0 where it is extrapolated. `beyond` is -1 where depth lies farther than the search, 1 where
    it lies nearer; with --method autofocus, at or beyond the focus at that end. With one focus and two apertures
    blur beyond the search has two possible distances, nearer and farther: see the summary.

    \b
    Methods and their uses:
      equalise     two or more views of anything with texture. The default.
      edges        one or more views: printed squares, cards and other hard edges on blank surfaces, where the default
                   finds no texture. Depth along the edges only.
      spectra      two or more views: the paper's regression on the spectra of patches, for comparison.
      ratio        two apertures at one focus: fast, with errors of a few per cent. For video see 'stream'.
      autofocus    three or more foci: the sharpest of a stack. The most accurate with ten or more images.
      dual-pixels  the two halves of dual pixels, for which it is the default.

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
      field_tolerance = 0.003    # the same of the focus at the frame's corner, in focal lengths; 0: flat
      calibration = "CAMERA.toml"  # may be omitted; gives everything above, and the focus if it has only one
      [[view]]                   # one such table per view, at least two
      image = "view0.png"        # relative to this file: PNG, TIFF, JPEG or .npy
      f_number = 16
      focus_distance_m = 0.85
      flat = "flat0.png"         # may be omitted: a blank, evenly lit surface, to correct vignetting

    Parameters
    ----------
    out
        Folder for the results.
    method
        Method of measuring blur: see above.
    at
        Point of measured distance: column and row in pixels of the first view, and distance in metres. Corrects the
        focus, with two or more points also the scale of the apertures, within their tolerance. Repeatable.
    psf
        Shape of the blur; auto: a disc, or as measured by --calibration. For a gaussian or a blend, blur_k in [camera]
        is its k.
    align
        Remove shift and scale between the views before comparing them; crop views of unequal size to their common part.
    dense
        Complete vergence where it is not valid, with a standard deviation that includes the interpolation error.
    calibration
        Camera measured by `focalgradient calibrate`; f-number and focus distance are then marks on the lens.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    near, far = limits["near"], limits["far"]
    if near is not None and far is not None and near >= far:
        raise InputError(f"--near {near:g} lies beyond or at --far {far:g}: give --near the smaller distance.")
    if numbers := [str(path) for path in inputs if as_number(str(path)) is not None and not path.exists()]:
        raise InputError(f"{numbers[0]} is not a file: write an option before each value: --f-number 16 --f-number 4.")
    call: dict[str, Any] = {"method": method, "psf": psf.stated(), "known_points": _known_points(at)}
    call |= {"align": align, "dense": dense, "calibration": calibration, **limits, **optics}
    read = [*inputs, *([] if calibration is None else [calibration]), *_files_of(inputs, calibration)]
    if len(inputs) > 1 and all(path.suffix.lower() == ".toml" for path in inputs):
        named = zip(folders(inputs), inputs, strict=True)
        frames = {name: Frame((path,), call, out / name).absolute() for name, path in named}
        for frame in frames.values():
            writable(frame.out, NAMES, read)
        recover_frames(_recovered, frames, out, workers.shared(SECONDS[method] * len(frames)))
        return
    writable(out, NAMES, read)
    frame = Frame(inputs, call, out)
    with resumable("") as say, warnings_given() as given, workers.shared() as executor:
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
    calibrated = None
    if calibration is not None:
        with suppress(InputError):
            calibrated = fg.photographs.load_camera(calibration)
    for path in (one for one in inputs if one.suffix.lower() == ".toml"):
        with suppress(InputError):
            yield from fg.photographs.load_settings(path, calibrated).files


def _recovered(frame: Frame, given: list[str], say: Progress) -> Recovered:
    """Recover the depth of one frame; `given` are the warnings issued so far."""
    start, method = time.perf_counter(), frame.call["method"]

    def begun(count: int, pixels: int) -> None:
        announce(SECONDS[method] * 1e-6 * pixels * count / 2, f"depth of {pixels / 1e6:.3g} megapixels")

    words = POINT_OPTIONS | FROM_EXIF
    if any(path.suffix.lower() == ".toml" for path in frame.inputs):  # names keys, and options that cannot go with it
        flags = {name: re.sub(r"s?(_[mu]?m)?$", "", name).replace("_", "-") for name in frame.call}
        words = POINT_OPTIONS | {f"{name} cannot": f"--{flag} cannot" for name, flag in flags.items()}
    with given_as(GIVEN), options_named(words):
        found = fg.photographs.depth_from_photographs(frame.inputs, begun=begun, progress=say, **frame.call)
    say(1.0, "drawing")
    drawn = found.depth
    if "rejected" in drawn.details:
        drawn = replace(drawn, details={**drawn.details, "rejected": with_options(drawn.details["rejected"])})
    names = [printable(photograph.path.name) for photograph in found.photographs]
    figure = fg.plotting.depth_figure(found.views, drawn, names=names)
    summary = found.record(given) | {"seconds": time.perf_counter() - start}
    files: dict[str, bytes | Callable[[Path], object]] = {
        "depth.npz": found.depth.save,
        "depth.png": figure.savefig,
        "summary.json": summary_json(summary),
    }
    return Recovered(files, summary, middle=found.summary().replace("(give encoding,", "(give --encoding,"))
