"""What the page notes of a session, as records of a session: with what it was run, and what was answered."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ValidationError

from focalgradient.dataset import Apparatus, Press, Rated, Watched
from focalgradient.design import DepthTrial, NeckerTrial, Trial
from focalgradient.stimuli import StimulusSet
from focalgradient.web.messages import Depth, Necker, Sitting
from focalgradient.web.pictures import picture_file

__all__ = ["apparatus_of", "first_problem", "read_answer"]

CLOCK = "seconds from when the page of this sitting was ready, of the browser's performance.now()"


def apparatus_of(given: Sitting, **versions: str) -> Apparatus:
    """What a sitting in a browser was run with; `versions` of what else took part."""
    wide, high = given.screen_px
    return Apparatus(
        clock=CLOCK,
        screen_px=(wide, high),
        screen_m=None if given.screen_m is None else (given.screen_m[0], given.screen_m[1]),
        viewing_distance_m=given.viewing_distance_m,
        refresh_hz=given.refresh_hz,
        gamma=None,
        versions={**versions, "browser": given.browser},
    )


def read_answer(
    pictures: StimulusSet | None, trial: Trial, answer: Mapping[str, Any]
) -> tuple[Rated | Watched, dict[str, Any]]:
    """Read the answer of a trial, and what was noted of its frames; `pictures` of depth rating.

    Raises
    ------
    ValidationError
        If it is no answer of the design's kind.
    InputError
        If its numbers are none of an answer.
    """
    kind: type[BaseModel] = Necker if isinstance(trial, NeckerTrial) else Depth
    read: Any = kind.model_validate_json(json.dumps(answer))
    frames = read.frames.model_dump()
    if isinstance(read, Necker):
        watched = Watched(
            onset=read.onset,
            presses=sorted(Press(*press) for press in read.presses),
            trial_duration=read.trial_duration,
            dropped_frames=read.dropped_frames,
        )
        return watched, frames
    assert isinstance(trial, DepthTrial)
    assert pictures is not None
    rated = Rated(
        onset=read.onset,
        rating=read.rating,
        response_time=read.response_time,
        dropped_frames=read.dropped_frames,
        stimulus=picture_file(pictures, (trial.scene, trial.aperture, trial.fixation)),
        start=read.start,
    )
    return rated, frames


def first_problem(error: ValidationError) -> str:
    """What is wrong with a message, in a few words: nothing of the message itself is repeated."""
    one = error.errors(include_url=False, include_context=False, include_input=False)[0]
    return f"{'.'.join(map(str, one['loc']))}: {one['msg']}"[:200]
