"""The documentation: ``sphinx-build -W -b html docs out/site`` runs every command on its pages.

With ``-D nb_execution_mode=off`` nothing is run: the pages are checked, their outputs are missing.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

import myst_nb.core.render
from docutils import nodes
from nbformat import NotebookNode

ROOT = Path(__file__).parents[1]
GENERATED = Path(__file__).parent / "generated"
SHOWN = GENERATED / "shown"
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]
# Pages run in folders of their own: their commands are those of this environment and of this tree.
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
os.environ["PYTHONPATH"] = str(ROOT)
os.environ["DEM_WARP"] = str(ROOT)
os.environ["SHOWN"] = str(SHOWN)
os.environ["BASH_ENV"] = str(ROOT / "docs" / "strict.sh")
os.environ["COLUMNS"] = "100"
os.environ["TERM"] = "dumb"
os.environ["TIMEFORMAT"] = "wall time %0lR"

from generate import write_pages  # noqa: E402

from dem_warp import __version__  # noqa: E402

project = "dem-warp"
author = "the dem-warp developers"
project_copyright = author
version = release = __version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton", "formulas"]
exclude_patterns = ["notebooks/*.py", "generated/shown"]
html_theme = "furo"
html_title = "dem-warp"
html_static_path = ["static"]
html_extra_path = ["generated/shown"]  # reports that pages made, to be opened from them
html_css_files = ["style.css"]
html_show_sphinx = False
html_math_renderer = "mathml"
copybutton_exclude = ".linenos, .gp, .go"

myst_enable_extensions = ["dollarmath", "attrs_inline", "colon_fence"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = False  # an error is a warning, and -W fails once every page was tried
nb_execution_show_tb = True
nb_execution_timeout = 900
nb_merge_streams = True
suppress_warnings = [
    "myst-nb.lexer",  # of cells that are shell, see `show_as_typed`
    "ref.python",  # words of a docstring's types, as "mean", that are names of several attributes too
]

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False

PROGRESS = re.compile(r".*: +\d+ %, .*\d+ of \d+ cases.*\n?")
"""A line of progress, as it is written every ten seconds where there is no terminal."""

LANGUAGES = {".toml": "toml", ".py": "python"}
"""The colouring of files that pages write; others, as tables, have none."""


def show_as_typed(app: Any, doctree: nodes.document) -> None:
    """Show a cell that IPython runs by its first line as what it holds: commands, or a file with its name.

    Lines of progress are left out of what the commands print.
    """
    for block in list(doctree.findall(nodes.literal_block)):
        first, _, rest = block.rawsource.partition("\n")
        if first == "%%bash":
            shown, language = rest, "bash"
        elif first.startswith("%%writefile "):
            name = first.split()[1]
            shown, language = f"# {name}\n{rest}", LANGUAGES.get(Path(name).suffix, "text")
        elif PROGRESS.search(block.rawsource):
            shown, language = PROGRESS.sub("", block.rawsource), block.get("language", "text")
        else:
            continue
        if shown.strip():
            block.replace_self(nodes.literal_block(shown, shown, language=language, classes=block["classes"]))
        else:
            block.parent.remove(block)


def join_streams(outputs: list[NotebookNode]) -> list[NotebookNode]:
    """Join what a cell printed just as it was printed, the errors after the output.

    IPython hands on what bash prints in chunks of 100 bytes. myst-nb would begin a new line after each.
    """
    printed = {"stdout": "", "stderr": ""}
    others = []
    for output in outputs:
        if output["output_type"] == "stream":
            printed[output["name"]] += output["text"]
        else:
            others.append(output)
    streams = [
        NotebookNode(output_type="stream", name=name, text=text.rstrip() + "\n")
        for name, text in printed.items()
        if text.strip()
    ]
    return [*streams, *others]


myst_nb.core.render.coalesce_streams = join_streams
write_pages(GENERATED)
SHOWN.mkdir(exist_ok=True)


def setup(app: Any) -> None:
    """Connect the transformation."""
    app.connect("doctree-read", show_as_typed)
