"""Folders of runs, as the tests of the pages watch them."""

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from dem_warp import CaseResult
from experiments.calibrate.cases import plan_cases
from experiments.cases import Store
from experiments.io.files import write_text
from experiments.journal.journal import Journal
from experiments.live.server import Place, serving, watch_app
from experiments.studyfile import Study

sys.path.insert(0, str(Path(__file__).parent))

NAME, KEY, OTHER = "a" * 64, "b" * 64, "c" * 64
"""Name of a case that runs; keys of two cases that have been planned."""

Cone = Callable[..., CaseResult]


def begin(folder: Path, study: Study, cone: Cone) -> Journal:
    """Begin a run: two cases planned, one of them ended and stored, a preview of the other."""
    journal = Journal(folder, "calibrate", study, device="cpu").__enter__()
    table = plan_cases(study, "screening", _points(study), 1, study.target.responses)
    journal.planned(table.assign(case_key=[KEY, OTHER]), ["d" * 64, NAME])
    Store(folder / "cases").save(KEY, cone())
    journal.ended(KEY, {"status": "finished", "reason": "", "angle": 26.5, "angle_se": 0.5})
    journal.previews.write(NAME, cone(0.3), {"phase": "lift", "fraction": 0.4})
    write_text(folder / "report.html", "<!doctype html><title>The report</title><script>1</script>")
    write_text(folder / "tables" / "cases.csv", "run\n1\n")
    return journal


def _points(study: Study) -> pd.DataFrame:
    [factor] = study.factors
    return pd.DataFrame({factor.name: [factor.low, factor.high]}, index=[1, 2])


def photograph(slope: float) -> bytes:
    """Draw a heap on a light wall."""
    picture = np.full((300, 600), 230, np.uint8)
    corners = np.array([[120, 250], [480, 250], [300, round(250 - 180 * slope)]], np.int32)
    cv2.fillPoly(picture, [corners], 40)
    picture[250:] = 120
    return bytes(cv2.imencode(".png", picture)[1])


@pytest.fixture
def run_folder(tmp_path: Path) -> Path:
    """Folder of a run that is still to begin."""
    return tmp_path / "out" / "small"


@pytest.fixture
def served() -> Iterator[Callable[[Path], Place]]:
    """Serve the page that watches a folder, until the test ends."""
    with ExitStack() as stack:

        def serve(folder: Path) -> Place:
            place = Place.open()
            stack.enter_context(serving(place, watch_app(folder, place.token)))
            return place

        yield serve
