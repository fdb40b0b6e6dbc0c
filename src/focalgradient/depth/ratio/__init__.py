"""The real-time form: the ratio of two views' detail (Pentland 1987, sections III.B-C, Fig. 5)."""

from focalgradient.depth.ratio.disparity import detail, fine_noise_floor, focal_disparity, read_depth, table_for
from focalgradient.depth.ratio.energies import luminance
from focalgradient.depth.ratio.table import DisparityTable

__all__ = [
    "DisparityTable",
    "detail",
    "fine_noise_floor",
    "focal_disparity",
    "luminance",
    "read_depth",
    "table_for",
]
