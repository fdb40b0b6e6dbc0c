"""Stimuli of focalgradient for PsychoPy: `FocalGradientStim` and `NeckerStim`, and their Builder components.

PsychoPy finds them by the entry points in ``pyproject.toml``: ``psychopy.plugins.activatePlugins()`` puts the stimuli
into ``psychopy.visual``, and the Builder shows the components under "Stimuli".
"""
