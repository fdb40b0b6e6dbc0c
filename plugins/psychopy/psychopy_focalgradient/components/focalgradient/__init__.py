"""The Builder's component of `FocalGradientStim`."""

from __future__ import annotations

from typing import Any

from psychopy.localization import _translate

from psychopy_focalgradient.components import REPEATS, PlainComponent

__all__ = ["FocalGradientComponent"]


class FocalGradientComponent(PlainComponent):
    """A picture whose depth is known, seen through a pupil; its focus may change at every frame."""

    kind = "FocalGradient"
    tooltip = _translate("Focal gradient: a picture that is refocused live by its depth")

    def __init__(
        self,
        exp: Any,
        parentName: str,
        name: str = "picture",
        image: str = "",
        distance: str = "",
        pupilMM: float = 4.0,
        focus: float | str = 0.8,
        focusRange: str = "",
        size: str = "",
        folder: str = "",
        **others: Any,
    ):
        super().__init__(exp, parentName, name=name, **others)
        self.offer(
            "image",
            image,
            "Picture",
            "The sharp picture (8-bit files are sRGB), or a folder that 'focalgradient focus-series' made",
            valType="file",
            inputType="file",
            updates=REPEATS,
        )
        self.offer(
            "distance",
            distance,
            "Depth",
            "Distance in metres of what each pixel shows (.npy, EXR, PFM, TIFF), or one number; none for a folder",
            valType="file",
            inputType="file",
            updates=REPEATS,
        )
        self.offer("pupilMM", pupilMM, "Pupil (mm)", "Diameter of the pupil in millimetres", updates=REPEATS)
        self.offer(
            "focus",
            focus,
            "Focus (D)",
            "Vergence in dioptres of the plane of focus: 0.8 is 1.25 m away. It may change at every frame",
            valType="code",
        )
        self.offer(
            "focusRange",
            focusRange,
            "Range of focus (D)",
            "Least and greatest focus in dioptres, as (0.2, 2.5); by default the picture's own depths",
            valType="code",
            updates=("constant",),
        )
        self.offer(
            "size",
            size,
            "Size",
            "Width, or [width, height]; by default each pixel of the picture is one of the screen",
            valType="code",
            categ="Layout",
            updates=("constant",),
        )
        self.offer(
            "folder",
            folder,
            "Keep in",
            "Folder in which the planes of focus are kept, so that the next start does not make them again",
            valType="str",
            categ="Data",
            updates=("constant",),
        )

    def writeInitCode(self, buff: Any) -> None:
        """Write how the stimulus is made."""
        names = ("image", "pupilMM", "focus", "focusRange", "pos", "units", "size", "gamma", "folder")
        self.writeStim(buff, "FocalGradientStim", {"distance": "depth"} | {name: name for name in names})

    def writeRoutineStartCode(self, buff: Any) -> None:
        """Write what a repeat changes, and make the planes of focus before the first frame."""
        super().writeRoutineStartCode(buff)
        buff.writeIndentedLines(
            f"if {self.params['name']}.prepare():  # its planes of focus were made: the routine begins now\n"
            "    routineTimer.reset()\n"
        )
