"""Registry of blur shapes by name, including those that other installed packages add; and checks of a shape."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, described
from focalgradient.psf.shape import Psf
from focalgradient.psf.shapes import Annulus, Blend, Disc, Gaussian, Polygon

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = ["GROUP", "SHAPES", "check_psf", "check_transfer", "names", "psf_from", "psf_of", "shape_class"]

SHAPES: dict[str, type[Psf]] = {shape.name: shape for shape in (Disc, Gaussian, Blend, Annulus, Polygon)}
"""The shapes of this package, by name."""

GROUP = "focalgradient.psf"
"""Entry-point group by which installed packages add shapes: name = "package.module:Class"."""


@cache
def _added() -> dict[str, EntryPoint]:
    """Return the entry points of other installed packages' shapes by name, without loading them."""
    from importlib.metadata import entry_points  # deferred to keep `import focalgradient` light

    return {entry.name: entry for entry in entry_points(group=GROUP) if entry.name not in SHAPES}


def names() -> list[str]:
    """Return the names of all shapes, with those of other installed packages last.

    >>> names()[:5]
    ['disc', 'gaussian', 'blend', 'annulus', 'polygon']
    """
    return [*SHAPES, *sorted(_added())]


def shape_class(name: str, others: tuple[str, ...] = (), called: str = "psf") -> type[Psf]:
    """Return the shape class called `name`; `others` are further names that the caller accepts.

    Raises
    ------
    InputError
        If there is no shape of this name, or the package that adds it cannot be loaded.
    """
    if name in SHAPES:
        return SHAPES[name]
    entry = _added().get(name)
    if entry is None:
        raise InputError(
            f"{called} is {described(name)}, but must be one of {', '.join([*others, *names()])}, or a Psf."
        )
    try:
        made = entry.load()
    except Exception as error:
        raise InputError(
            f"psf {name!r} of {_package(entry)} cannot be loaded ({type(error).__name__}: {error}): repair or "
            "remove it."
        ) from error
    if not (isinstance(made, type) and issubclass(made, Psf)):
        raise InputError(f"psf {name!r} of {_package(entry)} is {described(made)}, but must be a subclass of Psf.")
    return made


def _package(entry: EntryPoint) -> str:
    return f"package {entry.dist.name}" if entry.dist is not None else entry.value


def psf_of(psf: Any, k: float | None = None, others: tuple[str, ...] = (), called: str = "psf") -> Psf:
    """Return the shape for a public function's argument: the shape itself, or the named one with default parameters.

    Parameters
    ----------
    psf
        A shape, or its name.
    k
        sigma / disc radius of a shape that is given by name and has this parameter; None: its default.
    others
        Further names that the caller accepts, for the message.
    called
        Name of the caller's parameter, for the message.

    Raises
    ------
    InputError
        If there is no such shape, `k` is out of range, or `k` is given together with a shape instance.

    Examples
    --------
    >>> psf_of("gaussian", k=0.4)
    Gaussian(k=0.4)
    >>> psf_of("pillbox")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    focalgradient.errors.InputError: psf is 'pillbox', but must be one of disc, gaussian, blend, annulus, polygon...
    """
    if isinstance(psf, Psf):
        if k is not None:
            raise InputError(f"k is given with psf {psf}, which has its own parameters: leave k out.")
        return psf
    if isinstance(psf, type) and issubclass(psf, Psf):
        raise InputError(f"psf is the class {psf.__name__}, but must be a shape of it: give {psf.__name__}().")
    if not isinstance(psf, str):
        known = ", ".join([*others, *names()])
        raise InputError(f"{called} is {described(psf)}, but must be a Psf or one of {known}.")
    shape = shape_class(psf, others, called)
    if k is not None:
        Gaussian.parameters()[0].check(k)  # for a shape without it, too: callers pass a camera's k with any shape
    return _with_k(shape, {}, k)


def psf_from(stated: str | Mapping[str, Any], k: float | None = None) -> Psf:
    """Return the shape stated in a file: a name, or a table with `shape` and its parameters (see `Psf.stated`).

    >>> psf_from({"shape": "polygon", "blades": 5})
    Polygon(blades=5, rotation=0.0)
    """
    if isinstance(stated, str):
        return psf_of(stated, k)
    values = dict(stated)
    name = values.pop("shape", None)
    if not isinstance(name, str):
        raise InputError('psf has no shape: give a name, or a table such as {shape = "polygon", blades = 6}.')
    return _with_k(shape_class(name), values, k)


def _with_k(shape: type[Psf], values: dict[str, Any], k: float | None) -> Psf:
    """Return the shape of these parameters, with `k` where it has one that they leave open."""
    has_k = k is not None and "k" in [parameter.key for parameter in shape.parameters()]
    return shape.of(({"k": k} if has_k else {}) | values)


MAX_ERROR = 1e-3
"""Maximum error of a transfer or an edge response; shapes interpolated from tables meet it."""

RADII = (0.3, 1.0, 4.0)
"""Blur radii at which a shape is checked, including for scale invariance."""

LARGE_RADIUS, MAX_REMAINDER = 1000.0, 0.05
"""A large blur radius, and the maximum transfer allowed there at 0.25 to 0.5 cycles per unit of the radius."""

DIRECTIONS: FloatArray = np.pi * np.arange(12) / 12
"""Directions in radians in which transfers are compared."""

DIRECTION_FREQUENCIES: FloatArray = np.linspace(0.02, 1.5, 80)
"""Radial frequencies (cycles per radius) at which directions are compared."""

EDGE_BLUR, EDGE_EXTENT, EDGE_FREQUENCY_STEP = 0.1, 4.0, 1 / 64
"""Sigma of the Gaussian that smooths both edge responses, maximum position, and frequency spacing, in standard
deviations of the shape (or cycles per standard deviation); the smoothing makes the integral over the transfer
converge."""


def check_psf(psf: Psf | str) -> None:
    """Validate a blur shape; the error lists every inconsistency.

    A shape must have unit gain at frequency 0, no blur at radius 0, and negligible transfer of fine detail at a large
    radius. Its transfer must be Hermitian with modulus at most 1, depend only on the product of frequency and radius
    (checked by finite differences), and be isotropic, real, or free of sign changes where the shape declares so. The
    standard deviation must agree with the transfer, and the edge response, if defined, with the integral of the point
    spread function.

    Parameters
    ----------
    psf
        A shape, or its name.

    Raises
    ------
    InputError
        If `psf` is not a shape, or is inconsistent.

    Examples
    --------
    >>> from focalgradient.psf import Gaussian
    >>> check_psf(Gaussian(k=0.4))
    >>> class Leaky(Gaussian):
    ...     def transfer(self, frequency, radius):
    ...         return 0.9 * super().transfer(frequency, radius)
    >>> check_psf(Leaky())  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    focalgradient.errors.InputError: Leaky of k = 0.5 fails: the transfer is 0.9 at frequency 0, but must be 1 ...
    """
    shape = psf_of(psf)
    try:
        failures = list(_form_faults(shape))
        # A transfer of the wrong form cannot be checked further.
        failures = failures or [
            *_limit_faults(shape),
            *_declaration_faults(shape),
            *_moment_faults(shape),
            *_edge_faults(shape),
        ]
    except InputError:
        raise
    except Exception as error:
        failures = [f"it raises {type(error).__name__}: {error}"]
    if failures:
        raise InputError(f"{shape} fails: {'; '.join(failures)}.")


def check_transfer(psf: Psf) -> None:
    """Validate the form, unit gain and declared isotropy of a shape's transfer, quickly.

    The part of `check_psf` that `recover_depth` runs.
    """
    failures = list(_form_faults(psf)) or [
        *_gain_faults(psf),
        *_direction_faults(psf, _on_circle(psf, DIRECTION_FREQUENCIES, 1.0)),
    ]
    if failures:
        raise InputError(f"{psf} fails: {'; '.join(failures)}: see focalgradient.psf.check_psf.")


def _on_circle(shape: Psf, radial: FloatArray, radius: float) -> NDArray[np.complex128]:
    """Return the transfer at radial frequencies in all `DIRECTIONS`, shape directions x frequencies."""
    y, x = np.sin(DIRECTIONS)[:, None] * radial, np.cos(DIRECTIONS)[:, None] * radial
    return np.asarray(shape.optical_transfer(y, x, radius), np.complex128)


def _form_faults(shape: Psf) -> Iterator[str]:
    """Yield faults in the shape, type or finiteness of the transfer."""
    y, x, radius = np.linspace(-0.4, 0.4, 5)[:, None, None], np.linspace(0, 0.4, 4)[:, None], np.array([0.0, 1.5])
    for name, transfer in (
        ("optical_transfer", shape.optical_transfer(y, x, radius)),
        *([("transfer", shape.transfer(np.hypot(y, x), radius))] if shape.isotropic else []),
    ):
        values = np.asarray(transfer)
        if values.shape != (5, 4, 2) or values.dtype.kind not in "fc":
            yield f"{name} gives {values.dtype} of shape {values.shape}, but numbers of shape (5, 4, 2) were due"
        elif not np.isfinite(values).all():
            yield f"{name} gives values that are not finite"


def _gain_faults(shape: Psf) -> Iterator[str]:
    """Yield a fault if the gain at frequency 0 is not 1."""
    for radius in RADII:
        zero = np.asarray(shape.optical_transfer(0.0, 0.0, radius)).item()
        if not abs(zero - 1) <= MAX_ERROR:
            yield f"the transfer is {_shown(zero)} at frequency 0, but must be 1 (unit gain)"
            break


def _direction_faults(shape: Psf, circle: NDArray[np.complex128]) -> Iterator[str]:
    """Yield a fault if the transfer depends on direction though the shape is declared isotropic."""
    if shape.isotropic:
        uneven = max(np.abs(circle - shape.transfer(DIRECTION_FREQUENCIES, 1.0)).max(), np.abs(circle.imag).max())
        if uneven > MAX_ERROR:
            yield f"it states isotropic = True, but its transfer differs by {uneven:.2g} between directions"


def _limit_faults(shape: Psf) -> Iterator[str]:
    """Yield faults of the transfer at radius 0 and at a large radius, and of its modulus."""
    yield from _gain_faults(shape)
    radial = np.linspace(0.01, 0.5, 40)
    none = np.abs(_on_circle(shape, radial, 0.0) - 1).max()
    if none > MAX_ERROR:
        yield f"at radius 0 the transfer differs from 1 by {none:.2g}, but must equal 1 there"
    left = np.abs(_on_circle(shape, np.linspace(0.25, 0.5, 20), LARGE_RADIUS)).max()
    if left > MAX_REMAINDER:
        yield (
            f"at a radius of {LARGE_RADIUS:g} the transfer at 0.25 to 0.5 cycles per unit is {left:.2g}, but must be "
            f"below {MAX_REMAINDER:g}"
        )
    most = max(float(np.abs(_on_circle(shape, radial, radius)).max()) for radius in RADII)
    if most > 1 + MAX_ERROR:
        yield f"the transfer reaches {most:.3g}, but a non-negative point spread function has at most 1"


def _declaration_faults(shape: Psf) -> Iterator[str]:
    """Yield violations of Hermitian symmetry, of scale invariance and of the shape's declarations."""
    radial = DIRECTION_FREQUENCIES
    circle = _on_circle(shape, radial, 1.0)
    turned = np.abs(_on_circle(shape, -radial, 1.0) - circle.conj()).max()
    if turned > MAX_ERROR:
        yield f"the transfer at -f is not the conjugate of that at f (difference {turned:.2g})"
    yield from _direction_faults(shape, circle)
    if shape.symmetric and np.abs(circle.imag).max() > MAX_ERROR:
        yield f"it states symmetric = True, but its transfer has an imaginary part of {np.abs(circle.imag).max():.2g}"
    if not shape.ends_sharply and circle.real.min() < -MAX_ERROR:
        yield f"it states ends_sharply = False, but its transfer falls to {circle.real.min():.2g}"
    # Scale invariance: the derivative by the radius is f / radius times that by the frequency.
    for radius in RADII:
        f, step = radial / radius, 1e-4
        by_radius, by_frequency = (
            (_on_circle(shape, f * (1 + s), radius * (1 + r)) - _on_circle(shape, f * (1 - s), radius * (1 - r)))
            / (2 * step)
            for s, r in ((0.0, step), (step, 0.0))
        )
        off = float(np.abs(by_radius - by_frequency).max())
        if off > 5 * MAX_ERROR:
            yield (
                f"at radius {radius:g} its derivative by the radius differs from finite differences by the frequency "
                f"by {off:.2g}, but must depend only on frequency times radius"
            )
            break


def _moment_faults(shape: Psf) -> Iterator[str]:
    """Yield faults in the relation between radius and standard deviation."""
    stated, measured = shape.sd_per_radius, Psf.sd_per_radius.fget(shape)  # type: ignore[attr-defined]
    if not (np.isfinite(stated) and stated > 0):
        yield f"sd_per_radius is {stated!r}, but must be positive and finite"
        return
    if abs(stated - measured) > 0.01 * measured:
        yield f"sd_per_radius is {stated:.4g}, but by the transfer's curvature at 0 {measured:.4g}"
    back = float(shape.radius_of(shape.sd(3.0)))
    if abs(back - 3) > MAX_ERROR or abs(float(shape.variance(3.0)) - float(shape.sd(3.0)) ** 2) > MAX_ERROR:
        yield f"sd, variance and radius_of contradict each other: a radius of 3 becomes {back:.4g}"


def _edge_faults(shape: Psf) -> Iterator[str]:
    """Yield faults of the edge and line responses, compared with integrals over the transfer."""
    if not shape.gives_edge_response:
        return
    unit = Psf.sd_per_radius.fget(shape)  # type: ignore[attr-defined]
    place = np.linspace(-EDGE_EXTENT, EDGE_EXTENT, 81)
    frequency = EDGE_FREQUENCY_STEP * (np.arange(int(3.4 / (np.pi * EDGE_BLUR) / EDGE_FREQUENCY_STEP)) + 0.5)
    smoothed = shape.transfer(frequency / unit, 1.0) * np.exp(-2 * (np.pi * EDGE_BLUR * frequency) ** 2)
    waves = np.sin(2 * np.pi * place[:, None] * frequency) / (np.pi * frequency)
    integral = 0.5 + EDGE_FREQUENCY_STEP * waves @ smoothed
    nodes, weights = np.polynomial.hermite_e.hermegauss(41)
    given = shape.edge_response(unit * (place[:, None] + EDGE_BLUR * nodes), 1.0) @ (weights / weights.sum())
    off = float(np.abs(given - integral).max())
    if off > 2 * MAX_ERROR:
        yield f"the edge response differs from the integral of the point spread function by {off:.2g}"
    twice = np.abs(shape.edge_response(2 * unit * place, 2.0) - shape.edge_response(unit * place, 1.0)).max()
    if twice > MAX_ERROR:
        yield f"the edge response at twice the position and radius differs by {twice:.2g}, but must not"
    for radius in (1.0, 2.5):
        position, step = radius * unit * (place + 0.013), 1e-4 * radius
        above, below = (shape.edge_response(position + way * step, radius) for way in (1, -1))
        line = shape.line_response(position, radius)
        error = radius * float(np.abs(line - (above - below) / (2 * step)).max())
        if error > 0.01 / unit:
            yield f"at radius {radius:g} the line response differs from the slope of the edge response by {error:.2g}"
            break


def _shown(value: complex) -> str:
    return f"{value.real:.3g}" if abs(value.imag) < MAX_ERROR else f"{value:.3g}"
