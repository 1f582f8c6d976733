"""Program for a fresh interpreter: the additions of an installed package, and what commands do with them.

It prints one JSON object. Its arguments are the folders of tests whose helpers it takes and commands as JSON.
"""

import gc
import json
import logging
import sys

gc.disable()
warnings: list[str] = []
logging.basicConfig(level=logging.WARNING)
logging.getLogger("dem_warp.registry").addFilter(lambda record: not warnings.append(record.getMessage()))
sys.path[:0] = sys.argv[1:-1]

import pytest
from commandline import dem_warp
from worlds import RADIUS, ball_mass, grains, pair, record, small_case, solve, world

from dem_warp.laws.library import MECHANISMS
from dem_warp.scenes.library import SCENES
from experiments.calibrate.screening_stage import DESIGNS
from experiments.cases import ENGINES, Store
from experiments.cases.show import heap
from experiments.discover.mechanism_files import library_for
from experiments.export import EXPORTERS
from experiments.runs import calibration
from experiments.studyfile import load_study
from experiments.studyfile.mechanism_factor import with_mechanisms


def approach(*mechanisms: object) -> float:
    """Speed [m/s] that a step of 1 microsecond gives to one of two grains that just touch."""
    bodies = grains([[0.0, 0.0, 0.0], [0.0, 0.0, 1.999999 * RADIUS]])
    return float(record(solve(world(bodies, pair(mechanisms=mechanisms), 1e-6)), 1).velocities[1, 0, 2])


case = small_case()
found = {
    "laws": list(MECHANISMS),
    "scenes": list(SCENES),
    "designs": list(DESIGNS),
    "engines": list(ENGINES),
    "exporters": list(EXPORTERS),
    "key": Store("cases").key(case),
    "approach": approach(),
}
if "magnetism" in MECHANISMS:
    study = load_study(scale="bench")
    [mechanism] = (one for one in library_for(study) if one.name == "magnetic_grains")
    [law] = with_mechanisms(study, [mechanism]).case({"magnetic_grains": 0.5}, seed=1).mechanisms
    found["force"] = law.magnetic_force
    found["accelerations"] = [(approach(law) - approach()) * ball_mass() / 1e-6]
    found["keys by engine"] = [Store("cases", ENGINES["cones"]).key(case)]
    quick = ["-p", "no:cacheprovider", "-p", "no:unraisableexception"]  # the latter collects all at its end
    found["conformance"] = pytest.main(["-q", *quick, "conformance.py"])
    heap._write_pictures = lambda *_: None
    calibration.heap_pictures = lambda *_: []
    calibration.verified_heap = lambda *_: None
found["commands"] = [dem_warp(*words) for words in json.loads(sys.argv[-1])]
print(json.dumps(found | {"warnings": warnings}))
