"""The pause: what Escape opens, in the middle of anything."""

from __future__ import annotations

from runner.blocks.style import Style
from runner.blocks.text_entry import button
from runner.ports import Ask
from runner.presenter.scene import Scene

_OPTIONS = {"c": "continue", "r": "repeat", "n": "note", "s": "stop"}
_WORDS = {
    "continue": "Go on",
    "repeat": "Repeat the last trial",
    "note": "Write a note",
    "stop": "Stop the session",
}
_KEPT = "Every answer so far is kept; a stopped session can be resumed."
_TOP, _ROW = -80.0, 72.0


def pause_menu(style: Style, *, can_repeat: bool) -> Ask:
    """Return the menu; its meanings: ``continue``, ``repeat`` (if there is a trial to repeat), ``note``, ``stop``."""
    keys = {key: meaning for key, meaning in _OPTIONS.items() if can_repeat or meaning != "repeat"}
    rows = {key: _TOP + _ROW * row for row, key in enumerate(keys)}
    below = _TOP + _ROW * len(rows) + 10.0
    buttons = [
        item
        for key, y in rows.items()
        for item in (
            *button(style, key.upper(), -190, y, 52, 52),
            *button(style, _WORDS[keys[key]], 35, y, 370, 52),
        )
    ]
    return Ask(
        Scene(
            (
                style.text("Pause", y=_TOP - 90, height=36),
                *buttons,
                style.text(_KEPT, y=below, height=20, share=0.2),
            )
        ),
        {**keys, "escape": "continue"},
        targets={keys[key]: style.target(0, y, 440, 60) for key, y in rows.items()},
    )
