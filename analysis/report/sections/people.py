"""What observers and experimenters wrote, and what observers answered to questions. All of it stays text."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.records.session_record import SessionLog, Trial
from analysis.report.blocks import Cell, Column, Section, Table

QUESTIONNAIRE = "questionnaire"


def people_section(sessions: Sequence[SessionLog]) -> Section | None:
    """Return notes, and answers to questionnaires; None if there are neither."""
    tables = [table for table in (_notes(sessions), _answers(sessions)) if table.rows]
    return Section("notes", "What people wrote", tuple(tables)) if tables else None


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
        (session.header.observer, _words(data.get("question", data.get("name"))), _words(data.get("answer")), unit)
        for session in sessions
        for data, unit in ((trial.data, _words(trial.data.get("unit"))) for trial in _questions(session))
    )
    return Table("questionnaire", "Answers to questions", columns, rows, folded=len(rows) > 12)


def _questions(session: SessionLog) -> list[Trial]:
    return [trial for trial in session.trials if trial.kind == QUESTIONNAIRE]


def _words(value: object) -> Cell:
    return None if value is None or value == "" else str(value)
