"""Run every sweep to the edges, split over the cores: ``python tools/stress.py``, or ``make stress``.

Four parts, of which each runs whatever became of those before it: the sweeps, one worker for each core; those that must
be alone on the machine (marker ``alone``); the page on numerical stability, which is measured and written again; and a
search for new examples by the tests of properties. Words after the command, such as ``-k cable``, choose among the
sweeps; then only the first two parts run. With ``--nightly`` (``make nightly``) the tests with that marker, the types
on other platforms, the core's tests without extensions and a sample of mutants come before them.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time

from documents.platform import cores

# Each worker computes in one thread, as in `make test`: the threads of all would wait for each other.
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
_NOTHING_CHOSEN = 5  # pytest: no test of this part has the words that were asked for
_SEARCHED = "hypothesis and not nightly and not stress and not quad and not vdp"
_NIGHTLY = "--nightly"
_OTHERS = ("win32", "darwin")  # platforms; `make check` looks at the types of this one


def parts(words: list[str], workers: int) -> dict[str, list[str]]:
    """Return the command of each part by its name, to follow ``python -m``."""
    if words[:1] == [_NIGHTLY]:
        tests = ["pytest", "-q", "-m", "nightly and not stress", "-n", str(workers), "--dist", "loadfile"]
        mutants = ["tools.mutants", "--count", "20", "--jobs", str(workers), "--least", "85"]
        types = {
            f"types {name}": ["mypy", "--platform", name, "--cache-dir", f".mypy_cache/{name}"] for name in _OTHERS
        }
        nightly = {"nightly tests": [*tests, "--durations", "30"], "golden outputs": ["tools.golden"], **types}
        nightly |= {"core alone": ["tools.core_alone"], "mutants": mutants}
        return {**nightly, **parts(words[1:], workers)}
    split = ["-n", str(workers), "--dist", "worksteal"]
    sweeps = ["pytest", "-q", "tests", *words]
    made = {
        "sweeps": [*sweeps, "-m", "stress and not alone", *split, "--durations", "30"],
        "alone": [*sweeps, "-m", "stress and alone", "--durations", "5"],
    }
    if words:
        return made
    made["stability page"] = ["tests.stress.stability.page"]
    searching = ["pytest", "-q", "-m", _SEARCHED, "--hypothesis-profile", "searching"]
    return {**made, "searching": [*searching, *split, "--durations", "10"]}


def main() -> int:
    """Run all parts, print how long each took, and return 1 if one of them failed."""
    lines, failed = [], False
    for name, command in parts(sys.argv[1:], cores()).items():
        began_s = time.monotonic()
        status = subprocess.run([sys.executable, "-m", *command], env={**os.environ, **_ONE_THREAD}, check=False)
        chosen = bool(sys.argv[1:]) and sys.argv[1:] != [_NIGHTLY]
        right = status.returncode == 0 or (chosen and status.returncode == _NOTHING_CHOSEN)
        failed |= not right
        said = "passed" if right else f"FAILED (exit status {status.returncode})"
        lines.append(f"{name:15} {(time.monotonic() - began_s) / 60:5.1f} min  {said}")
    print("\n".join(["", f"On {cores()} cores:", *lines]))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
