"""Components of the Builder, one folder each, and what their parameters have in common."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

from psychopy.experiment.components import BaseVisualComponent, getInitVals
from psychopy.experiment.params import Param
from psychopy.localization import _translate

__all__ = ["REPEATS", "PlainComponent"]

MAY_CHANGE = ("constant", "set every repeat", "set every frame")
REPEATS = ("constant", "set every repeat")


class PlainComponent(BaseVisualComponent):  # type: ignore[misc]
    """A stimulus whose colours are its own: it has a place in degrees, but neither colour nor orientation.

    A component states `kind`, the start of its class's name, and `seconds`, for which it is shown unless it is changed.
    Its icons lie beside it: ``kind`` in lower case, and ``kind`` with "Component.svg".
    """

    kind = ""
    seconds = 1.0

    categories = ["Stimuli"]
    targets = ["PsychoPy"]
    version = "2024.1.0"
    beta = False

    def __init_subclass__(cls, **others: Any):
        super().__init_subclass__(**others)
        folder = Path(inspect.getfile(cls)).parent
        cls.iconFile, cls.iconSVG = folder / f"{cls.kind.lower()}.png", folder / f"{cls.kind}Component.svg"

    def __init__(
        self, exp: Any, parentName: str, *, gamma: str = "", pos: Any = (0, 0), units: str = "deg", **others: Any
    ):
        super().__init__(exp, parentName, pos=pos, units=units, **{"startVal": 0.0, "stopVal": self.seconds, **others})
        self.type = self.kind
        self.exp.requirePsychopyLibs(["visual"])
        for name in ("color", "fillColor", "borderColor", "colorSpace", "opacity", "contrast", "ori", "size"):
            del self.params[name]
        self.offer(
            "gamma",
            gamma,
            "Gamma",
            "Exponent of the display's light over value; by default sRGB, or linear where the monitor is calibrated",
            valType="code",
            categ="Appearance",
            updates=("constant",),
        )

    def offer(
        self,
        name: str,
        value: Any,
        label: str,
        hint: str,
        *,
        valType: str = "num",
        inputType: str = "single",
        categ: str = "Basic",
        updates: tuple[str, ...] = MAY_CHANGE,
        allowedVals: tuple[str, ...] = (),
        standing: bool = True,
    ) -> None:
        """Add a parameter; `standing` says whether it is one that the stimulus has under this name."""
        self.params[name] = Param(
            value,
            valType=valType,
            inputType=inputType,
            categ=categ,
            updates="constant",
            allowedUpdates=list(updates),
            allowedVals=list(allowedVals),
            hint=_translate(hint),
            label=_translate(label),
            direct=standing,
        )
        self.order += [name]

    def initial(self, arguments: dict[str, str]) -> str:
        """Return the arguments of the stimulus: by parameter, the name of its argument.

        One that changes with each repeat or frame is left to its default, as are empty ones.
        """
        inits = getInitVals(self.params, "PsychoPy")
        given = []
        for name, argument in arguments.items():
            stands = self.params[name].updates in ("constant", None, "None")
            if stands and self.params[name].val not in (None, "", "None", "none"):
                given.append(f"{argument}={inits[name]}")
        return ", ".join(given)

    def writeStim(self, buff: Any, kind: str, arguments: dict[str, str]) -> None:
        """Write the line that makes the stimulus."""
        name = getInitVals(self.params, "PsychoPy")["name"]
        buff.writeIndentedLines(
            f"{name} = visual.{kind}(\n"
            f"    win=win, name='{name}', drawDepth={-self.getPosInRoutine():.1f},\n"
            f"    {self.initial(arguments)})\n"
        )
