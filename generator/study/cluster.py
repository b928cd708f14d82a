"""Runs of a study on a cluster of dask.distributed, a library that is imported on use only.

Whoever reaches a scheduler of Dask can run programs on its workers. Connections to other machines
are therefore encrypted, unless `--insecure` allows others. The loopback interface is open to other
users of the machine: a cluster that is started there accepts a certificate of its command only.
"""

import asyncio
import concurrent.futures
import logging
import pickle
import re
import time
import warnings
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from ipaddress import ip_address
from pathlib import Path
from threading import Condition
from typing import Any, Protocol, cast

from generator.child_processes import blocked_interrupt
from generator.diagnostics import MoverError, NotInstalledError, UsageError, shorten
from generator.study.study import Study
from generator.study.worker_pool import (
    FinishedRun,
    RunFunction,
    Task,
    TaskQueue,
    died_run,
    perform_task,
)
from generator.text_io import os_error_reason

LOCAL = "local"
"""Address of a cluster that is started on this machine for one study."""

_ADDRESS = re.compile(
    r"(?:(?P<protocol>tcp|tls)://)?(?P<host>\[[0-9a-f:.]+\]|[a-z0-9._-]+):(?P<port>[0-9]{1,5})/?",
    re.ASCII | re.IGNORECASE,
)

_CONNECT_LIMIT = 5.0
"""Longest time of connecting to a scheduler [s]."""

_NO_WORKER_LIMIT = 30.0
"""Longest time for which a scheduler may be without workers [s]."""

_WAIT_INTERVAL = 0.1
"""Longest time of waiting for a result before the workers are counted again [s]."""

_COUNT_INTERVAL = 1.0
"""Time between counts of the workers [s]."""

_RUNS_PER_WORKER = 4
"""Number of runs that a worker has at a time, so that it need not wait for the next."""

_DISTRIBUTIONS = ("exudyn-mover", "exudyn", "numba", "numpy", "scipy")
"""Distributions that determine the numbers of a run."""

_QUIET_PROCESS = """\
import os
from generator.child_processes import redirect_output
redirect_output(os.devnull)
"""
"""Module that a worker on this machine loads first: nothing of its output is for the user."""


class ClusterError(MoverError):
    """A cluster cannot make the runs of a study."""


@dataclass(frozen=True)
class SchedulerAddress:
    """Address of a scheduler.

    Attributes:
        protocol: "tcp" or "tls".
        host: name or number.
        port: of the host.
    """

    protocol: str
    host: str
    port: int

    def __str__(self) -> str:
        """As Dask writes it."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.protocol}://{host}:{self.port}"

    @property
    def is_on_this_machine(self) -> bool:
        """Return whether the address is one of the loopback interface."""
        with suppress(ValueError):
            return ip_address(self.host).is_loopback
        return self.host == "localhost"


def parse_address(text: str, *, insecure: bool = False) -> SchedulerAddress:
    """Return the address of a scheduler: HOST:PORT, tcp://HOST:PORT or tls://HOST:PORT.

    Args:
        text: the address.
        insecure: accept plain connections to other machines.

    Raises:
        UsageError: malformed, or a plain connection to another machine.
    """
    match = _ADDRESS.fullmatch(text)
    if match is None or not 0 < int(match["port"]) < 65536:
        raise UsageError(
            "the scheduler's address is HOST:PORT, tcp://HOST:PORT or tls://HOST:PORT, "
            f"not `{shorten(text)}`"
        )
    host = match["host"].strip("[]")
    address = SchedulerAddress((match["protocol"] or "tcp").lower(), host, int(match["port"]))
    if address.protocol == "tcp" and not address.is_on_this_machine and not insecure:
        raise UsageError(
            f"{address} is on another machine and not encrypted: whoever reaches a scheduler can "
            "run programs with your rights; use tls://, or --insecure in a network that you trust"
        )
    return address


def check_scheduler(address: str, *, insecure: bool = False) -> SchedulerAddress | None:
    """Return the address of a scheduler, or None for "local", without connecting to it.

    Raises:
        UsageError: see `parse_address`.
        NotInstalledError: Dask is not installed, or what certificates of "local" need.
    """
    scheduler = None if address == LOCAL else parse_address(address, insecure=insecure)
    try:
        import_module("distributed")
        if scheduler is None:
            import_module("cryptography")
    except ModuleNotFoundError as failure:
        if failure.name not in ("distributed", "dask", "cryptography"):
            raise
        library = "cryptography" if failure.name == "cryptography" else "dask.distributed"
        message = (
            f'a cluster needs {library}: in the project\'s folder, `pip install -e ".[cluster]"`'
        )
        raise NotInstalledError(message) from None
    return scheduler


def run_on_cluster(
    study: Study,
    tasks: Sequence[Task],
    address: str,
    *,
    jobs: int = 1,
    insecure: bool = False,
    run: RunFunction | None = None,
) -> Generator[FinishedRun]:
    """Carry out tasks on a cluster, and yield each result as it arrives, in any order.

    A task whose worker dies is repeated, the last time while nothing else runs, before it counts
    as died. Closing the generator, or an exception such as that of Ctrl-C, gives up the rest.

    Args:
        study: that the runs belong to.
        tasks: runs to carry out.
        address: of the scheduler, or "local" for a cluster on this machine.
        jobs: number of processes of a cluster on this machine.
        insecure: accept a plain connection to another machine.
        run: function that carries out a run [default: `run_case`].

    Raises:
        UsageError, NotInstalledError: see `check_scheduler`.
        ClusterError: the scheduler or its workers cannot be used; raised during the runs.
        OSError: a motion cannot be written; raised during the runs.
    """
    scheduler = check_scheduler(address, insecure=insecure)
    if run is None:
        from generator.study.run_case import run_case

        run = run_case
    return _run_tasks(study, tasks, scheduler, jobs, run)


def _run_tasks(
    study: Study,
    tasks: Sequence[Task],
    address: SchedulerAddress | None,
    jobs: int,
    run: RunFunction,
) -> Generator[FinishedRun]:
    if not tasks:
        return
    with ExitStack() as stack:
        stack.enter_context(_quiet_logs())
        if address is None:
            client = stack.enter_context(_local_cluster(jobs))
        else:
            client = stack.enter_context(_connection(address))
        runs = _Runs(client, study, run, address)
        suspects: list[Task] = []
        for task, finished in runs.make(tasks):
            if finished is None:
                suspects.append(task)
            else:
                yield finished
        # Of the runs on a worker that died, those that were waiting there are innocent.
        for task, finished in runs.make(suspects, at_a_time=1):
            yield finished or died_run(study, task)


class _Future(Protocol):
    """A task of the cluster."""

    key: str
    status: str


class _Completed(Protocol):
    """Tasks of the cluster in the order in which they end, with their results or failures."""

    thread_condition: Condition

    def add(self, future: _Future) -> None: ...

    def has_ready(self) -> bool: ...

    def __next__(self) -> tuple[_Future, object]: ...


class _Client(Protocol):
    """Connection to a scheduler."""

    loop: object

    def submit(self, function: Callable[..., object], /, *args: object, pure: bool) -> _Future: ...

    def nthreads(self) -> Mapping[str, int]: ...

    def close(self) -> None: ...


class _Runs:
    """Runs of one study on a cluster."""

    def __init__(
        self,
        client: _Client,
        study: Study,
        run: RunFunction,
        address: SchedulerAddress | None,
    ) -> None:
        self._client = client
        if address is None:
            self._scheduler, self._remedy = "the cluster on this machine", "use --jobs alone"
        else:
            self._scheduler = f"the scheduler at {address}"
            self._remedy = "start some with `dask worker`"
        self._run = run
        self._payload = pickle.dumps(study)
        self._study = self._send_study()
        self._versions = library_versions()
        self._workers = 0
        self._counted = 0.0
        self._seen_worker = time.monotonic()

    def make(
        self, tasks: Sequence[Task], at_a_time: int | None = None
    ) -> Iterator[tuple[Task, FinishedRun | None]]:
        """Yield each task when it is finished, with None if its worker died.

        Args:
            tasks: of the runs.
            at_a_time: largest number of runs under way [default: a few per worker].
        """
        from distributed import KilledWorker, as_completed

        waiting = TaskQueue(tasks)
        running: dict[str, tuple[Task, _Future]] = {}
        completed = cast(
            _Completed, as_completed(loop=self._client.loop, with_results=True, raise_errors=False)
        )
        while waiting or running:
            self._count_workers()
            limit = at_a_time or max(1, _RUNS_PER_WORKER * self._workers)
            while waiting and len(running) < limit:
                task = waiting.popleft()
                sent = task if task.keep is None else replace(task, keep=task.keep.resolve())
                future = self._client.submit(
                    _run_on_worker, self._run, self._study, sent, self._versions, pure=False
                )
                running[future.key] = task, future
                completed.add(future)
            if not completed.has_ready():
                with completed.thread_condition:
                    completed.thread_condition.wait(_WAIT_INTERVAL)
                continue
            future, outcome = next(completed)
            task, _ = running.pop(future.key)
            if isinstance(outcome, FinishedRun):
                yield task, outcome
                continue
            failure = _failure_of(outcome)
            if not isinstance(failure, KilledWorker):
                raise self._explain(failure)
            if failure.task == self._study.key:
                self._study = self._send_study()
                waiting.put_back([task])
            else:
                yield task, None

    def _send_study(self) -> _Future:
        """Send the study, which each worker reads once, and again if it is lost with its worker."""
        return self._client.submit(pickle.loads, self._payload, pure=False)

    def _count_workers(self) -> None:
        """Raise ClusterError if the cluster has had no workers for long."""
        now = time.monotonic()
        if now < self._counted + _COUNT_INTERVAL and self._workers:
            return
        try:
            self._workers, self._counted = len(self._client.nthreads()), now
        except OSError:
            raise self._lost() from None
        if self._workers:
            self._seen_worker = now
        elif now > self._seen_worker + _NO_WORKER_LIMIT:
            raise ClusterError(
                f"{self._scheduler} has had no workers for {_NO_WORKER_LIMIT:.0f} s; {self._remedy}"
            )

    def _lost(self) -> ClusterError:
        return ClusterError(
            f"the connection to {self._scheduler} is lost; the same command continues"
        )

    def _explain(self, failure: BaseException) -> BaseException:
        """Return the error of the command for the failure of a task."""
        if isinstance(failure, asyncio.CancelledError | concurrent.futures.CancelledError):
            return self._lost()
        cause: BaseException | None = failure
        while cause is not None:
            if isinstance(cause, ModuleNotFoundError):
                return ClusterError(
                    f"a worker of {self._scheduler} lacks the module `{cause.name}`; "
                    "install exudyn-mover where the workers run"
                )
            cause = cause.__cause__ or cause.__context__
        return failure


def _failure_of(outcome: object) -> BaseException:
    """Return the exception of a task, which stands alone or between its type and its traceback."""
    found = cast("tuple[object, ...]", outcome)[1] if isinstance(outcome, tuple) else outcome
    assert isinstance(found, BaseException)
    return found


def _run_on_worker(
    run: RunFunction, study: Study, task: Task, versions: Mapping[str, str]
) -> FinishedRun:
    """Carry out a task, in a worker."""
    _check_worker(tuple(versions.items()))
    if task.keep is not None and not task.keep.parent.is_dir():
        raise ClusterError(
            f"the worker {_worker_name()} does not see the folder `{task.keep.parent}`; motions "
            "are kept in a folder that all workers share"
        )
    return perform_task(run, study, task)


@cache
def _check_worker(expected: tuple[tuple[str, str], ...]) -> None:
    """Raise ClusterError if this worker would give other rows than the client."""
    from distributed import get_worker

    here = library_versions()
    differences = [
        f"{name} {here[name]} in place of {wanted}"
        for name, wanted in expected
        if here[name] != wanted
    ]
    if differences:
        raise ClusterError(
            f"the worker {_worker_name()} has {', '.join(differences)}: its rows may differ from "
            "those made here; install the same versions"
        )
    threads = get_worker().state.nthreads
    if threads > 1:
        raise ClusterError(
            f"the worker {_worker_name()} has {threads} threads, but a process makes one run at a "
            f"time; start it with `dask worker --nworkers {threads} --nthreads 1`"
        )


def _worker_name() -> str:
    from distributed import get_worker

    return get_worker().address


def library_versions() -> dict[str, str]:
    """Return the versions of the distributions that determine the numbers of a run."""
    found: dict[str, str] = {}
    for name in _DISTRIBUTIONS:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "(not installed)"
    return found


@contextmanager
def _connection(address: SchedulerAddress) -> Generator[_Client]:
    """Connect to a scheduler for the time of a block. Raises ClusterError."""
    from distributed import Client
    from distributed.security import Security

    security: Any = Security()
    if address.protocol == "tls":
        _check_certificates(security)
    try:
        _shake_hands(address, security)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # other versions of libraries of Dask's
            client: Any = Client(
                str(address), timeout=_CONNECT_LIMIT, security=security, set_as_default=False
            )
    except TimeoutError:
        raise ClusterError(f"a scheduler does not answer at {address}") from None
    except (OSError, ImportError) as failure:
        raise ClusterError(f"{address} cannot be used: {_reason(failure)}") from None
    try:
        yield client
    finally:
        client.close()


def _shake_hands(address: SchedulerAddress, security: Any) -> None:
    """Connect to a scheduler once. Raises TimeoutError for a server that is not Dask's.

    A client of Dask waits for such a server without end.
    """
    from distributed.comm import core

    connect = cast(Any, core).connect

    async def connect_once() -> None:
        options = security.get_connection_args("client")
        async with asyncio.timeout(_CONNECT_LIMIT):
            connection = await connect(str(address), timeout=_CONNECT_LIMIT, **options)
            await connection.close()

    # In a notebook, this thread runs an event loop already.
    with concurrent.futures.ThreadPoolExecutor(1) as thread:
        thread.submit(asyncio.run, connect_once()).result()


def _check_certificates(security: Any) -> None:
    """Raise ClusterError if a certificate of the client is missing."""
    files = (security.tls_ca_file, security.tls_client_cert, security.tls_client_key)
    if not all(files[:2]):
        raise ClusterError(
            "tls:// needs certificates, which Dask's configuration names: "
            "distributed.comm.tls.ca-file, .client.cert and .client.key"
        )
    for file in filter(None, files):
        is_path = "\n" not in file  # else the certificate itself
        if is_path and not Path(file).is_file():
            raise ClusterError(f"Dask's configuration names `{file}`, which is missing")


def _reason(failure: BaseException) -> str:
    """Reason of a failed connection, which Dask wraps in a description of its sockets."""
    while failure.__cause__ is not None:
        failure = failure.__cause__
    if isinstance(failure, OSError) and failure.strerror:
        return os_error_reason(failure)
    return next(iter(str(failure).splitlines()), type(failure).__name__)


@contextmanager
def _local_cluster(jobs: int) -> Generator[_Client]:
    """Start a cluster of processes on this machine for the time of a block.

    It listens on the loopback interface only, and there to holders of its certificate only, which
    exists in the memory of this process and of the workers.
    """
    from dask import config
    from distributed import Client, LocalCluster
    from distributed.security import Security

    settings: dict[str, object] = {
        "distributed.comm.require-encryption": True,
        "distributed.scheduler.http.routes": [],
        "distributed.worker.http.routes": [],
        "distributed.worker.preload": [],
        "distributed.worker.profile.enabled": False,
    }
    security: Any = cast(Any, Security).temporary()
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
            preload=[_QUIET_PROCESS],
        )
        client: Any = Client(cluster, security=security, set_as_default=False)
    try:
        yield client
    finally:
        _end_workers(cluster)
        client.close()
        cluster.close()


def _end_workers(cluster: Any) -> None:
    """End the processes of a cluster at once; Dask would wait for the runs under way."""
    import psutil

    for nanny in list(cluster.workers.values()):
        nanny.close_gracefully()
        with suppress(psutil.Error, AttributeError):
            if nanny.pid:
                psutil.Process(nanny.pid).kill()


@contextmanager
def _quiet_logs() -> Generator[None]:
    """Silence Dask, which reports lost workers and ended connections on many lines."""
    import distributed as _  # noqa: F401

    loggers = [
        logger
        for name, logger in logging.root.manager.loggerDict.items()
        if isinstance(logger, logging.Logger)
        and name.split(".")[0] in ("asyncio", "distributed", "tornado")
    ]
    before = [logger.disabled for logger in loggers]
    for logger in loggers:
        logger.disabled = True
    try:
        yield
    finally:
        for logger, disabled in zip(loggers, before, strict=True):
            logger.disabled = disabled
