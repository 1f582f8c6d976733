"""The documentation: ``sphinx-build -W -b html docs out/site`` runs every command on its pages.

With ``-D nb_execution_mode=off`` nothing is run: the pages are checked, their outputs are missing. With ``-D
executed_pages=quick`` only pages that take seconds are run (`executed.py`).
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
GENERATED = Path(__file__).parent / "generated"
SHOWN = GENERATED / "shown"
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]
# Pages run in folders of their own: their commands are those of this environment and tree; with an empty
# PAGES_PYTHONPATH, those of what is installed.
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
os.environ["PYTHONPATH"] = os.environ.get("PAGES_PYTHONPATH", str(ROOT))
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

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "cells",
    "executed",
    "formulas",
]
exclude_patterns = ["notebooks/*.py", "generated/shown"]
html_theme = "furo"
html_title = "dem-warp"
html_static_path = ["static"]
html_extra_path = ["generated/shown"]  # reports that pages made, to be opened from them
html_css_files = ["style.css"]
html_show_sphinx = False
html_math_renderer = "mathml"
smartquotes_action = "qe"  # quotes and ellipses; the two dashes of an option stay two
copybutton_exclude = ".linenos, .gp, .go"

myst_enable_extensions = ["dollarmath", "attrs_inline", "colon_fence"]
myst_heading_anchors = 3
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = False  # an error is a warning, and -W fails once every page was tried
nb_execution_show_tb = True
nb_execution_timeout = 3600  # of a cell, on a machine that is busy
suppress_warnings = [
    "myst-nb.lexer",  # of cells that are shell, see `cells.show_as_typed`
    "ref.python",  # words of a docstring's types, as "mean", that are names of several attributes too
]

autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False

write_pages(GENERATED)
SHOWN.mkdir(exist_ok=True)
