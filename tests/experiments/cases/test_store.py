"""The store and the output folder: nothing half-written is read, nothing overwritten, changes are named."""

import dataclasses
import errno
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dem_warp import Case, CaseResult, ClumpShape
from dem_warp.population import ShapeMixture
from experiments.cases import Store, open_folder
from experiments.cases.engines import key as key_module
from experiments.io.errors import StoreError
from experiments.io.files import replacing
from experiments.studyfile import Study, load_study

Cone = Callable[..., CaseResult]
WriteStudy = Callable[..., Path]


def files_of(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*") if path.is_file())


def test_a_result_comes_back_bit_for_bit(tmp_path: Path, cone: Cone) -> None:
    store, result = Store(tmp_path), cone(status="diverged", reason="too fast")
    store.save("k", result)
    loaded = store.load("k")
    for field in dataclasses.fields(CaseResult):
        before, after = getattr(result, field.name), getattr(loaded, field.name)
        if isinstance(before, np.ndarray):
            assert before.dtype == after.dtype
            assert before.tobytes() == after.tobytes()
        else:
            assert before == after
    assert store.has("k")


def test_what_determines_a_case_makes_its_key(
    tmp_path: Path, small_study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    def key(friction: float = 0.3, seed: int = 1, folder: str = "here") -> str:
        return Store(tmp_path / folder).key(small_study.case({"E": friction}, seed))

    assert key() == key(folder="elsewhere")
    others = {key(), key(seed=2), key(0.31), key(0.2)}
    monkeypatch.setattr(key_module, "engine_fingerprint", lambda *_: "another")
    assert len({*others, key()}) == 5


def with_moved_spheres(case: Case, shape: ClumpShape, move: Callable[[float], float]) -> Case:
    """Move the coordinates and radii of the spheres of the case's grains."""
    moved = dataclasses.replace(
        shape, centers=np.vectorize(move)(shape.centers), radii=np.vectorize(move)(shape.radii)
    )
    return dataclasses.replace(case, grains=dataclasses.replace(case.grains, shape=moved))


TRIPLET = ClumpShape.from_spheres([[0, 0, 0], [1.3e-3, 0, 0], [0.5e-3, 0.8e-3, 0]], [1e-3, 0.9e-3, 0.8e-3])


def test_another_size_makes_another_key_and_last_bits_do_not(tmp_path: Path, small_study: Study) -> None:
    store, case = Store(tmp_path), small_study.case({}, seed=1)
    exact = with_moved_spheres(case, TRIPLET, lambda x: x)
    last_bit = with_moved_spheres(case, TRIPLET, lambda x: np.nextafter(x, np.inf))
    assert exact.grains.shape != last_bit.grains.shape
    assert store.key(exact) == store.key(last_bit)
    larger = with_moved_spheres(case, TRIPLET, lambda x: (1.0 + 1e-9) * x)
    assert store.key(exact) != store.key(larger)


def test_a_sphere_moved_by_a_billionth_makes_another_key(tmp_path: Path, small_study: Study) -> None:
    store, case = Store(tmp_path), small_study.case({}, seed=1)
    centers = TRIPLET.centers.copy()
    centers[1, 1] += 1e-9 * TRIPLET.bounding_radius
    moved = dataclasses.replace(TRIPLET, centers=centers)
    keys = [
        store.key(dataclasses.replace(case, grains=dataclasses.replace(case.grains, shape=shape)))
        for shape in (TRIPLET, moved, ShapeMixture((TRIPLET, moved), (0.5, 0.5)))
    ]
    assert len(set(keys)) == 3


def test_an_absent_case_is_absent(tmp_path: Path) -> None:
    store = Store(tmp_path / "new")
    assert not store.has("k")
    assert store.damage("k") is None
    with pytest.raises(StoreError, match="this stored case was removed"):
        store.load("k")
    assert not store.folder.exists()


def flipped(data: bytes) -> bytes:
    changed = bytearray(data)
    changed[len(data) // 2] ^= 1
    return bytes(changed)


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda data: b"",
    "half": lambda data: data[: len(data) // 2],
    "all but the end": lambda data: data[: int(0.999 * len(data))],
    "a flipped bit": flipped,
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_named_and_not_read(tmp_path: Path, cone: Cone, damage: str) -> None:
    store = Store(tmp_path)
    store.save("k", cone())
    store.path("k").write_bytes(DAMAGES[damage](store.path("k").read_bytes()))
    assert not store.has("k")
    assert str(store.path("k")) in (store.damage("k") or "")
    with pytest.raises(StoreError):
        store.load("k")


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_has_finished_has_finite_places(tmp_path: Path, cone: Cone, value: float) -> None:
    store = Store(tmp_path)
    whole = cone()
    positions = whole.positions.copy()
    positions[0, 2] = value
    store.save("k", dataclasses.replace(whole, positions=positions))
    assert "not finite" in (store.damage("k") or "")
    diverged = dataclasses.replace(whole, positions=positions, status="diverged", reason="too fast")
    store.save("k", diverged)
    assert store.has("k")


def test_a_file_under_another_cases_name_is_not_read(tmp_path: Path, cone: Cone) -> None:
    store = Store(tmp_path)
    store.save("k", cone())
    store.path("k").rename(store.path("other"))
    assert not store.has("other")


def test_an_interrupted_write_leaves_the_older_file(tmp_path: Path) -> None:
    path = tmp_path / "value.txt"
    path.write_text("old", encoding="utf-8")

    def write_half() -> None:
        with replacing(path) as temporary:
            temporary.write_text("half", encoding="utf-8")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_half()
    assert path.read_text(encoding="utf-8") == "old"
    assert files_of(tmp_path) == ["value.txt"]


def test_the_error_of_a_full_disk_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "value.txt"

    def write_half() -> None:
        with replacing(path):
            raise OSError(errno.ENOSPC, "No space left on device")

    with pytest.raises(OSError, match="No space left") as caught:
        write_half()
    assert caught.value.filename == str(path)


def test_a_used_folder_is_refused_untouched(tmp_path: Path, small_study: Study) -> None:
    (tmp_path / "mine.txt").write_text("mine", encoding="utf-8")
    before = files_of(tmp_path)
    with pytest.raises(StoreError, match="the folder is not empty"):
        open_folder(tmp_path, small_study)
    with pytest.raises(StoreError, match=r"study\.json"):
        open_folder(tmp_path, small_study, resume=True)
    assert files_of(tmp_path) == before


def test_a_folder_is_resumed_by_the_same_study(tmp_path: Path, small_study: Study) -> None:
    for resume in (False, True):
        assert open_folder(tmp_path / "out", small_study, resume)[1] == []


def test_a_changed_study_is_noticed_and_every_change_named(tmp_path: Path, write_study: WriteStudy) -> None:
    folder = tmp_path / "out"
    open_folder(folder, load_study(write_study()))
    changed = write_study(
        ("n = 5", "n = 6"), ("low = 0.2", "low = 0.3"), add="[campaign.screening]\nruns = 12\n"
    )
    _, changes = open_folder(folder, load_study(changed, "stiff"), resume=True)
    assert sorted(changes) == [
        'scale: not given -> "stiff"',
        'study.campaign: not given -> {"screening": {"runs": 12}}',
        "study.factor[1].low: 0.2 -> 0.3",
        "study.numerics.modulus_scale: 400.0 -> 1.0",
        "study.target.n: 5 -> 6",
    ]


def test_a_changed_clump_of_several_is_noticed(tmp_path: Path, write_study: WriteStudy) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.txt").write_text("0 0 0 1\n", encoding="utf-8")
    shapes = '[grain.shapes.a]\nclump = "a.txt"\n[grain.shapes.b]\nclump = "b.txt"\nfraction = 0.4\n'
    path = write_study(('sphere = "2 mm"\n', ""), ("[wall]", f"{shapes}[wall]"))
    open_folder(tmp_path / "out", load_study(path))
    (tmp_path / "b.txt").write_text("0 0 0 1.5\n", encoding="utf-8")
    [change] = open_folder(tmp_path / "out", load_study(path), resume=True)[1]
    assert change.startswith("clump_sha256[2]")
