"""An engine that simulates nothing: cones whose angle grows with both frictions, in the folder contract."""

from __future__ import annotations

import json
import math
import random
from pathlib import Path

RADIUS, BASE = 1e-3, 30e-3
"""Radius of the spheres and of the cone [m]."""


def main() -> None:
    """Answer the case of the current folder."""
    case = json.loads(Path("case.json").read_text(encoding="utf-8"))
    contact = case["contact"]["grain-grain"]
    noise = random.Random(case["seed"]).gauss(0.0, 0.3)
    angle = 15.0 + 30.0 * contact["static_friction"] + 40.0 * contact["rolling_friction"] + noise
    slope = math.tan(math.radians(min(angle, 60.0)))
    axis = [RADIUS * index - BASE for index in range(int(2.0 * BASE / RADIUS))]
    heights = ((x, y, slope * (BASE - math.hypot(x, y))) for x in axis for y in axis)
    rows = [f"{x:.9g},{y:.9g},{z:.9g},{RADIUS}" for x, y, z in heights if z > 0.0]
    Path("heap.csv").write_text("\n".join(["x,y,z,r", *rows, ""]), encoding="utf-8")
    answer = {"status": "finished", "program": "cones 1.0", "observables": {"grain_count": len(rows)}}
    Path("result.json").write_text(json.dumps(answer), encoding="utf-8")


if __name__ == "__main__":
    main()
