"""Runs of a study on an executor of `concurrent.futures`, and on one of dask.distributed.

A task carries its study along: a worker that dies takes nothing with it that other tasks need.

Whoever reaches a scheduler of Dask can run programs on its workers. Connections to other machines
are therefore encrypted, unless `--insecure` allows others. The loopback interface is open to other
users of the machine: a cluster that is started there accepts a certificate of its command only.
"""

import asyncio
import logging
import re
import time
import warnings
import zlib
from collections import deque
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import lru_cache
from importlib.metadata import version
from importlib.util import find_spec
from ipaddress import ip_address
from pickle import dumps, loads
from platform import node
from queue import Empty, SimpleQueue
from threading import Lock
from typing import Any, cast

from generator.child_processes import blocked_interrupt, cores
from generator.diagnostics import MoverError, NotInstalledError, UsageError, shorten
from generator.study.study import Study
from generator.study.sweep import Engine
from generator.study.worker_pool import (
    FinishedRun,
    RunFunction,
    Task,
    TaskQueue,
    died_run,
    perform_task,
)

LOCAL = "local"
"""Address of a cluster that is started on this machine for one study."""

_ADDRESS = re.compile(
    r"(?:(tcp|tls)://)?(\[[0-9a-f:.]+\]|[a-z0-9._-]+):([0-9]{1,5})/?", re.ASCII | re.IGNORECASE
)

_CONNECT_LIMIT = 5.0
"""Longest time of connecting to a scheduler [s]."""

_NO_WORKER_LIMIT = 30.0
"""Longest time for which a scheduler may be without workers [s]."""

_RESTART_LIMIT = 180.0
"""The same of a cluster on this machine, which starts others however busy the machine is [s]."""

_RUNS_PER_WORKER = 4
"""Number of runs that a worker has at a time, so that it need not wait for the next."""

_LONGEST_WAIT = 0.1
"""Longest time of waiting for a result [s]: Windows handles Ctrl-C only in between."""

_ONE_RUN = Lock()
"""Held by the run of this process, which makes one at a time, also with several threads."""


class ClusterError(MoverError):
    """A cluster cannot make the runs of a study."""


def run_on_executor(
    executor: Executor,
    limit: Callable[[], int] = lambda: _RUNS_PER_WORKER * cores(),
    *,
    deaths: tuple[type[BaseException], ...] = (),
    run: RunFunction | None = None,
) -> Engine:
    """Return an engine of `run_sweep` that yields each result as it arrives, in any order.

    A task whose worker dies is repeated, alone and after all others, before it counts as died.
    Closing the generator of the engine, or an exception such as that of Ctrl-C, cancels the rest.

    Args:
        executor: Executor with processes as workers, such as a `ProcessPoolExecutor`.
        limit: returns the largest number of tasks under way; called once a second, and may raise
            an exception that ends the runs [default: four per core].
        deaths: exceptions of tasks whose worker died; any other ends the runs.
        run: function that carries out a run [default: `run_case`].

    Raises:
        ClusterError: a worker cannot make the runs; raised during the runs.
        OSError: a motion cannot be written; raised during the runs.
    """

    def carry_out(study: Study, tasks: Sequence[Task]) -> Generator[FinishedRun]:
        from generator.study.run_case import run_case

        job = zlib.compress(dumps((run or run_case, study, library_versions())), 1)
        waiting, suspects, is_retry = TaskQueue(tasks), deque[Task](), False
        running: dict[Future[FinishedRun], Task] = {}
        ended: SimpleQueue[Future[FinishedRun]] = SimpleQueue()

        def submit(task: Task) -> None:
            running[future := executor.submit(_perform, job, task)] = task
            future.add_done_callback(ended.put)

        largest, next_count = 0, 0.0
        try:
            while waiting or running or suspects:
                if time.monotonic() >= next_count:
                    largest, next_count = limit(), time.monotonic() + 1.0
                while waiting and len(running) < largest:
                    submit(waiting.popleft())
                if suspects and not (waiting or running):
                    # Of the runs on a worker that died, those that waited there are innocent.
                    is_retry = True
                    submit(suspects.popleft())
                try:
                    future = ended.get(timeout=_LONGEST_WAIT)
                except Empty:
                    continue
                task, failure = running.pop(future), future.exception()
                if failure is None:
                    yield future.result()
                elif not isinstance(failure, deaths):
                    raise _explain(failure)
                elif is_retry:
                    yield died_run(study, task)
                else:
                    suspects.append(task)
        finally:
            for future in running:
                future.cancel()

    return carry_out


def _explain(failure: BaseException) -> BaseException:
    """Return the error of the command for that of a task."""
    cause: BaseException | None = failure
    while cause is not None and not isinstance(cause, ModuleNotFoundError):
        cause = cause.__cause__ or cause.__context__
    if cause is None:
        return failure
    return ClusterError(
        f"a worker lacks the module `{cause.name}`; install exudyn-mover where the workers run"
    )


def _perform(job: bytes, task: Task) -> FinishedRun:
    """Carry out a task, in a worker."""
    run, study = _read_job(job)
    if task.keep is not None and not task.keep.parent.is_dir():
        raise ClusterError(
            f"the worker on {node()} does not see the folder `{task.keep.parent}`; motions are "
            "kept in a folder that all workers share"
        )
    with _ONE_RUN:
        return perform_task(run, study, task)


@lru_cache(maxsize=1)
def _read_job(job: bytes) -> tuple[RunFunction, Study]:
    """Return the function and the study of tasks. Raises ClusterError if rows may differ here."""
    run, study, expected = loads(zlib.decompress(job))
    differences = [
        f"{name} {found} in place of {expected[name]}"
        for name, found in library_versions().items()
        if found != expected[name]
    ]
    if differences:
        raise ClusterError(
            f"the worker on {node()} has {', '.join(differences)}: its rows may differ from those "
            "made here; install the same versions"
        )
    return run, study


def library_versions() -> dict[str, str]:
    """Return the versions of the distributions that determine the numbers of a run."""
    names = ("exudyn-mover", "exudyn", "numba", "numpy", "scipy")
    return {name: version(name) for name in names}


def check_scheduler(address: str, *, insecure: bool = False) -> str:
    """Return the address of a scheduler as Dask writes it, or "local", without connecting to it.

    Args:
        address: HOST:PORT, tcp://HOST:PORT, tls://HOST:PORT, or "local".
        insecure: accept plain connections to other machines.

    Raises:
        UsageError: malformed, or a plain connection to another machine.
        NotInstalledError: Dask is not installed, or what certificates of "local" need.
    """
    if address != LOCAL:
        match = _ADDRESS.fullmatch(address)
        if match is None or not 0 < int(match[3]) < 65536:
            raise UsageError(
                "the scheduler's address is HOST:PORT, tcp://HOST:PORT or tls://HOST:PORT, "
                f"not `{shorten(address)}`"
            )
        protocol, host = (match[1] or "tcp").lower(), match[2]
        address = f"{protocol}://{host}:{int(match[3])}"
        if not (insecure or protocol == "tls" or _is_on_this_machine(host)):
            raise UsageError(
                f"{address} is on another machine and not encrypted: whoever reaches a scheduler "
                "can run programs with your rights; use tls://, or --insecure in a network that "
                "you trust"
            )
    for module in ("distributed", "cryptography")[: 2 if address == LOCAL else 1]:
        if find_spec(module) is None:
            library = module.replace("distributed", "dask.distributed")
            raise NotInstalledError(
                f"a cluster needs {library}: in the project's folder, "
                '`pip install -e ".[cluster]"`'
            )
    return address


def _is_on_this_machine(host: str) -> bool:
    with suppress(ValueError):
        return ip_address(host.strip("[]")).is_loopback
    return host == "localhost"


def run_on_cluster(
    address: str, *, jobs: int = 1, insecure: bool = False, run: RunFunction | None = None
) -> Engine:
    """Return an engine as `run_on_executor` does, for the workers of a scheduler of Dask.

    Args:
        address: Address as of `check_scheduler`, which `insecure` belongs to.
        jobs: number of processes of a cluster on this machine.
        insecure: acceptance of a plain connection to another machine.
        run: function that carries out a run [default: `run_case`].

    Raises:
        UsageError, NotInstalledError: see `check_scheduler`.
        ClusterError: the scheduler or its workers cannot be used; raised during the runs.
        OSError: a motion cannot be written; raised during the runs.
    """
    address = check_scheduler(address, insecure=insecure)
    name, remedy = f"the scheduler at {address}", "start some with `dask worker`"
    longest = _NO_WORKER_LIMIT
    if address == LOCAL:
        name, remedy = "the cluster on this machine", "use --jobs alone"
        longest = _RESTART_LIMIT
    lost = ClusterError(f"the connection to {name} is lost; the same command continues")

    def carry_out(study: Study, tasks: Sequence[Task]) -> Generator[FinishedRun]:
        from distributed import CancelledError, KilledWorker
        from distributed.comm.core import CommClosedError

        seen_worker = time.monotonic()

        def limit() -> int:
            nonlocal seen_worker
            try:
                workers = len(client.nthreads())
            except OSError:
                raise lost from None
            if workers:
                seen_worker = time.monotonic()
            elif time.monotonic() > seen_worker + longest:
                raise ClusterError(f"{name} has had no workers for {longest:.0f} s; {remedy}")
            return _RUNS_PER_WORKER * workers

        connection = _local_cluster(jobs) if address == LOCAL else _connection(address)
        with _quiet_logs(), connection as client:
            engine = run_on_executor(_Executor(client), limit, deaths=(KilledWorker,), run=run)
            try:
                yield from engine(study, tasks)
            except (CancelledError, CommClosedError):
                raise lost from None

    return carry_out


class _Executor(Executor):
    """Executor of a client of Dask.

    Dask's own (`Client.get_executor`) raises TypeError where a worker dies while the result of a
    run is fetched from it: it asks for the state of the run again, which is waiting by then.
    """

    def __init__(self, client: Any) -> None:
        self._client = client

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        started = self._client.submit(fn, *args, pure=False, **kwargs)
        ended: Future[Any] = Future()
        ended.set_running_or_notify_cancel()  # the tasks end with the client

        async def follow() -> None:
            try:
                ended.set_result(await started)
            except BaseException as failure:
                ended.set_exception(failure)

        self._client.loop.add_callback(follow)
        return ended


@contextmanager
def _connection(address: str) -> Generator[Any]:
    """Connect to a scheduler for the time of a block. Raises ClusterError."""
    from distributed import Client
    from distributed.comm import core
    from distributed.security import Security

    security: Any = Security()

    async def shake_hands() -> None:  # Dask's client waits without end for another server
        async with asyncio.timeout(_CONNECT_LIMIT):
            options = security.get_connection_args("client")
            await (await cast(Any, core).connect(address, **options)).close()

    try:
        with ThreadPoolExecutor(1) as thread:  # in a notebook, this one runs an event loop already
            thread.submit(asyncio.run, shake_hands()).result()
        with warnings.catch_warnings(action="ignore"):  # other versions of libraries of Dask's
            client: Any = Client(address, security=security, set_as_default=False)
    except TimeoutError:
        raise ClusterError(f"a scheduler does not answer at {address}") from None
    except (OSError, TypeError, ImportError) as failure:  # the second without certificates
        reason = next(iter(str(failure).splitlines()), type(failure).__name__)
        if address.startswith("tls"):
            reason += (
                "; tls:// needs the certificates that Dask's configuration names: "
                "distributed.comm.tls.ca-file, .client.cert and .client.key"
            )
        raise ClusterError(f"{address} cannot be used: {reason}") from None
    with client:
        yield client


@contextmanager
def _local_cluster(jobs: int) -> Generator[Any]:
    """Start a cluster of processes on this machine for the time of a block.

    It listens on the loopback interface only, and there to holders of its certificate only, which
    exists in the memory of this process and of the workers.
    """
    import psutil
    from dask import config
    from distributed import Client, LocalCluster
    from distributed.security import Security

    security: Any = cast(Any, Security).temporary()
    settings: dict[str, object] = {
        "distributed.comm.require-encryption": True,
        "distributed.scheduler.http.routes": [],
        "distributed.worker.http.routes": [],
        "distributed.worker.profile.enabled": False,
    }
    with config.set(settings), blocked_interrupt():
        cluster: Any = LocalCluster(
            n_workers=jobs,
            threads_per_worker=1,
            memory_limit=None,
            host="127.0.0.1",
            protocol="tls",
            dashboard_address="127.0.0.1:0",
            security=security,
            silence_logs=logging.CRITICAL,
            scheduler_kwargs={"allowed_failures": 0, "dashboard": False},
            preload=["import os, generator.child_processes as p\np.redirect_output(os.devnull)\n"],
        )
        client: Any = Client(cluster, security=security, set_as_default=False)
    try:
        yield client
    finally:
        for nanny in list(cluster.workers.values()):  # which would wait for the run under way
            nanny.close_gracefully()
            with suppress(psutil.Error, AttributeError):
                if nanny.pid:
                    psutil.Process(nanny.pid).kill()
        client.close()
        cluster.close()


@contextmanager
def _quiet_logs() -> Generator[None]:
    """Silence Dask, which reports lost workers and ended connections on many lines."""
    names = [*logging.root.manager.loggerDict]
    noisy = [name for name in names if name.split(".")[0] in ("asyncio", "distributed", "tornado")]
    before = {logger: logger.disabled for logger in map(logging.getLogger, noisy)}
    try:
        for logger in before:
            logger.disabled = True
        yield
    finally:
        for logger, disabled in before.items():
            logger.disabled = disabled
