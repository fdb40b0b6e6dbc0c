"""Published experiments as records, and predictions of their findings by simulated observers."""

from focalgradient.published.experiments import EXPERIMENTS, kruger1993
from focalgradient.published.record import (
    AGREES,
    CANNOT_BE_ASKED,
    DIFFERS,
    UNDECIDED,
    Finding,
    Prediction,
    Published,
    Source,
    simulate,
)
from focalgradient.published.table import Row, csv_of, markdown, predicted_beside_published

__all__ = [
    "AGREES",
    "CANNOT_BE_ASKED",
    "DIFFERS",
    "EXPERIMENTS",
    "UNDECIDED",
    "Finding",
    "Prediction",
    "Published",
    "Row",
    "Source",
    "csv_of",
    "kruger1993",
    "markdown",
    "predicted_beside_published",
    "simulate",
]
