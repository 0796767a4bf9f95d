"""Reading a log of JSON lines of which the last may be cut short, and of which no other may have been changed."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from functools import partial
from io import IOBase
from pathlib import Path
from typing import Any

from pydantic_core import from_json

from documents.files.chain import CHAIN, CHAINED, COUNT, NUMBER, RESTORE, ChainReader, Link, LogState
from documents.findings import Finding, InputError

_LONGEST = 64 << 20
# Twenty thousand trials, or ten thousand readings with a spectrum each, have less.
MOST_LOG_BYTES = 200_000_000
_MOST_KNOWN = {True: 100, False: 4000}  # texts that are kept, of first lines and of others: 1 and 3 MB
_REFUSED = (ArithmeticError, LookupError, RecursionError, TypeError, ValueError, InputError)


class DamagedLineError(Exception):
    """Line ``number``, counted from 1, is not what it should be; as text, why.

    ``changed`` says that it is not what was recorded: it does not fit its checksum.
    """

    def __init__(self, number: int, why: Exception | str, *, changed: bool = False) -> None:
        self.number = number
        self.changed = changed
        super().__init__(str(why))

    def finding(self, file: Path, what: str, remedy: str) -> Finding:
        """Return the finding in ``file``; of a line that is as it was recorded, ``what`` is wrong and the remedy."""
        if self.changed:
            return Finding(str(self), str(file), self.number, 1, RESTORE)
        return Finding(f"{what}: {self}", str(file), self.number, 1, remedy)


class Repeated:
    """Ends of lines that are long and alike in many lines and logs: equal texts are read once and are one object.

    Parameters
    ----------
    first
        The key from which on the first lines of logs are alike.
    last
        The last key of other lines, whose values are alike.
    """

    def __init__(self, *, first: str, last: str) -> None:
        self._last = last
        self._begin = {True: f',"{first}":'.encode(), False: f',"{last}":{{'.encode()}
        self._known: dict[bool, dict[bytes, dict[str, Any]]] = {True: {}, False: {}}

    def read(self, body: bytes, *, first: bool) -> dict[str, Any] | None:
        """Return the value of a line that fits its checksum, without what a log adds; None if it has no such end.

        No text within a value has the bytes of a key, since its quotes are escaped; and what stands before a key that
        is not one of the line itself is no JSON once it is closed.
        """
        key, known = self._begin[first], self._known[first]
        begin = body.find(key) if first else body.rfind(key)
        if begin < 0:
            return None
        text = body[begin + 1 : body.rindex(b",")]  # the number follows
        try:
            if text not in known:
                if len(known) >= _MOST_KNOWN[first] or not (first or text.endswith(b"}")):
                    return None
                of_last = text[len(self._begin[False]) - 2 :]
                known[text] = from_json(b"{%s}" % text) if first else {self._last: from_json(of_last)}
            value: dict[str, Any] = from_json(body[:begin] + b"}")
        except ValueError:
            return None
        if value.get("record") == "end":  # which states how many lines there are
            return None
        value |= known[text]
        if first:
            value.pop(CHAINED, None)
        return value


def read_lines(
    lines: Iterable[bytes],
    take: Callable[[int, Any], None],
    on_damage: Callable[[DamagedLineError], None] | None = None,
    on_checksum: Callable[[int], None] | None = None,
    chain: ChainReader | None = None,
    repeated: Repeated | None = None,
) -> LogState:
    r"""Call ``take(number, line)`` for each JSON line, without what its checksum adds to it.

    Parameters
    ----------
    lines
        The lines of the file with their line ends: a file that is open for reading bytes.
    take
        Called with the number of a line, from 1, and its value.
    on_damage
        Called with each damaged line, which is then left out; if None, the first is raised.
    on_checksum
        Called with the number of each line whose checksum fits, before it is taken.
    chain
        The checksums of the lines before, where those were read already: numbers count on, and ``size`` is that of the
        lines read now.
    repeated
        What is long and alike in many lines and logs, as it is known so far.

    Returns
    -------
    LogState
        How many whole lines there are, where they end, and the bytes of an unfinished last line.

    Raises
    ------
    DamagedLineError
        If a line does not fit its checksum, is no JSON, follows the end line of a log with checksums, or ``take``
        refuses it by an error of values, keys or types; not of the last line where its line end is missing and it is
        not the first: that one is unfinished.

    Examples
    --------
    >>> lines = []
    >>> state = read_lines([b'{"a":1}\n', b'{"b":2}\n', b'{"c"'], lambda number, line: lines.append(line))
    >>> state.torn_tail
    b'{"c"'
    >>> lines
    [{'a': 1}, {'b': 2}]
    """
    chain = chain or ChainReader()
    size = 0
    ended = lacks_line_end = False
    source = iter(partial(lines.readline, _LONGEST), b"") if isinstance(lines, IOBase) else lines
    for number, ended_raw in enumerate(source, start=chain.lines + 1):
        if len(ended_raw) >= _LONGEST:
            raise DamagedLineError(number, f"it is longer than {_LONGEST >> 20} MiB")
        raw = ended_raw.removesuffix(b"\n")
        lacks_line_end = len(raw) == len(ended_raw)
        raw = raw.removesuffix(b"\r")
        link = chain.look(raw)
        try:
            if ended:
                raise DamagedLineError(number, "this line follows the end of the session: it was put in", changed=True)
            if lacks_line_end and number > 1 and _is_torn(chain, link, raw, number):
                return LogState(number - 1, size, chain.digest, chain.chained_from, ended_raw)
            if link.fault:
                raise DamagedLineError(number, link.fault, changed=True)
            value = repeated.read(link.body, first=number == 1) if repeated and link.chain else None
            if value is None:
                value = _value(raw, link, number)
            if on_checksum is not None and link.chain is not None:
                on_checksum(number)
            try:
                take(number, value)
            except _REFUSED as error:
                if lacks_line_end and number > 1 and link.chain is None:
                    return LogState(number - 1, size, chain.digest, chain.chained_from, ended_raw)
                raise DamagedLineError(number, error) from error
            ended = link.chain is not None and value.get("record") == "end"
        except DamagedLineError as error:
            if on_damage is None:
                raise
            on_damage(error)
        chain.take(link)
        size += len(ended_raw)
    return LogState(chain.lines, size, chain.digest, chain.chained_from, b"", ended, lacks_line_end)


def _is_torn(chain: ChainReader, link: Link, raw: bytes, number: int) -> bool:
    """Return whether a last line without its line end is unfinished; raise if bytes follow the whole line in it."""
    after = chain.whole_line_within(raw)
    if after.strip(b"\0"):  # a file system may leave zeros where it did not come to write
        what = "this line does not end where it was recorded to end: the log was changed after it was recorded"
        raise DamagedLineError(number, what, changed=True)
    if chain.chained_from is not None:
        return link.chain is None or link.fault is not None
    try:
        json.loads(raw)
    except _REFUSED:
        return True
    return link.fault is not None


def parsed(raw: bytes) -> Any:
    """Return what `json.loads` returns, or raise what it raises, in less than half of the time.

    Equal texts of different lines are one object. The faster reader takes less: what it refuses is read again.
    """
    try:
        return from_json(raw)
    except ValueError:
        return json.loads(raw)


def _value(raw: bytes, link: Link, number: int) -> Any:
    """Return the line's value; what was added to it is taken off and checked."""
    try:
        value = parsed(raw)
    except _REFUSED as error:
        raise DamagedLineError(number, error) from error
    if link.chain is None and isinstance(value, dict) and NUMBER in value and CHAIN in value:
        what = "this line was written again by another program, and no longer fits its checksum"
        raise DamagedLineError(number, what, changed=True)
    if number == 1 and isinstance(value, dict) and CHAINED in value:
        if link.chain is None:
            what = "the log was recorded with checksums, which were taken off: it was changed after it was recorded"
            raise DamagedLineError(number, what, changed=True)
        del value[CHAINED]
    if link.chain is not None:
        del value[NUMBER], value[CHAIN]
        if value.get("record") == "end" and value.pop(COUNT, None) != number - 1:
            raise DamagedLineError(number, "the end line states another number of lines than the log has", changed=True)
    return value
