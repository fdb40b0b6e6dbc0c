"""The Builder's component of `NeckerStim`."""

from __future__ import annotations

from typing import Any

from psychopy.localization import _translate

from psychopy_focalgradient.components import REPEATS, PlainComponent

__all__ = ["NeckerComponent"]


class NeckerComponent(PlainComponent):
    """The turning Necker cube, blurred by the depth of one of its two readings."""

    kind, seconds = "Necker", 10.0
    tooltip = _translate("Necker cube: a turning wireframe, blurred by its depth")

    def __init__(
        self,
        exp: Any,
        parentName: str,
        name: str = "cube",
        gradient: str = "rigid",
        strengthMM: float = 4.0,
        phase: str = "$t * 0.125",
        edgeDeg: float = 8.0,
        direction: str = "right",
        **others: Any,
    ):
        super().__init__(exp, parentName, name=name, **others)
        self.offer(
            "gradient",
            gradient,
            "Blurred as",
            "none: sharp; rigid: as the cube; nonrigid: as the cube reversed in depth",
            valType="str",
            inputType="choice",
            allowedVals=("none", "rigid", "nonrigid"),
            updates=REPEATS,
        )
        self.offer("strengthMM", strengthMM, "Pupil (mm)", "Diameter in millimetres of the pupil that blurs")
        self.offer(
            "phase", phase, "Phase (turns)", "Turns done: t * 0.125 turns it once in eight seconds", valType="code"
        )
        self.params["phase"].updates = "set every frame"
        self.offer(
            "direction",
            direction,
            "Turns to the",
            "Where the near side moves",
            valType="str",
            inputType="choice",
            allowedVals=("right", "left"),
            updates=REPEATS,
        )
        self.offer(
            "edgeDeg",
            edgeDeg,
            "Edge (deg)",
            "Angle of an edge that faces the viewer at the cube's middle",
            categ="Layout",
            updates=("constant",),
        )

    def writeInitCode(self, buff: Any) -> None:
        """Write how the stimulus is made."""
        names = ("gradient", "strengthMM", "phase", "direction", "gamma", "pos", "units")
        self.writeStim(buff, "NeckerStim", {name: name for name in names} | {"edgeDeg": "size"})
