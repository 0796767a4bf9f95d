"""Compute blocks of work here, in processes of this machine, or by a Dask scheduler; the results are the same.

A block has its own random seed and depends on nothing else that a worker could change. Results are in the order of the
blocks. If a worker dies, its blocks are given to another. Dask is imported only for a scheduler that a lab has.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from time import perf_counter
from typing import TYPE_CHECKING, TypeVar

from documents.platform import cores
from extensions.power.processes import ComputeError, in_processes

if TYPE_CHECKING:
    from distributed import Client

Block = TypeVar("Block")
Result = TypeVar("Result")
Done = Callable[[int, int], None]

# Two processes need one to three seconds to start and halve the rest: well below this, one process is faster.
WORTH_PROCESSES_S = 12.0
CONNECT_S, FIRST_WORKER_S = 10, 60


def compute(
    work: Callable[[Block], Result],
    blocks: Sequence[Block],
    *,
    scheduler: str | None = None,
    workers: int | None = None,
    done: Done | None = None,
    note: Callable[[str], None] | None = None,
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
        each core if the rest would take it longer than `WORTH_PROCESSES_S`.
    done
        Called after each block with how many blocks are done, and how many there are.
    note
        Called with a sentence if processes could not be started; fewer then do the work, or this one.
    connect_s
        How long to wait for the scheduler to answer, in seconds.

    Raises
    ------
    ComputeError
        If Dask is not installed, the scheduler does not answer or has no workers, or workers die too often at one
        block. An exception from ``work`` is raised unchanged.
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
    left, begun = blocks[len(results) :], len(results)
    if scheduler is None:
        by_place: dict[int, Result] = {}
        for place, result in in_processes(work, left, workers or 1, note or (lambda line: None)):
            by_place[place] = result
            report(begun + len(by_place), len(blocks))
        return results + [by_place[place] for place in range(len(left))]
    with _remote(scheduler, connect_s) as client:
        return results + _on(client, work, left, lambda count: report(begun + count, len(blocks)))


def _here(work: Callable[[Block], Result], blocks: Sequence[Block], processes: int) -> Iterator[Result]:
    """Work in this process until done, or until starting more processes is worth the time."""
    began = perf_counter()
    for count, block in enumerate(blocks):
        left = len(blocks) - count
        if processes > 1 and count and left > 1 and (perf_counter() - began) / count * left > WORTH_PROCESSES_S:
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
def _remote(scheduler: str, connect_s: float) -> Iterator[Client]:
    try:
        from distributed import Client
    except ImportError as error:
        raise ComputeError("--scheduler needs Dask: pip install 'dask[distributed]'") from error
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
