"""Workers as jobs of a real SLURM, of one node on this machine."""

from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import slurm_node as slurm

from dem_warp import CaseResult
from experiments.cases import OwnWorkers, Resources, open_workers
from experiments.studyfile import load_study
from experiments.studyfile.cluster_section import read_profile

PROFILE = Path(slurm.__file__).with_name("slurm.toml")

pytestmark = [pytest.mark.program(name) for name in ("sbatch", "slurmctld", "slurmd", "munged")]


@pytest.fixture(scope="module")
def node(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """One node, whose commands everything in this module uses."""
    with (
        slurm.one_node(tmp_path_factory.mktemp("slurm") / "node") as environment,
        pytest.MonkeyPatch.context() as patch,
    ):
        patch.setenv("SLURM_CONF", environment["SLURM_CONF"])
        yield environment


def test_jobs_are_workers_and_one_that_is_requeued_loses_nothing(
    node: dict[str, str], write_study: Callable[..., Path], tmp_path: Path
) -> None:
    study = load_study(write_study(("grain_count = 30", "grain_count = 120")))
    cases = [study.case({"E": 0.2 + 0.05 * number}, number) for number in range(6)]
    section = read_profile(PROFILE).model_copy(update={"shared": str(tmp_path / "shared")})
    counted: Counter[int] = Counter()
    requeued: list[str] = []

    def note(index: int, result: CaseResult) -> None:
        """Count, and requeue a job once the first case has ended: another one runs there."""
        counted[index] += 1
        if not requeued:
            jobs = slurm.command(node, "squeue", "--noheader", "--states=R", "--format=%i").split()
            requeued.append(jobs[0])
            slurm.command(node, "scontrol", "requeue", jobs[0])

    with open_workers(Resources(cluster=section)) as workers:
        results = workers.simulate(cases, None, note, None, tmp_path / "unfinished")
        assert workers.described == {"device": "2 workers of slurm", "workers": 2}
    assert requeued
    assert counted == Counter(range(6))
    for one, other in zip(results, OwnWorkers("cpu", 2).simulate(cases), strict=True):
        assert one.status == other.status == "finished"
        np.testing.assert_array_equal(one.positions, other.positions)
        assert one.observables == other.observables
