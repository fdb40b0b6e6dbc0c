"""Messages in terms of the command line: options instead of parameters, one clause on wrong usage."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress

import click

from focalgradient.errors import InputError, entries_as_options, nearest, one_line
from focalgradient.files import printable
from focalgradient.files.cells import as_number

__all__ = ["clause_of", "options_named", "sentences", "usage", "with_options", "wrong_call"]

OPTIONS = {
    "set largest_error": "set --error",
    "(align=True)": "(--align)",
    "(calibration)": "(--calibration)",
    "(crop=True)": "(--align)",
    "(encoding": "(--encoding",
    "(field)": "(--field)",
    "(f_number, focus_distance)": "(--f-number, --focus-distance)",
    "(focus_distance)": "(--focus-distance)",
    "(f_number)": "(--f-number)",
    "(near, far)": "(--near, --far)",
    "telecentric (true)": "whether the lens is telecentric (--telecentric)",
    "(calibrate_camera, method='edges')": "(focalgradient calibrate --method edges)",
    "(give focus_distances_m once": "(give --focus-distance once",
    ", and focal_length_mm": ", and --focal-length",
    ", and f_numbers": ", and --f-number",
    ", and pixel_pitch_um": ", and --pixel-pitch",
    "(vergence of the screen)": "(--screen-at)",
}
"""Parameters in the library's messages, and the corresponding options."""

ALIKE = (
    ("--out", "--output", "-o", "--data", "--folder"),
    ("--observers", "--subjects", "--participants", "-n"),
    ("--participant", "--subject", "--id"),
    ("--f-number", "--fnumber", "--fstop", "--aperture", "--apertures", "-f"),
)
"""Options of like meaning, of which a command has one."""

NUMBERS = {"integer": "a whole number", "float": "a number"}
"""Types of numbers in click's messages, and the words for them here."""


@contextmanager
def options_named(names: Mapping[str, str]) -> Iterator[None]:
    """Replace the library's parameters in `InputError` messages by the options in `names`.

    Entries of mappings and lists become options: see `entries_as_options`.
    """
    try:
        yield
    except InputError as error:
        words = entries_as_options(str(error))
        if names:
            words = re.sub(r"\b(" + "|".join(names) + r")\b", lambda match: names[match.group()], words)
        raise InputError(words) from error


def sentences(options: Mapping[str, str]) -> dict[str, str]:
    """Return words for `options_named`: a one-word parameter stands for its option only where a sentence begins."""
    words = {name: option for name, option in options.items() if "_" in name}
    verbs = ("is", "has", "cannot", "does not apply")
    return words | {f"{name} {verb}": f"{option} {verb}" for name, option in options.items() for verb in verbs}


def with_options(sentence: str) -> str:
    """Return a message of the library on one line, with options instead of parameters."""
    words = one_line(sentence)
    for parameter, option in OPTIONS.items():
        words = words.replace(parameter, option)
    words = re.sub(r"\bpsf='(\w+)', k=([\d.]*\d)", r"--psf \1 --k \2", words)
    return re.sub(r"\b(psf|method)='(\w+)'", r"--\1 \2", words)


def usage(message: str) -> str:
    """Return click's message on wrong usage as one clause.

    >>> usage("No such command 'dpeth'. Did you mean 'depth'?")
    "No such command 'dpeth' (did you mean 'depth'?)"
    >>> usage("Invalid value for '--size': '33x32' is not a valid integer range.")
    "Invalid value for '--size': '33x32' is not a whole number"
    >>> usage("Invalid value for '--f-number': 'f/5.6' is not a valid float.")
    "Invalid value for '--f-number': 'f/5.6' is not a number (write 5.6)"
    >>> usage("Invalid value for '--near': '1,05' is not a valid float.")
    "Invalid value for '--near': '1,05' is not a number (a decimal takes a point; a further value, its option again)"
    >>> usage("Invalid value for '--method': 'edge' is not one of 'equalise', 'edges'.")
    "Invalid value for '--method': 'edge' is not one of 'equalise', 'edges' (did you mean edges?)"
    """
    clause = re.sub(r"\. \(?Did you mean (.*?\?)\)?$", r" (did you mean \1)", message.rstrip("."))
    clause = clause.replace("did you mean one of: ", "did you mean one of ")
    clause = re.sub(r"not a valid (integer|float)( range)?$", lambda match: f"not {NUMBERS[match[1]]}", clause)
    clause = re.sub(r"not in the range ([0-9.]+)<=x<=([0-9.]+)$", r"not between \1 and \2", clause)
    clause = re.sub(r"not in the range x>=([0-9.]+)$", r"not \1 or more", clause)
    if match := re.search(r"'([^']*)' is not one of ('.*')$", clause):
        like = nearest(match[1], match[2].strip("'").split("', '"))
        return clause if like is None else f"{clause} (did you mean {like}?)"
    if match := re.search(r"'(f/)?([0-9]+\.?[0-9]*) ?([a-zA-Z]*)' is not a number$", clause):
        return f"{clause} (write {match[2]})" if match[1] else f"{clause} (write it without its unit)"
    if re.search(r"'[0-9.]+[,;][0-9.,; ]+' is not a number$", clause):
        return f"{clause} (a decimal takes a point; a further value, its option again)"
    return clause


def _alike(error: click.NoSuchOption) -> str | None:
    """Return the option that is like an unknown one in meaning or in name; None for one named as an argument."""
    parameters = [] if error.ctx is None else error.ctx.command.params
    given = error.option_name.lstrip("-")
    if given in {one.name for one in parameters if isinstance(one, click.Argument)}:
        return None
    known = {name.lstrip("-"): name for one in parameters if isinstance(one, click.Option) for name in one.opts}
    meant = (name for group in ALIKE if error.option_name in group for name in group if name in known.values())
    return next(meant, known.get(nearest(given, known) or ""))


def clause_of(error: click.UsageError) -> str:
    """Return click's message on wrong usage as one clause, with an option that is alike for an unknown one."""
    if not isinstance(error, click.NoSuchOption):
        return usage(error.format_message())
    alike = _alike(error)
    return usage(error.message) + (f" (did you mean {alike!r}?)" if alike else "")


def wrong_call(error: click.UsageError) -> str:
    """Return the message on a wrong call, with a given file that does not exist or an example of the help."""
    clause = clause_of(error)
    parameter = error.param if isinstance(error, click.MissingParameter) else None
    is_unknown = isinstance(error, click.NoSuchOption) and _alike(error) is None
    if error.ctx is None or error.ctx.parent is None or (parameter is None and not is_unknown):
        return clause
    for argument in error.ctx.command.params if parameter else ():
        if isinstance(argument, click.Argument) and isinstance(argument.type, click.Path):
            given = error.ctx.params.get(str(argument.name)) or ()
            for path in given if isinstance(given, tuple) else (given,):
                with suppress(OSError, ValueError):  # reported when it is opened
                    if not os.path.lexists(path) and as_number(str(path)) is None:
                        return f"{printable(path)} does not exist ({clause[0].lower()}{clause[1:]})"
    lines = re.sub(r"\\\n\s*", "", error.ctx.command.help or "").splitlines()
    wanted = f" {parameter.opts[0]} " if isinstance(parameter, click.Option) else ""
    calls = [line.strip() for line in lines if line.strip().startswith(f"{error.ctx.command_path} ")]
    given = {value for value in error.ctx.params.values() if isinstance(value, str)}
    example = min(
        (call for call in calls if wanted in call),
        key=lambda call: (given.isdisjoint(call.split()), len(call)),
        default=None,
    )
    if example is None:
        return clause
    return f"{clause} (a right call: '{example}')" if is_unknown else f"{clause}, as in '{example}'"
