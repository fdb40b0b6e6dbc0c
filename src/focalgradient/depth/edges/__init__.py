"""Depth from the blur of sharp edges, in one view (Pentland 1987, section II.A, Eqs. 2-6)."""

from focalgradient.depth.edges.measure import Edges, average_segments, measure_edges

__all__ = ["Edges", "average_segments", "measure_edges"]
