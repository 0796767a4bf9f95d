"""Time and memory to read tables of comparisons: like answers counted together, beside a list of every answer.

    python benchmarks/comparison_table.py

Each table is read in a process of its own, whose largest memory is told in the note.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from curves import program, row, sized
from promises import Promise, times_as_fast

Row = dict[str, object]

TITLE = "Tables of comparisons: time to read"
ROWS = sized((10_000, 100_000, 1_000_000), (1000,))
MOST_ROWS = sized(10_000_000, 2000)
ITEMS, OBSERVERS = 200, 1000
OURS = "from analysis.comparisons.table import read_table; from pathlib import Path; read_table(Path(sys.argv[1]))"
PLAIN = """
import csv
from analysis.comparisons.comparisons import Answer, from_answers
rows = csv.DictReader(open(sys.argv[1], encoding="utf-8", newline=""))
from_answers([Answer(r["winner"], r["loser"], float(r["count"]), r["observer"], r["first"]) for r in rows])
"""
COMMAS = PLAIN.replace('newline="")', 'newline=""), delimiter=";"').replace(
    'r["count"]', 'r["count"].replace(",", ".")'
)
PANDAS = """
import pandas
from analysis.comparisons.comparisons import Answer, from_answers
rows = pandas.read_csv(sys.argv[1], dtype=str)
a = rows["choice"] == "a"
winner, loser = rows["item_a"].where(a, rows["item_b"]), rows["item_b"].where(a, rows["item_a"])
from_answers([Answer(*answer) for answer in zip(winner, loser, [1.0] * len(rows), rows["observer"])])
"""
TIMED = """
import resource, sys, time
import numpy, analysis.comparisons.table
start = time.perf_counter()
{work}
print(time.perf_counter() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


def run() -> dict[str, Any]:
    """Measure and return the title and the rows."""
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        for count in (*ROWS, MOST_ROWS):
            table = Path(folder) / f"{count}.csv"
            _write_table(table, count)
            rows.append(_row("counted while reading", count, OURS, table))
            if count < MOST_ROWS:
                rows.append(_row("a list of every answer", count, PLAIN, table))
                commas = table.with_name(f"{count} commas.csv")
                commas.write_text(table.read_text().replace(",1,", ",1.5,").replace(",", ";").replace(".", ","))
                rows.append(_row("decimal commas, counted while reading", count, OURS, commas))
                rows.append(_row("decimal commas, a list of every answer", count, COMMAS, commas))
            table.unlink()
        for count in ROWS:
            table = Path(folder) / f"{count} choices.csv"
            _write_choices(table, count)
            rows.append(_row("choices, counted while reading", count, OURS, table))
            rows.append(_row("choices, by pandas", count, PANDAS, table))
            table.unlink()
    promises = []
    for ours, theirs in (
        ("counted while reading", "a list of every answer"),
        ("choices, counted while reading", "choices, by pandas"),
        (
            "decimal commas, counted while reading",
            "decimal commas, a list of every answer",
        ),
    ):
        faster = times_as_fast(rows, ours, theirs)
        promises.append(Promise(f"{ours}, beside {theirs}", faster, None, "ratio", "at least", "×"))
    return {"title": TITLE, "rows": rows, "promises": promises}


def _write_table(file: Path, count: int) -> None:
    random = np.random.default_rng(1)
    with file.open("w", encoding="utf-8") as stream:
        stream.write("winner,loser,count,observer,first\n")
        for start in range(0, count, 100_000):
            size = min(100_000, count - start)
            first = random.integers(ITEMS, size=size)
            second = (first + random.integers(1, ITEMS, size=size)) % ITEMS
            person = random.integers(OBSERVERS, size=size)
            lines = zip(first.tolist(), second.tolist(), person.tolist(), strict=True)
            stream.write("".join(f"picture {a},picture {b},1,{c},picture {a}\n" for a, b, c in lines))


def _write_choices(file: Path, count: int) -> None:
    random = np.random.default_rng(2)
    first = random.integers(ITEMS, size=count)
    second = (first + random.integers(1, ITEMS, size=count)) % ITEMS
    person = random.integers(OBSERVERS, size=count)
    lines = zip(
        first.tolist(), second.tolist(), person.tolist(), random.choice(["a", "b"], count).tolist(), strict=True
    )
    with file.open("w", encoding="utf-8") as stream:
        stream.write("observer,item_a,item_b,choice\n")
        stream.write("".join(f"{c},picture {a},picture {b},{d}\n" for a, b, c, d in lines))


def _row(series: str, count: int, work: str, table: Path) -> Row:
    done = subprocess.run(
        [sys.executable, "-c", TIMED.format(work=work), str(table)], capture_output=True, text=True, check=True
    )
    seconds, megabytes = map(float, done.stdout.split())
    note = f"{count / seconds:,.0f} rows/s, at most {megabytes:.0f} MB"
    return row(series, f"{count:,} rows", seconds, 0.0, note=note)


if __name__ == "__main__":
    program("comparison_table", run)
