"""The checksums of a log of JSON lines, each chained to the line before.

The last two keys of a line are its number, from 1, as ``line``, and ``chain``: the SHA-256, in hexadecimal digits, of
the chain of the line before and of this line's bytes before ``,"chain":``. Before the first line that has a chain
stands the SHA-256 of all lines before it: of none in a log that has chains from its first line, of those without in a
log that an older version began. The first line of a log that is chained from there says so, by ``"chained": true``,
which its chain covers: chains that were taken off all lines are missed.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

NUMBER, CHAIN, COUNT, CHAINED = "line", "chain", "lines", "chained"
EMPTY = hashlib.sha256().hexdigest()
RESTORE = "restore the file from its mirror or a copy"

_KEY = b',"chain":"'
_ENDING = b',"line":%d,"chain":"%s"}'
_DIGITS = 64
_SUFFIX = len(_KEY) + _DIGITS + 2
_NUMBERED = re.compile(rb'[,{]"line":(\d{1,12})\Z')
_HEX = re.compile(rb"[0-9a-f]{64}")
_CANDIDATES = 4


def sealed(line: Mapping[str, Any], number: int, before: str) -> tuple[bytes, str]:
    """Return ``line`` as the bytes of line ``number`` without its line end, and its chain; ``before`` is the last one.

    Raises
    ------
    ValueError
        If the line has the key of the number or the chain already, or a value that JSON does not have.
    """
    if NUMBER in line or CHAIN in line:
        raise ValueError(f"a record has the key '{NUMBER}' or '{CHAIN}', which a log adds")
    text = json.dumps({**line, NUMBER: number}, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    # What no encoding has (half of a surrogate pair) stays as the escape that JSON has for it.
    body = text[:-1].encode("utf-8", "backslashreplace")
    chain = _next(before, body)
    return body + _KEY + chain.encode() + b'"}', chain


def _next(before: str, body: bytes) -> str:
    return hashlib.sha256(before.encode() + body).hexdigest()


def unprotected(chained_from: Iterable[int | None]) -> Iterator[str]:
    """Yield what no checksum protects in logs, by the first line with a checksum of each; nothing if all is protected.

    Parameters
    ----------
    chained_from
        For each log 1 if it was chained from its beginning, a later line, or None if it is unchained.

    Yields
    ------
    str
        A sentence without its full stop.

    Examples
    --------
    >>> list(unprotected([1, None, None, 4]))[0]
    '2 logs are unchained: nothing protects them, and no change would be noticed'
    """
    firsts = list(chained_from)
    unchained = sum(first is None for first in firsts)
    later = sum(first is not None and first > 1 for first in firsts)
    if unchained:
        words = (
            "log is unchained: nothing protects it" if unchained == 1 else "logs are unchained: nothing protects them"
        )
        yield f"{unchained} {words}, and no change would be noticed"
    if later:
        words = "log was" if later == 1 else "logs were"
        yield f"{later} {words} chained when resumed: nothing protected the lines before until then"


@dataclass(frozen=True, slots=True)
class LogState:
    """What was read of a log: how many whole ``lines``, and their ``size`` in bytes, without ``torn_tail``.

    ``digest`` is what the next line is chained to; ``chained_from`` the first line with a checksum, None if no line has
    one. ``torn_tail`` are the bytes of an unfinished last line; ``ended`` says that an end line is there.
    """

    lines: int = 0
    size: int = 0
    digest: str = EMPTY
    chained_from: int | None = None
    torn_tail: bytes = b""
    ended: bool = False
    lacks_line_end: bool = False

    @property
    def file_size(self) -> int:
        """The size of the file that was read, in bytes."""
        return self.size + len(self.torn_tail)


class Link(NamedTuple):
    """A line as the chain sees it: ``number`` and ``chain`` as it states them, what is wrong as ``fault``.

    ``computed`` is what its chain may be.
    """

    body: bytes
    number: int | None = None
    chain: str | None = None
    computed: tuple[str, ...] = ()
    fault: str | None = None


class ChainReader:
    """Checks the lines of a log one after the other.

    After a line that does not fit, what follows is checked against that line and the ones before, so that each place
    at which the log was changed is found.
    """

    def __init__(self) -> None:
        self.lines = 0
        self.chained_from: int | None = None
        self._unchained = hashlib.sha256()
        self._before: tuple[str, ...] = ()
        self._expected: tuple[int, ...] = (1,)

    @property
    def digest(self) -> str:
        """What the next line is to be chained to."""
        return self._before[0] if self._before else self._unchained.hexdigest()

    def look(self, raw: bytes) -> Link:
        """Return ``raw``, the next line without its line end, and what is wrong with it; it is not taken yet."""
        if len(self._before) == 1:
            body, number = raw[:-_SUFFIX], self._expected[0]
            chain = _next(self._before[0], body)
            if raw.endswith(_ENDING % (number, chain.encode())):
                return Link(body, number, chain, (chain,))
        return self._look_closely(raw)

    def _look_closely(self, raw: bytes) -> Link:
        """Look as `look` does at a line that need not be the one that is due."""
        body, stated = raw[:-_SUFFIX], raw[-_SUFFIX:]
        numbered = _NUMBERED.search(body[-24:])
        has_chain = stated.startswith(_KEY) and stated.endswith(b'"}') and _HEX.fullmatch(stated[len(_KEY) : -2])
        number = int(numbered[1]) if numbered else None
        if not has_chain and numbered is None:
            fault = None
            if self.chained_from is not None:
                fault = "this line has no checksum, as the lines before it have: it was changed or put in"
            return Link(raw, fault=fault)
        chain = stated[len(_KEY) : -2].decode("ascii", "replace")
        before = self._before or (self._unchained.hexdigest(),)
        computed = tuple(_next(chained_to, body) for chained_to in before)
        expected = self._expected if self.chained_from is not None else (self.lines + 1,)
        fault = None
        if not has_chain or chain not in computed or number not in expected:
            fault = "this line does not fit its checksum: the log was changed after it was recorded"
            if number is not None and number not in expected:
                fault += f" (the line is numbered {number}: lines were taken out, put in or exchanged)"
            elif self.chained_from is None and self.lines:
                fault += f" (in this line, or in those before it, 1 to {self.lines}, which have no checksums)"
        return Link(body, number, chain, computed, fault)

    def take(self, link: Link) -> None:
        """Go on to the line after ``link``."""
        self.lines += 1
        if link.chain is None:
            if self.chained_from is None:
                self._unchained.update(link.body + b"\n")
            else:
                self._expected = (*self._expected, self._expected[-1] + 1)[-_CANDIDATES:]
            return
        if self.chained_from is None:
            self.chained_from = self.lines
            self._expected = (self.lines,)
        if link.fault is None and link.number is not None:
            self._before, self._expected = (link.chain,), (link.number + 1,)
        else:
            numbers = (*self._expected, self._expected[0] - 1 if link.number is None else link.number)
            self._expected = tuple(dict.fromkeys(number + 1 for number in numbers))[:_CANDIDATES]
            self._before = tuple(dict.fromkeys((link.chain, *link.computed, *self._before)))[:_CANDIDATES]

    def whole_line_within(self, raw: bytes) -> bytes:
        """Return the bytes after the whole next line that ``raw`` begins with; none if it does not begin with one."""
        end = raw.rfind(b'"}') + 2
        link = self.look(raw[:end])
        return raw[end:] if link.chain is not None and link.fault is None else b""
