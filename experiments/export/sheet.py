"""Sheets of values for codes that are filled in by hand: names of dialogs, spheres, protocol."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from experiments.export.contact import Term
from experiments.export.exporter import Translation
from experiments.export.lift import Lift
from experiments.export.lift_rows import lift_rows, lift_warnings
from experiments.export.translated import Translated

SHEET, VALUES, SPHERES = "values.md", "values.csv", "spheres.csv"


@dataclass(frozen=True)
class Entry:
    """One value to be entered."""

    dialog: str
    """Dialog or page of the program."""
    name: str
    """Name that the value has there."""
    value: str
    """Number or choice."""
    unit: str = ""


def sheet_translation(
    lift: Lift,
    code: str,
    entries: Sequence[Entry],
    laws: Sequence[Translated],
    warnings: tuple[str, ...],
) -> Translation:
    """Write the sheet of a lifted cylinder as Markdown and as CSV, with a table of the spheres."""
    rows: list[tuple[str, ...]] = [("dialog", "name", "value", "unit")]
    rows += [(entry.dialog, entry.name, entry.value, entry.unit) for entry in entries]
    spheres = _spheres(lift)
    scale = lift.case.numerics.modulus_scale
    softened = (
        "" if scale == 1.0 else f"The grains' modulus is softened by {scale:g}: calibrated so, keep it.\n\n"
    )
    text = (
        f"# {lift.test.name}: values for {code}\n\n"
        f"{softened}## Values\n\n{_markdown(rows)}\n"
        f"## Spheres of a grain of size 1 (`{SPHERES}`)\n\n{_markdown(spheres)}\n"
        f"## Protocol\n\n{_protocol(lift)}"
    )
    files = {SHEET: text, VALUES: _csv(rows), SPHERES: _csv(spheres)}
    warnings += lift_warnings(lift)
    return Translation(files, SHEET, (), "", (*laws, *_rows(lift)), warnings, comment=">")


def term_entries(dialog: str, terms: Iterable[Term]) -> list[Entry]:
    """Entries of the terms of a material or a contact."""
    return [
        Entry(dialog, term.name, f"{term.value:.6g}", "" if term.unit == "1" else term.unit) for term in terms
    ]


def size_entries(lift: Lift, dialog: str, names: tuple[str, str, str, str]) -> list[Entry]:
    """Entries of sizes: mean, standard deviation, smallest and largest of a normal spread; or classes."""
    grains = lift.case.grains
    if grains.classes is not None:
        pairs = zip(grains.classes.sizes, grains.classes.fractions, strict=True)
        return [
            Entry(dialog, f"user defined {number}: scale, part of the number", f"{size:.6g}, {part:.6g}")
            for number, (size, part) in enumerate(pairs, 1)
        ]
    values = (grains.size_mean, grains.size_sd, *grains.size_range)
    return [Entry(dialog, name, f"{value:.6g}") for name, value in zip(names, values, strict=True)]


def _rows(lift: Lift) -> list[Translated]:
    """Rows of the README, with what a person enters in place of what an input holds."""
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
    quoted = ([f'"{cell}"' if "," in cell else cell for cell in row] for row in rows)
    return "".join(",".join(row) + "\n" for row in quoted)
