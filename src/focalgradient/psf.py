"""Blur as a filter: from the radius of a blur disc to its optical transfer function.

Frequencies are in cycles per unit of the radius: per pixel for radii in pixels, per radian for angles. Every model
is isotropic and keeps the light: its transfer is 1 at frequency 0.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, check_finite, check_number

__all__ = [
    "DISC_K",
    "MODELS",
    "PsfName",
    "blend_transfer",
    "check_psf",
    "disc_transfer",
    "gaussian_transfer",
    "has_edge",
    "pixel_transfer",
    "sigma_per_radius",
    "transfer",
]

PsfName = Literal["disc", "gaussian", "blend"]
"""Model of a blur that is known by its radius alone."""

DISC_K = 0.5
"""sigma / radius of the Gaussian with the second moment, per axis, of a uniform disc."""


def disc_transfer(frequency: ArrayLike, radius: ArrayLike) -> NDArray[np.float64]:
    """Transfer of a uniform disc, 2 J1(x) / x with x = 2 pi `radius` `frequency` (geometric optics); broadcasts.

    Negative beyond its first zero at 0.61 cycles per radius: there contrast reverses.

    >>> disc_transfer([0.0, 0.61], 1.0).round(3).tolist()
    [1.0, -0.0]
    """
    # Imported here, for `import focalgradient` to stay light.
    from scipy.special import j1

    x = 2 * np.pi * np.asarray(radius, dtype=float) * np.asarray(frequency, dtype=float)
    small = np.abs(x) < 1e-4
    safe = np.where(small, 1.0, x)
    return np.where(small, 1 - x**2 / 8, 2 * j1(safe) / safe)


def gaussian_transfer(frequency: ArrayLike, radius: ArrayLike, k: float = DISC_K) -> NDArray[np.float64]:
    """Transfer of a Gaussian of standard deviation sigma = `k` x `radius`, exp(-2 (pi sigma f)^2); broadcasts.

    >>> round(float(gaussian_transfer(0.1, 4.0, k=0.5)), 3)
    0.454
    """
    sigma = k * np.asarray(radius, dtype=float)
    return np.exp(-2 * (np.pi * sigma * np.asarray(frequency, dtype=float)) ** 2)


def blend_transfer(frequency: ArrayLike, radius: ArrayLike, k: float) -> NDArray[np.float64]:
    """Transfer of a disc convolved with a Gaussian, as real lenses' blur is; broadcasts.

    The Gaussian's standard deviation is `k` x `radius`, the disc's own radius `radius` sqrt(1 - (k / 0.5)^2): the two
    together have the second moment of the whole disc. 0 is the disc, 0.5 and more the Gaussian.

    >>> [round(float(blend_transfer(0.1, 4.0, k)), 3) for k in (0.0, 0.35, 0.5)]
    [0.393, 0.44, 0.454]
    """
    rest = np.sqrt(max(0.0, 1 - (k / DISC_K) ** 2)) * np.asarray(radius, dtype=float)
    return disc_transfer(frequency, rest) * gaussian_transfer(frequency, radius, k)


MODELS: dict[PsfName, Callable[[ArrayLike, ArrayLike, float], NDArray[np.float64]]] = {
    "disc": lambda frequency, radius, k: disc_transfer(frequency, radius),
    "gaussian": gaussian_transfer,
    "blend": blend_transfer,
}


EDGED: dict[PsfName, bool] = {"disc": True, "gaussian": False, "blend": True}
"""Whether a shape ends sharply, so that its transfer changes sign."""


def check_psf(psf: str, known: Sequence[PsfName] = tuple(MODELS), user: str = "") -> PsfName:
    """Return the shape of blur named `psf`, refused unless it is one of those `known` to its `user`.

    >>> check_psf("gaussian", ("disc", "gaussian"))
    'gaussian'
    >>> check_psf("blend", ("disc", "gaussian"), "method 'ratio'")
    Traceback (most recent call last):
    focalgradient.errors.InputError: psf is 'blend', but must be one of disc, gaussian for method 'ratio'.
    """
    for name in known:
        if psf == name:
            return name
    raise InputError(f"psf is {psf!r}, but must be one of {', '.join(known)}{' for ' * bool(user)}{user}.")


def has_edge(psf: str) -> bool:
    """Whether the shape of blur named `psf` ends sharply, as a disc does.

    >>> has_edge("disc"), has_edge("gaussian")
    (True, False)
    """
    return EDGED[check_psf(psf, tuple(EDGED))]


def sigma_per_radius(psf: str, k: float) -> float:
    """Return the standard deviation per axis of the disc (0.5), or of the Gaussian of `k`, over the blur radius."""
    return DISC_K if check_psf(psf, ("disc", "gaussian")) == "disc" else k


def transfer(frequency: ArrayLike, radius: ArrayLike, psf: PsfName, k: float = DISC_K) -> NDArray[np.float64]:
    """Transfer at `frequency` of the blur whose disc has `radius`, by the model named `psf`; broadcasts.

    Parameters
    ----------
    frequency
        Radial frequency, in cycles per unit of `radius`.
    radius
        Radius of the geometric blur disc; 0 (a pinhole, or a point in focus) transfers everything.
    psf
        ``"disc"``, ``"gaussian"`` or ``"blend"``.
    k
        For the Gaussian, and the blend's Gaussian part, sigma / disc radius. The paper takes 1 and asks for
        calibration; the default matches the second moment of the disc.

    Raises
    ------
    InputError
        If the model is unknown, a frequency is not finite, a radius negative or NaN, or k not positive.

    Examples
    --------
    >>> transfer(0.1, [0.0, 2.0], "gaussian", k=0.5).round(4).tolist()
    [1.0, 0.8209]
    """
    shape = MODELS[check_psf(psf)]
    frequency = check_finite("frequency", frequency, "cycles per unit of the radius")
    if not np.all(np.asarray(radius, dtype=float) >= 0):
        raise InputError("radius holds negative or undefined values, but the radius of a blur disc is 0 or more.")
    check_number("k", k, "sigma / disc radius", positive=True)
    return shape(frequency, radius, k)


def pixel_transfer(frequency_y: ArrayLike, frequency_x: ArrayLike) -> NDArray[np.float64]:
    """Transfer of a square pixel that averages the light over its whole area, in cycles per pixel; broadcasts.

    The sinc in frequency that the paper's appendix adds to blur.

    >>> round(float(pixel_transfer(0.0, 0.5)), 4)
    0.6366
    """
    return np.sinc(np.asarray(frequency_y, dtype=float)) * np.sinc(np.asarray(frequency_x, dtype=float))
