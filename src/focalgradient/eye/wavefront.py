"""Wave optics of any pupil: diffraction, defocus, Zernike aberrations and the Stiles-Crawford effect.

The wavefront is a sum of Zernike terms ``(n, m, micrometres)`` of the OSA standard, orthonormal over the pupil. Its
sign: positive defocus (focus nearer than the object) is a positive c(2, 0), and a wavefront that rises towards positive
x moves light to positive angles. As in the image, x goes to the right and y down, seen from behind the eye; tables of
measured eyes, whose x and y are those of the examiner, are converted by `Eye.from_zernike`.
"""

from __future__ import annotations

import math
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numba import njit
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike, NDArray
from scipy.fft import fft, ifft, next_fast_len

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_finite, check_list, check_number, checked, described
from focalgradient.eye.diffraction import clear_transfer
from focalgradient.eye.quadrature import gauss
from focalgradient.eye.ranges import Pupil as PupilDiameter
from focalgradient.eye.ranges import Vergence, Wavelength, check_pupil
from focalgradient.quantities import Range

if TYPE_CHECKING:
    from focalgradient.eye.zones import ZonedLens

__all__ = [
    "Aberrations",
    "Pupil",
    "check_aberrations",
    "defocus_term",
    "pupil_spread",
    "pupil_transfer",
    "pupil_transfer_of",
    "share_of_light",
    "zernike",
    "zernike_defocus",
]

Aberrations = tuple[tuple[int, int, float], ...]
"""Zernike terms (n, m, coefficient in micrometres) of a wavefront over the whole pupil."""

RIM_SAMPLES, PHASE_STEP = 128, 1.4
"""Minimum number of samples of the pupil per radius, and maximum phase between them (rad): the transfer then differs
from the quadrature by at most 3e-4 (`tests/eye/test_through_focus.py`)."""

_CHUNK = 1 << 20  # values at a time, to bound memory


@checked
def zernike_defocus(defocus: Annotated[float, Range("dioptres")], *, pupil_diameter: PupilDiameter) -> float:
    """Return the Zernike coefficient c(2, 0) in micrometres of a `defocus` (D), as `defocus_term` computes it.

    >>> round(zernike_defocus(1.0, pupil_diameter=0.004), 4)
    0.5774
    """
    return defocus_term(defocus, pupil_diameter)


def defocus_term(defocus: float, diameter: float) -> float:
    """Return the Zernike coefficient c(2, 0) in micrometres of a `defocus` (D): D d^2 / (16 sqrt 3), d in mm.

    >>> round(defocus_term(1.0, 0.004), 4)
    0.5774
    """
    return defocus * (1e3 * diameter) ** 2 / (16 * math.sqrt(3))


def zernike(n: int, m: int, x: ArrayLike, y: ArrayLike) -> FloatArray:
    """Return the Zernike polynomial of orders `n` (radial) and `m` (meridional) at (x, y) in the unit disc; broadcasts.

    Its mean square over the disc is 1. Negative `m` goes with the sine of the angle, counted from x towards y.

    >>> zernike(2, 0, [0.0, 1.0], 0.0).round(3).tolist()
    [-1.732, 1.732]
    """
    _check_order(n, m)
    z = np.asarray(x, dtype=float) + 1j * np.asarray(y, dtype=float)
    k = abs(m)
    radial = radial_over_power(n, k, np.abs(z) ** 2)
    if m == 0:
        return math.sqrt(n + 1) * radial
    turned = z**k
    return math.sqrt(2 * (n + 1)) * radial * (turned.imag if m < 0 else turned.real)


def radial_over_power(n: int, k: int, square: Any) -> Any:
    """Return Zernike's radial polynomial of orders n and k over rho^k, as a function of the squared radius."""
    half = (n - k) // 2
    return sum(
        (-1) ** s * math.comb(n - s, s) * math.comb(n - 2 * s, half - s) * square ** (half - s) for s in range(half + 1)
    )


@cache
def _radial_coefficients(n: int, k: int) -> FloatArray:
    """Return the coefficients of `radial_over_power` by power of the squared radius, constant first."""
    return np.asarray(radial_over_power(n, k, Polynomial([0.0, 1.0])).coef, float)


def pupil_transfer(
    frequency_y_cpd: ArrayLike,
    frequency_x_cpd: ArrayLike,
    *,
    pupil_diameter: float,
    wavelength_nm: float,
    defocus: float,
    aberrations: Aberrations = (),
    stiles_crawford: float = 0.0,
) -> NDArray[np.complex128]:
    """Return the OTF of an aberrated, apodised pupil: its autocorrelation, by quadrature.

    For a clear pupil `focalgradient.eye.optical_transfer` is the same, and far quicker.

    Parameters
    ----------
    frequency_y_cpd, frequency_x_cpd
        Cycles per degree; broadcast against each other.
    pupil_diameter, wavelength_nm, defocus
        As for `focalgradient.eye.optical_transfer`; here the sign of the defocus matters (positive beyond focus).
    aberrations
        Zernike terms (n, m, micrometres).
    stiles_crawford
        rho in 1/mm^2: light counts by 10^(-rho r^2).

    Returns
    -------
    ndarray
        Complex; 1 at frequency 0, and the conjugate at the opposite frequency.

    Raises
    ------
    InputError
        If a number is out of its range, or a Zernike term does not exist.

    Examples
    --------
    >>> eye = {"pupil_diameter": 0.003, "wavelength_nm": 555, "defocus": 0.25}
    >>> complex(pupil_transfer(0, 20, **eye, aberrations=((3, 1, 0.1),)).round(3))
    (0.14+0.133j)
    """
    check_pupil(pupil_diameter)
    pupil = Pupil(pupil_diameter, wavelength_nm, defocus, aberrations, stiles_crawford)
    down = check_finite("frequency_y_cpd", frequency_y_cpd, "cycles per degree")
    right = check_finite("frequency_x_cpd", frequency_x_cpd, "cycles per degree")
    return pupil_transfer_of(np.degrees(down), np.degrees(right), pupil)


def pupil_transfer_of(down: FloatArray, right: FloatArray, pupil: Pupil) -> NDArray[np.complex128]:
    """Return `pupil_transfer` at frequencies in cycles per radian, which broadcast against each other.

    On the grid of a picture's frequencies (a column and a row, all of them multiples of one step) it is by FFT of the
    sampled pupil: 5 to 60 times quicker, and right to 3e-4. Not where its samples, for a small step many, are more than
    the terms of the quadrature.
    """
    step = _lattice_step(down, right)
    nodes, weights = _rule(max(20 + pupil.steepness / 2, pupil.kinked_order))
    if step > 0 and (4 / _sampling(step, pupil)[1]) ** 2 < 2 * down.size * right.size * nodes.size**2:
        return _transfer_by_fft(down[:, 0] / step, right[0] / step, step, pupil)
    down, right = np.broadcast_arrays(down, right)
    shift = ((right + 1j * down) * (1e-9 * pupil.wavelength_nm / pupil.diameter)).ravel()
    transfer = np.zeros(shift.shape, complex)
    passed = np.flatnonzero(np.abs(shift) < 1)
    # The pupil meets itself, moved by +shift and -shift, in a lens: two halves, whose rims cos t makes smooth.
    for some in np.array_split(passed, 1 + passed.size * nodes.size**2 // _CHUNK):
        moved = shift[some, None, None]
        s = np.abs(moved)
        ahead = np.where(s > 0, moved / np.maximum(s, np.finfo(float).tiny), 1)
        t = np.arccos(s) * nodes[:, None]
        along, beside = np.cos(t) - s, np.sin(t) * (2 * nodes - 1)
        area = 2 * np.arccos(s) * np.sin(t) ** 2 * weights[:, None] * weights
        for half in (1, -1):
            place = ahead * (half * along + 1j * beside)
            light = area * np.exp(-pupil.loss * (np.abs(place) ** 2 + s**2))
            turn = pupil.phase(place - moved) - pupil.phase(place + moved)
            transfer[some] += (light * np.exp(1j * turn)).sum(axis=(1, 2))
    transfer /= pupil.light
    return transfer.reshape(down.shape)


def _lattice_step(down: FloatArray, right: FloatArray) -> float:
    """Return the common step of a column and a row of frequencies (sixteen values at least); 0 if there is none."""
    if not (down.ndim == right.ndim == 2 and down.shape[1] == right.shape[0] == 1 and down.size + right.size >= 16):
        return 0.0
    values = np.abs(np.concatenate([down.ravel(), right.ravel()]))
    step = float(np.min(values[values > 0], initial=np.inf))
    return step if np.isfinite(step) and np.allclose(values / step, np.rint(values / step), atol=1e-6) else 0.0


def _sampling(step: float, pupil: Pupil) -> tuple[int, float]:
    """Return the number of samples of the pupil for a frequency step (cycles per radian), and their spacing (radii).

    The step moves the pupil against itself by 2 x step x wavelength / diameter of its radius; the samples divide that.
    """
    apart = 2e-9 * step * pupil.wavelength_nm / pupil.diameter
    parts = math.ceil(apart * max(RIM_SAMPLES, pupil.steepness / PHASE_STEP))
    return parts, apart / parts


def _transfer_by_fft(rows: FloatArray, columns: FloatArray, step: float, pupil: Pupil) -> NDArray[np.complex128]:
    """Return the OTF at `rows` x `columns` multiples of a frequency (cycles per radian), by FFT of the pupil.

    Samples on the rim count by the share of them that lies within.
    """
    parts, spacing = _sampling(step, pupil)
    count = math.ceil(1 / spacing) + 1
    place = spacing * np.arange(-count, count + 1)
    z = place + 1j * place[:, None]
    within = np.clip((1 - np.abs(z)) / spacing + 0.5, 0, 1)
    inside = within > 0
    field = np.zeros(z.shape, np.complex64)  # single precision: to 1e-6
    field[inside] = within[inside] * pupil.amplitude(z[inside])
    size = next_fast_len(2 * len(place))
    down, right = (parts * np.rint(multiples).astype(int) for multiples in (rows, columns))
    # Along one axis after the other, without rows of zeros and columns that are not asked for.
    spectrum = fft(fft(field, size, axis=1), size, axis=0)
    power = spectrum.real**2 + spectrum.imag**2
    overlap = np.conj(ifft(ifft(power, axis=1)[:, right % size], axis=0))[down % size].astype(complex)
    far = (np.abs(down)[:, None] > 2 * count) | (np.abs(right) > 2 * count)
    # Not moved, a sample on the rim meets itself, and the autocorrelation would count its share twice.
    light = (within * np.exp(-pupil.loss * np.abs(z) ** 2)).sum()
    overlap[np.ix_(down == 0, right == 0)] = light
    return np.where(far, 0, overlap / light)


def pupil_spread(angle_y: ArrayLike, angle_x: ArrayLike, pupil: Pupil) -> FloatArray:
    """Return the point spread of a pupil on a grid of angles (rad): the squared diffraction integral.

    M x N for M rows `angle_y` and N columns `angle_x`: light per steradian, as a share of all the light.
    `focalgradient.eye.point_spread` gives it for an eye or a lens.
    """
    turn = np.pi * pupil.diameter / (1e-9 * pupil.wavelength_nm)  # radians of phase at the rim per radian of angle
    rows, columns = (
        turn * np.atleast_1d(check_finite(name, angle, "radians"))
        for name, angle in (("angle_y", angle_y), ("angle_x", angle_x))
    )
    steepness = float(max(np.abs(rows).max(), np.abs(columns).max()))
    nodes, weights = _rule(24 + steepness + max(pupil.steepness * 2 / 3, pupil.kinked_order))
    x = np.cos(np.pi * nodes)
    chord = np.sqrt(1 - x**2)
    field = np.zeros((rows.size, columns.size), complex)
    for place, half, weight in zip(x, chord, weights, strict=True):  # one chord of the pupil after another
        y = half * (2 * nodes - 1)
        wave = 2 * np.pi * half**2 * weight * weights * pupil.amplitude(place + 1j * y)
        field += np.outer(np.exp(-1j * np.outer(rows, y)) @ wave, np.exp(-1j * columns * place))
    return (turn / (2 * np.pi)) ** 2 / pupil.light * np.abs(field) ** 2


def added_terms(*terms: tuple[int, int, float], least: float = 0.0) -> Aberrations:
    """Return the sum of Zernike terms (n, m, micrometres) in order, of those whose magnitude exceeds `least`."""
    total: dict[tuple[int, int], float] = {}
    for n, m, um in terms:
        total[n, m] = total.get((n, m), 0.0) + um
    return tuple((n, m, um) for (n, m), um in sorted(total.items()) if abs(um) > least)


def check_aberrations(aberrations: Aberrations) -> None:
    """Raise `InputError` unless given Zernike terms."""
    for term in check_list("aberrations", aberrations, "Zernike terms (n, m, micrometres)"):
        if not (isinstance(term, tuple) and len(term) == 3):
            raise InputError(f"aberrations holds {described(term)}, but each term must be a tuple (n, m, micrometres).")
        _check_order(*term[:2])
        check_number("the coefficient of a Zernike term", term[2], "micrometres")


def is_term(n: int, m: int) -> bool:
    """Return whether a Zernike term of these orders exists and is supported."""
    return 0 <= abs(m) <= n <= 20 and (n - m) % 2 == 0


def _check_order(n: int, m: int) -> None:
    if not (isinstance(n, int) and isinstance(m, int) and is_term(n, m)):
        raise InputError(
            f"there is no Zernike term n = {described(n)}, m = {described(m)} here: n is a whole number from 0 to 20, "
            "and m one of -n, -n + 2, ..., n."
        )


def share_of_light(diameter: float, stiles_crawford: float) -> float:
    """Return the effective share of a pupil's light (m) by the Stiles-Crawford effect, the mean of 10^(-rho r^2).

    >>> round(share_of_light(0.006, 0.05), 3)
    0.623
    """
    loss = _loss(diameter, stiles_crawford)
    return -math.expm1(-loss) / loss if loss > 0 else 1.0


def _loss(diameter: float, stiles_crawford: float) -> float:
    return math.log(10) * stiles_crawford * (1e3 * diameter / 2) ** 2


class Pupil:
    """Pupil as a function of position in the unit disc, a complex number x + i y."""

    @checked
    def __init__(
        self,
        diameter: float,
        wavelength_nm: Wavelength,
        defocus: Vergence,
        aberrations: Aberrations = (),
        stiles_crawford: Annotated[float, Range("1/mm^2", 0)] = 0.0,
        lens: ZonedLens | None = None,
    ) -> None:
        self.diameter, self.wavelength_nm, self.defocus, self.lens = diameter, wavelength_nm, defocus, lens
        self.clear = not (aberrations or stiles_crawford or lens)
        check_aberrations(aberrations)
        terms = (*aberrations, (2, 0, defocus_term(defocus, diameter)))
        waves = 2e3 * np.pi / wavelength_nm  # radians of phase per micrometre
        self.terms = [(n, m, waves * c) for n, m, c in terms if c]
        self.loss = _loss(diameter, stiles_crawford)
        """Exponent of the Stiles-Crawford loss at the rim."""
        self.light = math.pi * share_of_light(diameter, stiles_crawford)
        self.steepness = self._steepest()
        """Maximum slope of the phase, in radians per radius."""

    def transfer(self, down: FloatArray, right: FloatArray) -> FloatArray | NDArray[np.complex128]:
        """Return the transfer at frequencies in cycles per radian, which broadcast; real for a clear pupil."""
        if self.clear:
            return clear_transfer(np.hypot(down, right), self.diameter, self.wavelength_nm, self.defocus)
        return pupil_transfer_of(down, right, self)

    @property
    def kinked_order(self) -> float:
        """Minimum order of a quadrature over a pupil with zones, whose wavefront has a kink at each edge; otherwise 0.

        The transfer of up to 10 D within 2 mm of a pupil of 8 mm, or of twelve zones, is then right to 2e-3.
        """
        return 24 + self.steepness / 2 + 4 * len(self._edges()) if self.lens is not None else 0.0

    def _edges(self) -> list[float]:
        """Return the radii of the edges of zones within the pupil, over the pupil's."""
        zones = () if self.lens is None else self.lens.diameters[:-1]
        return [edge / self.diameter for edge in zones if edge < self.diameter]

    def _steepest(self) -> float:
        """Return the steepest slope of the phase, found on circles about the centre.

        Zernike terms are steepest at the rim, and a zone at one of its edges.
        """
        edges = [edge + side for edge in self._edges() for side in (-2e-4, 2e-4)]
        radii = np.concatenate([np.linspace(0.4, 1, 7), edges])
        ring = np.exp(2j * np.pi * np.arange(96) / 96) * radii[:, None]
        slopes = [(self.phase(ring + step) - self.phase(ring - step)) / 2e-4 for step in (1e-4, 1e-4j)]
        return float(np.hypot(*slopes).max())

    def phase(self, place: NDArray[np.complex128]) -> FloatArray:
        """Return the phase in radians."""
        total = np.empty(place.size)
        _sum_of_terms(np.ascontiguousarray(place, np.complex128).ravel(), self._polynomials(), total)
        if self.lens is not None:
            waves = 2e3 * np.pi / self.wavelength_nm
            total += waves * self.lens.wavefront(np.abs(place).ravel() * self.diameter / 2)
        return total.reshape(place.shape)

    def _polynomials(self) -> FloatArray:
        """Return radial polynomials by meridional frequency, of cosine and sine, constant first."""
        highest = max((n for n, _, _ in self.terms), default=0)
        polynomials = np.zeros((1 + highest, 2, 1 + highest // 2))
        for n, m, radians in self.terms:
            coefficients = _radial_coefficients(n, abs(m))
            size = radians * math.sqrt((n + 1) * (2 if m else 1))
            polynomials[abs(m), int(m < 0), : len(coefficients)] += size * coefficients
        return polynomials

    def amplitude(self, place: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Return amplitude and phase of the light as a complex number."""
        turn, light = self.phase(place), np.empty(np.shape(place), np.complex128)
        np.cos(turn, out=light.real)  # in a third of the time of exp(1j * turn)
        np.sin(turn, out=light.imag)
        if self.loss > 0:
            light *= np.exp(-self.loss / 2 * np.abs(place) ** 2)
        return light


@njit(nogil=True, cache=True)
def _sum_of_terms(place, polynomials, total):  # type: ignore[no-untyped-def]
    """Return the phase at each `place`: radial polynomials of the squared radius, times powers of the place."""
    frequencies = len(polynomials)
    for number in range(place.size):
        x, y = place[number].real, place[number].imag
        square = x * x + y * y
        cosine, sine, found = 1.0, 0.0, 0.0
        for k in range(frequencies):
            along = aside = 0.0
            for power in range((frequencies - 1 - k) // 2, -1, -1):
                along = along * square + polynomials[k, 0, power]
                aside = aside * square + polynomials[k, 1, power]
            found += along * cosine + aside * sine
            cosine, sine = cosine * x - sine * y, sine * x + cosine * y
        total[number] = found


def _rule(order: float) -> tuple[FloatArray, FloatArray]:
    """Return the Gauss-Legendre rule of this order or slightly more."""
    return gauss(8 * math.ceil(order / 8))
