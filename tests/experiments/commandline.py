"""The command line in process, as the tests run it."""

from __future__ import annotations

from typer.testing import CliRunner

from experiments.cli import app


def dem_warp(*arguments: object) -> tuple[int, str, str]:
    """Run a command; return its exit code, what it says on standard output, and on standard error."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.stdout, result.stderr
