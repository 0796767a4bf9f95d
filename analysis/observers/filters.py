"""Leave observers out by a stated rule, and report who was left out and why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from analysis.choices import Filter as Filter
from analysis.errors import ResultsError
from analysis.observers.responses import catch_answers
from analysis.observers.screening import failed_tests, passed_screening
from analysis.records.answered_by import pool
from analysis.records.results import sessions_by_observer
from analysis.records.session_record import SessionLog
from documents import Finding
from documents.text import JsonResult


@dataclass(frozen=True, slots=True)
class KeptSessions(JsonResult):
    """The ``sessions`` that remain, in order, the ``rule``, and for each observer ``left_out`` the reasons.

    ``simulated`` are the codes of simulated observers who do not count beside people, ``notes`` say so in a sentence.
    ``answers`` are how many answers of each of both do not count.
    """

    sessions: tuple[SessionLog, ...]
    rule: Filter
    left_out: Mapping[str, tuple[str, ...]]
    simulated: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    answers: Mapping[str, int] = field(default_factory=dict)
    json_keys: ClassVar = {"rule.sentence": "rule", "observers": "kept"}
    json_names: ClassVar = "rule.sentence observers left_out simulated answers"

    @property
    def sentence(self) -> str:
        """Who was left out and why, in words."""
        if not self.left_out:
            return "Nobody was left out."
        reasons = "; ".join(f"{name} ({', '.join(why)})" for name, why in self.left_out.items())
        return f"Left out: {reasons}."

    @property
    def observers(self) -> tuple[str, ...]:
        """The observers who remain."""
        return tuple(sessions_by_observer(self.sessions))


def keep(sessions: Sequence[SessionLog], rule: Filter) -> KeptSessions:
    """Return the sessions of the observers that ``rule`` keeps; an observer is kept or left out with all sessions.

    Simulated observers do not count beside people unless the rule says so (`analysis.records.answered_by.pool`).

    Parameters
    ----------
    sessions
        Sessions of one experiment.
    rule
        Whom to leave out.

    Returns
    -------
    KeptSessions
        The sessions that are kept, and a sentence on those left out.

    Raises
    ------
    ResultsError
        If the rule names an unknown observer, has a negative limit, or leaves no observer.

    Examples
    --------
    >>> from pathlib import Path
    >>> from dataclasses import replace
    >>> from analysis.records import new_header
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1)
    >>> first = SessionLog(Path("1.jsonl"), header, (), complete=True)
    >>> second = replace(first, header=header.model_copy(update={"observer": "02"}))
    >>> keep([first, second], Filter(without=("02",))).sentence
    'Left out: 02 (by hand).'
    """
    pooled = pool(sessions, with_simulated=rule.with_simulated)
    by_observer = sessions_by_observer(pooled.sessions)
    for name in rule.without:
        if name not in by_observer and name not in pooled.left_out.simulated:
            there = ", ".join(by_observer) or "none"
            raise ResultsError(Finding(f"there is no observer '{name}' to leave out", remedy=f"observers: {there}"))
    if rule.most_missed is not None and rule.most_missed < 0:
        what = f"no observer can miss {rule.most_missed} catch trials"
        raise ResultsError(Finding(what, remedy="allow 0 or more"))
    left_out = {name: why for name, own in by_observer.items() if (why := _reasons(name, own, rule))}
    if sessions and len(left_out) == len(by_observer):
        everyone = "; ".join(f"{name}: {', '.join(reasons)}" for name, reasons in left_out.items())
        raise ResultsError(Finding(f"the filter leaves no observer ({everyone})", remedy="relax the filter"))
    kept = tuple(session for session in pooled.sessions if session.header.observer not in left_out)
    simulated = [one for one in sessions if one.header.simulated and pooled.left_out.simulated]
    answers: dict[str, int] = {}
    for session in [*(one for one in pooled.sessions if one.header.observer in left_out), *simulated]:
        code = session.header.observer
        name = code if code in left_out else f"{code} (simulated)"
        answers[name] = answers.get(name, 0) + sum(trial.is_task for trial in session.trials)
    return KeptSessions(kept, rule, left_out, pooled.left_out.simulated, pooled.notes, answers)


def _reasons(name: str, sessions: Sequence[SessionLog], rule: Filter) -> tuple[str, ...]:
    reasons = []
    if name in rule.without:
        reasons.append("by hand")
    caught = catch_answers(sessions)
    if rule.most_missed is not None and caught.missed > rule.most_missed:
        reasons.append(f"missed {caught.missed} of {caught.obvious} obvious catch trials")
    if rule.screening is not None:
        verdict = passed_screening(sessions, rule.screening)
        if verdict is False:
            failed = [outcome.test for outcome in failed_tests(sessions).get(name, ())]
            named = [test.replace("_", " ") for test in failed if test in (rule.screening or failed)]
            reasons.append(
                f"failed the vision screening: {' and '.join(named)}" if named else "failed the vision screening"
            )
        elif verdict is None and rule.unscreened == "leave_out":
            reasons.append("was not screened")
    return tuple(reasons)
