"""Depth from a stack of focus settings, by the setting at which each point is sharpest."""
