"""``focalgradient stereo``: a picture with its depth, as seen by two eyes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from focalgradient.cli.options import (
    UNITS,
    depth_file_options,
    gamma_of,
    picture_encoding_option,
    positive,
    screen_size,
)
from focalgradient.cli.program import (
    force_option,
    json_option,
    resumable,
    show,
    summary_json,
    warnings_given,
    writable,
    write_set,
)
from focalgradient.cli.through_optics import (
    NAMED,
    lens_or_eye_options,
    optics_of,
    pixel_options,
    read_picture_and_depth,
)
from focalgradient.errors import InputError
from focalgradient.files import printable, refuse_overwriting
from focalgradient.plausibility import given_as

if TYPE_CHECKING:
    from focalgradient.binocular import Presentation

__all__ = ["stereo"]

WAYS = ("side-by-side", "crossed", "over-under", "anaglyph", "colour-anaglyph", "rows", "halves", "screens")
"""Ways to combine two views, as `focalgradient.binocular.PRESENTATIONS`, without importing it."""


@click.command(short_help="Render a picture of known depth for two eyes.")
@click.argument("picture", type=click.Path(path_type=Path), metavar="PICTURE")
@click.argument("depth", type=click.Path(path_type=Path), metavar="DEPTH")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="DIR", help="Folder for the results.")
@lens_or_eye_options
@click.option(
    "--focus",
    type=float,
    required=True,
    metavar="M",
    callback=positive(" of metres, or inf", infinite=True),
    help="Distance in focus, in metres, or inf.",
)
@click.option(
    "--right-focus",
    type=float,
    metavar="M",
    callback=positive(" of metres, or inf", infinite=True),
    help="Distance in focus of the right eye, if it differs (monovision).",
)
@click.option(
    "--interocular",
    type=float,
    default=63.0,
    show_default=True,
    metavar="MM",
    callback=positive(" of millimetres", least=1.0, most=1000.0, hint=UNITS),
    help="Distance between the eyes, in millimetres.",
)
@click.option(
    "--screen-at",
    type=float,
    metavar="M",
    callback=positive(" of metres, or inf", infinite=True),
    help="Distance of zero disparity, in metres: that of the screen.  [default: --focus]",
)
@click.option("--no-blur", is_flag=True, help="Disparity only: both views are sharp.")
@click.option(
    "--blur-at",
    type=float,
    metavar="M",
    callback=positive(" of metres, or inf", infinite=True),
    help="Blur everything as at this distance, in metres; disparity is unchanged.",
)
@click.option("--no-disparity", is_flag=True, help="Blur only: both views from the midpoint, at the screen's distance.")
@click.option("--camera", type=click.Choice(["left", "middle", "right"]), default="middle", show_default=True)
@click.option(
    "--show",
    "ways",
    type=click.Choice(WAYS),
    multiple=True,
    help="How the two views are combined; left.png and right.png are always written. Repeatable.",
)
@click.option(
    "--screen",
    default="1920x1080",
    show_default=True,
    metavar="WxH",
    help="For halves: width and height of the screen in pixels.",
)
@pixel_options
@depth_file_options
@picture_encoding_option
@click.option("--gamma", default="sRGB", show_default=True, metavar="G", help="Gamma of the display, or sRGB.")
@click.option(
    "--white", type=float, default=1.0, show_default=True, callback=positive(), help="Linear value shown as white."
)
@force_option
@json_option
def stereo(picture: Path, depth: Path, out: Path, ways: tuple[Presentation, ...], **options: Any) -> None:
    """Render PICTURE for a left and a right eye, each with its own blur.

    PICTURE, DEPTH, the optics and the size of a pixel are as for 'focalgradient blur'. Surfaces that an eye sees beside
    an occlusion boundary, but that the picture does not show, are completed and flagged.

    Writes DIR/left.png and right.png, and DIR/left.npz and right.npz with linear light and, for every pixel, true
    distance (m), vergence (D), disparity (rad, positive if nearer than the screen), radius of blur (rad), pixels hidden
    from the other eye, and completed pixels. With --show also DIR/WAY.png; screens writes left-screen.png and
    right-screen.png, reversed left to right for a mirror in front of each eye.

    Takes about twice as long as 'focalgradient blur' with one focus.

    \b
    Example:
      focalgradient stereo demo/picture.png demo/distance.npy --out two-eyes --pupil 4 --focus 0.8 --field 6 \\
        --interocular 20 --show anaglyph --show side-by-side
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.binocular import PRESENTATIONS
    from focalgradient.binocular import stereo as see
    from focalgradient.display import Display
    from focalgradient.photographs.pictures import png_of

    pictures = [f"{name}.png" for way in ways for name in PRESENTATIONS[way]]
    names = ["left.png", "right.png", *pictures, "left.npz", "right.npz"]
    writable(out, [*names, "summary.json"], [picture, depth])
    refuse_overwriting([picture, depth], [out / name for name in names])
    click.get_current_context().with_resource(given_as(NAMED))
    if options["no_blur"] and options["blur_at"] is not None:
        raise InputError("--no-blur and --blur-at both set the blur: give one of them.")
    display, size = Display(gamma=gamma_of(options["gamma"])), screen_size(options["screen"])
    left = optics_of(options, 1 / options["focus"])
    right = left if options["right_focus"] is None else optics_of(options, 1 / options["right_focus"])
    zero = options["screen_at"] or options["focus"]
    with warnings_given() as said, resumable("nothing was written.") as say:
        shown = read_picture_and_depth(picture, depth, options, [left, right])
        pair = see(
            shown.light / options["white"],
            shown.metres,
            (left, right),
            pixel_angle=shown.pixel_angle,
            interocular=1e-3 * options["interocular"],
            vergence=1 / zero,
            blur=not options["no_blur"],
            blur_distance=options["blur_at"],
            disparity_distance=zero if options["no_disparity"] else None,
            camera={"left": -0.5, "middle": 0.0, "right": 0.5}[options["camera"]],
            progress=say,
        )
        lights = {"left": pair.left.light, "right": pair.right.light}
        for way in ways:
            lights |= pair.presented(way, size)
        files: dict[str, Any] = {f"{name}.png": png_of(display.encode(one)) for name, one in lights.items()}
        files |= {"left.npz": pair.left.write, "right.npz": pair.right.write}
    settings = {name: printable(one) if isinstance(one, Path) else one for name, one in options.items()}
    found = pair.summary()
    summary = {
        "settings": {"picture": printable(picture), "depth": printable(depth), **settings},
        **found,
        "warnings": said,
    }
    write_set(out, {**files, "summary.json": summary_json(summary)}, "summary.json")
    (low, high), (left_share, right_share) = found["disparity_px"], found["share_completed"]
    show(
        summary | {"written": [printable(out / name) for name in (*files, "summary.json")]},
        f"Disparity: {low:.3g} to {high:.3g} pixels, positive if nearer than the screen",
        f"Completed: {left_share:.1%} of the left view, {right_share:.1%} of the right one",
        f"Written: {len(files) + 1} files in {printable(out)}",
    )
