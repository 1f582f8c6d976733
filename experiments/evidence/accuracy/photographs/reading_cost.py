"""Cost of measuring one large photograph: processor time and memory of a process that does nothing else.

    python -m experiments.evidence.accuracy.photographs.reading_cost

A drawn photograph is enlarged to the pixels of a phone's, kept as a JPEG, and read and measured in a process
of its own. The start of the process is taken off its time, not off its memory. Linux alone tells the memory.
"""

from __future__ import annotations

import argparse
import multiprocessing
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

from experiments.evidence.accuracy.photographs.sampling import photograph
from imaging import measure, read_picture, save_picture

SIZES = (12, 50)
"""Millions of pixels."""


def enlarge(seed: int, millions: int, path: Path) -> None:
    """Draw a photograph, enlarge it to so many millions of pixels, and save it."""
    picture = photograph(seed).picture
    scale = (millions * 1e6 / (picture.shape[0] * picture.shape[1])) ** 0.5
    large = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    save_picture(path, np.asarray(large, dtype=np.uint8))


def cost_of_one(path: Path) -> tuple[float, float, float]:
    """Angle [degrees], time of the processor [s] and greatest memory of this process [MB]."""
    cv2.setNumThreads(1)
    started = time.process_time()
    angle = measure(read_picture(path))
    seconds = time.process_time() - started
    [peak] = [line for line in Path("/proc/self/status").read_text("ascii").splitlines() if "VmHWM" in line]
    return angle.mean, seconds, float(peak.split()[1]) / 1e3


def main() -> None:
    """Run the benchmark as a command."""
    parser = argparse.ArgumentParser(description="Cost of measuring large photographs.")
    parser.add_argument("--seeds", type=int, nargs="+", default=[970_000, 970_001, 970_002])
    chosen = parser.parse_args()
    print("| Mpx | seed | angle | CPU s | MB |\n| ---: | ---: | ---: | ---: | ---: |")
    context = multiprocessing.get_context("spawn")
    with tempfile.TemporaryDirectory() as folder:
        for millions in SIZES:
            for seed in chosen.seeds:
                path = Path(folder) / f"{millions}-{seed}.jpg"
                enlarge(seed, millions, path)
                with context.Pool(1) as pool:
                    angle, seconds, memory = pool.apply(cost_of_one, (path,))
                print(f"| {millions} | {seed} | {angle:.2f} | {seconds:.2f} | {memory:.0f} |", flush=True)


if __name__ == "__main__":
    main()
