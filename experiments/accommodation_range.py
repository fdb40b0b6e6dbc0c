"""Range of accommodation, to copy and change: up to which vergence a letter can be made clear.

A focus-tunable lens before the eye moves the display to each vergence of the design; the participant tries to make the
letter clear, and says whether it is. `focalgradient run experiments/accommodation_range.py --pilot` tries it with a
simulated lens; `lens = "optotune:/dev/ttyACM0"` in the design takes a real one.
"""

from dataclasses import dataclass, field, replace
from functools import cache
from typing import Annotated, Any, ClassVar

from pydantic import Field

from focalgradient.dataset import Response
from focalgradient.design import Plan, Trial
from focalgradient.lab.experiment import Experiment, Sitting
from focalgradient.lab.lenses import open_lens
from focalgradient.lab.questions import ask_which
from focalgradient.tasks import Task, register

LETTER_DEG = 1 / 6
"""Height of the letter: 10 arcmin, as 20/40 on a chart of acuity."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusTrial(Trial):
    """A vergence to accommodate to."""

    demand_d: float = field(metadata={"about": "Vergence of the display behind the lens.", "units": "D"})


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusAnswer(Response):
    """Whether the letter could be made clear."""

    clear: bool = field(metadata={"about": "Whether the letter could be made clear."})


class FocusDesign(Plan):
    """Vergences, and the lens that makes them."""

    task: str = "accommodation"
    repetitions: int = 4
    lens: Annotated[str, Field(description="simulated, optotune:PORT or planes:D,D,...")] = "simulated"
    demands_d: Annotated[tuple[float, ...], Field(strict=False, description="a list of numbers, in dioptres")] = (
        *(0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
    )
    letter_s: float = 2.0

    def trials(self, participant: str, session: str | None = None) -> Any:
        """Each vergence as often as the design says."""
        return self.ordered(participant, session, [FocusTrial(demand_d=one) for one in self.demands_d])


@register
class Accommodation(Task):
    """Say whether a letter can be made clear, at each vergence."""

    name = "accommodation"
    title = "Range of accommodation, by a focus-tunable lens"
    design, trial, answer = FocusDesign, FocusTrial, FocusAnswer
    texts: ClassVar = {
        "en": {
            "instructions": "Can you make it clear?\nLook at the letter and try to make it clear. Then say whether it "
            "was.\n\nBefore each letter the lens changes its focus.",
            "question": "Was the letter clear?",
            "clear": "clear",
            "blurred": "blurred",
        },
        "de": {
            "instructions": "Können Sie ihn scharf sehen?\nSehen Sie den Buchstaben an und versuchen Sie, ihn scharf "
            "zu sehen. Sagen Sie dann, ob es gelang.\n\nVor jedem Buchstaben ändert die Linse ihre Brechkraft.",
            "question": "War der Buchstabe scharf?",
            "clear": "scharf",
            "blurred": "unscharf",
        },
    }

    def experiment(self) -> Experiment:
        """Refuse a lens that does not answer before the window opens."""
        return replace(super().experiment(), check=lambda design, display, room: check(design))

    def run(self, sitting: Sitting, trial: FocusTrial) -> FocusAnswer:
        """Set the lens, wait until it has settled, show the letter, and ask."""
        screen, lens = sitting.screen, lens_of(sitting.design.lens)
        lens.set_focus(trial.demand_d)
        screen.empty(0.3, "focus")
        while not lens.settled():
            screen.stop_if_asked(screen.keys.events())
            screen.frame()
        letter = screen.text("E", height=LETTER_DEG * screen.display.pixels_per_degree / screen.size[1])
        onset = screen.play(lambda since: letter.draw(), sitting.design.letter_s, "picture")
        screen.empty(0.2, "off")
        ways = (self.text(sitting.words, "clear"), self.text(sitting.words, "blurred"))
        given = ask_which(screen, self.text(sitting.words, "question"), ways)
        return FocusAnswer(onset=sitting.since_start(onset), response_time=given.seconds, clear=given.value == 1)

    def simulated(self, design: FocusDesign, trial: FocusTrial, observer: Any, chance: Any) -> FocusAnswer:
        """Answer as somebody who accommodates up to 4 D, give or take half a dioptre."""
        clear = bool(trial.demand_d < chance.normal(4.0, 0.5))
        return FocusAnswer(onset=0.0, response_time=1.0, clear=clear)


lens_of = cache(open_lens)


def check(design: FocusDesign) -> None:
    """Open the lens, and refuse vergences that it does not reach."""
    lens = lens_of(design.lens)
    for demand in (*design.demands_d, design.demands_d[0]):
        lens.set_focus(demand)
