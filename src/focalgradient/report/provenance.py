"""Provenance of a report: software versions, settings of the data set, and hashes of its files."""

from __future__ import annotations

import hashlib
import platform
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol

from focalgradient.dataset import DataSet, Files
from focalgradient.dataset.bids import read_description
from focalgradient.files import read_bytes
from focalgradient.report.rules import Stated
from focalgradient.report.tables import Sheet, listed

__all__ = ["provenance"]

PACKAGES = ("focalgradient", "numpy", "scipy", "pandas", "matplotlib")
"""Packages that every report imports, whose versions are listed."""

SOME_PACKAGES = ("statsmodels", "psignifit", "pymc")
"""Packages that some analyses import, whose versions are listed if they were imported."""


class Analysed(Protocol):
    """Experiment of a data set or table."""

    @property
    def data(self) -> DataSet | None:
        """The data set; None for the user's own table."""
        ...


def provenance(
    paths: Sequence[Path], parts: Sequence[Analysed], applied: Collection[str], bound: float, stated: Stated
) -> Iterator[Sheet]:
    """Yield tables of the software, of the data set with the rules `applied` to it, and of its files with hashes."""
    root = paths[0]
    used = [*PACKAGES, *(name for name in SOME_PACKAGES if name in sys.modules)]
    made = [[name, version(name)] for name in used] + [["Python", platform.python_version()]]
    yield listed("versions.csv", "Analysed with", ["what", "version"], made, folded=True)
    sidecars: dict[Files, Mapping[str, Any]] = {}
    for part in parts:
        sidecars |= {} if part.data is None else part.data.sidecars
    facts: dict[str, dict[str, None]] = {}
    if sidecars:
        facts["BIDS version"] = {str(read_description(root).get("BIDSVersion", "not stated")): None}
    for sidecar in sidecars.values():
        facts.setdefault(f"seed of {sidecar['TaskName']}", {})[str(sidecar.get("Seed"))] = None
        facts.setdefault("stimuli (SHA-256 of the manifest)", {})[str(sidecar.get("StimuliSHA256") or "none")] = None
        for sitting in sidecar.get("Sittings", ()):
            for name, value in sitting.get("Versions", {}).items():
                facts.setdefault(f"recorded with {name}", {})[str(value)] = None
    for name, value in asdict(stated.rules).items():
        if name in applied:
            facts[f"rule {name}"] = {"none" if value is None else str(value): None}
    if applied:
        facts["file of rules (SHA-256)"] = {stated.sha256 or "none: the default rules": None}
    if "bound" in applied:
        facts["bound of equivalence"] = {f"{bound:g}": None}
    rows = [[name, ", ".join(values)] for name, values in facts.items()]
    if rows:
        yield listed("data_set.csv", "Data set", ["what", "value"], rows, folded=True)
    read = [(path.relative_to(root).as_posix(), path) for files in sidecars for path in (files.table, files.sidecar)]
    named = read or [(path.name, path) for path in paths]
    hashes = [[name, hashlib.sha256(read_bytes(path)).hexdigest()] for name, path in named]
    whole = hashlib.sha256("".join(f"{sha}  {name}\n" for name, sha in sorted(hashes)).encode()).hexdigest()
    hashes.append(["all of them together", whole])
    yield listed("files.csv", "Files analysed", ["file", "SHA-256"], hashes, folded=True)
