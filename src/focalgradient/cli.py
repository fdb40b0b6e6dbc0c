"""The command line: ``focalgradient depth``.

Whatever is wrong with the input is said in one sentence on standard error, with exit code 2. Results are computed
first, written beside their place, and moved there together. Heavy rooms are imported by the command that needs them.
"""

from __future__ import annotations

import json
import math
import os
import platform
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NoReturn

import click
import numpy as np

from focalgradient.errors import FocalGradientWarning, InputError

if TYPE_CHECKING:
    from focalgradient.depth.depthmap import DepthMap
    from focalgradient.photographs import Photograph, Settings

__all__ = ["main"]

_STAGES = 6
"""Stages that the progress bar counts: reading, the four of `recover_depth`, drawing."""


class _Program(click.Group):
    """A group of commands that says what went wrong in one sentence."""

    def main(self, *args: Any, **kwargs: Any) -> Any:
        try:
            code = super().main(*args, **{**kwargs, "standalone_mode": False})
        except click.UsageError as error:
            program = error.ctx.command_path if error.ctx else "focalgradient"
            _fail(f"{error.format_message().rstrip('.')}: see '{program} --help'.")
        except click.ClickException as error:
            _fail(error.format_message())
        except InputError as error:
            _fail(str(error))
        except OSError as error:
            _fail(f"{error.filename or 'a file'} could not be read or written ({error.strerror or error}).")
        sys.exit(code if isinstance(code, int) else 0)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            click.echo("Interrupted: nothing was written.", err=True)
            ctx.exit(130)


def _fail(sentence: str) -> NoReturn:
    click.echo(f"Error: {' '.join(sentence.split())}", err=True)
    sys.exit(2)


@click.group(
    "focalgradient", cls=_Program, no_args_is_help=False, context_settings={"help_option_names": ["-h", "--help"]}
)
@click.version_option(package_name="focalgradient", message="%(prog)s %(version)s", prog_name="focalgradient")
def main() -> None:
    """Depth from blur: the focal gradient as a source of depth (after Pentland 1987)."""


def _positive(
    unit: str = "", infinite: bool = False
) -> Callable[[click.Context, click.Parameter, float | tuple[float, ...] | None], Any]:
    def check(_: click.Context, option: click.Parameter, given: float | tuple[float, ...] | None) -> Any:
        for value in given if isinstance(given, tuple) else (given,):
            if value is not None and not (value > 0 and (infinite or math.isfinite(value))):
                raise InputError(f"{option.opts[0]} is {value:g}, but must be a positive number{unit}.")
        return given

    return check


@main.command(short_help="Recover depth from views that differ in aperture or focus.")
@click.argument(
    "inputs", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="VIEWS.toml | A.jpg B.jpg ..."
)
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the results.")
@click.option("--near", type=float, metavar="M", callback=_positive(" of metres"), help="Search from here, in metres.")
@click.option(
    "--far",
    type=float,
    metavar="M",
    callback=_positive(" of metres", infinite=True),
    help="Search up to here, in metres.",
)
@click.option(
    "--psf",
    type=click.Choice(["disc", "gaussian"]),
    default="disc",
    show_default=True,
    help="Shape of the blur. For a gaussian, blur_k in [camera] is its standard deviation over the disc's radius.",
)
@click.option("--align", is_flag=True, help="Remove shift and scale between the views before comparing them.")
@click.option(
    "--focal-length",
    type=float,
    metavar="MM",
    callback=_positive(" of millimetres"),
    help="* Focal length, in millimetres.",
)
@click.option(
    "--f-number",
    "f_numbers",
    type=float,
    multiple=True,
    metavar="N",
    callback=_positive(infinite=True),
    help="* f-number: once for each photograph, in order.",
)
@click.option(
    "--focus-distance",
    "focus_distances",
    type=float,
    multiple=True,
    metavar="M",
    callback=_positive(" of metres", infinite=True),
    help="* Distance of the plane in focus, in metres: once for each photograph, in order.",
)
@click.option(
    "--pixel-pitch",
    type=float,
    metavar="UM",
    callback=_positive(" of micrometres"),
    help="* Size of a pixel, in micrometres.",
)
@click.option(
    "--encoding",
    type=click.Choice(["linear", "srgb"]),
    help="* How pixel values encode light.  [default: srgb for 8-bit image files, linear for others]",
)
@click.option("--telecentric", is_flag=True, help="* Magnification does not change with focus.")
def depth(
    inputs: tuple[Path, ...],
    out: Path,
    near: float | None,
    far: float | None,
    psf: Literal["disc", "gaussian"],
    align: bool,
    **optics: Any,
) -> None:
    """Recover depth from two or more views that differ in aperture, in focus, or both.

    The views are named, with their optics, in a settings file; or they are photographs, whose focal length, f-number,
    distance of focus and pixel pitch are read from EXIF where the options marked * do not give them.

    Writes DIR/depth.npz (distance, vergence, vergence_sd, valid), DIR/depth.png and DIR/summary.json.

    \b
    Examples:
      focalgradient depth VIEWS.toml --out results --near 0.9 --far 2.2
      focalgradient depth f16.jpg f4.jpg --out results --focus-distance 0.85 --focus-distance 0.85

    \b
    VIEWS.toml:
      [camera]
      focal_length_mm = 25.0
      pixel_pitch_um = 8.0
      encoding = "linear"        # or "srgb", the default for 8-bit files
      telecentric = false
      [[view]]                   # one such table for each view, two or more
      image = "view0.png"        # relative to this file: PNG, TIFF, JPEG or .npy
      f_number = 16
      focus_distance_m = 0.85
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    start = time.perf_counter()
    if near is not None and far is not None and near >= far:
        raise InputError(f"--near {near:g} lies beyond or at --far {far:g}: give --near the smaller distance.")
    base = _writable(out, ("depth.npz", "depth.png", "summary.json"))
    with _progress() as say, _warnings_told() as told:
        say("reading the views")
        settings, photographs = _read(inputs, optics)

        from focalgradient import recover_depth
        from focalgradient.photographs import make_views

        views = make_views(settings, photographs)
        k = settings.camera.blur_k
        result = recover_depth(views, near=near, far=far, psf=psf, k=k, align=align, progress=say)
        if not result.valid.any():
            warnings.warn(
                "no pixel is valid: the views show too little texture, or contradict each other.",
                FocalGradientWarning,
                stacklevel=1,
            )
        say("drawing")
        from focalgradient.plotting import depth_figure

        figure = depth_figure(views, result, names=[photograph.path.name for photograph in photographs])

    asked = {"near_m": near, "far_m": far, "psf": psf, "align": align}
    summary = _summary(settings, photographs, asked, result, told)

    def write_summary(path: Path) -> None:
        text = json.dumps(
            _strict(summary | {"seconds": time.perf_counter() - start}), indent=2, allow_nan=False, ensure_ascii=False
        )
        path.write_text(text + "\n", encoding="utf-8")

    writers: dict[str, Callable[[Path], object]] = {
        "depth.npz": result.save,
        "depth.png": figure.savefig,
        "summary.json": write_summary,
    }
    _write(out, base, writers)
    distance = summary["medians"]["distance_m"]
    click.echo(f"Median distance: {'unknown' if math.isnan(distance) else f'{distance:.4g} m'}")
    click.echo(f"Valid pixels: {summary['share_valid']:.1%}")
    click.echo(f"Written: {', '.join(str(out / name) for name in writers)}")


def _read(inputs: Sequence[Path], optics: Mapping[str, Any]) -> tuple[Settings, list[Photograph]]:
    from focalgradient.photographs import from_exif, load_settings, read_photographs

    tables = [path for path in inputs if path.suffix.lower() == ".toml"]
    if tables:
        if len(inputs) > 1:
            raise InputError(f"{tables[0]} is a settings file, which names its images itself: give it alone.")
        if given := [name for name, value in optics.items() if value]:
            option = given[0].removesuffix("s").replace("_", "-")
            raise InputError(f"--{option} cannot go with {tables[0]}, which tells the optics itself: set it there.")
        settings = load_settings(tables[0])
        return settings, read_photographs([shot.image for shot in settings.shots], settings.camera.encoding)
    if len(inputs) < 2:
        raise InputError(
            f"only {inputs[0]} is given, but depth needs a settings file, whose name ends in .toml, "
            "or two or more photographs: add what is missing."
        )
    photographs = read_photographs(inputs, optics["encoding"])
    settings = from_exif(
        inputs,
        focal_length_mm=optics["focal_length"],
        f_numbers=optics["f_numbers"],
        focus_distances_m=optics["focus_distances"],
        pixel_pitch_um=optics["pixel_pitch"],
        encoding=optics["encoding"],
        telecentric=optics["telecentric"],
    )
    return settings, photographs


@contextmanager
def _warnings_told() -> Iterator[list[str]]:
    """Print focalgradient's warnings above the bar, a line each, and collect them; others go their way."""
    from tqdm import tqdm

    told: list[str] = []

    def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
        if not issubclass(category, FocalGradientWarning):
            otherwise(message, category, *place, **more)
        else:
            told.append(str(message))
            tqdm.write(f"Warning: {' '.join(str(message).split())}", file=sys.stderr)

    with warnings.catch_warnings():
        warnings.simplefilter("always", FocalGradientWarning)
        otherwise, warnings.showwarning = warnings.showwarning, show
        yield told


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """Show a bar over the stages of the work, on standard error where that is a terminal."""
    from tqdm import tqdm

    layout = "{desc:<24}|{bar:30}| {elapsed}"
    with tqdm(total=_STAGES, bar_format=layout, leave=False, disable=not sys.stderr.isatty()) as bar:

        def say(stage: str) -> None:
            bar.set_description_str(stage, refresh=False)
            bar.update()
            bar.refresh()

        yield say


def _summary(
    settings: Settings,
    photographs: Sequence[Photograph],
    asked: Mapping[str, Any],
    result: DepthMap,
    told: Sequence[str],
) -> dict[str, Any]:
    valid = result.valid

    def median(values: np.ndarray[Any, Any]) -> float:
        return float(np.median(values[valid])) if valid.any() else math.nan

    views = [
        {
            "image": str(photograph.path),
            "f_number": shot.f_number,
            "focus_distance_m": shot.focus_distance_m,
            "pixel_angle_rad": pixel_angle,
            "encoding": photograph.encoding,
            "pixel_type": photograph.pixel_type,
            "share_saturated": photograph.saturated,
        }
        for photograph, shot, pixel_angle in zip(photographs, settings.shots, settings.pixel_angles(), strict=True)
    ]
    packages = ("focalgradient", "numpy", "scipy")
    return {
        "settings": {"camera": settings.camera.model_dump(), "views": views, **asked},
        "medians": {
            "distance_m": median(result.distance),
            "vergence_dioptres": median(result.vergence),
            "vergence_sd_dioptres": median(result.vergence_sd),
        },
        "share_valid": float(valid.mean()),
        "side_of_focus": {
            "reading": result.details.get("side"),
            "share_of_valid_told_by_views": float(result.side_known[valid].mean()) if valid.any() else math.nan,
        },
        "details": result.details,
        "warnings": list(told),
        "versions": {name: version(name) for name in packages} | {"python": platform.python_version()},
    }


def _strict(value: Any) -> Any:
    """`value` as strict JSON knows it: NaN becomes null, infinities the texts "inf" and "-inf"."""
    if isinstance(value, Mapping):
        return {str(key): _strict(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_strict(item) for item in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return _strict(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value


def _writable(out: Path, names: Sequence[str]) -> Path:
    """Give the folder at or above `out` that exists; refuse what cannot be written before the long work, not after."""
    base = next(folder for folder in (out.absolute(), *out.absolute().parents) if os.path.lexists(folder))
    try:
        with tempfile.TemporaryFile(dir=base):
            pass
    except OSError as error:
        raise InputError(
            f"--out {out} cannot be written ({error.strerror}): give a folder that you may write in."
        ) from error
    for name in names:
        if (out / name).is_dir():
            raise InputError(
                f"{out / name} is a folder, where a file is to be written: move it or choose another --out."
            )
    return base


def _write(out: Path, base: Path, writers: Mapping[str, Callable[[Path], object]]) -> None:
    """Write all files out of sight in `base`, on the same disk; then move all into `out`."""
    with tempfile.TemporaryDirectory(prefix=".focalgradient-", dir=base) as staging:
        for name, write in writers.items():
            write(Path(staging, name))
        out.mkdir(parents=True, exist_ok=True)
        for name in writers:
            Path(staging, name).replace(out / name)
