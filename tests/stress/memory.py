"""The most memory that this process has held, on Linux.

`resource` tells too much of it: a program begins with the peak of the one that started it, and what came before in the
same process cannot be forgotten.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def peak_kb() -> int:
    """Return the peak of resident memory in kilobytes."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="ascii"))
    assert found is not None
    return int(found.group(1))


def forget_peak() -> int:
    """Begin anew from what is held now, and return that in kilobytes."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    return peak_kb()


def run_alone(program: str, *words: object, cwd: Path = ROOT) -> str:
    """Run a ``program`` of Python in a process of its own, in one thread, print what it says and return it."""
    said = subprocess.run(
        [sys.executable, "-c", program, *map(str, words)],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)},
        check=False,
    )
    print(said.stdout, said.stderr)
    assert said.returncode == 0, said.stderr
    return said.stdout


_COMMAND = """
import sys, time
from runner.cli.main import main
from tests.stress.memory import peak_kb
try:
    main()
finally:
    print(f"\\ntook {time.process_time()} {peak_kb()}")
"""


def command_alone(*words: object, cwd: Path = ROOT) -> tuple[str, float, float]:
    """Return what the command says to its standard output, its processor time in s and its peak in MB."""
    said, _, took = run_alone(_COMMAND, *words, cwd=cwd).rpartition("\ntook ")
    seconds, peak = map(float, took.split())
    return said, seconds, peak / 1024
