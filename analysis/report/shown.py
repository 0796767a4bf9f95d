"""What the display showed: the stimuli for each eye, clipping to the gamut, sessions and frame timing."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from dataclasses import astuple

from analysis.kinds.trial import TimedScene
from analysis.records.lines import Header, SwapIntervals
from analysis.records.seen import eye_costs, ghosts_recorded
from analysis.records.session_record import SessionLog
from analysis.records.times import SessionTimes, duration
from analysis.report.not_reported import unreported
from analysis.report.words import fixed, some
from documents.pages import Block, Cell, Column, Facts, Gallery, Heading, PagePicture, Paragraph, Section, Table
from documents.text import counted

Thumbnails = Mapping[str, Mapping[str, bytes]]
BESIDE_PX = 112, 80  # of a picture beside a name, which is shown at half that size
MOST_UNFOLDED = 24
_NO_SCREEN_MS = 2.0  # no screen that we know of refreshes as often
EYES = {"left": "left eye", "right": "right eye", "both": "both eyes"}


def beside(thumbnails: Thumbnails) -> dict[str, str]:
    """Return a smaller picture of each stimulus as a data URI, for the table of scores: the left eye's view."""
    from PIL import Image

    pictures = {}
    for name, views in thumbnails.items():
        png = views.get("left") or views.get("both") or next(iter(views.values()), None)
        if png is None:
            continue
        out = io.BytesIO()
        with Image.open(io.BytesIO(png)) as image:
            reduced = image.convert("RGB")
        reduced.thumbnail(BESIDE_PX)
        reduced.save(out, "JPEG", quality=85)
        pictures[name] = f"data:image/jpeg;base64,{base64.b64encode(out.getvalue()).decode()}"
    return pictures


def readable(thumbnails: Thumbnails) -> dict[str, Mapping[str, bytes]]:
    """Return the stimuli of which every picture can be decoded, so that no browser shows a broken one."""
    from PIL import Image

    def is_whole(png: bytes) -> bool:
        try:
            with Image.open(io.BytesIO(png), formats=["PNG"]) as image:
                image.load()
        except (OSError, SyntaxError, ValueError):  # what Pillow raises on damaged files
            return False
        return True

    return {name: views for name, views in thumbnails.items() if views and all(map(is_whole, views.values()))}


def gallery_section(names: Mapping[str, Sequence[str]], thumbnails: Thumbnails, words: str) -> Section | None:
    """Return the stimuli as small pictures (PNG) per eye, by group and in the order of ``names``; None without any.

    ``words`` say what the pictures are.
    """
    galleries = {
        group: tuple(
            PagePicture(name, tuple((EYES.get(eye, eye), _uri(png)) for eye, png in thumbnails[name].items()))
            for name in own
            if thumbnails.get(name)
        )
        for group, own in names.items()
    }
    galleries = {group: pictures for group, pictures in galleries.items() if pictures}
    many = sum(map(len, galleries.values())) > MOST_UNFOLDED
    blocks: list[Block] = []
    for group, pictures in galleries.items():
        if group and not many:
            blocks.append(Heading(group))
        folded = f"{group + ': ' if group else ''}{counted(len(pictures), 'stimulus', 'stimuli')}"
        blocks.append(Gallery(pictures, folded=folded if many else ""))
    if not blocks:
        return None
    missing = [name for own in names.values() for name in own if not thumbnails.get(name)]
    if missing:
        blocks.append(Paragraph(f"There is no picture of {some(missing)}."))
    return Section("stimuli", "The stimuli", (*blocks, Paragraph(words, small=True)))


def _uri(png: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"


def clipping_section(header: Header, names: Sequence[str]) -> Section | None:
    """Return the clipping of each stimulus and eye to the gamut, and the cost of filters; None if neither is known."""
    costs = eye_costs(header.stimuli, names)
    if not costs:
        return None
    columns = [
        Column("Stimulus", "stimulus"),
        Column("Eye", "eye"),
        Column("Out of gamut", "percent_out_of_gamut", "number", 2, "%"),
        Column("Above full drive", "percent_above_full", "number", 2, "%"),
        Column("Mean ΔE₀₀", "delta_e_00_mean", "number", 3),
        Column("Largest ΔE₀₀", "delta_e_00_max", "number", 1),
        Column("Filters’ mean ΔE₀₀", "filters_delta_e_00_mean", "number", 3),
        Column("Filters’ largest", "filters_delta_e_00_max", "number", 1),
    ]
    words = (
        "Share of each stimulus's pixels outside the display's gamut, which were clipped, and the colour difference "
        "between requested and shown colours, over all its pixels."
    )
    if any(cost.filters_mean is not None for cost in costs):
        words += (
            " Filters: what the anaglyph and its coloured filters cost besides, by what each eye sees, as if it had "
            "adapted to its filter."
        )
    else:
        columns = columns[:6]
    rows = tuple(astuple(cost)[: len(columns)] for cost in costs)
    table = Table("clipping", "Clipping to the gamut", tuple(columns), rows, folded=len(rows) > 40)
    blocks = (table, Paragraph(words, small=True), *_ghosts(header, names))
    return Section("clipping", f"Clipping to the display's gamut{', and filters' * (len(columns) > 6)}", blocks)


def _ghosts(header: Header, names: Sequence[str]) -> tuple[Table | Paragraph, ...]:
    """Return what crosstalk could not be cancelled of each stimulus and eye; nothing where none was measured."""
    known = [ghost for ghost in ghosts_recorded(header.stimuli) if ghost[0] in names]
    known.sort(key=lambda ghost: names.index(ghost[0]))
    rows = tuple(
        (name, eye, cost.percent_negative, cost.percent_above_full, cost.delta_e_00_mean, cost.delta_e_00_max)
        for name, eye, cost in known
    )
    if not rows:
        return ()
    columns = (
        Column("Stimulus", "stimulus"),
        Column("Eye", "eye"),
        Column("With a ghost", "percent_with_ghost", "number", 2, "%"),
        Column("Above full drive", "percent_above_full", "number", 2, "%"),
        Column("Mean ΔE₀₀", "delta_e_00_mean", "number", 3),
        Column("Largest ΔE₀₀", "delta_e_00_max", "number", 1),
    )
    words = (
        "Share of each stimulus's pixels at which crosstalk could not be cancelled, so that the eye saw a ghost of the "
        "other eye's picture, and the colour difference between requested and seen colours, gamut and lift included."
    )
    table = Table("ghosts", "Crosstalk that could not be cancelled", columns, rows, folded=len(rows) > 40)
    return table, Paragraph(words, small=True)


def timing_section(sessions: Sequence[SessionLog]) -> Section:
    """Return frame timing of each session, and how onsets were verified."""
    columns = (
        Column("Observer", "observer"),
        Column("Session", "session"),
        Column("Began (UTC)", "started_utc"),
        Column("Answers", "answers", "number"),
        Column("State", "state"),
        Column("Median swap (ms)", "swap_median_ms", "number", 2),
        Column("99 % (ms)", "swap_p99_ms", "number", 2),
        Column("Longest (ms)", "swap_longest_ms", "number", 2),
        Column("Refreshes missed", "swaps_missed", "number"),
        Column("Timed scenes", "timed_scenes", "number"),
        Column("Frames missed", "timed_frames_missed", "number"),
    )
    rows = [_session_row(session) for session in sessions]
    used = [index for index in range(len(columns)) if index < 5 or any(row[index] is not None for row in rows)]
    table = Table(
        "sessions",
        f"{len(rows)} session{'' if len(rows) == 1 else 's'}",
        tuple(columns[index] for index in used),
        tuple(tuple(row[index] for index in used) for row in rows),
        folded=True,
    )
    blocks: list[Block] = [Facts(tuple(timing_facts(sessions))), table]
    return Section("timing", "Sessions and timing", tuple(blocks))


def timing_facts(sessions: Sequence[SessionLog]) -> list[tuple[str, str]]:
    """Return the timing over all sessions, as terms and values."""
    timing = [session.header.presentation.timing for session in sessions]
    swaps = [record.swap_intervals for record in timing if record.swap_intervals]
    facts = []
    if swaps:
        medians = [record.median_ms for record in swaps]
        longest = max(record.longest_ms for record in swaps)
        words = f"Median {_span(medians, 2)} ms, longest {fixed(longest, 2)} ms; {_missed_words(swaps)}"
        facts.append(("Swap intervals", f"{words} (measured on black frames before each session)."))
    else:
        facts.append(("Swap intervals", "Not measured: no screen with vertical synchronisation."))
    scenes = [scene for session in sessions for scene in _timed(session)]
    if scenes:
        missed = [scene.missed_frames for scene in scenes if scene.missed_frames]
        words = (
            f"{len(missed)} of them missed {counted(sum(missed), 'frame', 'frames')}"
            if missed
            else "none missed a frame"
        )
        facts.append(("Timed scenes", f"{len(scenes):,}; {words}."))
    onsets = dict.fromkeys(record.verification or "not recorded" for record in timing)
    facts.append(("Onsets", "; ".join(onsets) + "."))
    compositors = dict.fromkeys(record.compositor for record in timing if record.compositor)
    if compositors:
        facts.append(("Compositor", "; ".join(compositors)))
    asked_again = sum(answer.attempt > 0 for session in sessions for answer in session.answers)
    if asked_again:
        facts.append(("Repeated trials", f"{counted(asked_again, 'trial', 'trials')}; the last answer counts."))
    resumed = [session for session in sessions if session.resumptions]
    if resumed:
        longest = max((stop.gap_s or 0.0 for session in resumed for stop in SessionTimes.of(session).stops), default=0)
        words = f"{counted(len(resumed), 'session was', 'sessions were')} interrupted and resumed"
        facts.append(("Resumed", f"{words}, after {duration(longest)} at most." if longest else f"{words}."))
    return facts


def _missed(swaps: SwapIntervals) -> int | None:
    """Return how many refreshes passed without a new frame; None where swaps did not wait for the screen.

    Logs written before that was known hold a number of times the median all the same.
    """
    return swaps.missed if swaps.median_ms >= _NO_SCREEN_MS else None


def _missed_words(swaps: Sequence[SwapIntervals]) -> str:
    counts = [(missed, record.frames) for record in swaps if (missed := _missed(record)) is not None]
    if not counts:
        return "swaps did not wait for the screen, so that late frames could not be counted"
    missed = sum(count for count, _ in counts)
    words = f"{missed} of {missed + sum(frames for _, frames in counts)} refreshes passed without a new frame"
    without = len(swaps) - len(counts)
    return words + (
        f"; in {counted(without, 'session', 'sessions')} swaps did not wait for the screen" if without else ""
    )


def _session_row(session: SessionLog) -> tuple[Cell, ...]:
    header = session.header
    swaps = header.presentation.timing.swap_intervals
    timed = _timed(session)
    state = ("completed" if session.complete else "not completed") + (", simulated" if header.simulated else "")
    numbers = [swaps.median_ms, swaps.p99_ms, swaps.longest_ms, _missed(swaps)] if swaps else [None] * 4
    missed = sum(scene.missed_frames for scene in timed) if timed else None
    answers = len(session.trials)
    return header.observer, header.session, header.started_utc, answers, state, *numbers, len(timed) or None, missed


def _timed(session: SessionLog) -> list[TimedScene]:
    return [scene for trial in session.trials for scene in trial.timed]


def _span(values: Sequence[float], digits: int) -> str:
    least, most = fixed(min(values), digits), fixed(max(values), digits)
    return least if least == most else f"{least} to {most}"


def unreported_section(sessions: Sequence[SessionLog]) -> Section | None:
    """Return what the logs hold and the report does not show; None without a trial."""
    columns = (
        Column("Trials", "kind"),
        Column("Field", "field"),
        Column("What it is", "what"),
        Column("Records", "records", "number"),
    )
    rows = tuple((one.kind or "all kinds", one.field or "all", one.what, one.records) for one in unreported(sessions))
    if not rows:
        return None
    table = Table("not_reported", "In the logs, not in this report", columns, rows, folded=True)
    return Section("not_reported", "What is not in this report", (table,))
