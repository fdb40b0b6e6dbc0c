"""Adaptive blur threshold: the blur increment that is just noticed, or that just makes a picture look deeper.

Each trial shows one scene twice, with added blur in one of two intervals (2IFC), and asks in which. QUEST+ chooses the
blur increment from all answers so far; the pictures are blurred during the grey pause before the trial. Requires the
extra `thresholds`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from focalgradient.dataset import Chosen
from focalgradient.design import BlurThresholdDesign, BlurTrial, Procedure
from focalgradient.design.procedure import NEEDED
from focalgradient.display import Display
from focalgradient.errors import check_installed
from focalgradient.lab.experiment import GREY, Experiment, Sitting
from focalgradient.lab.questions import ask_which
from focalgradient.stimuli import blurred_scene

__all__ = ["BLUR_THRESHOLD", "answers"]


def answers(recorded: Sequence[Mapping[str, Any]]) -> list[tuple[float, bool]]:
    """Return blur level and correctness of each recorded main trial, without catch trials: the input of QUEST+."""
    return [(one["level"], one["correct"]) for one in recorded if one["phase"] == "main" and not one["catch"]]


def _pictures(design: BlurThresholdDesign) -> Sequence[tuple[str, str, str, dict[str, str]]]:
    """List the pinhole pictures of all scenes of the design."""
    return [(scene, "pinhole", design.fixation, {}) for scene in design.scenes]


def _check(design: BlurThresholdDesign, display: Display, room: tuple[int, int]) -> None:
    check_installed(*NEEDED)


def _before(sitting: Sitting) -> None:
    """Initialise the adaptive procedure, and blur one picture so that compiled code is ready before the first trial."""
    sitting.screen.text(sitting.words("common.moment")).draw()
    sitting.screen.frame()
    assert sitting.stimuli is not None
    sitting.procedure = Procedure(sitting.design)
    blurred_scene(sitting.stimuli, sitting.design, sitting.design.scenes[0], sitting.design.levels[-1])


def _draw(image: Any, since: float) -> None:
    image.draw()


def _trial(sitting: Sitting, trial: BlurTrial) -> Chosen:
    design: BlurThresholdDesign = sitting.design
    screen, words, stimuli = sitting.screen, sitting.words, sitting.stimuli
    assert stimuli is not None
    picture = stimuli.picture(trial.scene, "pinhole", design.fixation)
    mark = sitting.mark(picture)
    levels: list[float] = []
    shown: list[tuple[str, Any]] = []

    def prepare() -> None:
        if trial.phase == "practice" or trial.catch:
            levels.append(design.levels[-1])
        else:
            sitting.procedure.learn(answers(sitting.recorded))
            levels.append(sitting.procedure.level())
        for number in (1, 2):
            added = levels[0] if number == trial.interval else 0.0
            image = screen.picture(blurred_scene(stimuli, design, trial.scene, design.pedestal + added))
            shown.append(("picture" if number == trial.interval else "reference", image))
        screen.warm(mark, *(image for _, image in shown))

    screen.empty(design.pause_s, "pause", prepare)
    screen.play(lambda since: mark.draw(), design.mark_s, "mark", lit=False)
    onsets = []
    for event, image in shown:
        onsets.append(screen.play(partial(_draw, image), design.picture_s, event))
        screen.empty(design.blank_s, "off")
    given = ask_which(screen, words(f"blur.question_{design.judged}"), (words("depth.first"), words("depth.second")))
    chosen = int(given.value)
    return Chosen(
        onset=sitting.since_start(onsets[0]),
        level=levels[0],
        answer=chosen,
        correct=chosen == trial.interval,
        response_time=given.seconds,
        stimulus=picture.png,
    )


BLUR_THRESHOLD = Experiment(
    task="blurthreshold",
    about=__doc__,
    trial=_trial,
    pictures=_pictures,
    check=_check,
    background=GREY,
    before=_before,
    right=lambda sitting, trial, answer: answer.correct,
)
