"""Conversion of the page's messages to session records: apparatus, and responses."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from datetime import datetime
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError

from focalgradient.dataset import Apparatus, Noted, Press, Session, answer_event
from focalgradient.dataset.times import times_of_events
from focalgradient.design import Trial
from focalgradient.design.given_list import trial_row
from focalgradient.design.words import Words, load_words
from focalgradient.display import Display
from focalgradient.errors import InputError
from focalgradient.scales import Control, Held, Scale, Ways
from focalgradient.stimuli import StimulusSet
from focalgradient.tasks.noted import SHOWN, SHOWN_ABOUT, START, noted_start, with_noted
from focalgradient.tasks.steps import control_of, stimulus_of
from focalgradient.web import messages
from focalgradient.web.messages import Answer, Exposure, Sitting
from focalgradient.web.pictures import Described, drawn, shown_sha256
from focalgradient.web.possible import check_frames, check_possible, check_presses
from focalgradient.web.screen import gamma_of, measure

__all__ = [
    "Read",
    "about_sitting",
    "apparatus_of",
    "expose",
    "first_problem",
    "read_practice",
    "record",
    "round_notes",
]

CLOCK = "seconds since the page of this sitting was ready, by the browser's performance.now()"
SCALE_TOLERANCE = 1e-6
"""Rounding tolerance at the ends of a response scale, in scale units."""
UNKNOWN_RATE = "; the browser does not report its refresh rate, so that late frames were not counted"


def apparatus_of(given: Sitting, **versions: str) -> Apparatus:
    """Return the apparatus of a sitting in a browser; `versions` are those of other software involved."""
    wide, high = given.screen_px
    size = None if given.screen_m is None else (given.screen_m[0], given.screen_m[1])
    distance, size_sd, distance_sd = given.viewing_distance_m, None, None
    if given.card_px is not None:
        found = measure(given.card_px, given.blind_spot_px, given.refresh_hz)
        css = (wide / given.pixel_ratio, high / given.pixel_ratio)
        size = (css[0] * found.pixel_m, css[1] * found.pixel_m)
        size_sd = (css[0] * found.pixel_sd_m, css[1] * found.pixel_sd_m)
        distance, distance_sd = found.distance_m, found.distance_sd_m
    return Apparatus(
        clock=CLOCK if given.refresh_hz is not None else CLOCK + UNKNOWN_RATE,
        screen_px=(wide, high),
        screen_m=size,
        screen_sd_m=size_sd,
        viewing_distance_m=distance,
        viewing_distance_sd_m=distance_sd,
        refresh_hz=given.refresh_hz,
        gamma=None,
        gamma_seen=gamma_of(given.gamma_matches),
        versions={**versions, "browser": given.browser},
    )


def about_sitting(given: Sitting) -> dict[str, Any]:
    """Return the raw measurements of a sitting that its journal keeps, so that derived values can be recomputed."""
    about: dict[str, Any] = {"browser": given.browser, "pixel_ratio": given.pixel_ratio}
    if given.waited_ms:
        about["waited_s"] = given.waited_ms / 1000
    if given.card_px is not None:
        about |= {"card_px": given.card_px, "blind_spot_px": given.blind_spot_px}
    if given.gamma_matches:
        about["gamma_matches"] = given.gamma_matches
    return about


class Read(NamedTuple):
    """Response, its frame times, and the shortest time in s in which it can have been given."""

    answer: Any
    frames: dict[str, Any]
    seconds: float


def read_answer(session: Session, pictures: StimulusSet | None, trial: Trial, answer: Mapping[str, Any]) -> Read:
    """Parse the response to a trial; `pictures` is the set that the task uses.

    Raises
    ------
    ValidationError
        If the response does not have the form of the design's responses.
    InputError
        If a value is outside its permitted range.
    """
    design: Any = session.design
    task, participant = session.task, session.files.participant
    words = load_words(design.language)
    shown = trial if task.adjusts else task.adapted(design, trial, session.recorded)
    control: Any = None if task.adjusts else control_of(task, design, words, shown, participant)
    kind: type[BaseModel] = messages.Held if isinstance(control, Held) else messages.Rating
    read: Any = kind.model_validate_json(json.dumps(answer))
    frames = read.frames.model_dump()
    _check_begun(read.onset, frames)
    extra = _further(session, trial, words, read.also)
    times = {"onset": read.onset, "dropped_frames": read.dropped_frames}
    least = design.least_s(trial)
    if task.adjusts:
        check_frames(frames["shown"], read.response_time + 1.0)
        times |= {"response_time": read.response_time, "start": read.start}
        given = task.answered(design, trial, _value(read), **times)
        return Read(with_noted(given, extra), frames, least + read.response_time)
    display = Display() if pictures is None else pictures.display
    seed = design.noise_seed(participant, trial)
    described = Described.of(task, design, shown, seed, words, display, pictures)
    seen = drawn(described)
    least = max(seen.seconds, least)
    check_frames(frames["shown"], least)
    late = _name_pictures(frames, seen.events, seen.judged)
    times["onset"] += late
    value: Any
    if isinstance(control, Held):
        check_presses(read, control.keys, seen.seconds)
        value = sorted(Press(time - late, key, down) for time, key, down in read.presses)
        times["response_time"] = read.trial_duration - late
        seconds = read.trial_duration
    else:
        value, times["response_time"] = _value(read), read.response_time
        _check_reached("rating", value, control)
        extra |= _started(read.start, control)
        seconds = design.least_s(trial) + read.response_time
    if digests := shown_sha256(described):
        extra[SHOWN] = Noted(digests, description=SHOWN_ABOUT)
    given = task.answered(design, shown, value, **times, **stimulus_of(task, design, shown, pictures))
    return Read(with_noted(given, extra, task.columns(design.model_dump(mode="json"))), frames, seconds)


def _value(read: messages.Rating) -> float:
    value = read.rating if read.chosen is None else read.chosen
    if value is None:
        raise InputError("rating is missing: send the response.")
    return float(value)


def _name_pictures(frames: dict[str, Any], names: Sequence[str], judged: int) -> float:
    """Name a trial's pictures, which the page calls alike; return the time in s from the first to the judged one."""
    pictures = [event for event in frames["shown"] if event["event"] == "picture"]
    if len(pictures) != len(names):
        return 0.0
    for event, name in zip(pictures, names, strict=True):
        event["event"] = name
    if judged:
        frames["judged"] = judged
    return float(pictures[judged]["stamps"][0] - pictures[0]["stamps"][0]) / 1e3


def _check_reached(name: str, value: float, control: Control) -> None:
    reached = control.reached()
    least, most = min(reached), max(reached)
    if not least - SCALE_TOLERANCE <= value <= most + SCALE_TOLERANCE:
        raise InputError(f"{name} is {value:g}, but must be from {least:g} to {most:g}: send a value on the scale.")
    if not isinstance(control, Scale) and min(abs(value - one) for one in reached) > SCALE_TOLERANCE:
        raise InputError(f"{name} is {value:g}, which lies between two answers: send one of them.")


def _check_begun(onset: float, frames: Mapping[str, Any]) -> None:
    times = [seconds for _, seconds in times_of_events(onset, frames)]
    first = min(times, default=0.0)
    if round(first, 6) < 0:  # data sets store microseconds
        raise InputError(f"a stimulus was shown {-first:.3g} s before the session began: send the measured times.")


def _further(session: Session, trial: Trial, words: Words, given: Mapping[str, float]) -> dict[str, Noted]:
    """Parse the responses to a trial's additional questions; exactly those asked must be present."""
    asked = session.task.further(session.design, words, trial)
    starts = {f"{name}_{START}" for name, (control, _) in asked.items() if not isinstance(control, Ways)}
    if wrong := sorted({*asked} ^ ({*given} - starts)):
        raise InputError(
            f"{wrong[0][:40]} is {'not asked' if wrong[0] in given else 'missing'}: send exactly the responses asked "
            "for."
        )
    for name, (control, _) in asked.items():
        _check_reached(name, given[name], control)
    noted = {name: replace(about, value=given[name]) for name, (_, about) in asked.items()}
    for name, (control, _) in asked.items():
        noted |= _started(given.get(f"{name}_{START}"), control, name)
    return noted


def _started(start: float | None, control: Control, name: str = "") -> dict[str, Noted]:
    """Return the note of a marker's initial position, which must lie on its scale."""
    if start is not None:
        _check_reached(f"{name}_{START}" if name else START, start, control)
    return noted_start(start, name)


def record(
    session: Session,
    pictures: StimulusSet | None,
    given: Answer,
    received: datetime | None = None,
    elapsed_s: float | None = None,
    practice: Sequence[messages.Round] = (),
) -> dict[str, Any]:
    """Record the response to the next trial; return the frame times.

    Parameters
    ----------
    session, pictures, given
        Session; its set of pictures; and the response.
    received
        Time of arrival by the server's clock; None if a platform received it.
    elapsed_s
        Seconds since the page received its trials, by the same clock; None if unknown.
    practice
        Results of practice before it that are not recorded.

    Raises
    ------
    ValidationError, InputError
        As for `read_answer`; nothing is then recorded.
    """
    trial = session.remaining()[0]
    answer, frames, seconds = read_answer(session, pictures, trial, given.answer)
    session.check_answer(trial, answer)
    check_possible(seconds, elapsed_s)
    notes = []
    for one in practice:
        again = read_practice(session, pictures, one.again)
        notes += round_notes(one.round, one.model_dump(), again, elapsed_s)
    about = {"phase": given.phase, "trial": given.trial, "condition": trial_row(trial)}
    notes.append(("frames", about | frames))
    came = {} if received is None else {"received": received.isoformat(timespec="milliseconds")}
    session.record(trial, answer, notes=notes, attempt=given.attempt, **came)
    return frames


def read_practice(
    session: Session, pictures: StimulusSet | None, given: Sequence[messages.Again]
) -> list[tuple[Trial, Read]]:
    """Parse responses to practice trials, as `read_answer`; `InputError` also for a trial that does not exist."""
    known = {trial.trial: trial for trial in session.trials if trial.phase == "practice"}
    if missing := [one.trial for one in given if one.trial not in known]:
        raise InputError(f"there is no practice trial {missing[0]}: send the number of a practice trial.")
    return [(known[one.trial], read_answer(session, pictures, known[one.trial], one.answer)) for one in given]


def round_notes(
    number: int, result: Mapping[str, Any], again: Sequence[tuple[Trial, Read]], elapsed_s: float | None
) -> list[tuple[str, dict[str, Any]]]:
    """Return the notes of a round of practice: its responses, unless they are the first to their trials; its result."""
    notes: list[tuple[str, dict[str, Any]]] = []
    for trial, repeated in again:
        check_possible(repeated.seconds, elapsed_s)
        content = {"round": number, "trial": asdict(trial), "answer": answer_event(repeated.answer)}
        notes.append(("practice again", content))
    return [*notes, ("practice", {"round": number, **{name: result[name] for name in ("right", "of", "passed")}})]


def expose(session: Session, given: Exposure) -> None:
    """Record an exposure that the page reports, once, before the response to its trial.

    Raises
    ------
    InputError
        If there is no such trial, or it is not yet its turn.
    """
    turn = (given.phase, given.trial)
    known = {(trial.phase, trial.trial): trial for trial in session.trials[: len(session.recorded) + 1]}
    if turn not in known:
        raise InputError(f"trial {given.trial} ({given.phase}) is not the next trial: report exposures in their order.")
    session.expose(known[turn], given.round, exposure=given.exposure)


def first_problem(error: ValidationError) -> str:
    """Summarise the first fault of a message without quoting the message itself."""
    one = error.errors(include_url=False, include_context=False, include_input=False)[0]
    return f"{'.'.join(map(str, one['loc']))}: {one['msg']}"[:200]
