"""What the functions of `cyclopean` return: a result with its rows as a table."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape
from typing import Any, Generic, TypeVar

import pandas as pd

from documents.pages import Section, sections_html

Value = TypeVar("Value")
Row = Mapping[str, Any]


@dataclass(frozen=True, repr=False, eq=False)
class Result(Generic[Value]):
    """A result to look at.

    Attributes
    ----------
    value
        The full result, as the function of the other package returned it.
    find_rows
        The ``rows``, or what returns them when they are read first.
    title
        One line on all of it.
    find_further
        Returns the ``further`` when it is read first.
    find_sections
        Returns what a notebook shows of it; without it, the title and the table.
    further
        What else was asked for, by its key in JSON.
    rows
        What it says of each item, observer or picture: plain values with named columns.
    """

    value: Value
    find_rows: Sequence[Row] | Callable[[], Sequence[Row]]
    title: str
    find_further: Callable[[], Mapping[str, Any]] = dict
    find_sections: Callable[[], Iterable[Section]] | None = None

    @cached_property
    def further(self) -> Mapping[str, Any]:
        """What else was asked for, by its key in JSON."""
        return self.find_further()

    @cached_property
    def rows(self) -> Sequence[Row]:
        """What it says of each item, observer or picture: plain values with named columns."""
        return self.find_rows() if callable(self.find_rows) else self.find_rows

    def to_frame(self) -> pd.DataFrame:
        """Return the rows as a DataFrame; the columns of nested values are joined by a dot."""
        return pd.json_normalize([dict(row) for row in self.rows])

    def __repr__(self) -> str:
        return f"<{self.title}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: all that the terminal or the page has of it, or the title and the table."""
        if self.find_sections is not None:
            return sections_html(self.find_sections())
        return f"<p>{escape(self.title)}</p>{self.to_frame().to_html(escape=True)}"
