"""The command, run within a test, and the sentence with which it refuses."""

from click.testing import CliRunner, Result

from focalgradient.cli import main


def run(*args: object) -> Result:
    return CliRunner().invoke(main, [str(arg) for arg in args])


def succeed(*args: object) -> Result:
    """Run a command that must end with exit code 0."""
    result = run(*args)
    assert result.exit_code == 0, result.output
    return result


def sentence(result: Result) -> str:
    """The one sentence with which a run was refused."""
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert result.stderr.startswith("Error: ")
    assert result.stderr.count("\n") == 1
    assert "Traceback" not in result.stderr
    return result.stderr
