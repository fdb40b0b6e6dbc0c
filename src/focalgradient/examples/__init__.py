"""Small example files for every input of the library, with known truth: ray-cast photographs, simulated ratings."""

from focalgradient.examples.files import EXAMPLE_FILES, example_files
from focalgradient.examples.warming import depth_compiling

__all__ = ["EXAMPLE_FILES", "depth_compiling", "example_files"]
