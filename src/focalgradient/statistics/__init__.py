"""Statistical analysis: tables of answers in, frozen records of results out.

Apply the exclusion criteria with `quality` first, then analyse with `depth_rating` or `necker`. A result that cannot be
computed is replaced by a `NotComputed` that states the reason. All results generalise over subjects, also with few
subjects.
"""

from focalgradient.statistics.comparisons import (
    ComparisonMean,
    ComparisonResult,
    compare_pictures,
)
from focalgradient.statistics.condition_test import ConditionTest, planned_interactions, planned_tests
from focalgradient.statistics.conditions import condition_tests
from focalgradient.statistics.crossed import Components
from focalgradient.statistics.cube import (
    Dominance,
    GradientEffect,
    NeckerResult,
    PeopleDominance,
    PerceptShare,
    SubjectShare,
    necker,
)
from focalgradient.statistics.detection import (
    Detection,
    DetectionGroup,
    RatingRoc,
    detection_by_person,
    rating_roc,
    sensitivity,
    type2_area,
)
from focalgradient.statistics.dominance import (
    DominanceModel,
    PerceptDurations,
    fit_dominance,
    log_likelihood_of_people,
)
from focalgradient.statistics.durations import (
    DurationFit,
    DurationsOfPeople,
    DurationsOfPerson,
    fit_durations_of_people,
)
from focalgradient.statistics.effects import analyse
from focalgradient.statistics.exclusions import Exclusion, Quality, Rules, SubjectQuality, Unjudged, quality
from focalgradient.statistics.factors import factor_effects
from focalgradient.statistics.hypotheses import Equivalence
from focalgradient.statistics.ordinal import OrdinalResult, StepShare, Threshold
from focalgradient.statistics.ratings import (
    DepthRatingResult,
    FixationResult,
    RatingMean,
    Scale,
    SceneMean,
    SubjectMean,
    depth_rating,
)
from focalgradient.statistics.records import Effect, Interval, NotComputed, as_table
from focalgradient.statistics.response_times import ResponseTimes, response_times
from focalgradient.statistics.thresholds import (
    SubjectThreshold,
    ThresholdFit,
    ThresholdResult,
    blur_thresholds,
    fit_threshold,
)
from focalgradient.user_tables.detection import OwnDetection, read_detection
from focalgradient.user_tables.ratings import OwnRatings, read_ratings
from focalgradient.user_tables.reports import OwnReports, read_reports
from focalgradient.user_tables.thresholds import OwnThresholds, read_thresholds

__all__ = [
    "ComparisonMean",
    "ComparisonResult",
    "Components",
    "ConditionTest",
    "DepthRatingResult",
    "Detection",
    "DetectionGroup",
    "Dominance",
    "DominanceModel",
    "DurationFit",
    "DurationsOfPeople",
    "DurationsOfPerson",
    "Effect",
    "Equivalence",
    "Exclusion",
    "FixationResult",
    "GradientEffect",
    "Interval",
    "NeckerResult",
    "NotComputed",
    "OrdinalResult",
    "OwnDetection",
    "OwnRatings",
    "OwnReports",
    "OwnThresholds",
    "PeopleDominance",
    "PerceptDurations",
    "PerceptShare",
    "Quality",
    "RatingMean",
    "RatingRoc",
    "ResponseTimes",
    "Rules",
    "Scale",
    "SceneMean",
    "StepShare",
    "SubjectMean",
    "SubjectQuality",
    "SubjectShare",
    "SubjectThreshold",
    "Threshold",
    "ThresholdFit",
    "ThresholdResult",
    "Unjudged",
    "analyse",
    "as_table",
    "blur_thresholds",
    "compare_pictures",
    "condition_tests",
    "depth_rating",
    "detection_by_person",
    "factor_effects",
    "fit_dominance",
    "fit_durations_of_people",
    "fit_threshold",
    "log_likelihood_of_people",
    "necker",
    "planned_interactions",
    "planned_tests",
    "quality",
    "rating_roc",
    "read_detection",
    "read_ratings",
    "read_reports",
    "read_thresholds",
    "response_times",
    "sensitivity",
    "type2_area",
]
