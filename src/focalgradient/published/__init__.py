"""Published experiments as records, asked of simulated observers: what is predicted beside what was found."""

from focalgradient.published.experiments import EXPERIMENTS
from focalgradient.published.record import (
    AGREES,
    CANNOT_BE_ASKED,
    DIFFERS,
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
    "Finding",
    "Prediction",
    "Published",
    "Row",
    "Source",
    "csv_of",
    "markdown",
    "predicted_beside_published",
    "simulate",
]
