"""What a report says of tests of vision, and the sessions of those who passed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from analysis.choices import Unscreened
from analysis.kinds import OutcomeRecord
from analysis.observers import failed_tests, passed_screening
from analysis.records import SessionLog
from analysis.report import Part, listed
from documents.pages import Column, Paragraph, Section, Table
from documents.text import counted
from extensions.vision_tests.record import VisionOutcomeRecord


def screened(
    logs: Iterable[SessionLog], tests: Sequence[str] = (), unscreened: Unscreened = "leave_out"
) -> tuple[SessionLog, ...]:
    """Return the sessions whose observers passed; sessions without the tests are left out or kept.

    Parameters
    ----------
    logs
        Sessions of any observers; each is judged by its own tests.
    tests
        Names of the vision tests to pass; none stands for every test that was taken.
    unscreened
        ``keep`` or ``leave_out``: what becomes of a session without these tests.

    Returns
    -------
    tuple[SessionLog, ...]
        The sessions that remain, in their order.
    """
    verdicts = [(log, passed_screening([log], tests)) for log in logs]
    return tuple(log for log, verdict in verdicts if verdict or (verdict is None and unscreened == "keep"))


def vision_part(sessions: Sequence[SessionLog]) -> Part | None:
    """Return what a report says of tests of vision; None if none was completed."""
    taken = [(session.header.observer, each) for session in sessions for each in session.of(VisionOutcomeRecord)]
    if not taken:
        return None
    words = _words(taken, failed_tests(sessions))
    return Part(observers=lambda: (_section(taken, words),), vision=words)


def _section(taken: Sequence[tuple[str, VisionOutcomeRecord]], words: str) -> Section:
    """Return the outcome of every vision test."""
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
            observer,
            tested.test.replace("_", " "),
            "passed" if tested.passed else "failed",
            tested.outcome.threshold,
            tested.outcome.estimate,
            tested.outcome.pass_mark,
            tested.outcome.unit,
        )
        for observer, tested in taken
    )
    table = Table("vision", counted(len(taken), "vision test", "vision tests"), columns, rows, folded=len(rows) > 20)
    return Section("vision", "Vision tests", (Paragraph(words), table))


def _words(taken: Sequence[tuple[str, VisionOutcomeRecord]], failed: Mapping[str, Sequence[OutcomeRecord]]) -> str:
    """Say whose vision was tested and who failed, of those whose answers are included."""
    tested = len({observer for observer, _ in taken})
    tests = listed(dict.fromkeys(each.test.replace("_", " ") for _, each in taken))
    words = f"The vision of {counted(tested, 'observer', 'observers')} was tested before the trials ({tests})"
    if not failed:
        return f"{words}; all passed."
    names = listed(
        f"{name} ({', '.join(outcome.test.replace('_', ' ') for outcome in wrong)})" for name, wrong in failed.items()
    )
    return f"{words}; {len(failed)} failed, and their answers are included: {names}."
