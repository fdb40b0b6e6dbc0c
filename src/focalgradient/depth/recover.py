"""Recover a depth map from views, by any of the methods."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Annotated

import numpy as np

from focalgradient.depth.common_error import KnownPoint, checked_points, common_modes, stated_parts, with_known_points
from focalgradient.depth.depth_map import DepthMap
from focalgradient.depth.settings import (
    METHODS,
    BlurSource,
    MethodName,
    RecoverySettings,
    blur_source,
    check_blur,
    check_usable,
    checked_views,
    halves_of,
)
from focalgradient.depth.validity import NEARLY_NOTHING
from focalgradient.errors import FocalGradientWarning, check_one_of
from focalgradient.optics import capabilities
from focalgradient.plausibility import too_near
from focalgradient.progress import Progress, silent
from focalgradient.psf import Psf
from focalgradient.quantities import FOCUS, LIMIT
from focalgradient.view import View

if TYPE_CHECKING:
    from focalgradient.depth.causes import Cause
    from focalgradient.depth.search import Estimate, Problem

__all__ = ["recover_depth"]

CAUSES_NAMED, SECOND_CAUSE = 2, 0.7
"""Maximum number of likely causes named if nothing is valid, and minimum evidence for the second. Chosen by hand."""

UNPLACED = {"scenes", "noise", "texture"}
"""Likeliest causes of a map without depth with which views fit together at a place by chance."""


def recover_depth(
    views: Sequence[View],
    *,
    method: MethodName = "equalise",
    near: Annotated[float | None, LIMIT] = None,
    far: Annotated[float | None, FOCUS] = None,
    psf: BlurSource | str = "auto",
    k: float | None = None,
    window: float = 8.0,
    noise: float | Sequence[float] | None = None,
    align: bool = False,
    false_alarm: float = 1e-3,
    outlines: bool = True,
    known_points: Iterable[KnownPoint] = (),
    dense: bool = False,
    progress: Progress | None = None,
) -> DepthMap:
    """Recover depth from views of one scene by their blur.

    Parameters
    ----------
    views
        Two or more views of one scene, of one size, that differ in aperture, in focus, or in both. Depth comes on
        the first view's pixels. Views whose pixel angles differ (focusing changes magnification) are brought to the
        first view's; exposures may differ by an unknown gain. Pixels outside a view's mask are left out; of a view
        without a mask, pixels at its highest value, where many share it, are taken for saturated, and lone pixels
        far outside the texture around them for hot or dead. The left and right view of dual pixels
        (`focalgradient.optics.DualPixel`) are compared by what displaces them: signed depth from
        one shot, by ``"dual-pixels"``, which takes the place of ``"equalise"``.
    method
        How blur is measured.

        - ``"equalise"``: maximum likelihood by equalisation over the whole image (Eqs. 7-11, for any optics);
        - ``"spectra"``: regression of the log ratio of patches' spectra (Eqs. 7-11);
        - ``"ratio"``: the real-time form, the ratio of Laplacian energies (section III); two views of one focus;
        - ``"edges"``: sharp edges, from one view (Eqs. 2-6): valid on contours only;
        - ``"autofocus"``: the best focus of a stack of three or more focus settings at one aperture; no blur model;
        - ``"dual-pixels"``: the displacement of the left and right half of one lens; their default.
    near
        Nearest distance of the search, in metres.  [default: where blur is 16 pixels]
    far
        Farthest distance of the search, in metres.  [default: where blur is 16 pixels]
    psf
        Where the views' blur comes from: ``"optics"``, the blur that the views' optics offer
        (`focalgradient.optics.own_blur`; method ``"equalise"`` only), a disc for optics that offer none; or its shape,
        a `focalgradient.psf.Psf` such as ``Polygon(blades=5)``, or the name of one: ``"disc"``, ``"gaussian"``,
        ``"blend"`` (a disc with a Gaussian rim), ``"annulus"``, ``"polygon"`` or one that another package adds.
        ``"auto"`` takes the optics' own where any offer it, else a disc. `focalgradient.depth.methods_for` lists the
        methods that can use a shape.
    k
        Of a Gaussian, or a blend's rim, given by name: sigma / disc radius. By default the shape's own, 0.5 and 0.35.
    window
        Standard deviation in pixels of the Gaussian window in which depth is estimated.
    noise
        Standard deviation of the pixels' noise in the images' units, one for all or one for each view; estimated
        for each view where not given.
    align
        Measure translation, rotation and scale between the views and remove them first.
    false_alarm
        Probability with which the check masks a pixel whose views do agree.
    outlines
        By ``"equalise"``: find outlines, where depth jumps, and continue either surface up to them; else depth is
        what windows give, which reach across outlines. Depth away from outlines is the same.
    known_points
        Measured points: each a column and a row in pixels, and the distance in metres from the entrance pupil. They
        correct focus and apertures within the tolerance that the optics state (`Lens`), and what remains uncertain of
        these is the map's ``common_sd``: one point corrects the focus, two the scale of the apertures as well.
    dense
        Complete the map: at pixels that are not valid `vergence` and `vergence_sd` are then what the valid ones and the
        picture's edges make likely (`focalgradient.depth.dense.complete`), and the map's `evidence` gives how each is
        known. Valid pixels stay as they are. Where nothing is valid, nothing is completed.
    progress
        Called at each stage with the share of the work that is done and a few words (`focalgradient.progress`).

    Both sides of focus are searched, unless `near` or `far` is given; limits extend the search, to a blur of 64 pixels
    in radius at most. ``details["searched_vergence_D"]`` states the range searched.

    Returns
    -------
    DepthMap
        ``details`` holds the settings, the blur that was used (``psf``, None where the method has no model of it, and
        ``psf_parameters``), ``side`` (how the side of focus was decided), ``noise``, ``gain`` and
        ``shift_px`` and ``turn_deg`` (clockwise) of each view, ``share_valid``, and ``common_sd_D``: what focus and
        apertures each leave uncertain at the median vergence. By ``"equalise"`` also
        ``split_band``: ``tau``, the blur model's error as a share of the blur radius, by which coarse and fine detail
        disagree and which is part of
        ``vergence_sd``, and the cuts between the two; and ``outlines``, those found: a list of curves, each a list of
        points (column, row) in pixels from the first pixel's centre, with the near side on the right of the way;
        and ``noise_by_brightness``: the ``share`` of the noise's variance that is in proportion to brightness, at a
        ``brightness`` of the views, or None; and ``likelier``, where another model explains the views better, with what
        depth would change by; and, of compressed views, ``coarse_detail``: the shares of the pixels at which depth by
        coarse detail is joined with that by fine detail, or added to it, and its ``tau``. Where no pixel is valid, or
        less than 1 %, ``rejected`` gives the likeliest cause and
        ``rejected_causes`` all, ranked (`focalgradient.depth.causes.Cause`). By ``"spectra"`` also ``tau``, the same
        error as its bands show it. Neither ``"ratio"`` nor ``"edges"`` without a calibration knows such an error: their
        ``vergence_sd`` holds for blur of the shape that is assumed.

    Raises
    ------
    InputError
        If the views cannot be compared, or are uninformative about depth, or a setting is out of range.

    Warns
    -----
    FocalGradientWarning
        If nothing is valid (with the likeliest cause), or the views are shifted by more than 0.25 pixel, or leave the
        side of focus open, or show blur of another shape than `psf`.

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
    views = checked_views(views)
    points = checked_points(known_points, near, far)
    check_one_of("method", method, METHODS)
    if method == "equalise" and halves_of(views) is not None:
        method = "dual-pixels"
    say = progress or silent
    source = blur_source(psf, k)
    settings = RecoverySettings(method, near, far, source, window, noise, align, false_alarm, say, outlines)
    problem = problem_of(views, settings)
    # Imported here, for `import focalgradient` to stay light.
    from focalgradient.parallel import linear_algebra_on_one_thread

    with linear_algebra_on_one_thread:
        estimate: Estimate = METHODS[method].load().estimate(problem)
        misordered = _misordered(problem, estimate)
    causes = _causes(problem, estimate, misordered)
    order = [f"{misordered}."] if misordered and not causes else []
    for text in [*_nothing_valid(estimate, causes), *order, *_warnings(problem, estimate, causes)]:
        warnings.warn(FocalGradientWarning(text), stacklevel=2)
    say(1.0, "done")
    found = with_known_points(_depth_map(problem, estimate, causes), points)
    return completed(found, views, window) if dense else found


def problem_of(views: Sequence[View], settings: RecoverySettings) -> Problem:
    """Return the checked and registered views with their search range, for the method of the settings."""
    settings.check(len(views))
    check_usable(views, settings.method, settings.window)
    from focalgradient.depth.registration import RegisteredViews
    from focalgradient.depth.search import Problem, Search

    optics = [view.optics for view in views]
    settings = settings.resolved(optics)
    check_blur(settings.method, settings.psf)
    method = METHODS[settings.method].load()
    if hasattr(method, "check"):
        method.check(views)
    search = Search.over(optics, views[0].pixel_angle, settings.near, settings.far, settings.psf)
    settings.progress(0.0, "registering the views")
    return Problem(views, RegisteredViews.of(views, settings.align), search, settings)


def completed(found: DepthMap, views: Sequence[View], window: float) -> DepthMap:
    """Complete a map with any valid pixel, by the edges of the view with the smallest aperture."""
    if not found.valid.any():
        return found
    from focalgradient.depth.dense import complete

    sharpest = min(views, key=lambda view: view.optics.aperture_diameter)
    lowest, highest = found.details["searched_vergence_D"]
    searched = float(lowest), float(highest)
    vergence, sd, evidence = complete(
        found.vergence, found.vergence_sd, found.valid, sharpest.image, window, searched=searched
    )
    return replace(found, vergence=vergence, vergence_sd=sd, evidence=evidence)


def _misordered(problem: Problem, estimate: Estimate) -> str | None:
    """Return a clause about f-numbers in the opposite order, unless a slip of the optics was already named."""
    from focalgradient.depth.hypotheses import likelier_slip, misordered_apertures

    is_named = likelier_slip(estimate.details.get("fit_by_optics", {})) is not None
    return None if is_named else misordered_apertures(problem.registered, problem.search)


def _causes(problem: Problem, estimate: Estimate, misordered: str | None) -> list[Cause]:
    """Return the likely causes where almost no pixel is valid; of edges, which are sparse, where none is."""
    least = 0.0 if problem.settings.method == "edges" else NEARLY_NOTHING
    if estimate.valid.any() and estimate.valid.mean() >= least:
        return []
    from focalgradient.depth.causes import likely_causes

    return likely_causes(problem, estimate, misordered)


def _nothing_valid(estimate: Estimate, causes: Sequence[Cause]) -> list[str]:
    """Return the warning for a map without depth: its likeliest causes."""
    if not causes:
        return []
    share = f"only {estimate.valid.mean():.1%} of the pixels are" if estimate.valid.any() else "no pixel is"
    likely = "; otherwise: ".join(cause.text for cause in causes[:CAUSES_NAMED] if cause.evidence > SECOND_CAUSE)
    return [f"{share} valid, most likely because {likely}."]


def _depth_map(problem: Problem, estimate: Estimate, causes: Sequence[Cause]) -> DepthMap:
    """Make the map of an estimate, with its details."""
    registered, search, settings = problem.registered, problem.search, problem.settings
    lowest, highest = estimate.searched or (search.lowest, search.highest)
    details = {
        **settings.stated(),
        **({"psf": None, "psf_parameters": {}, "k": None} if METHODS[settings.method].needs is None else {}),
        "searched_vergence_D": [float(lowest), float(highest)],
        "side": search.side_text,
        "noise": [float(sd) for sd in estimate.noise],
        "noise_estimated": settings.noise is None,
        "gain": registered.gains,
        "shift_px": [[p.down, p.right] for p in registered.placements],
        "scale": [p.scale for p in registered.placements],
        "turn_deg": [math.degrees(p.turn) for p in registered.placements],
        **estimate.details,
        "share_valid": float(estimate.valid.mean()),
    }
    assumptions = dict.fromkeys(capabilities(optics).assumption for optics in search.optics)
    if any(assumptions):
        details["assumes"] = [sentence for sentence in assumptions if sentence]
    if search.side_known and (alike := search.blurred_alike(settings.psf)):
        details["blurred_alike_D"] = list(alike)
    if causes:
        details["rejected"] = causes[0].text
        details["rejected_causes"] = [asdict(cause) for cause in causes]
    by_blur = METHODS[settings.method].needs is not None
    if estimate.valid.any():
        middle = float(np.median(estimate.vergence[estimate.valid]))
        details["common_sd_D"] = stated_parts(middle, search.optics, by_blur)
    side_known = np.full(registered.shape, search.side_known) & estimate.side_known
    common = common_modes(estimate.vergence, search.optics, by_blur)
    return DepthMap(
        estimate.vergence,
        estimate.vergence_sd,
        estimate.valid,
        side_known,
        details,
        common_errors=common,
        beyond=estimate.beyond,
    )


def _warnings(problem: Problem, estimate: Estimate, causes: Sequence[Cause]) -> list[str]:
    """Return the warnings to issue, each a sentence."""
    texts: list[str] = []
    own = [type(view.optics).__name__ for view in problem.views if capabilities(view.optics).forms_views]
    if own and isinstance(problem.settings.psf, Psf):
        texts.append(
            f"the blur is taken for {problem.settings.psf}, as asked for, but the optics ({own[0]}) offer a blur of "
            "their own: psf 'optics' uses it."
        )
    # A texture that is not quite the same seems displaced, and so do what coma blurs, noise and different scenes.
    is_one_texture = len(set(problem.search.wavebands)) == 1 and not {cause.name for cause in causes[:1]} & UNPLACED
    if is_one_texture and problem.search.isotropic:
        texts += problem.registered.warnings
    if not problem.search.side_known:
        texts.append(problem.search.side_text)
    if estimate.valid.any():
        foci = [(one.focus_vergence, getattr(one, "focal_length", None)) for one in problem.search.optics]
        vergence = float(np.median(estimate.vergence[estimate.valid]))
        texts += filter(None, [too_near(1 / vergence if vergence > 0 else math.inf, foci)])
    return texts + list(estimate.warnings)
