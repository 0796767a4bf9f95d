"""Pieces in threads: each once, in order, with no more threads than cores however they are nested."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from documents import at_most_threads, in_threads, thread_limit
from documents.platform import cores
from documents.threads import _BUDGET


class Crowd:
    """Counts how many threads are inside at once, and the most of them."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.inside, self.most, self.threads = 0, 0, set[int]()

    @contextmanager
    def entered(self) -> Iterator[None]:
        with self._lock:
            self.inside += 1
            self.most = max(self.most, self.inside)
            self.threads.add(threading.get_ident())
        try:
            yield
        finally:
            with self._lock:
                self.inside -= 1


@pytest.fixture(autouse=True)
def nothing_is_left_borrowed() -> Iterator[None]:
    before = _BUDGET.working
    yield
    assert _BUDGET.working == before


@pytest.mark.parametrize("number", [1, 2, 3, 8])
def test_every_piece_is_done_once_and_results_are_in_order(number: int) -> None:
    done: list[int] = []

    def work(piece: int) -> int:
        done.append(piece)
        return piece * piece

    with at_most_threads(number):
        assert in_threads(work, range(200)) == [piece * piece for piece in range(200)]
    assert sorted(done) == list(range(200))
    assert in_threads(work, []) == []


@pytest.mark.parametrize("number", [2, 4])
def test_as_many_threads_as_allowed_work_side_by_side(number: int) -> None:
    meet = threading.Barrier(number, timeout=60)
    with at_most_threads(number):
        # Each piece waits for all others: with fewer threads the barrier would break.
        in_threads(lambda _: meet.wait(), range(3 * number))


@pytest.mark.parametrize("number", [1, 2, 3])
def test_nested_work_never_makes_more_threads_than_allowed(number: int) -> None:
    crowd = Crowd()

    def inner(_: int) -> None:
        with crowd.entered():
            time.sleep(0.001)

    def outer(_: int) -> None:
        in_threads(inner, range(7))

    with at_most_threads(number):
        in_threads(outer, range(5))
    assert crowd.most <= number
    if number == 1:
        assert crowd.threads == {threading.get_ident()}


def test_nested_work_takes_a_core_that_has_become_free() -> None:
    ended, met = threading.Event(), threading.Barrier(2, timeout=60)

    def inner(number: int) -> None:
        if number == 0:
            assert ended.wait(60)
        else:
            met.wait()  # by two threads: the one that ended has lent its core

    def outer(number: int) -> None:
        if number == 0:
            ended.set()
        else:
            in_threads(inner, range(3))

    with at_most_threads(2):
        in_threads(outer, range(2))


def test_the_error_of_the_first_piece_that_fails_is_raised_and_no_more_are_begun() -> None:
    begun: list[int] = []

    def work(piece: int) -> None:
        begun.append(piece)
        time.sleep(0.01 if piece == 3 else 0)
        if piece >= 3:
            raise ValueError(f"piece {piece}")

    for number in (1, 2, 4):
        begun.clear()
        with at_most_threads(number), pytest.raises(ValueError, match="piece 3"):
            in_threads(work, range(1000))
        assert len(begun) <= 3 + number


def test_settings_of_the_caller_hold_in_helpers() -> None:
    met = threading.Barrier(2, timeout=60)

    def limit_and_handling(_: int) -> tuple[int, str]:
        met.wait()
        return thread_limit(), np.geterr()["divide"]

    with at_most_threads(2), np.errstate(divide="raise"):
        assert in_threads(limit_and_handling, range(4)) == [(2, "raise")] * 4


def test_the_limit_is_the_cores_unless_it_is_set() -> None:
    assert thread_limit() == cores()
    with at_most_threads(3):
        with at_most_threads(None):
            assert thread_limit() == 3
        with at_most_threads(1):
            assert thread_limit() == 1
    assert thread_limit() == cores()
    with pytest.raises(ValueError, match="0 threads"), at_most_threads(0):
        pass


def test_where_the_system_has_no_more_threads_one_does_all(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(self: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refused)
    with at_most_threads(4):
        assert in_threads(abs, range(-5, 0)) == [5, 4, 3, 2, 1]
