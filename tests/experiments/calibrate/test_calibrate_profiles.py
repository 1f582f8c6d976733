"""Campaigns on whole profiles: analytic heaps whose outlines are known, measured or of hidden settings."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from small_study import ANGLE

from experiments.calibrate import Campaign, Outcome, calibrate
from experiments.measurement.profile_responses import with_profiles
from experiments.studyfile import Study, load_study
from experiments.studyfile.observables import OUTLINE
from imaging.flank.heap_shape import STATIONS, profile_heights

ROLLING = """
[[factor]]
name = "G"
label = "rolling friction"
parameter = "contact.grain-grain.rolling_friction"
low = 0.05
high = 0.15
"""
CAMPAIGN = """
[campaign.surface]
half_range = { E = 0.1, G = 0.03 }
center = { E = 0.42, G = 0.1 }

[campaign.selection]
keep = ["E", "G"]
"""
TWIN = '[target]\nobservable = "outline"\n[target.twin]\ntruth = { E = 0.45, G = 0.11 }\nreplicates = 8\n'
TRUTH = {"E": 0.45, "G": 0.11}


def outline(slope: float, bend: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Heap of one volume [m]: its slope, how hollow its flanks are, and neighbours that scatter together."""
    x = np.linspace(-0.03, 0.03, 601)
    away = np.abs(x) / 0.02
    z = 0.01 * slope * np.maximum(1.0 - slope**0.5 * away, 0.0) ** (1.0 + bend)
    places = np.arange(0.0, 1.2, 0.15)
    bumps = np.exp(-0.5 * ((away[:, None] - places) / 0.15) ** 2) @ rng.normal(size=len(places))
    return x, np.where(z > 0.0, np.maximum(z + 5e-5 * bumps, 0.0), 0.0)


def heap(row: Mapping[str, float], rng: np.random.Generator) -> np.ndarray:
    """Heights at the stations: friction steepens the heap, rolling friction steepens and fills it."""
    x, z = outline(0.6 + row["E"] + 2.0 * row["G"], 1.0 - 6.0 * row["G"], rng)
    return profile_heights(x, z)


class Heaps:
    """A runner of analytic heaps; their angle is the slope of a line through the flank."""

    def __call__(self, table: pd.DataFrame) -> pd.DataFrame:
        rows = []
        for row in table.to_dict("records"):
            heights = heap(row, np.random.default_rng(int(row["seed"])))
            found = dict(zip((each.name for each in OUTLINE), heights, strict=True))
            rows.append(found | {"status": "finished", "reason": "", "angle": 30.0, "angle_se": 0.1})
        found_all = pd.DataFrame(rows, index=table.index)
        return table.assign(grain_count=100.0, simulated_time=1.0).assign(**found_all)


@pytest.fixture
def write(write_study: Callable[..., Path]) -> Callable[[str], Study]:
    """Write a study of two factors with a target."""
    fixed = "restitution = 0.2\nrolling_friction = 0.05\n"
    changes = (fixed, "restitution = 0.2\n")
    return lambda target: load_study(write_study(changes, (ANGLE, target), add=ROLLING + CAMPAIGN))


def measured(folder: Path, count: int) -> None:
    lines = ["replicate,view,x,z"]
    for number in range(count):
        rng = np.random.default_rng(900 + number)
        for view in "ab":
            x, z = outline(0.6 + TRUTH["E"] + 2.0 * TRUTH["G"], 1.0 - 6.0 * TRUTH["G"], rng)
            lines += [f"{number},{view},{1e3 * a:.3f} mm,{1e3 * b:.5f} mm" for a, b in zip(x, z, strict=True)]
    (folder / "outlines.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def check(campaign: Campaign) -> None:
    assert campaign.outcome in (Outcome.CALIBRATED, Outcome.UNDECIDED), campaign.reason
    names = ["outline_direction_1", "outline_direction_2"]
    assert [response.name for response in campaign.responses] == names
    joint = campaign.optimum.joint
    assert joint.agrees(TRUTH)
    # Two directions of one outline leave neither factor open.
    assert campaign.optimum.unidentified == ()
    assert campaign.optimum.point == pytest.approx(TRUTH, abs=0.03)
    assert set(names) <= set(campaign.cases.columns)


def test_measured_outlines_calibrate_what_an_angle_leaves_open(
    write: Callable[[str], Study], tmp_path: Path
) -> None:
    study = write('[target]\nobservable = "outline"\nprofiles = "outlines.csv"\nnote = "eight heaps"\n')
    measured(tmp_path, 8)
    ready = with_profiles(study)
    assert ready.measurement.outline
    assert len(ready.target.responses) == len(STATIONS)
    check(calibrate(ready, Heaps()))


def test_a_twin_of_outlines_finds_its_hidden_settings(write: Callable[[str], Study]) -> None:
    campaign = calibrate(with_profiles(write(TWIN)), Heaps())
    check(campaign)
    assert campaign.optimum.truth.compatible
    assert all(sample.n == 8 for sample in campaign.target.responses.values())
