"""Jobs that cannot be submitted, and addresses that are none: said at once, in plain words."""

import os
import select
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from commandline import install, refused

from experiments.cases import Resources
from experiments.cases.workers import dask_workers
from experiments.cases.workers.dask_workers import DaskWorkers
from experiments.cases.workers.submissions import Submissions, message_of
from experiments.cases.workers.workers import WorkersLostError
from experiments.io.errors import InputError
from experiments.runs.examination import _submission
from experiments.studyfile.cluster_section import ClusterSection

REFUSES = "sbatch: error: invalid partition specified: nope"
PROGRAM = "import sys; from experiments.cli import app; app(sys.argv[1:])"


@pytest.fixture
def profile(tmp_path: Path) -> Path:
    """Profile of a SLURM."""
    file = tmp_path / "profile.toml"
    text = f'[cluster]\nkind = "slurm"\nworkers = 3\nqueue = "nope"\nshared = "{tmp_path / "shared"}"\n'
    file.write_text(text, encoding="utf-8")
    return file


def test_without_the_command_that_submits_nothing_is_written(
    write_study: Callable[..., Path], profile: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    study, out = write_study(), tmp_path / "out"
    for command in ("calibrate", "heap"):
        said = refused(command, study, "--cluster", profile, "--out", out)
        assert "needs the command sbatch, which is not on the PATH" in said
        assert not out.exists()
    assert not (tmp_path / "shared").exists()


def test_jobs_that_are_refused_end_the_command_in_the_message_of_the_batch_system(
    write_study: Callable[..., Path], profile: Path, tmp_path: Path
) -> None:
    """A process of its own, as Dask would print its tracebacks when that ends."""
    path = install(tmp_path / "bin" / "sbatch", f"#!/bin/sh\necho '{REFUSES}' >&2; exit 1")
    out = tmp_path / "out"
    words = ["heap", str(write_study()), "--cluster", str(profile), "--out", str(out)]
    command, environment = [sys.executable, "-c", PROGRAM, *words], os.environ | {"PATH": str(path)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)
    assert done.returncode == 2
    assert f"sbatch refuses the jobs: {REFUSES}" in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
    assert "non-zero exit code" not in done.stderr
    assert not out.exists()


def test_ctrl_c_ends_a_command_whose_jobs_wait_as_any_other(
    write_study: Callable[..., Path], profile: Path, tmp_path: Path
) -> None:
    taken = tmp_path / "taken"
    os.mkfifo(taken)
    path = install(tmp_path / "bin" / "sbatch", f"#!/bin/sh\necho yes > {taken}; echo Submitted batch job 7")
    (path / "scancel").symlink_to("/bin/true")
    words = ["heap", str(write_study()), "--cluster", str(profile), "--out", str(tmp_path / "out")]
    # what a test is started from may ignore Ctrl-C
    program = f"import signal; signal.signal(signal.SIGINT, signal.default_int_handler); {PROGRAM}"
    with subprocess.Popen(
        [sys.executable, "-c", program, *words],
        stderr=subprocess.PIPE, text=True, env=os.environ | {"PATH": f"{path}:{os.environ['PATH']}"},
    ) as process:  # fmt: skip
        listening = os.open(taken, os.O_RDONLY | os.O_NONBLOCK)
        assert select.select([listening], [], [], 120.0)[0]
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=120)
    os.close(listening)
    assert process.returncode == 130
    assert "Interrupted. Begin again with: dem-warp heap" in " ".join(err.split())
    assert "Traceback" not in err


def test_jobs_in_a_queue_are_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Some jobs were refused, one waits: looks go on until its worker is there."""
    monkeypatch.setattr(dask_workers, "LISTEN", 0.0)
    submissions, looks = Submissions(2), iter([{}, {}, {}, {}])

    def wait(count: int, timeout: float) -> None:
        raise TimeoutError

    def there(n_workers: int) -> dict[str, Any]:
        return {"workers": next(looks, {"tls://node:1": {"nthreads": 1}})}

    submissions.refuse("a", RuntimeError("too many jobs"))
    assert not submissions.decided.is_set()
    submissions.take("b")
    assert submissions.decided.is_set()
    client: Any = SimpleNamespace(wait_for_workers=wait, scheduler_info=there)
    workers = DaskWorkers(client, {}, "queue", 2, submissions)
    workers._await_workers()
    assert next(looks, None) is None

    looks = iter([{}, {}, {}])
    submissions.end("b")
    submissions.refuse("b", RuntimeError("the partition is closed"))
    with pytest.raises(WorkersLostError, match="refuses the jobs: the partition is closed"):
        workers._await_workers()


def test_a_run_whose_last_jobs_are_refused_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(timeout: float) -> None:
        raise TimeoutError

    submissions = Submissions(1)
    queue = SimpleNamespace(get=nothing)
    session: Any = SimpleNamespace(submissions=submissions, _queue=queue, results=SimpleNamespace(report=int))
    session._take_all = threading.Event().set
    dask_workers._Session._listen(session)
    submissions.refuse("a", RuntimeError("no more"))
    with pytest.raises(WorkersLostError, match="no more"):
        dask_workers._Session._listen(session)


def test_words_are_what_the_batch_system_prints() -> None:
    head = "Command exited with non-zero exit code.\nExit code: 1\nCommand:\nsbatch job.sh"
    assert message_of(RuntimeError(f"{head}\nstdout:\n\nstderr:\none\ntwo\n\n")) == "one two"
    assert message_of(RuntimeError(f"{head}\nstdout:\nonly this\nstderr:\n\n")) == "only this"
    assert message_of(FileNotFoundError(2, "No such file", "bsub")) == "[Errno 2] No such file: 'bsub'"
    assert message_of(OSError()) == "OSError"


def test_the_doctor_says_whether_jobs_can_be_submitted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = Resources(cluster=ClusterSection(kind="slurm"))
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    [missing] = _submission(asked)
    assert (missing.good, missing.needed) == (False, True)
    assert "no sbatch on the PATH" in missing.text
    install(tmp_path / "bin" / "sbatch", "#!/bin/sh")
    [there] = _submission(asked)
    assert (there.good, there.text) == (True, str(tmp_path / "bin" / "sbatch"))
    assert _submission(Resources(cluster=ClusterSection(workers=2, gpu=False))) == []


@pytest.mark.parametrize(
    "text",
    ["foo bar", "", "host", "tcp://host", "ftp://host:80", "host:0", "host:65536"],
)
def test_what_is_no_address_is_refused_before_dask_sees_it(text: str) -> None:
    with pytest.raises(InputError, match="must be the address of a Dask scheduler"):
        Resources(scheduler=text)


@pytest.mark.parametrize("text", ["host:8786", "tls://node-1.site:80", "tcp://[fe80::1%eth0]:8786"])
def test_addresses_are_taken(text: str) -> None:
    assert Resources(scheduler=text).scheduler == text
