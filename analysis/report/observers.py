"""The observers: the observer table, who is left out, vision tests, notes and answers to questionnaires."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.kinds.questionnaire import QuestionRecord
from analysis.observers.filters import KeptSessions
from analysis.observers.table import ObserverLine, ObserverTable
from analysis.records.session_record import SessionLog
from analysis.report.words import counted
from documents.pages import Block, Cell, Column, Paragraph, Section, Table

_COLUMNS = (
    Column("Observer", "observer"),
    Column("Flags", "flags", "list"),
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


def observers_section(table: ObserverTable, kept: KeptSessions | None) -> Section:
    """Return the table of observers."""
    used = [index for index in range(len(_COLUMNS)) if index < 3 or any(_row(line)[index] for line in table.lines)]
    rows = tuple(tuple(_row(line)[index] for index in used) for line in table.lines)
    columns = tuple(_COLUMNS[index] for index in used)
    blocks: list[Block] = [Paragraph(left_out_words(kept))]
    blocks.append(Table("observers", "By observer", columns, rows, folded=len(rows) > 60))
    words = (
        "ζ is 1 without circular triads; its p (mid-p) is of the test against random answers. Fit: deviation of an "
        "observer's answers from the scores of all others, in standard deviations: below zero they fit worse than "
        f"expected; its p is adjusted by Holm's method (family-wise error rate {table.level:g}). Influence: the "
        "largest change of a log score when the observer is left out, in nats. First: the share of answers for the "
        "first position. Time: median response time. Fast: answers faster than a reaction time. Missed: obvious catch "
        "trials. A flag is a reason to look at the session, not to leave the observer out."
    )
    blocks.append(Paragraph(words, small=True))
    return Section("observers", "Observers", tuple(blocks))


def left_out_words(kept: KeptSessions | None) -> str:
    """Return who was left out, by which rule and why, in words."""
    if kept is None:
        return "No observer was left out."
    simulated = counted(len(kept.simulated), "simulated observer") if kept.simulated else ""
    if kept.rule.sentence == "No observer left out.":
        return f"{simulated} left out, and nobody else." if simulated else "No observer was left out."
    words = f"Rule: {kept.rule.sentence} {kept.sentence}"
    return f"{words} Also left out: {simulated}." if simulated else words


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


def people_section(sessions: Sequence[SessionLog]) -> Section | None:
    """Return notes, and answers to questionnaires; None if there are none."""
    tables = [table for table in (_notes(sessions), _answers(sessions)) if table.rows]
    return Section("notes", "Notes and answers to questions", tuple(tables)) if tables else None


def _notes(sessions: Sequence[SessionLog]) -> Table:
    columns = (
        Column("Observer", "observer"),
        Column("By", "by"),
        Column("Block", "block", "number"),
        Column("Trial", "trial", "number"),
        Column("When (UTC)", "utc"),
        Column("Note", "text"),
    )
    rows = tuple(
        (session.header.observer, note.by, note.block + 1, note.trial + 1, note.utc, note.text)
        for session in sessions
        for note in session.notes
    )
    return Table("notes", "Notes", columns, rows)


def _answers(sessions: Sequence[SessionLog]) -> Table:
    columns = (
        Column("Observer", "observer"),
        Column("Question", "question"),
        Column("Answer", "answer"),
        Column("Unit", "unit"),
    )
    rows = tuple(
        (session.header.observer, _words(asked.question), _words(asked.answer), _words(asked.unit))
        for session in sessions
        for asked in session.of(QuestionRecord)
    )
    return Table("questionnaire", "Answers to questions", columns, rows, folded=len(rows) > 12)


def _words(value: object) -> Cell:
    return None if value is None or value == "" else str(value)
