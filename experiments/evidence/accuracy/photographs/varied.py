"""Measure heaps before other cameras, or, with --low, heaps of 6 to 15 degrees before those of the record.

python -m experiments.evidence.accuracy.photographs.varied --first 550000 --heaps 500
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import cv2
import numpy as np

from experiments.evidence.accuracy.photographs import sampling
from experiments.evidence.accuracy.photographs.phone_camera import PhoneCamera
from experiments.evidence.accuracy.photographs.photographs_record import Row, figures, row_of
from experiments.evidence.accuracy.photographs.rendering import Phone, Top, render
from imaging import View
from imaging.photo.picture_file import least_focal_length

KINDS = ("near", "far", "above", "webcam", "plate", "guide", "plain")
SETTING = {"plate": "board", "plain": "sheet", "above": "table", "webcam": "table"}


def camera_of(kind: str, height: float, rng: np.random.Generator) -> PhoneCamera:
    """Draw a camera; a phone's focal length is 0.69 to 0.8 of its picture's width."""
    elevation, lens = abs(rng.normal(0.0, 2.0)), float(np.exp(rng.uniform(np.log(0.69), np.log(0.8))))
    size, share = ((800, 600) if rng.uniform() < 0.6 else (864, 486)), rng.uniform(0.3, 0.68)
    near, far = 2.0 * lens / share, float(np.exp(rng.uniform(np.log(3.0), np.log(20.0))))
    distance = near if kind == "near" or (kind != "guide" and rng.uniform() < 0.5) else far
    if kind == "above":
        elevation = rng.uniform(5.0, 14.0)
    if kind == "webcam":
        size, elevation = (640, 480), rng.uniform(0.0, 10.0)
    if kind == "guide":
        distance, share = rng.uniform(8.0, 16.0), rng.uniform(0.4, 0.6)
    tilt, aim = float(np.clip(rng.normal(0.0, 1.5), -6.0, 6.0)), rng.uniform(0.1, 0.9) * height
    middle = rng.uniform(-0.06, 0.06), rng.uniform(0.0, 0.12)
    bulge = rng.uniform(-0.03, 0.03)
    return PhoneCamera(*size, max(distance, 2.05), elevation, share, tilt, middle, aim, bulge)


def varied(seed: int) -> Row:
    """Row of a photograph of a seed, by a camera of one of `KINDS`."""
    cv2.setNumThreads(1)
    rng, kind = np.random.default_rng([54, seed]), KINDS[seed % len(KINDS)]
    heap = sampling._heap(rng)
    camera = camera_of(kind, heap.height, rng)
    around = sampling._surroundings(rng, SETTING.get(kind) or str(rng.choice(sampling.SETTINGS)))
    if kind == "plate":
        around = replace(around, top=Top(*rng.uniform([1.2, 1.1, 1.1, 0.03], [2.6, 2.2, 2.2, 0.25])))
    noise = rng.uniform(4.0, 12.0) if kind == "webcam" else rng.uniform(0.5, 6.0)
    phone, lamp = Phone(rng.uniform(0.4, 1.4), noise, 0.3, int(rng.integers(60, 96))), sampling._lamp(rng)
    spheres = heap.spheres(seed)
    picture = render(spheres, heap.height, around, lamp, camera, phone, seed)
    view = View(focal_length=camera.focus)
    if rng.uniform() < 0.5:  # a file without a focal length
        view = View(least_focal_length=least_focal_length(picture.shape[:2]))
    shot = sampling.Photograph(picture, sampling.true_angle(*spheres), kind, camera, heap, lamp.shadow)
    return row_of(shot, seed, view)[0]


def low_heap(seed: int) -> Row:
    """Row of a photograph of a low heap."""
    cv2.setNumThreads(1)
    return row_of(sampling.photograph_of_a_low_heap(seed), seed)[0]


def main() -> None:
    """Run the benchmark as a command."""
    parser = argparse.ArgumentParser(description="Measure heaps before other cameras, or low heaps.")
    parser.add_argument("--first", type=int, default=550_000, help="first seed")
    parser.add_argument("--heaps", type=int, default=500)
    parser.add_argument("--low", action="store_true", help="low heaps")
    parser.add_argument("--workers", type=int, help="processes; left out: one a core")
    chosen = parser.parse_args()
    seeds = range(chosen.first, chosen.first + chosen.heaps)
    with ProcessPoolExecutor(chosen.workers) as pool:
        rows = list(pool.map(low_heap if chosen.low else varied, seeds, chunksize=4))
    print("\n".join(f"| heaps{name} | {value} |" for name, value in figures(rows).items()))
    ratios = [row["error"] / row["se"] for row in rows if row["outcome"] == "measured"]
    print(f"| error over standard error, root mean square | {np.sqrt(np.mean(np.square(ratios))):.2f} |")


if __name__ == "__main__":
    main()
