"""Blocks of work in processes of this machine, each joined to this one by a pipe of its own.

No port is opened and no file is written. A process ends when this one does, however that ends.
"""

from __future__ import annotations

import os
import signal
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any, TypeVar

from documents import WorkError
from documents.platform import interrupts_held
from documents.text import counted

Block = TypeVar("Block")
Result = TypeVar("Result")

MOST_DEATHS = 4  # at one block, then it is given up
END_S = 5.0  # how long a process without work may take to end
# Threads of several processes would wait for each other.
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


class ComputeError(WorkError):
    """Blocks could not be computed: no scheduler, no worker, or workers that die again and again."""


class _Worker:
    """A process and this side of its pipe; ``at`` is the number of its block, None without one."""

    def __init__(self, work: Callable[[Any], Any]) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.at: int | None = None
        self.ready = False
        self.process: SpawnProcess = context.Process(target=_serve, args=(theirs, work), daemon=True)
        try:
            # Ctrl-C reaches every process of the terminal. A process that starts while it is blocked never receives
            # it: this one alone does, and ends the others.
            with interrupts_held():
                self.process.start()
        except BaseException:
            self.pipe.close()
            raise
        finally:
            theirs.close()

    def give(self, place: int, blocks: Sequence[Any]) -> None:
        """Let the process work at a block."""
        self.at = place
        with suppress(OSError):  # it is dead, as reading from it will show
            self.pipe.send(blocks[place])

    def end(self, at_once: bool) -> None:
        """End the process: at once, or when it has read that there is no more work."""
        self.pipe.close()
        if not at_once:
            self.process.join(END_S)
        self.process.kill()
        self.process.join()


def in_processes(
    work: Callable[[Block], Result], blocks: Sequence[Block], processes: int, note: Callable[[str], None]
) -> Iterator[tuple[int, Result]]:
    """Yield the place and the result of each block, as they are done.

    Processes that do not start are a note, and the others do the work; without any it is done in this process. The
    blocks of a process that dies are given to another.

    Raises
    ------
    ComputeError
        If processes died too often at one block. An exception from ``work`` is raised unchanged.
    """
    left, deaths = deque(range(len(blocks))), Counter[int]()
    asked = min(processes, len(blocks))
    with _workers() as workers:
        failed = _start(workers, work, asked)
        while workers and (left or any(worker.at is not None for worker in workers)):
            for pipe in wait([worker.pipe for worker in workers]):
                worker = next(worker for worker in workers if worker.pipe is pipe)
                try:
                    answer = worker.pipe.recv()
                except (EOFError, OSError):
                    workers.remove(worker)
                    worker.end(at_once=True)
                    if worker.at is None:
                        failed += not worker.ready
                        continue
                    deaths[worker.at] += 1
                    if deaths[worker.at] == MOST_DEATHS:
                        what = f"block {worker.at + 1} of {len(blocks)}"
                        raise ComputeError(f"workers died again and again at the same block: {what}") from None
                    left.appendleft(worker.at)
                    _start(workers, work, 1)
                    continue
                if worker.at is None:
                    worker.ready = True
                else:
                    right, result = answer
                    if not right:
                        raise result
                    place, worker.at = worker.at, None
                    yield place, result
            for worker in workers:
                if left and worker.ready and worker.at is None:
                    worker.give(left.popleft(), blocks)
        if failed:
            ready = sum(worker.ready for worker in workers)
            where = counted(ready, "process", "processes") if ready else "this process"
            note(f"{failed} of {asked} processes could not be started: {where} did the work. --workers 1 starts none.")
    for place in left:
        yield place, work(blocks[place])


def _start(workers: list[_Worker], work: Callable[[Any], Any], count: int) -> int:
    """Start so many processes; return how many the system refused."""
    for number in range(count):
        try:
            workers.append(_Worker(work))
        except OSError:
            return count - number
    return 0


@contextmanager
def _workers() -> Iterator[list[_Worker]]:
    workers: list[_Worker] = []
    at_once = True
    try:
        yield workers
        at_once = False
    finally:
        for worker in workers:
            worker.pipe.close()
        for worker in workers:
            worker.end(at_once)


def _serve(pipe: Connection, work: Callable[[Any], Any]) -> None:
    """Compute blocks until the pipe is closed (in the other process)."""
    with suppress(ValueError):
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # where it could not be blocked
    threading.Thread(target=_end_with_parent, daemon=True).start()
    for name in _ONE_THREAD:  # before a block brings NumPy
        os.environ.setdefault(name, "1")
    with suppress(EOFError, OSError):
        pipe.send("ready")
        while True:
            block = pipe.recv()
            try:
                answer = (True, work(block))
            except Exception as error:
                answer = (False, error)
            try:
                pipe.send(answer)
            except OSError:
                return
            except Exception:  # nothing is sent of what cannot be pickled
                pipe.send((False, ComputeError(f"a result cannot be sent to another process: {answer[1]!r}")))


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
