#!/usr/bin/env python3
"""Write tests/slow_files.txt, the files that `make test-fast` leaves out, from what the tests' files cost.

    TIMES=times.tsv python -m pytest -p tools.slow_files
    python tools/slow_files.py times.tsv

A file is slow from `LIMIT_S` on, unless it is the cheapest of its folder and takes no more than `MOST_S`: nearly each
room keeps one. A file that was not measured is not slow.

As a plugin of pytest this file appends to the file that `TIMES` names, for each test, how long it takes in s, and its
name: by the clock, so that it counts what a test waits for, such as a window; less, on Linux, what the test waited for
a processor that others had, so that a busy machine measures much the same as a quiet one.
"""

from __future__ import annotations

import os
import sys
import time
from collections import defaultdict
from collections.abc import Generator, Iterable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LIMIT_S, MOST_S = 0.4, 1.0
HEAD = """\
# Time in s of the test files that `make test-fast` leaves out; written by tools/slow_files.py.
"""


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item, nextitem: pytest.Item | None) -> Generator[None, object, object]:
    """Note what a test costs; not the last one's of a process, which also ends what all of its tests shared."""
    before = _own_s()
    done = yield
    if nextitem is not None:
        with Path(os.environ["TIMES"]).open("a", encoding="utf-8") as file:
            file.write(f"{_own_s() - before:.3f}\t{item.nodeid}\n")
    return done


def _own_s() -> float:
    """Return the clock in s, less the time in which this thread was ready to run and others ran."""
    counted = Path("/proc/thread-self/schedstat")
    others_ns = int(counted.read_text(encoding="ascii").split()[1]) if counted.exists() else 0
    return time.monotonic() - others_ns / 1e9


def slow(lines: Iterable[str]) -> dict[str, float]:
    """Return the slow files and what they cost in s, the dearest first; each line is seconds, a tab, a test's name."""
    costs: dict[str, float] = defaultdict(float)
    for line in lines:
        seconds, test = line.rstrip("\n").split("\t", 1)
        costs[test.split("::", 1)[0]] += float(seconds)
    cheapest: dict[Path, str] = {}
    for file in sorted(costs, key=lambda file: costs[file]):
        cheapest.setdefault(Path(file).parent, file)
    limits = {file: MOST_S if file in cheapest.values() else LIMIT_S for file in costs}
    dear = {file: cost for file, cost in costs.items() if cost >= limits[file]}
    return dict(sorted(dear.items(), key=lambda named: (-named[1], named[0])))


def main() -> None:
    """Write the list."""
    files = slow(Path(sys.argv[1]).read_text(encoding="utf-8").splitlines())
    listed = "".join(f"{cost:.1f} {file}\n" for file, cost in files.items())
    (ROOT / "tests/slow_files.txt").write_text(HEAD + listed, encoding="utf-8")


if __name__ == "__main__":
    main()
