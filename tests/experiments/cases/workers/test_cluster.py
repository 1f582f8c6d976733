"""Workers of Dask: the same bits for any split, nothing lost and nothing done twice when a worker is."""

import os
import signal
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from commandline import refused

from dem_warp import Case, CaseResult, Progress
from experiments.cases import OwnWorkers, Resources, Store, Workers, open_workers, run_cases
from experiments.cases.engines.contract import command_program
from experiments.cases.engines.program import ProgramEngine
from experiments.cases.workers import dask_clusters, dask_task, dask_workers, opening, resources
from experiments.cases.workers.batches import GPU_WORKERS
from experiments.cases.workers.dask_workers import DaskWorkers
from experiments.cases.workers.workers import WorkersLostError
from experiments.io.errors import InputError
from experiments.studyfile import Study, load_study
from experiments.studyfile.cluster_section import ClusterSection, read_profile

CONES = Path(__file__).parents[1] / "engines" / "cone_program.py"


def made(study: Study, count: int) -> list[Case]:
    return [study.case({"E": 0.2 + 0.02 * number}, number) for number in range(count)]


def assert_same_bits(some: list[CaseResult], others: list[CaseResult]) -> None:
    for one, other in zip(some, others, strict=True):
        assert one.status == other.status == "finished", (one.reason, other.reason)
        assert one.observables == other.observables
        for name in ("positions", "orientations", "sizes"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_any_split_gives_the_same_bits_and_every_case_is_handed_on_once(
    small_study: Study, two_workers: Workers
) -> None:
    cases = made(small_study, 3)
    received: list[int] = []
    progress: list[Progress] = []
    spread = two_workers.simulate(cases, None, lambda index, _: received.append(index), progress.append)
    assert sorted(received) == list(range(3))
    assert progress[-1].fraction == 1.0
    assert_same_bits(spread, OwnWorkers("cpu", 1).simulate(cases))
    assert_same_bits(spread, OwnWorkers("cpu", 2).simulate(cases[::-1])[::-1])


def test_workers_that_are_killed_lose_no_case_and_none_is_done_twice(
    small_study: Study,
    two_workers: Workers,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    cases = made(small_study, 4)
    assert isinstance(two_workers, DaskWorkers)
    client, take = two_workers._client, dask_workers._Session._take_message
    received: Counter[int] = Counter()
    begun: list[int] = []
    processes: list[
        int
    ] = []  # asked for before: a worker that has to answer first can end its batch meanwhile

    def kill(session: dask_workers._Session, message: dask_task.Message) -> None:
        """Take what a worker says; as the third batch has just begun, kill all workers."""
        if message.reply and not begun:
            processes.extend(client.run(os.getpid).values())
        take(session, message)
        if message.reply:
            begun.append(message.number)
            if len(begun) == 3:
                for process in processes:
                    os.kill(process, signal.SIGKILL)

    def note(index: int, result: CaseResult) -> None:
        received[index] += 1

    monkeypatch.setattr(dask_workers._Session, "_take_message", kill)
    results = two_workers.simulate(cases, None, note, None, tmp_path / "unfinished")
    assert max(Counter(begun).values()) > 1, "a batch was begun again"
    assert received == Counter(range(4))
    assert "a worker was lost" in caplog.text
    assert_same_bits(results, OwnWorkers("cpu", 1).simulate(cases))


def test_another_solver_runs_on_the_workers(small_study: Study, two_workers: Workers, tmp_path: Path) -> None:
    engine = ProgramEngine(command_program(f"'{sys.executable}' '{CONES}'", Path(), "command"))
    cases = made(small_study, 3)
    spread = two_workers.simulate(cases, engine, checkpoint=tmp_path / "unfinished")
    assert_same_bits(spread, engine(cases))


def test_a_table_is_stored_by_the_client_and_taken_up_by_any_workers(
    small_study: Study, two_workers: Workers, tmp_path: Path
) -> None:
    table = pd.DataFrame({"E": [0.3, 0.4, 0.5], "seed": [1, 2, 3]})
    store = Store(tmp_path / "cases")
    first = run_cases(small_study, table.iloc[:2], store, two_workers)
    both = run_cases(small_study, table, store, OwnWorkers("cpu", 1))
    pd.testing.assert_frame_equal(both.iloc[:2], first, check_exact=True)
    assert len(store) == 3
    assert not store.unfinished.exists()


def test_workers_of_another_version_are_refused(
    small_study: Study, two_workers: Workers, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask_workers, "fingerprint_of", lambda _: "another")
    with pytest.raises(InputError, match="must have the dem-warp of this machine"):
        two_workers.simulate(made(small_study, 1))


def test_the_workers_of_a_scheduler_are_used_by_its_address_until_it_is_gone(
    small_study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A scheduler of one's own, as `dask scheduler` and `dask worker` start them."""
    from distributed import LocalCluster

    monkeypatch.setattr(opening, "ANSWER", 5.0)  # on a machine that is busy, too
    with LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50, host="127.0.0.1"
    ) as cluster:
        asked = Resources(scheduler=cluster.scheduler_address)
        with open_workers(asked) as workers:
            results = workers.simulate(made(small_study, 1))
            assert workers.described["device"] == f"the workers of {cluster.scheduler_address}"
            cluster.close()
            with pytest.raises(WorkersLostError, match="connection to the scheduler was lost"):
                workers.simulate(made(small_study, 1))
    assert_same_bits(results, OwnWorkers("cpu", 1).simulate(made(small_study, 1)))


def test_without_dask_the_message_says_what_to_install(
    write_study: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(opening, "find_spec", lambda name: None)
    profile = tmp_path / "cluster.toml"
    profile.write_text("[cluster]\nworkers = 2\n", encoding="utf-8")
    words = ("calibrate", write_study(), "--cluster", profile, "--out", tmp_path / "out")
    assert "pip install 'dem-warp[cluster]'" in refused(*words)
    assert not (tmp_path / "out").exists()


def test_a_scheduler_that_does_not_answer_ends_with_2(
    write_study: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(opening, "ANSWER", 0.5)
    words = ("calibrate", write_study(), "--scheduler", "tcp://127.0.0.1:9", "--out", tmp_path / "out")
    assert "must be the address of a Dask scheduler that answers" in refused(*words)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("workers = 0", "greater than or equal to 1"),
        ('kind = "cloud"', "'local', 'slurm'"),
        ('memory = "plenty"', 'a size with its unit, e.g. "4 GB"'),
        ('directives = ["-p main\\nrm -rf ~"]', "one line each"),
        ('queue = "main\\nrm -rf ~"', "must be one line"),
        ("worker = 2", "did you mean 'workers'?"),
        ('walltime = "30 s"', "greater than or equal to 60"),
    ],
)
def test_a_wrong_profile_is_refused_with_its_place(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "profile.toml"
    path.write_text(f"[cluster]\n{text}\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_profile(path)
    assert said in str(caught.value)
    assert f"{path}:2" in str(caught.value)


def test_a_study_may_name_its_cluster_and_its_hash_stays(write_study: Callable[..., Path]) -> None:
    from experiments.runs.choices import chosen_resources, resources_for

    plain = load_study(write_study())
    before = plain.sha256
    study = load_study(write_study(add='\n[cluster]\nkind = "slurm"\nworkers = 4\n'))
    assert study.sha256 == before
    asked = resources_for(study.cluster, chosen_resources())
    assert (asked.count, asked.submits_jobs, str(asked)) == (4, True, "4 workers of slurm")
    assert resources_for(study.cluster, chosen_resources("cpu")).cluster is None
    assert resources_for(plain.cluster, chosen_resources()).cluster is None


def test_more_processes_than_the_cores_serve_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from experiments.runs.choices import chosen_resources

    monkeypatch.setattr("experiments.cases.workers.resources.cores", lambda: 2)
    profile = tmp_path / "many.toml"
    profile.write_text("[cluster]\ngpu = false\nworkers = 17\n", encoding="utf-8")
    assert chosen_resources("cpu", 16).count == 16
    for place, asked in (("--workers", {"device": "cpu", "workers": 17}), ("workers", {"cluster": profile})):
        with pytest.raises(InputError, match=f"{place}: must be at most 8 processes a core, 16 here"):
            chosen_resources(**asked)  # type: ignore[arg-type]
    assert chosen_resources(workers=17, scheduler="tcp://elsewhere:8786").count == 17


def test_workers_fill_whole_jobs(tmp_path: Path) -> None:
    from experiments.runs.choices import chosen_resources

    profile = tmp_path / "nodes.toml"
    text = '[cluster]\nkind = "slurm"\nworkers_per_job = 4\n'
    profile.write_text(text, encoding="utf-8")
    assert chosen_resources(cluster=profile).count == 4
    assert chosen_resources(cluster=profile, workers=8).count == 8
    rule = "must fill whole jobs of 4 workers"
    with pytest.raises(InputError, match=f"--workers: {rule}.* 6"):
        chosen_resources(cluster=profile, workers=6)
    profile.write_text(text + "workers = 3\n", encoding="utf-8")
    with pytest.raises(InputError, match=f"cluster.workers: {rule}.* 3"):
        chosen_resources(cluster=profile)


def test_jobs_ask_for_what_the_profile_says(tmp_path: Path) -> None:
    section = ClusterSection.model_validate(
        {
            "kind": "slurm", "workers": 8, "gpu": True, "workers_per_job": 4, "cores": 2, "memory": "6 GB",
            "walltime": "90 min", "queue": "gpu", "shared": str(tmp_path / "shared"),
        },
        context={"folder": "."},
    )  # fmt: skip
    options = dask_clusters.job_options(section)
    assert options["job_extra_directives"] == ["--gres=gpu:4"]
    assert (options["cores"], options["processes"], options["job_cpu"]) == (4, 4, 8)
    assert (options["walltime"], options["queue"]) == ("01:30:00", "gpu")
    assert options["memory"].startswith("22.3")  # 24 GB in GiB


def test_every_worker_finds_a_gpu_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_task.tempfile, "gettempdir", lambda: str(tmp_path))
    gpus = [("cuda:0", "GPU-a"), ("cuda:1", "GPU-b")]
    first, held = dask_task._claimed(gpus)
    second, other = dask_task._claimed(gpus)
    third, none = dask_task._claimed(gpus)
    assert (first, second, third, none) == ("cuda:0", "cuda:1", "cuda:0", None)
    assert held is not None
    held.release()
    assert dask_task._claimed(gpus)[0] == "cuda:0"
    assert other is not None
    assert dask_task._claimed([]) == ("cpu", None)


def test_a_worker_sees_its_gpu_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    assert dask_clusters.visible(["cuda:0", "cuda:3"]) == ["0", "3"]
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "4,GPU-b")
    assert dask_clusters.visible(["cuda:0", "cuda:1"]) == ["4", "GPU-b"]


@pytest.mark.parametrize(
    ("gpus", "asked", "sharing"),
    [
        (1, Resources(), 1),
        (1, Resources(gpu_workers=3), 3),
        (1, Resources(cluster=ClusterSection()), GPU_WORKERS),
        (2, Resources(), 1),
        (2, Resources(workers=2, gpu_workers=1), 1),
    ],
)
def test_a_gpu_has_one_worker_alone_and_several_next_to_others_or_as_many_as_asked(
    monkeypatch: pytest.MonkeyPatch, gpus: int, asked: Resources, sharing: int
) -> None:
    names = [f"cuda:{number}" for number in range(gpus)]
    monkeypatch.setattr(resources, "resolve_device", lambda name: name or "cuda:0")
    monkeypatch.setattr(resources.wp, "get_cuda_devices", lambda: [SimpleNamespace(alias=n) for n in names])
    assert asked.sharing == sharing
    assert asked.count == sharing * len(asked.gpus)
    assert str(asked).endswith(f", {sharing} workers each") == (sharing > 1)


def test_workers_of_a_gpu_share_its_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    free = {"GPU-a": 8.0e10, "GPU-b": 5.0e10}
    homes = ["GPU-a", "GPU-b", "GPU-a"]
    described = {str(i): {"identity": home, "memory": free[home]} for i, home in enumerate(homes)}
    client: Any = SimpleNamespace(run=lambda *_, **__: described)
    workers = DaskWorkers(client, {}, "two GPUs", 3)
    assert workers._shares() == (4.0e10, 2)
    assert (workers.on_gpu, workers.sharing) == (True, 2)
    described["3"] = {"identity": None, "memory": None}
    assert (workers.on_gpu, workers.sharing) == (False, 1)


def test_processes_are_dealt_out_to_the_gpus(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    started: dict[int, Any] = {}
    monkeypatch.setattr("distributed.SpecCluster", lambda workers, *_, **__: started.update(workers))
    for gpus, seen in ((["cuda:0", "cuda:1"], ["0", "1", "0", "1"]), ([], [""] * 4)):
        dask_clusters.start_processes(gpus, 4)
        assert [one["options"]["env"]["CUDA_VISIBLE_DEVICES"] for one in started.values()] == seen
