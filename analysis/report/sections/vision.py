"""What the vision tests said of each observer."""

from __future__ import annotations

from collections.abc import Sequence

from analysis.observers.screening import outcomes
from analysis.records.session_record import SessionLog
from analysis.report.blocks import Column, Paragraph, Section, Table
from analysis.report.words import counted


def vision_section(sessions: Sequence[SessionLog]) -> Section | None:
    """Return the outcome of every test of vision; None if none was taken."""
    found = [outcome for session in sessions for outcome in outcomes(session)]
    if not found:
        return None
    columns = (
        Column("Observer", "observer"),
        Column("Test", "test"),
        Column("Outcome", "outcome"),
        Column("Finest passed", "threshold", "number", 2),
        Column("Estimate", "estimate", "number", 2),
        Column("Pass mark", "pass_mark", "number", 2),
        Column("Unit", "unit"),
    )
    rows = tuple(
        (
            one.observer,
            one.test.replace("_", " "),
            "passed" if one.passed else "failed",
            one.threshold,
            one.estimate,
            one.pass_mark,
            one.unit,
        )
        for one in found
    )
    failed = len(dict.fromkeys(one.observer for one in found if not one.passed))
    words = f"{counted(failed, 'observer')} failed a test." if failed else "Every test that was taken was passed."
    table = Table("vision", f"{counted(len(found), 'test')} of vision", columns, rows, folded=len(rows) > 20)
    return Section("vision", "Vision tests", (Paragraph(words), table))
