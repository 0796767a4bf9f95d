"""Pieces of work in threads, as many at once as there are processor cores free.

Whoever has pieces of work does them in its own thread and borrows a helper for each core that is free, from one budget
for the whole process, before each piece: so nested work makes no more threads than there are cores, and takes a core as
soon as one is free. NumPy, SciPy, OpenCV and OpenImageIO let other threads run while they compute.

A piece must not depend on the thread that does it, and results come in the order of the pieces: what is computed is
then the same, to the last bit, with any number of threads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from threading import Event, Lock, Thread
from typing import Generic, TypeVar

from documents.platform import cores

Piece = TypeVar("Piece")
Result = TypeVar("Result")

_limit: ContextVar[int | None] = ContextVar("most threads", default=None)
# Whether the thread is one of those that the budget counts.
_counted: ContextVar[bool] = ContextVar("counted as working", default=False)


class _Budget:
    """How many threads of this process are at work on pieces."""

    def __init__(self) -> None:
        self.lock = Lock()
        self.working = 0


_BUDGET = _Budget()


def thread_limit() -> int:
    """Return how many threads pieces are shared among here: by `at_most_threads`, else the cores of this process.

    Returns
    -------
    int
        The number of threads, that of the caller among them.

    Examples
    --------
    >>> thread_limit() >= 1
    True
    """
    limit = _limit.get()
    return cores() if limit is None else limit


@contextmanager
def at_most_threads(number: int | None) -> Iterator[None]:
    """Share pieces of work among at most so many threads in the body.

    Parameters
    ----------
    number
        How many, at least 1; None changes nothing.

    Yields
    ------
    None
        Nothing: the limit holds until the ``with`` block ends.

    Parameters
    ----------
    number
        How many threads, that of the caller among them; at least 1.

    Returns
    -------
    context manager
        The limit holds in its body, and in the threads that help there.

    Raises
    ------
    ValueError
        If ``number`` is below 1.

    Examples
    --------
    >>> with at_most_threads(1):
    ...     thread_limit()
    1
    """
    if number is not None and number < 1:
        raise ValueError(f"at most {number} threads: there must be one at least")
    before = _limit.set(_limit.get() if number is None else number)
    try:
        yield
    finally:
        _limit.reset(before)


def in_threads(work: Callable[[Piece], Result], pieces: Iterable[Piece]) -> list[Result]:
    """Return ``work`` of each piece, in their order, done by as many threads as there are cores free.

    After an error no further piece is begun. Of several errors that of the first piece is raised: it is the one that a
    single thread would meet.

    Parameters
    ----------
    work
        What is done with each piece; several may be under way at once, and in any order.
    pieces
        What the work is divided into, by size alone and never by the number of threads.

    Returns
    -------
    list
        The results, in the order of the pieces.

    Examples
    --------
    >>> in_threads(abs, [-3, 2, -1])
    [3, 2, 1]
    """
    call = _Call(work, list(pieces))
    if len(call.pieces) < 2:
        return [work(piece) for piece in call.pieces]
    counted = _counted.get()
    if not counted:
        with _BUDGET.lock:
            _BUDGET.working += 1
    before = _counted.set(True)
    try:
        return call.results()
    finally:
        _counted.reset(before)
        if not counted:
            with _BUDGET.lock:
                _BUDGET.working -= 1


class _Call(Generic[Piece, Result]):
    """Pieces that several threads take in turn: that of the caller, and helpers."""

    def __init__(self, work: Callable[[Piece], Result], pieces: Sequence[Piece]) -> None:
        self.pieces = pieces
        self._work = work
        self._results: dict[int, Result] = {}
        self._errors: dict[int, BaseException] = {}
        self._begun = 0
        self._at_work = 1
        self._helped = Event()

    def results(self) -> list[Result]:
        """Do all pieces and return their results in order, when no helper is at work any more."""
        self._take_pieces()
        if not self._leaves_last():
            try:
                self._helped.wait()
            except BaseException:
                # Ctrl-C: helpers end after the piece that they are at.
                self._begin_no_more()
                self._helped.wait()
                raise
        if self._errors:
            raise self._errors[min(self._errors)]
        return [self._results[number] for number in range(len(self.pieces))]

    def _take_pieces(self) -> None:
        while True:
            with _BUDGET.lock:
                number = self._begun
                if number == len(self.pieces):
                    return
                self._begun += 1
            self._borrow()
            try:
                self._results[number] = self._work(self.pieces[number])
            except BaseException as error:
                self._errors[number] = error
                self._begin_no_more()

    def _begin_no_more(self) -> None:
        with _BUDGET.lock:
            self._begun = len(self.pieces)

    def _borrow(self) -> None:
        """Start a helper for each free core, as far as there are pieces left."""
        limit = thread_limit()
        while True:
            with _BUDGET.lock:
                left = len(self.pieces) - self._begun
                if left < 1 or _BUDGET.working >= limit:
                    return
                _BUDGET.working += 1
                self._at_work += 1
            try:
                Thread(target=copy_context().run, args=(self._help,), name="helper").start()
            except RuntimeError:  # the system has no more threads
                self._leaves_last()
                return

    def _help(self) -> None:
        self._take_pieces()
        if self._leaves_last():
            # The caller, who waits, goes on in this thread's place, and counts as working again.
            self._helped.set()

    def _leaves_last(self) -> bool:
        """Return whether no other thread is at work on these pieces; if one is, this one's core is free."""
        with _BUDGET.lock:
            self._at_work -= 1
            if self._at_work:
                _BUDGET.working -= 1
            return not self._at_work
