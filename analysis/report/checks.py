"""The checks of an experiment's results that failed: what, why, and what to do."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from analysis.observers.filters import failed_tests
from analysis.observers.table import ObserverTable
from analysis.records.session_record import SessionLog
from analysis.report.grouped import GroupedSummary
from analysis.report.summary import ReportSummary, Summary
from analysis.report.words import fixed, p_words, percent, some
from documents.text import JsonResult, counted

LEVEL = 0.05


@dataclass(frozen=True, slots=True)
class FailedCheck(JsonResult):
    """A check that failed: its name, the reason, and what to do, in words."""

    check: str
    reason: str
    remedy: str


def failed_checks(
    sessions: Sequence[SessionLog],
    compared: Summary | GroupedSummary | None,
    observers: ObserverTable | None,
    further: Iterable[FailedCheck],
) -> tuple[FailedCheck, ...]:
    """Return the checks that failed: those of the scores, of the observers, ``further`` ones, and of the sessions."""
    return (
        *(_one_scale(compared) if compared else ()),
        *(_side(compared) if compared else ()),
        *_vision(sessions),
        *(_flags(observers) if observers else ()),
        *further,
        *_timing(sessions),
    )


def _one_scale(compared: Summary | GroupedSummary) -> Iterator[FailedCheck]:
    parts = compared.groups if isinstance(compared, GroupedSummary) else (("", compared),)
    for name, part in parts:
        fits = part.one_scale
        # Bonferroni's correction for the number of groups.
        if fits is not None and fits.p < LEVEL / len(parts):
            where = f" of {name}" if name else ""
            yield FailedCheck(
                f"One scale fits all answers{where}",
                f"The answers depart from a single scale ({p_words(fits.p)}): some pairs were answered otherwise than "
                "the scores say.",
                "Look at the badly fitted pairs and at the stimuli's factors on the page, and do not rely on small "
                "differences of scores.",
            )


def _side(compared: ReportSummary) -> Iterator[FailedCheck]:
    share, interval = compared.first_share, compared.first_share_interval
    if share is not None and interval is not None and not interval[0] <= 0.5 <= interval[1]:
        yield FailedCheck(
            "No position is preferred",
            f"{percent(share, 1)} of the answers chose the first position (95 %: {fixed(100 * interval[0], 1)} to "
            f"{fixed(100 * interval[1], 1)}).",
            "Scores stay fair if every pair was shown both ways round (sides: counterbalanced); the order effect is "
            "under Diagnostics.",
        )


def _vision(sessions: Sequence[SessionLog]) -> Iterator[FailedCheck]:
    ended = {session.header.observer for session in sessions if session.screened_out}
    failed: dict[str, list[str]] = {}
    for observer, wrong in failed_tests(sessions).items():
        for outcome in wrong:
            more = "; the session ended there" if observer in ended else ""
            failed.setdefault(outcome.test, []).append(f"{observer} ({outcome.reached}{more})")
    for test, who in failed.items():
        yield FailedCheck(
            f"Vision test {test.replace('_', ' ')}",
            f"Not passed by {some(who)}. Their answers are included.",
            f"Test them again, or leave them out (--passed {test}).",
        )


def _flags(table: ObserverTable) -> Iterator[FailedCheck]:
    flagged: dict[str, list[str]] = {}
    for line in table.lines:
        for flag in line.flags:
            # Vision tests are above, and sessions that were not completed among the notes.
            if flag not in ("failed the vision screening", "not completed"):
                flagged.setdefault(flag, []).append(line.name or "–")
    for flag, who in flagged.items():
        yield FailedCheck(
            f"Observer{'' if len(who) == 1 else 's'} {some(who)}",
            f"{flag[0].upper()}{flag[1:]}.",
            "Look at the session. To leave an observer out, give --without CODE.",
        )


def _timing(sessions: Sequence[SessionLog]) -> Iterator[FailedCheck]:
    scenes = [scene for session in sessions for trial in session.trials for scene in trial.timed]
    missed = [scene.missed_frames for scene in scenes if scene.missed_frames]
    if missed:
        yield FailedCheck(
            "Timed scenes",
            f"{len(missed)} of {len(scenes):,} timed scenes missed {counted(sum(missed), 'frame', 'frames')}: they "
            "were shown later or longer than asked for.",
            "Close other programs, and look at the timing with cyclopean doctor --timing.",
        )
