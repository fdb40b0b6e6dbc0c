"""Closed-form rendering of blurred lines, and of the Necker cube drawn with them.

In perspective the vergence of a straight edge, and with it the blur of a thin lens, is linear along the edge's image.
A line whose points each spread their energy as a Gaussian of standard deviation sigma(s) = a + b s, at s = 0 to L from
p in the direction d, has at x the radiance (with r0 = x - p, r1 = r0 - L d, Q = b r0 + a d)

    I(x) = exp(-(r0 x d)^2 / 2|Q|^2) [erf(Q.r0 / sqrt(2) a |Q|) - erf(Q.r1 / sqrt(2) (a + b L) |Q|)] / 2 sqrt(2 pi) |Q|

because r(s) x Q = sigma(s) (r0 x d), so that |r|^2 / sigma^2 = (r.Q)^2 / (sigma |Q|)^2 + (r0 x d)^2 / |Q|^2, and the
derivative of r.Q / (sigma |Q|) along the line is -|Q| / sigma^2.

Lines have a width w of their own, so sigma is hypot(w, blur), with a linear blur of either sign: a line that crosses
the plane of focus needs no special case. It is divided into nearly linear pieces: for hypot(w, w tan(angle)), a chord
over an angle of delta has a relative error of at most delta^2 / 8 everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Annotated, Literal, NotRequired, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_number, checked
from focalgradient.loops import compiled, inlined
from focalgradient.parallel import share_rows
from focalgradient.psf import DISC_K
from focalgradient.psf.shapes import PIXEL_VARIANCE
from focalgradient.quantities import Range, Whole
from focalgradient.scenes.necker import EDGES, SYMMETRY, NeckerCube
from focalgradient.view import check_shape

__all__ = ["Focus", "Gradient", "blur_at", "draw_edges", "line_light", "necker_frame", "necker_loop", "wireframe"]

Gradient = Literal["none", "rigid", "nonrigid"]
"""Interpretation of the cube with whose depth the blur is consistent, if any."""

Focus = Literal["near", "far"]
"""Depth in focus: the nearest or the farthest that the cube reaches during a rotation."""

EXTENT_SD = 5.0  # extent of a line's profile in sigmas: 6e-7 of its energy lies outside
MAX_PIECE_ANGLE = 0.1  # maximum change of arctan(blur / width) within a linear piece (rad): sigma is accurate to 0.13 %
MIN_LINE_WIDTH_PX = (
    1.6  # minimum line width in pixels; thinner lines flicker as they cross pixels (at 1.6 px by 5e-5 of their energy)
)
WIDTH = 2 * math.sqrt(2 * math.log(2))  # full width at half maximum / standard deviation of a Gaussian

BANDS_PER_THREAD = 8
"""Bands of rows per thread, to balance the load of rows without lines."""


def wireframe(
    lines: ArrayLike,
    blur: ArrayLike,
    shape: tuple[int, int],
    *,
    width: float,
    brightness: float = 1.0,
) -> NDArray[np.float32]:
    """Draw blurred lines on black; where they cross, their radiance adds.

    Parameters
    ----------
    lines
        Start and end of each line, n x 2 x 2 (x, y), in pixels; (0, 0) is the centre of the first pixel. Lines may
        extend beyond the frame.
    blur
        Standard deviation of the blur at start and end, n x 2, in pixels, linear in between; a change of sign along a
        line marks a crossing of the plane of focus.
    shape
        Height and width of the picture in pixels.
    width
        Standard deviation of a line's own profile in pixels; below 0.7, aliasing makes lines uneven.
    brightness
        Energy of a line per pixel of its length: regardless of blur, each line contributes brightness x length.

    Returns
    -------
    ndarray
        Linear radiance at the pixel centres, H x W, 32-bit.

    Raises
    ------
    InputError
        If an array's shape or a value is invalid.

    Examples
    --------
    >>> picture = wireframe([[[20, 32], [44, 32]]], [[1, 3]], (64, 64), width=1)
    >>> round(float(picture.sum()), 3)
    24.0
    """
    lines, blur = (np.ascontiguousarray(array, dtype=float) for array in (lines, blur))
    if lines.ndim != 3 or lines.shape[1:] != (2, 2) or blur.shape != lines.shape[:2]:
        raise InputError(
            f"lines and blur are {lines.shape} and {blur.shape}, but must be n x 2 x 2 and n x 2, for both ends."
        )
    if not (np.isfinite(lines).all() and np.isfinite(blur).all()):
        raise InputError(
            "lines or blur contain values that are not finite, but must be positions and blurs in pixels: correct them."
        )
    check_shape(shape)
    for name, value in (("width", width), ("brightness", brightness)):
        check_number(name, value, "pixels", positive=True)
    image = np.zeros(shape, np.float32)
    share_rows(len(image), partial(_draw, lines, blur, width, brightness, image), each=BANDS_PER_THREAD)
    return image


def blur_at(
    necker: NeckerCube, depth: ArrayLike, *, aperture: float, focus: Focus | float = "near", k: float = DISC_K
) -> FloatArray:
    """Return the signed blur of the cube's points at `depth` z (m, any shape): sd in radians, positive beyond focus.

    sigma = `k` x magnification x (aperture / 2) (V_f - 1/z): the blur disc of a thin lens, magnified with the picture.

    Parameters
    ----------
    necker
        The cube.
    depth
        Distance in metres from the centre of projection.
    aperture
        Diameter in metres of the lens or pupil.
    focus
        ``"near"`` or ``"far"``: the smallest or largest depth during a rotation; or a vergence in dioptres.
    k
        Standard deviation of the blur / radius of the blur disc.

    Raises
    ------
    InputError
        If `aperture`, `focus` or `k` is invalid.

    Examples
    --------
    A cube at its natural size, seen through a 4 mm pupil: 2 mm x 0.5 x 1.505 D of blur across its depth.

    >>> cube = NeckerCube(size=0.4, perspective=0.4)
    >>> blur_at(cube, [cube.nearest, cube.farthest], aperture=0.004).round(6).tolist()
    [0.0, 0.001505]
    """
    for name, value, unit in (("aperture", aperture, "metres"), ("k", k, "disc radii")):
        check_number(name, value, unit, least=0)
    if focus in ("near", "far"):
        vergence = 1 / (necker.nearest if focus == "near" else necker.farthest)
    elif isinstance(focus, (int, float)) and math.isfinite(focus):
        vergence = focus
    else:
        raise InputError(f"focus is {focus!r}, but must be 'near', 'far' or a vergence in dioptres.")
    return k * necker.magnification * (aperture / 2) * (vergence - 1 / np.asarray(depth, dtype=float))


class Drawn(TypedDict):
    """How frames are drawn: keywords of `necker_frame`, with its defaults."""

    shape: tuple[int, int]
    pixel_angle: float
    gradient: NotRequired[Gradient]
    aperture: NotRequired[float]
    focus: NotRequired[Focus | float]
    k: NotRequired[float]


@checked
def necker_frame(
    necker: NeckerCube,
    turn: Annotated[float, Range("turns")],
    *,
    shape: tuple[int, int],
    pixel_angle: Annotated[float, Range("radians", positive=True)],
    gradient: Gradient = "none",
    aperture: float = 0.004,
    focus: Focus | float = "near",
    k: float = DISC_K,
) -> NDArray[np.float32]:
    """Draw one frame of the rotating cube, its lines blurred by the depth of one of its two interpretations.

        The positions of the lines are the same under every gradient, and so is the energy of each.

    Parameters
    ----------
    necker
        The cube.
    turn
        Rotation angle in turns.
    shape
        Height and width in pixels; the optical axis is at the centre of the picture.
    pixel_angle
        Angle in radians subtended by a pixel of the picture.
    gradient
        ``"none"``: all lines sharp. ``"rigid"``: blurred by true depth. ``"nonrigid"``: blurred by the depth in the
        depth-reversed shape.
    aperture, focus, k
        As in `blur_at`; with focus ``"near"``, lines near in that interpretation are sharp, and far lines blurred.

    Returns
    -------
    ndarray
        Linear radiance on black, H x W, 32-bit. Radiance adds where lines cross; 1 is the peak of an isolated sharp
        line many pixels wide. Pixels average over their square (to the second moment).

    Raises
    ------
    InputError
        If a setting is out of range, or the lines are too thin for the pixels.

    Examples
    --------
    >>> picture = necker_frame(NeckerCube(), 0.1, shape=(320, 320), pixel_angle=5e-4, gradient="rigid")
    >>> picture.dtype, picture.shape
    (dtype('float32'), (320, 320))
    """
    check_shape(shape)
    if necker.line_width < MIN_LINE_WIDTH_PX * pixel_angle:
        raise InputError(
            f"line_width is {necker.line_width / pixel_angle:.3g} pixels, but lines thinner than {MIN_LINE_WIDTH_PX:g} "
            "flicker as they move: draw wider lines or use smaller pixels."
        )
    blur = np.zeros(EDGES.shape)
    if gradient != "none":
        depth = necker.seen(turn, gradient)[EDGES, 2]
        blur = blur_at(necker, depth, aperture=aperture, focus=focus, k=k) / pixel_angle
    return draw_edges(necker, necker.vertices(turn), EDGES, blur, shape, pixel_angle)


def draw_edges(
    necker: NeckerCube,
    vertices: FloatArray,
    edges: NDArray[np.int_],
    blur: FloatArray,
    shape: tuple[int, int],
    pixel_angle: float,
) -> NDArray[np.float32]:
    """Return the radiance of edges between `vertices` (m), with the line width of a cube and the blur of their ends."""
    lines = necker.project(vertices)[edges] / pixel_angle + (np.array(shape[::-1]) - 1) / 2
    line = necker.line_width / WIDTH / pixel_angle
    width = math.sqrt(line**2 + PIXEL_VARIANCE)
    return wireframe(lines, blur, shape, width=width, brightness=math.sqrt(2 * math.pi) * line)


def necker_loop(necker: NeckerCube, frames: int, **drawn: Unpack[Drawn]) -> Iterator[NDArray[np.float32]]:
    """Yield the frames of a quarter rotation, evenly spaced; repeated, they form a seamless rotation.

        `NeckerCube.loop_frames` gives the number of `frames` for the cube's speed; other parameters are as in
        `necker_frame`.

    >>> loop = necker_loop(NeckerCube(), 120, shape=(320, 320), pixel_angle=5e-4, gradient="nonrigid")
    >>> next(loop).shape
    (320, 320)
    """
    Whole(3, remedy="see NeckerCube.loop_frames").check("frames", frames)
    for frame in range(frames):
        yield necker_frame(necker, SYMMETRY * frame / frames, **drawn)


@inlined
def line_light(along, across, length, first, last):  # type: ignore[no-untyped-def]
    """Return the radiance at one point of a line that emits unit energy per unit length.

    Parameters
    ----------
    along, across
        Coordinates of the point relative to the line's start, along the line and perpendicular to it.
    length
        Length of the line; any unit, the same for all.
    first, last
        Standard deviation of the blur at the line's start and end (linear in between), positive.

    Examples
    --------
    In the middle of a long line with constant blur: the peak of a Gaussian, 1 / (sqrt(2 pi) sigma).

    >>> round(line_light(50.0, 0.0, 100.0, 2.0, 2.0), 6)
    0.199471
    """
    b = (last - first) / length
    foot = first + b * along  # sigma at the foot of the perpendicular, and Q along the line
    q2 = foot * foot + b * b * across * across
    # The difference of the two erf's arguments is exactly length |Q| / sqrt(2) first last.
    q = math.sqrt(q2)
    gap = length * q / (math.sqrt(2.0) * first * last)
    if gap < 3e-5:
        # The erfs would cancel, and be undefined at |Q| = 0: use the midpoint rule instead.
        s = length * first / (first + last)
        sigma = first + b * s
        square = (along - s) ** 2 + across * across
        return length * math.exp(-square / (2 * sigma * sigma)) / (2 * math.pi * first * last)
    start = (along * foot + b * across * across) / (math.sqrt(2.0) * first * q)
    fall = math.exp(-across * across / (2 * q2))
    return fall * (math.erf(start) - math.erf(start - gap)) / (2 * math.sqrt(2 * math.pi) * q)


@compiled
def _draw(lines, blur, width, brightness, image, first, last):  # type: ignore[no-untyped-def]
    """Add the lines to the rows `first` to `last`."""
    for line in range(lines.shape[0]):
        x0, y0, x1, y1 = lines[line, 0, 0], lines[line, 0, 1], lines[line, 1, 0], lines[line, 1, 1]
        length = math.hypot(x1 - x0, y1 - y0)
        if length < 1e-9:
            continue
        dx, dy = (x1 - x0) / length, (y1 - y0) / length
        begin, end = math.atan(blur[line, 0] / width), math.atan(blur[line, 1] / width)
        pieces = max(1, math.ceil(abs(end - begin) / MAX_PIECE_ANGLE))
        s, sigma = 0.0, width / math.cos(begin)
        for piece in range(1, pieces + 1):
            start, sigma_start = s, sigma
            angle = begin + (end - begin) * piece / pieces
            sigma = width / math.cos(angle)
            s = length
            if piece < pieces:
                s *= (width * math.tan(angle) - blur[line, 0]) / (blur[line, 1] - blur[line, 0])
            if s > start:
                _draw_piece(
                    *(x0 + start * dx, y0 + start * dy, dx, dy, s - start, sigma_start, sigma),
                    *(brightness, image, first, last),
                )


@compiled
def _draw_piece(x0, y0, dx, dy, length, sigma0, sigma1, brightness, image, first, last):  # type: ignore[no-untyped-def]
    """Add one piece to the pixels within reach of its blur."""
    width = image.shape[1]
    reach = EXTENT_SD * max(sigma0, sigma1)
    top, low = min(y0, y0 + length * dy) - reach, max(y0, y0 + length * dy) + reach
    for row in range(max(first, math.ceil(top)), min(last, math.floor(low) + 1)):
        y = row - y0
        # Columns whose position is within reach across the line, and within reach of its ends along the line.
        left, right = -x0, width - 1 - x0
        if abs(dy) > 1e-12:
            a, b = (y * dx - reach) / dy, (y * dx + reach) / dy
            left, right = max(left, min(a, b)), min(right, max(a, b))
        elif abs(y) > reach:
            right = left - 1
        if abs(dx) > 1e-12:
            a, b = (-reach - y * dy) / dx, (length + reach - y * dy) / dx
            left, right = max(left, min(a, b)), min(right, max(a, b))
        for column in range(math.ceil(left + x0), math.floor(right + x0) + 1):
            x = column - x0
            image[row, column] += brightness * line_light(x * dx + y * dy, x * dy - y * dx, length, sigma0, sigma1)
