"""Fit of a Gaussian to an eye's point spread: a test of "the general shape of a Gaussian" (Pentland 1987, appendix)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, checked
from focalgradient.eye.light import Light
from focalgradient.eye.quadrature import panels
from focalgradient.eye.ranges import AnyOptics, Vergence
from focalgradient.eye.transfer import blur_transfer, in_light
from focalgradient.optics import capabilities
from focalgradient.psf import gaussian_transfer

__all__ = ["GaussianFit", "best_gaussian"]


@dataclass(frozen=True, slots=True)
class GaussianFit:
    """Gaussian closest to a point spread.

    Parameters
    ----------
    sigma
        Standard deviation of the Gaussian in radians.
    radius
        Radius in radians of the geometric blur disc at the eye's own wavelength.
    residual
        RMS residual of the fit over the RMS of the point spread.
    lowest
        Minimum of the transfer: below 0 contrast reverses, which no Gaussian does.
    lowest_per_rad
        Frequency of the minimum, in cycles per radian.
    reversal_per_rad
        Frequency at which contrast first reverses, in cycles per radian; ``inf`` where it never does.
    """

    sigma: float
    radius: float
    residual: float
    lowest: float
    lowest_per_rad: float
    reversal_per_rad: float

    def summary(self) -> str:
        """Return width, k and residual in one line."""
        reverses = (
            "contrast never reverses"
            if np.isinf(self.reversal_per_rad)
            else f"contrast reverses from {np.radians(self.reversal_per_rad):.3g} cycles per degree on"
        )
        return (
            f"Gaussian with a standard deviation of {60 * np.degrees(self.sigma):.3g} arcmin (k = {self.k:.3g}), which "
            f"leaves {self.residual:.0%} of the point spread; {reverses}"
        )

    @property
    def k(self) -> float:
        """Ratio of sigma to radius; ``nan`` in focus, where the disc is a point and diffraction is all."""
        return self.sigma / self.radius if self.radius > 0 else float("nan")


@checked
def best_gaussian(
    optics: AnyOptics, vergence: Vergence, light: Light | None = None, *, wavelength_nm: float | None = None
) -> GaussianFit:
    """Fit a Gaussian of unit volume by least squares to the spread of a point at `vergence` (D).

    The paper's appendix holds that blur has "the general shape" of a Gaussian; how far it has is the residual here. The
    square of the difference is summed over the plane: by Parseval, of the transfers over all frequencies.

    Parameters
    ----------
    optics
        An `Eye` whose blur is round (a centred pupil, no aberrations but those of m = 0), or a `Lens`.
    vergence
        Vergence of the point, in dioptres.
    light, wavelength_nm
        As for `focalgradient.eye.blur_transfer`.

    Raises
    ------
    InputError
        If the blur is not rotationally symmetric, or for the errors of `blur_transfer`.

    Examples
    --------
    >>> from focalgradient.eye import Eye
    >>> fit = best_gaussian(Eye(pupil_diameter=0.004, accommodation=1.0), 0.0)
    >>> round(fit.k, 2), round(fit.residual, 2), round(fit.lowest, 2)
    (0.58, 0.42, -0.12)
    """
    from scipy.optimize import minimize_scalar  # deferred: slow to import

    if not capabilities(optics).isotropic:
        raise InputError(
            "optics have no round blur, because of aberrations of m other than 0, an offset of the pupil or a half of "
            "it: leave these out."
        )
    diameter = optics.aperture_diameter
    limit = diameter / (1e-9 * min(nm for _, nm, _ in in_light(optics, wavelength_nm, light)))
    radius = float(abs(optics.focus_vergence - vergence)) * diameter / 2
    nodes, weights = panels(2 * np.pi * (radius + 1e-3) * limit)
    frequency = limit * nodes**2  # finest where transfers change most
    area = 2 * limit * nodes * weights * frequency  # of the rings of the plane of frequencies, over 2 pi
    transfer = np.real(blur_transfer(0, frequency, optics, vergence, light=light, wavelength_nm=wavelength_nm))

    def left(log_sigma: float) -> float:
        return float(area @ (transfer - gaussian_transfer(frequency, np.exp(log_sigma), 1.0)) ** 2)

    guesses = np.linspace(np.log(1e-5), np.log(2 * radius + 1e-3), 60)
    best = int(np.argmin([left(guess) for guess in guesses]))
    found = minimize_scalar(
        left, bounds=(guesses[max(best - 1, 0)], guesses[min(best + 1, 59)]), method="bounded", options={"xatol": 1e-9}
    )
    lowest = int(np.argmin(transfer))
    return GaussianFit(
        sigma=float(np.exp(found.x)),
        radius=radius,
        residual=float(np.sqrt(found.fun / (area @ transfer**2))),
        lowest=float(transfer[lowest]),
        lowest_per_rad=float(frequency[lowest]),
        reversal_per_rad=_first_zero(frequency, transfer),
    )


def _first_zero(frequency: FloatArray, transfer: FloatArray) -> float:
    """Return the frequency at which the transfer first falls below zero by more than rounding."""
    below = transfer < -1e-6
    if not below.any():
        return float("inf")
    after = int(below.argmax())
    return float(np.interp(0, -transfer[after - 1 : after + 1], frequency[after - 1 : after + 1]))
