"""The lock of a set: one at a time, whoever comes and goes, and nothing left."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from filelock import Timeout

from stimuli.build.cache import locked


def count_up(folder: Path, times: int) -> None:
    """Read a number and write the next, under the lock: none is lost if only one does so at a time."""
    number = folder / "number"
    for _ in range(times):
        with locked(folder / "set"):
            number.write_text(str(int(number.read_text()) + 1))


@pytest.mark.nightly
def test_processes_take_turns_though_each_removes_the_file(tmp_path: Path) -> None:
    (tmp_path / "number").write_text("0")
    other = multiprocessing.get_context("spawn").Process(target=count_up, args=(tmp_path, 200))
    other.start()
    with ThreadPoolExecutor(2) as pool:
        assert list(pool.map(lambda _: count_up(tmp_path, 200), range(2))) == [None, None]
    other.join()
    assert other.exitcode == 0
    assert (tmp_path / "number").read_text() == "600"
    assert [path.name for path in tmp_path.iterdir()] == ["number"]


def test_a_lock_that_is_held_is_not_waited_for_where_none_is_to(tmp_path: Path) -> None:
    with locked(tmp_path / "set"), pytest.raises(Timeout), locked(tmp_path / "set", wait=False):
        pass
    with pytest.raises(ZeroDivisionError), locked(tmp_path / "set", wait=False):
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
