"""Registered views: brought onto one pixel grid (magnification, rotation, shift) and to one exposure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import fft, ndimage

from focalgradient.arrays import FloatArray, Mask
from focalgradient.depth.filters import Image, Spectra, mean_in_squares
from focalgradient.depth.numerics import block_sum
from focalgradient.errors import InputError
from focalgradient.optics import Lens, capabilities
from focalgradient.parallel import share_rows
from focalgradient.view import View

__all__ = [
    "Placement",
    "RegisteredViews",
    "at_ceiling",
    "filled",
    "measure_placement",
    "misstated_magnification",
    "resample",
    "shrunk",
]

SHIFT_WARNING = 0.25
"""Displacement between views in pixels above which a warning is issued. Chosen by hand."""

SCALE_ALIKE, FEET_ALIKE = 0.3, 0.05
"""Maximum relative difference between the remaining scale and that of reversed foci for the order to be named as
reversed (chosen by hand); and the same for foci in feet, whose scale is measured to 0.01 where it is named."""

FOOT_M = 0.3048
"""Length of a foot in m."""

CLEARLY_LESS = 0.9
"""Residual at the shift of highest correlation, relative to that without a shift, below which views are displaced: 0.02
to 0.5 for displaced natural texture, 0.96 and more for stripes and checks in place."""

SMOOTHING_REACH = 5
"""Distance in pixels over which unusable pixels affect the smoothed images, whose Gaussian has an sd of 1.5: 3.3 sd."""

ENOUGH = 0.25
"""Minimum proportion of the frame unaffected by unusable pixels for views to be compared there alone (our choice)."""

LEAST_MASKED = 0.05
"""Maximum proportion of masked pixels in a resampled pixel that is still usable. Chosen by hand."""

DEFECT_SIDE, DEFECT, PLAIN = 5, 12.0, 2.0
"""Side in pixels of the surroundings of a pixel; difference from their mean, in their standard deviations, above which
it is defective (random dots on a tenth of the pixels reach 3.3); and standard deviation of surroundings, in that of
noise, up to which they are plain. Chosen by hand."""

LEAST_USABLE = 0.05
"""Minimum proportion of the frame that must be usable in all views. Chosen by hand."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Where a view's pixels lie: pixel p of the reference is found in the view at c + scale R (p - c) + shift.

    R is a rotation by `turn` in radians, clockwise as one sees it; `down` and `right` are the shift in pixels; c is the
    middle of the frame.
    """

    scale: float = 1.0
    down: float = 0.0
    right: float = 0.0
    turn: float = 0.0

    def of(self, down: float, right: float) -> tuple[float, float]:
        """Position, from the view's middle, of the pixel at (`down`, `right`) from the middle of the reference."""
        cos, sin = self.scale * math.cos(self.turn), self.scale * math.sin(self.turn)
        return cos * down + sin * right + self.down, cos * right - sin * down + self.right

    def displacement(self, shape: tuple[int, int]) -> float:
        """Return the largest displacement of a pixel of a frame of `shape`, in pixels.

        >>> round(Placement(1.001, 0.3, 0.4).displacement((600, 800)), 3)
        1.0
        """
        corners = [(side * shape[0] / 2, shape[1] / 2) for side in (-1, 1)]
        corners += [(-down, -right) for down, right in corners]
        return max(math.dist(self.of(*corner), corner) for corner in corners)

    def then(self, other: Placement) -> Placement:
        """Return the placement of a view whose image, once resampled by `self`, is still displaced by `other`."""
        down, right = self.of(other.down, other.right)
        return Placement(self.scale * other.scale, down, right, self.turn + other.turn)


def resample(image: Image, placement: Placement) -> tuple[Image, Mask]:
    """Resample the view on the reference's grid; also return the pixels that the view covers, both H x W.

    Interpolates with a Lanczos kernel of 8 pixels: along rows and columns in turn, as scale and shift are separable;
    a rotation is made of two passes along lines that are each shifted on their own (Catmull & Smith 1980).
    """
    if placement == Placement():
        return image, np.ones(image.shape, np.bool_)
    height, width = image.shape
    row, column = np.arange(height) - (height - 1) / 2, np.arange(width) - (width - 1) / 2
    down, right = placement.of(*np.ix_(row, column))
    covered = (np.abs(down) <= height / 2) & (np.abs(right) <= width / 2)
    # At the row `y` of the view, the reference's column x is found at right = a x + b y + c.
    cos, tan = math.cos(placement.turn), math.tan(placement.turn)
    first = placement.right + tan * (placement.down - row)
    along = _along_lines(np.asarray(image, np.float32), placement.scale / cos, first + (width - 1) / 2)
    second = placement.down + placement.scale * math.sin(placement.turn) * column
    across = _along_lines(np.ascontiguousarray(along.T), placement.scale * cos, second + (height - 1) / 2)
    return np.ascontiguousarray(across.T), covered


FRACTIONS = 1024
"""Number of places between two pixels for which the kernel is tabulated; linear between them, it errs by 1e-6."""


def _along_lines(lines: Image, scale: float, middle: FloatArray) -> Image:
    """Each of `lines` (N x count) resampled at `scale` times its own pixels, the middle one's at its `middle`."""
    stretch = max(1.0, scale)  # where pixels are skipped, average over them
    reach = math.ceil(8 * stretch)
    distance = (np.arange(1 - reach, reach + 1) - np.arange(FRACTIONS + 1)[:, None] / FRACTIONS) / stretch
    kernel = np.sinc(distance) * np.sinc(distance / 8) * (np.abs(distance) < 8)
    kernel = (kernel / kernel.sum(axis=1, keepdims=True)).astype(np.float32)
    resampled = np.empty_like(lines)
    share_rows(len(lines), lambda first, last: _resample_lines(lines, kernel, scale, middle, first, last, resampled))
    return resampled


@njit(nogil=True, cache=True, fastmath={"contract", "reassoc"})
def _resample_lines(lines, kernel, scale, middle, first, last, resampled):  # type: ignore[no-untyped-def]
    count, taps = lines.shape[1], kernel.shape[1]
    for line in range(first, last):
        for x in range(count):
            place = middle[line] + scale * (x - (count - 1) / 2)
            base = int(np.floor(place))
            at = (place - base) * FRACTIONS
            before = min(int(at), FRACTIONS - 1)
            part = np.float32(at - before)
            start = base + 1 - taps // 2
            is_inside = start >= 0 and start + taps <= count
            value = np.float32(0)
            for tap in range(taps):
                weight = kernel[before, tap] + part * (kernel[before + 1, tap] - kernel[before, tap])
                if is_inside:
                    value += weight * lines[line, start + tap]
                else:  # beyond the frame its mirror image continues it
                    mirrored = (start + tap + count) % (2 * count) - count
                    value += weight * lines[line, mirrored if mirrored >= 0 else -1 - mirrored]
            resampled[line, x] = value


def measure_placement(
    reference: Image, image: Image, usable: Mask | None = None, *, steps: int = 12
) -> tuple[Placement, float]:
    """Measure the shift, turn and scale of `image` against `reference` (both H x W).

    Least squares on smoothed images, to a few hundredths of a pixel, robust to regions that differ. A difference in
    blur, which is symmetric, leaves these unbiased; clipped light does not: pixels that are not `usable` (H x W), and
    those beside, are not compared. Also returns the sd (pixels) of the largest displacement.
    """
    factor = max(2, min(reference.shape) // 120)
    small = [shrunk(np.asarray(picture, np.float32), factor) for picture in (reference, image)]
    smooth = [ndimage.gaussian_filter(picture, 1.5) for picture in small]
    height, width = smooth[0].shape
    margin = min(4, height // 8, width // 8)
    frame = np.zeros((height, width), np.bool_)
    frame[margin : height - margin, margin : width - margin] = True
    if usable is not None and not usable.all():
        whole = shrunk(usable.astype(np.float32), factor) > 1 - 1e-3
        clear = frame & ndimage.minimum_filter(whole, 2 * SMOOTHING_REACH + 1)
        frame = clear if clear.mean() > ENOUGH else frame
    # Texture that repeats itself fits at many shifts.
    placement, shifted = Placement(), _coarse_shift(*smooth)
    first, other = (_placement_step(smooth[0], smooth[1], place, frame) for place in (placement, shifted))
    if other[2] < CLEARLY_LESS * first[2]:
        placement, first = shifted, other
    for number in range(steps):
        step, variance, _ = _placement_step(smooth[0], smooth[1], placement, frame) if number else first
        placement = placement.then(step)
        if step.displacement((height, width)) < 0.002 or not 0.5 < placement.scale < 2:
            break
    error = factor * float(np.sqrt(variance @ [(height**2 + width**2) / 4, 1, 1, (height**2 + width**2) / 4]))
    return replace(placement, down=factor * placement.down, right=factor * placement.right), error


def _placement_step(
    reference: Image, image: Image, placement: Placement, frame: Mask
) -> tuple[Placement, FloatArray, float]:
    """Estimate a placement's remaining error by least squares, and the variances of scale, shifts and rotation.

    Also returns the median absolute residual.
    """
    height, width = reference.shape
    down, right = np.ogrid[-(height - 1) / 2 : height / 2, -(width - 1) / 2 : width / 2]
    moved_image, covered = resample(image, placement)
    used = frame & covered
    # The blurrier image is the sharper one, blurred somehow, brightened somehow, and displaced.
    sharp, blurred, sign = reference, moved_image, -1
    if np.var(np.diff(moved_image)) > np.var(np.diff(reference)):
        sharp, blurred, sign = moved_image, reference, 1
    slope_down, slope_right = np.gradient(blurred)
    turned = right * slope_down - down * slope_right
    moved = np.stack([down * slope_down + right * slope_right, slope_down, slope_right, turned])[:, used]
    versions = np.stack([sharp, *(ndimage.gaussian_filter(sharp, sd) for sd in (1.5, 3.0, 6.0))])[:, used]
    columns = np.concatenate([moved, versions, np.ones_like(moved[:1])]).astype(float)
    target = blurred[used].astype(float)
    weight = np.ones_like(target)
    for _ in range(3):
        weighted = columns * weight
        fit = np.linalg.lstsq(weighted @ weighted.T, weighted @ (weight * target), rcond=None)[0]
        rest = np.abs(target - fit @ columns)
        weight = 1 / (1 + (rest / (2 * np.median(rest) + 1e-12)) ** 2)
    # A difference in blur leaves residuals alike over many pixels: blocks of the frame, not pixels, are independent.
    cells = (8 * np.arange(height) // height)[:, None] * 8 + 8 * np.arange(width) // width
    score = columns * (weight**2 * (target - fit @ columns))
    by_cell = np.stack([np.bincount(cells[used], row, 64) for row in score])
    inverse = np.linalg.pinv(weighted @ weighted.T)
    variance = np.diag(inverse @ (by_cell @ by_cell.T) @ inverse)[:4]
    return Placement(1 + sign * fit[0], *(sign * fit[1:4]).tolist()), variance, float(np.median(rest))


def shrunk(image: Image, factor: int) -> Image:
    """Average over squares of `factor` pixels, of the frame's middle where they do not fill it."""
    rows, columns = (n // factor for n in image.shape)
    top, left = ((n - m * factor) // 2 for n, m in zip(image.shape, (rows, columns), strict=True))
    part = image[top : top + rows * factor, left : left + columns * factor]
    return part.reshape(rows, factor, columns, factor).mean(axis=(1, 3))


def _coarse_shift(reference: Image, image: Image) -> Placement:
    """Whole-pixel shift by phase correlation of the images' middle frequencies."""
    height, width = reference.shape
    taper = np.outer(np.hanning(height), np.hanning(width))
    one, other = (fft.rfft2((picture - picture.mean()) * taper, workers=-1) for picture in (reference, image))
    frequency = np.hypot(fft.fftfreq(height)[:, None], fft.rfftfreq(width)[None])
    cross = np.conj(one) * other
    cross *= np.exp(-((frequency / 0.15) ** 2)) / (np.abs(cross) + 1e-9 * np.abs(cross).max())
    peak = fft.irfft2(cross, (height, width), workers=-1)
    down, right = np.unravel_index(np.argmax(peak), peak.shape)
    return Placement(
        1.0, float((down + height // 2) % height - height // 2), float((right + width // 2) % width - width // 2)
    )


@dataclass(frozen=True, slots=True)
class RegisteredViews:
    """Views on the first one's grid, at one exposure, with the mask of usable pixels."""

    images: list[Image]
    usable: Mask
    gains: list[float]
    placements: list[Placement]  # of each view beyond its pixel angle; removed only if the views were to be aligned
    warnings: tuple[str, ...] = ()
    shares: NDArray[np.floating] | None = None  # of each of the optics in an `optics.Mixture`, C x H x W
    start: tuple[int, int] = (0, 0)  # row and column of the first pixel in the whole frame
    whole: tuple[int, int] | None = None  # shape of the whole frame; None: it is this
    crops: dict[int, RegisteredViews] = field(init=False, default_factory=dict, compare=False, repr=False)
    kept: dict[int, Spectra] = field(init=False, default_factory=dict, compare=False, repr=False)
    """Crops already made by `most_textured_crop`, by side; and `spectra`, by reach."""

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width in pixels."""
        height, width = self.usable.shape
        return height, width

    @classmethod
    def of(cls, views: Sequence[View], align: bool) -> RegisteredViews:
        """Bring `views` to one magnification; measure what shift is left, and remove it if `align`."""
        first, shown = _image_and_mask(views[0])
        usable = shown
        images, placements = [first], [Placement()]
        warnings: list[str] = []
        for number, view in enumerate(views[1:], 2):
            image, mask = _image_and_mask(view)
            placement = Placement(views[0].pixel_angle / view.pixel_angle)
            moved, covered = resample(image, placement)
            shift, error = measure_placement(first, moved, shown & _shown(mask, placement))
            warnings += _placement_warnings(number, shift, error, views[0], view, align)
            if align:
                placement = placement.then(shift)
                moved, covered = resample(image, placement)
            usable = usable & covered & _shown(mask, placement)
            images.append(moved)
            placements.append(shift)
        if usable.mean() < LEAST_USABLE:
            raise InputError(
                "hardly a pixel is usable (unsaturated, not masked) in every view, but all views must show the same "
                "scene: check that the views belong together and are rightly exposed."
            )
        gains = [1.0, *(_gain(first, image, usable) for image in images[1:])]
        scaled = [first, *(image / np.float32(g) for image, g in zip(images[1:], gains[1:], strict=True))]
        mixture = capabilities(views[0].optics).mixture
        if mixture is not None and mixture.shares.shape[1:] != usable.shape:
            raise InputError(
                f"the blur is a mixture with shares of shape {mixture.shares.shape[1:]}, but the views have shape "
                f"{usable.shape}: give shares at the views' pixels."
            )
        shares = None if mixture is None else mixture.shares
        return cls(scaled, usable, gains, placements, tuple(warnings), shares)

    def most_textured_crop(self, side: int) -> RegisteredViews:
        """Return the part, at most `side` pixels in each direction, that shows most texture."""
        if side in self.crops:
            return self.crops[side]
        skip = max(1, min(self.shape) // 1024)  # a large frame need not be looked at pixel by pixel
        down, right = np.gradient(self.images[0][::skip, ::skip])
        steep = down**2 + right**2
        # Texture all over, not a few hard outlines.
        steep = np.minimum(steep, np.quantile(steep[::3, ::3], 0.75)) * self.usable[::skip, ::skip]
        textured = ndimage.uniform_filter(steep, [min(side // skip, n) for n in steep.shape], mode="constant")
        middle = [skip * int(place) for place in np.unravel_index(np.argmax(textured), textured.shape)]
        part = tuple(
            slice(start, start + side)
            for m, n in zip(middle, self.shape, strict=True)
            for start in [int(np.clip(m - side // 2, 0, max(0, n - side)))]
        )
        crop = self.crops[side] = self.part(part[0], part[1])
        return crop

    def spectra(self, reach: int) -> Spectra:
        """Return the views' spectra, with `reach` pixels of mirrored surround, and keep them: for crops."""
        if reach not in self.kept:
            self.kept[reach] = Spectra.of(self.images, reach)
        return self.kept[reach]

    def part(self, rows: slice, columns: slice) -> RegisteredViews:
        """Return these rows and columns of the views."""
        images = [np.ascontiguousarray(image[rows, columns]) for image in self.images]
        shares = None if self.shares is None else self.shares[:, rows, columns]
        start = self.start[0] + rows.start, self.start[1] + columns.start
        whole, usable = self.whole or self.shape, self.usable[rows, columns]
        return replace(self, images=images, usable=usable, shares=shares, warnings=(), start=start, whole=whole)


def _placement_warnings(
    number: int, shift: Placement, error: float, first: View, view: View, align: bool
) -> Iterator[str]:
    """Yield warnings for a view that is displaced, or magnified otherwise than by the optics stated.

    `shift` is the placement left once the magnification of the optics stated was removed; `error` its standard
    deviation in pixels, at the corner. Raise `InputError` if a view to align fits nowhere.
    """
    displacement = shift.displacement(view.shape)
    if not (0.8 < shift.scale < 1.25 and displacement < max(view.shape) / 3):
        trouble = f"view {number} does not seem to show what view 1 shows, wherever it is laid"
        if align:
            raise InputError(f"{trouble}, but views can be aligned only if they show one scene: check the files.")
        yield f"{trouble}: check that they show one scene."
        return
    if misstated := misstated_magnification(number, shift, first, view, error):
        text, shift = misstated
        displacement = shift.displacement(view.shape)
        yield f"{text}."
    if not align and displacement > max(SHIFT_WARNING, 3 * error):
        angle = math.degrees(shift.turn)
        turned = f"turned by {abs(angle):.2f} degrees {'counter' * (angle < 0)}clockwise and "
        yield (
            f"view {number} is {turned * (abs(shift.turn) * math.hypot(*view.shape) / 2 > SHIFT_WARNING)}displaced "
            f"against view 1 by up to {displacement:.2f} pixels ({shift.right:+.2f} right, {shift.down:+.2f} down, "
            f"scale {shift.scale:.5f}), which biases depth: align the views (align=True)."
        )


def misstated_magnification(
    number: int, shift: Placement, first: View, view: View, error: float = 0.0
) -> tuple[str, Placement] | None:
    """Return how the optics seem to misstate a magnification, and the shift without it; None if they do not."""
    left, corner = math.log(shift.scale), math.hypot(*view.shape) / 2
    for scale, tolerance, text in _other_scales(first, view, shift.scale):
        other = math.log(scale)
        if abs(other) * corner >= max(1.0, 6 * error) and abs(left / other - 1) <= tolerance:
            explained = replace(shift, scale=math.exp(left - other))
            return f"view {number} is magnified against view 1 {text}", explained
    return None


def _other_scales(first: View, view: View, left: float) -> Iterator[tuple[float, float, str]]:
    """Yield the scale that remains if the optics are misstated in a likely way, its relative tolerance, and the text.

    `left` is the scale that was measured. The sensor's distance sets the magnification of a lens that is not
    telecentric.
    """
    stated = first.pixel_angle / view.pixel_angle
    by = f"by {1 / (stated * left):.4f}, where its focus makes it {1 / stated:.4f}: the focus distances seem to be in"
    yield stated**-2, SCALE_ALIKE, f"{by} the opposite order (focus_distance)"
    yield stated ** (1 / FOOT_M - 1), FEET_ALIKE, f"{by} feet: give them in metres (focus_distance)"
    if not (isinstance(first.optics, Lens) and isinstance(view.optics, Lens)):
        return
    lens = view.optics.sensor_distance / first.optics.sensor_distance
    is_telecentric = abs(math.log(stated)) < abs(math.log(lens)) / 2
    seems, flag = ("not telecentric", "false") if is_telecentric else ("telecentric", "true")
    yield (
        (lens if is_telecentric else 1.0) / stated,
        SCALE_ALIKE,
        f"as by a lens that is {seems} on the image side, but the optics state otherwise, which changes the angle of a "
        f"pixel and all depths: check telecentric ({flag})",
    )


def _image_and_mask(view: View) -> tuple[Image, Mask]:
    """Return a view's image, defective pixels and those outside its mask filled, and the mask without the defective.

    Of a view without a mask, pixels at the image's ceiling are left out, where many share the highest value.
    """
    image = np.asarray(view.image, np.float32)
    mask = np.ones(image.shape, np.bool_) if view.mask is None else view.mask
    image = filled(image, mask)
    is_sound = ~_is_defective(image)
    shown = ~at_ceiling(image) if view.mask is None else mask
    return filled(image, is_sound), shown & is_sound


def _is_defective(image: Image) -> Mask:
    """Return the hot and dead pixels (H x W): lone ones far outside the texture around them.

    On a plain ground the same may be a point of the scene.

    >>> image = np.random.default_rng(0).standard_normal((64, 64)).astype(np.float32).cumsum(0).cumsum(1)
    >>> image[20, 30] += 500
    >>> np.argwhere(_is_defective(image)).tolist()
    [[20, 30]]
    """
    count = DEFECT_SIDE**2
    level = image - image.mean()
    mean, square = ((count * mean_in_squares(some, DEFECT_SIDE) - some) / (count - 1) for some in (level, level**2))
    sd = np.sqrt(np.maximum(square - mean**2, 0))
    noise = np.median(np.abs(np.diff(np.diff(image, 2, axis=0), 2, axis=1))) / 4  # of which 6 times 0.67 is the median
    return (np.abs(level - mean) > DEFECT * sd) & (sd > PLAIN * noise)


def _shown(mask: Mask, placement: Placement) -> Mask:
    """Return a view's `mask` on the reference's grid."""
    return mask if mask.all() else resample((~mask).astype(np.float32), placement)[0] < LEAST_MASKED


def filled(image: NDArray[np.floating], mask: Mask | None) -> Image:
    """Replace each pixel of `image` (H x W) outside `mask` by the nearest inside, for the filters.

    >>> filled(np.array([[1.0, np.nan, 3.0, 4.0]]), np.array([[True, False, True, True]])).tolist()
    [[1.0, 1.0, 3.0, 4.0]]
    """
    image = np.asarray(image, np.float32)
    if mask is None or mask.all():
        return image
    row, column = ndimage.distance_transform_edt(~mask, return_distances=False, return_indices=True)
    return np.asarray(image[row, column], np.float32)


def at_ceiling(image: Image) -> Mask:
    """Return the pixels at the image's highest value, where more share it than texture would make."""
    top = image == image.max()
    return top if top.sum() > max(16, 2e-4 * image.size) else np.zeros_like(top)


def _gain(reference: Image, image: Image, usable: Mask) -> float:
    """Return the exposure of `image` relative to `reference`: the ratio of light where it has its usual value.

    Blur moves light but keeps its sum. Places are never weighted by the brightness of one view: the brightest of the
    sharper view are darker in the other for their blur alone.
    """
    mask = usable.astype(np.float32)
    step = max(4, min(reference.shape) // 16)
    one, other = (block_sum(picture * mask, step).ravel() for picture in (reference, image))
    lit = one + other > 0.1 * (one + other).max()
    ratio = other[lit] / np.maximum(one[lit], np.finfo(np.float32).tiny)
    deviation = np.abs(ratio - np.median(ratio))
    alike = deviation <= 4 * np.median(deviation) + 1e-6
    gain = float(other[lit][alike].sum() / one[lit][alike].sum())
    if not gain > 0:
        raise InputError("one view is dark where another is bright, but views may differ by a positive gain only.")
    return gain
