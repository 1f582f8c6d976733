"""The response surface as a script: which settings give the target? Copy it for your own grain.

CENTER and HALF_RANGE are the paper's; take yours from the climb.

    python -m experiments.studies.buckwheat.surface --scale bench --target 27
"""

from pathlib import Path

import typer

from doe import Factor, Sample, TargetError, central_composite, fit_surface
from experiments.cases import OwnWorkers, Store, run_cases
from experiments.commands.options import OneDevice
from experiments.studyfile import load_study

CENTER = {"E": 0.48, "F": 0.45}
HALF_RANGE = {"E": 0.06, "F": 0.10}
CENTER_POINTS = 5
FIRST_SEED = 3000


def main(
    scale: str = "bench",
    target: float = 30.148,
    target_sd: float = 0.518,
    target_n: int = 5,
    out: Path = Path("out/scripts"),
    device: OneDevice = None,
) -> None:
    """Fit the surface; print its analysis of variance and the setting nearest to the center."""
    study = load_study(scale=scale)
    factors = [Factor.around(name, CENTER[name], HALF_RANGE[name]) for name in CENTER]
    design = central_composite(factors, center=CENTER_POINTS)

    cases = design.natural.assign(seed=range(FIRST_SEED, FIRST_SEED + len(design.natural)))
    cases = run_cases(study, cases, Store(out / "cases"), OwnWorkers(device))
    cases.to_csv(out / f"surface-{scale}.csv")

    surface = fit_surface(design, cases["angle"]).reduce()
    print(surface.anova.round(4).to_string())
    print(f"angle = {surface.equation()}")
    region = surface.compatible_region(Sample(target, target_sd, target_n))
    print(f"compatible with the target: {region.fraction:.0%} of the design's box\n{region.ranges.round(3)}")
    try:
        print(f"nearest to the center:\n{surface.nearest(target).round(3).to_string()}")
    except TargetError as error:
        print(f"no setting of the design gives the target: {error}")


if __name__ == "__main__":
    typer.run(main)
