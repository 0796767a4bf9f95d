"""Which typed characters are words: letters, digits, signs and spaces, and nothing that hides or turns others."""

from __future__ import annotations

import unicodedata

_REFUSED = frozenset({"Cc", "Cs", "Co", "Cn", "Zl", "Zp"})
_BIDIRECTIONAL = frozenset("\u061c\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def typed_character(codepoint: int) -> str | None:
    """Return the character of ``codepoint``, None if it is a control character, a direction mark or none at all."""
    try:
        character = chr(codepoint)
    except (ValueError, OverflowError):
        return None
    if unicodedata.category(character) in _REFUSED or character in _BIDIRECTIONAL:
        return None
    return character
