"""Uniform access to optics' own blur models, whichever methods the optics implement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, described

__all__ = ["OwnBlur", "own_blur"]

Transfer = NDArray[np.float64] | NDArray[np.complex128]
"""Optical transfer function: real for isotropic blur, complex in general."""

FORMS = ("through_focus", "optical_transfer", "transfer")
"""Methods that define a blur model: for several vergences, for one vergence, and for isotropic blur."""

DIRECTIONS_DEG = (0.0, 28.0, 45.0, 90.0)
"""Directions in which transfers are compared: two alone miss astigmatism along their bisector."""

TRANSFER_TOLERANCE = 5e-3
"""Tolerance of gain at frequency 0 and of isotropy of optics' own transfer functions (`eye.Cones`: 1e-3)."""


@dataclass(frozen=True, slots=True)
class OwnBlur:
    """The blur model of optics, available in every form from any one that they implement (see `own_blur`)."""

    optics: Any
    isotropic: bool
    """Whether blur is rotationally symmetric, so that its transfer is a real function of radial frequency."""

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> NDArray[np.float64]:
        """Return the transfer of isotropic blur for points at `vergence` (D) at `frequency` (cycles/rad); broadcasts.

        Raises
        ------
        InputError
            If the blur is not isotropic, or the optics return an invalid transfer.
        """
        if not self.isotropic:
            raise InputError(
                f"the blur of {self.name} is not isotropic, but only isotropic blur can be used here: use other optics."
            )
        radial, level = np.abs(np.asarray(frequency, float)), np.asarray(vergence, float)
        if self._offers("transfer"):
            shape = np.broadcast_shapes(radial.shape, level.shape)
            return np.asarray(self._checked(self.optics.transfer(radial, level), shape).real, float)
        return radial_transfer(self, radial, level)

    def optical_transfer(self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergence: float) -> Transfer:
        """Return the OTF of points at one `vergence` (D) at frequencies in cycles per radian; broadcasts."""
        if not self._offers("optical_transfer"):
            return self.through_focus(frequency_y, frequency_x, [vergence])[0]
        down, right = np.asarray(frequency_y, float), np.asarray(frequency_x, float)
        shape = np.broadcast_shapes(down.shape, right.shape)
        return self._checked(self.optics.optical_transfer(down, right, vergence), shape)

    def through_focus(self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike) -> Transfer:
        """Return the OTF at each of the `vergences` (D): shape L x the frequencies' shape."""
        down, right = np.asarray(frequency_y, float), np.asarray(frequency_x, float)
        levels = np.atleast_1d(np.asarray(vergences, float))
        shape = np.broadcast_shapes(down.shape, right.shape)
        if self._offers("through_focus"):
            return self._checked(self.optics.through_focus(down, right, levels), (len(levels), *shape))
        if self._offers("optical_transfer"):
            each: Any = [self.optical_transfer(down, right, level) for level in levels.tolist()]
            return np.asarray(each)
        return self.transfer(np.hypot(down, right), levels.reshape(-1, *(1,) * len(shape)))

    def check(self, vergence: float, frequency: float) -> None:
        """Raise `InputError` unless the blur at `vergence` (D) has unit gain at frequency 0 and the declared isotropy.

        The transfer is compared along four directions, unevenly spaced, up to `frequency` (cycles per radian).
        """
        some, turns = np.linspace(0, frequency, 9), np.radians(DIRECTIONS_DEG)[:, None]
        along = self.through_focus(some * np.sin(turns), some * np.cos(turns), [vergence])[0]
        right = along[0]
        if not abs(right[0] - 1) <= TRANSFER_TOLERANCE:
            raise InputError(
                f"the transfer of {self.name} is {right[0]:.3g} at frequency 0, but must be 1: normalise it."
            )
        uneven = max(float(np.abs(along - right).max()), float(np.abs(np.imag(along)).max()))
        if self.isotropic and uneven > TRANSFER_TOLERANCE:
            raise InputError(
                f"the blur of {self.name} is declared isotropic, but its transfer differs by {uneven:.2g} "
                "between directions: state isotropic = False."
            )

    def check_forms(self, vergence: float, frequency: float) -> None:
        """Raise `InputError` unless the OTF is Hermitian, and the same by every method that the optics implement."""
        y, x = np.meshgrid(*2 * [np.linspace(-frequency / 2, frequency / 2, 5)], indexing="ij")
        given = {form: getattr(self, f"_by_{form}")(y, x, vergence) for form in FORMS if self._offers(form)}
        for form, values in given.items():
            turned = float(np.abs(values[::-1, ::-1] - np.conj(values)).max())
            if turned > TRANSFER_TOLERANCE:
                raise InputError(
                    f"`{form}` of {self.name} at -f is not the conjugate of that at f (by {turned:.2g}), as for "
                    "a real point spread function: check its signs."
                )
        first = next(iter(given))
        for form, values in given.items():
            apart = float(np.abs(values - given[first]).max())
            if apart > TRANSFER_TOLERANCE and (form != "transfer" or self.isotropic):
                raise InputError(
                    f"`{form}` of {self.name} differs from its `{first}` by {apart:.2g} at {vergence:g} D, but both "
                    "must give the same blur: correct one of them."
                )

    def check_sides(self, vergences: NDArray[np.float64], frequency: float) -> None:
        """Raise `InputError` unless blur differs between the two sides of focus, as declared by `tells_side`."""
        line = np.linspace(-frequency / 2, frequency / 2, 9)
        y, x = np.meshgrid(line, line, indexing="ij")
        focus = self.optics.focus_vergence
        beyond, nearer = (self.through_focus(y, x, focus + way * np.abs(vergences - focus)) for way in (-1, 1))
        if np.abs(beyond - nearer).max() <= TRANSFER_TOLERANCE:
            raise InputError(
                f"{self.name} states tells_side = True, but its blur at equal distances in dioptres from focus is the "
                "same on both sides: leave tells_side out."
            )

    def _by_transfer(self, y: NDArray[np.float64], x: NDArray[np.float64], vergence: float) -> Transfer:
        return self._checked(self.optics.transfer(np.hypot(y, x), np.full(y.shape, vergence)), y.shape)

    def _by_optical_transfer(self, y: NDArray[np.float64], x: NDArray[np.float64], vergence: float) -> Transfer:
        return self.optical_transfer(y, x, vergence)

    def _by_through_focus(self, y: NDArray[np.float64], x: NDArray[np.float64], vergence: float) -> Transfer:
        return self.through_focus(y, x, [vergence])[0]

    @property
    def name(self) -> str:
        """Name of the optics, for messages: their own, or that of their class."""
        return str(getattr(self.optics, "name", type(self.optics).__name__))

    @property
    def forms_views(self) -> bool:
        """Whether this blur model forms views by default: not if the optics set `by_rays`."""
        return not getattr(self.optics, "by_rays", False)

    def _offers(self, form: str) -> bool:
        return callable(getattr(self.optics, form, None))

    def _checked(self, found: ArrayLike, shape: tuple[int, ...]) -> Transfer:
        """Return a transfer computed by the optics; raise `InputError` unless finite and of the given `shape`."""
        values: Transfer = np.asarray(found)
        if values.shape != shape or values.dtype.kind not in "fc" or not np.isfinite(values).all():
            raise InputError(
                f"the transfer of {self.name} has shape {values.shape} and type {values.dtype}, but must be finite "
                f"numbers of shape {shape}."
            )
        return values


def radial_transfer(blur: Any, frequency: ArrayLike, vergence: ArrayLike) -> NDArray[np.float64]:
    """Return the transfer of isotropic blur, by ``through_focus`` of `blur` at each radial frequency; broadcasts."""
    radial, level = np.abs(np.asarray(frequency, float)), np.asarray(vergence, float)
    radii, place = np.unique(radial, return_inverse=True)
    levels, number = np.unique(level, return_inverse=True)
    table = blur.through_focus(np.zeros_like(radii), radii, levels).real
    return np.asarray(table[number.reshape(level.shape), place.reshape(radial.shape)], float)


def blur_of(optics: Any) -> OwnBlur:
    """Return the blur model of `optics`; raise `InputError` if they have none."""
    blur = own_blur(optics)
    if blur is None:
        raise InputError(f"{type(optics).__name__} implements no blur model: add through_focus.")
    return blur


def own_blur(optics: Any) -> OwnBlur | None:
    """Return the blur model that `optics` implement, or None if they have only an aperture and a focus.

    The model is one or more of these methods, of frequencies in cycles per radian and vergences in dioptres:

    - ``transfer(frequency, vergence)``: isotropic blur, by radial frequency; broadcasts;
    - ``optical_transfer(frequency_y, frequency_x, vergence)``: at one vergence, complex if blur is not symmetric;
    - ``through_focus(frequency_y, frequency_x, vergences)``: the same for a list of vergences, L x the frequencies'
      shape.

    ``isotropic`` declares whether the blur is isotropic; by default it is if only ``transfer`` is implemented.
    ``by_rays = True`` declares that views are formed with the geometric blur disc unless ``psf="optics"`` is requested.

    Raises
    ------
    InputError
        If ``isotropic`` is not a boolean, or is False though only ``transfer`` is implemented.

    Examples
    --------
    >>> from focalgradient.optics import Lens
    >>> own_blur(Lens(0.05, 2, 1.0)) is None
    True
    >>> from focalgradient.eye import Cones, Eye
    >>> coma = Cones.of(Eye(0.004, 1.0, aberrations=((3, 1, 0.2),)), "L+M")
    >>> own_blur(coma).isotropic
    False
    """
    offered = [form for form in FORMS if callable(getattr(optics, form, None))]
    if not offered:
        return None
    stated = getattr(optics, "isotropic", None)
    if stated is None:
        stated = offered == ["transfer"]
    if not isinstance(stated, bool | np.bool_):
        raise InputError(f"isotropic of {type(optics).__name__} is {described(stated)}, but must be True or False.")
    if not stated and offered == ["transfer"]:
        raise InputError(
            f"{type(optics).__name__} declares isotropic = False, but implements only `transfer`, "
            "which describes isotropic blur: add `through_focus` or `optical_transfer`."
        )
    return OwnBlur(optics, bool(stated))
