"""The mouse's pointer in the window: hidden through the blank after a picture, until the question is on the screen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from focalgradient.design.words import load_words
from focalgradient.lab.questions import ask
from focalgradient.scales import Scale


class Window:
    """What a screen does, in order."""

    def __init__(self, done: list[str]):
        object.__setattr__(self, "done", done)

    def __setattr__(self, name: str, value: Any) -> None:
        self.done.append(f"{name} {value}")  # type: ignore[attr-defined]


class Screen:
    """A screen without a window, on which an arrow key and ENTER are pressed."""

    size = (1024, 768)
    frame_s = 1 / 60
    words = load_words("en")

    def __init__(self) -> None:
        self.done: list[str] = []
        self.window = Window(self.done)
        pressed = [[SimpleNamespace(key=key, down=True, time=1.0)] for key in ("right", "return")]
        self.keys = SimpleNamespace(clear=lambda: None, events=lambda: pressed.pop(0))
        nothing = lambda *given, **named: None  # noqa: E731
        self.mouse = SimpleNamespace(
            setPos=nothing, clickReset=nothing, getPressed=lambda getTime: ([0], [0.0]), getPos=lambda: (0, 0)
        )

    def __getattr__(self, name: str) -> Any:
        if name in ("warm", "stop_if_asked"):
            return lambda *given: None
        return lambda *given, **named: SimpleNamespace(draw=lambda: None)

    def wait_out(self) -> None:
        self.done.append("blank is over")

    def frame(self) -> float:
        self.done.append("frame")
        return 0.0

    def on_event(self, name: str, at: float) -> None:
        self.done.append(name)


def test_the_pointer_comes_with_the_question_and_not_before() -> None:
    screen: Any = Screen()
    ask(screen, Scale("How deep?", "", 0.25, 4.0))
    shown = screen.done.index("mouseVisible True")
    assert screen.done.index("blank is over") < screen.done.index("frame") < shown
    assert screen.done[-1] == "mouseVisible False"
