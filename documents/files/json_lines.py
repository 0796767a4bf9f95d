"""Reading a log of JSON lines of which the last may be cut short."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

from documents.findings import InputError


class DamagedLineError(Exception):
    """Line ``number``, counted from 1, is not what it should be; as text, why."""

    def __init__(self, number: int, why: Exception) -> None:
        self.number = number
        super().__init__(str(why))


def read_lines(content: bytes, take: Callable[[int, Any], None]) -> bytes:
    r"""Call ``take(number, line)`` for each JSON line of ``content``; return the bytes of an unfinished last line.

    Parameters
    ----------
    content
        The bytes of a file of JSON lines.
    take
        Called with the number of a line, from 1, and its value.

    Returns
    -------
    bytes
        The unfinished last line; empty if there is none.

    Raises
    ------
    DamagedLineError
        If a line is no JSON or ``take`` refuses it by an error of values, keys or types; not of the last line where
        its line end is missing and it is not the first: that one is unfinished.

    Examples
    --------
    >>> lines = []
    >>> read_lines(b'{"a":1}\n{"b":2}\n{"c"', lambda number, line: lines.append(line))
    b'{"c"'
    >>> lines
    [{'a': 1}, {'b': 2}]
    """
    *lines, tail = content.split(b"\n")
    if tail:
        lines.append(tail)
    for number, raw in enumerate(lines, start=1):
        try:
            take(number, json.loads(raw))
        except (ArithmeticError, LookupError, RecursionError, TypeError, ValueError, InputError) as error:
            if tail and number == len(lines) > 1:
                return tail
            raise DamagedLineError(number, error) from error
    return b""
