"""Numbers and values of headers as words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from analysis.classes.conclusions import p_words as p_words
from documents.text import chance as chance
from documents.text import fixed as fixed

UNITS: Mapping[str, str] = {
    "_cd_m2": "cd/m²",
    "_mm": "mm",
    "_px": "pixels",
    "_deg": "°",
    "_hz": "Hz",
    "_ms": "ms",
    "_s": "s",
}


def percent(share: float, digits: int = 0) -> str:
    """Return a share (0 to 1) in per cent."""
    return f"{fixed(100 * share, digits)} %"


def counted(number: float, noun: str) -> str:
    """Return "1 answer", "2 answers"."""
    return f"{number:,.10g} {noun}" if number == 1 else f"{number:,.10g} {noun}s"


def listed(words: Iterable[str]) -> str:
    """Return "a", "a and b", "a, b and c"."""
    parts = list(words)
    return " and ".join(filter(None, (", ".join(parts[:-1]), *parts[-1:])))


MOST_NAMED = 5


def some(names: Sequence[str]) -> str:
    """Return the first names, and how many more there are."""
    if len(names) <= MOST_NAMED:
        return listed(names)
    return f"{', '.join(names[:MOST_NAMED])} and {len(names) - MOST_NAMED} more"


COVARIANCE_WORDS: Mapping[str, str] = {
    "model": "the model, which treats all answers as independent",
    "scaled": "the model, scaled by how much observers differ",
    "sandwich": "the sandwich clustered by observer",
    "shrinkage": "the shrinkage covariance clustered by observer",
}


def key_words(key: object) -> str:
    """Return a key of a header as words, its unit in brackets."""
    words = str(key)
    for suffix, unit in UNITS.items():
        if words.endswith(suffix):
            words = f"{words.removesuffix(suffix)} ({unit})"
            break
    return words.replace("_", " ")


def plain(value: object) -> str:
    """Return a value of a header as words: mappings as "key: value", lists with commas, none as a dash."""
    if value is None or value == "" or value == () or value == [] or value == {}:
        return "–"
    if isinstance(value, Mapping):
        return "; ".join(f"{key_words(key)}: {plain(inner)}" for key, inner in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(plain(inner) for inner in value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value)


def as_words(name: str) -> str:
    """Return a factor's or a scale's name as words, its unit in brackets."""
    text = name.removesuffix("_s")
    return (f"{text} (s)" if text != name else name).replace("_", " ")
