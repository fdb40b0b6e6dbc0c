"""What every command says of itself, and what it prints for programs."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator

import click
import pytest
from command_line import run

from focalgradient.cli import main


def commands(group: click.Group = main, words: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    for name, command in group.commands.items():
        if isinstance(command, click.Group):
            yield from commands(command, (*words, name))
        else:
            yield (*words, name), command


ALL = dict(commands())
each = pytest.mark.parametrize("words", ALL, ids=" ".join)


@each
def test_every_option_has_a_help_text_and_stands_once(words):
    options = [one for one in ALL[words].params if isinstance(one, click.Option)]
    assert [one.opts[0] for one in options if not one.help or not one.help.strip("* ")] == []
    opts = [opt for one in options for opt in one.opts]
    assert len(opts) == len(set(opts))


@each
def test_help_has_an_example_that_the_command_understands(words):
    said = run(*words, "--help").stdout
    examples = re.findall(r"^ +(focalgradient (?:[^\\\n]|\\\n)*)", said.partition("Example")[2], re.MULTILINE)
    assert examples
    for example in examples:
        given = shlex.split(example.replace("\\\n", " "))[1:]
        command, context = main, None
        while given and isinstance(command, click.Group) and given[0] in command.commands:
            command = command.commands[given.pop(0)]
        if command is not ALL[("run",)]:
            context = command.make_context("it", given, resilient_parsing=True)
            known = {option for parameter in command.params for option in parameter.opts}
            assert {word for word in given if word.startswith("--")} <= known
            assert context is not None


def test_the_package_runs_as_a_module() -> None:
    words = [sys.executable, "-m", "focalgradient", "--version"]
    found = subprocess.run(words, capture_output=True, text=True, check=False)
    assert (found.returncode, found.stderr) == (0, "")
    assert found.stdout.startswith("focalgradient ")
