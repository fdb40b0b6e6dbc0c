"""Content of the page for a design: texts, pictures, and the trial list of each participant."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from focalgradient.dataset import Manifest, check_stimuli
from focalgradient.design import DepthRatingDesign, DepthTrial, Design, NeckerDesign, NeckerTrial, Trial
from focalgradient.design.consent import Consent
from focalgradient.design.necker import LEAST_HELD
from focalgradient.design.pages import pages_of
from focalgradient.design.sequence import Page, Pages, Standard, breaks
from focalgradient.design.words import Words, load_words
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.stimuli import StimulusSet, read_set
from focalgradient.stimuli.drawings import DRAWINGS
from focalgradient.tasks import Task, check_task, task_named
from focalgradient.web import texts
from focalgradient.web.pictures import (
    cube_session,
    cube_trial,
    depth_session,
    depth_trial,
    drawing_png,
    own_session,
    own_trial,
    standard,
)

__all__ = ["Lists", "check_completion", "digest_of"]


class Lists:
    """Design in the form that the browser page needs.

    Parameters
    ----------
    design
        Design of depth rating, of the Necker cube, or of a user-defined task whose trials are described as data.
    stimuli
        Folder of the pictures; required for depth rating.
    consent
        Consent text, if there is one.
    gamma
        Whether participants match greys to estimate their display's gamma.

    Raises
    ------
    InputError
        If the design cannot run in a browser, or pictures are missing or were changed.
    """

    def __init__(
        self, design: Design, stimuli: Path | None = None, consent: Consent | None = None, *, gamma: bool = False
    ):
        self.design, self.folder, self.consent, self.gamma = design, stimuli, consent, gamma
        self.words: Words = load_words(design.language)
        self.pictures: StimulusSet | None = None
        self.manifest: Manifest | None = None
        self.files: frozenset[str] = frozenset()
        self.drawings: dict[str, bytes] = {}
        if isinstance(design, DepthRatingDesign):
            if stimuli is None:
                raise InputError("stimuli is missing: depth rating shows pictures; give the folder of a set of them.")
            texts.check(design)
            manifest = check_stimuli(stimuli)
            self.manifest, self.files = manifest, frozenset(manifest.files)
            self.pictures = read_set(stimuli)
            self.drawings = {f"{name}.png": drawing_png(name, self.pictures) for name in DRAWINGS}
            self.pictures.check(design.pictures(), design.picture_factors)
        elif not (isinstance(design, NeckerDesign) or task_named(design.task).described):
            raise InputError(
                f"{design.task} needs what a browser cannot provide (real objects, or pictures blurred "
                "during the session): run it in the laboratory with focalgradient run."
            )
        elif self._task.adapts and self._task.adjusts:
            raise InputError(
                f"{design.task} adapts its adjustments to the responses, which a browser cannot do: run it in the "
                "laboratory with "
                "focalgradient run."
            )
        if getattr(design, "practice_required", False):
            raise InputError("practice_required is for the laboratory, but a browser goes on: leave it out.")
        if design.smallest_screen and isinstance(design, DepthRatingDesign | NeckerDesign):
            raise InputError(
                f"smallest_screen is given, but {design.task} needs a keyboard and a screen of 640 x 480 pixels: leave "
                "it out."
            )
        self._display = self.pictures.display if self.pictures else Display()
        check_task(design, self.words, pixels_per_degree=self._display.pixels_per_degree)

    def opening(self) -> dict[str, Any]:
        """Return what the page needs before a session begins: texts, consent, form fields, required measurements."""
        consent = self.consent and {"pages": list(self.consent.texts), "sha256": self.consent.sha256}
        return {
            "language": self.words.language if len(self.words.language) == 2 else "en",
            "words": {name: entry for name, entry in self.words.entries.items() if isinstance(entry, str)},
            "consent": consent,
            "ask": list(self.design.ask),
            "gamma": self.gamma,
            "dark": isinstance(self.design, NeckerDesign),
            "smallest_screen": sorted(self.design.smallest_screen, reverse=True),
            "refocuses": self._task.adjusts,
        }

    def session(self, participant: str) -> dict[str, Any]:
        """Return the content that all trials of a participant share: first and last pages, scale or keys, sizes."""
        design: Any = self.design
        if isinstance(design, DepthRatingDesign):
            assert self.pictures is not None
            content = depth_session(design, self.pictures) | {"scale": texts.scale(design, self.words)}
        elif isinstance(design, NeckerDesign):
            content = cube_session(design, self._display) | {"keys": design.keys_of(participant)}
        else:
            content = own_session()
        pages = self._pages(participant)
        again = pages.again()
        judged = (getattr(design, "practice_right", 0.0), getattr(design, "practice_rounds", 1))
        return content | {
            "opening": [self._step(page) for page in pages.opening()],
            "closing": self.closing(participant),
            "practice": dict(zip(("share", "rounds"), judged, strict=True)) | {"again": again and self._step(again)},
        }

    def closing(self, participant: str) -> list[dict[str, Any]]:
        """Return the pages of the debriefing."""
        return [self._step(page) for page in self._pages(participant).closing()]

    def _pages(self, participant: str) -> Pages:
        return pages_of(self.design, self.words, participant, browser=True)

    def _step(self, step: Page | Standard) -> dict[str, Any]:
        shown = isinstance(step, Standard) and self.pictures is not None
        return texts.step(step, standard(self.design, self.pictures) if shown else None)  # type: ignore[arg-type]

    def shown(self, participant: str, trials: Sequence[Trial], done: int = 0) -> list[dict[str, Any]]:
        """Return the stimuli and adjoining pages of a session's remaining trials.

        "first" precedes a trial that is the first of its sitting, "before" any other; "lead" and "after" accompany each
        presentation of it.
        """
        entries = []
        for turn, first, before in breaks(self.design, self.words, self._pages(participant), trials, done):
            trial = turn.trial
            entry: dict[str, Any] = {"phase": trial.phase, "trial": trial.trial}
            # Stimuli that depend on earlier responses are requested when the trial begins.
            entry |= {"adapts": True, **self._asked(trial)} if self._task.adapts else self._shown(trial)
            if further := task_named(self.design.task).further(self.design, self.words, trial):
                entry["also"] = [{"name": name, "scale": control.form()} for name, (control, _) in further.items()]
            if trial.phase == "practice":
                entry["right"] = self._right(trial)
            around = {"first": first, "before": before, "lead": turn.lead, "after": turn.after}
            entries.append(entry | {name: list(map(self._step, steps)) for name, steps in around.items()})
        return entries

    def _right(self, trial: Trial) -> dict[str, Any] | None:
        """Return the criterion for a correct practice response; None if the trial has no correct response."""
        design: Any = self.design
        if isinstance(trial, DepthTrial):
            side: dict[str, float] | None = design.right_side(trial)
            return side
        if not isinstance(trial, NeckerTrial):
            return None
        return None if trial.shape == "ambiguous" else {"shape": trial.shape, "share": LEAST_HELD}

    @property
    def _task(self) -> Task:
        return task_named(self.design.task)

    def _asked(self, trial: Trial) -> dict[str, Any]:
        """Return a trial's response scale, which does not depend on earlier responses."""
        return {"interval": 1, "scale": self._task.control(self.words, trial).form()}

    def adapted(self, trial: Trial, recorded: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        """Return the stimuli of a trial, given the responses so far."""
        return self._shown(self._task.adapted(self.design, trial, recorded))

    def _shown(self, trial: Trial) -> dict[str, Any]:
        design: Any = self.design
        if isinstance(trial, DepthTrial):
            assert self.pictures is not None
            return depth_trial(design, self.pictures, trial)
        if isinstance(trial, NeckerTrial):
            return cube_trial(trial)
        files, entry = own_trial(task_named(design.task), design, trial, self.words, self._display)
        self.drawings |= files
        return entry


def check_completion(completion: str | None) -> None:
    """Raise `InputError` unless `completion`, to which participants are redirected, is None or an address."""
    if completion is not None and not completion.startswith(("https://", "http://")):
        raise InputError(f"completion is {completion!r}, but must be an address that starts with https://.")


def digest_of(trials: Sequence[Trial]) -> str:
    """Return the SHA-256 of a trial list, which identifies a list made in advance."""
    content = [asdict(trial) for trial in trials]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
