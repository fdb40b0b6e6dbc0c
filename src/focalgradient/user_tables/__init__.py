"""Reading of the user's own tables of answers: each kind of table is a schema, and every assumption is stated.

`focalgradient.statistics` hands on `read_ratings`, `read_reports`, `read_thresholds` and `read_detection`.
"""

from focalgradient.user_tables.conditions import OwnConditions, read_conditions
from focalgradient.user_tables.data_sets import data_sets
from focalgradient.user_tables.detection import OwnDetection, read_detection
from focalgradient.user_tables.files import Paths, UserTable, read_table
from focalgradient.user_tables.ratings import OwnRatings, read_ratings
from focalgradient.user_tables.reports import OwnReports, read_reports
from focalgradient.user_tables.source import Where
from focalgradient.user_tables.thresholds import OwnThresholds, read_thresholds

__all__ = [
    "OwnConditions",
    "OwnDetection",
    "OwnRatings",
    "OwnReports",
    "OwnThresholds",
    "Paths",
    "UserTable",
    "Where",
    "data_sets",
    "read_conditions",
    "read_detection",
    "read_ratings",
    "read_reports",
    "read_table",
    "read_thresholds",
]
