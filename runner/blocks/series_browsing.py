"""Browsing one series: what is drawn of it, and the choice of one picture."""

from __future__ import annotations

from collections.abc import Collection

from runner.blocks.layout import SingleLayout
from runner.blocks.style import Style
from runner.ports import Target
from runner.presenter.scene import Item, Picture, Scene, Text

_ROW, _COUNT, _HINT = 34.0, 74.0, 120.0  # from the picture's lower edge, in units of Style
_WIDEST, _STEP, _HEAD = 640.0, 44.0, 40.0  # the row, from box to box, from its end to the arrow head
_HERE, _SEEN, _UNSEEN, _SMALL = 0.6, 0.18, 0.03, 0.2  # shares of white


def series_pictures(stimulus: str, layout: SingleLayout, reference: str | None) -> tuple[Item, ...]:
    """Return the picture in its place, with the reference picture if there is one."""
    return Picture(stimulus, layout.picture_px, layout.aperture_px), *layout.reference(reference)


def series_scene(
    stimuli: tuple[str, ...],
    index: int,
    seen: Collection[int],
    question: str,
    hint: str,
    layout: SingleLayout,
    style: Style,
    reference: str | None = None,
    *,
    wrap: bool = False,
) -> Scene:
    """Return picture ``index``, the question above it, and below it a row of boxes, a count and a hint.

    The box of the picture shown is bright and large; those of pictures that were ``seen`` are brighter than the rest.
    An arrow head stands at an end beyond which there are more, with ``wrap`` at both.
    """
    top = layout.below_px / style.unit_px
    items: list[Item] = [
        *series_pictures(stimuli[index], layout, reference),
        Text(question, layout.question_px, style.px(24), layout.question_width_px),
    ]
    middle, step = _row(len(stimuli), layout, style)
    for number in range(len(stimuli)):
        here = number == index
        share = _HERE if here else _SEEN if number in seen else _UNSEEN
        x = middle + (number - (len(stimuli) - 1) / 2) * step
        items.append(style.box(x, top + _ROW, step * (0.8 if here else 0.7), 20 if here else 12, share))
    items.append(style.text(f"{index + 1} / {len(stimuli)}", middle, top + _COUNT, height=24, share=0.3))
    room = _room(middle, style)
    items.append(style.text(hint, middle, top + _HINT, height=20, width=room, share=_SMALL))
    edge = len(stimuli) * step / 2 + _HEAD
    if wrap or index:
        items.append(style.text("◀", middle - edge, top + _ROW, height=22, share=_SMALL))
    if wrap or index + 1 < len(stimuli):
        items.append(style.text("▶", middle + edge, top + _ROW, height=22, share=_SMALL))
    return Scene(tuple(items))


def series_targets(count: int, layout: SingleLayout, style: Style) -> dict[str, Target]:
    """Return where to click for ``previous``, ``next`` and ``choose``: two arrow heads and the picture."""
    y = layout.below_px / style.unit_px + _ROW
    middle, step = _row(count, layout, style)
    edge = count * step / 2 + _HEAD
    return {
        "previous": style.target(middle - edge, y, 60, 50),
        "next": style.target(middle + edge, y, 60, 50),
        "choose": Target(layout.picture_px, layout.aperture_px),
    }


def _row(count: int, layout: SingleLayout, style: Style) -> tuple[float, float]:
    """Return the middle of the row, below the picture, and how far apart its boxes are."""
    middle = layout.picture_px[0] / style.unit_px
    widest = min(_WIDEST, _room(middle, style) - 2 * (_HEAD + 30))
    return middle, min(_STEP, max(widest, 0.0) / count)


def _room(middle: float, style: Style) -> float:
    """Return how wide something about ``middle`` can be within an eye's view."""
    return style.view_px[0] / style.unit_px - 2 * abs(middle) - 20
