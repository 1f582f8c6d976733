"""Cells as a reader sees them: commands, files with their names, and what was printed in one piece."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from docutils import nodes

PROGRESS = re.compile(r".*: +\d+ %, .*\d+ of \d+ cases.*\n?")
"""A line of progress, as it is written every ten seconds where there is no terminal."""

LANGUAGES = {".toml": "toml", ".py": "python"}
"""The colouring of files that pages write; others, as tables, have none."""

WRITTEN = re.compile(r"(Writing|Overwriting) \S+")
"""Words of IPython on a cell that is a file, whose name stands in the cell."""

TABLE = re.compile(r"((?:^.*\n)?^┏.*\n(?:^[┃┡│├└].*\n?)+)", re.MULTILINE)
"""A table with its title, apart from what is printed before and after it."""

COLUMNS = re.compile(r"\S {3,}\S")
"""Columns: they scroll where the page is narrow, and other text wraps."""

STREAMS = ("stderr", "stream")
"""Classes of what a cell printed; the output stands before the errors, so it is put there last."""


def join_streams(app: Any, doctree: nodes.document) -> None:
    """Join what a cell printed, without the lines of progress and what is said of a file.

    IPython hands on what bash prints in chunks of 100 bytes, each a block of its own.
    """
    for output in list(doctree.findall(nodes.container)):
        if output.get("nb_element") != "cell_code_output":
            continue
        for stream in STREAMS:
            chunks = [
                block for block in output.findall(nodes.literal_block) if stream in block.get("classes", [])
            ]
            text = PROGRESS.sub("", "".join(chunk.rawsource for chunk in chunks)).rstrip()
            for chunk in chunks:
                output.remove(chunk)
            if text and not WRITTEN.fullmatch(text):
                first, parts = chunks[0], [part.rstrip() for part in TABLE.split(text)]
                for part in reversed(parts):
                    classes = [*first["classes"], *(["table"] if COLUMNS.search(part) else [])]
                    block = nodes.literal_block(part, part, language=first["language"], classes=classes)
                    output.insert(0, block) if part else None
        if not output.children:
            output.parent.remove(output)


def show_as_typed(app: Any, doctree: nodes.document) -> None:
    """Show a cell that IPython runs by its first line as what it holds: commands, or a file with its name."""
    for block in list(doctree.findall(nodes.literal_block)):
        first, _, rest = block.rawsource.partition("\n")
        if first == "%%bash":
            shown, language = rest, "bash"
        elif first.startswith("%%writefile "):
            name = first.split()[1]
            shown, language = f"# {name}\n{rest}", LANGUAGES.get(Path(name).suffix, "text")
        else:
            continue
        block.replace_self(nodes.literal_block(shown, shown, language=language, classes=block["classes"]))


def setup(app: Any) -> dict[str, bool]:
    """Connect the transformations."""
    app.connect("doctree-read", join_streams)
    app.connect("doctree-read", show_as_typed)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
