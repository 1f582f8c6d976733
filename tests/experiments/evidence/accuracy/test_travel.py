"""The proof that a card travels: its cards, its comparison on drawn truth, and that it goes on."""

import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from commandline import install

from experiments.evidence.accuracy.travel import __main__, cards, travel_heaps, travel_page
from experiments.evidence.accuracy.travel import travel_heaps as travel
from experiments.export import Translation
from experiments.io.errors import InputError

PROGRAM = """\
#!{python}
import numpy as np
# a cone of 30 degrees
rng = np.random.default_rng(1)
radius = 0.04 * np.sqrt(rng.random(20000))
turn = 2 * np.pi * rng.random(20000)
height = np.tan(np.radians(30.0)) * (0.04 - radius)
with open("heap.dump", "w") as file:
    print("ITEM: ATOMS id type x y z radius", file=file)
    for i, (x, y, z) in enumerate(zip(radius * np.cos(turn), radius * np.sin(turn), height)):
        print(i + 1, 1, x, y, z, 5e-4, file=file)
"""


def heap(code: str, laws: str, card: str, seed: int, angle: float | None) -> travel_heaps.Heap:
    return travel_heaps.Heap(code, laws, card, seed, angle, 100, 0.01, 1.0, "" if angle else "no heap")


def test_ten_cards_of_one_volume() -> None:
    assert len(cards.CARDS) == len(cards.SHAPES) * len(cards.FRICTIONS) == 10
    for shape in cards.SHAPES.values():
        assert shape.volume == pytest.approx(cards.VOLUME)
    for card in cards.CARDS.values():
        assert len({card.case(code, 1).laws for code in cards.CODES}) == len(cards.CODES)


def test_equal_means_are_equivalent_and_shifted_ones_are_not(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    made = []
    for card, shift in (("sphere-low", 0.0), ("rod-high", 2.0)):
        made += [heap(travel_heaps.OURS, "lammps", card, i, 20.0 + 0.2 * rng.normal()) for i in range(12)]
        made += [heap("lammps", "lammps", card, i, 20.0 + shift + 0.2 * rng.normal()) for i in range(5)]
    # heaps of other laws do not count, nor do those without an angle
    made += [heap(travel_heaps.OURS, "yade", "sphere-low", i, 30.0) for i in range(3)]
    made += [heap("lammps", "lammps", "sphere-low", 9, None)]
    cells = travel_page.compare_cells(made).set_index(["code", "card"])
    tested = cells.loc["lammps"].loc[["sphere-low", "rod-high"]]
    assert list(tested["equivalent"]) == ["yes", "not shown"]
    assert list(tested["n"]) == [5, 5]
    assert tested.loc["rod-high", "difference"] == pytest.approx(-2.0, abs=0.5)
    # one heap is no test, and a code without heaps waits
    made += [heap(travel_heaps.OURS, "yade", "egg-low", i, 12.0) for i in range(3)] + [
        heap("yade", "yade", "egg-low", 1, 12.0)
    ]
    page = travel_page.write_page(made, tmp_path).read_text(encoding="utf-8")
    assert "**1 of 40 cells are shown to be equivalent**, 1 of them with all 5 heaps there." in page
    assert "Tested: 2; too few heaps for a test: 1" in page
    assert "not run: 37." in page
    assert "10 of its 10 cells have not been run" in page
    assert "- lammps sphere-low 9: no heap" in page
    assert len(pd.read_csv(tmp_path / "cells.csv")) == 40


def test_fresh_heaps_alone_decide_a_cell_once_all_are_made() -> None:
    rng = np.random.default_rng(5)

    def heaps(code: str, seeds: tuple[int, ...], mean: float) -> list[travel_heaps.Heap]:
        return [heap(code, "lammps", "rod-high", seed, mean + 0.5 * rng.normal()) for seed in seeds]

    made = heaps(travel_heaps.OURS, cards.SEEDS, 20.0) + heaps("lammps", cards.SEEDS, 21.5)
    fresh = heaps(travel_heaps.OURS, cards.FRESH_SEEDS, 20.0) + heaps("lammps", cards.FRESH_SEEDS, 20.0)
    verdicts = [
        travel_page.compare_cells(found).set_index(["code", "card"])
        for found in (made, made + fresh[:-1], made + fresh)
    ]
    first, begun, ended = (cells.loc["lammps"].loc["rod-high"] for cells in verdicts)
    assert (first["seeds"], first["n"], first["equivalent"]) == ("first", 5, "not shown")
    # heaps that are looked at as they come would find the means equal sooner or later
    assert (begun["seeds"], begun["n"], begun["equivalent"]) == ("first", 5, "not shown")
    assert (ended["seeds"], ended["n"], ended["n_own"], ended["equivalent"]) == ("fresh", 15, 15, "yes")


def test_heaps_of_a_record_are_taken_up(tmp_path: Path) -> None:
    made = [heap("yade", "yade", "egg-low", 1, 12.25), heap("yade", "yade", "egg-low", 2, None)]
    travel_page.write_page(made, tmp_path / "record")
    newer = replace(made[0], angle=13.0)
    newer.write(tmp_path / "out")
    travel_heaps.take_up(tmp_path / "record", tmp_path / "out")
    assert travel_heaps.stored_heaps(tmp_path / "out") == [newer, made[1]]


def test_a_record_gives_its_own_page_again(tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    made = [
        heap(code, "yade", "egg-low", seed, rng.normal(12.0, 0.4))
        for code in (travel_heaps.OURS, "yade")
        for seed in cards.SEEDS
    ]
    for name, source, heaps in (("drawn", None, made), ("committed", __main__.RECORD, [])):
        first, again = tmp_path / name, tmp_path / f"{name}-again"
        if source:
            shutil.copytree(source, first)
        else:
            travel_page.write_page(heaps, first)
        travel_heaps.take_up(first, tmp_path / f"{name}-out")
        shutil.copytree(first, again)
        travel_page.write_page(travel_heaps.stored_heaps(tmp_path / f"{name}-out"), again)
        for file in first.iterdir():
            assert (again / file.name).read_bytes() == file.read_bytes(), file


def test_an_input_is_the_same_whatever_the_processor_rounds() -> None:
    def key(text: str) -> str:
        return travel._input_key(Translation({"lift.in": text}, "lift.in", ("lmp",), "heap.dump", ()))

    expected = key("pour 2000 5255741 0.233711711664793 -2.53984396e-20 1.5e6")
    assert key("# a word\npour 2000 5255741 0.233711711664794 3e-21 1500000.0000000001") == expected
    for other in (
        "2000 5255742 0.233711711664793",
        "2000 5255741 0.2337118",
        "2001 5255741 0.233711711664793",
    ):
        assert key(f"pour {other} -2.53984396e-20 1.5e6") != expected


def test_a_run_is_measured_stored_and_not_repeated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "bin" / "liggghts"
    programs = install(program, PROGRAM.format(python=sys.executable))
    out = tmp_path / "out"
    travel_heaps.run_theirs(out, ["liggghts"], ["sphere-low"], [1, 2], 2, programs)
    stored = travel_heaps.stored_heaps(out)
    assert [found.seed for found in stored] == [1, 2]
    # the flank of a cone; spheres round off its apex and its foot
    assert stored[0].angle == pytest.approx(30.0, abs=1.0)
    program.unlink()
    travel_heaps.run_theirs(out, ["liggghts"], ["sphere-low"], [1, 2], 2, programs)
    assert travel_heaps.stored_heaps(out) == stored
    # a heap of another input is made again, which a missing program cannot do
    replace(stored[0], made_from="other").write(out)
    monkeypatch.setenv("PATH", str(programs))
    with pytest.raises(InputError, match="must be installed, its program on the PATH"):
        travel_heaps.run_theirs(out, ["liggghts"], ["sphere-low"], [1, 2], 1, None)


def test_a_run_without_a_heap_has_a_reason(tmp_path: Path) -> None:
    programs = install(tmp_path / "bin" / "lmp", "#!/bin/sh\necho ERROR: lost\nexit 1\n")
    travel_heaps.run_theirs(tmp_path, ["lammps"], ["rod-low"], [1], 1, programs)
    [found] = travel_heaps.stored_heaps(tmp_path)
    assert found.angle is None
    assert "ERROR: lost" in found.reason
    assert replace(found, reason="") != found
    assert travel.heap_file(tmp_path, "lammps", "lammps", "rod-low", 1).is_file()


def test_a_run_that_somebody_has_ended_is_no_heap_and_no_failure(tmp_path: Path) -> None:
    programs = install(tmp_path / "bin" / "lmp", "#!/bin/sh\nkill -TERM $$\n")
    travel_heaps.run_theirs(tmp_path, ["lammps"], ["rod-low"], [1], 1, programs)
    assert travel_heaps.stored_heaps(tmp_path) == []
