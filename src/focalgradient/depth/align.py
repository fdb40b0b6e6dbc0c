"""Bringing views onto one pixel grid: magnification, and the shift that real cameras add."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, ndimage, sparse

__all__ = ["Placement", "measure_placement", "resample"]

Image = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Placement:
    """Where a view's pixels lie: pixel p of the reference is found in the view at centre + scale (p - centre) + shift.

    `down` and `right` are in pixels, the centre is the middle of the frame.
    """

    scale: float = 1.0
    down: float = 0.0
    right: float = 0.0

    def displacement(self, shape: tuple[int, int]) -> float:
        """The farthest that any pixel of a frame of `shape` is displaced, in pixels.

        >>> round(Placement(1.001, 0.3, 0.4).displacement((600, 800)), 3)
        1.0
        """
        height, width = shape
        stretch = abs(self.scale - 1) / 2
        return float(np.hypot(abs(self.down) + stretch * height, abs(self.right) + stretch * width))

    def then(self, other: Placement) -> Placement:
        """The placement of a view whose image, once placed by `self`, is still placed by `other`."""
        return Placement(
            self.scale * other.scale, self.down + self.scale * other.down, self.right + self.scale * other.right
        )


def resample(image: Image, placement: Placement) -> tuple[Image, NDArray[np.bool_]]:
    """The view on the reference's grid, and which of its pixels the view covers; both H x W.

    Interpolates with a Lanczos kernel of 8 pixels, which is separable as scale and shift are.
    """
    if placement == Placement():
        return image, np.ones(image.shape, np.bool_)
    height, width = image.shape
    down, rows = _interpolation(height, placement.scale, placement.down)
    across, columns = _interpolation(width, placement.scale, placement.right)
    placed = (across @ (down @ image).T).T
    return np.ascontiguousarray(placed, np.float32), rows[:, None] & columns


def _interpolation(count: int, scale: float, shift: float) -> tuple[sparse.csr_array, NDArray[np.bool_]]:
    """The matrix that resamples `count` pixels, and which results lie within them."""
    centre = (count - 1) / 2
    place = centre + scale * (np.arange(count) - centre) + shift
    stretch = max(1.0, scale)  # where pixels are skipped, average over them
    reach = int(np.ceil(8 * stretch))
    tap = np.floor(place).astype(int)[:, None] + np.arange(1 - reach, reach + 1)
    distance = (tap - place[:, None]) / stretch
    weight = np.sinc(distance) * np.sinc(distance / 8) * (np.abs(distance) < 8)
    weight /= weight.sum(axis=1, keepdims=True)
    # Beyond the frame its mirror image continues it.
    mirrored = np.abs((tap + count) % (2 * count) - count + 0.5) - 0.5
    row = np.broadcast_to(np.arange(count)[:, None], tap.shape)
    matrix = sparse.csr_array(
        (weight.ravel().astype(np.float32), (row.ravel(), np.rint(mirrored).astype(int).ravel())), (count, count)
    )
    return matrix, (place >= -0.5) & (place <= count - 0.5)


def measure_placement(reference: Image, image: Image, *, steps: int = 12) -> tuple[Placement, float]:
    """Where `image` lies against `reference` (both H x W): translation and scale, to a few hundredths of a pixel.

    Least squares on smoothed images, robust to regions that differ. Blur is symmetric: a difference in blur between
    the images leaves translation and scale unbiased. Also returns the standard deviation, in pixels, of the
    displacement that the placement makes at most.
    """
    factor = max(2, min(reference.shape) // 120)
    small = [_shrink(np.asarray(picture, np.float32), factor) for picture in (reference, image)]
    smooth = [ndimage.gaussian_filter(picture, 1.5) for picture in small]
    placement = _coarse_shift(*smooth)
    height, width = smooth[0].shape
    down, right = np.ogrid[-(height - 1) / 2 : height / 2, -(width - 1) / 2 : width / 2]
    margin = min(4, height // 8, width // 8)
    frame = np.zeros((height, width), np.bool_)
    frame[margin : height - margin, margin : width - margin] = True
    for _ in range(steps):
        placed, covered = resample(smooth[1], placement)
        used = frame & covered
        # The blurrier image is the sharper one, blurred somehow, brightened somehow, and displaced.
        sharp, blurred, sign = smooth[0], placed, -1
        if np.var(np.diff(placed)) > np.var(np.diff(smooth[0])):
            sharp, blurred, sign = placed, smooth[0], 1
        slope_down, slope_right = np.gradient(blurred)
        moved = np.stack([down * slope_down + right * slope_right, slope_down, slope_right])[:, used]
        spread = np.stack([sharp, *(ndimage.gaussian_filter(sharp, sd) for sd in (1.5, 3.0, 6.0))])[:, used]
        columns = np.concatenate([moved, spread, np.ones_like(moved[:1])]).astype(float)
        target = blurred[used].astype(float)
        weight = np.ones_like(target)
        for _ in range(3):
            weighted = columns * weight
            fit = np.linalg.lstsq(weighted @ weighted.T, weighted @ (weight * target), rcond=None)[0]
            rest = np.abs(target - fit @ columns)
            weight = 1 / (1 + (rest / (2 * np.median(rest) + 1e-12)) ** 2)
        step = Placement(1 + sign * fit[0], sign * fit[1], sign * fit[2])
        placement = placement.then(step)
        if step.displacement((height, width)) < 0.002 or not 0.5 < placement.scale < 2:
            break
    # A difference in blur leaves residuals alike over many pixels: blocks of the frame, not pixels, are independent.
    cells = (8 * np.arange(height) // height)[:, None] * 8 + 8 * np.arange(width) // width
    score = columns * (weight**2 * (target - fit @ columns))
    by_cell = np.stack([np.bincount(cells[used], row, 64) for row in score])
    inverse = np.linalg.pinv(weighted @ weighted.T)
    variance = np.diag(inverse @ (by_cell @ by_cell.T) @ inverse)[:3]
    error = factor * float(np.sqrt(variance @ [(height**2 + width**2) / 4, 1, 1]))
    return Placement(placement.scale, factor * placement.down, factor * placement.right), error


def _shrink(image: Image, factor: int) -> Image:
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
        1.0,
        float((down + height // 2) % height - height // 2),
        float((right + width // 2) % width - width // 2),
    )
