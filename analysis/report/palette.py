"""Colours of perceptual classes as in the thesis's Figure 4.18: 1 green, 2 blue, 3 yellow, 4 brown, 5 red."""

from __future__ import annotations

CLASS_COLOURS = ("#2f9e58", "#3a76d2", "#f0c52e", "#8c5a2b", "#d03b36")
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
