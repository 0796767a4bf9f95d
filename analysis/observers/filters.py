"""Leave observers out by a stated rule, and report who was left out and why."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

from analysis.choices import Filter as Filter
from analysis.errors import ResultsError
from analysis.kinds.trial import OutcomeRecord
from analysis.observers.responses import catch_answers
from analysis.records.answered_by import pool
from analysis.records.results import sessions_by_observer
from analysis.records.session_record import SessionLog
from analysis.records.times import in_time
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


def passed(log: SessionLog, tests: Sequence[str] = ()) -> bool | None:
    """Return whether the session's observer passed all of ``tests``, or of the tests taken if none are named.

    None if a named test was not taken, or no test was. If a test was taken twice, the last outcome counts.
    """
    last = {outcome.test: outcome.passed for outcome in log.of(OutcomeRecord)}
    wanted = tests or tuple(last)
    if not wanted or any(test not in last for test in wanted):
        # A failed test decides, even if others were not taken.
        return False if any(last.get(test) is False for test in wanted) else None
    return all(last[test] for test in wanted)


def check_tests(sessions: Iterable[SessionLog], tests: Sequence[str]) -> None:
    """Check that each of ``tests`` was taken in some session.

    Parameters
    ----------
    sessions
        Sessions in which to look for the tests.
    tests
        Names of vision tests; none asks for nothing.

    Raises
    ------
    ResultsError
        If nobody took one of them.

    Examples
    --------
    >>> check_tests([], [])
    >>> check_tests([], ["stereo_acuity"])
    Traceback (most recent call last):
    ...
    analysis.errors.ResultsError: nobody took the test of vision 'stereo_acuity' (no session has a test of vision)
    """
    known = list(dict.fromkeys(outcome.test for session in sessions for outcome in session.of(OutcomeRecord)))
    for test in tests:
        if test not in known:
            remedy = f"tests taken: {', '.join(known)}" if known else "no session has a test of vision"
            raise ResultsError(Finding(f"nobody took the test of vision '{test}'", remedy=remedy))


def passed_screening(sessions: Sequence[SessionLog], tests: Sequence[str] = ()) -> bool | None:
    """Return whether one observer passed ``tests``, by their last session that has them; None if none has."""
    verdicts = [verdict for session in in_time(sessions) if (verdict := passed(session, tests)) is not None]
    return verdicts[-1] if verdicts else None


def failed_tests(sessions: Sequence[SessionLog]) -> dict[str, tuple[OutcomeRecord, ...]]:
    """Return the tests that each observer failed, by observer, without those who failed none.

    Of each observer the last session with a test counts, and of a test taken twice in it the last outcome.

    Parameters
    ----------
    sessions
        Sessions of any observers.

    Returns
    -------
    dict[str, tuple[OutcomeRecord, ...]]
        The outcomes of the failed tests.

    Examples
    --------
    >>> failed_tests([])
    {}
    """
    failed = {}
    for observer, own in sessions_by_observer(sessions).items():
        tested = [taken for log in in_time(own) if (taken := log.of(OutcomeRecord))]
        last = {outcome.test: outcome for outcome in tested[-1]} if tested else {}
        if wrong := tuple(outcome for outcome in last.values() if not outcome.passed):
            failed[observer] = wrong
    return failed
