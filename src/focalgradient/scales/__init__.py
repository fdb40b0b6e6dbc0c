"""Response scales: one class each, used by the laboratory, the browser, the files, the report and the power analysis.

A new scale is one class derived from `ResponseScale` in one file, registered by `register` or by an entry point of the
group "focalgradient.scales". `check_scale` verifies that it is complete.
"""

from focalgradient.analyses import Analysis, Choices, OrdinalSteps, Ratios, Slopes, analysis_named
from focalgradient.scales.base import AnswerColumn, ResponseScale
from focalgradient.scales.check import check_scale
from focalgradient.scales.controls import Control, Held, OwnControl, Scale, Steps, Ways
from focalgradient.scales.ratio import Ratio
from focalgradient.scales.registry import register, scale_class, scale_names, scale_of
from focalgradient.scales.signed import SignedComparison
from focalgradient.scales.steps import OrdinalScale
from focalgradient.scales.two_intervals import TwoIntervals
from focalgradient.scales.visual_analogue import VisualAnalogue

__all__ = [
    "Analysis",
    "AnswerColumn",
    "Choices",
    "Control",
    "Held",
    "OrdinalScale",
    "OrdinalSteps",
    "OwnControl",
    "Ratio",
    "Ratios",
    "ResponseScale",
    "Scale",
    "SignedComparison",
    "Slopes",
    "Steps",
    "TwoIntervals",
    "VisualAnalogue",
    "Ways",
    "analysis_named",
    "check_scale",
    "register",
    "scale_class",
    "scale_names",
    "scale_of",
]
