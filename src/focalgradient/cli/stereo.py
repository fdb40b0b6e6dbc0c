"""``focalgradient stereo``: a picture with its depth, as seen by two eyes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import click

import focalgradient as fg
from focalgradient.cli.generate import Folder, command
from focalgradient.cli.groups import gamma_of, screen_size
from focalgradient.cli.program import resumable, show, summary_json, warnings_given, writable, write_set
from focalgradient.cli.through_optics import DISTANCE, NAMED, LensOrEye, Read, read_picture_and_depth, settings_given
from focalgradient.errors import InputError
from focalgradient.files import printable
from focalgradient.plausibility import given_as
from focalgradient.quantities import MILLIMETRES, POSITIVE

__all__ = ["stereo"]

Way = Literal["side-by-side", "crossed", "over-under", "anaglyph", "colour-anaglyph", "rows", "halves", "screens"]
"""As `focalgradient.binocular.Presentation`, without importing it."""


@command("Render a picture of known depth for two eyes.")
def stereo(
    picture: Path,
    depth: Path,
    /,
    *,
    out: Folder,
    optics: LensOrEye,
    focus: Annotated[float, DISTANCE],
    right_focus: Annotated[float | None, DISTANCE] = None,
    interocular: Annotated[float, MILLIMETRES.between(1.0, 1000.0, ": check its unit")] = 63.0,
    screen_at: Annotated[float | None, DISTANCE] = None,
    no_blur: bool = False,
    blur_at: Annotated[float | None, DISTANCE] = None,
    no_disparity: bool = False,
    camera: Literal["left", "middle", "right"] = "middle",
    show_as: Annotated[tuple[Way, ...], "--show"] = (),
    screen: Annotated[str, "WxH"] = "1920x1080",
    read: Read,
    gamma: Annotated[str, "G"] = "sRGB",
    white: Annotated[float, POSITIVE] = 1.0,
) -> None:
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

    Parameters
    ----------
    out
        Folder for the results.
    focus
        Distance in focus, in metres, or inf.
    right_focus
        Distance in focus of the right eye, if it differs (monovision).
    interocular
        Distance between the eyes, in millimetres.
    screen_at
        Distance of zero disparity, in metres: that of the screen.  [default: --focus]
    no_blur
        Disparity only: both views are sharp.
    blur_at
        Blur everything as at this distance, in metres; disparity is unchanged.
    no_disparity
        Blur only: both views from the midpoint, at the screen's distance.
    camera
        Where the picture was taken: at the left eye, midway between the eyes, or at the right eye.
    show_as
        How the two views are combined; left.png and right.png are always written. Repeatable.
    screen
        For halves: width and height of the screen in pixels.
    gamma
        Gamma of the display, or sRGB.
    white
        Linear value shown at full display luminance.
    """  # noqa: D301  click's mark against rewrapping is a real backspace
    from focalgradient.photographs.pictures import png_of

    pictures = [f"{name}.png" for way in show_as for name in fg.binocular.PRESENTATIONS[way]]
    names = ["left.png", "right.png", *pictures, "left.npz", "right.npz"]
    writable(out, [*names, "summary.json"], [picture, depth])
    click.get_current_context().with_resource(given_as(NAMED))
    if no_blur and blur_at is not None:
        raise InputError("--no-blur and --blur-at both set the blur: give one of them.")
    display, size = fg.display.Display(gamma=gamma_of("--gamma", gamma)), screen_size("--screen", screen)
    zero, foci = screen_at or focus, [focus, right_focus or focus]
    with warnings_given() as said, resumable("nothing was written.") as say:
        left = optics.focused(1 / focus)
        right = left if right_focus is None else optics.focused(1 / right_focus)
        states = optics.states([left, right], [1 / metres for metres in foci])
        shown = read_picture_and_depth(picture, depth, [left, right], **read, focal_length=optics.focal_length)
        pair = fg.binocular.stereo(
            shown.light / white,
            shown.metres,
            (left, right),
            pixel_angle=shown.pixel_angle,
            interocular=1e-3 * interocular,
            vergence=1 / zero,
            blur=not no_blur,
            blur_distance=blur_at,
            disparity_distance=zero if no_disparity else None,
            camera={"left": -0.5, "middle": 0.0, "right": 0.5}[camera],
            progress=say,
        )
        lights = {"left": pair.left.light, "right": pair.right.light}
        for way in show_as:
            lights |= pair.presented(way, size)
        files: dict[str, Any] = {f"{name}.png": png_of(display.encode(one)) for name, one in lights.items()}
        files |= {"left.npz": pair.left.write, "right.npz": pair.right.write}
    found = pair.summary()
    summary = {
        "settings": {"picture": printable(picture), "depth": printable(depth), **settings_given("show"), **states},
        **found,
        "warnings": said,
    }
    write_set(out, {**files, "summary.json": summary_json(summary)}, "summary.json")
    (low, high), (left_share, right_share) = found["disparity_px"], found["share_completed"]
    show(
        summary | {"written": [printable(out / name) for name in (*files, "summary.json")]},
        *optics.notes(states),
        f"Disparity: {low:.3g} to {high:.3g} pixels, positive if nearer than the screen",
        f"Completed: {left_share:.1%} of the left view, {right_share:.1%} of the right one",
        f"Written: {len(files) + 1} files in {printable(out)}",
    )
