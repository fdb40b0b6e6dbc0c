"""Task of the pinhole demonstration: depth with one eye through a pinhole, freely, and through a tube."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from focalgradient.files.columns import Column
from focalgradient.tasks.base import Task, paper_settings
from focalgradient.tasks.columns import REPETITION, SCENE, TRIAL, judged
from focalgradient.tasks.response import check_rating

__all__ = ["PinholeDemonstration"]

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


class PinholeDemonstration(Task):
    """Judge the depth of the surroundings and of pictures through a pinhole, freely, and through a tube."""

    name: ClassVar[str] = "pinhole"
    title: ClassVar[str] = "Depth with one eye through a pinhole, freely, and through a tube"
    ratios: ClassVar[frozenset[str]] = frozenset({"rating"})

    @property
    def design(self) -> type[Any]:
        from focalgradient.design.pinhole import Pinhole

        return Pinhole

    @property
    def trial(self) -> type[Any]:
        from focalgradient.design.pinhole import PinholeTrial

        return PinholeTrial

    @property
    def answer(self) -> type[Any]:
        from focalgradient.dataset.answers import Rated

        return Rated

    def columns(self, settings: Mapping[str, Any] | None = None) -> tuple[Column, ...]:
        return COLUMNS

    def settings(self) -> str:
        return paper_settings("pinhole")

    def pages(self, design: Any, words: Any, participant: str, browser: bool) -> Any:
        from focalgradient.design.pinhole_pages import PinholePages

        return PinholePages(design, words, participant, browser)

    def experiment(self) -> Any:
        from focalgradient.lab.pinhole import PINHOLE

        return PINHOLE

    def check_answer(self, design: Any, trial: Any, answer: Any) -> None:
        check_rating(design, answer)

    def picture_file(
        self, design: Any, shown: Mapping[str, Any], pictures: Mapping[tuple[str, ...], str]
    ) -> str | None:
        if shown["form"] == "real":
            return None
        aperture = "pinhole" if shown["viewing"] == "pinhole" else design.natural_aperture
        known = {pictures.get((shown["scene"], aperture, one)) for one in ("nearest", "farthest")}
        name: str | None = shown["stimulus"]
        return name if name in known else next((one for one in known if one), None)

    def factors(self, design: Any) -> Mapping[str, tuple[Any, ...]]:
        """Return the fixed factors "viewing" and "form" that have several levels; scenes are a random factor."""
        found = {"viewing": design.viewings, "form": design.forms}
        return {name: tuple(levels) for name, levels in found.items() if len(levels) > 1}

    def measures(self, settings: Mapping[str, Any]) -> Mapping[str, str]:
        """Return the rating, the only measure, analysed as a ratio."""
        return {"rating": "ratio"}
