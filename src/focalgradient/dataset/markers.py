"""Markers: code, meaning and HED tags of each event, and custom codes of a laboratory.

Codes fit in one byte, as required by parallel ports and trigger boxes. HED tags follow schema 8.3.0.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import BeforeValidator, ConfigDict, Field

from focalgradient.errors import InputError, described
from focalgradient.files import printable, read_toml
from focalgradient.tables import Table, check_table

__all__ = ["HED_VERSION", "MARKERS", "Codes", "Marker", "read_codes"]

HED_VERSION = "8.3.0"
"""Version of the HED schema of the tags."""

LARGEST = 255
"""Largest code: one byte."""

CODE = "whole number from 1 to 255"


class Marker(NamedTuple):
    """Code, meaning and HED tags of an event."""

    code: int
    about: str
    hed: str


MARKERS: Mapping[str, Marker] = {
    name: Marker(**marker)
    for name, marker in tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))["codes"].items()
}
"""Markers that focalgradient sends, by event."""


@dataclass(frozen=True, slots=True)
class Codes:
    """Codes sent for events, by event name and by the condition of the trial.

    Parameters
    ----------
    markers
        Markers by name, including custom ones.
    conditions
        Event name, code, and the levels of the trial to which the code applies; the first match is sent.
    pulse_ms
        Pulse duration after which a port returns to 0, in ms; 0: never. None: 5 ms on a parallel port, never on others.

    Examples
    --------
    >>> codes = Codes(conditions=(("picture", 111, {"aperture": "pinhole"}),))
    >>> codes.of("picture", {"aperture": "pinhole"}), codes.of("picture", {"aperture": "f/22"}), codes.of("picture")
    (111, 11, 11)
    """

    markers: Mapping[str, Marker] = field(default_factory=lambda: dict(MARKERS))
    conditions: Sequence[tuple[str, int, Mapping[str, Any]]] = ()
    pulse_ms: float | None = None

    def of(self, name: str, trial: Mapping[str, Any] | None = None) -> int:
        """Return the code of an event.

        Parameters
        ----------
        name
            Name of the event.
        trial
            Condition of its trial, by name; None between trials.

        Raises
        ------
        InputError
            If the event has no code.
        """
        for event, code, levels in self.conditions:
            if event == name and trial is not None and all(trial.get(key) == level for key, level in levels.items()):
                return code
        if name not in self.markers:
            raise InputError(f"the event {name!r} has no code: add it to the file of codes.")
        return self.markers[name].code

    def entry(self) -> dict[str, Any]:
        """Return the codes as a journal entry."""
        markers = {name: list(marker) for name, marker in self.markers.items()}
        return {
            "markers": markers,
            "conditions": [[name, code, dict(levels)] for name, code, levels in self.conditions],
        }

    @classmethod
    def recorded(cls, entry: Mapping[str, Any]) -> Codes:
        """Return the codes stored in a journal entry."""
        markers = {name: Marker(*marker) for name, marker in entry["markers"].items()}
        return cls(markers, tuple((name, code, levels) for name, code, levels in entry["conditions"]))


class _OwnMarker(Table):
    """Code of an event, with its meaning and HED tags; those left out are the known ones."""

    code: int = Field(0, ge=1, le=LARGEST, description=f"a {CODE}")
    about: str = Field("", min_length=1, description="a text")
    hed: str = Field("", min_length=1, description="a text")


def _with_code(given: Any) -> Any:
    return given if isinstance(given, dict) else {"code": given}


class _Condition(Table):
    """Code of an event in a trial with the levels of further keys."""

    model_config = ConfigDict(extra="allow")

    event: str = Field("picture", description="the name of an event")
    code: int = Field(ge=1, le=LARGEST, description=f"a {CODE}")

    @property
    def levels(self) -> Mapping[str, Any]:
        """Levels of the trial to which the code applies."""
        return self.model_extra or {}


class _CodesFile(Table):
    """File of codes."""

    codes: dict[str, Annotated[_OwnMarker, BeforeValidator(_with_code)]] = Field(
        {}, description="a table of names with their codes, such as picture = 11"
    )
    condition: list[_Condition] = Field([], description="a list of tables, each begun by [[condition]]")
    pulse_ms: float | None = Field(None, ge=0, le=1000, description="from 0 to 1000 ms")


def read_codes(path: Path | None) -> Codes:
    """Read custom codes (TOML); without a file, return focalgradient's codes.

    ``[codes]`` has a code for each name, or a table with ``code``, ``about`` and ``hed``; each ``[[condition]]`` has an
    ``event``, a ``code`` and the levels of the trial to which it applies; ``pulse_ms`` is the pulse duration.

    Raises
    ------
    InputError
        If the file cannot be read, a code is not a whole number from 1 to 255, or two events share a code.
    """
    if path is None:
        return Codes()
    file = printable(path)
    table = check_table(file, read_toml(path, "the codes of markers"), _CodesFile)
    new = Marker(0, "An event of the laboratory's own.", "Experiment-control")
    markers = dict(MARKERS)
    for name, given in table.codes.items():
        markers[name] = MARKERS.get(name, new)._replace(**given.model_dump(exclude_unset=True))
        if not markers[name].code:
            raise InputError(f"{file}: the code of {name} is missing: give a {CODE}.")
    conditions = tuple((one.event, one.code, one.levels) for one in table.condition)
    for event, _, levels in conditions:
        if event not in markers:
            raise InputError(f"{file}: a condition names the event {described(event)}, which has no code: add it.")
        if not levels:
            raise InputError(f'{file}: a condition of {event!r} names no level: add one, such as aperture = "pinhole".')
    _refuse_shared(file, markers, conditions)
    return Codes(markers, conditions, table.pulse_ms)


def _refuse_shared(
    file: str, markers: Mapping[str, Marker], conditions: Sequence[tuple[str, int, Mapping[str, Any]]]
) -> None:
    taken: dict[int, str] = {}
    named = [(name, marker.code) for name, marker in markers.items()]
    for name, code in [*named, *((event, code) for event, code, _ in conditions)]:
        if taken.setdefault(code, name) != name:
            raise InputError(f"{file}: {taken[code]} and {name} share the code {code}: give each its own.")
