"""Previews of running cases: they change no bit, take hardly any time, and are read with care."""

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dem_warp import CaseResult, simulate
from experiments.journal import previews as module
from experiments.journal.previews import KEPT, SHARE, Previews, prune, read_preview, spheres_of
from experiments.studyfile import Study


def test_a_case_that_is_looked_at_ends_in_the_same_bits(
    small_study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = small_study.case({}, seed=3)
    [alone] = simulate([case], device="cpu", workers=1)
    monkeypatch.setattr(module, "EVERY", 0.0)
    monkeypatch.setattr(module, "SHARE", 1e9)
    seen: list[float] = []
    looking = Previews(tmp_path)

    def look(batch) -> None:  # type: ignore[no-untyped-def]
        looking(batch)
        for path in tmp_path.glob("*.npz"):
            spheres, facts = read_preview(path)
            assert len(spheres) <= 30
            seen.append(facts["fraction"])

    [watched] = simulate([case], device="cpu", workers=1, on_advance=look)
    assert len(seen) > 10
    assert seen == sorted(seen)
    for name in ("positions", "orientations", "sizes", "shapes"):
        assert np.array_equal(getattr(watched, name), getattr(alone, name)), name
    assert watched.observables == alone.observables
    assert watched.phases == alone.phases


class Batch:
    """Stands in for a batch of one world, and looks at nothing."""

    running = (0,)


def test_previews_take_a_small_part_of_the_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """However slow the disk: on a clock of its own, a preview takes 0.3 s, and steps a millisecond."""
    now = [0.0]
    clock = SimpleNamespace(monotonic=lambda: now[0], perf_counter=lambda: now[0])
    monkeypatch.setattr(module, "time", clock)

    def slow(self: Previews, batch: object) -> None:
        now[0] += 0.3

    monkeypatch.setattr(Previews, "_take", slow)
    looking = Previews(tmp_path)
    while now[0] < 1000.0:
        now[0] += 0.001
        looking(Batch())  # type: ignore[arg-type]
    assert 0.0 < looking.spent / now[0] <= SHARE + 0.3 / 1000.0


def test_a_preview_holds_the_spheres_as_they_lie(cone: Callable[..., CaseResult], tmp_path: Path) -> None:
    Previews(tmp_path).write("a", cone(), {"phase": "lift", "fraction": 0.25})
    spheres, facts = read_preview(tmp_path / "a.npz")
    assert np.array_equal(spheres, spheres_of(cone()))
    assert facts == {"phase": "lift", "fraction": 0.25}
    assert [path.name for path in tmp_path.iterdir()] == ["a.npz"]


RECORD = b'{"phase": "a", "fraction": 0}'


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        (b"", "archive of arrays"),
        (b"PK", "archive of arrays"),
        (b"no archive", "archive of arrays"),
        ({"spheres": np.zeros((2, 5), "<f4")}, "must be a preview"),
        ({"spheres": np.zeros((2, 4), "<f4"), "record": RECORD}, "five float32"),
        ({"spheres": np.full((2, 5), np.nan, "<f4"), "record": RECORD}, "finite"),
        ({"spheres": np.zeros((2, 5), "<f4"), "record": RECORD.replace(b"0", b'"x"')}, "preview"),
    ],
)
def test_another_file_is_refused(tmp_path: Path, content: bytes | dict, rule: str) -> None:
    if isinstance(content, bytes):
        (tmp_path / "a.npz").write_bytes(content)
    else:
        record = {"record": np.frombuffer(content["record"], np.uint8)} if "record" in content else {}
        np.savez(tmp_path / "a.npz", **content | record)
    with pytest.raises(ValueError, match=rule):
        read_preview(tmp_path / "a.npz")


def test_few_previews_stay(cone: Callable[..., CaseResult], tmp_path: Path) -> None:
    for number in range(KEPT + 5):
        Previews(tmp_path).write(f"{number}", cone(), {"phase": "lift", "fraction": 0.5})
    prune(tmp_path)
    assert len(list(tmp_path.iterdir())) == KEPT
