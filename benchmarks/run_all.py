"""Run every benchmark, and end with one page: what is promised, what was measured, and whether it is kept.

    python benchmarks/run_all.py [--quick] [--release] [SCRIPT ...]

The page is printed and written as promises.md and promises.json into benchmarks/out. The exit status is 1 if a promise
is not kept, a script fails, or a figure has fallen since the last release in history.jsonl. ``--release`` adds this
version's figures there.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from time import perf_counter

sys.path.insert(0, str(Path(__file__).parent))
import history
from curves import OUT, machine
from promises import Promise

HERE = Path(__file__).parent
NOT_BENCHMARKS = ("curves", "history", "promises", "run_all", "simulated_studies")


@dataclass(frozen=True, slots=True)
class Ran:
    """How one script went: its promises, or, where it failed, the end of what it wrote."""

    script: str
    taken_s: float
    promises: tuple[Promise, ...] = ()
    failed: str = ""


def scripts() -> list[str]:
    """Return the names of all benchmarks."""
    return sorted(file.stem for file in HERE.glob("*.py") if file.stem not in NOT_BENCHMARKS)


def run(script: str, *, quick: bool) -> Ran:
    """Run one script in a process of its own and read what it promises."""
    file = (OUT / "quick" if quick else OUT) / f"{script}.json"
    file.unlink(missing_ok=True)
    began = perf_counter()
    command = [sys.executable, str(HERE / f"{script}.py"), *(["--quick"] if quick else [])]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, encoding="utf-8")
    taken_s = perf_counter() - began
    if done.returncode or not file.exists():
        return Ran(script, taken_s, failed=done.stdout.strip()[-2000:] or f"exit status {done.returncode}")
    found = json.loads(file.read_text(encoding="utf-8"))["promises"]
    return Ran(script, taken_s, tuple(map(Promise.from_json, found)))


def named(all_ran: Sequence[Ran]) -> dict[str, Promise]:
    """Return all promises by script and name."""
    return {history.key(ran.script, promise): promise for ran in all_ran for promise in ran.promises}


def broken(all_ran: Sequence[Ran], fallen: Sequence[tuple[str, str]], *, quick: bool) -> list[str]:
    """Return a line for each thing that makes the exit status 1."""
    found = [f"{ran.script} failed" for ran in all_ran if ran.failed]
    states = {name: promise.state(quick=quick) for name, promise in named(all_ran).items()}
    found += [f"{name}: {state}" for name, state in states.items() if state == "NOT KEPT"]
    return found + [f"{name}: {words}" for name, words in fallen]


def page(all_ran: Sequence[Ran], fallen: Sequence[tuple[str, str]], where: str, *, quick: bool) -> str:
    """Return the page as Markdown."""
    lines = ["# What is promised, and what was measured", "", f"On {where}.", ""]
    if quick:
        lines += ["A quick run: only counts and errors are judged.", ""]
    lines += ["| script | promise | measured | promised | |", "|---|---|---:|---:|---|"]
    for ran in all_ran:
        for one in ran.promises:
            cells = (ran.script, one.name, one.measured(), one.promised(), one.state(quick=quick))
            lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    silent = [ran.script for ran in all_ran if not ran.promises and not ran.failed]
    if silent:
        lines += ["", f"Without promises: {', '.join(silent)}."]
    for ran in all_ran:
        if ran.failed:
            lines += ["", f"**{ran.script} failed.**", "", *(f"    {line}" for line in ran.failed.splitlines())]
    times = sorted(all_ran, key=lambda ran: -ran.taken_s)
    lines += ["", f"{sum(ran.taken_s for ran in all_ran) / 60:.1f} minutes in all, the longest: "]
    lines[-1] += ", ".join(f"{ran.script} {ran.taken_s:.0f} s" for ran in times[:8]) + "."
    wrong = broken(all_ran, fallen, quick=quick)
    lines += ["", *(f"- **{words}**" for words in wrong or ["Every promise that was judged is kept."])]
    return "\n".join(lines) + "\n"


def where() -> str:
    """Return the machine: its processor, how many of them, and what draws."""
    try:
        info = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        names = {line.split(":", 1)[1].strip() for line in info.splitlines() if line.startswith("model name")}
    except OSError:
        names = set()
    parts = [machine(), *sorted(names), f"{os.cpu_count()} processors", drawn_by()]
    return ", ".join(parts)


def drawn_by() -> str:
    """Return the driver that EGL gives, or why there is none."""
    from runner.presenter.surfaces.opening import open_surface

    try:
        with open_surface("egl", (64, 64)) as surface:
            return f"{surface.facts.renderer}, {surface.facts.gl_version}"
    except Exception as error:  # whatever a missing or broken driver raises
        return f"no OpenGL ({error})"


def main() -> int:
    """Run, write the page, and return the exit status."""
    parser = argparse.ArgumentParser(description="Run every benchmark, and end with one page.")
    parser.add_argument("names", nargs="*", metavar="SCRIPT", help="only these, such as colour_pass")
    parser.add_argument("--quick", action="store_true", help="smaller; counts and errors alone are judged")
    parser.add_argument("--release", action="store_true", help="add the figures to history.jsonl")
    asked = parser.parse_args()
    chosen = [Path(name).stem for name in asked.names] or scripts()
    unknown = sorted(set(chosen) - set(scripts()))
    if unknown:
        parser.error(f"no such benchmark: {', '.join(unknown)}; there are {', '.join(scripts())}")
    if asked.release and asked.quick:
        parser.error("--release measures in full: leave out --quick")
    all_ran = _all(chosen, quick=asked.quick)
    here = where()
    lines = history.releases()
    fallen = list(history.fallen(named(all_ran), lines[-1], machine=here, quick=asked.quick)) if lines else []
    wrong = broken(all_ran, fallen, quick=asked.quick)
    text = page(all_ran, fallen, here, quick=asked.quick)
    _save(all_ran, wrong, here, text, quick=asked.quick)
    print(text)
    if asked.release:
        wrong += _release(all_ran, here, wrong, whole=not asked.names)
    return 1 if wrong else 0


def _all(chosen: Sequence[str], *, quick: bool) -> list[Ran]:
    all_ran = []
    for script in chosen:
        ran = run(script, quick=quick)
        print(f"{ran.script}: {ran.taken_s:.1f} s{', FAILED' if ran.failed else ''}", flush=True)
        all_ran.append(ran)
    return all_ran


def _save(all_ran: Sequence[Ran], wrong: Sequence[str], here: str, text: str, *, quick: bool) -> None:
    folder = OUT / "quick" if quick else OUT
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "promises.md").write_text(text, encoding="utf-8")
    document = {
        "machine": here,
        "quick": quick,
        "wrong": list(wrong),
        "scripts": [
            {
                "script": ran.script,
                "taken_s": ran.taken_s,
                "failed": ran.failed,
                "promises": [promise.to_json(quick=quick) for promise in ran.promises],
            }
            for ran in all_ran
        ],
    }
    (folder / "promises.json").write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _release(all_ran: Sequence[Ran], here: str, wrong: Sequence[str], *, whole: bool) -> list[str]:
    """Add a line to the history, unless a script failed or a promise is not kept; return why not."""
    if wrong:
        print("nothing added to history.jsonl: mend what is not kept, or run again on a quiet machine")
        return []
    quick = _all([ran.script for ran in all_ran], quick=True)
    failed = [f"{ran.script} --quick failed" for ran in quick if ran.failed]
    if failed:
        print("nothing added to history.jsonl:", *failed, sep="\n")
        return failed
    history.append(history.release(version("cyclopean"), here, named(all_ran), named(quick)), whole=whole)
    print(f"added to {history.FILE}")
    return []


if __name__ == "__main__":
    sys.exit(main())
