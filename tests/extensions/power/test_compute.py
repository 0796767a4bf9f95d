"""Blocks of work here and in processes, and schedulers that do not answer; what goes wrong there is said."""

from __future__ import annotations

import math
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from multiprocessing import active_children
from multiprocessing.context import SpawnContext, SpawnProcess
from pathlib import Path

import psutil
import pytest

from extensions.power import ComputeError
from extensions.power.compute import compute
from tests.choice import nightly

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals and process groups of POSIX")


PROGRAM = """
import os, sys, time
from extensions.power.compute import compute
if __name__ == "__main__":
    def tell(done, of):
        print(done, flush=True)
    compute(time.sleep, [0.1] + [1000.0] * 9, workers=2, done=tell, note=print)
"""


def test_results_stand_in_the_order_of_the_blocks() -> None:
    blocks, told = list(range(20)), []
    expected = [math.factorial(block) for block in blocks]
    assert compute(math.factorial, blocks, workers=1, done=lambda *of: told.append(of)) == expected
    assert told == [(done, 20) for done in range(1, 21)]
    assert compute(math.factorial, blocks) == expected


def test_nothing_is_started_for_no_work_or_a_little() -> None:
    before = set(active_children())
    started: list[bool] = []
    assert compute(math.factorial, []) == []
    assert compute(math.factorial, [3, 4], done=lambda *_: started.append(set(active_children()) != before)) == [6, 24]
    assert started == [False, False]


def test_what_the_work_raises_comes_through() -> None:
    with pytest.raises(ValueError, match=r"math domain error|nonnegative"):
        compute(math.sqrt, [4.0, -1.0], workers=1)


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


class Program:
    """A program whose two processes have done a block and work for 1000 s at the next, and all its processes."""

    def __init__(self, folder: Path) -> None:
        script = folder / "program.py"
        script.write_text(PROGRAM)
        self.temporary = folder / "temporary"
        self.temporary.mkdir()
        environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3]), "TMPDIR": str(self.temporary)}
        begun_s = time.monotonic()
        self.caller = subprocess.Popen(
            [sys.executable, str(script)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
            start_new_session=True,
        )
        assert self.caller.stdout is not None
        assert self.caller.stdout.readline() == "1\n"
        self.started_s = time.monotonic() - begun_s
        self.processes = [
            psutil.Process(self.caller.pid),
            *psutil.Process(self.caller.pid).children(recursive=True),
        ]
        assert len(self.processes) >= 3

    def ended(self) -> str:
        """Return what it wrote to its error stream, when no process and no file of it is left."""
        _, told = self.caller.communicate(timeout=120)
        _, alive = psutil.wait_procs(self.processes, timeout=60)
        assert alive == []
        assert list(self.temporary.iterdir()) == []
        return told


@pytest.fixture
def program(tmp_path: Path) -> Iterator[Program]:
    """A program at work, ended at the latest when the test is over."""
    started = Program(tmp_path)
    yield started
    for process in started.processes:
        with suppress(psutil.NoSuchProcess):
            process.kill()
    started.caller.communicate()


@posix
def test_ctrl_c_ends_all_processes_quickly_and_without_noise(program: Program) -> None:
    begun_s = time.monotonic()
    os.killpg(program.caller.pid, signal.SIGINT)  # as a terminal does
    told = program.ended()
    # Where the machine is so busy that starting takes long, so may the end.
    assert time.monotonic() - begun_s < max(20, 3 * program.started_s)
    assert told.count("Traceback") == 1  # the program's own
    assert told.rstrip().endswith("KeyboardInterrupt")


@posix
def test_no_port_is_open_while_processes_work(program: Program) -> None:
    assert [place for process in program.processes for place in process.net_connections("inet")] == []
    named = [
        place.laddr
        for process in program.processes
        for place in process.net_connections("unix")
        if place.laddr and place.laddr != "/dev/log"
    ]
    assert named == []  # nor a socket that another user could find by its name


@pytest.mark.nightly
@posix
def test_a_killed_caller_leaves_nothing(program: Program) -> None:
    program.caller.kill()
    program.ended()


@pytest.mark.nightly
@posix
def test_the_work_of_a_killed_process_is_given_to_another(tmp_path: Path) -> None:
    before = set(active_children())
    flags = [str(tmp_path / f"{number}") for number in range(4)]
    told: list[str] = []
    assert compute(_die_once, flags, workers=2, note=told.append) == flags
    assert told == []
    assert set(active_children()) == before


def _die_once(flag: str) -> str:
    """Kill this process at the first call."""
    if not Path(flag).exists():
        Path(flag).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return flag


class Refusing(SpawnProcess):
    """A process that starts only while ``allowed`` lasts."""

    allowed = 0

    def start(self) -> None:
        if Refusing.allowed == 0:
            raise BlockingIOError(11, "Resource temporarily unavailable")
        Refusing.allowed -= 1
        super().start()


@pytest.mark.parametrize(
    ("allowed", "who"), [*nightly((0, "this process did")), (1, "1 process did"), *nightly((2, "2 processes did"))]
)
def test_processes_that_the_system_refuses_are_a_note_and_fewer(
    monkeypatch: pytest.MonkeyPatch, allowed: int, who: str
) -> None:
    monkeypatch.setattr(SpawnContext, "Process", Refusing)
    monkeypatch.setattr(Refusing, "allowed", allowed)
    told: list[str] = []
    blocks = list(range(40 if allowed == 2 else 3))  # so many that both are ready before the last
    assert compute(_slowly, blocks, workers=3, note=told.append) == blocks
    (note,) = told
    assert note.startswith(f"{3 - allowed} of 3 processes")
    assert f"{who} the work" in note


def _slowly(number: int) -> int:
    time.sleep(0.1)
    return number


@posix
def test_processes_that_die_at_their_start_are_a_note(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("multiprocessing.spawn._python_exe", b"/bin/false")
    told: list[str] = []
    assert compute(math.factorial, [3, 4, 5], workers=2, note=told.append) == [6, 24, 120]
    assert told[0].startswith("2 of 2 processes")


def test_a_result_that_cannot_be_sent_is_named() -> None:
    with pytest.raises(ComputeError, match="cannot be sent to another"):
        compute(_view, [b"1", b"2"], workers=2)


def _view(block: bytes) -> memoryview:
    return memoryview(block)


def test_without_dask_a_scheduler_is_refused_with_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ComputeError, match=r"pip install .*dask\[distributed\]"):
        compute(math.factorial, [1, 2], scheduler="tcp://127.0.0.1:1")
