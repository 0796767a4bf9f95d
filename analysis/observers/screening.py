"""Vision tests: thresholds from answers, outcomes in sessions, and who passed.

A `screening` block records a line for each presentation and, after each test, a line with its ``outcome``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from analysis.choices import Unscreened
from analysis.errors import ResultsError
from analysis.kinds.screening import OutcomeRecord, ScreenedOutRecord
from analysis.records.results import sessions_by_observer
from analysis.records.session_record import SessionLog
from analysis.records.times import in_time
from documents import Finding


def outcomes(log: SessionLog) -> tuple[OutcomeRecord, ...]:
    """Return the outcome of every test completed in the session, in order; of a test taken twice, both.

    Parameters
    ----------
    log
        One session. Practice and tests that were not completed do not count.

    Returns
    -------
    tuple[OutcomeRecord, ...]
        A record for each completed test; empty if there was none.

    Examples
    --------
    >>> from pathlib import Path
    >>> from analysis.kinds import new_trial
    >>> from analysis.records import SessionLog, new_header
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1)
    >>> series = {"near": {"passed": True, "threshold": 40.0, "presentations": 8, "right": 8}}
    >>> result = {"passed": True, "threshold": 40, "estimate": 35.2, "pass_mark": 60, "unit": "arcsec"}
    >>> result["controls_seen"] = True
    >>> data = {"test": "stereo_acuity", "outcome": result, "by_series": series}
    >>> trial = new_trial(0, 0, "screening", (), 1.2, "2026-01-31T09:31:00Z", data)
    >>> log = SessionLog(Path("session.jsonl"), header, (trial,), complete=True)
    >>> [(each.test, each.passed, each.outcome.threshold) for each in outcomes(log)]
    [('stereo_acuity', True, 40.0)]
    """
    return log.of(OutcomeRecord)


def passed(log: SessionLog, tests: Sequence[str] = ()) -> bool | None:
    """Return whether the session's observer passed all of ``tests``, or of the tests taken if none are named.

    None if a named test was not taken, or no test was. If a test was taken twice, the last outcome counts.
    """
    last = {outcome.test: outcome.passed for outcome in outcomes(log)}
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
    known = list(dict.fromkeys(outcome.test for session in sessions for outcome in outcomes(session)))
    for test in tests:
        if test not in known:
            remedy = f"tests taken: {', '.join(known)}" if known else "no session has a test of vision"
            raise ResultsError(Finding(f"nobody took the test of vision '{test}'", remedy=remedy))


def screened(
    logs: Iterable[SessionLog], tests: Sequence[str] = (), unscreened: Unscreened = "leave_out"
) -> tuple[SessionLog, ...]:
    """Return the sessions whose observers passed (see `passed`); sessions without the tests are left out or kept.

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

    Examples
    --------
    >>> from pathlib import Path
    >>> from analysis.kinds import new_trial
    >>> from analysis.records import SessionLog, new_header
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1)
    >>> series = {"near": {"passed": True, "threshold": 40.0, "presentations": 8, "right": 8}}
    >>> result = {"passed": True, "threshold": 40, "estimate": 35.2, "pass_mark": 60, "unit": "arcsec"}
    >>> result["controls_seen"] = True
    >>> data = {"test": "stereo_acuity", "outcome": result, "by_series": series}
    >>> trial = new_trial(0, 0, "screening", (), 1.2, "2026-01-31T09:31:00Z", data)
    >>> log = SessionLog(Path("session.jsonl"), header, (trial,), complete=True)
    >>> len(screened([log])), len(screened([log], ["near_acuity"])), len(screened([log], ["near_acuity"], "keep"))
    (1, 0, 1)
    """
    verdicts = [(log, passed(log, tests)) for log in logs]
    return tuple(log for log, verdict in verdicts if verdict or (verdict is None and unscreened == "keep"))


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
    >>> from pathlib import Path
    >>> from analysis.kinds import new_trial
    >>> from analysis.records import SessionLog, new_header
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1)
    >>> series = {"near": {"passed": False, "threshold": 200.0, "presentations": 8, "right": 4}}
    >>> result = {"passed": False, "threshold": 200, "estimate": None, "pass_mark": 140, "unit": "arcsec"}
    >>> result["controls_seen"] = True
    >>> data = {"test": "stereo_acuity", "outcome": result, "by_series": series}
    >>> trial = new_trial(0, 0, "screening", (), 1.2, "2026-01-31T09:31:00Z", data)
    >>> log = SessionLog(Path("session.jsonl"), header, (trial,), complete=True)
    >>> [outcome.words for outcome in failed_tests([log])["01"]]
    ['stereo acuity: passed 200 arcsec, pass mark 140 arcsec']
    """
    failed = {}
    for observer, own in sessions_by_observer(sessions).items():
        tested = [taken for log in in_time(own) if (taken := outcomes(log))]
        last = {outcome.test: outcome for outcome in tested[-1]} if tested else {}
        if wrong := tuple(outcome for outcome in last.values() if not outcome.passed):
            failed[observer] = wrong
    return failed


def screened_out(log: SessionLog) -> bool:
    """Return whether the session ended at a vision test that was failed (``on_fail: stop``).

    Parameters
    ----------
    log
        One session.

    Returns
    -------
    bool
        Whether its record says so.

    Examples
    --------
    >>> from pathlib import Path
    >>> from analysis.kinds import new_trial
    >>> from analysis.records import SessionLog, new_header
    >>> header = new_header("views", "01", "s1", "2026-01-31T09:30:00Z", seed=1)
    >>> ended = new_trial(0, 0, "screening", (), 1.2, "2026-01-31T09:31:00Z", {"test": "t", "screened_out": True})
    >>> screened_out(SessionLog(Path("session.jsonl"), header, (ended,), complete=True))
    True
    """
    return bool(log.of(ScreenedOutRecord))


SLOPE = 4.0  # log odds per factor of e in strength
LAPSES = 0.02
_STEP = 0.02
_BEYOND = math.log(2.0)


def threshold_estimate(strengths: Sequence[float], right: Sequence[bool], options: int) -> float | None:
    """Return the threshold of a logistic psychometric function by maximum likelihood; None without a maximum.

    The probability of a right answer is guess + (1 - guess - lapses) · logistic(slope · ln(strength / threshold)), with
    a slope of 4 and 0.02 lapses: a few answers cannot estimate these two. The search goes from half the smallest of
    ``strengths``, all above 0, to twice the largest; a maximum at either end gives None.

    Parameters
    ----------
    strengths
        Shape (m,): strength of each presentation, above 0, in the unit of the test.
    right
        Shape (m,): whether each answer was right.
    options
        Number of answers to choose from, at least 2; the guessing rate is 1 / options.

    Returns
    -------
    float | None
        The threshold in the unit of ``strengths``; None without answers, or without a maximum within the search.

    Examples
    --------
    >>> threshold = threshold_estimate([1, 1, 2, 2, 4, 4], [False, False, True, False, True, True], 4)
    >>> threshold is not None and 1 < threshold < 4
    True
    """
    if not strengths:
        return None
    guess = 1.0 / options
    low = math.log(min(strengths)) - _BEYOND
    count = math.ceil((math.log(max(strengths)) + _BEYOND - low) / _STEP)
    places = [math.log(strength) for strength in strengths]

    def log_likelihood(threshold: float) -> float:
        total = 0.0
        for place, was_right in zip(places, right, strict=True):
            known = 1.0 / (1.0 + math.exp(-SLOPE * (place - threshold)))
            chance = guess + (1.0 - guess - LAPSES) * known
            total += math.log(chance if was_right else 1.0 - chance)
        return total

    likelihoods = [log_likelihood(low + _STEP * index) for index in range(count + 1)]
    best = max(range(count + 1), key=likelihoods.__getitem__)
    return None if best in (0, count) else math.exp(low + _STEP * best)
