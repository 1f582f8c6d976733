"""Growth by one new file and one line: the guide's table, followed to the letter in a copy of the tree."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PLUGIN = ROOT / "tests" / "plugin" / "grain_magnets"
PACKAGES = ("dem_warp", "doe", "imaging", "experiments")
EVIDENCE = shutil.ignore_patterns("evidence", "*.npz")

EXPORTER = """
from experiments.export.exporter import Exporter

MAGNETS = Exporter("Magnets", "none", "in all", lambda material: (), lambda contact: ())
"""

FORMAT = """
import numpy as np
from experiments.grains.spheres.sphere_file import Format, SphereFile

SPHERES = np.array([[0.0, 0.0, 0.0, 2.0]])
BALL = Format("ball", lambda head: head == "ball", lambda path: SphereFile("a ball", SPHERES))
"""


@dataclass(frozen=True)
class Addition:
    """A new thing, added as the guide's row says."""

    name: str
    """Name of its file; empty where it needs none."""
    text: str
    """Everything in the file."""
    imported: str
    """Name that its registry imports from the file."""
    after: str
    """Text of the registry that its entry follows."""
    entry: str


ADDITIONS = {
    "contact law": Addition(
        "magnetism", (PLUGIN / "magnetism.py").read_text("utf-8"), "",
        "_ALL: Modules[type[Mechanism]] = Modules({", '"magnetism": "dem_warp.laws.magnetism:Magnetism", ',
    ),
    "scene": Addition("jar", (PLUGIN / "jar.py").read_text("utf-8"), "Jar",
        "_ALL: tuple[type[WalledScene], ...] = (", "Jar, ",
    ),
    "mechanism": Addition(
        "magnetic_grains", (PLUGIN / "magnetic_grains.toml").read_text("utf-8"), "", "", ""
    ),
    "screening design": Addition(
        "corners", (PLUGIN / "corners.py").read_text("utf-8"), "corners",
        '"dem_warp.designs", {', '"corners": corners, ',
    ),
    "observable": Addition(
        "", "", "", "\nOBSERVABLES = (",
        'Observable("spread", "spread", "m", "its width", Instrument.RULER), ',
    ),
    "exporter": Addition("magnets", EXPORTER, "MAGNETS", "_ALL = {", '"magnets": MAGNETS, '),
    "format of spheres": Addition(
        "ball", FORMAT, "BALL", "FORMATS: tuple[Format, ...] = (", "BALL, "
    ),
}  # fmt: skip

PROGRAM = """
import json, pathlib
from experiments.calibrate.screening_stage import screening_design
from experiments.cli import app
from experiments.discover.mechanism_files import library_for
from experiments.export import EXPORTERS
from experiments.grains.spheres import read_clump
from experiments.studyfile import load_study
from experiments.studyfile.loading import build_study
from experiments.studyfile.places import Places
trial = pathlib.Path("experiments/studies/trial/study.toml")
magnets, corners = {"magnetism": {"magnetic_force": "0.5 mN"}}, {"screening": {"design": "corners"}}
study = load_study(trial, "bench", {"mechanism": magnets, "campaign": corners})
paper = load_study(scale="bench")
written = {key: value for key, value in paper.document.items() if key not in ("target", "response", "direct")}
written |= {"scene": {"jar": {"diameter": "28 mm", "height": "28 mm"}}}
jar = build_study(written, Places(paper.file, {}))
app(["new", str(trial), "--measured"], standalone_mode=False)
[measured] = pathlib.Path(".").rglob("*-measured.csv")
pathlib.Path("ball.txt").write_text("ball", encoding="utf-8")
print(json.dumps({
    "contact law": study.case({}, seed=1).to_dict()["mechanisms"][0]["magnetic_force"],
    "scene": jar.case({}, seed=1).to_dict()["scene"]["kind"],
    "mechanism": "magnetic_grains" in [one.name for one in library_for(load_study(trial, "bench"))],
    "screening design": len(screening_design(study.factors, study.campaign.screening).dummies),
    "observable": "spread" in measured.read_text(encoding="utf-8"),
    "exporter": EXPORTERS["magnets"].code,
    "format of spheres": read_clump(pathlib.Path("ball.txt")).shape.sphere_count,
}))
"""


def table() -> dict[str, tuple[str, str]]:
    """Rows of the guide: what is added, its file, and the file of its line."""
    guide = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([a-z ]+) \| (?:`([^`]+)`|none) \| (?:`([^`]+)`|none) \|$", guide, re.MULTILINE)
    return {name: (file, registry) for name, file, registry in rows}


@pytest.fixture(scope="module")
def used(tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    """Add everything to a copy of the tree, and use it there."""
    tree = tmp_path_factory.mktemp("tree")
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tree / package, ignore=EVIDENCE)
    for kind, (file, registry) in table().items():
        addition = ADDITIONS[kind]
        path = file.replace("NAME", addition.name)
        if file:
            assert not (tree / path).exists()
            (tree / path).write_text(addition.text, encoding="utf-8")
        if registry:
            text = (tree / registry).read_text(encoding="utf-8")
            assert addition.after in text
            text = text.replace(addition.after, addition.after + addition.entry, 1)
            if addition.imported:
                module = path.removesuffix(".py").replace("/", ".")
                first = re.search(r"^from (?!__future__)", text, re.MULTILINE).start()
                text = f"{text[:first]}from {module} import {addition.imported}\n{text[first:]}"
            (tree / registry).write_text(text, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=tree, env=os.environ | {"PYTHONPATH": str(tree)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_the_guide_has_a_row_for_each() -> None:
    assert table().keys() == ADDITIONS.keys()


def test_a_file_and_a_line_are_all_that_a_new_thing_takes(used: dict[str, object]) -> None:
    assert used == {
        "contact law": 0.5e-3,
        "scene": "Jar",
        "mechanism": True,
        "screening design": 0,
        "observable": True,
        "exporter": "Magnets",
        "format of spheres": 1,
    }
