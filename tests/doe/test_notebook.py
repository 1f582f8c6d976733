"""The notebook: its cells are those of its script, run, and print what the stored outputs show."""

import contextlib
import io
import json
import re
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "docs" / "notebooks"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]\d+)?")


@pytest.fixture(scope="module")
def cells() -> list[dict]:
    notebook = json.loads((FOLDER / "doe.ipynb").read_text(encoding="utf-8"))
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert "".join(code[0]["source"]) == "%matplotlib inline"
    return code[1:]


def stored_text(cell: dict) -> str:
    return "".join("".join(output["text"]) for output in cell["outputs"] if output["output_type"] == "stream")


def test_notebook_is_made_from_its_script(cells):
    script = (FOLDER / "doe_source.py").read_text(encoding="utf-8")
    for cell in cells:
        source = "".join(cell["source"]).removesuffix("\nfigure")
        assert source in script
    assert len(cells) == script.count("# %%\n")


def test_notebook_is_executed_and_draws(cells):
    assert [cell["execution_count"] for cell in cells] == list(range(2, len(cells) + 2))
    figures = [
        cell for cell in cells if any("image/png" in output.get("data", {}) for output in cell["outputs"])
    ]
    assert len(figures) == sum("".join(cell["source"]).startswith("figure") for cell in cells) >= 4
    assert not [output for cell in cells for output in cell["outputs"] if output["output_type"] == "error"]


def test_cells_print_what_is_stored(cells):
    names: dict = {}
    for cell in cells:
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            exec("".join(cell["source"]), names)
        ours, theirs = printed.getvalue(), stored_text(cell)
        assert NUMBER.sub("#", ours).split() == NUMBER.sub("#", theirs).split()
        # Printed to three decimals: the last one may turn with another library of linear algebra.
        values, stored = (list(map(float, NUMBER.findall(text))) for text in (ours, theirs))
        assert values == pytest.approx(stored, rel=2e-3, abs=2e-3)
