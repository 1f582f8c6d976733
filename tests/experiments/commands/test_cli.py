"""The command line, run as a person runs it: exit codes, messages, and what is (not) written."""

import json
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import pyvista
from commandline import dem_warp, refused

from experiments import cli, studyfile
from experiments.commands.console import CaseProgress, describe_progress, duration
from imaging import save_picture

WriteStudy = Callable[..., Path]

COMMANDS = [command.callback.__name__ for command in cli.app.registered_commands if command.callback]


def triangle(slope: float = 0.5) -> np.ndarray:
    """Draw a dark heap on white: a triangle of a given slope."""
    rows, columns = np.mgrid[0:180, 0:480]
    inside = (144 - rows) < slope * (180 - np.abs(columns - 240))
    return np.where(inside & (rows < 144), 40, 255).astype(np.uint8)


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself_with_an_example(command: str) -> None:
    code, out, _ = dem_warp(command, "--help")
    assert code == 0
    assert f"Example: dem-warp {command}" in " ".join(out.split())


def test_an_interruption_says_how_to_go_on(write_study: WriteStudy, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("experiments.runs.calibration.run_campaign", interrupt)
    path = write_study()
    options = ("--out", "my results", "--scale", "stiff", "--device", "cpu", "--workers", 2)
    code, _, err = dem_warp("calibrate", path, *options, "--json")
    assert code == 130
    written = f"dem-warp calibrate {path} --out 'my results' --scale stiff --device cpu --workers 2 --json"
    assert f"Interrupted. Resume with: {written} --resume" in err


def test_a_small_real_heap_is_simulated_and_written(write_study: WriteStudy) -> None:
    path = write_study()
    words = ("heap", path, "--set", "E=0.5", "--seed", 3, "--device", "cpu", "--json", "--out", "one")
    code, out, _ = dem_warp(*words)
    assert code == 0
    heap = json.loads(out)
    assert heap == json.loads(Path("one/angle.json").read_text(encoding="utf-8"))
    assert (heap["settings"], heap["seed"], heap["status"]) == ({"E": 0.5}, 3, "finished")
    assert heap["provenance"]["study"] == studyfile.load_study(path).sha256
    assert heap["observables"]["grain_count"] == 30
    views = [0.5 * (view["left"] + view["right"]) for view in heap["views"]]
    assert heap["angle"]["mean"] == pytest.approx(np.mean(views), rel=1e-12)
    spheres = pyvista.read("one/heap.vtp")
    assert spheres.n_points == 30
    # Every sphere rests on the plate or on others: Hertz overlaps are far below a tenth of a radius.
    assert (spheres.points[:, 2] > 0.9 * spheres["radius"]).all()
    assert Path("one/snapshot.png").stat().st_size > 1000


def test_a_heap_of_two_shapes_is_simulated_and_written(write_study: WriteStudy) -> None:
    shapes = (
        '[grain.shapes.large]\nsphere = "2 mm"\n[grain.shapes.small]\nsphere = "1.5 mm"\nfraction = 0.4\n\n'
    )
    path = write_study(('sphere = "2 mm"\n', ""), ("[wall]", f"{shapes}[wall]"))
    code, out, _ = dem_warp("heap", path, "--device", "cpu", "--json", "--out", "one")
    assert (code, json.loads(out)["status"]) == (0, "finished")
    spheres = pyvista.read("one/heap.vtp")
    assert spheres.n_points == 30
    counts = np.bincount(spheres["shape"])
    # Binomial: four standard deviations about 12 of 30.
    assert counts[1] == pytest.approx(12, abs=4.0 * np.sqrt(30 * 0.4 * 0.6))
    for shape, radius in enumerate((2e-3, 1.5e-3)):
        # Sizes lie within three standard deviations of 5 %.
        np.testing.assert_allclose(spheres["radius"][spheres["shape"] == shape], radius, rtol=0.15)
    assert Path("one/snapshot.png").stat().st_size > 1000


def test_photographs_become_angles_and_overlays() -> None:
    save_picture("a.png", triangle(0.5))
    save_picture("b.png", triangle(0.3))
    code, out, _ = dem_warp("angle", "a.png", "b.png", "--json", "--overlay", "drawn")
    assert code == 0
    angles = [row["mean"] for row in json.loads(out)["pictures"]]
    assert json.loads(dem_warp("angle", "[ab].png", "--json")[1])["pictures"] == [
        row | {"overlay": None} for row in json.loads(out)["pictures"]
    ]
    # The smooth-heap tolerance of `imaging` at this width.
    assert angles == pytest.approx(np.degrees(np.arctan([0.5, 0.3])), abs=0.3)
    assert sorted(path.name for path in Path("drawn").iterdir()) == ["a-angle.png", "b-angle.png"]
    code, out, _ = dem_warp("angle", "a.png")
    assert code == 0
    assert f"{angles[0]:.2f}" in out


def test_a_photograph_without_a_heap_ends_with_2() -> None:
    save_picture("empty.png", np.full((300, 800), 255, dtype=np.uint8))
    assert "empty.png" in refused("angle", "empty.png", "--overlay", "drawn")
    assert not Path("drawn").exists()


def test_one_bad_photograph_does_not_hide_the_others() -> None:
    save_picture("a.png", triangle())
    code, out, err = dem_warp("angle", "a.png", "absent.png", "--json")
    assert code == 2
    assert [row["mean"] is None for row in json.loads(out)["pictures"]] == [False, True]
    assert "absent.png" in err


def test_photographs_become_a_target() -> None:
    for name, slope in (("a", 0.5), ("b", 0.52), ("c", 0.54)):
        save_picture(f"{name}.png", triangle(slope))
    code, out, _ = dem_warp("angle", "a.png", "b.png", "c.png", "--target")
    assert code == 0
    section = tomllib.loads(out)["target"]
    truth = np.degrees(np.arctan([0.5, 0.52, 0.54]))
    # Three angles, each within the smooth-heap tolerance.
    assert float(section["mean"].split()[0]) == pytest.approx(truth.mean(), abs=0.3)
    assert float(section["sd"].split()[0]) == pytest.approx(truth.std(ddof=1), abs=0.3)
    assert section["n"] == 3
    assert "two measured heaps" in refused("angle", "a.png", "--target")
    code, out, _ = dem_warp("angle", "a.png", "b.png", "--csv")
    assert (code, len(out.splitlines())) == (0, 3)


def test_a_photograph_given_twice_has_its_rows_and_is_no_target() -> None:
    Path("views").mkdir()
    for name in ("a.png", "views/a.png", "views/b.png"):
        save_picture(name, triangle(0.5))
    save_picture("c.png", triangle(0.54))
    code, out, _ = dem_warp("angle", "a.png", "views/a.png", "--csv")
    assert (code, len(out.splitlines())) == (0, 3)
    err = refused("angle", "a.png", "c.png", "views/a.png", "--target")
    assert "a.png (--target: picture 1)" in err
    assert "--target: picture 3" in err
    # Views of one heap are no repeats.
    code, _, _ = dem_warp("angle", "c.png", "views/a.png", "views/b.png", "--by", "folder", "--target")
    assert code == 0


def test_a_clump_is_made_written_and_described() -> None:
    solid = ("clump", "ellipsoid:6x3x3", "--spheres", 3, "--density", "1000 kg/m^3", "--json")
    code, out, _ = dem_warp(*solid, "--out", "grain.txt")
    assert code == 0
    fitted = json.loads(out)
    assert len(fitted["spheres_mm"]) == 3
    # Water: a milligram a cubic millimetre.
    assert fitted["mass_mg"] == pytest.approx(fitted["volume_mm3"], rel=1e-12)
    assert 0.5 < fitted["coverage"] < 1.0
    code, out, _ = dem_warp("clump", "grain.txt", "--json")
    # The file holds nine decimals of a millimetre.
    assert json.loads(out)["volume_mm3"] == pytest.approx(fitted["volume_mm3"], rel=1e-7)
    assert dem_warp(*solid, "--out", "grain.txt")[0] == 2


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.4, "0 s"), (59.4, "59 s"), (80.0, "1 min 20 s"), (7500.0, "2 h 5 min")]
)
def test_times_read_well(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_progress_tells_the_time_left(capsys: pytest.CaptureFixture[str]) -> None:
    from dem_warp import Progress

    halfway = Progress(done=3, total=12, fraction=0.25, phase_counts={"lift": 2, "waiting": 7}, seconds=20.0)
    assert describe_progress(halfway) == "1 min 0 s left, 3 of 12 cases, 2 lift"
    # An earlier run had done a fifth: this one did a twentieth in its 20 s.
    taken_up = Progress(done=0, total=12, fraction=0.2, phase_counts={}, seconds=0.0)
    assert describe_progress(halfway, taken_up).startswith("5 min 0 s left")
    with CaseProgress("climb") as show:
        show(start := Progress(0, 12, 0.01, {}, 1.0))
        show(halfway)
        show(Progress(3, 12, 0.26, {}, 21.0))
    # Without a terminal: nothing in the first two seconds, then a line every ten.
    assert capsys.readouterr().err.split() == f"climb: 25 %, {describe_progress(halfway, start)}".split()
