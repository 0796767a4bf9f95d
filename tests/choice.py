"""Which files are collected: none whose marker is left out, and with ``--fast`` none that is dear; nightly cases."""

from __future__ import annotations

import re
from functools import cache
from itertools import accumulate
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
SLOW_FILES = Path(__file__).with_name("slow_files.txt")
# Every test of these folders has the marker of the folder's name.
MARKED_FOLDERS = ("stress", "quad", "vdp")
_CHEAP_S = 0.2  # of a file that is not dear
# The marker of all tests of a file, or one of several.
_MARKED_FILE = re.compile(r"^pytestmark = (.*(?:\n .*)*)", re.MULTILINE)


def nightly(*cases: Any) -> list[Any]:
    """Return the cases of a parametrised test that only `make nightly` runs: ``[1, *nightly(2, 3)]``."""
    return [pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.nightly) for case in cases]


@cache
def slow_files() -> dict[str, float]:
    """Return what the files that `make test-fast` leaves out cost in s, by their paths from the root, `/` between."""
    lines = SLOW_FILES.read_text(encoding="utf-8").splitlines()
    return {line.split()[1]: float(line.split()[0]) for line in lines if line and not line.startswith("#")}


@cache
def file_marks(path: Path) -> set[str]:
    """Return the markers that all tests of a file have: those of its ``pytestmark``, and ``nightly`` for a page."""
    if path.parent == ROOT / "docs":
        return {"nightly"}
    given = _MARKED_FILE.search(path.read_text(encoding="utf-8")) if path.suffix == ".py" else None
    return set(re.findall(r"pytest\.mark\.(\w+)", given[1])) if given else set()


def left_out(path: Path, marks: str, fast: bool) -> bool:
    """Whether nothing in ``path`` would run, by the expression of ``-m`` and whether ``--fast`` was given.

    Only an expression that is all ``not`` and ``and`` leaves files out, such as ``not stress and not quad``.
    """
    if not path.is_relative_to(ROOT):
        return False
    here = path.relative_to(ROOT)
    terms = [term.strip("( )") for term in re.split(r"\band\b", marks)]
    refused = {term[4:].strip() for term in terms} if all(re.fullmatch(r"not \w+", term) for term in terms) else set()
    if path.is_dir():
        return here.parts[:1] == ("tests",) and len(here.parts) == 2 and here.name in refused & set(MARKED_FOLDERS)
    return bool(refused & file_marks(path)) or (fast and here.as_posix() in slow_files())


@cache
def share(worker: int, workers: int, marks: str, fast: bool) -> frozenset[Path]:
    """Return the files that one of ``workers`` collects, and their folders.

    They are neighbours, which import much the same, and take about as long as those of each other worker.
    """
    every = [ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "tests").rglob("test_*.py")]
    files = [path for path in sorted(every) if not left_out(path, marks, fast)]
    costs = [slow_files().get(path.relative_to(ROOT).as_posix(), _CHEAP_S) for path in files]
    per_worker = sum(costs) / workers
    middles = (end - cost / 2 for end, cost in zip(accumulate(costs), costs, strict=True))
    own = [path for path, middle in zip(files, middles, strict=True) if int(middle / per_worker) == worker]
    return frozenset(own).union(*(path.parents for path in own))
