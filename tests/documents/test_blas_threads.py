"""One BLAS thread where it is asked for, and as many as before afterwards."""

from __future__ import annotations

from threading import Barrier, Thread

import numpy as np
import pytest
import scipy.linalg.lapack  # noqa: F401, its OpenBLAS is the second one

from documents import one_blas_thread
from documents.blas_threads import blas_threads, prefer_one_blas_thread, set_blas_threads

pytestmark = [
    pytest.mark.usefixtures("blas_threads_kept"),
    pytest.mark.skipif(
        "openblas" not in np.show_config(mode="dicts")["Build Dependencies"]["blas"]["name"],
        reason="NumPy's linear algebra is not OpenBLAS's",
    ),
]


def test_both_libraries_are_found_and_their_threads_restored() -> None:
    set_blas_threads(3)
    assert blas_threads() == [3, 3]
    with one_blas_thread():
        assert blas_threads() == [1, 1]
        with one_blas_thread():
            assert blas_threads() == [1, 1]
        assert blas_threads() == [1, 1]
    assert blas_threads() == [3, 3]


def test_the_last_thread_to_leave_restores() -> None:
    set_blas_threads(2)
    entered, left = Barrier(2, timeout=60), Barrier(2, timeout=60)
    after: list[list[int]] = []

    def first() -> None:
        with one_blas_thread():
            entered.wait()
        after.append(blas_threads())
        left.wait()

    thread = Thread(target=first)
    thread.start()
    with one_blas_thread():
        entered.wait()
        left.wait()
        after.append(blas_threads())
    thread.join()
    assert after == [[1, 1], [1, 1]]
    assert blas_threads() == [2, 2]


def test_what_the_user_asked_for_is_kept() -> None:
    environment: dict[str, str] = {}
    prefer_one_blas_thread(environment)
    assert environment == {"OPENBLAS_NUM_THREADS": "1"}
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
        asked = {name: "4"}
        prefer_one_blas_thread(asked)
        assert asked == {name: "4"}


def test_as_a_decorator_it_is_restored_after_an_error() -> None:
    seen = []

    @one_blas_thread()
    def fails() -> None:
        seen.append(blas_threads())
        raise ValueError

    set_blas_threads(2)
    for _ in range(2):
        with pytest.raises(ValueError):  # noqa: PT011, raised just above
            fails()
    assert seen == [[1, 1], [1, 1]]
    assert blas_threads() == [2, 2]
