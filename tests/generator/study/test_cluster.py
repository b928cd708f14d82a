import asyncio
import multiprocessing
import os
import signal
import socket
import ssl
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from generator.diagnostics import NotInstalledError, UsageError
from generator.study import cluster
from generator.study.cluster import (
    ClusterError,
    check_scheduler,
    run_on_cluster,
    run_on_executor,
)
from generator.study.run_case import run_case
from generator.study.study import DIED, PROGRAM_ERROR, RunResult, Study
from generator.study.sweep import TABLE_NAME, run_sweep
from generator.study.worker_pool import Task, run_locally
from tests.processes import ENVIRONMENT
from tests.study_runs import (
    BEGIN,
    FAULTY,
    FULL_DISK,
    POISON,
    REAL,
    deadly_run,
    is_running,
    list_study,
    processes_of,
    quick_run,
)

dask = pytest.importorskip("dask")
distributed = pytest.importorskip("distributed")
psutil = pytest.importorskip("psutil")


def tasks(values: list[float], folder: Path | None = None) -> list[Task]:
    return [
        Task(index, (value,), None if folder is None else folder / f"{index:03}")
        for index, value in enumerate(values)
    ]


def rows(values: list[float], address: str, folder: Path | None = None, **options: Any):
    """The results of quick runs on a cluster, by index."""
    options = {"run": quick_run, **options}
    with closing(
        run_on_cluster(address, **options)(list_study(*values), tasks(values, folder))
    ) as runs:
        results = {run.index: run.result for run in runs}
    return [results[index] for index in range(len(values))]


def wait_until(condition: Callable[[], bool]) -> None:
    """Wait for half a minute at most."""
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def expected(values: list[float]) -> list[RunResult]:
    return [quick_run(list_study(*values), (value,), None) for value in values]


# Addresses


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("127.0.0.1:8786", "tcp://127.0.0.1:8786"),
        ("localhost:8786", "tcp://localhost:8786"),
        ("tcp://127.0.0.1:8786/", "tcp://127.0.0.1:8786"),
        ("tcp://[::1]:8786", "tcp://[::1]:8786"),
        ("tls://node1.example:8786", "tls://node1.example:8786"),
        *((f"{host}:1", f"tcp://{host}:1") for host in ("127.0.0.1", "127.1.2.3", "[::1]")),
    ],
)
def test_reads_addresses(text: str, meant: str) -> None:
    assert check_scheduler(text) == meant


@pytest.mark.parametrize(
    "text",
    [
        *("", "node1", "node1:", ":8786", "node1:0", "node1:99999", "node1:x", "8786"),
        *("no de:8786", "no\nde:8786", "scheduler.json", "ucx://node1:8786", "inproc://1/2/3"),
        *("tcp://node1:8786/path", "tcp://me@node1:8786", "tcp://[::1:8786"),
        "tcp://node1:8786?x=1",
    ],
)
def test_refuses_other_texts(text: str) -> None:
    with pytest.raises(UsageError, match="HOST:PORT"):
        check_scheduler(text, insecure=True)


@given(st.text())
def test_any_text_is_an_address_or_refused(text: str) -> None:
    try:
        address = check_scheduler(text, insecure=True)
    except UsageError:
        return
    assert check_scheduler(address, insecure=True) == address


@pytest.mark.parametrize("host", ["node1", "10.0.0.1", "0.0.0.0", "[2001:db8::1]", "localhost.ab"])
def test_refuses_a_plain_address_of_another_machine(host: str) -> None:
    with pytest.raises(UsageError, match=r"not encrypted.*tls://.*--insecure"):
        check_scheduler(f"tcp://{host}:8786")
    assert check_scheduler(f"tcp://{host}:8786", insecure=True)
    assert check_scheduler(f"tls://{host}:8786")


def test_an_address_is_checked_before_the_first_run() -> None:
    with pytest.raises(UsageError):
        run_on_cluster("node1:8786")


@pytest.mark.parametrize("library", ["dask.distributed", "cryptography"])
def test_says_what_to_install(library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, library.removeprefix("dask."), None)
    with pytest.raises(NotInstalledError, match=rf'{library}: .*pip install -e "\.\[cluster\]"'):
        check_scheduler("local")
    if library == "cryptography":  # which only certificates need
        assert check_scheduler("127.0.0.1:8786")


# A cluster of two processes, one of which is killed in mid-run, and once more in the same run

VALUES = [*(0.5 + 0.04 * k for k in range(5)), POISON, *(1.5 + 0.04 * k for k in range(9)), REAL]
DEADLY = VALUES.index(POISON)


@dataclass(frozen=True)
class Killed:
    """Runs of which one killed its worker twice, and one was simulated.

    Attributes:
        rows: by index.
        attempts: number of times that the run was carried out.
        listening: addresses at which the command and its processes listened.
        addresses: of the scheduler and of the nannies and workers.
        accepted: descriptions of the strangers that got an answer from one of these addresses.
        survivors: processes that were there after the runs.
        printed: on the standard streams.
    """

    rows: list[RunResult]
    attempts: int
    listening: set[str]
    addresses: list[str]
    accepted: list[str]
    survivors: list[int]
    printed: str


def strangers() -> dict[str, tuple[str, Any]]:
    """Protocol and identity of clients that do not belong to a cluster."""
    return {
        "without encryption": ("tcp", distributed.Security()),
        "with a certificate of its own": ("tls", distributed.Security.temporary()),
        "without a certificate": ("tls", None),
    }


async def answers(address: str, protocol: str, security: Any) -> bool:
    """Return whether a server of Dask answers a call."""
    host = address.split("://")[1]
    if security is None:  # speaks TLS, and does not look at the server's certificate
        context = ssl.create_default_context()
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        options = {"ssl_context": context}
    else:
        options = security.get_connection_args("client")
    try:
        async with asyncio.timeout(5.0):
            server = await distributed.comm.connect(f"{protocol}://{host}", timeout=2.0, **options)
            await server.write({"op": "identity", "reply": True})
            return "id" in await server.read()
    except (OSError, TypeError, ValueError):  # the last ones of a plain server
        return False


async def accepted_strangers(addresses: list[str]) -> list[str]:
    """Descriptions of the strangers that get an answer from one of these addresses."""
    tried = {
        f"{address} {stranger}": answers(address, protocol, security)
        for address in addresses
        for stranger, (protocol, security) in strangers().items()
    }
    found = await asyncio.gather(*tried.values())
    return [name for name, answer in zip(tried, found, strict=True) if answer]


@contextmanager
def time_out(seconds: float, message: Callable[[], str]) -> Iterator[None]:
    """Interrupt the block after a time, as Ctrl-C does, and fail with a message."""
    timer = threading.Timer(seconds, signal.raise_signal, [signal.SIGINT])
    timer.start()
    try:
        yield
    except KeyboardInterrupt:
        if timer.is_alive():
            raise
        pytest.fail(f"after {seconds:.0f} s {message()}")
    finally:
        timer.cancel()


@contextmanager
def streams_in(file: Path) -> Iterator[None]:
    """Write the standard streams of this process, and of those that it starts, into a file."""
    before = [os.dup(number) for number in (1, 2)]
    with file.open("w") as stream:
        for number in (1, 2):
            os.dup2(stream.fileno(), number)
    try:
        yield
    finally:
        for number, old in zip((1, 2), before, strict=True):
            os.dup2(old, number)
            os.close(old)


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> Killed:
    printed = tmp_path_factory.mktemp("printed") / "streams.txt"
    motions = tmp_path_factory.mktemp("motions")
    this = psutil.Process()
    others = set(this.children())
    results: dict[int, RunResult] = {}
    listening: set[str] = set()
    addresses: list[str] = []
    accepted: list[str] = []
    engine = run_on_cluster("local", jobs=2, run=deadly_run)
    runs = engine(list_study(*VALUES), tasks(VALUES, motions))

    def missing() -> str:
        left = sorted(set(range(len(VALUES))) - results.keys())
        return f"runs {left} have no result: was the death of a worker not noticed?"

    with time_out(240.0, missing), streams_in(printed), closing(runs):
        for run in runs:
            results[run.index] = run.result
            if len(results) == 1:
                started = set(this.children()) - others
                workers = [one for one in started if "spawn_main" in " ".join(one.cmdline())]
                assert len(workers) == 2
                for each in [this, *workers]:
                    found = each.net_connections("inet")
                    listening |= {one.laddr.ip for one in found if one.status == "LISTEN"}
                    ports = [one.laddr.port for one in found if one.status == "LISTEN"]
                    addresses += [f"tls://127.0.0.1:{port}" for port in ports]
                accepted += asyncio.run(accepted_strangers(addresses))
                (motions / BEGIN).touch()
    return Killed(
        [results[index] for index in range(len(VALUES))],
        len((motions / f"{DEADLY:03}").read_text().split()),
        listening,
        addresses,
        accepted,
        [one.pid for one in set(this.children()) - others if "spawn_main" in str(one.cmdline())],
        printed.read_text(),
    )


def test_gives_the_rows_of_this_machine_although_workers_were_killed(killed: Killed) -> None:
    values = [value for value in VALUES if value not in (POISON, REAL)]
    rows = [row for row, value in zip(killed.rows, VALUES, strict=True) if value in values]
    assert rows == expected(values)
    assert killed.rows[-1] == run_case(list_study(*VALUES), (REAL,))
    assert killed.rows[-1].outcome == "done"


def test_a_run_that_kills_its_worker_twice_is_a_row(killed: Killed) -> None:
    row = killed.rows[DEADLY]
    assert (row.outcome, row.measures) == (DIED, {"swing": None, "end": None})
    assert killed.attempts == 2


def test_listens_on_the_loopback_interface_only(killed: Killed) -> None:
    assert killed.listening == {"127.0.0.1"}


def test_answers_nobody_without_its_certificate(killed: Killed) -> None:
    assert len(killed.addresses) >= 4  # a scheduler, two workers, a nanny at least
    assert killed.accepted == []


def test_strangers_are_answered_by_a_cluster_without_certificates(address: str) -> None:
    assert asyncio.run(answers(address, *strangers()["without encryption"]))


def test_leaves_no_process(killed: Killed) -> None:
    assert killed.survivors == []


def test_prints_nothing(killed: Killed) -> None:
    assert killed.printed == ""


SLOW_SWEEP = """
import sys
from pathlib import Path
from generator.study.cluster import run_on_cluster
from generator.study.worker_pool import Task
from tests.study_runs import SLOW, list_study, quick_run
tasks = [Task(index, (SLOW,), Path(sys.argv[1], str(index))) for index in range(4)]
if __name__ == "__main__":
    try:
        list(run_on_cluster("local", jobs=2, run=quick_run)(list_study(*[SLOW] * 4), tasks))
    except KeyboardInterrupt:
        sys.exit(3)
"""


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of a group of processes")
def test_ctrl_c_ends_all_processes_at_once(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", SLOW_SWEEP, str(tmp_path)],
        env=ENVIRONMENT,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    wait_until(lambda: len(processes_of(tmp_path)) == 2)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal sends it, to all of them
    _, printed = process.communicate(timeout=30.0)  # the runs take longer
    assert (process.returncode, printed) == (3, b"")
    assert not any(map(is_running, processes_of(tmp_path)))


# Executors

under_way: list[float] = []
most_at_once: list[int] = []


def watched_run(
    study: Study, values: Sequence[float], keep: Path | None, threads: int = 1
) -> RunResult:
    under_way.append(values[0])
    time.sleep(0.002)
    most_at_once.append(len(under_way))
    under_way.pop()
    return quick_run(study, values, keep)


class Endless(Sequence[Task]):
    """Tasks of so many runs that no list should hold them, of which each is counted."""

    def __init__(self) -> None:
        self.made = 0

    def __len__(self) -> int:
        return 10**9

    def __getitem__(self, index: Any) -> Any:
        self.made += 1
        return Task(index, (float(index),))


def test_any_executor_carries_out_runs(tmp_path: Path) -> None:
    values = [*(0.1 * k for k in range(12)), FAULTY]
    study = list_study(*values)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(2, mp_context=context) as executor:
        runs = run_on_executor(executor, run=quick_run)(study, tasks(values, tmp_path))
        found = {run.index: run.result for run in runs}
    assert [found[index] for index in range(12)] == expected(values[:12])
    assert found[12].outcome == PROGRAM_ERROR
    assert os.getpid() not in processes_of(tmp_path)


def test_few_runs_of_an_executor_are_under_way() -> None:
    made = Endless()
    with ThreadPoolExecutor(2) as executor:
        with closing(
            run_on_executor(executor, lambda: 5, run=watched_run)(list_study(1.0), made)
        ) as runs:
            seen = [next(runs).index for _ in range(40)]
        assert len(set(seen)) == 40
        assert max(seen) < made.made <= 40 + 5
    assert set(most_at_once) == {1}


def test_a_sweep_on_an_executor_writes_the_bytes_of_a_local_one(tmp_path: Path) -> None:
    study = list_study(0.8, 0.9, 1.0)
    with ThreadPoolExecutor(2) as executor:
        run_sweep(study, tmp_path / "executor", run_on_executor(executor))
    run_sweep(study, tmp_path / "local", partial(run_locally, jobs=1))
    tables = [(tmp_path / name / TABLE_NAME).read_bytes() for name in ("executor", "local")]
    assert tables[0] == tables[1]
    assert tables[0].count(b"done") == 3


# A scheduler and workers in this process


@contextmanager
def scheduler(workers: int = 1, threads: int = 1) -> Iterator[Any]:
    with distributed.LocalCluster(
        n_workers=workers,
        threads_per_worker=threads,
        processes=False,
        protocol="tcp",
        host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
    ) as started:
        yield started


@pytest.fixture(scope="module")
def shared() -> Iterator[Any]:
    with scheduler() as started:
        yield started


@pytest.fixture
def address(shared: Any) -> str:
    return shared.scheduler_address


def test_submits_few_runs_at_a_time(shared: Any, address: str) -> None:
    values = [0.1 * k for k in range(60)]
    known: list[int] = []
    needed: list[str] = []
    results: dict[int, RunResult] = {}
    for run in run_on_cluster(address, run=quick_run)(list_study(*values), tasks(values)):
        results[run.index] = run.result
        known.append(len(shared.scheduler.tasks))
        needed += [one.key for one in shared.scheduler.tasks.values() if one.dependents]
    assert [results[index] for index in range(60)] == expected(values)
    assert max(known) < 20
    # What tasks need of others is lost with a worker, and Dask may wait for it without end.
    assert needed == []


def test_simulates_the_study_by_default(address: str) -> None:
    values = [0.5 + 0.04 * k for k in range(24)]
    study = list_study(*values)
    rows = {run.index: run.result for run in run_on_cluster(address)(study, tasks(values))}
    assert [rows[k] for k in range(24)] == [run_case(study, (value,)) for value in values]
    assert len({str(row.measures) for row in rows.values()}) == len(values)
    assert {row.outcome for row in rows.values()} == {"done"}


def test_an_error_of_the_program_is_a_row(address: str) -> None:
    results = rows([1.0, FAULTY, 3.0], address)
    assert [one.outcome for one in results] == ["done", PROGRAM_ERROR, "done"]


def test_a_motion_that_cannot_be_written_ends_the_runs(address: str) -> None:
    with pytest.raises(OSError, match="No space left"):
        rows([1.0, FULL_DISK], address)


def test_motions_need_a_folder_that_workers_see(address: str, tmp_path: Path) -> None:
    with pytest.raises(ClusterError, match=r"does not see the folder.*workers share"):
        rows([1.0], address, tmp_path / "elsewhere")


def test_workers_need_the_same_versions(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    actual = cluster.library_versions

    def versions() -> dict[str, str]:  # the worker is a thread here
        is_client = threading.current_thread() is threading.main_thread()
        return {**actual(), "numpy": "0.9"} if is_client else actual()

    monkeypatch.setattr(cluster, "library_versions", versions)
    with pytest.raises(ClusterError, match=r"has numpy \S+ in place of 0\.9"):
        rows([1.0], address)


class Unreadable:
    """A function of a module that a worker does not have."""

    def __reduce__(self) -> Any:
        return import_module, ("no_such_module",)


def test_workers_need_the_program(address: str) -> None:
    with pytest.raises(ClusterError, match="lacks the module `no_such_module`"):
        rows([1.0], address, run=Unreadable())


def test_a_worker_with_several_threads_makes_one_run_at_a_time() -> None:
    values = [0.1 * k for k in range(20)]
    most_at_once.clear()
    with scheduler(threads=3) as started:
        assert rows(values, started.scheduler_address, run=watched_run) == expected(values)
    assert set(most_at_once) == {1}


def test_a_scheduler_without_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "_NO_WORKER_LIMIT", 0.3)
    with (
        scheduler(workers=0) as started,
        pytest.raises(ClusterError, match="start some with"),
    ):
        rows([1.0], started.scheduler_address)


def test_a_scheduler_that_ends_in_mid_run() -> None:
    values = [1.0] * 50
    # A client that looks for its scheduler again gives up soon.
    with dask.config.set({"distributed.comm.timeouts.connect": "1s"}), scheduler() as started:
        engine = run_on_cluster(started.scheduler_address, run=quick_run)
        runs = engine(list_study(*values), tasks(values))
        next(runs)
        started.close()
        with pytest.raises(ClusterError, match="is lost"):
            list(runs)


def test_a_server_that_is_not_a_scheduler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "_CONNECT_LIMIT", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        with pytest.raises(ClusterError, match="does not answer"):
            rows([1.0], f"127.0.0.1:{port}")
    with pytest.raises(ClusterError, match="does not answer"):  # nor does a closed port
        rows([1.0], f"127.0.0.1:{port}")


def test_tls_needs_certificates(address: str, tmp_path: Path) -> None:
    encrypted = address.replace("tcp", "tls")
    with pytest.raises(ClusterError, match=r"distributed\.comm\.tls\.ca-file"):
        rows([1.0], encrypted)
    file = str(tmp_path / "missing.pem")
    with (
        dask.config.set(
            {"distributed.comm.tls.ca-file": file, "distributed.comm.tls.client.cert": file}
        ),
        pytest.raises(ClusterError, match=r"No such file.*distributed\.comm\.tls\.ca-file"),
    ):
        rows([1.0], encrypted)
