"""Drivers of other codes: what they run and read, with stand-ins on the PATH, and with the codes themselves.

Tests marked with a `program` run it, and are left out where it is not installed.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from commandline import install

from dem_warp import CaseResult
from experiments.cases import Store, engine_of, simulate_heap
from experiments.cases.engines.driver import Driver
from experiments.cases.engines.engine import NO_ANSWER
from experiments.cases.engines.program import ProgramEngine
from experiments.export import ExportedTest, export_input
from experiments.io.errors import InputError
from experiments.studyfile import Study, load_study

Write = Callable[..., Path]

DUMPING = """\
#!{python}
import sys
from pathlib import Path
text = Path(sys.argv[sys.argv.index("-in") + 1]).read_text()
if "{way}" == "error":
    print("ERROR: Fix gravity redefined")
    print("Running script lift.py", file=sys.stderr)
    raise SystemExit(1)
if "{way}" != "silent":
    rows = ["1 1 0 0 0.002 0.002", "2 1 0.004 0 0.002 0.002"]
    head = ["ITEM: TIMESTEP", "0", "ITEM: NUMBER OF ATOMS", "2", "ITEM: BOX BOUNDS ff ff ff", *["-1 1"] * 3]
    Path("{heap}").write_text("\\n".join([*head, "ITEM: ATOMS id type x y z radius", *rows]) + "\\n")
"""


def study_for(write_study: Write, name: str, approximate: bool = True) -> Study:
    more = "approximate = true\n" if approximate else ""
    return load_study(write_study(add=f'\n[engine]\nname = "{name}"\n{more}'))


@pytest.fixture
def liggghts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, small_study: Study) -> Callable[[str], None]:
    """Write a stand-in for LIGGGHTS, which dumps two spheres or goes wrong."""
    test = ExportedTest("Small", small_study.case({}, 1), "small.toml")
    translation = export_input(test, "liggghts", approximate=True)
    folder = tmp_path / "bin"
    monkeypatch.setenv("PATH", str(folder))

    def put(way: str = "") -> None:
        text = DUMPING.format(python=sys.executable, way=way, heap=translation.heap)
        install(folder / translation.command[0], text)

    return put


def test_a_driver_runs_the_exported_input_and_reads_its_heap(
    write_study: Write, tmp_path: Path, liggghts: Callable[[str], None]
) -> None:
    liggghts("")
    study = study_for(write_study, "liggghts")
    engine = engine_of(study)
    assert isinstance(engine, ProgramEngine)
    [result] = engine([study.case({}, 1)], checkpoint=tmp_path / "cases" / "unfinished")
    assert result.status == "finished", result.reason
    np.testing.assert_array_equal(result.sphere_centers, [[0, 0, 0.002], [0.004, 0, 0.002]])
    np.testing.assert_array_equal(result.sphere_radii, [0.002, 0.002])
    assert result.provenance["engine"] == "liggghts"


@pytest.mark.parametrize(
    ("way", "reason"),
    [
        ("error", "the exit code 1; its last line: ERROR: Fix gravity redefined"),
        ("silent", "the program wrote no"),
    ],
)
def test_a_code_that_fails_is_a_status_with_its_last_words(
    write_study: Write, tmp_path: Path, liggghts: Callable[[str], None], way: str, reason: str
) -> None:
    liggghts(way)
    study = study_for(write_study, "liggghts")
    [result] = engine_of(study)([study.case({}, 1)], checkpoint=tmp_path / "unfinished")
    assert result.status == NO_ANSWER
    assert reason in result.reason
    assert list((tmp_path / "failed").iterdir())


def test_a_code_that_is_not_installed_is_bad_input(
    write_study: Write, liggghts: Callable[[str], None]
) -> None:
    with pytest.raises(InputError, match="is not on the PATH"):
        engine_of(study_for(write_study, "liggghts"))


def test_what_a_code_lacks_is_refused_by_name_unless_the_nearest_will_do(
    write_study: Write, liggghts: Callable[[str], None]
) -> None:
    liggghts("")
    with pytest.raises(InputError, match="rolling = 'own_spin': LIGGGHTS lacks it") as refused:
        engine_of(study_for(write_study, "liggghts", approximate=False))
    assert "[engine] approximate = true" in str(refused.value)
    assert engine_of(study_for(write_study, "liggghts")) is not None


def test_the_nearest_and_the_same_are_stored_apart(small_study: Study, tmp_path: Path) -> None:
    case = small_study.case({}, 1)
    drivers = [Driver("liggghts"), Driver("liggghts", approximate=True), Driver("lammps")]
    keys = {Store(tmp_path, ProgramEngine(driver)).key(case) for driver in drivers}
    keys.add(Store(tmp_path, ProgramEngine(Driver("liggghts"), workers=3, time_limit=5.0)).key(case))
    assert len(keys) == 3


REAL = [
    pytest.param(name, marks=pytest.mark.program(program))
    for name, program in {"liggghts": "liggghts", "lammps": "lmp", "yade": "yade"}.items()
]
"""Solvers, each left out where its program is not installed."""


def at_rest(result: CaseResult) -> bool:
    """Return whether no sphere of a heap hangs: each is on the plate or touches another."""
    centers, radii = result.sphere_centers, result.sphere_radii
    gaps = np.linalg.norm(centers[:, None] - centers[None], axis=2) - radii[:, None] - radii[None]
    np.fill_diagonal(gaps, np.inf)
    # A soft contact may be open by what a slow grain crosses in the time between two looks.
    return bool(np.all((gaps.min(axis=1) < 1e-5) | (centers[:, 2] < 1.01 * radii)))


@pytest.mark.parametrize("name", REAL)
def test_the_real_code_ends_in_a_heap_the_same_for_a_seed_and_another_for_another(
    write_study: Write, name: str
) -> None:
    study = study_for(write_study, name)
    heap = simulate_heap(study, {"E": 0.5}, seed=1)
    assert heap.result.status == "finished", heap.reason
    assert len(heap.result.sphere_radii) == 30
    assert at_rest(heap.result)
    assert heap.result.sphere_radii.mean() == pytest.approx(0.002, rel=0.03)
    # The spheres' 5 % spread of 30: a part of 0.01 of their mean.
    again, other = (simulate_heap(study, {"E": 0.5}, seed).result for seed in (1, 2))
    np.testing.assert_array_equal(heap.result.sphere_centers, again.sphere_centers)
    assert heap.result.sphere_centers.tolist() != other.sphere_centers.tolist()
