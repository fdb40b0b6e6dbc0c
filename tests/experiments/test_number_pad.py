"""Digits of the number pad as answers: typed numbers and steps, by real keys in a window and without one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from focalgradient.dataset import Press
from focalgradient.design.words import load_words
from focalgradient.lab import Scale, Steps, ask


class Part(SimpleNamespace):
    """A stimulus that is drawn nowhere."""

    def draw(self) -> None:
        """Do nothing."""


def screen_of(*keys: str) -> Any:
    """A screen on which these keys are pressed one after the other, a frame each."""
    left = [[Press(0.1 * number, key, True)] for number, key in enumerate(keys, start=1)]
    part = lambda *shown, **how: Part(text="", pos=(0, 0))  # noqa: E731
    return SimpleNamespace(
        **dict.fromkeys(("text", "plate", "line", "box", "triangle"), part),
        **{name: lambda *given, **how: None for name in ("warm", "wait_out", "stop_if_asked", "offer", "on_event")},
        keys=SimpleNamespace(clear=lambda: None, events=lambda: left.pop(0)),
        frame=lambda lit=False: 0.0,
        words=load_words("en"),
        size=(1024, 768),
        pointer=None,
        practice=True,
        ink=0.9,
        background=-1.0,
    )


TYPED = Scale("How far?", "", 0, 99, ratios=False, ends=("", ""), typed=True)
STEPS = Steps("How blurred?", "", 0, 7, labels=())


@pytest.mark.parametrize(
    ("scale", "keys", "value"),
    [
        (TYPED, ("num_4", "num_2", "num_enter"), 42.0),
        (TYPED, ("num_1", "num_decimal", "num_5", "return"), 1.5),
        (TYPED, ("num_9", "backspace", "7", "num_enter"), 7.0),
        (STEPS, ("num_6", "num_enter"), 6.0),
        (STEPS, ("num_6", "3", "num_enter"), 3.0),
        (STEPS, ("num_5", "num_9", "return"), 5.0),  # 9 is no step
    ],
)
def test_digits_of_the_number_pad_are_digits(scale: Any, keys: tuple[str, ...], value: float) -> None:
    given = ask(screen_of(*keys), scale)
    assert given.value == value
