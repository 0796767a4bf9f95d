"""Answers that prefer neither of two: the relaxed forced choice."""

from __future__ import annotations

from typing import Literal

from runner.blocks.style import Style
from runner.ports import Target
from runner.presenter.scene import Offset, Text

Ties = Literal["none", "no_difference", "not_sure", "both"]
TIES = ("no_difference", "not_sure")
_KEYS = {"no_difference": "n", "not_sure": "u"}
_WORDS = {"no_difference": "N: no difference", "not_sure": "U: not sure"}
_APART, _WIDTH, _HEIGHT = 220.0, 210.0, 30.0  # units of Style


def tie_meanings(ties: Ties) -> tuple[str, ...]:
    """Return the answers beside ``first`` and ``second``."""
    return TIES if ties == "both" else () if ties == "none" else (ties,)


def tie_keys(ties: Ties) -> dict[str, str]:
    """Return the keys of these answers."""
    return {_KEYS[meaning]: meaning for meaning in tie_meanings(ties)}


def tie_words(ties: Ties, middle_px: Offset, style: Style) -> tuple[Text, ...]:
    """Return the answers in small words, side by side about a place."""
    places = _places(ties, middle_px, style)
    return tuple(Text(_WORDS[m], place, style.px(17), style.px(_WIDTH), 0.2) for m, place in places.items())


def tie_targets(ties: Ties, middle_px: Offset, style: Style) -> dict[str, Target]:
    """Return where the answers can be clicked."""
    size = style.px(_WIDTH), style.px(_HEIGHT)
    return {meaning: Target(place, size) for meaning, place in _places(ties, middle_px, style).items()}


def _places(ties: Ties, middle_px: Offset, style: Style) -> dict[str, Offset]:
    meanings = tie_meanings(ties)
    left = -_APART * (len(meanings) - 1) / 2
    return {m: (middle_px[0] + style.px(left + _APART * n), middle_px[1]) for n, m in enumerate(meanings)}
