"""The check of a task before anyone takes part: each fault is one sentence, and nothing has been written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar, Literal

import numpy as np
import pytest
from pydantic import Field

from focalgradient.dataset import Press
from focalgradient.design import Plan, Trial
from focalgradient.errors import InputError
from focalgradient.lab import Given, ask, respond
from focalgradient.observers import simulate
from focalgradient.scales import Held, Scale, Steps, Ways
from focalgradient.tasks import Noted, Response, Step, Task, check_task, register
from focalgradient.web import Lists


@dataclass(frozen=True, slots=True, kw_only=True)
class SideTrial(Trial):
    side: Literal["left", "right"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SideAnswer(Response):
    chosen: Literal["left", "right"]


class SideDesign(Plan):
    task: str = "sides"

    def trials(self, participant: str, session: str | None = None) -> tuple[Trial, ...]:
        return self.ordered(participant, session, [SideTrial(side="left"), SideTrial(side="right")])


@register
class Sides(Task):
    """Say which side is brighter, and how sure you are."""

    name = "sides"
    title = "Brighter side"
    design, trial, answer = SideDesign, SideTrial, SideAnswer
    texts: ClassVar = {
        "en": {"instructions": "Which side?\nSay which.", "question": "Which side?", "debriefing": "Thanks."}
    }

    def shown(self, design: Any, trial: Any, pixels_per_degree: float) -> Any:
        return np.zeros((8, 16, 3), np.uint8), 0.5

    def control(self, words: Any, trial: Any) -> Any:
        return Ways(self.text(words, "question"), ("left", "right"))

    def further(self, design: Any, words: Any, trial: Any) -> Any:
        return {"sure": (Steps("How sure?", "", 1, 5, ("not", "very")), Noted(None, "points", "How sure."))}

    def answered(self, design: Any, trial: Any, value: float, **times: Any) -> Any:
        return SideAnswer(chosen=("left", "right")[int(value) - 1], **times)

    def simulated(self, design: Any, trial: Any, observer: Any, chance: Any) -> Any:
        return self.sound(trial)

    @staticmethod
    def sound(trial: Any) -> Any:
        return SideAnswer(onset=0.0, response_time=1.0, chosen=trial.side)


@pytest.fixture
def changed(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    def change(**parts: Any) -> None:
        for name, part in parts.items():
            monkeypatch.setattr(Sides, name, part)

    return change


def test_a_whole_task_passes() -> None:
    check_task(SideDesign(), room=(16, 8))


def picture(pixels: Any, seconds: Any = 0.5) -> Callable[..., Any]:
    return lambda *_: (pixels, seconds)


def control(given: Any) -> Callable[..., Any]:
    return lambda *_: given


def raising(*_: Any) -> Any:
    return dict[str, int]()["side"]


BLACK = np.zeros((8, 16, 3), np.uint8)


def ending(*_: Any) -> Any:
    raise SystemExit(0)


def unseeded(*_: Any) -> Any:
    return np.random.default_rng().integers(0, 255, (8, 16, 3), np.uint8), 0.5


def undrawn(self: Any, participant: str, session: str | None = None) -> Any:
    sides = np.random.default_rng().permutation(["left", "right"] * 20)
    return tuple(SideTrial(side=str(side), trial=number) for number, side in enumerate(sides, start=1))  # type: ignore[arg-type]


FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "a brace": (
        {"texts": {"en": {"instructions": "100 % of {it}"}}},
        r"the text 'instructions' of the task 'sides' has a brace that is not a value's name \(none\): correct it",
    ),
    "floats": ({"shown": picture(BLACK / 255)}, r"picture of shown is float64 of shape \(8, 16, 3\), but must be an"),
    "no duration": ({"shown": picture(BLACK, 0)}, "the duration of shown is 0, but must be a number of seconds above"),
    "nothing judged": (
        {"shown": lambda *_, **known: Step(BLACK, 0.5, judged=False)},
        "shown has no step that is judged: leave judged at True for the step that is answered",
    ),
    "an exit": ({"shown": ending}, r"fails: shown raises SystemExit\(0\)"),
    "an unseeded picture": ({"shown": unseeded}, "draws another picture the second time: draw from the parameter seed"),
    "no observer": ({"simulated": raising}, r"fails: simulated raises KeyError\('side'\)"),
    "three ways": ({"control": control(Ways("?", ("a", "b", "c")))}, "control has 3 ways, but must have 2"),
    "no ratios": ({"control": control(Scale("?", "", 0, 9))}, "goes from 0 to 9, which has no ratios: give ratios=Fal"),
    "another answer": ({"answered": lambda *_, **times: 3}, "answered gives 3, not SideAnswer"),
    "a name with a space": ({"further": lambda *_: {"a b": ()}}, "further names 'a b': use letters, digits and _"),
    "no note": ({"further": lambda *_: {"sure": Ways("?", ("a", "b"))}}, "must be a control and a Noted"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_each_fault_is_named_before_anything_is_written(
    fault: str, changed: Callable[..., None], tmp_path: Path
) -> None:
    parts, sentence = FAULTS[fault]
    changed(**parts)
    with pytest.raises(InputError, match=sentence):
        simulate(SideDesign(), tmp_path / "data", observers=1, seed=1)
    assert not (tmp_path / "data").exists()
    if "simulated" in parts:  # which people do not need
        return
    with pytest.raises(InputError, match=sentence):
        Lists(SideDesign())


def test_fields_with_the_name_of_a_column_or_unknown_metadata_are_refused(changed: Callable[..., None]) -> None:
    def record(name: str, **metadata: Any) -> Any:
        made = field(default=1, metadata=metadata)
        own = type("OwnTrial", (Trial,), {"__annotations__": {name: int}, name: made})
        return dataclass(frozen=True, kw_only=True)(own)

    for name, metadata, sentence in (
        ("onset", {}, "'onset' is the name of another column: rename the field"),
        ("event", {}, "'event' is the name of another column: rename the field"),
        ("ring", {"abuot": "x"}, "ring is a field with the metadata 'abuot', but may have about, units, levels, least"),
    ):
        changed(trial=record(name, **metadata))
        with pytest.raises(InputError, match=sentence):
            check_task(SideDesign())


def test_a_design_without_defaults_is_refused() -> None:
    class Bare(SideDesign):
        task: str = "bare"
        levels: int = Field()

    parts = {"name": "bare", "design": Bare}
    with pytest.raises(
        InputError,
        match=r"'bare' cannot be made without settings \(levels: Field required\): give each a valid default",
    ):
        register(type("BareSides", (Sides,), parts))


def test_trials_that_differ_when_made_again_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SideDesign, "trials", undrawn)
    with pytest.raises(InputError, match="trials gives participant 01 another list the second time: draw with self"):
        check_task(SideDesign())


def test_an_answer_may_not_overwrite_the_condition_that_was_shown(changed: Callable[..., None]) -> None:
    own = dataclass(frozen=True, kw_only=True)(type("Own", (Response,), {"__annotations__": {"side": str}}))
    changed(answer=own)
    with pytest.raises(InputError, match="'side' is a field of the trial and of the answer, which would overwrite"):
        check_task(SideDesign())
    with pytest.raises(InputError, match="'side' is a field of the trial and of the answer"):
        Sides().columns()


class HeldDesign(SideDesign):
    task: str = "heldsides"


@register
class HeldSides(Sides):
    """Hold the key of the side that is brighter, while a film is shown."""

    name = "heldsides"
    design = HeldDesign
    keys: ClassVar = ("f", "j")

    def shown(self, design: Any, trial: Any, pixels_per_degree: float) -> Any:
        return Step((np.full((8, 16), grey, np.uint8) for grey in (90, 120)), 2.0, "film")

    def control(self, words: Any, trial: Any) -> Any:
        return Held(self.keys, ("left", "right"))

    def answered(self, design: Any, trial: Any, value: Any, **times: Any) -> Any:
        held = max(("left", "right"), key=lambda side: sum(press.key == "fj"[side == "right"] for press in value))
        return SideAnswer(chosen=held, **times)


def test_a_film_with_held_keys_is_checked_and_shown_in_a_browser(monkeypatch: pytest.MonkeyPatch) -> None:
    design = HeldDesign()
    check_task(design)
    (entry,) = Lists(design).shown("01", design.trials("01")[:1])
    assert (entry["scale"]["kind"], entry["intervals"][0]["film"]) == ("held", 60.0)
    with pytest.raises(InputError, match="have 16 x 8 pixels, but the window has only 40 x 7"):
        check_task(design, room=(40, 8))  # the labels of the keys need room, too
    monkeypatch.setattr(HeldSides, "keys", ("f", "f"))
    with pytest.raises(InputError, match="must name different ones, each with a label"):
        check_task(design)


class OwnDesign(SideDesign):
    task: str = "ownsides"


@dataclass(frozen=True)
class Lever:
    """Control that is in no room of the package."""

    question: str = "Which side?"

    def reached(self) -> list[float]:
        return [1.0, 2.0]

    def ask(self, screen: Any, event: str) -> Any:
        return respond(
            screen,
            lambda: screen.drawn.append(self.question),
            event,
            lambda press, seconds: Given(2.0, seconds) if press.key == "x" and press.down else None,
        )


@register
class OwnSides(Sides):
    """Say which side is brighter, by a lever."""

    name = "ownsides"
    design = OwnDesign

    def control(self, words: Any, trial: Any) -> Any:
        return Lever()


def test_a_control_of_a_task_file_is_checked_asked_and_left_to_the_laboratory() -> None:
    check_task(OwnDesign())
    with pytest.raises(InputError, match="answered on a control of its own, which a browser cannot show"):
        Lists(OwnDesign())
    presses = [[Press(0.2, "y", True)], [Press(0.5, "x", True), Press(0.6, "x", False)]]
    noted: list[tuple[str, float]] = []
    drawn: list[str] = []
    screen: Any = SimpleNamespace(
        drawn=drawn,
        frame=lambda lit=False: 0.1 * len(drawn),
        wait_out=lambda: None,
        keys=SimpleNamespace(clear=lambda: None, events=lambda: presses.pop(0)),
        stop_if_asked=lambda found: None,
        on_event=lambda name, at: noted.append((name, at)),
    )
    given = ask(screen, Lever())
    assert (given.value, given.seconds) == (2.0, pytest.approx(0.4))
    assert noted == [("question", 0.1)]
