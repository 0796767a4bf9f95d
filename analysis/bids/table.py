"""Writing tables and sidecars as BIDS wants them: tabs, line feeds, UTF-8."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from analysis.bids.text import inert_json


def write_table(file: Path, header: Sequence[str], rows: Iterable[Sequence[str]]) -> int:
    """Write cells as a table, row by row, and return how many rows there were."""
    count = 0
    with open(file, "w", encoding="utf-8", newline="\n") as stream:
        stream.write("\t".join(header) + "\n")
        for row in rows:
            stream.write("\t".join(row) + "\n")
            count += 1
    return count


def write_json(file: Path, value: Mapping[str, Any]) -> None:
    """Write an object as JSON with every active character as its number."""
    file.write_text(inert_json(value, indent=2) + "\n", encoding="utf-8", newline="\n")
