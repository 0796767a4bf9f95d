"""Check what the screens of a session will look like: words that fit the view and cover no picture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, islice
from typing import Any, NamedTuple

from documents import Finding
from documents.fonts import font_name, other_fonts, undrawable
from documents.text import counted
from documents.yaml import Path_, YamlSource
from runner.blocks.block import Block, Draft
from runner.blocks.message import pause_menu
from runner.blocks.text_entry import typed
from runner.check.report import CheckReport
from runner.observers.simulated import walk
from runner.presenter.lettering import Area, text_area
from runner.protocol.experiment import Experiment
from runner.scene import Picture, Scene, Text
from runner.views.pages import page

# More screens than show all there is to read: pages between trials come every some dozens of trials.
_MOST_STEPS = 2_000
_SHOWN = 40
_LETTERS = 12


_NO_FONT = "name a font file that has them as font: under style: text, install a font for them, or write other letters"


class _Misfit(NamedTuple):
    """Words that do not fit: ``what`` is wrong, how many of their letters would fit, and a ``remedy`` of its own."""

    words: str
    what: str
    fitting: int
    remedy: str = ""


def check_screens(report: CheckReport, design: Experiment, source: YamlSource) -> None:
    """Report words that leave an eye's view, are drawn over a picture, or over other words; each once.

    Likewise letters that no font has, and the fonts other than DejaVu Sans that have some.
    """
    told: set[tuple[str, str]] = set()
    texts: set[Text] = set()
    trials = sum(block.trials for block in design.example_blocks)
    for index, (spec, block) in enumerate(zip(design.spec.blocks, design.example_blocks, strict=True)):
        scenes = (design.style.with_progress(scene, 0, trials) for scene in _scenes(block))
        for misfit in _misfits(scenes, design.view_px, texts):
            if (misfit.words, misfit.remedy) in told:
                continue
            told.add((misfit.words, misfit.remedy))
            where = f"in block {index + 1} ({spec.kind})"
            report.errors.append(_finding(misfit, where, _place(misfit.words, index, source.data), source, design))
    for misfit in _misfits(_around(design), design.view_px, texts):
        own = [("words", name) for name, words in design.spec.words.items() if words.strip() in misfit.words]
        where = "at the end" if misfit.words == (design.end_page or "").rstrip() else "around the blocks"
        report.errors.append(_finding(misfit, where, own[0] if own else ("style",), source, design))
    if fonts := other_fonts("".join(sorted({text.words for text in texts})), design.font):
        report.facts["fonts"] = [f"{font_name(font)} ({font.name})" for font in fonts]


def _scenes(block: Block) -> Iterator[Scene]:
    return (step.scene for step in islice(walk(block), _MOST_STEPS) if not isinstance(step, Draft))


def _around(design: Experiment) -> Iterator[Scene]:
    """Yield the screens that belong to no block: the pause menu, the field for a note, the page at the end."""
    yield pause_menu(design.style, can_repeat=True).scene
    yield next(typed(design.style.say("note"), design.style, required=False)).scene
    if design.end_page:
        yield page(design.end_page, design.style, "finish").scene


def _finding(misfit: _Misfit, where: str, place: Path_, source: YamlSource, design: Experiment) -> Finding:
    words = " ".join(misfit.words.split())
    begins = words if len(words) <= _SHOWN else f"{words[:_SHOWN].rstrip()}…"
    if misfit.remedy:
        return source.finding(place, f"{where} the words '{begins}' {misfit.what}", misfit.remedy)
    if place[-1:] == ("text",):
        remedy = "write fewer lines, or a page more: another block of instructions"
    elif misfit.fitting:
        remedy = f"about {counted(misfit.fitting, 'letter fits', 'letters fit')}: shorten it, or make size_mm smaller"
    else:
        remedy = "make size_mm or gap_mm smaller, or change the arrangement"
    if design.style.type_px is not None:
        remedy += ", or write a smaller height_arcmin under style: text"
    return source.finding(place, f"{where} the words '{begins}' {misfit.what}", remedy)


def _misfits(scenes: Iterator[Scene], view_px: tuple[int, int], known: set[Text]) -> Iterator[_Misfit]:
    """Yield the words of ``scenes`` that do not fit an eye's view of ``view_px``, or that no font here can draw.

    Equal screens are looked at once. ``known`` are the texts that were looked at, to which these are added.
    """
    seen: set[tuple[Any, ...]] = set()
    for scene in scenes:
        texts = [item for item in scene.items if isinstance(item, Text)]
        pictures = _pictures(scene)
        key = (*texts, *pictures)
        if key not in seen:
            seen.add(key)
            yield from _empty_boxes([text for text in texts if text not in known])
            known.update(texts)
            if misfits := list(_misfits_of(texts, pictures, view_px)):
                yield _worst(misfits, texts)


def _empty_boxes(texts: Sequence[Text]) -> Iterator[_Misfit]:
    for text in texts:
        if letters := undrawable(text.words, text.font):
            named = ", ".join(f"{letter} (U+{ord(letter):04X})" for letter in letters[:_LETTERS])
            more = f" and {len(letters) - _LETTERS} more" if len(letters) > _LETTERS else ""
            yield _Misfit(text.words, f"would show empty boxes: no font here has {named}{more}", 0, _NO_FONT)


def _worst(misfits: Sequence[_Misfit], texts: Sequence[Text]) -> _Misfit:
    """Return of a screen's misfits that of its longest words, which leave no room for the others."""
    longest = max((text.words for text in texts), key=len)
    misfit = max(misfits, key=lambda misfit: len(misfit.words))
    if len(longest) > 2 * len(misfit.words):
        return _Misfit(longest, f"leave no room for '{misfit.words[:_SHOWN]}'", 0)
    return misfit


def _misfits_of(texts: Sequence[Text], pictures: Sequence[Area], view_px: tuple[int, int]) -> Iterator[_Misfit]:
    areas = [(text, area) for text in texts if (area := text_area(text))]
    for text, area in areas:
        if not area.within(view_px):
            need = f"{area.right - area.left} x {area.bottom - area.top} px"
            what = f"do not fit: they need {need} there, and leave an eye's view of {view_px[0]} x {view_px[1]} px"
            yield _Misfit(text.words, what, _fitting(text, pictures, view_px))
        elif any(_overlap(area, picture) for picture in pictures):
            yield _Misfit(text.words, "are drawn over a picture", _fitting(text, pictures, view_px))
    for (one, first), (other, second) in combinations(areas, 2):
        if _overlap(first, second):
            longer, shorter = sorted((one, other), key=lambda text: -len(text.words))
            what = f"are drawn over the words '{shorter.words[:_SHOWN]}'"
            others = [area for text, area in areas if text is not longer]
            yield _Misfit(longer.words, what, _fitting(longer, [*pictures, *others], view_px))


def _pictures(scene: Scene) -> list[Area]:
    """Return where pictures stand that have an aperture; what blocks draw themselves is laid out with its words."""
    return [_area(item) for item in scene.items if isinstance(item, Picture) and item.aperture_px]


def _area(picture: Picture) -> Area:
    (x, y), (width, height) = picture.offset_px, picture.aperture_px or (0, 0)
    left, top = x - width // 2, y - height // 2
    return Area(left, top, left + width, top + height)


def _overlap(one: Area, other: Area) -> bool:
    across = one.left < other.right and other.left < one.right
    return across and one.top < other.bottom and other.top < one.bottom


def _fitting(text: Text, others: Sequence[Area], view_px: tuple[int, int]) -> int:
    """Return how many letters of ``text`` would fit, to the nearest ten below."""

    def fits(length: int) -> bool:
        shorter = Text(text.words[:length], text.offset_px, text.height_px, text.width_px)
        area = text_area(shorter)
        return area is None or (area.within(view_px) and not any(_overlap(area, other) for other in others))

    low, high = 0, len(text.words)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low // 10 * 10


def _place(words: str, index: int, data: Any) -> Path_:
    """Return where the file says ``words``: in its block, as the experiment's question, else the block itself."""
    for place, value in _texts(data["blocks"][index], ("blocks", index)):
        if value.strip() and value.strip() in words:
            return place
    if str(data.get("question", "")).strip() in words:
        return ("question",)
    return ("blocks", index)


def _texts(value: Any, place: Path_) -> Iterator[tuple[Path_, str]]:
    """Yield the long texts below ``place``, the longest first: names of things stand in other words."""
    found: list[tuple[Path_, str]] = []
    if isinstance(value, str):
        found.append((place, value))
    elif isinstance(value, dict | list):
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            found += _texts(inner, (*place, key))
    yield from sorted(found, key=lambda item: -len(item[1]))
