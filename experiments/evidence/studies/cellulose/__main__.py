"""Microcrystalline cellulose in a drum: calibrated on two surfaces, two others predicted.

    python -m experiments.evidence.studies.cellulose run --out out/cellulose
    python -m experiments.evidence.studies.cellulose run --scale bench --device cpu --out out/cellulose-bench
    python -m experiments.evidence.studies.cellulose page --out out/cellulose

The first needs a GPU, and a quarter of an hour on an H200; the second is a coarse slice for two cores; the
third writes the page of a run. What a folder holds is not simulated again: a run that was stopped goes on.
"""

from pathlib import Path

from experiments.evidence.studies.drum_commands import drum_commands

app = drum_commands("experiments.evidence.studies.cellulose.cellulose", __doc__, Path("out/cellulose"))

if __name__ == "__main__":
    app()
