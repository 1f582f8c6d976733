"""Measure photograph-like pictures with and without heaps, and write how well it went.

    python -m experiments.evidence.accuracy.photographs.photographs_record --first 100000 --out record

Seeds below 1000, 800000 to 800299 and those of earlier series were used while the rules were made; figures
are for others. What a person notes in `notes.md` of the record's folder stands on its page.
"""

import argparse
import csv
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from experiments.evidence.accuracy.photographs.sampling import (
    Photograph,
    photograph,
    photograph_in_hard_light,
)
from experiments.evidence.accuracy.photographs.without import picture_without_heap
from imaging import PictureError, ReposeAngle, View, measure, overlay, read_picture, save_picture
from imaging.geometry import Picture

COLUMNS = (
    "kind", "seed", "outcome", "truth", "mean", "error", "se", "covered", "elevation", "seen_elevation",
    "distance", "shadow", "why",
)  # fmt: skip
TILE, TILES_ACROSS, SHEET_TILES = (300, 220), 6, 12
Row = dict[str, Any]
Task = tuple[Callable[[Any], tuple[Row, Picture]], Any]
"""Function that measures one picture, and the seed or the file of the picture."""


def measured(picture: Picture, view: View | None = None) -> tuple[str, ReposeAngle | None, str]:
    """Outcome (measured, marked or refused), the angle, and why it is not simply measured."""
    try:
        angle = measure(picture, view=view)
    except PictureError as error:
        return "refused", None, f"{error.problem}, got {error.value}"
    if angle.doubts:
        return "marked", angle, ", ".join(doubt.name for doubt in angle.doubts)
    return "measured", angle, ""


def with_heap(seed: int) -> tuple[Row, Picture]:
    """Row of a photograph of a heap, with what is to be shown of it."""
    return row_of(photograph(seed), seed)


def in_hard_light(seed: int) -> tuple[Row, Picture]:
    """Return the same for a heap that throws a sharp shadow on the wall next to it."""
    return row_of(photograph_in_hard_light(seed), seed)


def row_of(shot: Photograph, seed: int, view: View | None = None) -> tuple[Row, Picture]:
    """Row of a photograph, and the picture with what was seen in it."""
    outcome, angle, why = measured(shot.picture, view)
    row: Row = {
        "kind": shot.setting,
        "seed": seed,
        "outcome": outcome,
        "truth": shot.truth.mean,
        "why": why,
        "elevation": shot.camera.elevation,
        "distance": 0.5 * shot.camera.distance,
        "shadow": shot.shadow,
    }
    if angle is None:
        return row, shot.picture
    low, high = angle.interval()
    row |= {"mean": angle.mean, "error": angle.mean - shot.truth.mean, "se": angle.se}
    row |= {"covered": low <= shot.truth.mean <= high, "seen_elevation": angle.outline.elevation}
    return row, overlay(shot.picture, angle)


def without_heap(source: int | Path) -> tuple[Row, Picture]:
    """Row of a drawn picture without a heap, by its seed, or of one in a file."""
    if isinstance(source, Path):
        seed, kind, picture = "", source.name, read_picture(source)
    else:
        seed, (kind, picture) = str(source), picture_without_heap(source)
    outcome, angle, why = measured(picture)
    row: Row = {"kind": kind, "seed": seed, "outcome": outcome, "why": why}
    if angle is not None:
        row |= {"mean": angle.mean, "se": angle.se}
    return row, picture


def small_copy(picture: Picture) -> Picture:
    """Copy of a picture that fits into a tile."""
    scale = min(TILE[0] / picture.shape[1], TILE[1] / picture.shape[0])
    copy = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return np.asarray(copy, dtype=np.uint8)


def one(task: Task) -> tuple[Row, Picture]:
    """Row and small copy of one picture."""
    make, source = task
    cv2.setNumThreads(1)
    row, picture = make(source)
    return row, small_copy(picture)


def contact_sheet(tiles: list[tuple[str, Picture]]) -> Picture:
    """Lay small copies side by side, each with its caption."""
    small = []
    for caption, copy in tiles:
        page = np.full((TILE[1] + 20, TILE[0] + 6, 3), 255, np.uint8)
        page[20 : 20 + copy.shape[0], : copy.shape[1]] = copy
        cv2.putText(page, caption, (3, 14), cv2.FONT_HERSHEY_SIMPLEX, 0.42, (0, 0, 0), 1, cv2.LINE_AA)
        small.append(page)
    small += [np.full_like(small[0], 255)] * (-len(small) % TILES_ACROSS)
    rows = [np.hstack(small[i : i + TILES_ACROSS]) for i in range(0, len(small), TILES_ACROSS)]
    return np.asarray(np.vstack(rows), dtype=np.uint8)


def summary(heaps: list[Row], others: list[Row], hard: list[Row]) -> str:
    """Return the figures, as lines of Markdown."""
    silent = Counter(row["outcome"] for row in others)
    table = {f"pictures of heaps{name}": value for name, value in figures(heaps).items()}
    table["pictures without a heap"] = len(others)
    counts = ", ".join(str(silent[outcome]) for outcome in ("refused", "marked", "measured"))
    table["of these refused, marked, measured"] = counts
    if hard:
        table |= {
            f"heaps with a sharp shadow on the wall{name}": value for name, value in figures(hard).items()
        }
    lines = [f"| {name} | {value} |" for name, value in table.items()]
    return "\n".join(["| | |", "|---|---|", *lines])


def figures(heaps: list[Row]) -> dict[str, Any]:
    """Say how well photographs of heaps were measured."""
    clear = [row for row in heaps if row["outcome"] == "measured"]
    errors = np.abs([row["error"] for row in clear])
    marked = [abs(row["error"]) for row in heaps if row["outcome"] == "marked"]
    count = Counter(row["outcome"] for row in heaps)
    quantiles = f"{np.median(errors):.2f}, {np.quantile(errors, 0.95):.2f}, {errors.max():.2f}"
    outcomes = f"{count['measured']}, {count['marked']}, {count['refused']}"
    far = f"{len(marked)}, {int((np.array(marked) > 1.0).sum())}"
    held = 100.0 * np.mean([row["covered"] for row in clear])
    return {
        "": len(heaps),
        ": measured, marked as doubtful, refused": outcomes,
        ": error of the measured: median, 95th percentile, greatest [degrees]": quantiles,
        ": measured and wrong by more than 2 degrees": int((errors > 2.0).sum()),
        ": marked, of these wrong by more than 1 degree": far,
        ": 95 % intervals that hold the truth [%]": f"{held:.1f}",
    }


def main() -> None:
    """Run the benchmark as a command."""
    parser = argparse.ArgumentParser(description="Measure photograph-like pictures with and without heaps.")
    parser.add_argument("--first", type=int, default=100_000, help="first seed")
    parser.add_argument("--heaps", type=int, default=500)
    parser.add_argument("--others", type=int, default=200)
    parser.add_argument("--hard", type=int, default=60, help="heaps with a sharp shadow on the wall")
    parser.add_argument("--folder", type=Path, help="more pictures without a heap")
    parser.add_argument("--workers", type=int, help="processes; left out: one a core")
    parser.add_argument("--out", type=Path, required=True)
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    found = sorted(chosen.folder.iterdir()) if chosen.folder else []
    seeds = range(chosen.first, chosen.first + max(chosen.heaps, chosen.others, chosen.hard))
    tasks: dict[str, list[Task]] = {
        "heaps": [(with_heap, seed) for seed in seeds[: chosen.heaps]],
        "others": [(without_heap, source) for source in (*seeds[: chosen.others], *found)],
        "hard": [(in_hard_light, seed) for seed in seeds[: chosen.hard]],
    }
    with ProcessPoolExecutor(chosen.workers) as pool:
        seen = {name: list(pool.map(one, each, chunksize=4)) for name, each in tasks.items()}
    for name, pairs in seen.items():
        if pairs:
            write(chosen.out, name, pairs)
    table = summary(*([row for row, _ in pairs] for pairs in seen.values()))
    (chosen.out / "README.md").write_text(page(table, chosen), encoding="utf-8")
    print(table)


def write(folder: Path, name: str, pairs: list[tuple[Row, Picture]]) -> None:
    """Write the rows as a table, and some of the pictures as a contact sheet."""
    tiles = []
    for row, copy in pairs[:: max(1, len(pairs) // SHEET_TILES)][:SHEET_TILES]:
        error = f" {row['mean']:.1f} ({row['truth']:.1f})" if "error" in row else ""
        tiles.append((f"{row['kind']} {row['seed']}: {row['outcome']}{error}", copy))
    save_picture(folder / f"{name}.jpg", contact_sheet(tiles))
    with (folder / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: _short(value) for key, value in row.items()} for row, _ in pairs)


def page(table: str, chosen: argparse.Namespace) -> str:
    """Page of a record, with the notes that its folder has."""
    command = f"--first {chosen.first} --heaps {chosen.heaps} --others {chosen.others} --hard {chosen.hard}"
    file = chosen.out / "notes.md"
    notes = f"\n{file.read_text(encoding='utf-8')}" if file.exists() else ""
    return f"""# Photograph-like pictures, measured

    python -m experiments.evidence.accuracy.photographs.photographs_record {command} --out RECORD

{table}

Seeds below 1000, 800000 to 800299 and those of earlier series were used while the rules were made; these
are others. A *marked* angle is shown with its doubt and left out of a mean. Every picture has a row in
`heaps.csv`, `others.csv` or `hard.csv`.

![Some of the heaps; in brackets the true angle](heaps.jpg)

![Some of the pictures without a heap](others.jpg)

![Some of the heaps in hard light](hard.jpg)
{notes}"""


def _short(value: Any) -> Any:
    return f"{value:.4g}" if isinstance(value, float) else value


if __name__ == "__main__":
    main()
