"""The paper's series of a pupil's point spread, which is independent truth."""

import numpy as np
from scipy.special import jv


def lommel_point_spread(
    angle: np.ndarray, *, pupil_diameter: float, wavelength_nm: float, defocus: float
) -> np.ndarray:
    """Return the light per steradian, as a share of all the light, by Lommel's functions, as in the paper's appendix.

    With v = pi d angle / wavelength and u = pi D d^2 / (2 wavelength), the light relative to the centre of the spread
    in focus is (2 / u)^2 (U1^2 + U2^2), where U_n(u, v) = sum over s of (-1)^s (u / v)^(n + 2s) J_(n + 2s)(v); for
    v < u the same light is (2 / u)^2 [(V0 - cos w)^2 + (V1 - sin w)^2], with w = (u + v^2 / u) / 2 and V_n(u, v) =
    sum over s of (-1)^s (v / u)^(n + 2s) J_(n + 2s)(v).
    """
    wavelength = 1e-9 * wavelength_nm
    v = np.pi * pupil_diameter * np.abs(angle) / wavelength
    u = np.pi * abs(defocus) * pupil_diameter**2 / (2 * wavelength)
    light = np.empty_like(v)
    middle = np.maximum(u, v) < 1e-2
    # There the series divide nothing by nothing: the expansion to second order.
    light[middle] = 1 - v[middle] ** 2 / 4 - u**2 / 48
    outer, inner = ~middle & (v >= u), ~middle & (v < u)
    if outer.any():
        x = v[outer]
        first, second = _lommel(1, u / x, x), u / x * _lommel(2, u / x, x)  # U1 v / u and U2 v / u: u may be 0
        light[outer] = (2 / x) ** 2 * (first**2 + second**2)
    if inner.any():
        x = v[inner]
        zeroth, first = _lommel(0, x / u, x), x / u * _lommel(1, x / u, x)  # V0 and V1
        phase = (u + x**2 / u) / 2
        light[inner] = (2 / u) ** 2 * ((zeroth - np.cos(phase)) ** 2 + (first - np.sin(phase)) ** 2)
    peak = np.pi * pupil_diameter**2 / (4 * wavelength**2)
    return peak * light


def _lommel(order: int, ratio: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Sum (-1)^s ratio^(2 s) J_(order + 2 s)(x) over s, for ratios up to 1."""
    largest = float(x.max())
    terms = 12 + int((largest + 12 * np.cbrt(largest)) / 2)  # Bessel functions vanish once their order exceeds x
    power, total = np.ones_like(x), np.zeros_like(x)
    for term in range(terms):
        live = np.abs(power) > 1e-18
        total[live] += power[live] * jv(order + 2 * term, x[live])
        power *= -(ratio**2)
    return total
