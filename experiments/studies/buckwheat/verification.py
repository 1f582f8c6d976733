"""The verification as a script: do fresh heaps at the chosen setting agree with the measurement?

POINT is the paper's; take yours from the surface. Copy it for your own grain.

    python -m experiments.studies.buckwheat.verification --scale bench --target 27
"""

from pathlib import Path

import pandas as pd
import typer

from doe import Sample, compare_means
from experiments.cases import OwnWorkers, Store, run_cases
from experiments.commands.options import OneDevice
from experiments.studyfile import load_study

POINT = {"E": 0.482, "F": 0.446}
REPLICATES = 5
MARGIN = 1.0  # a difference that does not matter [degrees]
FIRST_SEED = 4000


def main(
    scale: str = "bench",
    target: float = 30.148,
    target_sd: float = 0.518,
    target_n: int = 5,
    out: Path = Path("out/scripts"),
    device: OneDevice = None,
) -> None:
    """Simulate fresh heaps; print the t-test and the equivalence test against the measurement."""
    study = load_study(scale=scale)
    cases = pd.DataFrame([POINT | {"seed": FIRST_SEED + replicate} for replicate in range(REPLICATES)])
    cases = run_cases(study, cases, Store(out / "cases"), OwnWorkers(device))
    cases.to_csv(out / f"verification-{scale}.csv", index=False)

    result = compare_means(cases["angle"].to_numpy(), Sample(target, target_sd, target_n), margin=MARGIN)
    low, high = result.interval
    print(f"angles: {', '.join(f'{angle:.2f}' for angle in cases['angle'])}")
    print(f"difference {result.difference:+.2f} degrees, 95 % interval {low:+.2f} to {high:+.2f}")
    print(f"t-test p = {result.p:.3f}; within {MARGIN} degrees: p = {result.equivalence_p:.3f}")
    print(f"equivalence is shown from a margin of {result.smallest_margin:.2f} degrees on")


if __name__ == "__main__":
    typer.run(main)
