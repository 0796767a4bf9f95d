"""What is drawn of a series while one leafs through it: the picture, and where it stands among the others."""

from __future__ import annotations

from collections.abc import Collection

from runner.blocks.layouts import SingleLayout
from runner.blocks.style import Style
from runner.ports import Target
from runner.presenter.scene import Item, Picture, Scene, Text

_ROW, _COUNT, _HINT = 34.0, 74.0, 120.0  # from the picture's lower edge, in units of Style
_WIDEST, _STEP = 640.0, 44.0
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
) -> Scene:
    """Return picture ``index``, the question above it, and below it a row of boxes, a count and a hint.

    The box of the picture shown is bright and large; those of pictures that were ``seen`` are brighter than the rest.
    """
    top = layout.below_px / style.unit_px
    items: list[Item] = [
        *series_pictures(stimuli[index], layout, reference),
        Text(question, layout.question_px, style.px(24), layout.question_width_px),
    ]
    step = _step(len(stimuli))
    for number in range(len(stimuli)):
        here = number == index
        share = _HERE if here else _SEEN if number in seen else _UNSEEN
        x = (number - (len(stimuli) - 1) / 2) * step
        items.append(style.box(x, top + _ROW, step * (0.8 if here else 0.7), 20 if here else 12, share))
    items.append(style.text(f"{index + 1} / {len(stimuli)}", 0, top + _COUNT, height=24, share=0.3))
    items.append(style.text(hint, 0, top + _HINT, height=18, share=_SMALL))
    edge = _edge(len(stimuli))
    items += [style.text(words, x, top + _ROW, height=22, share=_SMALL) for words, x in (("◀", -edge), ("▶", edge))]
    return Scene(tuple(items))


def series_targets(count: int, layout: SingleLayout, style: Style) -> dict[str, Target]:
    """Return where to click for ``previous``, ``next`` and ``choose``: two arrow heads and the picture."""
    y = layout.below_px / style.unit_px + _ROW
    edge = _edge(count)
    return {
        "previous": style.target(-edge, y, 60, 50),
        "next": style.target(edge, y, 60, 50),
        "choose": Target(layout.picture_px, layout.aperture_px),
    }


def _step(count: int) -> float:
    return min(_STEP, _WIDEST / count)


def _edge(count: int) -> float:
    return count * _step(count) / 2 + 40
