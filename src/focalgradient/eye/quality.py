"""Image quality of an eye through focus: modulation transfer and visual Strehl ratio.

The visual Strehl ratio is the real part of the optical transfer function weighted by contrast sensitivity, relative to
that of a clear pupil in focus in one light (VSOTF; Thibos, Hong, Bradley & Applegate 2004, "Accuracy and precision of
objective refraction from wavefront aberrations", J. Vis. 4, 329).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_finite, checked
from focalgradient.eye.chromatic import REFERENCE_NM
from focalgradient.eye.cones import HIGHEST_CPD, Cones
from focalgradient.eye.diffraction import optical_transfer
from focalgradient.eye.ranges import check_kind
from focalgradient.quantities import Range, Values

__all__ = ["ThroughFocus", "contrast_sensitivity", "image_quality", "point_images"]


RADII, ANGLES = 40, 24
"""Number of frequencies along a radius and of directions over half a circle (of isotropic blur one suffices) in the sum
of the visual Strehl ratio: twice as many change it by less than 1e-6, and the modulation by 2e-3 (1.25 D of
astigmatism, whose contrast reverses in some directions before others: the mean modulation has corners there)."""


SPAN, STEP = 2.0, 0.05
"""Range in dioptres beyond the foci of the eye and of its lens's zones, and step of the vergences."""

SHARE = 0.8
"""Share of the greatest visual Strehl ratio that what is in focus has."""

PIXEL_ANGLE = math.radians(0.2 / 60)
"""Visual angle in radians of a pixel of a point's image: frequencies up to 150 cycles per degree, near the cut-off of a
pupil of 5 mm."""


def contrast_sensitivity(frequency_cpd: ArrayLike) -> FloatArray:
    """Return contrast sensitivity at each frequency (cycles per degree): 75 f^0.8 exp(-0.2 f).

    The double exponential of Movshon & Kiorpes (1988) with the numbers that are usual for people by day (these from
    memory). It only weights frequencies, so that its height does not matter.

    >>> contrast_sensitivity([1, 4, 20]).round(1).tolist()
    [61.4, 102.2, 15.1]
    """
    f = check_finite("frequency_cpd", frequency_cpd, "cycles per degree")
    return np.asarray(75 * np.abs(f) ** 0.8 * np.exp(-0.2 * np.abs(f)))


@dataclass(frozen=True, slots=True, eq=False)
class ThroughFocus:
    """Image quality of points at each of L `vergences` (D).

    ``mtf`` is the mean over all directions of the modulation at each of F ``frequency_cpd``, L x F; ``visual_strehl``
    the visual Strehl ratio.
    """

    vergences: FloatArray
    frequency_cpd: FloatArray
    mtf: FloatArray
    visual_strehl: FloatArray

    @property
    def best(self) -> float:
        """Vergence in dioptres at which the visual Strehl ratio is greatest."""
        return float(self.vergences[int(np.argmax(self.visual_strehl))])

    @checked
    def depth_of_focus(self, share: Annotated[float, Range("shares", 1e-9, 1 - 1e-9)] = SHARE) -> float:
        """Return the total range (D) in which the visual Strehl ratio is at least this `share` of its maximum.

        It counts `vergences` only: where it is cut off at an end of them (`is_cut_off`), it is a lower bound.
        """
        _, kept = self._in_focus(share)
        return float(np.mean(kept) * np.ptp(self.vergences))

    @checked
    def ranges_of_focus(
        self, share: Annotated[float, Range("shares", 1e-9, 1 - 1e-9)] = SHARE
    ) -> list[tuple[float, float]]:
        """Return the ends (D) of each separate range that `depth_of_focus` adds up, in ascending order.

        Two foci of an eye, as of astigmatism, can have separate ranges; the eye's own focus can be between them.
        """
        fine, kept = self._in_focus(share)
        steps = np.flatnonzero(np.diff(kept, prepend=False, append=False)).reshape(-1, 2)
        return [(float(fine[start]), float(fine[end - 1])) for start, end in steps]

    def _in_focus(self, share: float) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return interpolated vergences, and whether the visual Strehl ratio is at least the `share` at each."""
        fine = np.linspace(self.vergences[0], self.vergences[-1], 2001)
        return fine, np.interp(fine, self.vergences, self.visual_strehl) >= share * self.visual_strehl.max()

    def is_cut_off(self, share: float = SHARE) -> bool:
        """Return whether the range of `depth_of_focus` reaches an end of `vergences`, and may continue beyond it."""
        ends = max(self.visual_strehl[0], self.visual_strehl[-1])
        return bool(ends >= share * self.visual_strehl.max())

    def summary(self) -> dict[str, float | bool]:
        """Return the best vergence, the visual Strehl ratio there, and the `depth_of_focus`.

        >>> found = ThroughFocus(np.arange(3.0), np.empty(0), np.empty((3, 0)), np.array([0.1, 0.8, 0.1]))
        >>> {name: round(value, 2) for name, value in found.summary().items()}
        {'best_D': 1.0, 'visual_strehl': 0.8, 'depth_of_focus_D': 0.46, 'depth_of_focus_is_cut_off': 0}
        """
        return {
            "best_D": self.best,
            "visual_strehl": float(self.visual_strehl.max()),
            "depth_of_focus_D": self.depth_of_focus(),
            "depth_of_focus_is_cut_off": self.is_cut_off(),
        }

    def to_csv(self) -> str:
        """Return a CSV table with one row for each vergence."""
        head = ["vergence_D", "visual_strehl", *(f"mtf_{f:g}_cpd" for f in self.frequency_cpd)]
        values = np.column_stack([self.visual_strehl, self.mtf])
        rows = [
            ",".join([f"{vergence:.2f}", *(f"{value:.4f}" for value in row)])
            for vergence, row in zip(self.vergences, values, strict=True)
        ]
        return "\n".join([",".join(head), *rows, ""])


def image_quality(
    cones: Cones, vergences: ArrayLike | None = None, frequency_cpd: ArrayLike = (4.0, 8.0, 16.0)
) -> ThroughFocus:
    """Compute the image quality of points at each of `vergences` (D), as seen by `cones`.

    Parameters
    ----------
    cones
        An eye in the light of a band; "luminance" for what people see of white.
    vergences
        L values, in order; None: every 0.05 D, to 2 D beyond the focus of the eye and of each zone of its lens.
    frequency_cpd
        F frequencies in cycles per degree at which the modulation is given.

    Raises
    ------
    InputError
        If vergences are not two or more numbers in order.

    Examples
    --------
    >>> from focalgradient.eye.model_eye import Eye
    >>> cones = Cones(Eye(0.004, 1.0), "luminance", (580.0,))
    >>> found = image_quality(cones, np.arange(0, 2.01, 0.25))
    >>> found.best, found.visual_strehl[4].round(2).item(), found.mtf[4].round(2).tolist()
    (1.0, 1.0, [0.96, 0.92, 0.83])
    """
    check_kind("cones", cones, Cones, 'give Cones.of(eye, "luminance")')
    if vergences is None:
        low, high = _additions(cones)
        ends = round((low - SPAN) / STEP), round((high + SPAN) / STEP)
        vergences = round(cones.focus_vergence / STEP) * STEP + STEP * np.arange(ends[0], ends[1] + 1)
    levels = check_finite("vergences", vergences, "dioptres")
    if levels.ndim != 1 or levels.size < 2 or np.any(np.diff(levels) <= 0):
        raise InputError("vergences must be two or more numbers, each above the one before: sort them.")
    shown = np.atleast_1d(Values("cycles per degree", 0).of("frequency_cpd", frequency_cpd))
    nodes, weights = np.polynomial.legendre.leggauss(RADII)
    radius, width = HIGHEST_CPD / 2 * (nodes + 1), HIGHEST_CPD / 2 * weights
    directions = 1 if cones.isotropic else ANGLES
    turn = np.pi * (np.arange(directions) + 0.5) / directions
    every = np.degrees(np.concatenate([shown, radius]))
    seen = cones.through_focus(every * np.sin(turn)[:, None], every * np.cos(turn)[:, None], levels)
    weight = contrast_sensitivity(radius) * radius * width
    clear = optical_transfer(radius, pupil_diameter=cones.aperture_diameter, wavelength_nm=REFERENCE_NM, defocus=0.0)
    real = seen[:, :, shown.size :].real.mean(axis=1)
    strehl = real @ weight / float(np.asarray(clear).real @ weight)
    return ThroughFocus(levels, shown, np.abs(seen[:, :, : shown.size]).mean(axis=1), np.asarray(strehl))


def point_images(
    cones: Cones, vergence: float, *, side: int = 160, pixel_angle: float = PIXEL_ANGLE
) -> dict[float, FloatArray]:
    """Return five images of a point about a `vergence` (D), by their distance from it in dioptres, positive nearer.

    They lie 0.5 D apart or, through a lens with zones of different power, over its additions.

    Parameters
    ----------
    cones
        Optics of the images.
    vergence
        Vergence of the best focus in dioptres.
    side, pixel_angle
        Pixels across an image, and the visual angle in radians of one.

    Returns
    -------
    dict
        Images of side x side pixels; all light of a point has a sum of 1.

    Examples
    --------
    >>> from focalgradient.eye.model_eye import Eye
    >>> images = point_images(Cones(Eye(0.003, 1.0), "luminance", (580.0,)), 1.0)
    >>> [*images], images[0.0].shape, round(float(images[0.0].sum()), 2)
    ([-1.0, -0.5, 0.0, 0.5, 1.0], (160, 160), 0.99)
    """
    low, high = _additions(cones)
    spacing = np.linspace(low, high, 5) if low < high else np.linspace(-1, 1, 5)
    whole = 2 * side  # light beyond the picture's border must not wrap around
    down, right = np.fft.fftfreq(whole, pixel_angle)[:, None], np.fft.rfftfreq(whole, pixel_angle)[None]
    inner = slice((whole - side) // 2, (whole + side) // 2)
    images = {}
    for change in spacing.round(2).tolist():
        seen = cones.optical_transfer(down, right, vergence + change)
        images[change] = np.fft.fftshift(np.fft.irfft2(seen, (whole, whole)))[inner, inner]
    return images


def _additions(cones: Cones) -> tuple[float, float]:
    """Return the lowest and the highest addition (D) of the eye's lens and of the eye itself."""
    lens = getattr(cones.eye, "lens", None)
    foci = (0.0, *(() if lens is None else lens.additions))
    return min(foci), max(foci)
