"""Observers run through a design, and what they answer recorded as a person's answers are.

Each trial of each observer has its own stream of random numbers, so that answers do not depend on who computes them,
when, or beside what. They are recorded here, in order, by one process.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focalgradient.dataset import Answer, Apparatus, Files, Session, export, read_journal
from focalgradient.design import BlurThresholdDesign, DepthRatingDesign, DepthTrial, NeckerDesign
from focalgradient.design.depth_rating import EXAMPLES
from focalgradient.design.plan import Plan
from focalgradient.errors import InputError
from focalgradient.observers.answers import EncodedPictures
from focalgradient.observers.observer import FORMER_NAMES, Observer, observer_named
from focalgradient.observers.rotation import EncodedCubes
from focalgradient.observers.thresholds import known_threshold, seen_threshold
from focalgradient.parallel import in_order
from focalgradient.progress import Progress
from focalgradient.scales import OrdinalScale
from focalgradient.stimuli import StimulusSet
from focalgradient.tasks import task_named

if TYPE_CHECKING:
    from focalgradient.observers.intervals import SeenLevels

__all__ = ["check_pictures", "labels", "simulate"]

Simulated = DepthRatingDesign | NeckerDesign | BlurThresholdDesign | Plan
"""Designs that simulated observers take part in."""

CLOCK = "seconds of a simulated clock, from the beginning of the session"
WHO = "simulated observer"
"""The entry of the observer's name, seed and model among the versions of what a session was run with."""

MODEL = 5
"""Version of the observers' model: a data set of another one is not continued."""


def labels(observers: int) -> tuple[str, ...]:
    """Labels of so many participants.

    >>> labels(3)
    ('01', '02', '03')
    """
    return tuple(f"{number:02}" for number in range(1, observers + 1))


def check_pictures(design: DepthRatingDesign, stimuli: StimulusSet) -> None:
    """Refuse a set that lacks a picture of the design, or has it with another aperture.

    Raises
    ------
    InputError
        Naming the first picture.
    """
    own = [name for name, factor in design.factors.items() if factor.pictures]
    if own:
        raise InputError(
            f"factors names {own[0]!r}, whose levels are pictures, which simulated observers do not look at: leave it "
            "out, or say pictures = false."
        )
    stimuli.picture(design.standard_scene, "pinhole", design.fixations[0])
    for trial in design.trials("01"):
        assert isinstance(trial, DepthTrial)
        if trial.scene in EXAMPLES.values():
            continue  # a drawing, not of the set
        picture = stimuli.picture(trial.scene, trial.aperture, trial.fixation)
        if abs(picture.aperture_mm - trial.aperture_mm) > 0.01:
            raise InputError(
                f"{trial.aperture} is {picture.aperture_mm:.3g} mm in {stimuli.folder}, but {trial.aperture_mm:.3g} mm "
                "in the design: make its focal_length_mm that of the pictures."
            )


def simulate(
    design: Simulated,
    out: Path,
    *,
    observers: int,
    seed: int,
    observer: str = "default",
    encoded: EncodedPictures | EncodedCubes | Mapping[str, SeenLevels] | None = None,
    stimuli: Path | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> int:
    """Simulate observers and record them in a data set; those that it has already are left as they are.

    Parameters
    ----------
    design
        Of either experiment, or of a threshold.
    out
        Folder of the data set, new or of simulated observers.
    observers
        How many it is to have.
    seed
        Of all that is random in them.
    observer
        By name, of `focalgradient.observers.OBSERVERS`.
    encoded
        `focalgradient.observers.encoded_stimuli` of the pictures, `encoded_cubes` of the design, or `encoded_levels` of
        both for a threshold; None for a threshold, whose observers have a known one then and look at no pictures
        (`focalgradient.observers.choose`).
    stimuli
        Folder of the pictures.
    executor
        What computes the answers; the same whatever it is. None: this process.
    progress
        Called with the share done, 0 to 1, and what is being done.

    Returns
    -------
    int
        How many were simulated now.

    Raises
    ------
    InputError
        If there is no observer of that name, or the folder holds something else, or other observers.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from focalgradient.design import BlurThresholdDesign
    >>> with TemporaryDirectory() as folder:
    ...     simulate(BlurThresholdDesign(), Path(folder, "data"), observers=2, seed=1)
    2
    """
    one = observer_named(observer)
    if one.categories and isinstance(design, DepthRatingDesign) and design.response_scale.analysis.ratios:
        design = DepthRatingDesign.model_validate(
            design.model_dump() | {"scale": OrdinalScale.name, "steps": one.categories}
        )
    if isinstance(design, DepthRatingDesign):  # they fixate what the design says: no gaze is recorded
        design = design.model_copy(update={"gaze": "none"})
    who = f"{FORMER_NAMES.get(observer, observer)}, seed {seed}, model {MODEL}"
    wanted = [label for label in labels(observers) if not _finished(out, design, label, who)]
    for label in wanted[:1]:
        begun = Files(out, design.task, label).journal.exists()
        Session.check(out, design, label, resume=begun, kind="simulated", stimuli=stimuli)
    apparatus = Apparatus(clock=CLOCK, versions={WHO: who})
    jobs = [(design, one, label, seed, encoded) for label in wanted]
    computed = in_order(executor, _answers, jobs)
    for number, (label, answers) in enumerate(zip(wanted, computed, strict=True), start=1):
        if Files(out, design.task, label).journal.exists():
            session = Session.resume(out, design.task, label, apparatus=apparatus, stimuli=stimuli)
        else:
            about: dict[str, float] = {}
            if isinstance(design, BlurThresholdDesign):
                about = _threshold(design, one, label, seed, encoded)
            session = Session.begin(
                out, design, label, apparatus=apparatus, kind="simulated", stimuli=stimuli, about=about
            )
        with session:
            remaining = session.remaining()
            for trial, answer in zip(remaining, answers[-len(remaining) :], strict=True):
                session.record(trial, answer)
        if progress is not None:
            progress(number / len(wanted), "simulating observers")
    return len(wanted)


def _threshold(design: BlurThresholdDesign, observer: Observer, label: str, seed: int, seen: Any) -> dict[str, float]:
    """The threshold that a simulated person has, if there is one among the levels."""
    found = (
        known_threshold(design, label, seed) if seen is None else seen_threshold(design, observer, label, seed, seen)
    )
    return {} if found is None else {"threshold": found}


def _answers(job: tuple[Simulated, Observer, str, int, Any]) -> tuple[Answer, ...]:
    design, observer, label, seed, encoded = job
    return task_named(design.task).observe(design, observer, label, seed, encoded)


def _finished(out: Path, design: Simulated, label: str, who: str) -> bool:
    """Whether a participant is in the data set, whole; if in part, by the same design and the same observer."""
    files = Files(out, design.task, label)
    if not files.journal.exists():
        return False
    log = read_journal(files.journal)
    found = log.head["versions"].get(WHO)
    if found != who or log.head["design"] != design.model_dump(mode="json"):
        what = f"observer {found or 'unknown'}" if found != who else "another design"
        raise InputError(f"{files.journal} is of {what}, not of the simulated one ({who}): give another folder.")
    whole = len(log.of("trial")) == len(design.trials(label))
    if whole and not files.table.exists():
        export(files.journal)
    return whole
