"""Compute blocks of work here, in processes of this machine, or by a Dask scheduler; the results are the same.

A block has its own random seed and depends on nothing else that a worker could change. Results are in the order of the
blocks. If a worker dies, Dask gives its blocks to another worker and starts a new local process in its place.

Dask is imported only where a cluster is needed. Servers listen on the loopback address alone, and there is no
dashboard.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from time import perf_counter
from typing import TYPE_CHECKING, TypeVar

from documents.platform import cores, interrupts_held

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

Block = TypeVar("Block")
Result = TypeVar("Result")
Done = Callable[[int, int], None]

# Two processes need two to four seconds to start and halve the rest: below this, one process is faster.
WORTH_A_CLUSTER_S = 12.0
RESTART_S = 20.0  # how long workers that died may take to come back before the cluster is closed
CONNECT_S, FIRST_WORKER_S = 10, 60


class ComputeError(Exception):
    """Blocks could not be computed: no scheduler, no worker, or workers that die again and again."""


def compute(
    work: Callable[[Block], Result],
    blocks: Sequence[Block],
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    done: Done | None = None,
    connect_s: float = CONNECT_S,
) -> list[Result]:
    """Return ``work(block)`` of each block, in order.

    Parameters
    ----------
    work
        A function of a module, which workers import by name: a scheduler's workers need the same version installed.
    blocks
        What to work on; each is sent to a worker whole.
    scheduler
        Address of a Dask scheduler, such as ``tcp://10.0.0.5:8786``; None for this machine.
    workers
        How many local processes; 1 works in this process. With None, this process begins, and starts one process for
        each core if the rest would take it longer than `WORTH_A_CLUSTER_S`.
    done
        Called after each block with how many blocks are done, and how many there are.
    connect_s
        How long to wait for the scheduler to answer, in seconds.

    Raises
    ------
    ComputeError
        If the scheduler does not answer or has no workers, or workers die too often at one block. An
        exception from ``work`` is raised unchanged.
    """
    results: list[Result] = []
    report = done or (lambda count, of: None)
    if scheduler is None and (workers is None or workers == 1):
        processes = workers or cores()
        for result in _here(work, blocks, processes):
            results.append(result)
            report(len(results), len(blocks))
        if len(results) == len(blocks):
            return results
        workers = processes
    left = blocks[len(results) :]
    connection = _local(min(workers or 1, len(left))) if scheduler is None else _remote(scheduler, connect_s)
    begun = len(results)
    with connection as client:
        return results + _on(client, work, left, lambda count: report(begun + count, len(blocks)))


def _here(work: Callable[[Block], Result], blocks: Sequence[Block], processes: int) -> Iterator[Result]:
    """Work in this process until done, or until starting more processes is worth the time."""
    began = perf_counter()
    for count, block in enumerate(blocks):
        left = len(blocks) - count
        if processes > 1 and count and left > 1 and (perf_counter() - began) / count * left > WORTH_A_CLUSTER_S:
            return
        yield work(block)


def _on(
    client: Client, work: Callable[[Block], Result], blocks: Sequence[Block], report: Callable[[int], None]
) -> list[Result]:
    from distributed import KilledWorker, as_completed
    from distributed.client import FutureCancelledError

    futures = client.map(work, blocks, pure=False)
    place = {future.key: index for index, future in enumerate(futures)}
    by_place: dict[int, Result] = {}
    try:
        coming = as_completed(futures)
        futures.clear()  # release fetched results: if their worker died, they would be computed again
        for future in coming:
            by_place[place[future.key]] = future.result()
            future.release()
            report(len(by_place))
    except KilledWorker as error:
        raise ComputeError(f"workers died again and again at the same block: {error}") from error
    except (FutureCancelledError, OSError) as error:
        raise ComputeError(f"the connection to the scheduler was lost: {error}") from error
    except ImportError as error:
        raise ComputeError(f"a worker lacks what the work needs (is cyclopean installed there?): {error}") from error
    return [by_place[index] for index in range(len(blocks))]


@contextmanager
def _local(processes: int) -> Iterator[Client]:
    import logging
    from tempfile import TemporaryDirectory

    import dask
    from distributed import Client, LocalCluster

    with ExitStack() as stack:
        scratch = stack.enter_context(TemporaryDirectory(prefix="cyclopean-", ignore_cleanup_errors=True))
        stack.enter_context(dask.config.set(_QUIET))
        cluster: LocalCluster
        # Ctrl-C reaches every process of the terminal. Threads and processes that start while it is blocked never
        # receive it: this process alone does, and ends the others.
        with interrupts_held():
            cluster = stack.enter_context(
                LocalCluster(
                    n_workers=processes,
                    threads_per_worker=1,
                    processes=True,
                    host="127.0.0.1",
                    dashboard_address="127.0.0.1:0",
                    worker_dashboard_address="127.0.0.1:0",
                    local_directory=scratch,
                    silence_logs=logging.CRITICAL,
                )
            )
            client = stack.enter_context(Client(cluster))
        try:
            yield client
        except ComputeError:
            # A worker that is restarting cannot be closed cleanly: wait until all of them are back.
            with suppress(TimeoutError):
                client.wait_for_workers(processes, timeout=RESTART_S)
            raise


@contextmanager
def _remote(scheduler: str, connect_s: float) -> Iterator[Client]:
    from distributed import Client

    try:
        client = Client(scheduler, timeout=connect_s)
    except (OSError, ValueError, TypeError) as error:
        raise ComputeError(f"no Dask scheduler answers at {scheduler}: {error}") from error
    with client:
        try:
            client.wait_for_workers(1, timeout=FIRST_WORKER_S)
        except TimeoutError as error:
            raise ComputeError(f"the scheduler at {scheduler} has no workers") from error
        yield client


_QUIET: dict[str, list[str]] = {"distributed.scheduler.http.routes": [], "distributed.worker.http.routes": []}
