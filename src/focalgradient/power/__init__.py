"""Power analysis: whole experiments are simulated and analysed, and their significant results counted.

Subjects are drawn from a *statistical* model, not simulated from pictures: results are only as good as that model.

"""

from focalgradient.power.cube import CUBE_TESTS, CubeModel, quick_cube_power, simulated_reports
from focalgradient.power.latent import LatentModel, latent_power, simulated_answers
from focalgradient.power.own_tasks import Observers
from focalgradient.power.ratings import Model, quick_power, simulated_ratings
from focalgradient.power.running import Power, power, run, run_here, share_interval, subjects_needed
from focalgradient.power.sensitivity import sensitivity
from focalgradient.power.studies import study_of
from focalgradient.power.study import AnyStudy, Claim, People, Study
from focalgradient.power.thresholds import ThresholdModel

__all__ = [
    "CUBE_TESTS",
    "AnyStudy",
    "Claim",
    "CubeModel",
    "LatentModel",
    "Model",
    "Observers",
    "People",
    "Power",
    "Study",
    "ThresholdModel",
    "latent_power",
    "power",
    "quick_cube_power",
    "quick_power",
    "run",
    "run_here",
    "sensitivity",
    "share_interval",
    "simulated_answers",
    "simulated_ratings",
    "simulated_reports",
    "study_of",
    "subjects_needed",
]
