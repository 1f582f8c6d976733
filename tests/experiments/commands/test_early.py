"""Answers before the libraries load: to a wrong study, to ``--help``, to ``new``."""

import subprocess
import sys
from pathlib import Path

import pytest

from experiments.io.errors import StudyError
from experiments.runs.choices import check_campaign, check_scene
from experiments.studyfile import load_study, write_template

ROOT = Path(__file__).resolve().parents[3]

HEAVY = {
    "warp", "pandas", "scipy", "statsmodels", "sklearn", "cv2", "pyvista", "vtkmodules", "plotly",
    "matplotlib", "trimesh", "jinja2",
}  # fmt: skip
"""Libraries that take from a tenth of a second to seconds to load."""

WRONG: dict[str, tuple[str, str]] = {
    "no TOML": ("[wall]", "[wall"),
    "an unknown key": ("size_sd = 0.05", "size_sdd = 0.05"),
    "a wrong unit": ('density = "700 kg/m^3"', 'density = "700 mm"'),
    "a range reversed": ("low = 0.3\nhigh = 0.6", "low = 0.6\nhigh = 0.3"),
    "a clump file that is not there": ('sphere = "2 mm"', 'clump = "none.txt"'),
    "a clump that is none": ('sphere = "2 mm"', 'clump = "words.txt"'),
    "a factor that leads nowhere": (
        'parameter = "contact.grain-grain.static_friction"',
        'parameter = "contact.grain-grain.stickiness"',
    ),
    "laws that are none": ('laws = "relative"', 'laws = "liggghtz"'),
    "an engine that is none": ("[numerics]", '[engine]\nname = "nobody"\n\n[numerics]'),
    "a file of measurements without its columns": (
        'mean = "30 deg"\nsd = "0.5 deg"\nn = 5',
        'file = "words.txt"',
    ),
    "a decision on no factor": ("at_most = 3", 'at_most = 3\nkeep = ["Z"]'),
    "more grains than a case can have": ("# grain_count = 400 ", "grain_count = 1_000_000_000 "),
    "a tube that too many grains fill": ('height = "110 mm"', 'height = "10000 m"'),
    "a tube narrower than two grains": ('diameter = "35 mm"', 'diameter = "7 mm"'),
}
"""Mistakes of a study: the template's text, and its replacement."""


def wrong_study(folder: Path, kind: str) -> Path:
    """Write the template's study, wrong in one way."""
    path = folder / "study.toml"
    write_template("study", folder)
    (folder / "words.txt").write_text("no numbers here\n", encoding="utf-8")
    text = path.read_text(encoding="utf-8")
    old, new = WRONG[kind]
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


PROGRAM = """
import sys
from experiments.cli import app
try:
    app(sys.argv[1:])
finally:
    print("LOADED", *sys.modules)
"""


def run(*words: str, folder: Path) -> tuple[int, str, set[str]]:
    """Run a command; return its exit code, what it says of an error, and the modules that it loaded."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *words],
        cwd=folder,
        env={"PYTHONPATH": str(ROOT), "PATH": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    loaded = set(done.stdout.partition("LOADED")[2].split())
    assert "experiments.cli" in loaded
    return done.returncode, done.stderr, loaded


@pytest.mark.parametrize("kind", WRONG)
def test_a_wrong_study_is_answered_without_simulator_statistics_or_pictures(
    kind: str, tmp_path: Path
) -> None:
    study = wrong_study(tmp_path, kind)
    code, said, loaded = run("calibrate", study.name, "--out", "out", folder=tmp_path)
    assert code == 2
    assert said.startswith("Error:")
    assert HEAVY & loaded == set()
    assert not (tmp_path / "out").exists()


def test_other_commands_check_a_study_as_early(tmp_path: Path) -> None:
    study = wrong_study(tmp_path, "a wrong unit")
    for words in (("heap", study.name), ("discover", study.name, "measured.csv")):
        code, said, loaded = run(*words, folder=tmp_path)
        assert (code, HEAVY & loaded) == (2, set())
        assert "needs a unit of density" in said


@pytest.mark.parametrize(
    "kind",
    [
        "more grains than a case can have",
        "a tube that too many grains fill",
        "a tube narrower than two grains",
    ],
)
def test_a_heap_that_cannot_be_is_refused_as_early(kind: str, tmp_path: Path) -> None:
    study = wrong_study(tmp_path, kind)
    code, said, loaded = run("heap", study.name, "--seed", "2", folder=tmp_path)
    assert (code, HEAVY & loaded) == (2, set())
    assert "grains" in said
    assert "scene" in said


def test_settings_may_make_a_heap_of_fewer_grains(tmp_path: Path) -> None:
    path = wrong_study(tmp_path, "a tube that too many grains fill")
    text = path.read_text(encoding="utf-8").replace('height = "10000 m"\n', "")
    factor = """
[[factor]]
name = "h"
label = "height"
parameter = "scene.lifted-cylinder.height"
low = "40 mm"
high = "20000 m"
"""
    path.write_text(text + factor, encoding="utf-8")
    check_scene(load_study(path))
    with pytest.raises(StudyError, match="at most"):
        check_campaign(load_study(path))


def test_an_engine_that_is_none_is_answered_as_early(tmp_path: Path) -> None:
    code, said, loaded = run("calibrate", "--engine", "nobody", folder=tmp_path)
    assert (code, HEAVY & loaded) == (2, set())
    assert "liggghts, lammps, yade" in said


@pytest.mark.parametrize("words", [("--help",), ("calibrate", "--help"), ("new", "mygrain")])
def test_help_and_a_new_study_read_no_study(words: tuple[str, ...], tmp_path: Path) -> None:
    code, _, loaded = run(*words, folder=tmp_path)
    assert code == 0
    assert (HEAVY | {"numpy"}) & loaded == set()
