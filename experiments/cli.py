"""The command line ``dem-warp``: each command checks its input, calls public functions and shows the result.

Imports of the simulator, the statistics and the pictures are inside the commands: ``--help`` needs none.
"""

from __future__ import annotations

from typing import Annotated

import typer

from experiments.commands.angle import ANGLE_EXAMPLE, angle
from experiments.commands.bridge import BRIDGE_EXAMPLE, bridge
from experiments.commands.calibrate import CALIBRATE_EXAMPLE, calibrate
from experiments.commands.clump import CLUMP_EXAMPLE, clump
from experiments.commands.console import BAD_INPUT, messages
from experiments.commands.discover import DISCOVER_EXAMPLE, discover
from experiments.commands.doctor import DOCTOR_EXAMPLE, doctor
from experiments.commands.doe import doe
from experiments.commands.export import EXPORT_EXAMPLE, export
from experiments.commands.heap import HEAP_EXAMPLE, heap
from experiments.commands.new import NEW_EXAMPLE, new
from experiments.commands.options import show_version
from experiments.commands.plan import PLAN_EXAMPLE, plan
from experiments.commands.reading import READING_EXAMPLE, reading
from experiments.commands.streams import lasting_streams
from experiments.commands.ui import UI_EXAMPLE, ui
from experiments.commands.watch import WATCH_EXAMPLE, watch
from experiments.io.errors import InputError
from experiments.io.own_packages import require_own_packages

app = typer.Typer(
    name="dem-warp",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=show_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Calibrate discrete element models of grain: simulated heaps, designed experiments, repose angles."""


app.command(epilog=CALIBRATE_EXAMPLE)(calibrate)
app.command(epilog=PLAN_EXAMPLE)(plan)
app.command(epilog=DISCOVER_EXAMPLE)(discover)
app.command(epilog=HEAP_EXAMPLE)(heap)
app.command(epilog=ANGLE_EXAMPLE)(angle)
app.command(epilog=READING_EXAMPLE)(reading)
app.command(epilog=CLUMP_EXAMPLE)(clump)
app.command(epilog=NEW_EXAMPLE)(new)
app.command(epilog=EXPORT_EXAMPLE)(export)
app.command(epilog=BRIDGE_EXAMPLE)(bridge)
app.add_typer(doe, name="doe")
app.command(epilog=DOCTOR_EXAMPLE)(doctor)
app.command(epilog=WATCH_EXAMPLE)(watch)
app.command(epilog=UI_EXAMPLE)(ui)


def main() -> None:
    """Run the command line."""
    with lasting_streams():
        try:
            require_own_packages()
        except InputError as error:
            messages.print(f"Error: {error}")
            raise SystemExit(BAD_INPUT) from None
        app()
