"""Wheat in drums: one grain, five slopes, a friction for each wall, and the heap that they foretell.

    python -m experiments.evidence.studies.wheat_drums run --out out/wheat-drums
    python -m experiments.evidence.studies.wheat_drums run --scale bench --device cpu --out out/drums
    python -m experiments.evidence.studies.wheat_drums page --out out/wheat-drums
    python -m experiments.evidence.studies.wheat_drums search --out out/wheat-drums

The first needs a GPU; the second has small drums for two cores; the third writes the page of a run, and the
fourth a study and a table for `dem-warp discover`. What a folder holds is not simulated again.
"""

from pathlib import Path

from experiments.commands.console import clear_errors
from experiments.evidence.studies.drum_commands import Out, drum_commands

DEFAULT = Path("out/wheat-drums")

app = drum_commands("experiments.evidence.studies.wheat_drums.drum", __doc__, DEFAULT)


@app.command()
def search(out: Out = DEFAULT) -> None:
    """Write a study and a table for a search, and say how to run it."""
    from experiments.evidence.studies.wheat_drums.drum_page import fit_of
    from experiments.evidence.studies.wheat_drums.drum_search import write_search

    with clear_errors():
        study, fit, _ = fit_of(out)
        made, measured = write_search(out, study, fit)
    print(f"dem-warp discover {made} {measured} --out {out / 'search'}")


if __name__ == "__main__":
    app()
