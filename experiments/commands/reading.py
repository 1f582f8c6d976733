"""``dem-warp reading``: what was read on the bench to a parameter with its standard error."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.commands.console import clear_errors, plain
from experiments.commands.options import AsJson

if TYPE_CHECKING:
    from experiments.io.units import Quantity

READING_EXAMPLE = 'Example: [bold]dem-warp reading rebound fall="300 mm" height=58 61 66[/]'


def reading(
    method: Annotated[str, typer.Argument(help="Method, as listed above.")],
    quantities: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="QUANTITY=VALUE...",
            help="What was read; further values of a quantity follow it. One value holds for all readings.",
        ),
    ] = None,
    file: Annotated[
        Path | None, typer.Option(metavar="CSV", help="Table with a column for each quantity instead.")
    ] = None,
    sd: Annotated[
        list[str] | None,
        typer.Option(
            metavar="QUANTITY=VALUE", help="Standard deviation of one reading; the values are then means."
        ),
    ] = None,
    n: Annotated[
        int | None, typer.Option("-n", "--n", min=1, help="Number of readings behind the means.")
    ] = None,
    parameter: Annotated[
        str, typer.Option(metavar="NAME", help="Factor of the study that was measured.")
    ] = "NAME",
    as_json: AsJson = False,
) -> None:
    """Turn readings of single grains into a parameter, its standard error, and a study's lines.

    - incline: angle at which a grain slides; sledge: three or four glued grains; rolling-start: it rolls

    - rolling-run: slope, distance rolled down it, run on the flat behind it

    - rebound: fall and height, or first and second time between bounces

    - rebound-45: fall onto a plate at 45 degrees; height_1, distance_1, height_2, distance_2 of the flight

    - pendulum: angles release, striker and struck of two grains on threads

    - value: the parameter itself

    A number without a unit is in degrees, millimetres or seconds. Without --sd the readings' own scatter
    gives the standard error, with it the delta method.
    """
    with clear_errors():
        from experiments.grains.bench_readings import METHODS, formula_of, read_columns
        from experiments.io.errors import InputError
        from experiments.io.texts import nearest_name
        from experiments.io.toml_files import toml_text

        if method not in METHODS:
            raise InputError("METHOD", f"must be a method, {nearest_name(method, list(METHODS))}", method)
        if (file is None) == (not quantities) or (sd is None) != (n is None) or (file and sd):
            raise InputError("reading", "needs values or --file; with values --sd and -n, or neither")
        given = _columns(quantities or [], "QUANTITY=VALUE")
        columns: dict[str, Any] = given if file is None else read_columns(file, method)
        spread = _columns(sd or [], "--sd")
        try:
            formula = formula_of(method, columns)
            found = formula.of_means(columns, spread, n or 0) if sd else formula.of_readings(columns)
        except ValueError as error:
            raise InputError(str(file or method), str(error)) from None
        if as_json:
            facts = {"method": method, "value": found.mean, "se": found.se, "sd": found.sd, "n": found.n}
            typer.echo(json.dumps(facts))
            return
        section: dict[str, Any] = {"parameter": parameter, "by": method}
        if file is not None:
            section["file"] = str(file)
        elif sd:
            section |= {"mean": _written(given), "sd": _written(spread), "n": n}
        else:
            section["readings"] = _written(given)
        what = formula.parameter.replace("_", " ") or "value"
        scatter = f"sd {found.sd:.2g}, n = {found.n}"
        typer.echo(f"{what} {found.mean:.4g}, standard error {found.se:.2g} ({scatter})")
        typer.echo(plain("\n" + toml_text({"direct": [section]})), nl=False)


def _columns(words: Sequence[str], place: str) -> dict[str, list[Quantity]]:
    """Read ``name=value value ...``; values before a name are of the quantity without one."""
    from experiments.io.errors import InputError
    from experiments.io.units import Quantity

    columns: dict[str, list[Quantity]] = {}
    name = ""
    for word in words:
        before, sign, after = word.partition("=")
        name, text = (before.strip(), after) if sign else (name, word)
        try:
            columns.setdefault(name, []).append(Quantity.parse(text))
        except ValueError as error:
            raise InputError(f"{place}: {name}" if name else place, str(error), text) from None
    return columns


def _written(columns: dict[str, list[Quantity]]) -> Any:
    """Return quantities as a study file has them."""
    lists = {name: [one.written for one in column] for name, column in columns.items()}
    short = {name: column[0] if len(column) == 1 else column for name, column in lists.items()}
    return short.get("", short)
