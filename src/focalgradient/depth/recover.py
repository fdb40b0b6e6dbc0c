"""From views to a depth map, by the method asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Literal

from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.settings import RecoverySettings
from focalgradient.errors import InputError
from focalgradient.psf import DISC_K, PsfName
from focalgradient.view import View

__all__ = ["METHODS", "Method", "MethodName", "check_usable", "recover_depth"]

MethodName = Literal["equalise", "spectra", "ratio", "edges", "autofocus"]

Progress = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Method:
    """A way from views to depth: the module of `focalgradient.depth` whose `recover` does it, and what it needs."""

    module: str
    least: int = 2
    most: int | None = None


METHODS: dict[str, Method] = {
    "equalise": Method("equalise.estimate"),
    "spectra": Method("spectra.estimate"),
    "ratio": Method("ratio.disparity", most=2),
    "edges": Method("edges.measure", least=1),
    "autofocus": Method("autofocus.estimate", least=3),
}


def recover_depth(
    views: Sequence[View],
    *,
    method: MethodName = "equalise",
    near: float | None = None,
    far: float | None = None,
    psf: PsfName = "disc",
    k: float = DISC_K,
    window: float = 8.0,
    noise: float | Sequence[float] | None = None,
    align: bool = False,
    false_alarm: float = 1e-3,
    progress: Progress | None = None,
) -> DepthMap:
    """Recover depth from views of one scene by their blur.

    Parameters
    ----------
    views
        Two or more views of one scene, of one size, that differ in aperture, in focus, or in both. Depth comes on
        the first view's pixels. Views whose pixel angles differ (focusing changes magnification) are brought to the
        first view's; exposures may differ by any gain.
    method
        How blur is measured.

        - ``"equalise"``: maximum likelihood by equalisation over the whole image (Eqs. 7-11, for any optics);
        - ``"spectra"``: regression of the log ratio of patches' spectra (Eqs. 7-11);
        - ``"ratio"``: the real-time form, the ratio of Laplacian energies (section III); two views of one focus;
        - ``"edges"``: sharp edges, from one view (Eqs. 2-6): valid on contours only;
        - ``"autofocus"``: the best focus of a stack of three or more focus settings at one aperture; no blur model.
    near, far
        Limits of the search in metres. By default both sides of focus are searched, from infinity up to a blur of
        16 pixels.
    psf, k
        Blur model, ``"disc"`` or ``"gaussian"``, and for the Gaussian sigma / disc radius.
    window
        Standard deviation in pixels of the Gaussian window in which the evidence is gathered.
    noise
        Standard deviation of the pixels' noise in the images' units, one for all or one for each view; estimated
        from the views where not given (then alike in all, up to their exposure).
    align
        Measure translation and scale between the views and remove them first.
    false_alarm
        Probability with which the check refuses a pixel whose views do agree.
    progress
        Called with a few words at each stage.

    Returns
    -------
    DepthMap
        ``details`` holds the settings, ``side`` (how the side of focus was decided), ``noise``, ``gain`` and
        ``shift_px`` of each view, and ``share_valid``.

    Raises
    ------
    InputError
        If the views cannot be compared, tell nothing of depth, or a setting is out of range.

    Warns
    -----
    FocalGradientWarning
        If the views are shifted by more than 0.25 pixel, or leave the side of focus open.

    Examples
    --------
    A textured wall at 1.25 m, a pinhole view and one at f/4 focused at 1 m: its blur disc has a radius of 2.4 pixels.

    >>> import numpy as np
    >>> from focalgradient import Lens
    >>> from focalgradient.psf import transfer
    >>> sharp, wide = (Lens(focal_length=0.025, f_number=n, focus_distance=1.0) for n in (np.inf, 4))
    >>> pixel_angle = 2.6e-4
    >>> rng = np.random.default_rng(1)
    >>> frequency = np.hypot(np.fft.fftfreq(128)[:, None], np.fft.rfftfreq(128))
    >>> spectrum = np.fft.rfft2(rng.standard_normal((128, 128))) / np.maximum(frequency, 1 / 128)
    >>> blurred = spectrum * transfer(frequency, wide.blur_radius(1.25) / pixel_angle, "disc")
    >>> images = [100 + np.fft.irfft2(s) + 0.01 * rng.standard_normal((128, 128)) for s in (spectrum, blurred)]
    >>> views = [View(image, lens, pixel_angle) for image, lens in zip(images, (sharp, wide))]
    >>> depth = recover_depth(views, near=1.0)
    >>> round(float(np.median(depth.distance[depth.valid])), 2)
    1.25
    """
    views = list(views)
    if method not in METHODS:
        raise InputError(f"method is {method!r}, but must be one of {', '.join(METHODS)}.")
    say = progress or (lambda stage: None)
    asked = RecoverySettings(method, near, far, psf, k, window, noise, align, false_alarm, say)
    asked.check(len(views))
    check_usable(views, method)
    if window > min(views[0].shape) / 4:
        raise InputError(
            f"window is {window:g} pixels, but may be a quarter of the views' smaller side at most, which is "
            f"{min(views[0].shape)} pixels: give a smaller window."
        )
    # Imported here, for `import focalgradient` to stay light.
    recover = import_module(f"focalgradient.depth.{METHODS[method].module}").recover
    return recover(views, asked)


def check_usable(views: Sequence[View], method: str) -> None:
    """Refuse views that the method cannot use, or that tell nothing of depth."""
    least, most = METHODS[method].least, METHODS[method].most
    if len(views) < least:
        raise InputError(
            f"{len(views)} view{'s' * (len(views) > 1)} given, but method {method!r} needs {least} or more: add a view."
        )
    if most is not None and len(views) > most:
        raise InputError(f"{len(views)} views given, but method {method!r} takes {most} at most: give fewer.")
    for number, view in enumerate(views, 1):
        if view.shape != views[0].shape:
            sizes = [f"{v.shape[1]} x {v.shape[0]}" for v in (views[0], view)]
            raise InputError(
                f"view 1 is {sizes[0]} pixels but view {number} is {sizes[1]}, and all views must be of one size: "
                "crop or scale them alike."
            )
        image = view.image
        top = image.max()
        if not top > 0:
            raise InputError(f"view {number} is black, but depth needs a lit scene: check its exposure.")
        if image.min() == top or (image == top).mean() > 0.5:
            raise InputError(
                f"view {number} is {'constant' if image.min() == top else 'saturated over more than half its pixels'}, "
                "so that it shows no texture to compare: expose it so that the scene keeps below the maximum."
            )
    if min(views[0].shape) < 32:
        raise InputError(f"the views are {views[0].shape[1]} x {views[0].shape[0]} pixels, but at least 32 are needed.")
    optics = {(v.optics.aperture_diameter, v.optics.focus_vergence) for v in views}
    if (len(optics) == 1 and least > 1) or all(aperture == 0 for aperture, _ in optics):
        raise InputError(
            "all views are blurred alike (same aperture and focus, or pinholes all), so that they tell nothing of "
            "depth: change the aperture or the focus of one."
        )
