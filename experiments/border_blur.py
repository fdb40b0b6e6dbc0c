"""Border blur and depth order: which of two textures lies in front, judged by the blur of the border between them.

One texture is sharp and one blurred; the border between them is sharp or blurred. Observers see the texture that shares
the blur of the border as the nearer one (Mather 1996, Proc. R. Soc. B 263:169). Laboratory and browser.
Run it: focalgradient run border_blur.py --participant 01 --monitor lab
"""

from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import Field

from focalgradient.dataset import Response
from focalgradient.design import Counterbalanced, Trial
from focalgradient.display import Display
from focalgradient.scales import Ways
from focalgradient.stimuli import texture_border
from focalgradient.tasks import Task, register


@dataclass(frozen=True, slots=True, kw_only=True)
class BorderTrial(Trial):
    blurred: Literal["left", "right"] = field(metadata={"about": "Side of the blurred texture."})
    border: Literal["sharp", "blurred"] = field(metadata={"about": "The border between the textures."})


@dataclass(frozen=True, slots=True, kw_only=True)
class BorderAnswer(Response):
    blurred_near: bool = field(metadata={"about": "Whether the blurred texture was chosen as the nearer one."})


class BorderDesign(Counterbalanced):
    task: str = "borderblur"
    repetitions: int = 10
    practice_trials: int = 2
    runs: dict[str, int] = {"border": 3, "blurred": 3}
    blur_arcmin: Annotated[float, Field(gt=0, le=60, description="minutes of arc above 0")] = 4.0
    picture_s: Annotated[float, Field(gt=0, le=60, description="a number of seconds above 0")] = 1.0

    def trials(self, participant, session=None):
        shown = [BorderTrial(blurred=side, border=kind) for side in ("left", "right") for kind in ("sharp", "blurred")]
        return self.ordered(participant, session, shown)


@register
class BorderBlur(Task):
    """Judge which of two textures lies in front."""

    name = "borderblur"
    title = "Border blur as a cue to the order of depth (Mather 1996)"
    design, trial, answer = BorderDesign, BorderTrial, BorderAnswer
    texts = {
        "en": {
            "instructions": "Which is nearer?\nTwo textures meet at a wavy border. Say which of them lies in front.",
            "question": "Which texture was nearer?",
            "left": "left",
            "right": "right",
        },
        "de": {
            "instructions": "Was ist näher?\nZwei Muster grenzen aneinander. Sagen Sie, welches davon vorn liegt.",
            "question": "Welches Muster war näher?",
            "left": "links",
            "right": "rechts",
        },
    }

    def shown(self, design, trial, pixels_per_degree, seed=0):
        blur = {f"{side}_blur_arcmin": design.blur_arcmin * (side == trial.blurred) for side in ("left", "right")}
        made = texture_border(
            **blur,
            border_blur_arcmin=design.blur_arcmin * (trial.border == "blurred"),
            pixels_per_degree=pixels_per_degree,
            width_deg=6.0,
            height_deg=6.0,
            equalise=("contrast",),
            seed=seed,  # another texture in each trial
        )
        grey = Display().encode(made.picture)
        return grey, design.picture_s

    def control(self, words, trial):
        return Ways(self.text(words, "question"), (self.text(words, "left"), self.text(words, "right")))

    def answered(self, design, trial, value, **times):
        return BorderAnswer(blurred_near=("left", "right")[int(value) - 1] == trial.blurred, **times)

    def simulated(self, design, trial, observer, chance):
        near = bool(chance.random() < 0.5 + observer.scale * (0.3 if trial.border == "blurred" else -0.25))
        return BorderAnswer(onset=0.0, response_time=0.9, blurred_near=near)
