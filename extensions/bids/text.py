"""Escape text from people, so that it cannot break a table, change the reading direction or run as a formula.

A BIDS cell cannot contain a tab or a line end, so these are written as in JSON strings (``\t``, ``\n``, ``\u202e``).
`unescape` restores the original text exactly.
"""

from __future__ import annotations

import json
import math
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

MISSING = "n/a"
_SHORT = {"\\": "\\\\", "\t": "\\t", "\n": "\\n", "\r": "\\r"}
_LONG = {short[1]: character for character, short in _SHORT.items()}
# Controls, invisible marks (also those that change the reading direction), lone surrogates, line separators.
_ACTIVE = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
_JOINERS = "\u200c\u200d"  # Persian and emoji need them, and they have no other effect
# Characters that begin a quoted cell or a formula in a spreadsheet or a CSV reader.
_OPENING = re.compile(r'^(\s*)(["=+\-@])')
_ESCAPE = re.compile(r"\\(?:u([0-9a-f]{4})|U([0-9a-f]{8})|(.))")


def _is_active(character: str) -> bool:
    return unicodedata.category(character) in _ACTIVE and character not in _JOINERS


def _number(character: str) -> str:
    code = ord(character)
    return f"\\u{code:04x}" if code <= 0xFFFF else f"\\U{code:08x}"


@lru_cache(4096)  # most cells are names and words that stand in many rows
def escape(text: str) -> str:
    """Return ``text`` as a table's cell: one line without tabs, never empty, never ``n/a``, never a formula."""
    if text == "":
        return '""'
    if text == MISSING:
        return "n\\u002fa"
    if text.isascii() and text.isprintable() and "\\" not in text:
        line = text
    else:
        line = "".join(_SHORT.get(c) or (_number(c) if _is_active(c) else c) for c in text)
    return _OPENING.sub(lambda match: match[1] + _number(match[2]), line)


def unescape(cell: str) -> str:
    """Return the original text of a ``cell`` that `escape` returned.

    Parameters
    ----------
    cell
        One cell of a table, as text.

    Returns
    -------
    str
        The text before it was escaped.

    Examples
    --------
    >>> escape("=1+1"), unescape(escape("=1+1"))
    ('\\\\u003d1+1', '=1+1')
    """
    if cell == '""':
        return ""

    def character(match: re.Match[str]) -> str:
        digits = match[1] or match[2]
        return chr(int(digits, 16)) if digits else _LONG.get(match[3], match[0])

    return _ESCAPE.sub(character, cell)


def inert_json(value: Any, indent: int | None = None) -> str:
    """Return ``value`` as JSON with every active character as an escape; NaN and infinities become strings."""
    separators = None if indent else (",", ":")
    try:
        text = json.dumps(value, ensure_ascii=False, allow_nan=False, indent=indent, separators=separators)
    except ValueError:
        value = json.loads(json.dumps(value), parse_constant=str)
        text = json.dumps(value, ensure_ascii=False, allow_nan=False, indent=indent, separators=separators)
    if text.isascii() and "\x7f" not in text:
        return text
    # The only raw controls are the line ends of the indent: JSON escapes those within strings.
    return "".join(_json_number(c) if c != "\n" and _is_active(c) else c for c in text)


def _json_number(character: str) -> str:
    """Return the JSON escape of a character: four digits, or two surrogates."""
    units = character.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[i]:02x}{units[i + 1]:02x}" for i in range(0, len(units), 2))


def cell(value: Any) -> str:
    """Return a recorded value as a table's cell: mappings and sequences as JSON, None as ``n/a``."""
    if value is None:
        return MISSING
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return escape(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else escape(json.dumps(value))
    return inert_json(value)


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
    """Write an object as JSON with every active character as an escape."""
    file.write_text(inert_json(value, indent=2) + "\n", encoding="utf-8", newline="\n")
