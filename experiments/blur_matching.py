"""Blur matching by adjustment: set the blur of the right edge until it looks like that of the left one.

The left edge is defocused for a pupil of 4 mm, at full or low contrast; the right one, always at full contrast, follows
the knob immediately. If contrast affects perceived blur, matches at low contrast are biased. Laboratory and browser.
Run it: focalgradient run blur_matching.py --participant 01 --monitor lab
"""

from dataclasses import dataclass, field
from functools import cache
from typing import Annotated

import numpy as np
from pydantic import Field

from focalgradient import Lens
from focalgradient.dataset import Response
from focalgradient.design import Counterbalanced, Trial
from focalgradient.live import FocusSeries
from focalgradient.tasks import Adjustment, Refocused, Task, register

EYE = Lens(focal_length=0.017, f_number=17 / 4, focus_distance=1.0)  # a pupil of 4 mm
MOST_D = 2.0  # end of the knob's range
Numbers = Annotated[tuple[float, ...], Field(strict=False, description="a list of numbers")]


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchTrial(Trial):
    defocus: float = field(metadata={"about": "Defocus of the standard.", "units": "D", "least": 0})
    contrast: float = field(metadata={"about": "Michelson contrast of the standard.", "least": 0, "most": 1})


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchAnswer(Response):
    matched: float = field(metadata={"about": "Defocus that was set.", "units": "D", "least": 0, "most": MOST_D})
    start: float = field(metadata={"about": "Defocus at the start, at random.", "units": "D", "least": 0})


class MatchDesign(Counterbalanced):
    task: str = "blurmatching"
    repetitions: int = 6
    practice_trials: int = 2
    defocuses: Numbers = (0.25, 0.5, 1.0)
    contrasts: Numbers = (0.8, 0.2)
    size_deg: Annotated[float, Field(gt=0.5, le=12, description="a number of degrees")] = 4.0

    def trials(self, participant, session=None):
        shown = [MatchTrial(defocus=one, contrast=other) for one in self.defocuses for other in self.contrasts]
        return self.ordered(participant, session, shown)


@cache
def edge_series(pixels: int, pixel_angle: float, contrast: float) -> FocusSeries:
    """Return an edge at every defocus up to `MOST_D`."""
    edge = 0.5 * (1 + contrast * np.sign(np.arange(pixels) - pixels / 2 + 0.5)) * np.ones((pixels, 1))
    return FocusSeries.uniform(edge, EYE, pixel_angle=pixel_angle, defocus=(0.0, MOST_D))


@register
class BlurMatching(Task):
    """Set the blur of one edge until it looks like that of another."""

    name = "blurmatching"
    title = "Blur matching by adjustment"
    design, trial, answer = MatchDesign, MatchTrial, MatchAnswer
    texts = {
        "en": {
            "instructions": "Match the blur\nSet the blur of the right edge until both look equally blurred.",
            "question": "Are both equally blurred?",
        },
        "de": {
            "instructions": "Unschärfe angleichen\nStellen Sie die rechte Kante ein, bis beide gleich unscharf sind.",
            "question": "Sind beide gleich unscharf?",
        },
    }

    def adjustment(self, design, words, trial, pixels_per_degree):
        pixels = 2 * round(design.size_deg * pixels_per_degree / 2)
        angle = float(np.radians(1 / pixels_per_degree))
        standard, matched = (
            edge_series(pixels, angle, contrast) for contrast in (trial.contrast, max(design.contrasts))
        )
        views = (
            Refocused(standard, (-0.6 * pixels, 0.0), focus=trial.defocus),
            Refocused(matched, (0.6 * pixels, 0.0)),  # follows the knob
        )
        return Adjustment(views, 0.0, MOST_D, self.text(words, "question"))

    def answered(self, design, trial, value, start, **times):
        return MatchAnswer(matched=value, start=start, **times)

    def simulated(self, design, trial, observer, chance):
        gain = trial.contrast ** (-0.1 * observer.scale)  # low contrast looks more blurred
        seen = trial.defocus * gain * np.exp(chance.normal(0, 0.15))
        answer = {"matched": float(min(seen, MOST_D)), "start": float(chance.uniform(0, MOST_D))}
        return MatchAnswer(onset=0.0, response_time=4.0, **answer)
