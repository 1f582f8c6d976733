"""A program that keeps the folder contract with the standard library alone: cones, by their friction.

The further word, where there is one, names a way to go wrong, or to be another solver.
"""

import json
import math
import sys
import time
from pathlib import Path

RADIUS, BASE = 1e-3, 20e-3


def cone(slope):
    count = int(2 * BASE / RADIUS)
    places = [RADIUS * index - BASE for index in range(count)]
    points = ((x, y, slope * (BASE - math.hypot(x, y))) for x in places for y in places)
    return [point for point in points if point[2] > 0.0]


def main(way=""):
    case = json.loads(Path("case.json").read_text(encoding="utf-8"))
    with Path("../../runs.txt").open("a", encoding="utf-8") as log:
        log.write(f"{case['seed']}\n")
    mode = way if case["seed"] % 2 or not way.endswith("-odd") else ""
    match mode.removesuffix("-odd"):
        case "crash":
            raise SystemExit("no license was found\n")
        case "silent":
            return
        case "no-heap":
            given = {"flow_rate": 0.0125} if "flow_rate" in case["observables"] else {}
            answer = {"status": "finished", "observables": given}
            Path("result.json").write_text(json.dumps(answer), encoding="utf-8")
            return
        case "sleep":
            time.sleep(600.0)
    noise = 0.3 * math.sin(12.9898 * case["seed"])
    foot, slope = (12.0, 33.0) if mode == "flatter" else (15.0, 30.0)
    angle = foot + slope * case["contact"]["grain-grain"]["static_friction"] + noise
    lines = [f"{x:.9g},{y:.9g},{z:.9g},{RADIUS}" for x, y, z in cone(math.tan(math.radians(angle)))]
    Path("heap.csv").write_text("\n".join(["x,y,z,r", *lines]) + "\n", encoding="utf-8")
    answer = {"status": "finished", "program": "cones 1.0", "observables": {"grain_count": len(lines)}}
    match mode:
        case "nan":
            Path("heap.csv").write_text("x,y,z,r\n0,0,nan,0.001\n", encoding="utf-8")
        case "high":
            Path("heap.csv").write_text("x,y,z,r\n0,0,0.1,0.001\n", encoding="utf-8")
        case "diverged":
            answer = {"status": "diverged", "reason": "a grain was too fast"}
        case "status":
            answer = {"status": "fine"}
        case "observable":
            answer["observables"] = {"grain_cuont": 3}
        case "infinite":
            answer["observables"] = {"grain_count": float("inf")}
        case "huge":
            answer["observables"] = {"grain_count": 10**400}
        case "deep":
            Path("result.json").write_text("[" * 100_000, encoding="utf-8")
            return
    Path("result.json").write_text(json.dumps(answer), encoding="utf-8")


main(*sys.argv[1:])
