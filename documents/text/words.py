"""Words for people: counts with their noun, the nearest spelling, text without hidden characters."""

from __future__ import annotations

import re
from collections.abc import Iterable

# No name is longer; finding the nearest spelling of a very long one would take seconds.
_LONGEST_WORD = 60
_SPACES = str.maketrans("\t\n\r", "   ")
# Unicode's bidirectional formatting characters (UAX 9): with them, one name looks like another.
_BIDIRECTIONAL = "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"
# For a regular expression: these, and control characters other than tabs and ends of lines.
HIDDEN = f"\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f{_BIDIRECTIONAL}"
_HIDDEN = re.compile(f"[{HIDDEN}\ud800-\udfff]")


def counted(count: float, one: str, many: str) -> str:
    """Return ``count`` and its noun: ``one`` where it is 1, else ``many``.

    Parameters
    ----------
    count
        How many.
    one, many
        The words after the number: for 1, and for any other.

    Returns
    -------
    str
        The number with its words.

    Examples
    --------
    >>> counted(1, "answer is", "answers are"), counted(3, "answer is", "answers are")
    ('1 answer is', '3 answers are')
    """
    return f"{count:.12g} {one if count == 1 else many}"


def nearest(word: str, known: Iterable[str], *, cutoff: float = 0.6) -> str | None:
    """Return the word of ``known`` that is spelled most like ``word``; None if none is near.

    Parameters
    ----------
    word
        The word as it was written.
    known
        The words to choose from.
    cutoff
        The least similarity in 0..1, as `difflib.get_close_matches` has it.

    Returns
    -------
    str or None
        A word of ``known``, or None.

    Examples
    --------
    >>> nearest("gama", ["gamma", "gain"])
    'gamma'
    """
    import difflib

    close = difflib.get_close_matches(word[:_LONGEST_WORD], list(known), n=1, cutoff=cutoff)
    return close[0] if close else None


def did_you_mean(word: str, known: Iterable[str], otherwise: str | None = None) -> str:
    """Return the remedy for an unknown ``word``: the nearest of ``known``, else ``otherwise``, else all of them.

    Parameters
    ----------
    word
        What was written.
    known
        The words that are allowed.
    otherwise
        The remedy where none is near; None lists all of ``known``.

    Returns
    -------
    str
        The remedy.

    Examples
    --------
    >>> did_you_mean("gama", ["gamma", "gain"])
    "did you mean 'gamma'?"
    >>> did_you_mean("x", ["gamma", "gain"])
    'expected one of: gamma, gain'
    """
    words = list(known)
    near = nearest(word, words)
    if near is not None:
        return f"did you mean '{near}'?"
    return "expected one of: " + ", ".join(words) if otherwise is None else otherwise


def hidden_character(text: str) -> str | None:
    """Return the first control character, lone surrogate or direction mark of ``text``; None if there is none.

    Tabs and ends of lines are none.
    """
    match = _HIDDEN.search(text)
    return match[0] if match else None


def visible(text: str) -> str:
    """Return ``text`` without hidden characters, and with spaces for tabs and ends of lines.

    Parameters
    ----------
    text
        Any text, such as a name from a file.

    Returns
    -------
    str
        The text on a single line, without control characters, lone surrogates and direction marks.

    Examples
    --------
    >>> visible("left" + chr(9) + "eye" + chr(0x202E))
    'left eye'
    """
    return _HIDDEN.sub("", text).translate(_SPACES)
