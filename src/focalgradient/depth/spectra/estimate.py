"""Depth by regression of patches' log spectral ratio (Pentland 1987, Eqs. 7-11), without its bias."""

from __future__ import annotations

from scipy import stats

from focalgradient.depth.noise import noise_from_residuals
from focalgradient.depth.search import Estimate, Problem
from focalgradient.depth.spectra.pairs import Differences
from focalgradient.depth.validity import DOUBTFUL, LARGEST_TAU, blur_is_known

__all__ = ["estimate"]


def estimate(problem: Problem) -> Estimate:
    """Estimate depth by comparison of local spectra, for `focalgradient.recover_depth`."""
    search, registered, settings = problem.search, problem.registered, problem.settings
    count = len(problem.views)
    settings.progress(0.15, "estimating noise")
    blurs = search.blurs(settings.shape)
    noise_sd, _ = noise_from_residuals(registered, blurs, settings.window, settings.given_noise(count))
    settings.progress(0.4, "comparing spectra")
    differences = Differences.of(registered, search, noise_sd, settings.shape, settings.window)
    settings.progress(0.7, "estimating depth")
    joint = differences.estimate()
    agrees = joint.agrees(settings.false_alarm)
    # A depth at the end of the search must fit as well as any.
    inside = joint.misfit <= stats.chi2.isf(settings.false_alarm, count - 1)
    # The model's error is stated, and no reason to claim nothing, until most of it is the model's.
    known = (joint.tau <= LARGEST_TAU) & blur_is_known(joint.noise_sd * search.slope, search.radius(joint.vergence))
    disagreeing = float(1 - agrees[joint.whole].mean()) if joint.whole.any() else 0.0
    texts = []
    if joint.tau >= DOUBTFUL and disagreeing < 0.5:  # views that contradict each other are not a matter of blur's shape
        texts.append(
            f"the blur is not quite {settings.shape}: depth from coarse detail and depth from fine detail differ by "
            f"{joint.tau:.0%} of the blur, which is part of the standard deviations; compare method equalise, which "
            "names the likelier shape, or check focus and apertures."
        )
    valid = joint.to_blocks(known & agrees & inside & joint.unambiguous, registered.shape) & registered.usable
    return Estimate(
        joint.to_pixels(joint.vergence, search.spacing, registered.shape),
        joint.to_pixels(joint.vergence_sd, search.spacing, registered.shape),
        valid,
        noise=[sd * gain for sd, gain in zip(noise_sd, registered.gains, strict=True)],
        details={"tau": joint.tau, "share_disagreeing": disagreeing},
        warnings=texts,
    )
