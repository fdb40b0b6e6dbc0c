"""Content of the page for a design: texts, pictures, and the trial list of each participant."""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from focalgradient.dataset import Manifest, check_stimuli
from focalgradient.design import Design, Trial
from focalgradient.design.consent import Consent
from focalgradient.design.given_list import PARTICIPANT
from focalgradient.design.pages import pages_of
from focalgradient.design.sequence import Page, Pages, Standard, breaks
from focalgradient.design.words import Words, load_words
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.scales import OwnControl
from focalgradient.stimuli import StimulusSet, read_set
from focalgradient.tasks import Task, check_task, task_named
from focalgradient.tasks.steps import control_of
from focalgradient.web.pictures import (
    CONTENT,
    Described,
    form_of,
    is_png,
    own_session,
    own_trial,
    padded,
    parts,
    standard,
)

__all__ = ["Lists", "check_completion", "digest_of"]

DARK = -0.5
"""Grey of the laboratory's screen, from -1 to 1, below which the page is black."""

STANDARD = "/pictures/standard"
"""Address of the standard's picture."""

SHARED: dict[str, Any] = {one.name: one.default for one in fields(Trial)}
"""Fields of a trial that do not describe its stimulus, with their defaults."""


class Lists:
    """Design in the form that the browser page needs.

    Parameters
    ----------
    design
        Design of a task whose trials are described as data.
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
        self._measuring, self._sizes = threading.Lock(), dict[str, int]()
        self.pictures: StimulusSet | None = None
        self.manifest: Manifest | None = None
        if not self._task.described:
            raise InputError(
                f"{design.task} shows its trials by its own program, which a browser cannot run: run it in the "
                "laboratory with focalgradient run."
            )
        if self._task.adapts and self._task.adjusts:
            raise InputError(
                f"{design.task} adapts its adjustments to the responses, which a browser cannot do: run it in the "
                "laboratory with focalgradient run."
            )
        if needed := self._task.needed(design):
            if stimuli is None:
                raise InputError(f"stimuli is missing: {design.task} shows pictures; give the folder of a set of them.")
            self.manifest = check_stimuli(stimuli)
            self.pictures = read_set(stimuli)
            self.pictures.check(needed, getattr(design, "picture_factors", ()))
        if getattr(design, "practice_required", False):
            raise InputError("practice_required is for the laboratory, but a browser goes on: leave it out.")
        self._display = self.pictures.display if self.pictures else Display()
        self._own = lru_cache(16)(
            lambda trial, seed: own_trial(
                Described.of(self._task, design, trial, seed, self.words, self._display, self.pictures)
            )
        )
        for label in sorted({str(row.get(PARTICIPANT, "001")).removeprefix("sub-") for row in design.given_trials}):
            _check_finite(label, design.trials(label))
        check_task(design, self.words, pixels_per_degree=self._display.pixels_per_degree, stimuli=self.pictures)
        if self._task.adjusts:
            return
        control = control_of(self._task, design, self.words, design.trials("01")[0], "01")
        if isinstance(control, OwnControl):
            raise InputError(
                f"{design.task} is answered on a control of its own, which a browser cannot show: run it in the "
                "laboratory with focalgradient run."
            )

    def opening(self) -> dict[str, Any]:
        """Return what the page needs before a session begins: texts, consent, form fields, required measurements."""
        consent = self.consent and {"pages": list(self.consent.texts), "sha256": self.consent.sha256}
        return {
            "language": self.words.language if len(self.words.language) == 2 else "en",
            "words": {name: entry for name, entry in self.words.entries.items() if self._is_told(name)},
            "consent": consent,
            "ask": list(self.design.ask),
            "gamma": self.gamma,
            "dark": self._task.background < DARK,
            "smallest_screen": sorted(self.design.smallest_screen, reverse=True),
            "refocuses": self._task.adjusts,
        }

    def _is_told(self, name: str) -> bool:
        """Return whether a text is needed by every page; texts of tasks and debriefings come with their pages."""
        named = ("common.decimal", "scale.typed_wrong", "session.rest_wait", "session.thanks")
        return name.startswith(("web.", "form.")) or name in named

    def session(self, participant: str) -> dict[str, Any]:
        """Return the content that all trials of a participant share: first and last pages, scale, sizes."""
        design: Any = self.design
        content = own_session(design, self._display)
        pages = self._pages(participant)
        opening = pages.opening()
        if any(isinstance(page, Page) and page.at is not None for page in opening):  # an example of an answer
            content["scale"] = form_of(design.response_scale.control(self.words), self.words)
        return content | {"opening": [self._step(page) for page in opening]}

    def again(self, participant: str) -> dict[str, Any] | None:
        """Return the page before repeated practice; None for a task without it."""
        page = self._pages(participant).again()
        return None if page is None else self._step(page)

    def closing(self, participant: str) -> list[dict[str, Any]]:
        """Return the pages of the debriefing."""
        return [self._step(page) for page in self._pages(participant).closing()]

    def _pages(self, participant: str) -> Pages:
        return pages_of(self.design, self.words, participant, browser=True)

    def _step(self, step: Page | Standard) -> dict[str, Any]:
        if not isinstance(step, Standard):
            shown = {"event": step.event, "text": step.text, "at": step.at, "least_s": step.least_s or None}
            return {name: value for name, value in shown.items() if value is not None}
        interval = self._standard(step.form)
        if interval.pop(CONTENT, None) is not None:
            interval["url"] = STANDARD
        return {"event": "ready", "text": step.text, "standard": interval}

    def _standard(self, form: str) -> dict[str, Any]:
        return standard(self._task, self.design, form, self.words, self._display, self.pictures)

    def shown(
        self,
        participant: str,
        trials: Sequence[Trial],
        began: int = 0,
        asked: slice = slice(None),
        recorded: Sequence[Mapping[str, Any]] = (),
    ) -> list[dict[str, Any]]:
        """Return the stimuli and adjoining pages of trials.

        "first" precedes a trial that is the first of its sitting, "before" any other; "lead" and "after" accompany each
        presentation of it. Pictures have addresses that name the trial's number and theirs, and nothing else.

        Parameters
        ----------
        participant, trials
            Label, and all trials of the session.
        began
            Number of trials recorded before this sitting.
        asked
            Trials to return, counted from `began`.
        recorded
            Responses so far, on which the stimuli of an adaptive task depend.
        """
        entries = []
        for turn, first, before in breaks(self.design, self.words, self._pages(participant), trials, began)[asked]:
            trial = turn.trial
            entry = {"phase": trial.phase, "trial": trial.trial, **self._stimuli(participant, trial, recorded)}
            for number, part in enumerate(parts(entry)):
                part.pop(CONTENT)
                part["url"] = f"/pictures/{trial.phase}/{trial.trial}/{number}"
            if further := self._task.further(self.design, self.words, trial):
                entry["also"] = [
                    {"name": name, "scale": form_of(control, self.words)} for name, (control, _) in further.items()
                ]
            around = {"first": first, "before": before, "lead": turn.lead, "after": turn.after}
            entries.append(entry | {name: list(map(self._step, steps)) for name, steps in around.items()})
        return entries

    def contents(self, participant: str, trial: Trial, recorded: Sequence[Mapping[str, Any]] = ()) -> list[bytes]:
        """Return the files of a trial's pictures."""
        return [_read(part[CONTENT]) for part in parts(self._stimuli(participant, trial, recorded))]

    def files(self, participant: str, trial: Trial, recorded: Sequence[Mapping[str, Any]] = ()) -> list[bytes]:
        """Return the same files, filled up to the size that all files of the participant's session have."""
        contents = self.contents(participant, trial, recorded)
        return padded(contents, 0 if all(map(is_png, contents)) else self._largest(participant))

    def _largest(self, participant: str) -> int:
        """Return the size in bytes of the largest film or focus series of a session, of which each is made once."""
        found = 0
        with self._measuring:
            for trial in self.design.trials(participant):
                alike = repr(replace(trial, **SHARED))
                if alike not in self._sizes:
                    self._sizes[alike] = max(map(len, self.contents(participant, trial)), default=0)
                found = max(found, self._sizes[alike])
        return found

    def standard(self) -> bytes | None:
        """Return the file of the standard's picture; None if the design has none."""
        if self.pictures is None:
            return None
        return _read(self._standard("picture")[CONTENT])

    def key(self, participant: str, trial: Trial) -> dict[str, Any]:
        """Return the correct response to a practice trial, by which a page without a server judges it."""
        right = self._task.right_key and self._task.right_key(self.design, trial, participant)
        return {"right": right, "interval": getattr(trial, "interval", None)}

    @property
    def _task(self) -> Task:
        return task_named(self.design.task)

    def _stimuli(self, participant: str, trial: Trial, recorded: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
        design: Any = self.design
        shown = self._task.adapted(design, trial, recorded) if self._task.adapts else trial
        entry = deepcopy(self._own(shown, design.noise_seed(participant, trial)))
        if not self._task.adjusts:
            entry["scale"] = form_of(control_of(self._task, design, self.words, shown, participant), self.words)
        return entry


def _read(content: bytes | Path | Callable[[], bytes]) -> bytes:
    if isinstance(content, bytes):
        return content
    return content.read_bytes() if isinstance(content, Path) else content()


def check_completion(completion: str | None) -> None:
    """Raise `InputError` unless `completion`, to which participants are redirected, is None or an address."""
    if completion is not None and not completion.startswith(("https://", "http://")):
        raise InputError(f"completion is {completion!r}, but must be an address that starts with https://.")


def _check_finite(participant: str, trials: Sequence[Trial]) -> None:
    for trial in trials:
        try:
            json.dumps(asdict(trial), allow_nan=False)
        except ValueError as error:
            raise InputError(
                f"{trial.phase} trial {trial.trial} of participant {participant} has a number that is not finite: "
                "correct the list of trials."
            ) from error


def digest_of(trials: Sequence[Trial]) -> str:
    """Return the SHA-256 of a trial list, which identifies a list made in advance."""
    content = [asdict(trial) for trial in trials]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
