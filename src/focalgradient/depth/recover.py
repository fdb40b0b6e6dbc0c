"""From views to a depth map: checks, one grid and one exposure, equalisation, and what is to be trusted."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from focalgradient.depth.depthmap import DepthMap
from focalgradient.depth.search import Search
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.psf import DISC_K, MODELS, PsfName
from focalgradient.view import View

if TYPE_CHECKING:
    from focalgradient.depth.equalise import Equalised, Nodes
    from focalgradient.depth.placed import Placed

__all__ = ["recover_depth"]

Image = NDArray[np.float32]
Progress = Callable[[str], None]

CHECK_SIDE = 5
"""Side in pixels of the squares in which the views' agreement is tested."""

MODEL_ERROR = 0.03
"""Error of real lenses' blur against the model, as a share of its radius, that is not yet a contradiction."""

LENIENCE = 2.0
"""Times the noise that an image can hold up to which what is left of the views is put down to noise."""

MISFIT = 4.0
"""Times the noise's power that may be left of the views in the wide window, beyond which nothing is claimed."""

ROUNDS = 6
"""Times that contradicting pixels are looked for, at most."""


def recover_depth(
    views: Sequence[View],
    *,
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
    """Recover depth from two or more views that differ in aperture, in focus, or in both.

    Maximum likelihood by equalisation over the whole image (Pentland 1987, Eqs. 7-11, for any optics): see
    `focalgradient.depth.equalise`.

    Parameters
    ----------
    views
        Two or more views of one scene, of one size. Depth comes on the first view's pixels. Views whose pixel angles
        differ (focusing changes magnification) are brought to the first view's; exposures may differ by any gain.
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

    >>> from focalgradient import Lens
    >>> from focalgradient.psf import transfer
    >>> sharp, wide = (Lens(focal_length=0.025, f_number=n, focus_distance=1.0) for n in (math.inf, 4))
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
    say = progress or (lambda stage: None)
    views = list(views)
    _check_settings(near, far, psf, k, window, noise, false_alarm, len(views))
    _check_views(views)
    search = Search.over(views, near, far)

    # Imported here, for `import focalgradient` to stay light.
    from focalgradient.depth.placed import Placed

    say("placing the views")
    placed = Placed.of(views, align)
    say("measuring noise")
    noise_sd, raisable = _noise(noise, placed, search, psf, k, window)
    say("equalising blur")
    equalised = search.equalise(placed.images, noise_sd, psf, k, window)
    say("reading depth")
    tolerance = MODEL_ERROR * search.radius(search.vergences) / (search.slope * search.spacing)
    nodes, agrees, scale = _read_robustly(equalised, placed, false_alarm, tolerance, raisable)

    level = equalised.to_pixels(nodes.level, nodes.sd, placed.shape)
    sd_level = equalised.to_pixels(nodes.sd, nodes.sd, placed.shape)
    vergence = (search.lowest + level * search.spacing).astype(np.float32)
    vergence_sd = (sd_level * search.spacing).astype(np.float32)
    # Texture enough: blur known to 0.3 pixel or to a tenth, and told by signal rather than by noise.
    blur = search.radius(vergence.astype(float))
    clear = vergence_sd * search.slope <= np.maximum(0.3, 0.1 * blur)
    told = nodes.alone & nodes.inside & (nodes.texture >= 1) & (nodes.support >= 0.1) & (nodes.misfit < MISFIT)
    valid = clear & agrees & equalised.to_blocks(told, placed.shape)
    if not search.side_known:
        warnings.warn(FocalGradientWarning(search.side_text), stacklevel=2)
    details = {
        "method": "equalise",
        "near_m": near,
        "far_m": far,
        "searched_vergence_D": [search.lowest, search.highest],
        "psf": psf,
        "k": k,
        "window_px": window,
        "align": align,
        "false_alarm": false_alarm,
        "side": search.side_text,
        "noise": [float(sd * gain * math.sqrt(scale)) for sd, gain in zip(noise_sd, placed.gains, strict=True)],
        "noise_estimated": noise is None,
        "gain": placed.gains,
        "shift_px": [[p.down, p.right] for p in placed.found],
        "scale": [p.scale for p in placed.found],
        "misfit": float(np.median(nodes.misfit)),
        "share_disagreeing": float(1 - agrees.mean()),
        "share_valid": float(valid.mean()),
    }
    side_known = np.full(placed.shape, search.side_known)
    return DepthMap(vergence, vergence_sd, valid, side_known, details)


def _noise(
    noise: float | Sequence[float] | None, placed: Placed, search: Search, psf: PsfName, k: float, window: float
) -> tuple[list[float], float | None]:
    """Standard deviation of each placed view's noise, as given or from what equalising leaves of the busiest part.

    Also returns by how much its variance may still be raised, as the whole frame may ask for; None where it is given.
    """
    from focalgradient.depth.filters import fine_noise

    if noise is not None:
        given = np.broadcast_to(np.asarray(noise, float), len(placed.images))
        return [float(sd / gain) for sd, gain in zip(given, placed.gains, strict=True)], None
    part = placed.busiest(192)
    spread = float(np.mean([image.std() for image in part.images]))
    floor = 2e-4 * spread  # storage and rounding leave at least this
    gains = np.array(placed.gains)
    # An upper bound first: what the finest detail of the most blurred view holds.
    level = max(floor, min(fine_noise(image) * gain for image, gain in zip(part.images, gains, strict=True)))

    # What an image holds of finest detail bounds its noise; that the blur model errs a little is counted as noise too.
    most = LENIENCE * np.array([fine_noise(image) for image in part.images]) + floor

    def settle(shape: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        """Noise of the given proportions, and how much speaks against them."""
        noise_sd = np.maximum(floor, level * shape)
        for _ in range(3):
            equalised = search.equalise(part.images, noise_sd.tolist(), psf, k, window)
            nodes = equalised.read(part.usable.astype(np.float32))
            change = math.sqrt(equalised.noise_found(nodes))
            # Of the wrong proportions the fit is uneven over the frame, and each view's residual says otherwise.
            misfit = np.log(nodes.misfit[nodes.support > 0.5])
            each = equalised.noise_by_view(equalised.look(nodes)) if uneven else np.ones(1)
            doubt = float(misfit.std() + 0.2 * np.ptp(np.log(each)))
            noise_sd = np.maximum(floor, noise_sd * min(change, float(np.min(most / noise_sd))))
            if 0.7 < change < 1.4:
                break
        return doubt, noise_sd

    # Noise comes after exposure, alike in all views, or before, in proportion to it.
    uneven = float(np.ptp(np.log(gains))) > 0.05
    shapes = [1 / gains, np.ones_like(gains)] if uneven else [1 / gains]
    _, noise_sd = min((settle(shape) for shape in shapes), key=lambda settled: settled[0])
    return [float(sd) for sd in noise_sd], float(np.min((most / noise_sd) ** 2))


def _read_robustly(
    equalised: Equalised, placed: Placed, false_alarm: float, tolerance: NDArray[np.float64], raisable: float | None
) -> tuple[Nodes, NDArray[np.bool_], float]:
    """Read depth without the pixels whose views contradict each other.

    Contradicting pixels mislead the windows around them, so they are found, left out, and looked for again.
    Returns the nodes, which pixels agree, and the noise variance in units of the one assumed.
    """
    from focalgradient.depth.equalise import GROWTH

    # Blur carries light in from beyond the frame: its rim is not read, and goes by what lies next to it.
    rim = min(round(equalised.window), min(placed.shape) // 8)
    middle = (slice(rim, -rim), slice(rim, -rim))
    frame = np.zeros(placed.shape, np.bool_)
    frame[middle] = True
    agrees = placed.usable
    # Only once: where contradiction is wide, what is left of it after each round would pass for ever less noise.
    weight = (agrees & frame).astype(np.float32)
    mean, support = equalised.averages(weight)
    some = equalised.minima(mean[:, ::2, ::2], support[::2, ::2])
    scale = min(raisable, equalised.noise_found(some)) if raisable is not None else 1.0
    nodes = equalised.minima(mean, support, scale)
    for _ in range(ROUNDS):
        seen, before = equalised.look(nodes), agrees
        agreement = equalised.agreement(seen, scale, CHECK_SIDE, false_alarm, tolerance)
        agrees = placed.usable & np.pad(agreement[middle], rim, mode="edge")
        if (before ^ agrees).mean() < 2e-3:
            break
        weight = (agrees & frame).astype(np.float32)
        nodes = equalised.read(weight, scale)
    nodes = replace(equalised.refine(nodes, seen, weight, scale, GROWTH[:2]), sd=nodes.sd)
    nodes = equalised.refine(nodes, equalised.look(nodes), weight, scale)  # again, about the first's answer
    return equalised.beside_jumps(nodes), agrees, scale


def _check_settings(
    near: float | None,
    far: float | None,
    psf: PsfName,
    k: float,
    window: float,
    noise: float | Sequence[float] | None,
    false_alarm: float,
    count: int,
) -> None:
    """Refuse settings out of range."""

    def positive(name: str, value: Any, unit: str) -> None:
        if not (np.ndim(value) == 0 and value > 0):
            raise InputError(f"{name} is {value!r}, but must be a positive number{unit}.")

    if near is not None:
        positive("near", near, " of metres")
    if far is not None:
        positive("far", far, " of metres")
    if near is not None and far is not None and near >= far:
        raise InputError(f"near {near:g} m lies beyond far {far:g} m, but must be less: exchange them.")
    if near is not None and math.isinf(near):
        raise InputError("near is infinite, but must be a finite distance in metres: leave it out to search all.")
    if psf not in MODELS:
        raise InputError(f"psf is {psf!r}, but must be one of {', '.join(MODELS)}.")
    positive("k", k, ", sigma / disc radius")
    if math.isinf(k):
        raise InputError("k is infinite, but must be finite: sigma / disc radius, 0.5 for the disc's second moment.")
    if not (np.ndim(window) == 0 and 2 <= window <= 64):
        raise InputError(f"window is {window!r}, but must be between 2 and 64 pixels.")
    values = np.asarray(1.0 if noise is None else noise, dtype=float)
    if values.ndim > 1 or values.size not in (1, count) or not np.all((values > 0) & np.isfinite(values)):
        raise InputError(f"noise is {noise!r}, but must be one positive number, or one for each of the {count} views.")
    if not 0 < false_alarm < 1:
        raise InputError(f"false_alarm is {false_alarm!r}, but must be a probability between 0 and 1.")


def _check_views(views: Sequence[View]) -> None:
    """Refuse views that cannot be compared or tell nothing of depth."""
    if len(views) < 2:
        raise InputError(f"{len(views)} view given, but depth by comparison needs two or more: add a view.")
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
    if len(optics) == 1 or all(aperture == 0 for aperture, _ in optics):
        raise InputError(
            "all views are blurred alike (same aperture and focus, or pinholes all), so that they tell nothing of "
            "depth: change the aperture or the focus of one."
        )
