"""Read drawn drums, and write how well it went.

python -m experiments.evidence.accuracy.drums --out record
"""

import argparse
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd

from experiments.evidence.accuracy.drums.drawn_drums import MILLIMETRES, draw
from experiments.evidence.accuracy.photographs.photographs_record import contact_sheet, small_copy
from experiments.evidence.machine import machine
from experiments.evidence.record_page import markdown_table, write_page
from imaging import PictureError, overlay_drum, read_drum, save_picture


def row_of(seed: int) -> tuple[dict[str, object], np.ndarray]:
    """Row of a drawn drum, and the picture with what was read."""
    drawn = draw(seed)
    picture = np.ascontiguousarray(drawn.picture[:, :, ::-1])
    row: dict[str, object] = {"seed": seed, "kind": drawn.kind, "angle": drawn.angle, "outcome": "refused"}
    try:
        found = read_drum(picture)
    except PictureError as error:
        return row | {"why": str(error)}, picture
    heights = np.array([np.nan if height is None else height for height in found.heights])
    row |= {
        "outcome": "marked" if found.doubts else "read",
        "why": ", ".join(doubt.name for doubt in found.doubts),
        "error": found.dynamic_angle - drawn.angle,
        "se": found.se,
        "height": float(np.nanmedian(np.abs(heights - drawn.heights))) * MILLIMETRES,
        "filling": np.nan if found.filling is None else found.filling - drawn.filling,
        "radius": (found.circle.radius / drawn.circle[2] - 1.0) * MILLIMETRES,
    }
    return row, overlay_drum(picture, found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--first", type=int, default=10_000, help="first seed; rules: below 1000")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    start, rows = time.perf_counter(), []
    tiles: list[tuple[str, np.ndarray]] = []
    seeds = range(options.first, options.first + options.count)
    with ProcessPoolExecutor(options.workers) as pool:
        found = list(pool.map(row_of, seeds))
    for seed, (row, picture) in zip(seeds, found, strict=True):
        rows.append(row)
        tiles += [(f"{seed} {row['kind']}"[:44], small_copy(picture))] if len(tiles) < 12 else []
    frame = pd.DataFrame(rows)
    frame.to_csv(options.out / "drums.csv", index=False, float_format="%.5g")
    save_picture(options.out / "drums.jpg", contact_sheet(tiles))
    write_page(
        options.out / "README.md",
        "# Drums read from drawn pictures",
        f"`python -m experiments.evidence.accuracy.drums --first {options.first} --count {options.count}`: "
        f"drawn pictures of drums of {2 * MILLIMETRES:.0f} mm, half of them as areas, half grain by grain, "
        f"with known surfaces, in {time.perf_counter() - start:.0f} s on {machine('cpu')}.",
        markdown_table(pd.DataFrame([figures(frame, name) for name in ("all", "grains", "averaged", "cut")])),
        "![Drawn drums and what was read](drums.jpg)",
    )


def figures(frame: pd.DataFrame, kind: str) -> dict[str, object]:
    """Figures of all pictures, or of those of a kind."""
    own = frame if kind == "all" else frame[frame["kind"].str.contains(kind)]
    clear = own[own["outcome"] == "read"]
    angle, height = clear["error"].abs(), clear["height"]
    return {
        "pictures": kind,
        "read, marked, refused": ", ".join(
            str(int((own["outcome"] == name).sum())) for name in ("read", "marked", "refused")
        ),
        "median error [deg]": round(angle.median(), 3),
        "95 % [deg]": round(angle.quantile(0.95), 3),
        "largest without a mark [deg]": round(angle.max(), 3),
        "median error of a height [mm]": round(height.median(), 3),
        "median error of the filling": round(clear["filling"].abs().median(), 4),
        "within 2 standard errors": round(float((angle < 2.0 * clear["se"]).mean()), 2),
    }


if __name__ == "__main__":
    main()
