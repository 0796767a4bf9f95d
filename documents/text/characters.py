"""Characters that hide, turn round or break what people read."""

from __future__ import annotations

import unicodedata

_LAYOUT = frozenset("\t\n\r")
# Unicode's bidirectional formatting characters (UAX 9): with them, one name looks like another.
_BIDIRECTIONAL = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def hidden_character(text: str) -> str | None:
    """Return the first control character, lone surrogate or direction mark of ``text``; None if there is none.

    Tabs and ends of lines are none.
    """
    if text.isascii() and text.isprintable():
        return None
    for character in text:
        if character in _BIDIRECTIONAL or (
            unicodedata.category(character) in ("Cc", "Cs") and character not in _LAYOUT
        ):
            return character
    return None


def visible(text: str) -> str:
    """Return ``text`` without hidden characters, and with spaces for tabs and ends of lines."""
    return "".join(" " if c in _LAYOUT else c for c in text if c in _LAYOUT or hidden_character(c) is None)
