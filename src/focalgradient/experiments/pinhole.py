"""Task of the pinhole demonstration: depth with one eye through a pinhole, freely, and through a tube."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from focalgradient.dataset import Rated
from focalgradient.design.pinhole import Form, Pinhole, PinholeTrial
from focalgradient.design.sequence import Page, Pages, Standard
from focalgradient.design.words import Words
from focalgradient.errors import InputError
from focalgradient.files.columns import Column
from focalgradient.scales import Control, Scale
from focalgradient.tasks.base import Task
from focalgradient.tasks.columns import REPETITION, SCENE, TRIAL, judged
from focalgradient.tasks.response import check_rating
from focalgradient.tasks.steps import Look, Pictured, Step

if TYPE_CHECKING:
    from focalgradient.stimuli import Picture, StimulusSet

__all__ = ["PinholeDemonstration", "through_tube", "whole_field"]

FIXATION = "nearest"
"""Object that is in focus, and marked before each picture."""

MARK_S = 1.0
"""Duration of the mark, in s (our choice)."""

WAYS = {"pinhole": "pinhole.through_pinhole", "natural": "pinhole.freely", "tube": "pinhole.through_tube"}

COLUMNS: tuple[Column, ...] = (
    TRIAL,
    Column(
        "form",
        "Kind of scene viewed.",
        "text",
        levels={"real": "the real surroundings", "picture": "a picture on the screen"},
    ),
    Column(
        "viewing",
        "Way of viewing, with one eye.",
        "text",
        levels={
            "pinhole": "through a pinhole",
            "natural": "freely",
            "tube": "through a tube that shows as little of the scene as the pinhole does",
        },
    ),
    SCENE,
    REPETITION,
    *judged("the view through the pinhole"),
)


BLOCKS = {"real": "pinhole.block_real", "picture": "pinhole.block_picture"}


class PinholePages(Pages):
    """Pages for one participant, in the laboratory or in a browser."""

    def opening(self) -> tuple[Page, ...]:
        """Return the instructions."""
        words = self.words
        ratios = self.design.response_scale.doubled(words)
        texts = [words("pinhole.instructions", ratios=ratios, escape=self.escape)]
        if "real" in self.design.forms:
            tube = words("pinhole.needed_tube") if "tube" in self.design.viewings else ""
            texts.append(words("pinhole.needed", tube=tube, seconds=words.number(self.design.look_s, "g")))
        return self.instructions(*texts)

    def lead(self, trial: PinholeTrial, previous: PinholeTrial | None) -> tuple[Page | Standard, ...]:
        """Return the page and the standard at the beginning of a block or sitting."""
        if previous is not None and (previous.form, previous.repetition) == (trial.form, trial.repetition):
            return ()
        block = Page("ready", self.words(BLOCKS[trial.form]), ends="block")
        return block, Standard(self.words("pinhole.standard"), trial.form)

    def closing(self) -> tuple[Page, ...]:
        """Return the debriefing, which mentions the tube only if it was used."""
        tube = self.words("pinhole.about_tube") if "tube" in self.design.viewings else ""
        return self.debriefing("pinhole.debriefing", tube=tube)


class PinholeDemonstration(Task[Pinhole, PinholeTrial, Rated]):
    """Demonstration of the pinhole effect: monocular depth through a pinhole, without it, and through a tube.

    The tube has the same field as the pinhole. In the real world the program names the eye to use, what to hold
    before it, and for how long; a tone ends each look. On the screen, pinhole and tube conditions show the same
    circular field, which contains the object that was marked before; the one shows the pinhole picture, the other the
    natural one. Each block begins with a page and the standard, the view through the pinhole.
    """

    name: ClassVar[str] = "pinhole"
    title: ClassVar[str] = "Depth with one eye through a pinhole, freely, and through a tube"
    background: ClassVar[float] = -1.0
    ratios: ClassVar[frozenset[str]] = frozenset({"rating"})
    settings_file: ClassVar[str] = "pinhole"
    table: ClassVar[tuple[Column, ...]] = COLUMNS
    pages = PinholePages
    design, trial, answer = Pinhole, PinholeTrial, Rated

    def needed(self, design: Pinhole) -> Sequence[Pictured]:
        if "picture" not in design.forms:
            return ()
        return [(*pair, FIXATION, {}) for pair in product(design.scenes, ("pinhole", design.natural_aperture))]

    def pictured(self, design: Pinhole, trial: PinholeTrial) -> Mapping[str, Pictured]:
        if trial.form == "real":
            return {}
        aperture = "pinhole" if trial.viewing == "pinhole" else design.natural_aperture
        return {"picture": (trial.scene, aperture, FIXATION, {})}

    def shown(
        self,
        design: Pinhole,
        trial: PinholeTrial,
        pixels_per_degree: float,
        *,
        stimuli: StimulusSet,
        words: Words | None,
    ) -> Step:
        if trial.form == "real":
            assert words is not None
            look = Look(words(WAYS[trial.viewing]), words("pinhole.ready"), words("pinhole.look"))
            return Step(look, design.look_s, "look")
        picture: Picture | NDArray[np.uint8]
        picture = whole = stimuli.picture(*self.pictured(design, trial)["picture"])
        place = stimuli.scene(trial.scene).target(FIXATION).position_px
        if trial.viewing != "natural":
            wide = 2 * math.degrees(math.tan(math.radians(design.field_deg) / 2)) * pixels_per_degree
            pixels = stimuli.pixels(whole)
            height, width = pixels.shape[:2]
            if wide > min(width, height):
                raise InputError(
                    f"field_deg is {design.field_deg:g}, which takes {wide:.0f} pixels, but the pictures of "
                    f"{trial.scene} have only {width} x {height}, and would cut it off: make it smaller, or the "
                    "pictures larger."
                )
            picture = through_tube(pixels, whole_field(place, pixels.shape, wide), wide)
        return Step(picture, design.picture_s, "picture", place, MARK_S)

    def standard(
        self, design: Pinhole, form: Form, pixels_per_degree: float, stimuli: StimulusSet, words: Words
    ) -> Step:
        trial = PinholeTrial(form=form, viewing="pinhole", scene=design.scenes[0])
        return replace(self.shown(design, trial, pixels_per_degree, stimuli=stimuli, words=words), event="standard")

    def control(self, words: Words, trial: PinholeTrial, *, design: Pinhole) -> Control:
        question, *texts = (words(f"pinhole.{name}") for name in ("question", "below", "flatter", "deeper"))
        return Scale(question, texts[0], design.least_rating, design.most_rating, ends=(texts[1], texts[2]))

    def answered(self, design: Pinhole, trial: PinholeTrial, value: float, **times: Any) -> Rated:
        return Rated(rating=value, **times)

    def check_answer(self, design: Pinhole, trial: PinholeTrial, answer: Rated) -> None:
        check_rating(design, answer)

    def factors(self, design: Pinhole) -> Mapping[str, tuple[Any, ...]]:
        """Return the fixed factors "viewing" and "form" that have several levels; scenes are a random factor."""
        found = {"viewing": design.viewings, "form": design.forms}
        return {name: tuple(levels) for name, levels in found.items() if len(levels) > 1}

    def measures(self, settings: Mapping[str, Any]) -> Mapping[str, str]:
        """Return the rating, the only measure, analysed as a ratio."""
        return {"rating": "ratio"}


def through_tube(pixels: NDArray[np.uint8], middle: tuple[float, float], wide: float) -> NDArray[np.uint8]:
    """Return a picture, H x W x 3, that is black outside a circle of diameter `wide` px around (x, y)."""
    y, x = (np.arange(side) + 0.5 for side in pixels.shape[:2])
    field = np.hypot(y[:, None] - middle[1], x - middle[0]) <= wide / 2
    return np.where(field[..., None], pixels, 0).astype(np.uint8)


def whole_field(about: tuple[float, float], shape: tuple[int, ...], wide: float) -> tuple[float, float]:
    """Return the centre (x, y), nearest to `about`, of a field of `wide` px that lies entirely in a picture of H x W.

    >>> whole_field((40.0, 90.0), (400, 300), 100.0), whole_field((290.0, 200.0), (400, 300), 100.0)
    ((50.0, 90.0), (250.0, 200.0))
    """
    x, y = (min(max(place, wide / 2), side - wide / 2) for place, side in zip(about, (shape[1], shape[0]), strict=True))
    return x, y
