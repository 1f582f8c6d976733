"""A study and a table for `dem-warp discover`, to ask if one set of the grain explains the inclined drums.

The walls have the frictions that the fit gave them, and the grain is open. The level test takes no part: its
single angles are not published.
"""

from pathlib import Path

import pandas as pd

from experiments.evidence.studies.wheat_drums.drum_fit import SETTINGS, WheatFit
from experiments.evidence.studies.wheat_drums.drum_plan import GRAIN, HERE, SHELLS
from experiments.io.files import write_text
from experiments.io.toml_files import toml_text
from experiments.studyfile import Study
from experiments.studyfile.factor_section import merge


def write_search(folder: Path, study: Study, fit: WheatFit) -> list[Path]:
    """Write the study and the measured angles into a folder; return both files."""
    factor = next(factor for factor in study.factors if factor.name == "mu_shell")
    walls = {
        name: round(float(factor.center + factor.half_range * fit.best[SETTINGS.index(f"mu_{name}")]), 4)
        for name in SHELLS
    }
    cover = {"static_friction": walls[SHELLS[-1]]}
    document = {key: value for key, value in study.document.items() if key not in ("condition", "factor")}
    document = merge(document, {"contact": {"grain-wall": cover}, "walls": {"front": cover}})
    document["factor"] = [table for table in study.document["factor"] if table["name"] in GRAIN]
    document["condition"] = {
        name: {
            "scene": {"drum": {"inclination": "45 deg"}},
            "contact": {"grain-wall": {"static_friction": value}},
        }
        for name, value in walls.items()
    }
    made, measured = folder / "search.toml", folder / "measured.csv"
    write_text(made, toml_text(document))
    shape = study.document["grain"]["clump"]
    write_text(folder / shape, (HERE / shape).read_text(encoding="utf-8"))
    angles = pd.read_csv(HERE / "angles.csv", comment="#")
    columns = {"shell": "condition", "angle_deg": "value"}
    table = angles.rename(columns=columns).assign(observable="dynamic_angle", unit="deg")
    write_text(measured, table.to_csv(index=False))
    return [made, measured]
