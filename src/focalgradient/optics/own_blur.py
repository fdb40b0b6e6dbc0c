"""The blur that optics offer themselves, in whichever form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, described

__all__ = ["OwnBlur", "own_blur"]

Transfer = NDArray[np.float64] | NDArray[np.complex128]
"""Real where blur is round, and complex where it need not be."""

FORMS = ("through_focus", "optical_transfer", "transfer")
"""Methods by which optics may offer a blur of their own: of many vergences at once, of one, and of round blur."""

BLUR_ERROR = 5e-3
"""Error up to which an optics' own transfer is 1 at frequency 0, and alike in all directions (`eye.Cones`: 1e-3)."""


@dataclass(frozen=True, slots=True)
class OwnBlur:
    """The blur that optics offer themselves, in every form whichever of them the optics have (see `own_blur`)."""

    optics: Any
    isotropic: bool
    """Whether blur is alike in all directions, its transfer real and a function of the radial frequency."""

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> NDArray[np.float64]:
        """Return the transfer of round blur of points at `vergence` (D) at `frequency` (cycles per radian); broadcasts.

        Raises
        ------
        InputError
            If the blur is not round, or what the optics return is not a transfer.
        """
        if not self.isotropic:
            raise InputError(f"the blur of {self.name} is not round, but only round blur can be used here.")
        radial, level = np.abs(np.asarray(frequency, float)), np.asarray(vergence, float)
        if self._offers("transfer"):
            shape = np.broadcast_shapes(radial.shape, level.shape)
            return np.asarray(self._checked(self.optics.transfer(radial, level), shape).real, float)
        radii, place = np.unique(radial, return_inverse=True)
        levels, number = np.unique(level, return_inverse=True)
        table = self.through_focus(np.zeros_like(radii), radii, levels).real
        return np.asarray(table[number.reshape(level.shape), place.reshape(radial.shape)], float)

    def optical_transfer(self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergence: float) -> Transfer:
        """Return the transfer of points at one `vergence` (D) at frequencies in cycles per radian; broadcasts."""
        if not self._offers("optical_transfer"):
            return self.through_focus(frequency_y, frequency_x, [vergence])[0]
        down, right = np.asarray(frequency_y, float), np.asarray(frequency_x, float)
        shape = np.broadcast_shapes(down.shape, right.shape)
        return self._checked(self.optics.optical_transfer(down, right, vergence), shape)

    def through_focus(self, frequency_y: ArrayLike, frequency_x: ArrayLike, vergences: ArrayLike) -> Transfer:
        """Return the same for each of the `vergences` (D): L x the frequencies' shape."""
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
        """Raise `InputError` unless the blur of points at `vergence` (D) keeps light, and is round if said to be.

        It is compared along two directions up to `frequency` (cycles per radian).
        """
        some = np.linspace(0, frequency, 9)
        right, down = (self.through_focus(y, x, [vergence])[0] for y, x in ((0 * some, some), (some, 0 * some)))
        if not abs(right[0] - 1) <= BLUR_ERROR:
            raise InputError(
                f"the transfer of {self.name} is {right[0]:.3g} at frequency 0, but must be 1: blur keeps the light."
            )
        uneven = max(float(np.abs(right - down).max()), float(np.abs(np.imag(right)).max()))
        if self.isotropic and uneven > BLUR_ERROR:
            raise InputError(
                f"the blur of {self.name} is said to be round (isotropic), but its transfer differs by {uneven:.2g} "
                "between directions: state isotropic = False."
            )

    def check_forms(self, vergence: float, frequency: float) -> None:
        """Raise `InputError` unless the blur is that of real light, and one by each of the methods that are offered."""
        y, x = np.meshgrid(*2 * [np.linspace(-frequency / 2, frequency / 2, 5)], indexing="ij")
        given = {form: getattr(self, f"_by_{form}")(y, x, vergence) for form in FORMS if self._offers(form)}
        for form, values in given.items():
            turned = float(np.abs(values[::-1, ::-1] - np.conj(values)).max())
            if turned > BLUR_ERROR:
                raise InputError(
                    f"`{form}` of {self.name} at -f is not the conjugate of that at f (by {turned:.2g}), as that "
                    "of any real light is: check its signs."
                )
        first = next(iter(given))
        for form, values in given.items():
            apart = float(np.abs(values - given[first]).max())
            if apart > BLUR_ERROR and (form != "transfer" or self.isotropic):
                raise InputError(
                    f"`{form}` of {self.name} differs from its `{first}` by {apart:.2g} at {vergence:g} D, but both "
                    "must give one blur."
                )

    def check_sides(self, vergences: NDArray[np.float64], frequency: float) -> None:
        """Raise `InputError` unless blur on one side of focus differs from that on the other, as is stated."""
        line = np.linspace(-frequency / 2, frequency / 2, 9)
        y, x = np.meshgrid(line, line, indexing="ij")
        focus = self.optics.focus_vergence
        beyond, nearer = (self.through_focus(y, x, focus + way * np.abs(vergences - focus)) for way in (-1, 1))
        if np.abs(beyond - nearer).max() <= BLUR_ERROR:
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
        """Name of the optics' class, for messages."""
        return type(self.optics).__name__

    @property
    def forms_views(self) -> bool:
        """Whether views are taken to be blurred so unless said otherwise: not where the optics say `by_rays`."""
        return not getattr(self.optics, "by_rays", False)

    def _offers(self, form: str) -> bool:
        return callable(getattr(self.optics, form, None))

    def _checked(self, found: ArrayLike, shape: tuple[int, ...]) -> Transfer:
        """What the optics return, refused unless it is finite and of the `shape` asked for."""
        values: Transfer = np.asarray(found)
        if values.shape != shape or values.dtype.kind not in "fc" or not np.isfinite(values).all():
            raise InputError(
                f"the transfer of {self.name} has shape {values.shape} and type {values.dtype}, but must be finite "
                f"numbers of shape {shape}."
            )
        return values


def own_blur(optics: Any) -> OwnBlur | None:
    """Return the blur that `optics` offer themselves, or None where they have an aperture and a focus only.

    Optics offer it by one or more of these methods, at frequencies in cycles per radian and vergences in dioptres:

    - ``transfer(frequency, vergence)``: of round blur, by radial frequency; broadcasts;
    - ``optical_transfer(frequency_y, frequency_x, vergence)``: at one vergence, complex where blur is not symmetric;
    - ``through_focus(frequency_y, frequency_x, vergences)``: the same for a list of vergences, L x the frequencies'
      shape.

    ``isotropic`` states whether the blur is round. Where it is absent, blur is taken to be round if ``transfer`` alone
    is offered, and may depend on direction else. ``by_rays = True`` states that their views are blurred by geometric
    optics, by a disc, unless ``psf="optics"`` is asked for.

    Raises
    ------
    InputError
        If ``isotropic`` is not a truth value, or is False though only ``transfer`` is offered.

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
            f"{type(optics).__name__} has blur that is not round (isotropic is False), but offers only `transfer`, "
            "which is of round blur: add `through_focus` or `optical_transfer`."
        )
    return OwnBlur(optics, bool(stated))
