"""What each release measured, a line each in history.jsonl, and what has fallen since.

A line has ``version``, ``date``, ``machine``, and the ``figures`` of all promises that were measured, by script and
name; ``quick`` has those of a quick run that are exact, which a test compares at every change.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from promises import Direction as Direction
from promises import Promise as Promise

FILE = Path(__file__).parent / "history.jsonl"
MOST_FALLEN = 0.25
"""By what share a ratio may fall short of the last release's: two runs on one machine differ by less."""

Named = Mapping[str, Promise]
"""Promises by script and name, as `key` writes it."""


@dataclass(frozen=True, slots=True)
class Release:
    """The figures of one release."""

    version: str
    date: str
    machine: str
    figures: Mapping[str, float]
    quick: Mapping[str, float] = field(default_factory=dict)


def key(script: str, promise: Promise) -> str:
    """Return what a promise is called in the history."""
    return f"{script}: {promise.name}"


def releases(file: Path = FILE) -> list[Release]:
    """Return all releases of ``file``, the oldest first; none where there is no file."""
    if not file.exists():
        return []
    return [Release(**json.loads(line)) for line in file.read_text(encoding="utf-8").splitlines() if line.strip()]


def release(version: str, machine: str, full: Named, quick: Named) -> Release:
    """Return today's figures, rounded to six digits."""
    figures = {name: _rounded(one.figure) for name, one in full.items() if one.figure is not None}
    counts = {name: one.figure for name, one in quick.items() if one.kind == "count"}
    exact = {name: _rounded(figure) for name, figure in counts.items() if figure is not None}
    return Release(version, datetime.now(UTC).date().isoformat(), machine, figures, exact)


def append(line: Release, file: Path = FILE, *, whole: bool = True) -> None:
    """Add a line, in the place of one of the same version.

    Unless it is ``whole``, the figures of other scripts stay as that line has them, if it is of the same machine.
    """
    kept = [one for one in releases(file) if one.version != line.version]
    for old in releases(file):
        if not whole and (old.version, old.machine) == (line.version, line.machine):
            line = replace(line, figures=_joined(old.figures, line.figures), quick=_joined(old.quick, line.quick))
    text = [json.dumps(asdict(one), ensure_ascii=False) for one in (*kept, line)]
    file.write_text("\n".join(text) + "\n", encoding="utf-8")


def fallen(promises: Named, last: Release, *, machine: str = "", quick: bool = False) -> Iterator[tuple[str, str]]:
    """Yield the name of each promise that has fallen since ``last``, and in words how far.

    Counts must be equal. Ratios may be worse by `MOST_FALLEN`; they are compared on the same machine only, and not in a
    quick run, whose times say nothing. What the last release had and ``promises`` has not is named too.
    """
    figures = last.quick if quick else last.figures
    scripts = {name.split(": ")[0] for name in promises}
    for name, was in figures.items():
        if name not in promises:
            if name.split(": ")[0] in scripts:
                yield name, f"{was:g} in {last.version}, and measured no more"
            continue
        now = promises[name]
        if now.figure is None:
            continue
        if now.kind == "count" and _rounded(now.figure) != was:
            yield name, f"{now.figure:g}, not {was:g} as in {last.version}"
        if now.kind == "ratio" and not quick and machine == last.machine and _worse(now, was):
            yield name, f"{now.figure:.3g}, more than a quarter worse than {was:.3g} in {last.version}"


def _joined(old: Mapping[str, float], new: Mapping[str, float]) -> dict[str, float]:
    """Return the old figures of the scripts that have no new ones, and the new ones."""
    again = {name.split(": ")[0] for name in new}
    return {name: figure for name, figure in old.items() if name.split(": ")[0] not in again} | dict(new)


def _worse(now: Promise, was: float) -> bool:
    assert now.figure is not None
    if now.direction == "at least":
        return not now.figure >= was * (1 - MOST_FALLEN)
    return not now.figure <= was / (1 - MOST_FALLEN)


def _rounded(figure: float) -> float:
    return float(f"{figure:.6g}")
