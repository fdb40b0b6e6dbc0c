"""The real-time form: the ratio of two views' detail (Pentland 1987, sections III.B-C, Fig. 5)."""

from focalgradient.depth.ratio.disparity import detail, focal_disparity, read_depth, table_for
from focalgradient.depth.ratio.table import DisparityTable

__all__ = ["DisparityTable", "detail", "focal_disparity", "read_depth", "table_for"]
