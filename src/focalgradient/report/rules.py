"""Settings file of preregistered rules: exclusions of trials and subjects, equivalence bound."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from focalgradient.errors import InputError, is_number, located
from focalgradient.files import printable, read_bytes, read_toml
from focalgradient.statistics import Rules
from focalgradient.statistics.criteria import WORDING
from focalgradient.statistics.hypotheses import check_bound

__all__ = ["Stated", "as_toml", "load_rules"]

OPTIONAL = {field.name for field in dataclasses.fields(Rules) if str(field.type).endswith("None")}
"""Rules that can be switched off."""


@dataclass(frozen=True, slots=True)
class Stated:
    """Rules stated in advance.

    Parameters
    ----------
    rules
        Exclusion rules.
    bound
        Equivalence bound; None if the file does not state it.
    file, sha256
        Name of the file and SHA-256 of its content; None for the default rules.
    """

    rules: Rules
    bound: float | None = None
    file: str | None = None
    sha256: str | None = None


def load_rules(path: Path) -> Stated:
    r"""Read rules from a TOML file: keys are the fields of `Rules`, and `bound`; `false` switches a rule off.

    Raises
    ------
    InputError
        If the file cannot be read, or a key is unknown or out of range; the message names it.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     _ = Path(folder, "rules.toml").write_text("bound = 1.2\n")
    ...     stated = load_rules(Path(folder, "rules.toml"))
    >>> stated.bound
    1.2
    """
    found = read_toml(path, "a file of rules")
    digest = hashlib.sha256(read_bytes(path, "a file of rules")).hexdigest()
    fields = {field.name for field in dataclasses.fields(Rules)}
    values: dict[str, Any] = {}
    bound: float | None = None
    for key, value in found.items():
        if key == "bound":
            check_bound(f"{printable(path)}: bound", value)
            bound = float(value)
        elif key not in fields:
            raise InputError(f"{printable(path)}: {key} is not a known rule: use {', '.join([*WORDING, 'bound'])}.")
        else:
            values[key] = _value(key, value)
    with located(printable(path)):
        rules = Rules(**values)
    return Stated(rules, bound, path.name, digest)


def _value(key: str, value: Any) -> Any:
    """Return the value of a rule; `Rules` checks it."""
    if value is False and key in OPTIONAL:
        return None
    return tuple(float(end) if is_number(end) else end for end in value) if isinstance(value, list) else value


def as_toml(rules: Rules, bound: float | None, names: Collection[str] = tuple(WORDING)) -> str:
    """Format the named rules, and the bound if given, as a file for `load_rules`.

    Examples
    --------
    >>> as_toml(Rules(), 1.2).splitlines()[-1]
    'bound = 1.2'
    """
    lines = ["# Rules of exclusion, stated in advance: focalgradient report DATASET --rules rules.toml"]
    for key, rule in WORDING.items():
        if key in names:
            lines += ["", f"# {rule.meaning}", f"{key} = {_as_text(getattr(rules, key))}"]
    if bound is not None:
        lines += [
            "",
            "# smallest depth effect at the largest aperture that would matter, as a ratio",
            f"bound = {bound:g}",
        ]
    return "\n".join(lines) + "\n"


def _as_text(value: Any) -> str:
    if value is None:
        return "false"
    return str(list(value)) if isinstance(value, tuple) else f"{value:g}"
