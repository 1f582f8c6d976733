"""Sheets of values for codes that a person fills in by hand: names of dialogs, spheres, protocol."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from experiments.export.code_table import CodeTest, code_exporter, code_table
from experiments.export.exporter import Exporter, Translation
from experiments.export.laws import Translated
from experiments.export.lift import Lift
from experiments.export.lift_rows import lift_rows, lift_warnings
from experiments.io.texts import safe_cell

SHEET, VALUES, SPHERES = "values.md", "values.csv", "spheres.csv"


def sheet_exporter(name: str) -> Exporter:
    """Make the exporter of a code whose dialogs are named in its table."""
    dialogs = code_table(name)["sheet"]
    return code_exporter(name, lambda test: _sheet(dialogs, test))


def _sheet(dialogs: Mapping[str, Any], test: CodeTest) -> Translation:
    """Write the values of a lifted cylinder as Markdown and as CSV, with a table of the spheres."""
    lift = test.lift
    rows: list[tuple[str, ...]] = [("dialog", "name", "value", "unit"), *_entries(dialogs, test)]
    spheres = _spheres(lift)
    scale = lift.case.numerics.modulus_scale
    softened = (
        "" if scale == 1.0 else f"The grains' modulus is softened by {scale:g}: calibrated so, keep it.\n\n"
    )
    text = (
        f"# {lift.test.name}: values for {test.exporter.code}\n\n"
        f"{softened}## Values\n\n{_markdown(rows)}\n"
        f"## Spheres of a grain of size 1 (`{SPHERES}`)\n\n{_markdown(spheres)}\n"
        f"## Protocol\n\n{_protocol(lift)}"
    )
    files = {SHEET: text, VALUES: _csv(rows), SPHERES: _csv(spheres)}
    warnings = test.warnings + _warnings(dialogs, test) + lift_warnings(lift)
    return Translation(files, SHEET, (), "", (*test.rows, *_rows(lift)), warnings, comment=">")


def _entries(dialogs: Mapping[str, Any], test: CodeTest) -> Iterator[tuple[str, ...]]:
    """List the values to be entered: dialog, name, value and unit."""
    exporter, (among, wall, _) = test.exporter, test.contacts
    terms = [exporter.material_terms(each) for each in (among.first, wall.second)]
    terms += [exporter.contact_terms(each) for each in (among, wall)]
    for dialog, some in zip([*dialogs["material"], *dialogs["contact"]], terms, strict=True):
        for term in some:
            yield dialog, term.name, f"{term.value:.6g}", "" if term.unit == "1" else term.unit
    for name, law in dialogs["models"]:
        yield dialogs["physics"], name, test.words[law], ""
    if "softening" in dialogs:
        yield dialogs["physics"], *dialogs["softening"], ""
    yield *dialogs["spheres"], SPHERES, "mm"
    for name, value in _sizes(test.lift, dialogs["sizes"]):
        yield dialogs["size"], name, value, ""
    yield *dialogs["time_step"], f"{test.lift.case.time_step:.6g}", "s"


def _sizes(lift: Lift, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """List mean, standard deviation, smallest and largest of a normal spread; or classes."""
    grains = lift.case.grains
    if grains.classes is None:
        values = (grains.size_mean, grains.size_sd, *grains.size_range)
        yield from ((name, f"{value:.6g}") for name, value in zip(names, values, strict=True))
    else:
        pairs = zip(grains.classes.sizes, grains.classes.fractions, strict=True)
        for number, (size, part) in enumerate(pairs, 1):
            yield f"user defined {number}: scale, part of the number", f"{size:.6g}, {part:.6g}"


def _warnings(dialogs: Mapping[str, Any], test: CodeTest) -> tuple[str, ...]:
    """Name the coefficients that the code has fixed, or has once for all contacts."""
    case, rolling, warnings = test.lift.case, test.words["rolling"], []
    stiffness = case.laws.rolling_stiffness
    fixed = dialogs.get("fixed_stiffness", {}).get(rolling, stiffness)
    if stiffness != fixed:
        has = f"{test.exporter.code}'s {rolling} has {fixed:g}"
        warnings.append(f"law rolling_stiffness = {stiffness:g}: {has}, and no entry for it")
    own, with_wall = case.grain_grain.rolling_friction, case.grain_wall.rolling_friction
    if "one_number" in dialogs and own != with_wall:
        warnings.append(f"{dialogs['one_number']}, {own:g}; that of grain with wall is {with_wall:g}")
    return tuple(warnings)


def _rows(lift: Lift) -> list[Translated]:
    """Return rows of the README, with what a person enters."""
    entered = {
        "sizes": "the same, as entered",
        "mass and inertia": "enter those of the table below, or compare what the program finds",
        "seed": "the program's own: another heap of the same kind",
    }
    rows = lift_rows(lift, exact_tube=True)
    return [Translated(row.subject, row.here, entered.get(row.subject, row.there)) for row in rows]


def _spheres(lift: Lift) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = [("shape", "x", "y", "z", "radius", "unit")]
    for number, shape in enumerate(lift.case.grains.mixture.shapes, 1):
        for center, radius in zip(shape.centers, shape.radii, strict=True):
            # rounded first, so that no zero has a sign
            written = (f"{round(1e3 * value, 6) + 0.0:.6f}" for value in (*center, radius))
            rows.append((f"{number}", *written, "mm"))
    return rows


def _protocol(lift: Lift) -> str:
    scene = lift.scene
    filling = (
        f"pour {scene.grain_count} grains"
        if scene.grain_count
        else "pour until grains lie above the rim, then take away every grain whose centre is above it"
    )
    wide = (
        "an endless plate" if scene.plate_diameter is None else f"a disc of {1e3 * scene.plate_diameter:g} mm"
    )
    fractions = lift.case.grains.mixture.fractions
    parts = ", ".join(f"{part:.4g} of shape {number}" for number, part in enumerate(fractions, 1))
    mixed = f" By number they are {parts}." if len(fractions) > 1 else ""
    gravity = ", ".join(f"{part:.4g}" for part in scene.gravity)
    steps = (
        f"Stand a tube of {1e3 * scene.diameter:g} mm inner diameter and {1e3 * scene.height:g} mm height in "
        f"the middle of {wide}; both have the wall's material.",
        f"Set gravity to ({gravity}) m/s2, z being the tube's axis.",
        f"Create grains at random places and orientations {1e3 * lift.reach:.3g} mm above the rim, at "
        f"{scene.rain_speed:g} m/s downwards, {lift.rain_rate:.4g} a second; {filling}.{mixed}",
        f"Wait until the root mean square speed is below {scene.rest_speed:g} m/s for {scene.rest_time:g} s.",
        f"Lift the tube at {scene.lift_speed:g} m/s along its axis until it is clear of the heap.",
        "Wait for rest again, and export the spheres' centres and radii.",
        f"Read the angle as the study's: {lift.test.estimator}.",
    )
    return "".join(f"{number}. {step}\n" for number, step in enumerate(steps, 1))


def _markdown(rows: Sequence[Sequence[str]]) -> str:
    head, *body = rows
    lines = [head, ["---"] * len(head), *body]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _csv(rows: Sequence[Sequence[str]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([safe_cell(cell) for cell in row] for row in rows)
    return text.getvalue()


EDEM, ROCKY = sheet_exporter("edem"), sheet_exporter("rocky")
