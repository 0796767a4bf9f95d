"""What the vision tests of sessions said of each observer, and sessions chosen by it.

A `screening` block records one line for each presentation and, after each test, one with its ``outcome``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
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


def screened(
    logs: Iterable[SessionLog], tests: Sequence[str] = (), unscreened: Unscreened = "leave_out"
) -> tuple[SessionLog, ...]:
    """Return the sessions whose observers passed (see `passed`); those that tell nothing are left out or kept."""
    return tuple(
        log for log, verdict in _verdicts(logs, tests) if verdict or (verdict is None and unscreened == "keep")
    )


def _verdicts(logs: Iterable[SessionLog], tests: Sequence[str]) -> Iterator[tuple[SessionLog, bool | None]]:
    for log in logs:
        yield log, passed(log, tests)


def _number(value: object) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{value!r} is no number")
    return float(value)
