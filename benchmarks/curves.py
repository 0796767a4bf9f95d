"""Write one benchmark as JSON, as a Markdown table and as a plot of run time against error.

A benchmark is a script beside this file, one for a part. Each of its functions that measure returns ``{"title", "rows",
"promises"}``, and as a program it hands them to `program`. Run it as ``python benchmarks/<name>.py``: Python then finds
this module beside it. With ``--quick`` it is small, for a test that it runs: `sized` gives the smaller sizes, and
everything is timed once.
"""

from __future__ import annotations

import json
import math
import os
import platform
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any, TypeVar

from promises import Promise

Row = Mapping[str, object]
Size, Given, Found = TypeVar("Size"), TypeVar("Given"), TypeVar("Found")

OUT = Path(__file__).parent / "out"
SMALLEST_SHOWN = 1e-17


def is_quick() -> bool:
    """Return whether the program was asked to be quick."""
    return "--quick" in sys.argv[1:]


def sized(full: Size, quick: Size) -> Size:
    """Return ``full``, or ``quick`` in a quick run, whose times say nothing."""
    return quick if is_quick() else full


def numbers() -> list[int]:
    """Return the whole numbers of the command line, such as how many studies to simulate."""
    return [int(word) for word in sys.argv[1:] if word.isdecimal()]


def out() -> Path:
    """Return the folder that is written to: that of ``--out=FOLDER``, or ``benchmarks/out``, ``out/quick`` if quick."""
    named = [word.removeprefix("--out=") for word in sys.argv[1:] if word.startswith("--out=")]
    return Path(named[0]) if named else sized(OUT, OUT / "quick")


def program(name: str, *runs: Callable[[], Mapping[str, Any]]) -> None:
    """Run what is measured of a part, one after another, write the files, and print the promises and where they are.

    What each of ``runs`` returns has a ``title``, ``rows`` as `write` wants them, and may have ``promises``, a
    `Promise` each, and ``lines`` of text to print.
    """
    started = perf_counter()
    results = [run() for run in runs]
    write(name, results, taken_s=perf_counter() - started)
    for line in (line for result in results for line in result.get("lines", ())):
        print(line)
    for promise in promises_of(results):
        print(promise.words(quick=is_quick()))
    print(f"written to {out()}")


def row(
    series: str, parameter: object, taken_s: float | None, error: float | None = None, note: str = "", **more: object
) -> dict[str, Any]:
    """Return a row: run time in seconds and error, None where there is none, a note, and what only the JSON has."""
    return {"series": series, "parameter": str(parameter), "seconds": taken_s, "error": error, "note": note, **more}


def promises_of(results: Sequence[Mapping[str, Any]]) -> list[Promise]:
    """Return the promises of all results."""
    return [promise for result in results for promise in result.get("promises", ())]


def seconds(work: Callable[[], object], *, repeats: int = 7, at_least_s: float = 0.02) -> float:
    """Return the median time of ``work()`` in seconds, each repeat long enough for the clock.

    The first call, which may compile or cache, is not counted. A quick run calls it once.
    """
    if is_quick():
        return _once(work)
    work()
    start = perf_counter()
    work()
    once = max(perf_counter() - start, 1e-9)
    loops = max(1, round(at_least_s / once))
    times = []
    for _ in range(repeats):
        start = perf_counter()
        for _ in range(loops):
            work()
        times.append((perf_counter() - start) / loops)
    return median(times)


def answer_and_seconds(work: Callable[[], Found], *, repeats: int = 7, at_least_s: float = 0.02) -> tuple[Found, float]:
    """Return what ``work()`` gives, and its `seconds`; a quick run calls it once for both."""
    if is_quick():
        start = perf_counter()
        return work(), max(perf_counter() - start, 1e-9)
    return work(), seconds(work, repeats=repeats, at_least_s=at_least_s)


def times_faster(ours: Callable[[], object], theirs: Callable[[], object], *, rounds: int = 9) -> float:
    """Return how many times as long ``theirs()`` takes as ``ours()``: the median over rounds that time both in turn.

    Other work on the machine then slows both alike. A quick run calls each once.
    """
    if is_quick():
        return _once(theirs) / _once(ours)
    ours()
    theirs()
    ratios = []
    for _ in range(rounds):
        start = perf_counter()
        ours()
        between = perf_counter()
        theirs()
        ratios.append((perf_counter() - between) / (between - start))
    return median(ratios)


def in_two_processes(work: Callable[[Given], Found], cells: Sequence[Given]) -> Iterator[Found]:
    """Yield ``work`` of each cell, in order, done by two processes; a quick run starts none."""
    if is_quick():
        yield from map(work, cells)
        return
    with ProcessPoolExecutor(min(2, os.cpu_count() or 1)) as pool:
        yield from pool.map(work, cells)


def _once(work: Callable[[], object]) -> float:
    start = perf_counter()
    work()
    return max(perf_counter() - start, 1e-9)


def write(name: str, results: Sequence[Mapping[str, Any]], *, taken_s: float | None = None) -> None:
    """Write ``<name>.json``, ``.md`` and, unless quick, a plot of each result (``.svg``, ``-2.svg``) into `out`.

    Each row has ``series`` and ``parameter`` (text), ``seconds`` and ``error`` (numbers, or None where there is
    none to give), and optionally ``note``. Further keys go into the JSON and not into the table; NaN becomes null.
    """
    text = "\n".join(table(str(result["title"]), machine(), result["rows"]) for result in results)
    text += "".join(f"\n- {promise.words(quick=is_quick())}" for promise in promises_of(results)) + "\n"
    save(name, json_document(name, results, taken_s=taken_s), text)
    for number, result in enumerate(() if is_quick() else results, 1):
        _plot(str(result["title"]), result["rows"], out() / f"{name}{f'-{number}' if number > 1 else ''}.svg")


def machine() -> str:
    """Return what the times were taken on."""
    return f"{platform.machine()}, {platform.system()}, Python {platform.python_version()}"


def json_document(
    name: str, results: Sequence[Mapping[str, Any]], *, taken_s: float | None = None
) -> dict[str, object]:
    """Return what the JSON file of a benchmark says; each row says the ``title`` that it stands under."""
    return {
        "name": name,
        "title": "; ".join(str(result["title"]) for result in results),
        "machine": machine(),
        "quick": is_quick(),
        "taken_s": taken_s,
        "promises": [promise.to_json(quick=is_quick()) for promise in promises_of(results)],
        "rows": [{"title": result["title"], **_plain(one)} for result in results for one in result["rows"]],
    }


def save(name: str, document: Mapping[str, object], markdown: str) -> None:
    """Write ``<name>.json`` and ``.md``."""
    out().mkdir(parents=True, exist_ok=True)
    (out() / f"{name}.json").write_text(json.dumps(document, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    (out() / f"{name}.md").write_text(markdown, encoding="utf-8")


def _plain(row: Row) -> Row:
    return {key: None if isinstance(value, float) and math.isnan(value) else value for key, value in row.items()}


def table(title: str, machine: str, rows: Sequence[Row]) -> str:
    """Return the rows as a Markdown table."""
    lines = [f"# {title}", "", f"Median times on {machine}. Compare ratios, not times.", ""]
    lines += ["| series | parameter | time | error | note |", "|---|---|---:|---:|---|"]
    for row in rows:
        cells = (row["series"], row["parameter"], _time(row["seconds"]), _number(row["error"]), row.get("note", ""))
        lines.append("| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(lines) + "\n"


def _time(value: object) -> str:
    if not isinstance(value, int | float):
        return "–"
    for unit, scale in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= scale:
            return f"{value / scale:.3g} {unit}"
    return f"{value / 1e-9:.3g} ns"


def _number(value: object) -> str:
    return f"{value:.2g}" if isinstance(value, int | float) else "–"


def _plot(title: str, rows: Sequence[Row], file: Path) -> None:
    from matplotlib import colormaps, rc_context
    from matplotlib.figure import Figure

    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "curves", "font.size": 9}):
        figure = Figure(figsize=(7.5, 4.6), layout="constrained")
        axes = figure.subplots()
        axes.set_prop_cycle(color=[colormaps["tab20"](place) for place in (*range(0, 20, 2), *range(1, 20, 2))])
        for index, series in enumerate(dict.fromkeys(str(row["series"]) for row in rows)):
            points = [
                (float(row["seconds"]), max(float(row["error"]), SMALLEST_SHOWN))
                for row in rows
                if row["series"] == series
                and isinstance(row["seconds"], int | float)
                and isinstance(row["error"], int | float)
            ]
            if points:
                marker = "osD^vPX*<>"[index % 10]
                axes.plot(*zip(*points, strict=True), marker=marker, label=series, linewidth=1, markersize=5)
        axes.set(xscale="log", yscale="log", xlabel="time (s)", ylabel="error", title=title)
        axes.grid(True, which="major", alpha=0.3)
        if axes.get_lines():
            axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
        figure.savefig(file, format="svg", metadata={"Date": None})
