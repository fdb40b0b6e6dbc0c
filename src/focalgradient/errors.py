"""What focalgradient says when it is given something it cannot use."""

__all__ = ["FocalGradientWarning", "InputError"]


class InputError(ValueError):
    """Bad input: the message names what was wrong, what was expected and the remedy, in one sentence."""


class FocalGradientWarning(UserWarning):
    """A result that can be used, with something about it that the user should know."""
