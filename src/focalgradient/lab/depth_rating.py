"""Experiment 1: how three-dimensional a picture looks, by its aperture and by what is fixated.

Each trial shows a mark on the object to be fixated, then the picture, then asks how three-dimensional it looked as a
ratio to the standard, a pinhole picture that counts as 1 and is shown at the start and again at intervals.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

from focalgradient.dataset import Rated
from focalgradient.design import DepthRatingDesign, DepthTrial
from focalgradient.lab.experiment import GREY, Experiment, Sitting
from focalgradient.lab.questions import Given, Scale, ask, pages
from focalgradient.stimuli import Picture

__all__ = ["DEPTH_RATING", "ask_confidence", "ask_depth", "show_picture", "show_standard"]


def _instructions(sitting: Sitting) -> Sequence[str]:
    """Pages that the participant reads."""
    design: DepthRatingDesign = sitting.design
    answer = (
        "type a number and press ENTER"
        if design.answer == "typed"
        else "move the marker with the arrow keys (or the mouse) and press ENTER"
    )
    stays = "The mark stays: keep looking at it." if design.mark == "kept" else "Keep looking where the mark was."
    return (
        "How deep does the picture look?\n"
        "You will see pictures of a scene, one after the other. Each time tell how three-dimensional the scene looks "
        "to you: how much it seems to extend in depth, in front of you and away from you.\n\n"
        "You compare each picture with one that we call the standard. It counts as 1. A picture that looks twice as "
        "deep is a 2; one that looks half as deep is 0.5. There are no right or wrong answers.",
        "A trial\n"
        f"A mark appears first: look at it. Then the picture comes, with an object where the mark was. {stays}\n\n"
        f"After the picture, {answer}.\n\n"
        "ESCAPE stops at any time; you will be asked before anything ends.",
    )


def _pictures(design: DepthRatingDesign) -> Sequence[tuple[str, str, str]]:
    """All that the design can show."""
    scenes = (*design.scenes, design.standard_scene)
    standard = [(design.standard_scene, "pinhole", fixation) for fixation in design.fixations]
    return [*product(scenes, design.apertures, design.fixations), *standard]


def show_standard(sitting: Sitting) -> None:
    """Show the picture that counts as 1."""
    design: DepthRatingDesign = sitting.design
    screen = sitting.screen
    _, image = sitting.picture(design.standard_scene, "pinhole", design.fixations[0])
    text = "The standard\nThe next picture is the standard. How deep it looks counts as 1.\n\nLook around in it freely."
    pages(screen, [text], "ready")
    screen.play(lambda seconds: image.draw(), design.standard_s, "standard")
    screen.on_event("off", screen.blank())


def show_picture(sitting: Sitting, trial: DepthTrial) -> tuple[float, Picture]:
    """Show mark, picture and blank of a trial: when the picture appeared (s of the sitting), and which it is."""
    design: DepthRatingDesign = sitting.design
    screen = sitting.screen
    picture, image = sitting.picture(trial.scene, trial.aperture, trial.fixation)
    mark = sitting.mark(picture)

    def draw(seconds: float) -> None:
        image.draw()
        if design.mark == "kept":
            mark.draw()

    screen.warm(image, mark)
    screen.play(lambda seconds: mark.draw(), design.mark_s, "mark", lit=False)
    onset = screen.play(draw, design.picture_s, "picture")
    screen.on_event("off", screen.blank())
    return sitting.since_start(onset), picture


def ask_depth(sitting: Sitting) -> Given:
    """Ask how three-dimensional it looked, as a ratio to the standard."""
    design: DepthRatingDesign = sitting.design
    scale = Scale(
        "How three-dimensional did it look?",
        "The standard is 1.",
        design.least_rating,
        design.most_rating,
        ends=("flatter", "deeper"),
        typed=design.answer == "typed",
    )
    return ask(sitting.screen, scale)


def ask_confidence(sitting: Sitting) -> float | None:
    """Ask how sure the participant is, from 0 to 1, where the design wants to know."""
    if not sitting.design.confidence:
        return None
    scale = Scale("How sure are you?", "", 0.0, 1.0, ratios=False, ends=("not at all", "quite sure"))
    return ask(sitting.screen, scale, "confidence").value


def _trial(sitting: Sitting, trial: DepthTrial) -> Rated:
    if trial.standard_before and trial.trial > 1:
        show_standard(sitting)
    onset, picture = show_picture(sitting, trial)
    answer = ask_depth(sitting)
    return Rated(
        onset=onset,
        rating=answer.value,
        response_time=answer.seconds,
        confidence=ask_confidence(sitting),
        stimulus=picture.png,
    )


DEPTH_RATING = Experiment(
    task="depthrating",
    about=__doc__,
    instructions=_instructions,
    trial=_trial,
    pictures=_pictures,
    background=GREY,
    before=show_standard,
)
