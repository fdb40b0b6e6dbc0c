"""The protocol that optics implement, with optional capabilities."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focalgradient.errors import InputError, check_number, check_tolerance, described
from focalgradient.optics.own_blur import OwnBlur, own_blur

__all__ = ["Capabilities", "Mixture", "Optics", "capabilities", "check_optics", "refocused"]


TOLERANCES = ("focus_tolerance", "aperture_tolerance")
"""Attributes that give the relative standard deviations of focus and aperture."""


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
    contrast: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None
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
    waveband, residual = getattr(optics, "light", ""), getattr(optics, "residual_blur_variance", 0.0)
    if not isinstance(waveband, str):
        raise InputError(f"light of {type(optics).__name__} is {described(waveband)}, but must be the waveband's name.")
    check_number(f"residual_blur_variance of {type(optics).__name__}", residual, "rad^2")
    tolerances = [getattr(optics, name, 0.0) for name in TOLERANCES]
    for name, value in zip(TOLERANCES, tolerances, strict=True):
        check_tolerance(f"{name} of {type(optics).__name__}", value)
    field_sd = getattr(optics, "field_sd", 0.0)
    check_number(f"field_sd of {type(optics).__name__}", field_sd, "dioptres", least=0)
    blur = own_blur(optics)
    mixture = getattr(optics, "mixture", None)
    if not (mixture is None or isinstance(mixture, Mixture)):
        raise InputError(f"mixture of {type(optics).__name__} is {described(mixture)}, but must be a Mixture or None.")
    sides, uniform = _flag(optics, "tells_side", False), _flag(optics, "uniform", True)
    own = dict(zip(TOLERANCES, tolerances, strict=True))
    contrast = getattr(optics, "contrast", None)
    if not (contrast is None or callable(contrast)):
        raise InputError(f"contrast of {type(optics).__name__} is {described(contrast)}, but must be a method or None.")
    assumption = getattr(optics, "assumption", "")
    if not isinstance(assumption, str):
        raise InputError(f"assumption of {type(optics).__name__} is {described(assumption)}, but must be a sentence.")
    stated = Capabilities(
        blur,
        sides,
        uniform,
        waveband,
        residual,
        mixture=mixture,
        contrast=contrast,
        assumption=assumption,
        **own,
        field_sd=field_sd,
    )
    if stated.tells_side and stated.blur is None:
        raise InputError(
            f"{type(optics).__name__} states tells_side = True, but implements no blur model: add "
            "`optical_transfer`, or leave tells_side out."
        )
    return stated


def _flag(optics: Any, name: str, default: bool) -> bool:
    """Return a boolean attribute of optics; raise `InputError` if it is of another type."""
    value = getattr(optics, name, default)
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name} of {type(optics).__name__} is {described(value)}, but must be True or False.")
    return bool(value)


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
