"""The folder of an exported test: the other code's input, with a README of what was translated how."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from experiments.export.exporter import ExportedTest, Translation
from experiments.export.exporters import EXPORTERS
from experiments.export.facts import grain_rows, laws_row
from experiments.io.errors import InputError, Problem
from experiments.io.files import write_text
from experiments.io.program_version import program_version

README = "README.md"
"""File that says what was translated how."""


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
        Take the nearest for what the code lacks, with a warning at the top of the input.
    option
        Words by which a person says so, for the message.

    Raises
    ------
    InputError
        When there is no such code or it has no input, when it cannot have the test at all, or lacks something
        of it and the nearest will not do.
    """
    known = {name: each.translate for name, each in EXPORTERS.items() if each.translate is not None}
    if to not in known:
        raise InputError("--to", f"must be one of {', '.join(known)}", to)
    translation = known[to](test)
    if translation.warnings and not approximate:
        rule = f"{EXPORTERS[to].code} must have all of the test, or {option} takes the nearest that it has"
        raise InputError.of(Problem(test.source, rule, warning) for warning in translation.warnings)
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
    return "".join(f"{translation.comment} {line}\n" for line in lines)


def readme(test: ExportedTest, to: str, translation: Translation) -> str:
    """Say how to run an exported test, what was translated how, and what could not be."""
    exporter = EXPORTERS[to]
    parts = [f"# {test.name} in {exporter.code}\n\nFrom {test.source}, by dem-warp {program_version()}.\n"]
    if exporter.unproven:
        parts.append(f"**{exporter.unproven}**\n")
    if translation.warnings:
        parts.append("## Not the same there\n\n" + "".join(f"- {text}\n" for text in translation.warnings))
    if translation.command:
        parts.append(_running(test, translation))
    if test.settings:
        parts.append("## Factors\n\n" + _table(("factor", "value"), list(test.settings.items())))
    rows = [(row.subject, row.here, row.there) for row in (laws_row(test, exporter), *translation.translated)]
    parts.append("## Translated\n\n" + _table(("what", "in dem-warp", f"in {exporter.code}"), rows))
    parts.append("## Grains\n\n" + _table(*grain_rows(test.case)))
    return "\n".join(parts)


def _running(test: ExportedTest, translation: Translation) -> str:
    text = f"## Run\n\n    {' '.join(translation.command)}\n"
    if translation.heap:
        text += (
            f"\nIt leaves the spheres of the final heap in `{translation.heap}` (LAMMPS dump, metres), and "
            f"nothing there before it has finished. Its angle, read as the study's ({test.estimator}):\n\n"
            f"    dem-warp angle {translation.heap}\n"
        )
    return text


def _table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(str(cell).replace('|', '/') for cell in line)} |\n" for line in lines)
