"""Depth of many frames, each a set of views with its own results, in one or several processes."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import click

from focalgradient.cli.program import nothing_valid, resumable, show, warnings_given, write_set
from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.files import plain_name, printable
from focalgradient.parallel import completed
from focalgradient.progress import Progress, silent

__all__ = ["NAMES", "Frame", "Recovered", "by_worker", "folders", "recover_frames"]

NAMES = ("depth.npz", "depth.png", "summary.json")

LEFT = "folders that have a summary.json are complete; the same command makes all of them again."


@dataclass(frozen=True, slots=True)
class Frame:
    """Inputs of one depth map, the keyword arguments of `depth_from_photographs`, and the output folder."""

    inputs: tuple[Path, ...]
    call: Mapping[str, Any]
    out: Path

    def absolute(self) -> Frame:
        """Return the frame with absolute paths, for a process with another working folder."""
        call = {name: value.absolute() if isinstance(value, Path) else value for name, value in self.call.items()}
        return Frame(tuple(path.absolute() for path in self.inputs), call, self.out.absolute())


@dataclass(frozen=True, slots=True)
class Recovered:
    """Result of one frame: files (or functions that write them), summary, median depth as text, and warnings.

    A failed frame has only its warnings and its error message.
    """

    files: Mapping[str, bytes | Callable[[Path], object]]
    summary: Mapping[str, Any]
    middle: str = ""
    warnings: Sequence[str] = ()
    wrong: str | None = None

    @property
    def valid(self) -> float:
        """Proportion of valid pixels."""
        return float(self.summary["share_valid"])

    @property
    def rejected(self) -> str | None:
        """Most likely cause, if no pixel is valid."""
        cause = self.summary["details"].get("rejected")
        return None if cause is None else str(cause)

    def give_warnings(self, name: str = "") -> None:
        """Reissue the warnings of another process; raise `InputError` if the frame failed."""
        for given in self.warnings:
            warnings.warn(FocalGradientWarning(f"{name}{given}"), stacklevel=2)
        if self.wrong is not None:
            raise InputError(self.wrong)

    def write(self, out: Path) -> None:
        """Write the files to a folder, all or none."""
        write_set(out, self.files, "summary.json")


Recover = Callable[[Frame, list[str], Progress], Recovered]
"""Function that recovers one frame, given a list for warnings and a progress callback."""


def folders(inputs: Sequence[Path]) -> list[str]:
    """Return a folder name for each settings file: that of the file, or of its folder if file names are not unique.

    >>> folders([Path("a/views.toml"), Path("b/views.toml")])
    ['a', 'b']
    """
    for names in ([path.stem for path in inputs], [path.absolute().parent.name for path in inputs]):
        if len({name.casefold() for name in names}) == len(names):
            return [plain_name(name, "the name of a settings file or its folder") for name in names]
    raise InputError(
        "several settings files have the same name, in folders of the same name: rename them, so that each gets a "
        "separate folder."
    )


def by_worker(recover: Recover, frame: Frame) -> Recovered:
    """Recover a frame in any process; return all that another process needs."""
    with warnings_given(printed=False) as given, tempfile.TemporaryDirectory() as folder:
        try:
            found = recover(frame, given, silent)
        except InputError as error:
            return Recovered({}, {}, warnings=given, wrong=str(error))
        files: dict[str, bytes] = {}
        for name, content in found.files.items():
            if not isinstance(content, bytes):
                content(place := Path(folder, name))
                content = place.read_bytes()
            files[name] = content
    return replace(found, files=files, warnings=given)


def recover_frames(
    recover: Recover, frames: Mapping[str, Frame], out: Path, work: AbstractContextManager[Executor | None]
) -> None:
    """Recover every frame, writing each as soon as it is complete; failed frames are named at the end.

    Raises
    ------
    InputError
        If a frame failed, after all others were processed.
    """
    names, wrong, summaries, empty = list(frames), [], {}, {}
    with warnings_given(), resumable(LEFT) as say, work as executor:
        made = completed(executor, partial(by_worker, recover), list(frames.values()))
        for done, (number, found) in enumerate(made, start=1):
            name = names[number]
            try:
                found.give_warnings(f"{name}: ")
            except InputError as error:
                wrong.append(name)
                click.echo(f"{name}: {' '.join(str(error).split())}", err=True)
            else:
                found.write(out / name)
                summaries[name] = found.summary
                if found.rejected is not None:
                    empty[name] = found.rejected
                show(None, f"{name}: {found.middle}; valid pixels {found.valid:.1%}")
            say(done / len(names), f"{done} of {len(names)} frames")
    if wrong:
        raise InputError(
            f"{len(wrong)} of {len(names)} frames failed, first {wrong[0]}: correct the errors listed above."
        )
    ordered = {name: summaries[name] for name in names}
    show(
        {"frames": ordered, "written": [printable(out / name) for name in names]},
        f"Written: {len(names)} folders in {out}",
    )
    if empty:
        first = next(name for name in names if name in empty)
        nothing_valid(empty[first], f"No depth in {len(empty)} of {len(names)} frames, first {first}")
