"""The pause: what Escape opens, in the middle of anything."""

from __future__ import annotations

from runner.blocks.style import Style
from runner.ports import Ask
from runner.presenter.scene import Scene

_OPTIONS = {"c": "continue", "r": "repeat", "n": "note", "s": "stop"}
_WORDS = {
    "continue": "C   go on",
    "repeat": "R   repeat the last trial",
    "note": "N   write a note",
    "stop": "S   stop; every answer so far is kept, and the session can be resumed",
}


def pause_menu(style: Style, *, can_repeat: bool) -> Ask:
    """Return the menu; its meanings: ``continue``, ``repeat`` (if there is a trial to repeat), ``note``, ``stop``."""
    keys = {key: meaning for key, meaning in _OPTIONS.items() if can_repeat or meaning != "repeat"}
    heights = {meaning: -70.0 + 64.0 * row for row, meaning in enumerate(keys.values())}
    return Ask(
        Scene(
            (
                style.text("Pause", y=-170, height=36),
                *(style.text(_WORDS[meaning], y=y, height=24) for meaning, y in heights.items()),
            )
        ),
        {**keys, "escape": "continue"},
        targets={meaning: style.target(0, y, 880, 56) for meaning, y in heights.items()},
    )
