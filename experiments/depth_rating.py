"""Experiment 1: how three-dimensional a picture looks, by its aperture and by what is fixated.

Each trial shows a mark on the object to be fixated, then the picture, then asks how three-dimensional it looked as a
ratio to the standard, a pinhole picture that counts as 1 and is shown at the start and again at intervals.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from itertools import product

from laboratory import GREY, Programme, Sitting, run

from focalgradient.dataset import Rated
from focalgradient.design import DepthRatingDesign, DepthTrial


def instructions(sitting: Sitting) -> Sequence[str]:
    """What the participant is told."""
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


def pictures(design: DepthRatingDesign) -> Sequence[tuple[str, str, str]]:
    """All that the design can show."""
    scenes = (*design.scenes, design.standard_scene)
    standard = [(design.standard_scene, "pinhole", fixation) for fixation in design.fixations]
    return [*product(scenes, design.apertures, design.fixations), *standard]


def show_standard(sitting: Sitting) -> None:
    """Show the picture that counts as 1."""
    from questions import pages

    design: DepthRatingDesign = sitting.design
    screen = sitting.screen
    _, image = sitting.picture(design.standard_scene, "pinhole", design.fixations[0])
    text = "The standard\nThe next picture is the standard. How deep it looks counts as 1.\n\nLook around in it freely."
    pages(screen, [text], "ready")
    screen.play(lambda seconds: image.draw(), design.standard_s, "standard")
    screen.tell("off", screen.blank())


def trial(sitting: Sitting, trial: DepthTrial) -> Rated:
    """Show one picture and ask."""
    from questions import Scale, ask

    design: DepthRatingDesign = sitting.design
    screen = sitting.screen
    if trial.standard_before and trial.trial > 1:
        show_standard(sitting)
    picture, image = sitting.picture(trial.scene, trial.aperture, trial.fixation)
    mark = sitting.mark(picture)

    def draw(seconds: float) -> None:
        image.draw()
        if design.mark == "kept":
            mark.draw()

    screen.warm(image, mark)
    screen.play(lambda seconds: mark.draw(), design.mark_s, "mark", lit=False)
    onset = screen.play(draw, design.picture_s, "picture")
    screen.tell("off", screen.blank())
    depth = Scale(
        "How three-dimensional did it look?",
        "The standard is 1.",
        design.least_rating,
        design.most_rating,
        ends=("flatter", "deeper"),
        typed=design.answer == "typed",
    )
    given = ask(screen, depth)
    sure = None
    if design.confidence:
        scale = Scale("How sure are you?", "", 0.0, 1.0, ratios=False, ends=("not at all", "quite sure"))
        sure = ask(screen, scale, "confidence").value
    return Rated(
        onset=sitting.since_start(onset),
        rating=given.value,
        response_time=given.seconds,
        confidence=sure,
        stimulus=picture.png,
    )


PROGRAMME = Programme(
    task="depthrating",
    about=__doc__,
    instructions=instructions,
    trial=trial,
    pictures=pictures,
    background=GREY,
    before=show_standard,
)

if __name__ == "__main__":
    sys.exit(run(PROGRAMME))
