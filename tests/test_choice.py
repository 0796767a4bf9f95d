"""Which test files run: all that are usual, or only the cheap ones of every folder."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.choice import ROOT, left_out, share, slow_files
from tools.slow_files import slow

USUAL = "not nightly and not stress and not quad and not vdp"


def test_slow_files_exist_and_each_part_of_the_tests_keeps_some_that_are_fast() -> None:
    gone = [name for name in slow_files() if not (ROOT / name).is_file()]
    assert not gone, f"measure again, as tools/slow_files.py says, or take out of tests/slow_files.txt: {gone}"
    for folder in {Path(name).parts[:2] for name in slow_files() if name.count("/") > 1}:
        files = {file.relative_to(ROOT).as_posix() for file in ROOT.joinpath(*folder).rglob("test_*.py")}
        assert files - set(slow_files()) or folder[-1] in ("cyclopean", "packaging"), (
            f"nothing of {'/'.join(folder)} is fast"
        )


@pytest.mark.parametrize(
    ("name", "marks", "fast", "out"),
    [
        ("tests/stress", USUAL, False, True),
        ("tests/stress", f"({USUAL}) and not window", True, True),
        ("tests/stress", "stress", False, False),
        ("tests/stress", "hypothesis and not stress", False, False),
        ("tests/stress", "not stress or window", False, False),
        ("tests/runner", USUAL, True, False),
        ("tests/runner/test_whole_way.py", USUAL, True, True),
        ("tests/runner/test_whole_way.py", USUAL, False, False),
        ("tests/test_rooms.py", USUAL, True, False),
        ("tests/benchmarks/test_every_benchmark.py", USUAL, False, True),
        ("tests/benchmarks/test_every_benchmark.py", "nightly", False, False),
        ("tests/benchmarks/test_every_benchmark.py", "not stress", False, False),
        ("docs/scores.md", USUAL, False, True),
        ("docs/scores.md", "nightly", False, False),
        ("README.md", USUAL, False, False),
    ],
)
def test_what_is_left_out(name: str, marks: str, fast: bool, out: bool) -> None:
    assert left_out(ROOT / name, marks, fast) is out


@pytest.mark.parametrize("workers", [1, 2, 8])
def test_workers_share_all_that_is_collected(workers: int) -> None:
    shares = [{path for path in share(n, workers, USUAL, False) if path.is_file()} for n in range(workers)]
    every = [ROOT / "README.md", *(ROOT / "tests").rglob("test_*.py")]
    assert sorted(path for one in shares for path in one) == sorted(p for p in every if not left_out(p, USUAL, False))
    costs = [sum(slow_files().get(path.relative_to(ROOT).as_posix(), 0.2) for path in one) for one in shares]
    # A file goes to the share that its middle lies in: half of one may stick out at either end.
    assert max(costs) < sum(costs) / workers + max(slow_files().values())


def test_files_outside_are_no_business_of_ours(tmp_path: Path) -> None:
    assert not left_out(tmp_path / "tests/stress", USUAL, True)


def test_a_file_is_slow_by_the_sum_of_its_tests_and_the_cheapest_of_a_folder_only_if_it_is_dear() -> None:
    costs = {
        "a/x.py::one": 0.3,
        "a/x.py::two[a::b]": 0.3,
        "a/y.py::one": 0.3,
        "c/v.py::one": 0.9,
        "b/z.py::one": 9.0,
        "a/w.py::one": 2.0,
    }
    dear = {"b/z.py": 9.0, "a/w.py": 2.0, "a/x.py": 0.6}
    assert slow(f"{seconds}\t{name}\n" for name, seconds in costs.items()) == dear


@pytest.mark.nightly
def test_pytest_takes_the_option() -> None:
    words = ["--fast", "-m", USUAL, "--collect-only", "-q", "tests/benchmarks"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *words], capture_output=True, text=True, cwd=ROOT, check=False
    )
    assert "tests/benchmarks/test_promises.py" in done.stdout, done.stdout + done.stderr
    assert "tests/benchmarks/test_every_benchmark.py" not in done.stdout
