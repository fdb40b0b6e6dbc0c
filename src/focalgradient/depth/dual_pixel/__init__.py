"""Depth from the two halves of dual pixels: what displaces them in opposite directions, over the whole image."""
