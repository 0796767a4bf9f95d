"""Count what a command does: files read, models fitted, figures drawn.

Counts are the same in every run, where times are not: a test that pins them sees a change that does needless work.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

_lock = Lock()
_counters: list[Counter[str]] = []


def count_work(what: str, number: int = 1) -> None:
    """Count pieces of work in every `counted_work` that is open.

    Parameters
    ----------
    what
        Their kind, such as ``models_fitted``.
    number
        How many, at least 0.
    """
    if _counters:
        with _lock:
            for counter in _counters:
                counter[what] += number


@contextmanager
def counted_work() -> Iterator[Counter[str]]:
    """Count the work of all threads of this process until the ``with`` block ends.

    Yields
    ------
    collections.Counter
        How much was done so far, by kind; work in other processes is not seen.

    Examples
    --------
    >>> with counted_work() as work:
    ...     count_work("models_fitted", 3)
    >>> dict(work)
    {'models_fitted': 3}
    """
    counter: Counter[str] = Counter()
    with _lock:
        _counters.append(counter)
    try:
        yield counter
    finally:
        with _lock:
            _counters[:] = [other for other in _counters if other is not counter]
