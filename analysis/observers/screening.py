"""Vision tests: the threshold that answers give, the outcomes in the sessions, and who passed.

A `screening` block records one line for each presentation and, after each test, one with its ``outcome``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from analysis.errors import ResultsError
from analysis.records.session_record import SessionLog
from documents import Finding

KIND = "screening"
Unscreened = Literal["keep", "leave_out"]


@dataclass(frozen=True, slots=True)
class Outcome:
    """One test's outcome; ``threshold`` is the finest level passed in ``unit``, None if none was."""

    observer: str
    session: str
    test: str
    passed: bool
    threshold: float | None
    estimate: float | None
    pass_mark: float
    unit: str


def outcomes(log: SessionLog) -> tuple[Outcome, ...]:
    """Return the outcome of every test that the session completed, in order; of a test taken twice, both.

    Raises
    ------
    ResultsError
        If a record of an outcome is damaged.
    """
    found = []
    for trial in log.trials:
        if trial.kind != KIND or "outcome" not in trial.data or trial.data.get("practice"):
            continue
        try:
            told = trial.data["outcome"]
            found.append(
                Outcome(
                    log.header.observer,
                    log.header.session,
                    str(trial.data["test"]),
                    bool(told["passed"]),
                    _number(told["threshold"]),
                    _number(told["estimate"]),
                    float(told["pass_mark"]),
                    str(told["unit"]),
                )
            )
        except (KeyError, TypeError, ValueError) as error:
            what = f"trial {trial.trial} of block {trial.block} holds no outcome of a vision test: {error}"
            raise ResultsError(Finding(what, str(log.file), remedy="restore the file")) from error
    return tuple(found)


def passed(log: SessionLog, tests: Sequence[str] = ()) -> bool | None:
    """Return whether the session's observer passed all of ``tests``, or of the tests taken if none are named.

    None if a test that is named was not taken, or none was. Of a test taken twice, the last counts.
    """
    last = {outcome.test: outcome.passed for outcome in outcomes(log)}
    wanted = tests or tuple(last)
    if not wanted or any(test not in last for test in wanted):
        # A test that was failed decides, whatever was not taken after it.
        return False if any(last.get(test) is False for test in wanted) else None
    return all(last[test] for test in wanted)


def check_tests(sessions: Iterable[SessionLog], tests: Sequence[str]) -> None:
    """Do nothing if each of ``tests`` was taken in some session.

    Raises
    ------
    ResultsError
        If nobody took one of them.
    """
    known = list(dict.fromkeys(outcome.test for session in sessions for outcome in outcomes(session)))
    for test in tests:
        if test not in known:
            remedy = f"tests taken: {', '.join(known)}" if known else "no session has a test of vision"
            raise ResultsError(Finding(f"nobody took the test of vision '{test}'", remedy=remedy))


def screened(
    logs: Iterable[SessionLog], tests: Sequence[str] = (), unscreened: Unscreened = "leave_out"
) -> tuple[SessionLog, ...]:
    """Return the sessions whose observers passed (see `passed`); sessions without the tests are left out or kept."""
    verdicts = [(log, passed(log, tests)) for log in logs]
    return tuple(log for log, verdict in verdicts if verdict or (verdict is None and unscreened == "keep"))


def passed_screening(sessions: Sequence[SessionLog], tests: Sequence[str] = ()) -> bool | None:
    """Return whether one observer passed ``tests``, by their last session that has them; None if none has."""
    in_time = sorted(sessions, key=lambda session: session.header.started_utc)
    verdicts = [verdict for session in in_time if (verdict := passed(session, tests)) is not None]
    return verdicts[-1] if verdicts else None


def _number(value: object) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{value!r} is no number")
    return float(value)


SLOPE = 4.0  # log odds per factor of e in strength
LAPSES = 0.02
_STEP = 0.02
_BEYOND = math.log(2.0)


def threshold_estimate(strengths: Sequence[float], right: Sequence[bool], options: int) -> float | None:
    """Return the strength half-way between guessing among ``options`` and certainty, None if the answers leave it open.

    The probability of a right answer is guess + (1 - guess - lapses) · logistic(slope · ln(strength / threshold)), with
    a slope of 4 and 0.02 lapses: a few answers cannot tell these two. The estimate is sought from half the smallest of
    ``strengths``, all above 0, to twice the largest; a best value at either end is none.
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
