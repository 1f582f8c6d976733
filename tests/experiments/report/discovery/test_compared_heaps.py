"""Heaps side by side: cut out of a photograph, and drawn at one scale."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from dem_warp import CaseResult
from experiments.report.discovery import compared_heaps
from experiments.report.discovery.compared_heaps import photograph, simulated_heaps, turned
from experiments.studyfile import Study, load_study
from imaging import measure, save_picture, snapshot

TRIAL = Path(__file__).parents[4] / "experiments" / "studies" / "trial" / "study.toml"

ROWS, COLUMNS, TABLE = 600, 900, 456
"""Size of a photograph, and the row of its table's edge."""


@pytest.fixture(scope="module")
def trial() -> Study:
    return load_study(TRIAL, "bench")


def taken(result: CaseResult, roll: float = 0.0) -> np.ndarray:
    """Return a photograph: a small heap off the middle, uneven light, a grained table, rolled [deg]."""
    rng = np.random.default_rng(4)
    seen = snapshot(
        result.sphere_centers, result.sphere_radii, pixels=270, backend="raster", grains=result.sphere_grain
    )
    heap = seen.image[: round(seen.ground_row + 0.5)]
    down, across = np.mgrid[0.0 : 1.0 : ROWS * 1j, -1.0 : 1.0 : COLUMNS * 1j, 0:1][:2]
    scene = np.array([188.0, 176.0, 160.0]) * (1.05 - 0.25 * down) * (1.0 + 0.12 * across)
    grain = cv2.GaussianBlur(rng.standard_normal((ROWS - TABLE, COLUMNS)), (0, 0), sigmaX=30.0, sigmaY=2.0)
    table = np.array([128.0, 136.0, 150.0]) * (1.0 + 0.02 * grain / grain.std())[:, :, None]
    scene[TABLE:] = table * (1.0 + 0.1 * across[TABLE:])
    place = np.s_[TABLE - len(heap) : TABLE, 420 : 420 + heap.shape[1]]
    opaque = (np.abs(heap.astype(float) - 255.0).sum(axis=2, keepdims=True) > 6.0).astype(float)
    scene[place] += opaque * (heap * np.array([0.85, 0.95, 1.1]) - scene[place])
    turn = cv2.getRotationMatrix2D((0.5 * COLUMNS, 0.5 * ROWS), roll, 1.0)
    scene = cv2.warpAffine(scene, turn, (COLUMNS, ROWS), borderMode=cv2.BORDER_REPLICATE)
    scene = cv2.GaussianBlur(scene, (0, 0), 1.0) + rng.normal(0.0, 4.0, scene.shape)
    return np.clip(scene, 0.0, 255.0).astype(np.uint8)


def test_a_heap_is_cut_out_of_its_photograph(
    cone: Callable[..., CaseResult], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    image = taken(cone(slope=0.5), roll=-1.5)
    path = save_picture(tmp_path / "DSC_0412.jpg", image)
    shown = photograph(path, "base", "flank")
    assert shown is not None
    assert "DSC_0412.jpg" in shown.caption
    # Next to the heap there are a fifth of its width on either side: it takes 1 / 1.4 of the picture. Of the
    # photograph it takes less than a third.
    heap = np.ptp(measure(image).outline.position)
    assert heap < COLUMNS / 3
    assert shown.image.shape[1] == pytest.approx(1.4 * heap, rel=0.02)
    assert shown.image.shape[0] < shown.image.shape[1]
    # The flanks are drawn on the heap: red crosses the middle columns, where the summit is.
    red = (np.abs(shown.image.astype(int) - [40, 40, 215]).max(axis=2) < 30).any(axis=0)
    assert red[len(red) // 3 : 2 * len(red) // 3].mean() > 0.9
    read = float(shown.caption.partition("°")[0].rpartition(" ")[2])
    # The cone is laid out on a grid of 0.5 mm, and stands on spheres of 0.5 mm, 20 mm about its axis.
    assert read == pytest.approx(np.degrees(np.arctan(0.5)), abs=1.0)
    monkeypatch.setattr(compared_heaps, "WIDEST", 200)
    small = photograph(path, "base", "flank")
    assert small is not None
    assert small.image.shape[1] == 200


def test_a_photograph_without_a_heap_is_left_out(tmp_path: Path) -> None:
    path = save_picture(tmp_path / "empty.png", np.full((90, 120, 3), 200, np.uint8))
    assert photograph(path, "base", "flank") is None


def test_simulated_heaps_share_a_scale_and_a_failed_one_is_left_out(
    cone: Callable[..., CaseResult], trial: Study
) -> None:
    small = cone(slope=0.4, radius=0.5e-3)
    large = replace(small, positions=1.5 * small.positions, clumps=1.5 * small.clumps)
    models = {"small": small, "large": large, "clogged": cone(status="failed", reason="clogged")}
    drawn = simulated_heaps(models, "base", trial)
    assert [picture.title for picture in drawn] == ["small", "large"]
    # Rounded to whole rows.
    np.testing.assert_allclose(drawn[0].image.shape, drawn[1].image.shape, atol=1)
    widths = [np.ptp(measure(picture.image).outline.position) for picture in drawn]
    # The drawn lines widen an outline by some pixels of hundreds.
    assert widths[1] / widths[0] == pytest.approx(1.5, rel=0.05)


def test_a_heap_from_behind_is_the_mirror_image(cone: Callable[..., CaseResult]) -> None:
    heap = cone(slope=0.4)
    # leaning: what is at +x stands higher
    positions = heap.positions + 0.2 * heap.positions[:, :1] * [0.0, 0.0, 1.0]
    leaning = replace(heap, positions=positions)
    behind = turned(leaning, 180.0)
    x, y, z = leaning.sphere_centers.T
    # double precision of centimetres
    np.testing.assert_allclose(behind.sphere_centers, np.column_stack([-x, -y, z]), atol=1e-12)
    along = turned(leaning, 90.0)
    np.testing.assert_allclose(along.sphere_centers, np.column_stack([-y, x, z]), atol=1e-12)
    assert turned(leaning, 0.0) is leaning
