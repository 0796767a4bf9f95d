"""Blocks of work here, in processes and on a scheduler; what goes wrong there is said."""

from __future__ import annotations

import math
import os
import signal
import socket
import subprocess
import sys
import time
from multiprocessing import active_children
from pathlib import Path

import psutil
import pytest

from analysis.power.compute import ComputeError, compute

PROGRAM = """
import os, sys, time
from analysis.power.compute import compute
if __name__ == "__main__":
    def tell(done, of):
        print(done, flush=True)
    compute(time.sleep, [0.2] * 1000, workers=2, done=tell)
"""


def test_results_stand_in_the_order_of_the_blocks(scheduler: str) -> None:
    blocks, told = list(range(20)), []
    expected = [math.factorial(block) for block in blocks]
    assert compute(math.factorial, blocks, workers=1, done=lambda *of: told.append(of)) == expected
    assert told == [(done, 20) for done in range(1, 21)]
    assert compute(math.factorial, blocks) == expected
    told.clear()
    assert compute(math.factorial, blocks, scheduler=scheduler, done=lambda *of: told.append(of)) == expected
    assert told == [(done, 20) for done in range(1, 21)]


def test_nothing_is_started_for_no_work_or_a_little() -> None:
    before = set(active_children())
    started: list[bool] = []
    assert compute(math.factorial, []) == []
    assert compute(math.factorial, [3, 4], done=lambda *_: started.append(set(active_children()) != before)) == [6, 24]
    assert started == [False, False]


def test_what_the_work_raises_comes_through(scheduler: str) -> None:
    for where in ({"workers": 1}, {"scheduler": scheduler}):
        with pytest.raises(ValueError, match=r"math domain error|nonnegative"):
            compute(math.sqrt, [4.0, -1.0], **where)


def test_a_block_that_kills_every_worker_is_given_up() -> None:
    before = set(active_children())
    with pytest.raises(ComputeError, match="workers died again and again"):
        compute(os._exit, [1, 1], workers=2)
    assert set(active_children()) == before


def test_a_scheduler_that_does_not_answer_is_named() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(ComputeError, match=f"no Dask scheduler answers at {address}"):
            compute(math.factorial, [1, 2], scheduler=address, connect_s=1)


@pytest.mark.parametrize("address", ["nonsense://here", "127.0.0.1"])
def test_an_address_that_is_none_is_refused(address: str) -> None:
    with pytest.raises(ComputeError, match="no Dask scheduler answers at"):
        compute(math.factorial, [1, 2], scheduler=address, connect_s=1)


@pytest.mark.skipif(sys.platform == "win32", reason="signals and process groups of POSIX")
def test_ctrl_c_ends_all_processes_quickly_and_without_noise(tmp_path: Path) -> None:
    script = tmp_path / "program.py"
    script.write_text(PROGRAM)
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    with subprocess.Popen(
        [sys.executable, str(script)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
        start_new_session=True,
    ) as program:
        begun_s = time.monotonic()
        assert program.stdout is not None
        assert program.stdout.readline() == "1\n"
        started_s = time.monotonic() - begun_s
        mine = [psutil.Process(program.pid), *psutil.Process(program.pid).children(recursive=True)]
        assert len(mine) >= 3
        listening = [place for one in mine for place in one.net_connections("inet") if place.status == "LISTEN"]
        assert listening
        assert {place.laddr.ip for place in listening} == {"127.0.0.1"}
        begun_s = time.monotonic()
        os.killpg(program.pid, signal.SIGINT)  # as a terminal does
        _, told = program.communicate(timeout=300)
    # The work would go on for 100 s. Where the machine is so busy that starting takes long, so may the end.
    assert time.monotonic() - begun_s < max(20, 3 * started_s)
    assert told.count("Traceback") == 1  # the program's own
    assert told.rstrip().endswith("KeyboardInterrupt")
    _, alive = psutil.wait_procs(mine, timeout=60)
    assert alive == []
