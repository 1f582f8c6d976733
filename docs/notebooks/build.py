"""Make and execute the notebooks: ``python docs/notebooks/build.py [NAME ...]``.

``NAME_source.py`` in percent format is the source of ``NAME.ipynb``. Needs nbformat, nbclient and ipykernel
(``pip install -e ".[docs]"``).
"""

import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).parent
MARKS = {"# %%": "code", "# %% [markdown]": "markdown"}


def cells_of(script: str) -> list[tuple[str, str]]:
    """Return kind and source of every cell of a script in percent format."""
    cells: list[tuple[str, list[str]]] = []
    for line in script.splitlines():
        if line in MARKS:
            cells.append((MARKS[line], []))
        else:
            cells[-1][1].append(line)
    return [(kind, _source(kind, lines)) for kind, lines in cells]


def _source(kind: str, lines: list[str]) -> str:
    text = "\n".join(
        line.removeprefix("#").removeprefix(" ") if kind == "markdown" else line for line in lines
    )
    return text.strip("\n")


def notebook_of(script: str) -> nbformat.NotebookNode:
    """Return the notebook of a script, not executed; figures that a cell ends with are shown."""
    make = {"code": nbformat.v4.new_code_cell, "markdown": nbformat.v4.new_markdown_cell}
    unseen = {"tags": ["remove-cell"]}  # by the site
    cells = [nbformat.v4.new_code_cell("%matplotlib inline", id="inline", metadata=unseen)]
    for number, (kind, source) in enumerate(cells_of(script)):
        shown = f"{source}\nfigure" if source.startswith("figure = ") else source
        cells.append(make[kind](shown, id=f"cell-{number}"))
    kernel = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
    return nbformat.v4.new_notebook(cells=cells, metadata=kernel)


def main(names: list[str]) -> None:
    """Execute the named notebooks (default: all), and write each next to its script."""
    chosen = [f"{name}_source.py" for name in names] or ["*_source.py"]
    for script in sorted(path for pattern in chosen for path in FOLDER.glob(pattern)):
        notebook = notebook_of(script.read_text(encoding="utf-8"))
        NotebookClient(notebook, timeout=900).execute()
        for cell in notebook.cells:
            cell.metadata.pop("execution", None)  # times of a run would change the file each time
        nbformat.write(notebook, FOLDER / f"{script.stem.removesuffix('_source')}.ipynb")


if __name__ == "__main__":
    main(sys.argv[1:])
