"""Simulated sessions: observers respond to a design, and their responses are recorded like a person's.

Each trial of each observer has its own random stream, so that responses depend neither on the process that computes
them nor on their order. One process records them in order.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focalgradient.dataset import Answer, Apparatus, Files, Session, export, read_journal
from focalgradient.design import BlurThresholdDesign, DepthRatingDesign, NeckerDesign
from focalgradient.design.plan import Plan
from focalgradient.errors import InputError
from focalgradient.observers.answers import EncodedPictures
from focalgradient.observers.observer import Observer, observer_named
from focalgradient.observers.rotation import EncodedCubes
from focalgradient.observers.sessions import observe
from focalgradient.observers.thresholds import known_threshold, seen_threshold
from focalgradient.parallel import in_order
from focalgradient.progress import Progress
from focalgradient.scales import OrdinalScale
from focalgradient.tasks import check_task, task_named

if TYPE_CHECKING:
    from focalgradient.observers.intervals import SeenLevels

__all__ = ["labels", "simulate"]

Simulated = DepthRatingDesign | NeckerDesign | BlurThresholdDesign | Plan
"""Designs that simulated observers can take part in."""

CLOCK = "seconds of a simulated clock, from the beginning of the session"
WHO = "simulated observer"
"""Key under which observer, seed and model version are recorded among the software versions of a session."""

MODEL = 5
"""Version of the observer model; data sets of another version are not continued."""


def labels(observers: int) -> tuple[str, ...]:
    """Return participant labels for a number of observers.

    >>> labels(3)
    ('01', '02', '03')
    """
    return tuple(f"{number:02}" for number in range(1, observers + 1))


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
    """Simulate observers and record them in a data set; sessions that it already contains are kept.

    Parameters
    ----------
    design
        Design of either experiment, of a threshold, or of a custom task.
    out
        Folder of the data set, new or with simulated observers.
    observers
        Number of observers in the data set afterwards.
    seed
        Random seed.
    observer
        Name of the observer in `focalgradient.observers.OBSERVERS`.
    encoded
        Encoded stimuli: `focalgradient.observers.encoded_stimuli` of the pictures, `encoded_cubes` of the design, or
        for a threshold `encoded_levels` of both. None for threshold observers with a known threshold, who look at no
        pictures (`focalgradient.observers.choose`).
    stimuli
        Folder of the pictures.
    executor
        Executor that computes the responses, which do not depend on it. None: this process.
    progress
        Function called with the completed fraction, 0 to 1, and a description of the work.

    Returns
    -------
    int
        Number of observers simulated in this call.

    Raises
    ------
    InputError
        If the observer is unknown, or the folder contains other data or other observers.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from focalgradient.design import BlurThresholdDesign
    >>> with TemporaryDirectory() as folder:
    ...     simulate(BlurThresholdDesign(), Path(folder, "data"), observers=2, seed=1)
    2
    """
    simulated_observer = observer_named(observer)
    check_task(design, observer=simulated_observer)
    if (
        simulated_observer.categories
        and isinstance(design, DepthRatingDesign)
        and design.response_scale.analysis.ratios
    ):
        design = DepthRatingDesign.model_validate(
            design.model_dump() | {"scale": OrdinalScale.name, "steps": simulated_observer.categories}
        )
    if isinstance(design, DepthRatingDesign):  # fixation follows the design: no gaze is recorded
        design = design.model_copy(update={"gaze": "none"})
    who = f"{observer}, seed {seed}, model {MODEL}"
    wanted = [label for label in labels(observers) if not _finished(out, design, label, who)]
    for label in wanted[:1]:
        begun = Files(out, design.task, label).journal.exists()
        Session.check(out, design, label, resume=begun, kind="simulated", stimuli=stimuli)
    apparatus = Apparatus(clock=CLOCK, versions={WHO: who})
    jobs = [(design, simulated_observer, label, seed, encoded) for label in wanted]
    computed = in_order(executor, _answers, jobs)
    for number, (label, answers) in enumerate(zip(wanted, computed, strict=True), start=1):
        if Files(out, design.task, label).journal.exists():
            session = Session.resume(out, design.task, label, apparatus=apparatus, stimuli=stimuli)
        else:
            about: dict[str, float] = {}
            if isinstance(design, BlurThresholdDesign):
                about = _threshold(design, simulated_observer, label, seed, encoded)
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
    """Return the threshold of a simulated person by unit, if it lies within the levels."""
    threshold = (
        known_threshold(design, label, seed) if seen is None else seen_threshold(design, observer, label, seed, seen)
    )
    return {} if threshold is None else {"threshold": threshold}


def _answers(job: tuple[Simulated, Observer, str, int, Any]) -> tuple[Answer, ...]:
    design, observer, label, seed, encoded = job
    return observe(task_named(design.task), design, observer, label, seed, encoded)


def _finished(out: Path, design: Simulated, label: str, who: str) -> bool:
    """Return whether a participant's session is complete; raise `InputError` if it has another design or observer."""
    files = Files(out, design.task, label)
    if not files.journal.exists():
        return False
    log = read_journal(files.journal)
    recorded = log.head["versions"].get(WHO)
    if recorded != who or log.head["design"] != design.model_dump(mode="json"):
        what = f"observer {recorded or 'unknown'}" if recorded != who else "another design"
        raise InputError(f"{files.journal} is of {what}, not of the simulated one ({who}): give another folder.")
    whole = len(log.of("trial")) == len(design.trials(label))
    if whole and not files.table.exists():
        export(files.journal)
    return whole
