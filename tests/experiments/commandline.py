"""The command line in process, and programs that stand in for others."""

from pathlib import Path

from click.testing import CliRunner
from typer.main import get_command

from experiments.cli import app

COMMAND = get_command(app)
"""The command line; typer would build it anew for each call."""


def dem_warp(*arguments: object) -> tuple[int, str, str]:
    """Run a command; return its exit code, what it says on standard output, and on standard error."""
    result = CliRunner().invoke(COMMAND, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr


def refused(*arguments: object) -> str:
    """Run a command that ends with 2 and prints no result; return its message on one line."""
    code, out, err = dem_warp(*arguments)
    assert (code, out) == (2, "")
    return " ".join(err.split())


def install(program: Path, text: str) -> Path:
    """Write a program that stands in for another; return its folder."""
    program.parent.mkdir(exist_ok=True)
    program.write_text(text, encoding="utf-8")
    program.chmod(0o755)
    return program.parent
