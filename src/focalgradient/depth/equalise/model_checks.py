"""Whether other models explain the views better than the one asked for: what is stated of it, and warned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from focalgradient.depth.equalise.alternatives import Alternative, judge_alternatives
from focalgradient.depth.equalise.blur_shape import judge_shape
from focalgradient.depth.equalise.optics_check import judge_optics
from focalgradient.depth.equalise.split_band import SplitBand
from focalgradient.depth.estimate import Problem
from focalgradient.depth.model_error import DOUBTFUL, LARGEST_TAU
from focalgradient.depth.search import Blurs
from focalgradient.psf import Disc, Psf

__all__ = ["ModelChecks", "check_model", "error_with", "likelier_model"]


@dataclass(frozen=True, slots=True)
class ModelChecks:
    """What alternative models of the views show."""

    details: dict[str, Any] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)


def likelier_model(problem: Problem, blurs: Blurs, noise_sd: Sequence[float]) -> Alternative | None:
    """The alternative that explains views in one waveband clearly better, if one does."""
    # A displacement, which the user is warned about, looks like other blur.
    if problem.registered.warnings or blurs.frequencies.down is not None or blurs.parts:
        return None
    return judge_alternatives(problem, blurs, noise_sd, isinstance(problem.settings.psf, Disc))


def error_with(split: SplitBand, alternative: Alternative | None) -> float:
    """Model error as a share of the blur radius: by the split-band test, or what an alternative would change."""
    return split.tau if alternative is None else max(split.tau, min(alternative.change, LARGEST_TAU))


def check_model(
    problem: Problem,
    noise_sd: Sequence[float],
    split: SplitBand,
    alternative: Alternative | None,
    misfit: float,
    explained: float,
    any_valid: bool,
) -> ModelChecks:
    """Compare the stated optics, and the shape of blur, with others, for views in one waveband.

    `misfit` is the frame's median misfit, `explained` the share of its texture that the model explains.
    """
    shape = problem.settings.psf if isinstance(problem.settings.psf, Psf) else None
    shapes: dict[str, dict[str, float]] = {}
    slips: dict[str, float] = {}
    texts: list[str] = []
    if shape is not None:
        slips, texts = judge_optics(problem, shape, misfit, explained, split.tau)
    # A displacement, which the user is warned about, looks like blur of another shape.
    if not problem.registered.warnings and any_valid:
        by_slip, is_better = texts, False
        if shape is not None and not by_slip:
            shapes, texts, is_better = judge_shape(split, problem, shape, noise_sd)
        larger = [alternative.text] if alternative is not None and alternative.change >= DOUBTFUL else []
        if by_slip:
            texts = [*by_slip, *larger]
        elif not is_better:
            texts = split.warnings() or larger or texts
    details = {"fit_by_shape": shapes, "fit_by_optics": slips}
    if alternative is not None:
        details["likelier"] = asdict(alternative)
    return ModelChecks({name: found for name, found in details.items() if found}, texts)
