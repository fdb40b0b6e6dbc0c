"""Components of the Builder, one folder each, and what their parameters have in common."""

from __future__ import annotations

from typing import Any

from psychopy.experiment.components import BaseVisualComponent, getInitVals
from psychopy.experiment.params import Param
from psychopy.localization import _translate

__all__ = ["PlainComponent"]

MAY_CHANGE = ("constant", "set every repeat", "set every frame")


class PlainComponent(BaseVisualComponent):  # type: ignore[misc]
    """A stimulus whose colours are its own: it has a place in degrees, but neither colour nor orientation."""

    categories = ["Stimuli"]
    targets = ["PsychoPy"]
    version = "2024.1.0"
    beta = False

    def __init__(self, exp: Any, parentName: str, *, pos: Any, units: str, **others: Any):
        super().__init__(exp, parentName, pos=pos, units=units, **others)
        self.exp.requirePsychopyLibs(["visual"])
        for name in ("color", "fillColor", "borderColor", "colorSpace", "opacity", "contrast", "ori", "size"):
            del self.params[name]

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
