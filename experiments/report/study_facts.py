"""Facts of a study that a reader of its report needs: what was simulated and how it was measured."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dem_warp import EDEM, ContactLaws
from experiments.studyfile import Study


def study_facts(study: Study) -> dict[str, str]:
    """Say what was simulated and measured, in the terms in which scales differ."""
    tube, numerics, measurement = study.scene.given.get("lifted-cylinder"), study.numerics, study.measurement
    count = tube.grain_count if tube else study.case({}, seed=0).scene.grain_count
    grains = f"{count} grains" if count else "as many grains as fill it"
    counts = sorted({shape.sphere_count for shape in study.grain.population().mixture.shapes})
    spheres = f"{' or '.join(map(str, counts))} sphere{'' if counts == [1] else 's'}"
    softened = "real" if numerics.modulus_scale == 1.0 else f"divided by {numerics.modulus_scale:g}"
    test = {"Test": _scene_text(study.document["scene"])}
    if tube is not None:
        size = f"{1e3 * tube.diameter:g} mm wide, {1e3 * tube.height:g} mm high"
        test = {"Tube": size, "Lift": f"{tube.lift_speed:g} m/s"}
    sizes = study.grain.sizes
    measured = {"Sizes": sizes.cut_into_classes().summary} if sizes else {}
    walls = {f"Walls “{name}”": _part_text(part) for name, part in study.document.get("walls", {}).items()}
    further = study.document.get("response-scene", {})
    return {
        "Scale": study.scale or "the study as written",
        **test,
        "Grains": f"{grains}, {spheres} each",
        **measured,
        **walls,
        "Contact laws": _laws_text(study.solver.laws),
        **({"Card": f"corrected for {solver} by a bridge"} if (solver := study.solver.corrected_for) else {}),
        "Shear modulus": softened,
        "Time step": f"{100.0 * numerics.time_step_fraction:g} % of the Rayleigh time",
        "Angle": f"“{measurement.fit}” fit, mean of {measurement.azimuths} views of a heap, both flanks",
    } | {f"Scene “{name}”": _scene_text(scene) for name, scene in further.items()}


def _part_text(part: Mapping[str, Any]) -> str:
    text = ", ".join(f"{key.replace('_', ' ')} {value}" for key, value in part.items())
    return text or "varied by factors"


def _laws_text(laws: ContactLaws) -> str:
    base = EDEM.to_dict()
    own = {law: value for law, value in laws.to_dict().items() if value != base[law]}
    text = ", ".join(f"{law.replace('_', ' ')} {value}" for law, value in own.items())
    return f"{laws.name}: {text or 'the base law'}"


def _scene_text(scene: Mapping[str, Any]) -> str:
    [(kind, settings)] = scene.items()
    return ", ".join([kind, *(f"{key.replace('_', ' ')} {value}" for key, value in settings.items())])
