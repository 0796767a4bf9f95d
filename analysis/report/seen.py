"""What the eyes saw, in words: the page's section, its captions and notes, and sentences for Methods."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from analysis.records.answered_by import who_answered
from analysis.records.seen import Both, Cost, Seen, what_eyes_saw
from analysis.records.session_record import SessionLog
from analysis.report.references import Citations
from analysis.report.words import counted, fixed, key_words, listed, percent
from documents.pages import Block, Column, Facts, Heading, Paragraph, Section, Table

NOT_RECORDED = "Not recorded"
NO_EYE = "The sessions are simulated: no eye saw anything, and what follows is what the display would have shown."
_FILTERS_ARE = {
    "measured": "measured with the display",
    "stated": "as the rig states them",
    "assumed": "round figures, not measured",
}
_NONE = "none"


def seen_section(sessions: Sequence[SessionLog]) -> Section:
    """Return what the eyes saw, for each way in which sessions were shown, and the same as numbers."""
    each = what_eyes_saw(sessions)
    blocks: list[Block] = [Paragraph(NO_EYE)] if who_answered(sessions).all_simulated else []
    for seen, count in each.items():
        blocks += [Heading(f"In {counted(count, 'session')}")] if len(each) > 1 else []
        blocks.append(Facts(tuple(_facts(seen))))
    rows = [{"sessions": count, **seen.to_json()} for seen, count in each.items()]
    keys = dict.fromkeys(key for row in rows for key in row)
    columns = tuple(Column(key_words(key).replace("delta e 00", "ΔE₀₀"), key) for key in keys)
    cells = tuple(tuple(row.get(key) for key in keys) for row in rows)
    blocks.append(Table("seen", "The numbers", columns, cells, folded=True))
    return Section("seen", "What the eyes saw", tuple(blocks))


def filters_notes(sessions: Sequence[SessionLog]) -> Iterator[str]:
    """Yield that an anaglyph's filters changed colours as an eye notices, or that it is not recorded what they cost."""
    from devices.compensation import NOTICED_DELTA_E_00

    for seen in what_eyes_saw(sessions):
        lead = f"The pictures were shown as an anaglyph ({seen.mode}), through coloured filters"
        if seen.has_filters and seen.filters is None:
            yield f"{lead}: what these cost the colours is not recorded."
        elif seen.filters and seen.filters.worst_mean >= NOTICED_DELTA_E_00:
            assumed = " (in round figures, not measured)" if "assumed" in (seen.filters_are or ()) else ""
            yield (
                f"{lead}{assumed}: the colours at the eyes differ from those of the pictures by a "
                f"{_cost(seen.filters)}."
            )


def methods_words(sessions: Sequence[SessionLog], cited: Citations) -> str:
    """Return sentences on size, surround, resampling, filters and clipping."""
    each = what_eyes_saw(sessions)
    said = [
        " ".join([*([f"In {counted(count, 'session')}:"] if len(each) > 1 else []), *_sentences(seen, cited)])
        for seen, count in each.items()
    ]
    return " ".join(filter(None, said))


def caption(sessions: Sequence[SessionLog]) -> str:
    """Return what the small pictures are, and in what they are not what the eyes saw."""
    each = what_eyes_saw(sessions)
    some = " in some of the sessions" if len(each) > 1 else ""
    words = [
        f"{_lead(sessions, each)}, reduced in size and converted to sRGB: the display's white is this page's white, "
        "and colours outside its gamut are clipped here too."
    ]
    if any(seen.has_filters for seen in each):
        words.append(f"These are not the colours at the eyes: the pictures are an anaglyph{some}.")
    for otherwise in dict.fromkeys(seen.otherwise for seen in each if seen.otherwise):
        words.append(f"Each eye sees {otherwise}{some}.")
    return " ".join(words)


def _lead(sessions: Sequence[SessionLog], each: Iterable[Seen]) -> str:
    if any(seen.otherwise for seen in each):
        return "The view for each eye"
    if any(seen.nominal for seen in each):
        return "As a display of the standard shows them to each eye"
    would = who_answered(sessions).all_simulated
    return f"As the display {'would have shown' if would else 'showed'} them to each eye"


def white_place(seen: Seen) -> str:
    """Return where the display's white is what Methods say: at the eye, or before the filters; empty if not known."""
    if not seen.has_filters or seen.filters_are == ("measured", "measured"):
        return " at the eye"
    return " before the filters" if seen.filters_are else ""


def mode_words(seen: Seen) -> str:
    """Return the stereo mode, and what it does to the pictures."""
    if not seen.mode:
        return f"{NOT_RECORDED}."
    words = seen.mode
    if seen.has_filters:
        words += ": one picture of both views, seen through coloured filters"
    elif seen.sampled:
        words += f": each eye sees {seen.sampled} of its view"
    elif seen.mode == "flat":
        words += ": both eyes see the same pixels"
    if seen.characterised_as and seen.characterised_as != seen.mode:
        words += f"; the display was characterised in the mode {seen.characterised_as}, not in this one"
    return f"{words}."


def _facts(seen: Seen) -> Iterator[tuple[str, str]]:
    yield "Stereo mode", mode_words(seen)
    if seen.nominal:
        glasses = f" What the {seen.glasses} glasses take of the light is not known." if seen.glasses else ""
        yield "Colours", f"Those of a standard, nominal, not measured ({seen.nominal}).{glasses}"
    if seen.has_filters:
        yield "Filters", f"{_filters(seen)}; {_cost(seen.filters)}." if seen.filters else f"{_filters(seen)}."
    yield "Clipping", f"{_upper(_cost(seen.clipping))}." if seen.clipping else f"{NOT_RECORDED}."
    if seen.ghosts:
        yield "Crosstalk left", f"{_upper(_cost(seen.ghosts))}, gamut included."
    if seen.white_cd_m2:
        yield "White", f"{_luminance(seen.white_cd_m2)} at the eyes."
    if dimmed := list(_dimmed(seen)):
        yield "Light", " ".join(dimmed)
    yield "Size", _size(seen)
    yield "Surround", f"{_luminance(seen.surround_cd_m2)} at the eyes." if seen.surround_cd_m2 else f"{NOT_RECORDED}."
    yield "Resampling", f"{_resampling(seen)}."
    if seen.partly_unseen:
        yield "Unseen", "In some trials the panel was larger than the screen: a part was not seen."
    if seen.changed:
        yield "Changed", _changed(seen)


def _sentences(seen: Seen, cited: Citations) -> Iterator[str]:
    if seen.smallest:
        where = f", on a surround of {_luminance(seen.surround_cd_m2)}" if seen.surround_cd_m2 else ""
        yield f"Pictures covered {_size(seen).rstrip('.')}{where}."
    if seen.resampled:
        pixels = seen.resampled == (_NONE,)
        yield "They were not resampled." if pixels else f"Pixels were resampled: {_resampling(seen)}."
    yield from _dimmed(seen)
    if seen.sampled:
        yield f"In the mode {seen.mode} each eye sees {seen.sampled} of its view."
    if seen.has_filters:
        known = f" ({_lower(_filters(seen))})" if seen.filters_are else ""
        cost = (
            f"so that what it sees differs from its view by a {_cost(seen.filters, cited)}"
            if seen.filters
            else "and what these cost the colours is not recorded"
        )
        yield f"Each eye sees one picture of both views through its coloured filter{known}, {cost}."
        if seen.white_cd_m2:
            yield f"Behind the filters white has {_luminance(seen.white_cd_m2)}."
    if seen.clipping:
        caused = f"caused a {_cost(seen.clipping, cited)}" if seen.clipping.largest else "changed no colour"
        yield f"Clipping to the display's gamut {'besides ' * seen.has_filters}{caused}."
    if seen.changed:
        yield _changed(seen)


def _dimmed(seen: Seen) -> Iterator[str]:
    if seen.dimmed_to is not None:
        yield f"Pictures had {percent(seen.dimmed_to, 1)} of their luminance, so that the panel was even."
    if seen.lifted_by is not None:
        yield f"Black was lifted by {percent(seen.lifted_by, 2)} of white, so that crosstalk could be cancelled."


def _filters(seen: Seen) -> str:
    if seen.filters_are is None:
        return f"{NOT_RECORDED}" if seen.filters is None else "Where they are known from is not recorded"
    left, right = (_FILTERS_ARE[known] for known in seen.filters_are)
    return _upper(left) if left == right else f"Left {left}, right {right}"


def _cost(cost: Cost, cited: Citations | None = None) -> str:
    """Return the mean over stimuli and eyes, the worst of one stimulus, and the largest of a pixel."""
    if not cost.largest:
        return "ΔE₀₀ of 0 in every pixel"
    measure = f"ΔE₀₀ {cited.cite('Sharma2005')}" if cited else "ΔE₀₀"
    mean, worst, largest = fixed(cost.mean, 3), fixed(cost.worst_mean, 3), fixed(cost.largest, 1)
    return (
        f"mean {measure} of {mean} per pixel over stimuli and eyes, {worst} in the worst case ({cost.stimulus}), "
        f"{largest} at most"
    )


def _size(seen: Seen) -> str:
    if seen.smallest is None or seen.largest is None:
        return f"{NOT_RECORDED}."
    sizes = dict.fromkeys((seen.smallest, seen.largest))
    pixels = " to ".join(f"{size.width_px} × {size.height_px}" for size in sizes) + " pixels"
    if any(size.width_deg is None for size in sizes):
        return f"{pixels}."
    return " to ".join(f"{fixed(s.width_deg, 2)}° × {fixed(s.height_deg, 2)}°" for s in sizes) + f" ({pixels})."


def _resampling(seen: Seen) -> str:
    if not seen.resampled:
        return NOT_RECORDED
    steps = [step.replace("_", " ") for step in seen.resampled if step != _NONE]
    if not steps:
        return "None: pictures were shown pixel for pixel"
    return f"{_upper(listed(steps))}{', of some pictures none' if _NONE in seen.resampled else ''}"


def _luminance(both: Both) -> str:
    each = dict.fromkeys(f"{luminance:.3g}" for luminance in both)
    return f"{' and '.join(each)} cd/m²{' (left and right eye)' if len(each) > 1 else ''}"


def _changed(seen: Seen) -> str:
    return f"The {listed(seen.changed)} changed when a session was resumed: what is said here holds until then."


def _upper(words: str) -> str:
    return words[:1].upper() + words[1:]


def _lower(words: str) -> str:
    return words[:1].lower() + words[1:]
