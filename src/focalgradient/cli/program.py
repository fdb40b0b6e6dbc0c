"""What the commands share: one sentence for whatever is wrong, progress, and results written together or not at all."""

from __future__ import annotations

import math
import os
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import click
import numpy as np

from focalgradient.errors import FocalGradientWarning, InputError

__all__ = ["Program", "fail", "progress", "resumable", "strict", "warnings_told", "writable", "write"]


class Program(click.Group):
    """A group of commands that says what went wrong in one sentence."""

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run, and leave with exit code 2 after one sentence where the input is wrong."""
        try:
            code = super().main(*args, **{**kwargs, "standalone_mode": False})
        except click.UsageError as error:
            program = error.ctx.command_path if error.ctx else "focalgradient"
            fail(f"{error.format_message().rstrip('.')}: see '{program} --help'.")
        except click.ClickException as error:
            fail(error.format_message())
        except InputError as error:
            fail(str(error))
        except OSError as error:
            fail(f"{error.filename or 'a file'} could not be read or written ({error.strerror or error}).")
        sys.exit(code if isinstance(code, int) else 0)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; Ctrl-C leaves with exit code 130."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            click.echo("Interrupted: nothing was written.", err=True)
            ctx.exit(130)


def fail(sentence: str) -> NoReturn:
    """Say what is wrong and leave with exit code 2."""
    click.echo(f"Error: {' '.join(sentence.split())}", err=True)
    sys.exit(2)


@contextmanager
def warnings_told() -> Iterator[list[str]]:
    """Print focalgradient's warnings above the bar, a line each, and collect them; others go their way."""
    from tqdm import tqdm

    told: list[str] = []

    def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
        if not issubclass(category, FocalGradientWarning):
            otherwise(message, category, *place, **more)
        else:
            told.append(str(message))
            tqdm.write(f"Warning: {' '.join(str(message).split())}", file=sys.stderr)

    with warnings.catch_warnings():
        warnings.simplefilter("always", FocalGradientWarning)
        otherwise, warnings.showwarning = warnings.showwarning, show
        yield told


@contextmanager
def progress(stages: int) -> Iterator[Callable[[str], None]]:
    """Show a bar over the `stages` of the work, on standard error where that is a terminal."""
    from tqdm import tqdm

    layout = "{desc:<24}|{bar:30}| {elapsed}"
    with tqdm(total=stages, bar_format=layout, leave=False, disable=not sys.stderr.isatty()) as bar:

        def say(stage: str) -> None:
            bar.set_description_str(stage, refresh=False)
            bar.update()
            bar.refresh()

        yield say


@contextmanager
def resumable(left: str) -> Iterator[Callable[[float, str], object]]:
    """Show a bar of the share done with the time left; Ctrl-C says what is `left`, and leaves with exit code 130."""
    from tqdm import tqdm

    layout = "{desc:<26}|{bar:30}| {percentage:3.0f}% {elapsed}, {remaining} left"
    try:
        with tqdm(total=1.0, bar_format=layout, leave=False, disable=not sys.stderr.isatty()) as bar:

            def say(share: float, what: str) -> None:
                bar.set_description_str(what, refresh=False)
                bar.update(share - bar.n)

            yield say
    except KeyboardInterrupt:
        click.echo(f"Interrupted: {left}", err=True)
        click.get_current_context().exit(130)


def strict(value: Any) -> Any:
    """`value` as strict JSON knows it: NaN becomes null, infinities the texts "inf" and "-inf"."""
    if isinstance(value, Mapping):
        return {str(key): strict(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [strict(item) for item in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return strict(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value


def writable(out: Path, names: Sequence[str]) -> Path:
    """Give the folder at or above `out` that exists; refuse what cannot be written before the long work, not after."""
    base = next(folder for folder in (out.absolute(), *out.absolute().parents) if os.path.lexists(folder))
    try:
        with tempfile.TemporaryFile(dir=base):
            pass
    except OSError as error:
        raise InputError(
            f"--out {out} cannot be written ({error.strerror}): give a folder that you may write in."
        ) from error
    for name in names:
        if (out / name).is_dir():
            raise InputError(
                f"{out / name} is a folder, where a file is to be written: move it or choose another --out."
            )
    return base


def write(out: Path, base: Path, writers: Mapping[str, Callable[[Path], object]]) -> None:
    """Write all files out of sight in `base`, on the same disk; then move all into `out`."""
    with tempfile.TemporaryDirectory(prefix=".focalgradient-", dir=base) as staging:
        for name, make in writers.items():
            make(Path(staging, name))
        out.mkdir(parents=True, exist_ok=True)
        for name in writers:
            Path(staging, name).replace(out / name)
