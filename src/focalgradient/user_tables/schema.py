"""Schemas of tables of answers: the columns by which each kind is recognised and read."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import pandas as pd

from focalgradient.errors import InputError, nearest
from focalgradient.files.cells import name_and_unit
from focalgradient.user_tables.names import clean, few, heading, stem_of

__all__ = [
    "CUBE",
    "DETECTION",
    "GIVEN_AS",
    "LENGTHS",
    "LOGARITHMS",
    "RATINGS",
    "THRESHOLDS",
    "TIMES",
    "UNITS",
    "Column",
    "Schema",
    "found_columns",
]

LENGTHS = {"mm": 1, "cm": 10, "m": 1000, "um": 0.001, "µm": 0.001}
"""Factor to millimetres of each unit of length."""

TIMES = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1.0),
    **dict.fromkeys(("ms", "msec", "msecs", "millis", "millisecond", "milliseconds"), 0.001),
    **dict.fromkeys(("us", "µs"), 1e-6),
    "min": 60,
}
"""Factor to seconds of each unit of time."""

RATIOS = {"": 1, "%": 0.01, "percent": 0.01, "ratio": 1, "x": 1}
"""Factor to a ratio of each unit of ratings."""

UNITS = frozenset({*LENGTHS, *TIMES, *RATIOS})
"""Units of all columns."""

ABSENT = frozenset({"", "na", "n/a", "nan", "null", "none", ".", "-", "#n/a", "<na>"})
"""Cells that count as empty."""

NO = MappingProxyType(dict.fromkeys(ABSENT, False))
"""Empty cells of optional columns that mark rows: no."""


YES_OR_NO = '1 or 0 (yes or no): give the words\' meaning with conditions={"NAME": "1"}'


class Column(NamedTuple):
    """Definition of the column of one role.

    Parameters
    ----------
    names
        Recognised names besides the role's own, in lower case.
    stems
        Names that are recognised without a unit or logarithm in the heading, if no column has another recognised name.
    units
        Units that the heading of a number may state, each with its factor to the package's unit.
    number
        True for numbers, whose decimal mark is decided together.
    shown
        True if the column states a condition: rows without any such cell are not trials.
    compared
        True if its levels may be groups of people.
    answer
        Noun for the missing value of rows that are left out; "" if cells may be empty.
    codes
        Codes of missing values: "unsigned" if negative numbers are among them, "signed" if not, "" for none.
    absent
        Cells that count as empty.
    words
        Recognised words and their meanings, in lower case.
    expected
        What cells must be, for messages.
    """

    names: tuple[str, ...] = ()
    stems: tuple[str, ...] = ()
    units: Mapping[str, float] = MappingProxyType({})
    number: bool = False
    shown: bool = False
    compared: bool = False
    answer: str = ""
    codes: str = ""
    absent: frozenset[str] = ABSENT
    words: Mapping[str, object] = MappingProxyType({})
    expected: str = YES_OR_NO


class Schema(NamedTuple):
    """Definition of one kind of table.

    Parameters
    ----------
    columns
        Columns by role.
    signs
        Sets of roles, of which a table of this kind has one.
    others
        Roles and names of columns by which tables of other kinds are recognised.
    required
        Roles of the columns that must be there.
    instead
        Roles that together may stand in the place of a required one, with the remedy that says so; "{}" stands for
        how to name those that are missing.
    """

    columns: Mapping[str, Column]
    signs: Sequence[frozenset[str]] = ()
    others: frozenset[str] = frozenset()
    required: Sequence[str] = ()
    instead: Mapping[str, tuple[frozenset[str], str]] = MappingProxyType({})


PARTICIPANT = Column(
    (
        *("participant", "subject", "subj", "sub", "id", "observer", "subject_id", "subj_id", "sub_id", "sid", "pp"),
        *("participant_private_id", "participant_public_id", "prolific_pid", "worker_id", "workerid", "run_id"),
        *("responseid", "response_id", "result", "participant_code", "participant_number", "subject_number", "ppt"),
        *("subject_nr", "participant_nr", "subject_no", "participant_no", "vp_nr", "vp_code"),
        *("subj_no", "observer_id", "user", "user_id", "person", "pid", "ppid", "anon_id", "prolific_id"),
        *("versuchsperson", "vp", "vpn", "proband", "proband_nr", "teilnehmer", "sujet", "participante", "soggetto"),
    )
)
TRIAL = Column(("trial_number", "trial_index", "trial_nr", "trial_no", "trial_num", "trialnum", "trials.thisn"))
PLAIN, CATCH, FRAMES = Column(), Column(words=NO), Column(number=True)
KIND = Column(("simulated",))
GROUP = Column(("group", "cond"), compared=True)

RATINGS = Schema(
    {
        "participant_id": PARTICIPANT,
        "aperture": Column(("f_number", "fnumber", "f_no", "fnum", "fstop", "f_stop", "blende"), shown=True),
        "aperture_mm": Column(
            ("aperture (mm)", "aperture [mm]", "diameter", "diameter_mm", "diameter (mm)", "pupil_mm"),
            units=LENGTHS,
            number=True,
            shown=True,
        ),
        "fixation": Column(("focus", "fixated", "focus_object", "focal_object", "fixated_object", "fokus"), shown=True),
        "rating": Column(
            (
                *("answer", "response", "resp", "choice", "chosen", "chosen_interval", "slider", "slider_value"),
                *("rating_response", "likert", "vas", "antwort"),
                *("depth_rating", "rating_depth", "rated_depth", "perceived_depth"),
                *("depth_judgment", "depth_judgement", "judgment", "judgement", "bewertung", "urteil"),
            ),
            units=RATIOS,
            number=True,
            answer="rating",
            codes="unsigned",
        ),
        "interval": Column(("picture_interval", "target_interval", "picture_side", "target_side", "test_side")),
        "scene": Column(("picture", "image", "item", "stimulus"), shown=True),
        "trial": TRIAL,
        "session": PLAIN,
        "catch": CATCH,
        "response_time": Column(("rt", "reaction_time", "latency"), units=TIMES, number=True, codes="unsigned"),
        "repetition": Column(("rep", "repeat", "replicate", "replication", "repetition_number", "wiederholung")),
        "slider_start": FRAMES,
        "dropped_frames": FRAMES,
        "kind": KIND,
    },
    required=("participant_id", "aperture", "fixation", "rating"),
    instead={"aperture": (frozenset({"aperture_mm"}), "")},
)

DETECTION_WORDS = {
    **dict.fromkeys(("present", "signal", "old", "seen"), True),
    **dict.fromkeys(("absent", "noise", "new", "unseen"), False),
}

DETECTION = Schema(
    {
        "participant_id": PARTICIPANT,
        "signal": Column(
            (
                *("signal_present", "target_present", "stimulus_present", "present"),
                *("is_signal", "is_target", "signal_shown"),
            ),
            shown=True,
            words=DETECTION_WORDS,
        ),
        "response": Column(
            ("answer", "resp", "said", "judgment", "judgement"),
            answer="answer",
            words=DETECTION_WORDS,
        ),
        "confidence": Column(
            ("conf", "certainty", "confidence_rating"), number=True, answer="confidence", codes="unsigned"
        ),
        "rating": Column(number=True, answer="rating", codes="unsigned"),
        "condition": GROUP,
        "session": PLAIN,
        "catch": CATCH,
        "trial": TRIAL,
        "kind": KIND,
    },
    signs=[frozenset(("signal", "response")), frozenset(("signal", "rating"))],
    others=frozenset(("percept", "aperture", "aperture_mm", "fixation", "level", "correct", "interval")),
    required=("participant_id", "signal", "response"),
    instead={"response": (frozenset({"rating"}), ", or a rating from the surest no to the surest yes ({})")},
)

LEVELS = (
    *("intensity", "stimulus_level", "stimulus_intensity", "stim_level", "stim_levels", "blur_level"),
    *("defocus", "defocus_d", "contrast", "delta", "increment", "blur_increment"),
    *("blur_difference", "delta_blur", "stim_intensity", "dioptres", "diopters"),
)

THRESHOLDS = Schema(
    {
        "participant_id": PARTICIPANT,
        "level": Column(
            LEVELS,
            stems=("level", *LEVELS, "blur"),
            number=True,
            shown=True,
            answer="level",
            codes="signed",
        ),
        "correct": Column(
            (
                *("right", "hit", "hits", "accuracy", "acc", "corr", "is_correct", "iscorrect"),
                *("response_correct", "resp_correct", "richtig"),
                *("n_correct", "ncorrect", "num_correct", "num_pos"),
            ),
            number=True,
            answer="answer",
            words={
                **dict.fromkeys(("correct", "right", "hit", "richtig", "juste"), True),
                **dict.fromkeys(("incorrect", "wrong", "error", "miss"), False),
            },
            expected='1 for a right and 0 for a wrong answer: give the words\' meaning with conditions={"NAME": "1"} '
            "(NA: a missing answer), or the counts of trials in a column of its own (trials)",
        ),
        "interval": Column(
            (
                *("target_interval", "signal_interval", "test_interval", "target", "target_side", "test_side"),
                *("correct_interval", "correct_answer", "correct_response"),
            )
        ),
        "response": Column(
            ("answer", "chosen", "choice", "resp", "chosen_interval", "response_interval"), answer="answer"
        ),
        "trials": Column(
            ("n", "n_trials", "ntrials", "num_trials", "shown", "total", "n_total", "out_of_num"), number=True
        ),
        "alternatives": Column(("intervals", "n_alternatives", "n_intervals", "nafc", "mafc", "n_afc"), number=True),
        "condition": GROUP,
        "session": PLAIN,
        "catch": CATCH,
        "trial": TRIAL,
        "kind": KIND,
    },
    signs=[frozenset(("level", "correct")), frozenset(("level", "interval", "response"))],
    others=frozenset(("rating", "percept")),
    required=("participant_id", "level", "correct"),
    instead={
        "correct": (
            frozenset(("interval", "response")),
            ", or the right one of two intervals and the one chosen ({})",
        ),
    },
)

STAIRCASE = {"level": "intensity", "correct": "response", "condition": "label"}
"""Names of PsychoPy's columns of a staircase, after that of its loop."""

GRADIENTS = ("none", "rigid", "nonrigid")
"""Reading of the cube that the focal gradient favours."""

PERCEPTS = ("rigid", "nonrigid", "none", "both")
"""Percepts reported of the cube: "none" if no key is held, "both" if both are."""

NONRIGID = {"non-rigid": "nonrigid", "non rigid": "nonrigid", "non_rigid": "nonrigid"}
NONE = {"no": "none", "sharp": "none", "0": "none"}
TIME = Column(units=TIMES, number=True)

CUBE = Schema(
    {
        "participant_id": PARTICIPANT,
        "percept": Column(
            ("reading", "report", "reported", "seen", "state", "perception"),
            shown=True,
            answer="report",
            absent=ABSENT - {"none"},
            words={name: name for name in PERCEPTS} | NONRIGID | NONE,
        ),
        "gradient": Column(
            ("condition", "blur", "blur_condition", "focal_gradient"),
            shown=True,
            words={name: name for name in GRADIENTS} | NONRIGID | NONE,
        ),
        "strength": Column(("strength_mm", "aperture_mm"), units=LENGTHS, number=True),
        "onset": TIME._replace(names=("onset_s", "start", "onset_ms")),
        "duration": TIME._replace(
            names=("duration_s", "lasted", "dur", "duration_ms", "dur_ms", "dominance_duration", "dauer")
        ),
        "end": TIME._replace(names=("offset", "end_ms", "offset_ms")),
        "trial": TRIAL,
        "session": PLAIN,
        "trial_duration": TIME._replace(
            names=("trial_duration_s", "trial_s", "trial_duration_ms", "trial_ms", "trial_length"),
        ),
        "censored": CATCH._replace(names=("cut_off",)),
        "catch": CATCH,
        "kind": KIND,
        "dropped_frames": FRAMES,
    },
    signs=[frozenset(("percept", "gradient", "duration")), frozenset(("percept", "gradient", "onset", "end"))],
    others=frozenset(("rating", "response", "aperture", "fixation", "level", "correct", "signal")),
    required=("participant_id", "percept", "gradient", "trial", "duration"),
    instead={
        "trial": (frozenset({"onset"}), ", or give the onset of each report within its trial"),
        "duration": (frozenset({"onset", "end"}), ", or give onset and end"),
    },
)


LOGARITHMS = {"log10": 10.0, "ln": math.e}
"""Bases of logarithms that levels may be given as, or their heading may state."""

GIVEN_AS = {"participant": "participant_id"} | {f"{base}_level": "level" for base in LOGARITHMS}
"""Roles by names under which columns are given besides."""


MECHANICAL_TURK = ("Input.", "Answer.")
"""Beginnings of the names of columns that are of a trial."""

DERIVED = frozenset(
    ("log", "log10", "ln", "z", "mean", "median", "sd", "se", "n", "min", "max", "prev", "previous", "last")
)
"""First parts of the names of columns that are computed of others, as log.rt."""


def _parts(header: Sequence[str]) -> dict[str, str]:
    """Return the columns that programs name WHOLE.PART, by PART where it is of one column, by WHOLE where it is Q0.

    >>> _parts(["Stim.ACC", "key.rt", "mouse.rt", "log.keys", "response.Q0"])
    {'acc': 'Stim.ACC', 'response': 'response.Q0'}
    """
    named = [(column, *column.rpartition(".")[::2]) for column in header]
    words = [heading(whole if part == "Q0" else part) for _, whole, part in named]
    counts = Counter(words)
    return {
        word: column
        for word, (column, whole, _) in zip(words, named, strict=True)
        if whole and whole.casefold() not in DERIVED and counts[word] == 1
    }


def found_columns(name: str, table: pd.DataFrame, schema: Schema, columns: Mapping[str, str]) -> dict[str, str]:
    """Return the file's column for each role: the one given in `columns`, else one with a recognised name."""
    header = [str(column) for column in table.columns]
    by_name = {clean(column).casefold(): column for column in reversed(header)} | {column: column for column in header}
    found: dict[str, str] = {}
    wrong = []
    for given, column in columns.items():
        role = GIVEN_AS.get(given, given)
        theirs = by_name.get(column, by_name.get(clean(column).casefold()))
        if role not in schema.columns:
            open_roles = [role for role in schema.columns if role not in columns]
            known = {word: role for role in open_roles for word in (role, *schema.columns[role].names)}
            word = nearest(given, known)
            likely = known[word] if word else ", ".join(["participant", *list(schema.columns)[1:]])
            wrong.append(f"{given} is not known: use {likely} = the file's name")
        elif theirs is None:
            wrong.append(f"{name} has no column {column} for {given}: it has {few(header)}")
        elif theirs in found.values():
            wrong.append(f"{column} is given for {given}, but for another column, too: give each a column of its own")
        else:
            found[role] = theirs
    if wrong:
        raise InputError(f"columns: {'; '.join(wrong)}.")
    free = [column for column in reversed(header) if column not in found.values()]
    lower = {heading(name_and_unit(clean(column))[0]): column for column in free}
    lower |= {heading(column): column for column in free} | {clean(column).casefold(): column for column in free}
    loop = next((column.removesuffix(".intensity") for column in free if column.endswith(".intensity")), "")
    parts = _parts(free)
    lower = {part: column for part, column in parts.items() if column.startswith(MECHANICAL_TURK)} | lower
    if "level" in schema.columns:
        of_loop = {role: f"{loop}.{part}" for role, part in STAIRCASE.items() if f"{loop}.{part}" in free}
        lower = of_loop | lower
    for role, definition in schema.columns.items():
        if role not in found:
            words = [spelt for word in (role, *definition.names) for spelt in (word, heading(word))]
            near = next((lower[word] for word in words if word in lower), None)
            if near is None and (definition.answer or role == "response_time"):
                near = next((parts[word] for word in words if word in parts), None)
            if near is not None and near not in found.values():
                found[role] = near
    stems = parts | {heading(stem_of(column)): column for column in header if column not in found.values()}
    for role, definition in schema.columns.items():
        near = next((stems[stem] for stem in definition.stems if stem in stems), None)
        if role not in found and near is not None and near not in found.values():
            found[role] = near
    for column in found.values():
        again = [other for other in header if re.fullmatch(re.escape(column) + r" \(column \d+\)", other)]
        if column not in columns.values():
            again += [
                other for other in header if other != column and clean(other).casefold() == clean(column).casefold()
            ]
        if any((table[other] != table[column]).any() for other in again):
            raise InputError(f"{name} has the column {column} twice, with different cells: remove or rename one.")
    return found
