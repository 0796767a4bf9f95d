"""Processes forked from one that has imported the program: a person's session begins without a second of imports.

Nothing is shared but what was imported: each process has an environment, words, a folder and an output of its own, and
glfw, which looks at the environment when it is imported, is imported by each.
"""

from __future__ import annotations

import importlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

ROOT = Path(__file__).parents[1]
# What a session in a window imports, but for the window.
IMPORTED = (
    "numpy",
    "OpenImageIO",
    "PIL.Image",
    "rich.progress",
    "runner.cli.main",
    "runner.cli.commands",
    "runner.session.run",
    "runner.session.picture_source",
    "runner.presenter.presenter",
)
SERVER = """
import sys
sys.path.insert(0, sys.argv[1])
from tests.forked import next_code
exec(compile(next_code(int(sys.argv[2])), "<session>", "exec"), {"__name__": "__main__"})
"""
LONGEST = 1 << 20


class Server:
    """The process that has imported the program."""

    def __init__(self) -> None:
        self.channel, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with other:
            self._process = subprocess.Popen(
                [sys.executable, "-c", SERVER, str(ROOT), str(other.fileno())],
                stdin=subprocess.DEVNULL,
                pass_fds=[other.fileno()],
            )

    def close(self) -> None:
        """End it; what was forked goes on."""
        self.channel.close()
        self._process.wait()

    def start(self, code: str, words: Sequence[str], environment: Mapping[str, str]) -> Forked:
        """Run Python ``code`` with ``words`` after its name, as ``python -c`` does."""
        return Forked(self.channel, {"code": code, "words": words, "environment": environment, "folder": os.getcwd()})


class Forked:
    """A forked process, with what tests use of `subprocess.Popen`: its output and its errors are one text."""

    def __init__(self, channel: socket.socket, task: Mapping[str, object]) -> None:
        self._output, output = os.pipe()
        self._status, status = os.pipe()
        socket.send_fds(channel, [json.dumps(task).encode()], [output, status])
        os.close(output)
        os.close(status)
        self.returncode: int | None = None
        self._told = b""
        self._ended = b""
        while b"\n" not in self._ended:
            piece = os.read(self._status, 100)
            assert piece, "the process could not be forked"
            self._ended += piece
        pid, _, self._ended = self._ended.partition(b"\n")
        self.pid = int(pid)

    def poll(self) -> int | None:
        """Return the exit status, None while it runs."""
        return self._wait(0.0)

    def _wait(self, most_s: float) -> int | None:
        if self.returncode is None and select.select([self._status], [], [], most_s)[0]:
            while piece := os.read(self._status, 100):
                self._ended += piece
            self.returncode = int(self._ended)
            os.close(self._status)
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send a signal unless it has ended."""
        if self.poll() is None:
            with suppress(ProcessLookupError):  # it may end between the two
                os.kill(self.pid, number)

    def kill(self) -> None:
        """End it by force."""
        self.send_signal(signal.SIGKILL)

    def communicate(self, timeout: float | None = None) -> tuple[str, None]:
        """Return all that it has written, once it has ended."""
        end_s = time.monotonic() + (1e9 if timeout is None else timeout)
        while self._output >= 0:
            if not select.select([self._output], [], [], max(0.0, end_s - time.monotonic()))[0]:
                raise subprocess.TimeoutExpired("session", timeout or 0.0)
            piece = os.read(self._output, 65536)
            self._told += piece
            if not piece:
                os.close(self._output)
                self._output = -1
        if self._wait(max(0.0, end_s - time.monotonic())) is None:
            raise subprocess.TimeoutExpired("session", timeout or 0.0)
        return self._told.decode(), None


def _reap() -> None:
    """Take notice of those that ended, so that what they took of the processor is counted."""
    with suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def next_code(channel: int) -> str:
    """Import the program, fork for each task that is sent, and return the task's code in the process that is to run it.

    Between that process and this one stands a third, which tells the process's number and, in the end, its exit status.
    """
    for name in IMPORTED:
        importlib.import_module(name)
    assert "glfw" not in sys.modules
    signal.signal(signal.SIGCHLD, lambda *_: _reap())
    with socket.socket(fileno=channel) as asked:
        while True:
            task, (*ends,), _, _ = socket.recv_fds(asked, LONGEST, 2)
            if not task:
                os._exit(0)
            if os.fork() == 0:
                break
            for end in ends:
                os.close(end)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    output, status = ends
    session = os.fork()
    if session:
        os.close(output)
        os.write(status, b"%d\n" % session)
        os.write(status, b"%d" % os.waitstatus_to_exitcode(os.waitpid(session, 0)[1]))
        os._exit(0)
    os.close(status)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.close(output)
    sys.stdout = open(1, "w", closefd=False)  # noqa: SIM115  # as long as the process lives
    sys.stderr = open(2, "w", buffering=1, errors="backslashreplace", closefd=False)  # noqa: SIM115
    given = json.loads(task)
    os.environ.clear()
    os.environ.update(given["environment"])
    os.chdir(given["folder"])
    sys.argv = ["-c", *given["words"]]
    return str(given["code"])
