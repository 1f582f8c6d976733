"""Whatever a package from outside returns or raises, the message has its name, a file and a line."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from importlib import import_module
from typing import Any

import pytest
import typer
import warp as wp

from experiments.calibrate.screening_stage import DESIGNS, screening_design
from experiments.cases import OwnWorkers
from experiments.commands.console import clear_errors
from experiments.export import EXPORTERS, ExportedTest, Exporter, case_terms, export_input
from experiments.io import plug_ins
from experiments.io.errors import InputError
from experiments.io.plug_ins import PlugIn
from experiments.report.other_codes import other_codes_chapter
from experiments.runs import examination
from experiments.studyfile import Study
from experiments.studyfile.physics import _check_supply as check_supply

FAULTS = """
import warp as wp
from dem_warp import LiftedCylinder
from dem_warp.laws.jkr import JKR

class Hidden(JKR):
    name = "hidden"

class Vat(LiftedCylinder):
    def volume_below(self, height):
        return float("nan")

@wp.kernel
def wrong(count: int):
    x = count.nothing_here

def raising(*given, **named):
    raise KeyError("license")

def answering(answer):
    return lambda *given, **named: answer
"""


@pytest.fixture(scope="module")
def faults(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Import a package from outside that keeps no rule, with its metadata as installed."""
    site = tmp_path_factory.mktemp("site")
    (site / "grain_faults.py").write_text(FAULTS, encoding="utf-8")
    folder = site / "grain_faults-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: grain-faults\nVersion: 1.0\n")
    (folder / "top_level.txt").write_text("grain_faults\n")
    (folder / "entry_points.txt").write_text(
        "[dem_warp.engines]\nraising = grain_faults:raising\n[dem_warp.laws]\nlost = grain_faults:Lost\n"
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(site))
        _forget()
        yield import_module("grain_faults")
    _forget()


def _forget() -> None:
    plug_ins._folders.cache_clear()
    plug_ins._packages.cache_clear()


def placed(text: str, faults: Any) -> bool:
    """Return whether a message has the package and a line of its file."""
    return "package grain-faults" in text and f"{faults.__file__}, line " in text


def test_an_engine_and_its_results_are_named(
    faults: Any, small_study: Study, cone: Callable[..., Any]
) -> None:
    case = small_study.case({}, 1)

    def reason(engine: Any) -> str:
        return OwnWorkers("cpu").simulate([case], engine)[0].reason

    assert placed(reason(faults.raising), faults)
    nan = replace(cone(), observables={"angle": math.nan, "name": "text"})
    assert reason(faults.answering([nan])).endswith(" returned angle = nan, name = text")
    assert placed(reason(faults.answering([nan])), faults)
    assert "sizes of shape (1,)" in reason(faults.answering([replace(cone(), sizes=cone().sizes[:1])]))
    for answer in (None, [], [{"angle": 30.0}]):
        with pytest.raises(InputError) as error:
            reason(faults.answering(answer))
        assert placed(str(error.value), faults)
    # a call that is refused has no line of the package in its traceback
    strange = type("Strange", (), {"__call__": lambda self: None, "__module__": "grain_faults"})()
    assert "(package grain-faults" in reason(strange)


def test_a_law_that_no_entry_point_announces_is_named(faults: Any, small_study: Study) -> None:
    case = replace(small_study.case({}, 1), mechanisms=(faults.Hidden(),))
    with pytest.raises(InputError, match=r"contact law hidden: .* must be an entry point") as error:
        OwnWorkers("cpu").simulate([case])
    assert placed(str(error.value), faults)


def test_a_scene_without_a_volume_is_named(faults: Any, small_study: Study) -> None:
    case = small_study.case({}, 1)
    vat = faults.Vat(**{part.name: getattr(case.scene, part.name) for part in fields(case.scene)})
    with pytest.raises(ValueError, match="has volume_below = nan: it must be positive") as error:
        check_supply(replace(case, scene=vat))
    assert placed(str(error.value), faults)


def test_the_doctor_finds_an_entry_that_cannot_be_loaded(faults: Any) -> None:
    good, lost = (
        examination._plug_in(PlugIn("grain-faults", "1.0", (f"laws: {name}",))) for name in ("jkr", "lost")
    )
    assert (good.good, good.text, good.cure) == (True, "grain-faults 1.0 (laws: jkr)", "")
    assert not lost.good
    assert "skipped laws: lost, AttributeError" in lost.text
    assert lost.cure.endswith("or uninstall grain-faults.")


def test_an_error_in_a_device_function_names_it(faults: Any) -> None:
    with pytest.raises(Exception, match="nothing_here") as error:
        wp.launch(faults.wrong, 1, [1], device="cpu")
    text = plug_ins.described(error.value)
    assert text.endswith(f"{faults.__file__}, function wrong (package grain-faults)")
    assert "\n" not in text


def test_a_design_is_named(faults: Any, small_study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = small_study.campaign.screening.model_copy(update={"design": "odd"})
    for design in (faults.raising, faults.answering("a table")):
        monkeypatch.setitem(DESIGNS._built_in, "odd", design)
        with pytest.raises(InputError, match=r"campaign\.screening\.design") as error:
            screening_design(small_study.factors, settings)
        assert placed(str(error.value), faults)


def test_an_exporter_is_named_and_loses_no_report(
    faults: Any, small_study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = small_study.case({}, 1)
    test = ExportedTest("small", case, "small.toml")
    for function in (faults.raising, faults.answering("text")):
        exporter = Exporter("Odd", "none", "in all", lambda material: (), function, function)
        monkeypatch.setitem(EXPORTERS._built_in, "odd", exporter)
        for call in (lambda: export_input(test, "odd"), lambda: case_terms("odd", case)):
            with pytest.raises(InputError, match="exporter odd") as error:
                call()
            assert placed(str(error.value), faults)
        assert "Odd" not in str(other_codes_chapter(case))


def test_a_command_prints_the_place_and_no_traceback(faults: Any, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(typer.Exit), clear_errors():
        faults.raising()
    printed = "".join(capsys.readouterr().err.split())
    assert f"{faults.__file__},line".replace(" ", "") in printed
    with pytest.raises(ZeroDivisionError), clear_errors():  # one of ours keeps its traceback
        raise ZeroDivisionError
