"""Every observer on a line, with nobody left out unless asked; and whom it was asked to leave out."""

from __future__ import annotations

from analysis.observers.filters import Kept
from analysis.observers.table import ObserverLine, ObserverTable
from analysis.report.blocks import Block, Cell, Column, Paragraph, Section, Table

_COLUMNS = (
    Column("Observer", "observer"),
    Column("To look at", "flags", "list"),
    Column("Answers", "answers", "number"),
    Column("Ties", "ties", "number"),
    Column("ζ", "consistency_zeta", "number", 2),
    Column("p (ζ)", "consistency_mid_p", "p"),
    Column("Fit (z)", "fit_z", "number", 1),
    Column("p (fit)", "fit_adjusted_p", "p"),
    Column("Influence", "influence_nats", "number", 2),
    Column("First", "first_share", "number", 2),
    Column("Time (s)", "median_response_time_s", "number", 2),
    Column("Fast", "too_fast", "number"),
    Column("Missed", "catch_missed"),
    Column("Vision", "screening"),
)


def observers_section(table: ObserverTable, kept: Kept | None) -> Section:
    """Return the table of observers."""
    used = [index for index in range(len(_COLUMNS)) if index < 3 or any(_row(line)[index] for line in table.lines)]
    rows = tuple(tuple(_row(line)[index] for index in used) for line in table.lines)
    columns = tuple(_COLUMNS[index] for index in used)
    blocks: list[Block] = [Paragraph(left_out_words(kept))]
    blocks.append(Table("observers", "By observer", columns, rows, folded=len(rows) > 60))
    words = (
        "ζ is 1 without circular triads; its p is the chance of so few by tossing coins (mid-p). Fit: an observer's "
        "answers held against the scores of all others, in standard deviations: below zero they fit worse than "
        f"expected; its p is Holm's over the observers, at level {table.level:g}. Influence: the largest change of a "
        "strength when the observer is left out, in nats. First: the share of answers for the first position. Time: "
        "the median. Fast: answers given too fast to have looked. Missed: obvious catch trials. What stands under “to "
        "look at” is a reason to look, not to leave out."
    )
    blocks.append(Paragraph(words, small=True))
    return Section("observers", "Observers", tuple(blocks))


def left_out_words(kept: Kept | None) -> str:
    """Say who was left out, by which rule and why."""
    if kept is None or kept.rule.sentence == "No observer left out.":
        return "Nobody was left out."
    return f"Asked for: {kept.rule.sentence} {kept.sentence}"


def _row(line: ObserverLine) -> tuple[Cell, ...]:
    test = line.consistency.test if line.consistency else None
    catch = line.catch
    vision = {True: "passed", False: "failed", None: None}[line.screening_passed]
    return (
        line.name or "–",
        line.flags,
        line.answers,
        line.ties or None,
        line.consistency.zeta if line.consistency else None,
        test.mid_p if test else None,
        line.fit.z if line.fit else None,
        line.fit.adjusted_p if line.fit else None,
        abs(line.fit.influence) if line.fit else None,
        line.side.share if line.side else None,
        line.times.median_s if line.times else None,
        (line.times.too_fast or None) if line.times else None,
        f"{catch.missed} of {catch.obvious}" if catch and catch.obvious else None,
        vision,
    )
