"""Local spectra across apertures, and the check that every pair of views agrees (Pentland 1987, Eqs. 7-11)."""

from focalgradient.depth.spectra.check import Check, Pair, check_views
from focalgradient.depth.spectra.difference import spectral_difference

__all__ = ["Check", "Pair", "check_views", "spectral_difference"]
