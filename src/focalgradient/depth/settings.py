"""The settings of `focalgradient.recover_depth`, its methods and its views, checked."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, Literal

import numpy as np

from focalgradient.arrays import FloatArray
from focalgradient.errors import InputError, is_number
from focalgradient.optics import DualPixel, Optics, capabilities, own_blur
from focalgradient.progress import Progress
from focalgradient.psf import Capability, Disc, Psf, check_transfer, psf_of, shape_class
from focalgradient.quantities import Range
from focalgradient.view import View

__all__ = [
    "AUTO",
    "LEAST_SIDE",
    "METHODS",
    "OPTICS",
    "SOURCES",
    "WINDOW",
    "WINDOWS",
    "BlurSource",
    "Method",
    "MethodName",
    "RecoverySettings",
    "blur_source",
    "check_blur",
    "check_usable",
    "checked_views",
    "halves_of",
    "methods_for",
    "noise_of_each",
    "used_blur",
]

SATURATED = 0.5
"""Maximum proportion of a view's pixels that are saturated or masked; beyond it the view is rejected."""


WINDOW = Range("pixels", 2, 64)
"""Bounds of a window."""

LEAST_SIDE, WINDOWS = 32, 4
"""Minimum side of a view in pixels, and in windows. Chosen by hand."""

MethodName = Literal["equalise", "spectra", "ratio", "edges", "autofocus", "dual-pixels"]


AUTO, OPTICS = "auto", "optics"
SOURCES = (AUTO, OPTICS)
"""Names of what stands for a shape: the blur that the views' optics offer, "auto" a disc where none offers any."""

BlurSource = Psf | str
"""Where the blur of a view comes from: a shape of its radius, or the name of one of `SOURCES`."""


def blur_source(psf: BlurSource | str, k: float | None = None) -> BlurSource:
    """Return the source of blur that a public function was given: itself, or that of its name.

    >>> blur_source("auto"), blur_source("gaussian", 0.4)
    ('auto', Gaussian(k=0.4))
    """
    shape = psf_of("disc" if psf in SOURCES else psf, k, SOURCES)  # which refuses a k out of range
    return psf if isinstance(psf, str) and psf in SOURCES else shape


def used_blur(details: Mapping[str, Any]) -> BlurSource | None:
    """Return the blur that a map was made by, from its `details`; None where its method has no model of the blur.

    >>> used_blur({"psf": "polygon", "psf_parameters": {"blades": 5}})
    Polygon(blades=5, rotation=0.0)
    """
    name: str | None = details.get("psf")
    if name is None or name in SOURCES:
        return name
    return shape_class(name).of(details.get("psf_parameters", {}))


@dataclass(frozen=True, slots=True)
class Method:
    """A method of depth: its folder, the number of views that it takes, and the capabilities of blur that it needs."""

    folder: str
    least: int = 2
    most: int | None = None
    needs: tuple[Capability, ...] | None = ()
    """What the method builds on; none: it takes any blur. None: it has no model of the blur."""
    of_halves: bool = False
    """Whether it takes the halves of dual pixels, whose blur no shape describes, and no other views."""

    def load(self) -> Any:
        """Import the method's module when it is called, for `import focalgradient` to stay light.

        It holds `estimate(problem)`, and may hold `check(views)`, which refuses views by their optics.
        """
        return import_module(f"focalgradient.depth.{self.folder}.estimate")


METHODS: dict[MethodName, Method] = {
    "equalise": Method("equalise"),
    "spectra": Method("spectra", needs=(Capability.BY_RADIUS, Capability.ISOTROPIC)),
    "ratio": Method("ratio", most=2, needs=(Capability.BY_RADIUS, Capability.ISOTROPIC)),
    "edges": Method("edges", least=1, needs=(Capability.EDGE_RESPONSE,)),
    "autofocus": Method("autofocus", least=3, needs=None),
    "dual-pixels": Method("dual_pixel", of_halves=True),
}


def methods_for(psf: BlurSource | str) -> list[MethodName]:
    """Return the methods that can use the blur `psf`, a shape or its name; "autofocus" has no model of the blur.

    >>> methods_for("disc"), methods_for("polygon")
    (['equalise', 'spectra', 'ratio', 'edges', 'autofocus'], ['equalise', 'autofocus'])
    """
    given = _provided(blur_source(psf))
    return [name for name, method in METHODS.items() if not method.of_halves and set(method.needs or ()) <= given]


def _provided(psf: BlurSource) -> frozenset[Capability]:
    """Return what methods may build on: of the optics' own blur nothing."""
    return frozenset() if isinstance(psf, str) else psf.provides


def check_blur(method: MethodName, psf: BlurSource) -> None:
    """Raise `InputError` where a method needs what a blur does not provide, naming both and what else can be done."""
    if isinstance(psf, Psf):
        check_transfer(psf)
    blur = "the optics' own blur" if isinstance(psf, str) else psf.name
    for need in METHODS[method].needs or ():
        if need not in _provided(psf):
            raise InputError(
                f"method {method!r} needs {need.value}, which {blur} does not give: use method "
                f"{' or '.join(repr(name) for name in methods_for(psf))}."
            )


@dataclass(frozen=True, slots=True)
class RecoverySettings:
    """The settings of `focalgradient.recover_depth`, by its parameters' names."""

    method: MethodName
    near: float | None
    far: float | None
    psf: BlurSource
    window: float
    noise: float | Sequence[float] | None
    align: bool
    false_alarm: float
    progress: Progress
    outlines: bool = True

    @property
    def shape(self) -> Psf:
        """Shape of the blur, for methods that know a view's blur by its radius alone."""
        if isinstance(self.psf, str):
            raise InputError(f"psf is {self.psf!r}, but method {self.method!r} needs a shape of blur: give 'disc'.")
        return self.psf

    def resolved(self, optics: Sequence[Optics]) -> RecoverySettings:
        """Return the same, with `AUTO` decided: these `optics`' own blur where any offer it, else a disc.

        Equalisation and dual pixels alone use the optics' own blur, and autofocus uses none. With other methods a disc
        must be asked for where optics offer another blur.
        """
        own = [one for one in map(own_blur, optics) if one is not None and one.forms_views]
        if self.psf != AUTO:
            return self
        if not own:
            return replace(self, psf=Disc())
        if self.method in ("equalise", "autofocus", "dual-pixels"):
            return replace(self, psf=OPTICS)
        raise InputError(
            f"the optics ({own[0].name}) offer a blur of their own, which method {self.method!r} cannot use: take "
            "method 'equalise', or give psf 'disc' to take the blur for a disc."
        )

    def given_noise(self, count: int) -> FloatArray | None:
        """Standard deviation of the noise of each of `count` views, as given; None where it is to be estimated."""
        return None if self.noise is None else noise_of_each(self.noise, count)

    def stated(self) -> dict[str, Any]:
        """Return the settings for the details of a map."""
        parameters = {} if isinstance(self.psf, str) else self.psf.stated()
        return {
            "method": self.method,
            "near_m": self.near,
            "far_m": self.far,
            "psf": self.psf if isinstance(self.psf, str) else self.psf.name,
            "psf_parameters": parameters,
            "k": parameters.get("k"),
            "window_px": self.window,
            "align": self.align,
            "false_alarm": self.false_alarm,
            **({"continued_to_outlines": self.outlines} if self.method == "equalise" else {}),
        }

    def check(self, count: int) -> None:
        """Refuse settings out of range, for `count` views."""
        near, far = self.near, self.far
        for name, limit in (("near", near), ("far", far)):
            if limit is not None and not (is_number(limit) and limit > 0):
                raise InputError(f"{name} is {limit!r}, but must be a positive number of metres.")
        if near is not None and far is not None and near >= far:
            raise InputError(f"near {near:g} m lies beyond far {far:g} m, but must be less: exchange them.")
        if near is not None and math.isinf(near):
            raise InputError("near is infinite, but must be a finite distance in metres: leave it out to search all.")
        WINDOW.check("window", self.window)
        self.given_noise(count)
        if not (is_number(self.false_alarm) and 0 < self.false_alarm < 1):
            raise InputError(f"false_alarm is {self.false_alarm!r}, but must be a probability between 0 and 1.")


def noise_of_each(noise: float | Sequence[float], count: int, of: str = "views") -> FloatArray:
    """Return the standard deviation of the noise of each of `count` views; raise `InputError` unless positive.

    >>> noise_of_each(0.1, 2).tolist()
    [0.1, 0.1]
    """
    values = np.asarray(noise)
    fits = values.dtype.kind in "iuf" and values.ndim < 2 and values.size in (1, count)
    if not (fits and np.all((values > 0) & np.isfinite(values))):
        raise InputError(f"noise is {noise!r}, but must be one positive number, or one for each of the {count} {of}.")
    return np.broadcast_to(values.astype(float), count)


def checked_views(views: Sequence[View]) -> list[View]:
    """Return the views as a list; raise `InputError` unless all are views."""
    if isinstance(views, View | str | bytes) or not isinstance(views, Iterable):
        what = "one View" if isinstance(views, View) else f"a {type(views).__name__}"
        raise InputError(f"views is {what}, but must be a list of View: give [first, second].")
    views = list(views)
    for number, view in enumerate(views, 1):
        if not isinstance(view, View):
            raise InputError(f"view {number} is a {type(view).__name__}, but must be a View: {_remedy(view)}.")
    return views


def _remedy(given: object) -> str:
    if isinstance(getattr(given, "view", None), View):
        return "give its attribute view"
    if isinstance(given, np.ndarray):
        return "give View(image, optics, pixel_angle)"
    return "make one of its image and its optics"


def halves_of(views: Sequence[View]) -> tuple[int, int] | None:
    """Return the numbers of the left and the right half of one lens among views; None without such a pair.

    A mean of the two beside them, as `DualPixel.mean`, shows nothing more.
    """
    optics = [view.optics for view in views]
    if not optics or not all(isinstance(one, DualPixel) for one in optics):
        return None
    halves = [one for one in optics if isinstance(one, DualPixel)]
    signs = [float(np.sign(one.asymmetry)) for one in halves]
    alike = {(one.lens, abs(one.asymmetry), one.field) for one in halves if one.asymmetry}
    if signs.count(1.0) != 1 or signs.count(-1.0) != 1 or len(alike) != 1:
        return None
    return signs.index(1.0), signs.index(-1.0)


def check_usable(views: Sequence[View], method: MethodName, window: float) -> None:
    """Raise `InputError` for views that the method cannot use in this window (pixels), or without depth information."""
    least, most = METHODS[method].least, METHODS[method].most
    if len(views) < least:
        raise InputError(
            f"{len(views)} view{'s' * (len(views) != 1)} given, but method {method!r} needs {least} or more: add a "
            "view."
        )
    if METHODS[method].of_halves and halves_of(views) is None:
        raise InputError("dual pixels need the left and the right view of one lens: give DualPixel.pair(lens).")
    if most is not None and len(views) > most:
        raise InputError(f"{len(views)} views given, but method {method!r} takes {most} at most: give fewer.")
    for number, view in enumerate(views, 1):
        if view.shape != views[0].shape:
            sizes = [f"{v.shape[1]} x {v.shape[0]}" for v in (views[0], view)]
            raise InputError(
                f"view 1 is {sizes[0]} pixels but view {number} is {sizes[1]}, and all views must be of one size: "
                "crop or scale them alike."
            )
        _check_light(number, view)
    if min(views[0].shape) < LEAST_SIDE:
        size = f"{views[0].shape[1]} x {views[0].shape[0]}"
        raise InputError(f"the views are {size} pixels, but at least {LEAST_SIDE} are needed.")
    optics = {(v.optics.aperture_diameter, v.optics.focus_vergence) for v in views}
    stated = [capabilities(view.optics) for view in views]
    for view, one in zip(views, stated, strict=True):
        if not (one.uniform or METHODS[method].of_halves):
            raise InputError(
                f"the blur of {type(view.optics).__name__} varies over the field (uniform = False), which no method "
                "can use: crop the views to a part of the field, and give the optics of that part."
            )
    alike = len(optics) == 1 and least > 1 and not any(one.tells_side for one in stated)
    if alike or all(aperture == 0 for aperture, _ in optics):
        raise InputError(
            "all views are blurred alike (same aperture and focus, or pinholes all), which is uninformative about "
            "depth: change the aperture or the focus of one."
        )
    if window > min(views[0].shape) / WINDOWS:
        raise InputError(
            f"window is {window:g} pixels, but may be a quarter of the views' smaller side at most, which is "
            f"{min(views[0].shape)} pixels: give a smaller window."
        )


def _check_light(number: int, view: View) -> None:
    """Raise `InputError` for a view that is black, constant, or mostly saturated or masked."""
    image = view.image if view.mask is None else view.image[view.mask]
    top = image.max()
    unusable = (image == top).mean() if view.mask is None else 1 - view.mask.mean()
    if not top > 0:
        raise InputError(f"view {number} is black, but depth needs a lit scene: check its exposure.")
    constant = image.min() == top
    if constant or unusable > SATURATED:
        trouble = "saturated" if view.mask is None else "saturated or bad, by its mask,"
        raise InputError(
            f"view {number} is {'constant' if constant else f'{trouble} over more than half its pixels'}, "
            "so that it shows no texture to compare: expose it so that the scene keeps below the maximum."
        )
