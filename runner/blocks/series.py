"""Series of pictures: which stimuli make one, by name or by their factors, and what is drawn while one is browsed."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag

from documents.yaml import FileModel
from runner.blocks.block import Fault, Named, name_faults
from runner.blocks.context import Stimuli, level_words
from runner.ports import Button
from runner.scene import Item, Picture, Scene
from runner.views.field_types import Factor, Line
from runner.views.layout import SingleLayout
from runner.views.style import Style


@dataclass(frozen=True, slots=True)
class Browsable:
    """Pictures to browse, in order; series of one ``group`` show the same thing."""

    name: str
    stimuli: tuple[str, ...]
    group: str = ""


Names = Annotated[list[str], Field(min_length=2)]


class SeriesBySpec(FileModel):
    """Series that the stimuli's factors make.

    Stimuli that agree in every factor of ``by`` make a series, sorted by the factor ``order``. Series that agree in the
    first factor of ``by`` are kept apart where that can be avoided.
    """

    by: Annotated[list[Factor], Field(min_length=1)]
    """The factors that stimuli of one series agree in."""
    order: Factor
    """The factor that a series is sorted by."""


def _tag(value: Any) -> str:
    return (
        "by-factors" if isinstance(value, SeriesBySpec) or (isinstance(value, Mapping) and "by" in value) else "by-name"
    )


SomeSeries = Annotated[
    Annotated[SeriesBySpec, Tag("by-factors")] | Annotated[dict[Line, Names], Field(min_length=1), Tag("by-name")],
    Discriminator(_tag),
]


def find_series(some: SomeSeries, stimuli: Stimuli) -> tuple[Browsable, ...]:
    """Return the series that are named, or those that the stimuli's factors make."""
    if not isinstance(some, SeriesBySpec):
        return tuple(Browsable(name, tuple(names)) for name, names in some.items())
    members: dict[tuple[str | float, ...], list[str]] = {}
    for name in stimuli.names:
        factors = stimuli.factors[name]
        if all(key in factors for key in (*some.by, some.order)):
            members.setdefault(tuple(factors[key] for key in some.by), []).append(name)
    return tuple(
        Browsable(
            "-".join(map(level_words, values)),
            tuple(sorted(names, key=lambda name: _sortable(stimuli.factors[name][some.order]))),
            level_words(values[0]),
        )
        for values, names in members.items()
    )


def series_named(some: SomeSeries, stimuli: Stimuli) -> Iterator[Named]:
    """Yield each series' name, which means its pictures in their order."""
    for series in find_series(some, stimuli):
        path = ("series", "by") if isinstance(some, SeriesBySpec) else ("series", series.name)
        yield Named("series", series.name, series.stimuli, ", ".join(series.stimuli), path)


def series_faults(some: SomeSeries, stimuli: Stimuli) -> Iterator[Fault]:
    """Yield wrong stimuli or factors, series of one picture, and pictures of a series in the same place."""
    if not isinstance(some, SeriesBySpec):
        for series, names in some.items():
            yield from name_faults(names, stimuli, "series", series, at_least=2)
        return
    known = sorted({key for name in stimuli.names for key in stimuli.factors[name]})
    places = [(("by", index), key) for index, key in enumerate(some.by)] + [(("order",), some.order)]
    for place, key in places:
        without = [name for name in stimuli.names if key not in stimuli.factors[name]]
        if without:
            remedy = f"the stimuli have: {', '.join(known)}" if known else "name the series' stimuli"
            yield Fault(f"the stimulus '{without[0]}' has no factor '{key}'", ("series", *place), remedy)
    if all(key in known for _, key in places):
        yield from _order_faults(find_series(some, stimuli), stimuli, some.order)


def _order_faults(all_series: tuple[Browsable, ...], stimuli: Stimuli, order: str) -> Iterator[Fault]:
    for series in all_series:
        if len(series.stimuli) < 2:
            only = f"the series '{series.name}' has only the picture '{series.stimuli[0]}'"
            yield Fault(only, ("series", "by"), "name fewer factors")
        for name, other in pairwise(series.stimuli):
            if stimuli.factors[name][order] == stimuli.factors[other][order]:
                same = f"'{name}' and '{other}' of the series '{series.name}' have the same {order}"
                yield Fault(same, ("series", "by"), "name the factor in which they differ")


def _sortable(value: str | float) -> tuple[bool, float, str]:
    """Return a key by which numbers come before words."""
    return (True, 0.0, value) if isinstance(value, str) else (False, float(value), "")


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
        style.text_at(question, layout.question_px, width_px=layout.question_width_px),
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


def series_targets(count: int, layout: SingleLayout, style: Style) -> dict[str, Button]:
    """Return where to click for ``previous``, ``next`` and ``choose``: two arrow heads and the picture."""
    y = layout.below_px / style.unit_px + _ROW
    middle, step = _row(count, layout, style)
    edge = count * step / 2 + _HEAD
    return {
        "previous": style.target(middle - edge, y, 60, 50),
        "next": style.target(middle + edge, y, 60, 50),
        "choose": Button(layout.picture_px, layout.aperture_px),
    }


def _row(count: int, layout: SingleLayout, style: Style) -> tuple[float, float]:
    """Return the middle of the row, below the picture, and how far apart its boxes are."""
    middle = layout.picture_px[0] / style.unit_px
    widest = min(_WIDEST, _room(middle, style) - 2 * (_HEAD + 30))
    return middle, min(_STEP, max(widest, 0.0) / count)


def _room(middle: float, style: Style) -> float:
    """Return how wide something about ``middle`` can be within an eye's view."""
    return style.view_px[0] / style.unit_px - 2 * abs(middle) - 20
