"""Folder of an exported test: the other code's input, with a README on the translation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dem_warp import Case
from experiments.export.exporter import ExportedTest, Translation
from experiments.export.exporters import EXPORTERS
from experiments.io.errors import InputError, Problem
from experiments.io.files import write_text
from experiments.io.plug_ins import calling, made_in
from experiments.io.program_version import program_version
from experiments.io.texts import safe_text

README = "README.md"
"""File about the translation."""


def export_input(
    test: ExportedTest, to: str, approximate: bool = False, option: str = "--approximate"
) -> Translation:
    """Translate a test into the input of another code.

    Parameters
    ----------
    test
        The test.
    to
        Name of the code, a key of `EXPORTERS`.
    approximate
        Replace what the code lacks by the nearest that it has, with a warning at the top of the input.
    option
        Name of that option, for the message.

    Raises
    ------
    InputError
        When the code is unknown or has no input, or lacks something of the test.
    """
    known = {name: each.translate for name, each in EXPORTERS.items() if each.translate is not None}
    if to not in known:
        raise InputError("--to", f"must be one of {', '.join(known)}", to)
    translate, place = known[to], f"exporter {to}"
    with calling(translate, place):
        translation = translate(test)
    if not isinstance(translation, Translation):
        raise InputError(place, f"{made_in(translate)} must return a Translation", translation)
    if translation.warnings and not approximate:
        hint = f"{option} substitutes the nearest that it has"
        problem = f"{EXPORTERS[to].code} does not support the whole test"
        raise InputError.of(
            Problem(test.source, f"{problem}: {each}", "", hint) for each in translation.warnings
        )
    return translation


def write_export(test: ExportedTest, to: str, translation: Translation, folder: Path) -> list[Path]:
    """Write the files of a translation and its README into a folder, made when it is missing."""
    files = dict(translation.files)
    files[translation.main] = _head(test, to, translation) + files[translation.main]
    files[README] = readme(test, to, translation)
    for name, text in files.items():
        write_text(folder / name, text)
    return [folder / name for name in files]


def _head(test: ExportedTest, to: str, translation: Translation) -> str:
    lines = [
        f"{test.name}, {test.source}; written by dem-warp {program_version()}; README.md says what is what"
    ]
    lines += [EXPORTERS[to].unproven] if EXPORTERS[to].unproven else []
    lines += [f"WARNING: {warning}" for warning in translation.warnings]
    return "".join(f"{translation.comment} {safe_text(line)}\n" for line in lines)


def readme(test: ExportedTest, to: str, translation: Translation) -> str:
    """Write how to run an exported test, how each part was translated, and what could not be."""
    exporter = EXPORTERS[to]
    parts = [f"# {test.name} in {exporter.code}\n\nFrom {test.source}, by dem-warp {program_version()}.\n"]
    if exporter.unproven:
        parts.append(f"**{exporter.unproven}**\n")
    if translation.warnings:
        parts.append(
            "## Not the same there\n\n" + "".join(f"- {safe_text(text)}\n" for text in translation.warnings)
        )
    if translation.command:
        parts.append(_running(test, translation))
    if test.settings:
        parts.append("## Factors\n\n" + _table(("factor", "value"), list(test.settings.items())))
    own = (f"the set `{test.case.laws.name}`", *(mechanism.name for mechanism in test.case.mechanisms))
    rows = [("contact laws", ", ".join(own), f"{exporter.laws}. {exporter.differs}")]
    rows += [(row.subject, row.here, row.there) for row in translation.translated]
    parts.append("## Translated\n\n" + _table(("what", "in dem-warp", f"in {exporter.code}"), rows))
    parts.append("## Grains\n\n" + _table(*_grain_rows(test.case)))
    return "\n".join(parts)


def _grain_rows(case: Case[Any]) -> tuple[tuple[str, ...], list[tuple[object, ...]]]:
    # of the union of the spheres: no overlap counts twice
    density, mixture = case.grain_material.density, case.grains.mixture
    head = ("shape", "fraction", "spheres", "mass [kg]", "principal moments of inertia [kg m2]")
    rows: list[tuple[object, ...]] = []
    for number, (shape, fraction) in enumerate(zip(mixture.shapes, mixture.fractions, strict=True), 1):
        mass = density * shape.volume
        moments = ", ".join(f"{mass * moment:.6g}" for moment in shape.inertia_over_mass)
        rows.append((number, f"{fraction:.4g}", shape.sphere_count, f"{mass:.6g}", moments))
    return head, rows


def _running(test: ExportedTest, translation: Translation) -> str:
    text = f"## Run\n\n    {' '.join(translation.command)}\n"
    if translation.heap and not test.case.scene.leaves_a_heap:
        text += f"\nIt leaves `{translation.heap}`, and nothing there before it has finished.\n"
    elif translation.heap:
        text += (
            f"\nIt leaves the spheres of the final heap in `{translation.heap}` (LAMMPS dump, metres), and "
            f"nothing there before it has finished. Its angle, read as the study's ({test.estimator}):\n\n"
            f"    dem-warp angle {translation.heap}\n"
        )
    return text


def _table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join(
        f"| {' | '.join(' '.join(str(cell).replace('|', '/').split()) for cell in line)} |\n"
        for line in lines
    )
