"""The protocol that optics implement: aperture and focus, a blur model in any of its forms, optional capabilities."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, check_number, check_tolerance, described

__all__ = ["Capabilities", "Mixture", "Optics", "OwnBlur", "capabilities", "check_optics", "own_blur", "refocused"]

Transfer = FloatArray | NDArray[np.complex128]
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

    def transfer(self, frequency: ArrayLike, vergence: ArrayLike) -> FloatArray:
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
        level = np.full(y.shape, vergence)
        by_form: dict[str, Callable[[], Transfer]] = {
            "through_focus": lambda: self.through_focus(y, x, [vergence])[0],
            "optical_transfer": lambda: self.optical_transfer(y, x, vergence),
            "transfer": lambda: self._checked(self.optics.transfer(np.hypot(y, x), level), y.shape),
        }
        given = {form: otf() for form, otf in by_form.items() if self._offers(form)}
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

    def check_sides(self, vergences: FloatArray, frequency: float) -> None:
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


def radial_transfer(blur: Any, frequency: ArrayLike, vergence: ArrayLike) -> FloatArray:
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


class Optics(Protocol):
    """Image-forming optics: a lens, an eye or a user-defined class. An aperture and a focus are required.

        Further capabilities are declared by the optional attributes and methods below; `capabilities` collects them,
        and `check_optics` validates them.

    ``transfer``, ``optical_transfer``, ``through_focus``
        A blur model: see `own_blur`.
    ``isotropic``
        Whether that blur is rotationally symmetric.
    ``by_rays``
        Whether views are nevertheless formed with the geometric blur disc.
    ``tells_side``
        Whether blur differs between the two sides of focus, so that views with the same focus (the two halves of a dual
        pixel) determine the side.
    ``uniform``
        Whether blur is constant over the field; depth is estimated only through such optics.
    ``mixture``
        Field-dependent blur as a `Mixture` of other optics; ``transfer`` is then its mean over the field.
    ``contrast(vergences)``
        Of a component of a mixture: contrast of the texture at each vergence (D), relative to the mixture's.
    ``light``
        Name of the waveband, as for an eye's cones of one class: only views in the same waveband show the same surface
        radiance.
    ``refocused(vergence)``
        Return the same optics focused at another vergence (D): see `refocused`.
    ``residual_blur_variance``
        Variance in rad^2 of the blur that remains in focus.
    ``assumption``
        A sentence on what the blur takes for granted, which every depth map states (``details["assumes"]``).
    ``focus_tolerance``, ``aperture_tolerance``
        Relative standard deviations of focus vergence and aperture, which cause errors common to the whole depth map.
    ``field_sd``
        Standard deviation (D) of the focus at the frame's corner, for its curvature and for its tilt over the field.
    """

    @property
    def aperture_diameter(self) -> float:
        """Aperture (pupil) diameter in metres; 0 for a pinhole."""

    @property
    def focus_vergence(self) -> float:
        """Vergence of the plane of focus in dioptres."""


@dataclass(frozen=True, slots=True, eq=False)
class Mixture:
    """Field-dependent blur: at each pixel a weighted mixture of the blurs of a few optics.

    Parameters
    ----------
    optics
        C optics with the same aperture.
    shares
        Weight of each at each pixel of the view, C x H x W; the weights sum to 1.
    focus_sd
        Standard deviation of the focus (D) at each pixel, H x W, due to the uncertainty of the weights.
    gain, gain_sd
        Contrast of the texture in the optics' waveband (its variation divided by the mean radiance of the view), in a
        unit common to all wavebands; and the standard deviation of its logarithm, infinite if unknown.
    """

    optics: tuple[Any, ...]
    shares: NDArray[np.floating]
    focus_sd: NDArray[np.floating]
    gain: float = 1.0
    gain_sd: float = np.inf

    def __post_init__(self) -> None:
        shape = np.shape(self.shares)
        if len(shape) != 3 or shape[0] != len(self.optics) or shape[1:] != np.shape(self.focus_sd):
            raise InputError(
                f"shares has shape {shape} and focus_sd {np.shape(self.focus_sd)}, but must be C x H x W for the "
                f"{len(self.optics)} optics of the mixture, and H x W."
            )
        if not np.allclose(np.sum(self.shares, axis=0), 1, atol=1e-3):
            raise InputError("shares do not sum to 1 everywhere: divide them by their sum over the optics.")


@dataclass(frozen=True, slots=True)
class Capabilities:
    """Optional capabilities that optics declare (see `Optics`), with defaults."""

    blur: OwnBlur | None
    """The optics' blur model; None: geometric blur from aperture and focus."""
    tells_side: bool
    uniform: bool
    waveband: str
    residual_blur_variance: float
    focus_tolerance: float = 0.0
    aperture_tolerance: float = 0.0
    field_sd: float = 0.0
    mixture: Mixture | None = None
    """Field-dependent blur; None: blur is constant over the field."""
    contrast: Callable[[FloatArray], FloatArray] | None = None
    """Of a component of a mixture: texture contrast at each vergence (D), relative to the mixture's; None: 1."""
    assumption: str = ""

    @property
    def isotropic(self) -> bool:
        """Whether blur is rotationally symmetric."""
        return self.blur is None or self.blur.isotropic

    @property
    def forms_views(self) -> bool:
        """Whether views are formed with the optics' own blur model by default."""
        return self.blur is not None and self.blur.forms_views


def _must_be(expected: str, fits: Callable[[Any], bool]) -> Callable[[str, Any], None]:
    """Return a check that raises `InputError` unless a value `fits`."""

    def check(name: str, value: Any) -> None:
        if not fits(value):
            raise InputError(f"{name} is {described(value)}, but must be {expected}.")

    return check


_flag = _must_be("True or False", lambda value: isinstance(value, bool | np.bool_))

DECLARED: dict[str, tuple[Any, Callable[[str, Any], object]]] = {
    "light": ("", _must_be("the waveband's name", lambda value: isinstance(value, str))),
    "tells_side": (False, _flag),
    "uniform": (True, _flag),
    "residual_blur_variance": (0.0, partial(check_number, unit="rad^2")),
    "focus_tolerance": (0.0, check_tolerance),
    "aperture_tolerance": (0.0, check_tolerance),
    "field_sd": (0.0, partial(check_number, unit="dioptres", least=0)),
    "mixture": (None, _must_be("a Mixture or None", lambda value: value is None or isinstance(value, Mixture))),
    "contrast": (None, _must_be("a method or None", lambda value: value is None or callable(value))),
    "assumption": ("", _must_be("a sentence", lambda value: isinstance(value, str))),
}
"""Attributes that optics may declare: the default, and the check of a value by its name."""


def capabilities(optics: Any) -> Capabilities:
    """Return the optional capabilities that `optics` declare.

    Raises
    ------
    InputError
        If a declared attribute has an invalid type or value.

    Examples
    --------
    >>> from focalgradient.optics import Lens
    >>> stated = capabilities(Lens(0.05, 2, 1.0))
    >>> stated.blur, stated.isotropic, stated.tells_side
    (None, True, False)
    """
    declared = {name: getattr(optics, name, default) for name, (default, _) in DECLARED.items()}
    for name, (_, check) in DECLARED.items():
        check(f"{name} of {type(optics).__name__}", declared[name])
    stated = Capabilities(own_blur(optics), waveband=declared.pop("light"), **declared)
    if stated.tells_side and stated.blur is None:
        raise InputError(
            f"{type(optics).__name__} states tells_side = True, but implements no blur model: add "
            "`optical_transfer`, or leave tells_side out."
        )
    return stated


def check_optics(optics: Any, *, vergences: ArrayLike | None = None, frequency: float | None = None) -> None:
    """Raise `InputError` unless `optics` implement `Optics` and their blur model is consistent.

    Parameters
    ----------
    optics
        Optics with a finite focus vergence and a finite aperture diameter of 0 or more.
    vergences, frequency
        Vergences (D) and maximum frequency (cycles per radian: 0.5 / pixel angle) at which the blur model is also
        checked: unit gain at frequency 0, Hermitian symmetry, isotropy and difference between the sides of focus as
        declared, and agreement between the methods.

    Raises
    ------
    InputError
        For the first violation found, naming the optics' class.

    Examples
    --------
    >>> from focalgradient.optics import Lens
    >>> check_optics(Lens(0.05, 2, 1.0))
    >>> check_optics(None)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    focalgradient.errors.InputError: optics is None, but must be a Lens, an Eye or ...
    """
    aperture, focus = (getattr(optics, name, None) for name in ("aperture_diameter", "focus_vergence"))
    if isinstance(optics, type) or aperture is None or focus is None:
        raise InputError(
            f"optics is {described(optics)}, but must be a Lens, an Eye or whatever else has an aperture_diameter "
            "(m) and a focus_vergence (D)."
        )
    for value in (aperture, focus):
        if not (np.ndim(value) == 0 and np.isfinite(value) and aperture >= 0):
            raise InputError(
                f"optics has an aperture of {aperture!r} m and a focus vergence of {focus!r} D, "
                "but both must be finite and the aperture 0 or more."
            )
    stated = capabilities(optics)
    if vergences is None and frequency is None:
        return
    if vergences is None or frequency is None:
        raise InputError("only one of vergences and frequency is given, but the blur is checked with both: give both.")
    if stated.blur is not None:
        for vergence in np.atleast_1d(np.asarray(vergences, float)).tolist():
            stated.blur.check(vergence, frequency)
            stated.blur.check_forms(vergence, frequency)
        if stated.tells_side:
            stated.blur.check_sides(np.atleast_1d(np.asarray(vergences, float)), frequency)


def refocused(optics: Any, vergence: float) -> Any:
    """Return the optics focused at another `vergence` (D), by their method ``refocused(vergence)``.

    Raises
    ------
    InputError
        If they have no such method, or cannot focus there.

    Examples
    --------
    >>> from focalgradient.optics import Lens
    >>> refocused(Lens(0.05, 2, 1.0), 4.0).focus_distance
    0.25
    """
    if not callable(getattr(optics, "refocused", None)):
        raise InputError(
            f"optics is {described(optics)}, which cannot be focused elsewhere: give it a method refocused(vergence)."
        )
    return optics.refocused(vergence)
