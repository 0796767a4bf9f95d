"""Missing values in tables of comparisons: the words that other programs write for them, and the lines left out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.comparisons.sources import Coded, ColumnBlock, NumberedRow, Row, WrittenRow
from documents import Finding

# As R, pandas, Excel, MATLAB, SPSS and SAS write them. Capitals count: an item may well be called "na" or "none".
WORDS = frozenset(
    (
        "NA",
        "<NA>",
        "N/A",
        "n/a",
        "#N/A",
        "#N/A N/A",
        "#NA",
        "#NULL!",
        "NULL",
        "null",
        "None",
        "<missing>",
        "<undefined>",
    )
) | {"NaN", "nan", "-NaN", "-nan", "NaT", ".", "1.#IND", "-1.#IND", "1.#QNAN", "-1.#QNAN"}
MOST_SAID = 20
KEEP = "--keep-na (from Python: keep_na=True)"


@dataclass(slots=True)
class Missing:
    """What is missing in the lines of one table, block by block.

    Attributes
    ----------
    file
        Name of the table in findings.
    needed, unknown
        Columns, as `analysis.comparisons.layouts.LayoutReading` has them.
    words
        What stands for a missing value.
    lines
        How many lines were left out.
    by_column
        How often a value was missing, by what the column holds.
    said
        A finding for each of the first 20 lines.
    found
        Of a frame, for each column which of its distinct texts are such words.
    """

    file: str
    needed: Mapping[int, str]
    unknown: Collection[int]
    words: frozenset[str]
    lines: int = 0
    by_column: Counter[str] = field(default_factory=Counter)
    said: list[Finding] = field(default_factory=list)
    found: dict[int, NDArray[np.bool_]] = field(default_factory=dict)

    def occurs(self, rows: Sequence[Row]) -> bool:
        """Say whether a value may be missing in ``rows``; takes little time where none is."""
        if not self.words:
            return False
        for place in (*self.needed, *self.unknown):
            try:
                met = set(map(itemgetter(place), rows))
            except IndexError:
                return True
            if not self.words.isdisjoint(map(str.strip, met)):
                return True
        return False

    def left_out(self, row: Row) -> bool:
        """Say whether a needed value is missing in ``row``."""
        return any(self._is_missing(row, place) for place in self.needed)

    def cleaned(self, row: Row) -> Row:
        """Return ``row`` with an empty field for each value that may be unknown and is missing."""
        places = [place for place in self.unknown if self._is_missing(row, place)]
        return ["" if place in places else cell for place, cell in enumerate(row)] if places else row

    def without(self, rows: Iterable[NumberedRow]) -> list[Row]:
        """Return the ``rows`` in which nothing needed is missing, and note the others.

        Each row comes with the number of its line and its text.
        """
        kept: list[Row] = []
        for row, number, line in rows:
            if self.left_out(row):
                self._note(row, number, line)
            else:
                kept.append(self.cleaned(row))
        return kept

    def without_rows(self, block: ColumnBlock) -> ColumnBlock:
        """Return the rows of ``block`` in which nothing needed is missing, cleaned, and note the others."""
        missing = np.zeros(len(block.number), dtype=np.bool_)
        columns = list(block.columns)
        for place in (*self.needed, *self.unknown):
            texts, code = columns[place].texts, columns[place].code
            if place not in self.found:
                self.found[place] = np.array([text.strip() in self.words for text in texts], dtype=np.bool_)
            if not self.found[place].any():
                continue
            if place in self.needed:
                missing |= self.found[place][code]
            else:
                cleaned = ["" if word else text for word, text in zip(self.found[place], texts, strict=True)]
                columns[place] = Coded(cleaned, code)
        for noted in block.part(missing).numbered() if missing.any() else ():
            self._note(*noted)
        kept = ColumnBlock(columns, block.number)
        return kept.part(~missing) if missing.any() else kept

    @property
    def sentence(self) -> str:
        """How many lines were left out and why; empty where none was."""
        if not self.lines:
            return ""
        columns = ", ".join(f"{name} ({count})" for name, count in self.by_column.items())
        lines, were = ("1 line", "was") if self.lines == 1 else (f"{self.lines:,} lines", "were")
        return f"{lines} {were} left out, because values are missing: {columns}"

    @property
    def sentences(self) -> tuple[str, ...]:
        """The same, each of the first lines by itself, and how to take the words as names."""
        if not self.lines:
            return ()
        more = (f"and {self.lines - len(self.said):,} more",) if self.lines > len(self.said) else ()
        return (self.sentence, *map(str, self.said), *more, f"to take such words as names: {KEEP}")

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON; none where no line was left out."""
        if not self.lines:
            return {}
        first = [{"line": each.line, "column": each.column, "message": each.message} for each in self.said]
        return {"lines": self.lines, "missing": dict(self.by_column), "first": first}

    def everything(self) -> Finding:
        """Return what to say where no line is left."""
        whole = [name for name, count in self.by_column.items() if count >= self.lines]
        what = f"the {whole[0]} is missing in every line" if whole else f"{self.sentence}, and none remains"
        first, remedy = self.said[0], f"leave the column out; or, if the word is a name: {KEEP}"
        return Finding(f"{what}; in the first, {first.message}", self.file, first.line, first.column, remedy)

    def _is_missing(self, row: Row, place: int) -> bool:
        return place < len(row) and row[place].strip() in self.words

    def _note(self, row: Row, number: int, line: WrittenRow) -> None:
        places = [place for place in self.needed if self._is_missing(row, place)]
        self.lines += 1
        self.by_column.update(dict.fromkeys((self.needed[place] for place in places), 1))
        if len(self.said) < MOST_SAID:
            what = ", ".join(f"the {self.needed[place]} is '{row[place].strip()}'" for place in places)
            self.said.append(Finding(what, self.file, number, line.column_of(places[0])))
