"""``dem-warp doe``: designs, and the analysis of a table of runs from anywhere."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from experiments.commands.console import clear_errors, messages, plain
from experiments.commands.options import AsJson, assignments
from experiments.io.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

    from doe import Wish
    from experiments.commands.tables.answers import Answer
    from experiments.commands.tables.sheet import Sheet

doe = typer.Typer(no_args_is_help=True, help="Design experiments, and analyse a table of runs from anywhere.")

DESIGN_EXAMPLE = (
    'Example: [bold]dem-warp doe design box-behnken --factor "E=0.1..0.9" --factor "F=0.1..0.5" ...[/]'
)
SCREEN_EXAMPLE = "Example: [bold]dem-warp doe screen runs.csv --response angle --out screening[/]"
FIT_EXAMPLE = "Example: [bold]dem-warp doe fit runs.csv --response angle --model quadratic --out fit[/]"
OPTIMUM_EXAMPLE = "Example: [bold]dem-warp doe optimum runs.csv --wish angle=28.6 --wish time=min[/]"

CLIMB_EXAMPLE = "Example: [bold]dem-warp doe climb climb.csv --target 28.6[/]"
COMPARE_EXAMPLE = "Example: [bold]dem-warp doe compare runs.csv --value simulated --reference measured[/]"

CURVE_EXAMPLE = "Example: [bold]dem-warp doe curve runs.csv --measured edge.csv --reading 0.1[/]"

Table = Annotated[Path, typer.Argument(metavar="TABLE.csv", help="Runs: factors, and at least one response.")]
Factors = Annotated[
    list[str] | None,
    typer.Option(
        "--factor",
        metavar="NAME=LOW..HIGH",
        help="A factor with its levels -1 and +1, and a unit if it has one; NAME=one,two for a category. For "
        "a table the name is enough. Default: the columns before the response.",
    ),
]
Response = Annotated[
    str | None, typer.Option(help="Column of the response. Default: the last one.", metavar="NAME")
]
Dummies = Annotated[
    list[str] | None,
    typer.Option("--dummy", metavar="NAME", help="A column without factor. Default: dummy 1, ..."),
]
Block = Annotated[str | None, typer.Option(help="Column of the blocks. Default: block.", metavar="NAME")]
Alpha = Annotated[float, typer.Option(help="Level of the tests and intervals.", min=1e-9, max=0.999)]
Model = Annotated[
    str,
    typer.Option(
        help="first-order, interaction, quadratic or three-factor; or its terms, e.g. A,B,A:B,A^2.",
    ),
]
Reduce = Annotated[bool, typer.Option("--reduce", help="Leave out terms that are not significant.")]
OutFolder = Annotated[
    Path | None, typer.Option(metavar="FOLDER", help="New folder for the tables, the plots and one page.")
]


@doe.command(epilog=DESIGN_EXAMPLE)
def design(
    kind: Annotated[
        str,
        typer.Argument(
            help="plackett-burman, definitive-screening, full-factorial, fractional-factorial, "
            "central-composite, box-behnken, optimal, latin-hypercube, sobol; simplex-lattice, "
            "simplex-centroid of components; foldover, axial, center, which add runs to a --table."
        ),
    ],
    factor: Factors = None,
    component: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="A component of a mixture.")
    ] = None,
    table: Annotated[Path | None, typer.Option(metavar="TABLE.csv", help="Runs to add others to.")] = None,
    runs: Annotated[int | None, typer.Option(help="Number of runs.", min=1)] = None,
    center: Annotated[int | None, typer.Option(help="Runs at the center.", min=0)] = None,
    alpha: Annotated[str | None, typer.Option(help="Axial distance, or rotatable, face, orthogonal.")] = None,
    resolution: Annotated[int | None, typer.Option(help="Least resolution of a fraction.", min=3)] = None,
    levels: Annotated[int | None, typer.Option(help="Levels of each factor.", min=2)] = None,
    blocks: Annotated[int | None, typer.Option(help="Blocks of runs.", min=1)] = None,
    degree: Annotated[int | None, typer.Option(help="Degree of a lattice.", min=1)] = None,
    model: Model = "first-order",
    seed: Annotated[int | None, typer.Option(help="Seed of the order of the runs.", min=0)] = None,
    sd: Annotated[
        float | None, typer.Option(help="Standard deviation of the response, for the power.")
    ] = None,
    effect: Annotated[float | None, typer.Option(help="Effect that matters, for the power.")] = None,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Make the runs of a design, and say what they can tell apart."""
    with clear_errors():
        from experiments.commands.tables.answers import describe_design
        from experiments.commands.tables.design_kinds import make_design
        from experiments.commands.tables.sheet import read_factor

        given = {
            "runs": runs, "center": center, "alpha": _number_or_word(alpha), "resolution": resolution,
            "levels": levels, "blocks": blocks, "degree": degree, "seed": seed,
            "model": model if kind == "optimal" else None,
        }  # fmt: skip
        before = _sheet(table, None, []).design if table else None
        factors = [] if before else [read_factor(text) for text in factor or []]
        made = make_design(kind, factors, component or [], before, given)
        answer = describe_design(made, model, sd, effect)
        if out is None:
            answer.texts.append(answer.tables["runs"][1].to_csv().rstrip())
    _show(answer, out, as_json, f"a {kind} design")


@doe.command(epilog=SCREEN_EXAMPLE)
def screen(
    table: Table,
    response: Response = None,
    factor: Factors = None,
    dummy: Dummies = None,
    block: Block = None,
    error: Annotated[
        str | None,
        typer.Option(
            help="Error of the tests: dummies, lenth, pooled or pure. Default: dummies, or what the factors "
            "leave; lenth where they leave nothing."
        ),
    ] = None,
    alpha: Alpha = 0.05,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Screen the factors of two-level runs: effects, tests, aliases, the way of the steepest climb."""
    with clear_errors():
        from experiments.commands.tables.answers import screen_table

        sheet = _sheet(table, factor, [response] if response else [], block, dummy)
        answer = screen_table(sheet, sheet.responses.columns[0], error, alpha)
    _show(answer, out, as_json, str(table))


@doe.command(epilog=FIT_EXAMPLE)
def fit(
    table: Table,
    response: Response = None,
    factor: Factors = None,
    block: Block = None,
    model: Model = "quadratic",
    formula: Annotated[
        str | None, typer.Option(help='Terms in the syntax of R instead, e.g. "A * variety + I(A**2)".')
    ] = None,
    mixture: Annotated[
        bool, typer.Option("--mixture", help="The columns are shares of a mixture: Scheffe's polynomial.")
    ] = False,
    reduce: Reduce = False,
    at: Annotated[
        list[str] | None, typer.Option(metavar="A=1,B=2", help="A setting to predict, in natural units.")
    ] = None,
    alpha: Alpha = 0.05,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Fit a response surface: analysis of variance, lack of fit, predicted R2, canonical analysis."""
    with clear_errors():
        from experiments.commands.tables import answers

        asked = [response] if response else []
        if (formula or mixture) and (at or reduce):
            option = "--at" if at else "--reduce"
            raise InputError(option, "needs a polynomial of factors, not --formula or --mixture")
        if mixture:
            answer = answers.fit_mixture_table(table, asked, model)
        else:
            sheet = _sheet(table, factor, asked, block)
            name = sheet.responses.columns[0]
            if formula:
                answer = answers.fit_formula_table(sheet, name, formula)
            else:
                surface = answers.fitted(sheet, name, _terms(model), alpha, reduce)
                answer = answers.describe_fit(surface, name, alpha)
                _predict(answer, surface, at or [], alpha)
    _show(answer, out, as_json, str(table))


@doe.command(epilog=OPTIMUM_EXAMPLE)
def optimum(
    table: Table,
    wish: Annotated[
        list[str],
        typer.Option(
            metavar="NAME=AIM",
            help="Aim of a response: max, min or a target; with ends of its scale, e.g. angle=28.6:25..32."
            " Default: those of the runs.",
        ),
    ],
    factor: Factors = None,
    block: Block = None,
    model: Model = "quadratic",
    reduce: Reduce = False,
    extent: Annotated[float, typer.Option(help="Coded half width of the box that is searched.")] = 1.0,
    constraint: Annotated[
        list[str] | None, typer.Option(metavar='"A + B <= 3"', help="Limit of natural settings.")
    ] = None,
    alpha: Alpha = 0.05,
    seed: Annotated[int, typer.Option(help="Seed of the search.", min=0)] = 0,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Find the setting that comes nearest to the aims of one response or several."""
    with clear_errors():
        from experiments.commands.tables.answers import best_setting, fitted

        aims = assignments(wish, "--wish", "angle=28.6")
        sheet = _sheet(table, factor, list(aims), block)
        names = list(sheet.responses.columns)
        wishes = {
            name: _wish(aim, sheet.responses[name], alone=len(aims) == 1)
            for name, aim in zip(names, aims.values(), strict=True)
        }
        surfaces = {name: fitted(sheet, name, _terms(model), alpha, reduce) for name in names}
        answer = best_setting(surfaces, wishes, extent, constraint or [], seed)
    _show(answer, out, as_json, str(table))


@doe.command(epilog=CLIMB_EXAMPLE)
def climb(
    table: Table,
    target: Annotated[float, typer.Option(help="Response that is wanted.")],
    response: Response = None,
    factor: Factors = None,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Show how far each run of a climb is from the target."""
    with clear_errors():
        from experiments.commands.tables.answers import climb_runs

        sheet = _sheet(table, factor, [response] if response else [])
        answer = climb_runs(sheet, sheet.responses.columns[0], target)
    _show(answer, out, as_json, str(table))


@doe.command(epilog=COMPARE_EXAMPLE)
def compare(
    table: Table,
    value: Annotated[str, typer.Option(metavar="NAME", help="Column to judge, e.g. simulated.")],
    reference: Annotated[str, typer.Option(metavar="NAME", help="Column to judge it by, e.g. measured.")],
    value_sd: Annotated[float, typer.Option(help="Noise of one value, a standard deviation.", min=0.0)] = 0.0,
    reference_sd: Annotated[float, typer.Option(help="Noise of one reference value.", min=0.0)] = 0.0,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Compare two columns run by run: bias, difference, slope and rank correlation."""
    with clear_errors():
        from experiments.commands.tables.answers import compare_columns
        from experiments.commands.tables.sheet import read_columns

        answer = compare_columns(read_columns(table, [value, reference]), value_sd, reference_sd)
    _show(answer, out, as_json, str(table))


@doe.command(epilog=CURVE_EXAMPLE)
def curve(
    table: Annotated[
        Path, typer.Argument(metavar="TABLE.csv", help="Runs: factors, and heights under their places.")
    ],
    measured: Annotated[Path, typer.Option(metavar="CURVE.csv", help="Measured curve: places, and heights.")],
    reading: Annotated[float, typer.Option(help="Standard deviation of one measured height.", min=1e-12)],
    factor: Factors = None,
    varying: Annotated[
        bool, typer.Option("--varying-noise", help="The scatter of a run depends on its settings.")
    ] = False,
    alpha: Alpha = 0.05,
    seed: Annotated[int, typer.Option(help="Seed of the search.", min=0)] = 0,
    out: OutFolder = None,
    as_json: AsJson = False,
) -> None:
    """Find the settings whose simulated curve agrees with a measured one."""
    with clear_errors():
        from experiments.commands.tables.curves import fit_curve, read_curves, read_measured

        sheet = read_curves(table, factor or [])
        answer = fit_curve(sheet, read_measured(measured), reading, varying, alpha, seed)
    _show(answer, out, as_json, f"{table} and {measured}")


def _sheet(
    table: Path, factors: list[str] | None, responses: list[str], block: str | None = None,
    dummies: list[str] | None = None,
) -> Sheet:  # fmt: skip
    from experiments.commands.tables.sheet import Columns, read_sheet

    return read_sheet(table, Columns(factors or [], responses, block, dummies or []))


def _number_or_word(text: str | None) -> float | str | None:
    """Return a number as a float, e.g. of an axial distance."""
    from experiments.io.texts import is_number

    return float(text) if text is not None and is_number(text, ",") else text


def _terms(model: str) -> str | list[str]:
    """Return the name of a model, or its terms."""
    from doe.design.polynomial_terms import MODELS

    return model if model in MODELS else [term.strip() for term in model.split(",")]


def _wish(aim: str, values: pd.Series, alone: bool) -> Wish | str:
    """Read an aim; without ends its scale is that of the runs."""
    from doe import Wish
    from experiments.commands.tables.sheet import LEVELS
    from experiments.io.texts import is_number

    text, colon, scale = (part.strip() for part in aim.partition(":"))
    target, ends = float(text) if is_number(text, ",") else text, LEVELS.fullmatch(scale)
    if (isinstance(target, str) and target not in ("max", "min")) or (colon and not ends):
        rule = "needs max, min or a number as its aim, and numbers as the ends of its scale"
        raise InputError("--wish", rule, aim, "For example angle=28.6:25..32.")
    given = (float(ends["low"]), float(ends["high"])) if ends else None
    if isinstance(target, str):
        if alone and given is None:
            return target
        low, high = given or (float(values.min()), float(values.max()))
        return Wish(low, high, larger=target == "max")
    reach = float(abs(values - target).max())
    low, high = given or (target - reach, target + reach)
    return Wish(low, high, target=target)


def _predict(answer: Answer, surface: Any, points: list[str], alpha: float) -> None:
    """Add the predictions at the settings that were asked for."""
    import pandas as pd

    if not points:
        return
    rows = [assignments(point.split(","), "--at", "A=1,B=2") for point in points]
    settings = pd.DataFrame(rows).map(_number_or_word)
    predicted = surface.predict(settings, alpha)
    answer.tables["predictions"] = "Predictions.", settings.join(predicted)
    answer.texts.append(answer.tables["predictions"][1].to_string(index=False))


def _show(answer: Answer, out: Path | None, as_json: bool, source: str) -> None:
    """Print an answer, and write its folder."""
    with clear_errors():
        from experiments.commands.tables.answer_page import plain_answer, publish, require_new_folder

        if out:
            require_new_folder(out)
            publish(answer, out, source)
        if as_json:
            typer.echo(json.dumps(plain_answer(answer), allow_nan=False))
        elif answer.texts:
            typer.echo(plain("\n\n".join(answer.texts)))
        for note in [] if as_json else answer.notes:
            messages.print(f"Note: {note}")
        if out:
            messages.print(f"Wrote {out / 'report.html'}, tables and plots.")
