"""A page of words that waits for the observer to go on."""

from __future__ import annotations

from dataclasses import replace

from runner.ports import Ask, Button
from runner.presenter.lettering import text_area
from runner.scene import Scene
from runner.views.style import Style

CONTINUE_KEYS = {"space": "continue", "enter": "continue", "pad_a": "continue"}
_TYPE, _WIDTH, _HINT_BELOW, _HINT_ROOM = 26, 860, 60, 20


def page(words: str, style: Style, hint: str = "press_space") -> Ask:
    """Return a page that waits for the space bar, Enter, a gamepad's first button or a click on the ``hint``.

    The hint is one of the interface's words: ``press_space``, ``next_page``, ``begin`` or ``finish``.
    """
    text = style.text(words.rstrip(), height=_TYPE, width=_WIDTH)
    area = text_area(text)
    # In the middle, or higher where the hint would not fit below.
    below = (area.bottom if area else 0) + style.px(_HINT_BELOW)
    up = max(0, below + style.px(_HINT_ROOM) - style.room_px[1] // 2)
    told = style.text(style.say(hint), height=20, share=0.2)
    place = 0, below - up
    return Ask(
        Scene((replace(text, offset_px=(0, -up)), replace(told, offset_px=place))),
        CONTINUE_KEYS,
        targets={"continue": Button(place, (style.px(400), style.px(50)))},
    )
