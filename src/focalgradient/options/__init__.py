"""Options of command lines, stated once as typed parameters with their descriptions, and messages that name them."""

from focalgradient.options.messages import options_named, sentences
from focalgradient.options.parameters import File, Folder, Given, Made, parsed

__all__ = ["File", "Folder", "Given", "Made", "options_named", "parsed", "sentences"]
