"""Range of accommodation (template): the range of vergences at which a letter can be seen clearly.

A focus-tunable lens in front of the eye moves the display optically to each vergence of the design; the participant
tries to focus on the letter, and reports whether it is clear. `focalgradient run experiments/accommodation_range.py
--pilot` runs it with a simulated lens; `lens = "optotune:/dev/ttyACM0"` in the design selects a real one.
"""

from dataclasses import dataclass, field
from functools import cache
from typing import Annotated, Any, ClassVar

from pydantic import Field

from focalgradient.dataset import Response
from focalgradient.design import Plan, Trial
from focalgradient.lab.devices.lenses import open_lens
from focalgradient.lab.experiment import Sitting
from focalgradient.lab.questions import ask_which
from focalgradient.tasks import Task, register

LETTER_DEG = 1 / 6
"""Height of the letter: 10 arcmin, the 20/40 line of an acuity chart."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusTrial(Trial):
    """Vergence to accommodate to."""

    demand_d: float = field(metadata={"about": "Vergence of the display behind the lens.", "units": "D"})


@dataclass(frozen=True, slots=True, kw_only=True)
class FocusAnswer(Response):
    """Report whether the letter could be seen clearly."""

    clear: bool = field(metadata={"about": "Whether the letter could be made clear."})


class FocusDesign(Plan):
    """Vergences to be shown, and the lens that produces them."""

    task: str = "accommodation"
    repetitions: int = 4
    lens: Annotated[str, Field(description="simulated, optotune:PORT or planes:D,D,...")] = "simulated"
    demands_d: Annotated[tuple[float, ...], Field(strict=False, description="a list of numbers, in dioptres")] = (
        *(0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
    )
    letter_s: float = 2.0

    def trials(self, participant: str, session: str | None = None) -> Any:
        """Return each vergence, repeated as the design states."""
        return self.ordered(participant, session, [FocusTrial(demand_d=one) for one in self.demands_d])


@register
class Accommodation(Task):
    """Report at each vergence whether a letter can be seen clearly."""

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

    def check_devices(self, design: FocusDesign) -> None:
        """Open the lens, and raise `InputError` for vergences beyond its range."""
        lens = lens_of(design.lens)
        for demand in (*design.demands_d, design.demands_d[0]):
            lens.set_focus(demand)

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
        """Answer like a person who accommodates up to about 4 D, with a standard deviation of 0.5 D."""
        clear = bool(trial.demand_d < chance.normal(4.0 * observer.scale, 0.5))
        return FocusAnswer(onset=0.0, response_time=1.0, clear=clear)


lens_of = cache(open_lens)
