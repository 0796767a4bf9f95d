"""The colours of all figures and pages, and what else tells series apart."""

from __future__ import annotations

INK = "#23282d"
FAINT = "#d8dde1"
DEEP = "#165466"
# Series that are told apart by more than their colour: each has a marker, dashes and a hatch of its own. The first five
# colours also stay apart in grey and to the colour-blind.
SERIES_COLOURS = ("#4b2f7d", "#3f7fdc", "#a9b1b8", "#206b3c", "#f5d34a", "#8c5a2b", "#2aa7a0", "#d03b36")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
HATCHES = ("", "//", "..", "xx", "--", "\\\\", "++", "oo")
# Classes of stimuli, best first. They stay apart in grey and to the colour-blind; the thesis's own do not.
CLASS_COLOURS = ("#3dbb86", "#2050a8", "#f8dc55", "#4f2d0d", "#d6453c")
FURTHER_COLOURS = ("#7b5ea7", "#6d7782", "#2aa7a0", "#c06a9b")
NO_CLASS = "#9aa3ab"


def class_colours(label: str | None) -> tuple[str, ...]:
    """Return one colour for each class in a label such as "3+4"; a grey for no class."""
    if not label:
        return (NO_CLASS,)
    return tuple(_colour(int(number)) for number in label.split("+"))


def _colour(number: int) -> str:
    if number <= len(CLASS_COLOURS):
        return CLASS_COLOURS[number - 1]
    return FURTHER_COLOURS[(number - len(CLASS_COLOURS) - 1) % len(FURTHER_COLOURS)]
