"""What formed an image: what optics must have, and what else they state of themselves."""

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
"""Attributes by which optics state how well their focus and aperture are known."""


class Optics(Protocol):
    """What formed an image: a lens, an eye or a class of the user's own. All need an aperture and a focus.

    What else optics can do they state by further attributes and methods, of which each may be absent; `capabilities`
    reads them, and `check_optics` checks them.

    ``transfer``, ``optical_transfer``, ``through_focus``
        A blur of their own: see `own_blur`.
    ``isotropic``
        Whether that blur is alike in all directions.
    ``by_rays``
        Whether their views are blurred by geometric optics, by a disc, all the same.
    ``tells_side``
        Whether blur on one side of focus differs from that on the other, so that views of one focus (the two halves of
        a dual pixel) tell the side.
    ``uniform``
        Whether blur is alike all over the field; depth is recovered through such optics only.
    ``mixture``
        Blur that varies over the field as a `Mixture` of other optics; ``transfer`` is then its mean over the field.
    ``contrast(vergences)``
        Of optics that are part of a mixture: contrast of the texture that they see if it lies at each vergence (D),
        over the mixture's own.
    ``light``
        Name of the waveband that they see, as an eye's cones of one class do: surfaces look alike, but for their blur,
        in views of one name only.
    ``refocused(vergence)``
        The same optics focused elsewhere (D): see `refocused`.
    ``residual_blur_variance``
        Variance in rad^2 of the blur that is there even in focus.
    ``focus_tolerance``, ``aperture_tolerance``
        Relative standard deviations of focus vergence and aperture: errors that the whole depth map shares.
    """

    @property
    def aperture_diameter(self) -> float:
        """Diameter of the aperture (pupil) in metres; 0 for a pinhole."""

    @property
    def focus_vergence(self) -> float:
        """Vergence of the plane in exact focus, in dioptres."""


@dataclass(frozen=True, slots=True, eq=False)
class Mixture:
    """Blur that varies over the field: at each pixel, a mixture of the blurs of a few optics.

    Parameters
    ----------
    optics
        C optics of one aperture.
    shares
        Share of each at each pixel of the view, C x H x W: 1 in sum.
    focus_sd
        Standard deviation of the focus at each pixel (D), H x W: how well the shares are known.
    gain, gain_sd
        Contrast of the texture in the optics' waveband (its variation over the mean light of the view), in a unit
        common to all wavebands; and the standard deviation of its logarithm, infinite where nothing is known of it.
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
            raise InputError("shares do not add up to 1 everywhere: divide them by their sum over the optics.")


@dataclass(frozen=True, slots=True)
class Capabilities:
    """What optics state of themselves beside aperture and focus (see `Optics`), with what holds where they do not."""

    blur: OwnBlur | None
    """The blur that they offer themselves; None: an aperture and a focus only, and blur by the radius."""
    tells_side: bool
    uniform: bool
    waveband: str
    residual_blur_variance: float
    focus_tolerance: float = 0.0
    aperture_tolerance: float = 0.0
    mixture: Mixture | None = None
    """How blur varies over the field; None: it does not."""
    contrast: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None
    """As part of a mixture: the texture's contrast at each vergence (D, L), over the mixture's own; None: 1."""

    @property
    def isotropic(self) -> bool:
        """Whether blur is alike in all directions."""
        return self.blur is None or self.blur.isotropic

    @property
    def forms_views(self) -> bool:
        """Whether views are blurred by the optics' own blur unless said otherwise."""
        return self.blur is not None and self.blur.forms_views


def capabilities(optics: Any) -> Capabilities:
    """Return what `optics` state of themselves.

    Raises
    ------
    InputError
        If what they state is not of its kind.

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
    blur = own_blur(optics)
    mixture = getattr(optics, "mixture", None)
    if not (mixture is None or isinstance(mixture, Mixture)):
        raise InputError(f"mixture of {type(optics).__name__} is {described(mixture)}, but must be a Mixture or None.")
    sides, uniform = _flag(optics, "tells_side", False), _flag(optics, "uniform", True)
    own = dict(zip(TOLERANCES, tolerances, strict=True))
    contrast = getattr(optics, "contrast", None)
    if not (contrast is None or callable(contrast)):
        raise InputError(f"contrast of {type(optics).__name__} is {described(contrast)}, but must be a method or None.")
    stated = Capabilities(blur, sides, uniform, waveband, residual, mixture=mixture, contrast=contrast, **own)
    if stated.tells_side and stated.blur is None:
        raise InputError(
            f"{type(optics).__name__} states tells_side = True, but offers no blur of its own that could: add "
            "`optical_transfer`, or leave tells_side out."
        )
    return stated


def _flag(optics: Any, name: str, default: bool) -> bool:
    """A truth value that optics state."""
    value = getattr(optics, name, default)
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name} of {type(optics).__name__} is {described(value)}, but must be True or False.")
    return bool(value)


def check_optics(optics: Any, *, vergences: ArrayLike | None = None, frequency: float | None = None) -> None:
    """Raise `InputError` unless `optics` implement `Optics`, and their own blur is what they state.

    Parameters
    ----------
    optics
        They must have a finite aperture diameter of 0 or more, and a finite focus vergence.
    vergences, frequency
        Of points (D), and the highest frequency (cycles per radian: 0.5 / pixel angle), where their own blur is to be
        checked, too: unit gain at frequency 0, that of real light (its conjugate at the negative frequency), alike in
        all directions and on both sides of focus where they state so, and the same by each method that they offer.

    Raises
    ------
    InputError
        The first of what is wrong, by the optics' name.

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
        raise InputError("only one of vergences and frequency is given, but a blur is checked by both: give both.")
    if stated.blur is not None:
        for vergence in np.atleast_1d(np.asarray(vergences, float)).tolist():
            stated.blur.check(vergence, frequency)
            stated.blur.check_forms(vergence, frequency)
        if stated.tells_side:
            stated.blur.check_sides(np.atleast_1d(np.asarray(vergences, float)), frequency)


def refocused(optics: Any, vergence: float) -> Any:
    """Return the same optics focused at another `vergence` (D), by their own method ``refocused(vergence)``.

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
