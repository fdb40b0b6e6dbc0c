"""Infrastructure of the commands: one-sentence errors, progress bars, and results written together or not at all."""

from __future__ import annotations

import json
import math
import os
import platform
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any, NoReturn

import click
import numpy as np
from click.core import ParameterSource

from focalgradient.errors import FocalGradientWarning, InputError
from focalgradient.files import (
    earlier_files,
    existing,
    printable,
    refuse_foreign,
    refuse_overwriting,
    refuse_special,
    replace_set,
    replacing,
)
from focalgradient.options.messages import with_options, wrong_call
from focalgradient.progress import Progress
from focalgradient.termination import exit_code, terminable

__all__ = [
    "FORCE_OPTION",
    "JSON_OPTION",
    "KEPT",
    "Program",
    "announce",
    "fail",
    "given_option",
    "nothing_valid",
    "placing",
    "resumable",
    "show",
    "software_versions",
    "strict",
    "summary_json",
    "warnings_given",
    "with_options",
    "writable",
    "write_set",
]

NOTHING_VALID = 1
"""Exit code if results were written but no depth is valid."""

KEPT = "finished files are valid, and the same command continues from them."
"""Message after Ctrl-C."""

MEMORY = "there is too little memory for this: give smaller images or fewer of them, or close other programs."
ANNOUNCED_S = 10.0
"""Time in s above which a command announces its duration before it starts."""

LINE_S = 30.0
"""Time in s between two lines of progress if standard error is not a terminal."""

NAMED = 3
"""Maximum number of files of an earlier run that are named."""

JSON = "focalgradient.json"
"""Key in a command's context: whether to print the result as JSON."""

FORCE, WRITTEN = "focalgradient.force", "focalgradient.written"
"""Keys in a command's context: whether foreign files may be replaced, and which outputs have been written."""

NESTED = "something in the input is nested too deeply to be read: give a simpler file."


class Program(click.Group):
    """Command group that reports errors in one sentence."""

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run a command; exit with code 2 and one sentence if the input is invalid."""
        _open_standard_streams()
        with suppress(AttributeError, ValueError):  # a name that the terminal cannot show must not cause a failure
            sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
        try:
            with terminable():
                code = super().main(*args, **{**kwargs, "standalone_mode": False})
        except click.exceptions.NoArgsIsHelpError as error:
            click.echo(error.format_message(), err=True)
            sys.exit(2)
        except click.UsageError as error:
            program = error.ctx.command_path if error.ctx else "focalgradient"
            fail(f"{wrong_call(error)}: see '{program} --help'.")
        except click.ClickException as error:
            fail(error.format_message())
        except InputError as error:
            fail(str(error))
        except OSError as error:
            fail(f"{printable(error.filename or 'a file')} could not be read or written ({error.strerror or error}).")
        except MemoryError:
            fail(MEMORY)
        except RecursionError:
            fail(NESTED)
        except (KeyboardInterrupt, click.Abort) as stop:  # before or after the command
            click.echo("Interrupted.", err=True)
            sys.exit(exit_code(stop.__cause__ or stop))
        except Exception as error:
            if not _of_compiled_code(error):
                raise
            removed = _forget_compiled_code()
            fail(f"the cache of compiled code was damaged and its {removed} files were removed: run this again.")
        sys.exit(code if isinstance(code, int) else 0)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; exit with 130 on Ctrl-C and 143 on SIGTERM, stating which results exist."""
        try:
            os.getcwd()
        except OSError:
            fail("the working folder no longer exists: change to another, and run this again.")
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as stop:
            written = ", ".join(ctx.meta.get(WRITTEN, ()))
            before = f"{written} was written before that." if written else "nothing was written."
            click.echo(f"Interrupted: {str(stop) or before}", err=True)
            ctx.exit(exit_code(stop))


def _open_standard_streams() -> None:
    """Redirect closed standard streams to null, because the next file opened would receive the libraries' output."""
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        try:
            os.fstat(number)
        except OSError:
            nowhere = os.open(os.devnull, os.O_RDWR)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115  until the process ends


def _of_compiled_code(error: BaseException) -> bool:
    """Return whether an error arose while numba read its cache of compiled code."""
    frames = traceback.extract_tb(error.__traceback__)
    return any(Path(frame.filename).parts[-3:] == ("numba", "core", "caching.py") for frame in frames)


def _forget_compiled_code() -> int:
    """Remove numba's cache of this package, so that it is compiled again; return the number of files."""
    folders = [Path(__file__).parents[1]]
    if elsewhere := os.environ.get("NUMBA_CACHE_DIR"):
        folders.append(Path(elsewhere))
    kept = [path for folder in folders for path in folder.rglob("*.nb[ic]")]
    for path in kept:
        with suppress(OSError):
            path.unlink()
    return len(kept)


def fail(sentence: str) -> NoReturn:
    """Print an error message and exit with code 2."""
    click.echo(f"Error: {with_options(sentence)}", err=True)
    sys.exit(2)


def _remember(key: str) -> Callable[[click.Context, click.Parameter, bool], None]:
    """Return an option's callback that stores whether it is given."""

    def remember(context: click.Context, _: click.Parameter, given: bool) -> None:
        if given:
            context.meta[key] = True

    return remember


JSON_OPTION = click.Option(
    ["--json"],
    is_flag=True,
    expose_value=False,
    callback=_remember(JSON),
    help="Print the result as one JSON object, for programs.",
)
"""Option with which `show` prints the result as one JSON object."""

FORCE_OPTION = click.Option(
    ["--force"],
    is_flag=True,
    expose_value=False,
    callback=_remember(FORCE),
    help="Also replace files that this command did not write, but never its inputs.",
)
"""Option with which `writable` allows foreign files to be replaced."""


def given_option(*names: str) -> str | None:
    """Return the first of these options that is given on the command line, as written there."""
    context = click.get_current_context()
    for name in names:
        if context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            return f"--{name.replace('_', '-')}"
    return None


def show(result: Mapping[str, Any] | None, *lines: str) -> None:
    """Print the result of a command as `lines`, or with ``--json`` as `result` only (None: nothing)."""
    if not click.get_current_context().meta.get(JSON):
        for line in lines:
            click.echo(line)
    elif result is not None:
        click.echo(summary_json(result), nl=False)


def nothing_valid(cause: str | None, where: str = "No depth") -> None:
    """Print the most likely `cause` and exit with code 1, if it is given; files have been written by then."""
    if cause is not None:
        show(None, f"{where}: most likely because {with_options(cause)}.")
        click.get_current_context().exit(NOTHING_VALID)


def announce(seconds: float, work: str) -> None:
    """Announce the approximate duration of long work on standard error; short work is not announced.

    Parameters
    ----------
    seconds
        Estimated duration on two cores, from measured rates.
    work
        Description of the work, with which the sentence begins.
    """
    if seconds < ANNOUNCED_S:
        return
    if seconds < 90:
        time = f"{10 * round(seconds / 10)} s"
    elif seconds < 5400:
        time = f"{round(seconds / 60)} min"
    else:
        time = f"{seconds / 3600:.2g} h"
    click.echo(f"{work}: about {time} on two cores.", err=True)


@contextmanager
def warnings_given(printed: bool = True) -> Iterator[list[str]]:
    """Collect each different focalgradient warning once, and print it above the progress bar; pass on all others."""
    from tqdm import tqdm

    given: list[str] = []

    def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
        if not issubclass(category, FocalGradientWarning):
            otherwise(message, category, *place, **more)
        elif str(message) not in given:
            given.append(str(message))
            if printed:
                tqdm.write(f"Warning: {with_options(str(message))}", file=sys.stderr)

    with warnings.catch_warnings():
        warnings.simplefilter("always", FocalGradientWarning)
        otherwise, warnings.showwarning = warnings.showwarning, show
        yield given


@contextmanager
def resumable(left: str, begun: Callable[[], object] = lambda: None) -> Iterator[Progress]:
    """Show a progress bar with the remaining time, or off a terminal a line every 30 s; Ctrl-C prints `left`.

    `begun` is called once, when the input has been checked and the work begins.
    """
    from tqdm import tqdm

    layout = "{desc:<26}|{bar:30}| {percentage:3.0f}% {elapsed}, {remaining} left"
    try:
        with tqdm(total=1.0, bar_format=layout, leave=False, disable=not sys.stderr.isatty()) as bar:
            started, printed = False, time.monotonic()

            def say(share: float, what: str) -> None:
                nonlocal started, printed
                if not started:
                    begun()
                    started = True
                bar.set_description_str(what, refresh=False)
                bar.update(share - bar.n)
                if bar.disable and time.monotonic() - printed >= LINE_S:
                    printed = time.monotonic()
                    click.echo(f"{what}: {share:.0%}", err=True)

            yield say
    except KeyboardInterrupt as stop:
        raise type(stop)(left or str(stop)) from None


def strict(value: Any) -> Any:
    """Convert a value to strict JSON: NaN becomes null, infinities the texts "inf" and "-inf"."""
    if isinstance(value, Mapping):
        return {str(key): strict(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [strict(item) for item in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return strict(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value


def summary_json(content: Mapping[str, Any]) -> bytes:
    """Return a summary as strict JSON in UTF-8, whatever file names it contains."""
    text = json.dumps(strict(content), indent=2, allow_nan=False, ensure_ascii=False)
    return (text + "\n").encode("utf-8", "backslashreplace")


def software_versions(*packages: str) -> dict[str, str]:
    """Return the versions of this package, of other `packages` and of Python, for a summary."""
    return {name: version(name) for name in ("focalgradient", *packages)} | {"python": platform.python_version()}


def _refuse_data_set(out: Path) -> None:
    """Raise `InputError` for an output folder in a data set of human answers, which is kept as recorded."""
    try:
        place = out.resolve()
    except (OSError, ValueError, RuntimeError):
        return  # reported when it is opened
    for folder in (place, *place.parents):
        if os.path.lexists(folder / "dataset_description.json"):
            raise InputError(
                f"--out {printable(out)} is in the data set {printable(folder)}, which is kept as recorded: "
                "give a folder outside it."
            )


def writable(out: Path, names: Sequence[str], inputs: Iterable[Path] = ()) -> None:
    """Raise `InputError` before long work if results cannot be written.

    This includes data sets, files that are also `inputs`, and, without ``--force``, files that the command did not
    write.
    """
    _refuse_data_set(out)
    try:
        with tempfile.TemporaryFile(dir=existing(out)):
            pass
    except ValueError as error:
        raise InputError(f"--out is {printable(out)!r}, which is not a valid folder name: give another.") from error
    except OSError as error:
        raise InputError(
            f"--out {printable(out)} cannot be written ({error.strerror}): give a folder that you may write in."
        ) from error
    refuse_special(out / name for name in names)
    refuse_overwriting(inputs, [out / name for name in names])
    if not click.get_current_context().meta.get(FORCE):
        remedy = "move it, choose another place to write to, or replace it with --force"
        refuse_foreign([out / name for name in names], _written_by(), remedy)


def write_set(
    out: Path, files: Mapping[str, bytes | Callable[[Path], object]], summary: str, others: Iterable[str] | None = ()
) -> None:
    """Write the results of the running command with its mark, as `focalgradient.files.replace_set` does.

    Results of an earlier run that remain in the folder are named on standard error; `others` are further files of this
    run there, None if more follow.
    """
    replace_set(out, files, summary, _written_by())
    _note_output(out)
    if others is not None and (left := earlier_files(out, [*files, *others], _written_by())):
        names = ", ".join(printable(path.name) for path in left[:NAMED]) + (" and others" if len(left) > NAMED else "")
        click.echo(f"Note: {printable(out)} also contains results of an earlier run: {names}.", err=True)


@contextmanager
def placing(places: Sequence[Path], summary: Path) -> Iterator[dict[Path, Path]]:
    """Write the results of the running command with its mark, as `focalgradient.files.replacing` does."""
    with replacing(places, summary, _written_by()) as hidden:
        yield hidden
    _note_output(places[0])


def _note_output(place: Path) -> None:
    """Record an output, for the message if the command is interrupted."""
    click.get_current_context().meta.setdefault(WRITTEN, []).append(printable(place))


def _written_by() -> str:
    """Return the name of the running command, as in the marks of its files."""
    return f"focalgradient {click.get_current_context().command.name}"
