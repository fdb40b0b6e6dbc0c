"""The optics of Pentland (1987) in the paper's notation: distances behind the lens, and the paper's f-number.

F is the focal length, v0 the distance from lens to sensor, sigma the spatial constant of the blur *on the sensor*; all
in metres. Caution: the paper's appendix defines f = F / (lens *radius*), which is **twice** the photographer's
f-number. `focalgradient.Lens`, used everywhere else, states the same optics in vergence. ``docs/paper.md`` lists where
each equation and figure of the paper is implemented.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, check_finite, check_number
from focalgradient.optics import Side

__all__ = ["conjugate_distance", "paper_distance", "pinhole_distance"]


def conjugate_distance(distance: ArrayLike, *, focal_length: float) -> NDArray[np.float64]:
    """Return the conjugate distance of `distance` for a thin lens, u = F v / (v - F): Eq. 13.

    Eq. 12, 1/u + 1/v = 1/F, solved for either distance. At the sensor distance v0 it gives the distance of the plane of
    focus, u0 = F v0 / (v0 - F): Eq. 14.

    Parameters
    ----------
    distance
        v, or u, in metres; any shape, ``inf`` included.
    focal_length
        F in metres.

    Returns
    -------
    ndarray
        u, or v, in metres; ``inf`` at the focal length, and negative within it (virtual image).

    Raises
    ------
    InputError
        If a distance or the focal length is not positive.

    Examples
    --------
    A 50 mm lens with its sensor 1000/19 mm behind it is focused at 1 m.

    >>> round(float(conjugate_distance(1 / 19, focal_length=0.050)), 6)
    1.0
    """
    check_number("focal_length", focal_length, "metres", positive=True)
    values = np.asarray(distance, dtype=float)
    if not np.all(values > 0):
        raise InputError(
            "distance contains values that are not positive, but distances from the lens must be: give metres."
        )
    with np.errstate(divide="ignore"):
        return np.divide(1.0, 1.0 / focal_length - 1.0 / values)


def paper_distance(
    sigma: ArrayLike,
    *,
    focal_length: float,
    sensor_distance: float,
    paper_f_number: float,
    side: Side,
    paper_k: float = 1.0,
) -> NDArray[np.float64]:
    """Return the distance of a point from its blur, D = F v0 / (v0 - F - sigma f): Eq. 1 (nearer than focus, Eq. 16).

    The appendix relates the blur circle and the spatial constant by a constant k of the optics, to be calibrated: D = F
    v0 / (v0 - F - sigma k f), where k sigma is the radius of the blur circle. This k is the reciprocal of sigma /
    radius, which is called k elsewhere in the package (`focalgradient.psf.DISC_K`).

    Parameters
    ----------
    sigma
        Spatial constant of the blur *on the sensor*, in metres; any shape. With `paper_k` = 1, the blur circle's
        radius.
    focal_length, sensor_distance
        F and v0, in metres.
    paper_f_number
        f = F / (lens radius) = 2 x the photographer's f-number. The photographer's f-number would halve the defocus.
    side
        ``"beyond"`` or ``"nearer"`` than the plane of focus.
    paper_k
        The appendix's k: radius of the blur circle / sigma. The paper takes 1.

    Returns
    -------
    ndarray
        Distance in metres, of the shape of `sigma`; ``inf`` or negative where no real point has so much blur.

    Raises
    ------
    InputError
        If sigma is not finite, a number is not positive, or the side is unknown.

    Examples
    --------
    A 50 mm f/2 lens focused at 1 m images a point at 2 m as a blur circle of 0.329 mm radius on the sensor. A Gaussian
    with the second moment of that disc has half this sigma, and k = 2.

    >>> from focalgradient import Lens
    >>> lens = Lens(0.050, 2, 1.0)
    >>> terms = {"focal_length": 0.050, "sensor_distance": lens.sensor_distance, "paper_f_number": 2 * lens.f_number}
    >>> round(float(paper_distance(0.00032895, **terms, side="beyond")), 3)
    2.0
    >>> round(float(paper_distance(0.00032895 / 2, **terms, side="beyond", paper_k=2)), 3)
    2.0
    """
    for name, value, unit in (
        ("focal_length", focal_length, "metres"),
        ("sensor_distance", sensor_distance, "metres"),
        ("paper_f_number", paper_f_number, "F / (lens radius)"),
        ("paper_k", paper_k, "radius / sigma"),
    ):
        check_number(name, value, unit, positive=True)
    if side not in ("beyond", "nearer"):
        raise InputError(f"side is {side!r}, but must be 'beyond' or 'nearer' (than the plane of focus).")
    defocused = paper_k * paper_f_number * check_finite("sigma", sigma, "metres on the sensor")
    if side == "nearer":
        defocused = -defocused
    with np.errstate(divide="ignore"):
        return np.divide(focal_length * sensor_distance, sensor_distance - focal_length - defocused)


def pinhole_distance(
    slope: ArrayLike,
    *,
    focal_length: float,
    sensor_distance: float,
    paper_f_number: float,
    side: Side,
    paper_k: float = 1.0,
) -> NDArray[np.float64]:
    """Return the distance from a view compared with a pinhole view, D = F v0 / (v0 - F - sigma f): Eq. 10.

    With sigma1 = 0 the regression of Eq. 9 has the slope A = 2 pi^2 sigma^2, hence sigma = sqrt(A / 2) / pi.

    Parameters
    ----------
    slope
        Slope A of ln F1 - ln F2 (amplitude spectra of the pinhole view and of the other view) over the squared spatial
        frequency on the sensor in cycles per metre; in m^2, any shape.
    focal_length, sensor_distance, paper_f_number, side, paper_k
        As for `paper_distance`; the aperture is that of the blurred view.

    Raises
    ------
    InputError
        If the slope is negative (the pinhole view is the more blurred one) or not finite; otherwise as
        `paper_distance`.

    Examples
    --------
    >>> from focalgradient import Lens
    >>> lens = Lens(0.050, 2, 1.0)
    >>> sigma = 0.00032895
    >>> round(float(pinhole_distance(2 * np.pi**2 * sigma**2, focal_length=0.050, side="beyond", paper_f_number=4,
    ...                              sensor_distance=lens.sensor_distance)), 3)
    2.0
    """
    slopes = check_finite("slope", slope, "square metres")
    if not np.all(slopes >= 0):
        raise InputError(
            "slope contains negative values, but a pinhole view cannot be the more blurred one: swap the views, or "
            "mask them."
        )
    return paper_distance(
        np.sqrt(slopes / 2) / np.pi,
        focal_length=focal_length,
        sensor_distance=sensor_distance,
        paper_f_number=paper_f_number,
        side=side,
        paper_k=paper_k,
    )
