"""Every field that any kind of block can record is in the report, or is listed there as not reported.

Each field of each kind is changed in all its records: a report that stays the same does not show it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import pytest

from analysis.errors import ResultsError
from analysis.kinds import KINDS, RecordError, Trial
from analysis.kinds.kinds import read_trial
from analysis.records import SessionLog, WindowEvent
from analysis.report import describe
from analysis.report.not_reported import COMMON, unreported
from analysis.report.page import render
from tests.answers import altered, changed
from tests.runner import every_kind as EVERY
from tests.runner.test_report_every_kind import log_of

pytestmark = pytest.mark.usefixtures("undrawn")
UNKNOWN = "not known to this version"
PLACE = {"record", "block", "trial", "kind"}
# Declared with the record that these kinds share with others, and written by no block of theirs.
NEVER = {
    "active_pairs": {"ratings"},
    "preference": {"ratings", "group", "group_factor", "interval_s"},
    "screening": {"screened_out"},
}


@cache
def recorded(kind: str, variant: int) -> tuple[SessionLog, ...]:
    logs = [log_of(EVERY.of_kind(kind, variant), code) for code in ("01", "02")]
    return tuple(replace(log, header=altered(log.header, simulated=False)) for log in logs)


def told(sessions: Sequence[SessionLog], *, page: bool) -> str:
    """Return what the report says, as JSON or also as a page; a refusal says that it was read."""
    try:
        report = describe(sessions)
    except ResultsError as error:
        return str(error)
    return json.dumps(report.to_json(), sort_keys=True) + (render(report) if page else "")


def other(value: Any, all_values: Sequence[Any]) -> Any:
    """Return another value of the kind of ``value``, of ``all_values`` where these have one."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float):
        return value + 1
    if isinstance(value, Mapping):
        return {name: other(inner, ()) for name, inner in value.items()}
    if isinstance(value, list | tuple):
        return [other(inner, ()) for inner in value]
    others = [one for one in all_values if one != value and one is not None]
    return others[0] if others else 1.25 if value is None else f"{value}x"


def held(trial: Trial) -> dict[str, Any]:
    return {
        **trial.details(),
        **{name: getattr(trial, name) for name in ("events", "response_time_s", "utc", "attempt")},
    }


def with_others(sessions: Sequence[SessionLog], kind: str, paths: Sequence[str]) -> list[SessionLog]:
    """Return the sessions with other values of fields of a kind."""
    changed = list(sessions)
    for path in paths:
        values = [value for log in changed for trial in log.trials if (value := _at(held(trial), path)) is not None]
        changed = [
            replace(log, records=tuple(_changed(one, path, values) if one.kind == kind else one for one in log.answers))
            for log in changed
        ]
    return changed


def _at(fields: Any, path: str) -> Any:
    name, _, within = path.partition(".")
    found = fields.get(name) if isinstance(fields, Mapping) else None
    return _at(found, within) if within else found


def _changed(trial: Trial, path: str, values: Sequence[Any]) -> Trial:
    name, _, within = path.partition(".")
    if name not in held(trial):
        return trial
    given: dict[str, Any] = {
        "events": [("f12", seconds + 1) for _, seconds in trial.events],
        "utc": f"{trial.utc[:19]}.999+00:00" if trial.is_practice else "2027-01-01T00:00:00.000+00:00",
    }
    field = "members" if name == "stimuli" else name
    if name in given:
        new = given[name]
    elif name in ("timed", "timing_marks"):
        new = [part.model_copy(update=other(part.model_dump(), ())) for part in getattr(trial, name)]
    elif within:
        part = getattr(trial, field)
        new = part.model_copy(update={within: other(getattr(part, within), values)})
    else:
        new = other(held(trial)[name], values)
    return trial.model_copy(update={field: new})


def _read_again(log: SessionLog) -> SessionLog:
    again = (read_trial(json.loads(json.dumps(one.to_json()))) for one in log.answers)
    return replace(log, records=(*again, *log.notes, *log.marks, *log.resumptions))


def fields_of(sessions: Sequence[SessionLog], kind: str) -> set[str]:
    """Return the fields that records of a kind have; of an outcome, those within it."""
    paths = {name for log in sessions for trial in log.trials if trial.kind == kind for name in held(trial)}
    within = {
        f"outcome.{name}" for log in sessions for one in log.trials for name in one.details().get("outcome") or ()
    }
    return (paths - {"outcome"}) | within


def listed(sessions: Sequence[SessionLog], kind: str) -> set[str]:
    """Return the fields of a kind that the report says it does not show."""
    said = {one.field for one in unreported(sessions) if one.kind in ("", kind)}
    if "" in said:
        return fields_of(sessions, kind) - {"attempt", "timed"}
    if "presentation" in said:
        shown = ("test", "response_time_s", "attempt")
        said |= {
            name
            for log in sessions
            for one in log.trials
            if "presentation" in one.details()
            for name in one.details()
            if name not in shown
        }
        said |= {"response_time_s"}
    return said - {"utc"}  # of an answer; the last one's ends the session, whose length Methods states


# One of each class of records here, the others nightly.
HERE = ("questionnaire", "rating", "preference")
EACH = [kind if kind in HERE else pytest.param(kind, marks=pytest.mark.nightly) for kind in EVERY.BLOCKS]


def variants(kind: str) -> range:
    return range(len(EVERY.BLOCKS[kind]))


@pytest.mark.parametrize("kind", EACH)
def test_what_is_listed_as_not_reported_changes_nothing(kind: str) -> None:
    for variant in variants(kind)[: 3 if kind != "practice" else 1]:
        sessions = recorded(kind, variant)
        assert not [one for one in unreported(sessions) if one.what == UNKNOWN]
        changed = with_others(sessions, kind, sorted(listed(sessions, kind) & fields_of(sessions, kind)))
        assert changed != list(sessions)
        assert told(changed, page=True) == told(sessions, page=True)


@pytest.mark.parametrize("kind", EACH)
def test_every_other_field_is_in_the_report(kind: str) -> None:
    """Changed, it changes what JSON or the page says, in one of the ways in which the kind is written.

    A change that the record refuses, or by which it contradicts itself, is one that no log can hold.
    """
    missing: set[str] = set()
    shown: set[str] = set()
    for variant in variants(kind):
        sessions = recorded(kind, variant)
        fields = fields_of(sessions, kind) - listed(sessions, kind) - shown
        base = {page: told(sessions, page=page) for page in (False, True)} if fields else {}
        assert [_read_again(log).answers for log in sessions] == [log.answers for log in sessions]
        for field in sorted(fields):
            try:
                changed = [_read_again(log) for log in with_others(sessions, kind, [field])]
                if any(told(changed, page=page) != base[page] for page in (False, True)):
                    shown.add(field)
            except (RecordError, KeyError):
                shown.add(field)
        missing |= fields
    # what is chosen is shown by its place; another name there is a contradiction, and refused as the log is read
    assert missing <= shown | ({"chosen"} if kind == "best_of_series" else set())


@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS)
def test_every_field_of_its_record_is_written_by_some_block(kind: str) -> None:
    """So that no field escapes the tests above."""
    logs = [log for variant in variants(kind) for log in recorded(kind, variant)]
    models = {KINDS[kind].of_line(dict.fromkeys(keys, 1)) for keys in ((), ("outcome",), ("screened_out",))}
    declared = {field.alias or name for one in models for name, field in one.model_fields.items()}
    declared -= set(Trial.model_fields)
    written = {name for log in logs for trial in log.trials if trial.kind == kind for name in trial.details()}
    assert declared - written == NEVER.get(kind, set()) & declared


SCENE = {"what": "fixation", "frames": 30, "asked_ms": 500.0, "shown_ms": 500.0, "missed_frames": 3}
MARK = {"port": "lsl", "mark": "onset", "code": 1, "failed": "gone"}
SHOWN: Mapping[str, Any] = {
    "timed": [SCENE],
    "ignored": [["up", 0.01, "too_soon"]] * 20,
    "timing_marks": [MARK],
    "nominal": "srgb",
    "wrong_screen": True,
    "window_lost": True,
    "attempt": 1,
}
LEFT_OUT: Mapping[str, Any] = {"clipping": {"a": {}}, "ignored_more": 5, "interruptions": 2, "uncharacterised": True}


@pytest.mark.parametrize(("field", "value"), [*SHOWN.items(), *LEFT_OUT.items()])
def test_what_the_engine_adds_is_in_the_report_or_listed(field: str, value: Any) -> None:
    away = (WindowEvent(what="lost_focus", block=1, trial=0, utc="2026-01-01T00:00:00Z"),)
    sessions = [replace(log, windows=away) for log in recorded("rating", 0)]
    more = [replace(log, records=tuple(_with(one, field, value) for one in log.answers)) for log in sessions]
    is_listed = field in {one.field for one in unreported(more)}
    assert is_listed == (field in LEFT_OUT)
    plain = [json.loads(told(each, page=False)) for each in (sessions, more)]
    for report in plain:
        report.pop("not_reported")
    pages = [render(describe(each)) for each in (sessions, more)]
    assert (plain[0] != plain[1] or pages[0] != pages[1]) or is_listed
    if is_listed:
        assert plain[0] == plain[1]


def _with(trial: Trial, field: str, value: Any) -> Trial:
    if field == "attempt":
        return changed(trial, attempt=value)
    return changed(trial, data={**trial.details(), field: value})


def test_the_engine_adds_no_other_field() -> None:
    added = set(Trial.model_fields)
    assert added == {*SHOWN, *LEFT_OUT, *PLACE, "practice_of", "events", "response_time_s", "utc"}
    assert set(COMMON) == {*LEFT_OUT, "events", "utc"}


def test_a_field_of_a_newer_version_is_listed() -> None:
    sessions = recorded("rating", 0)
    more = [replace(log, records=tuple(_with(one, "gaze", 1) for one in log.answers)) for log in sessions]
    (field,) = [
        one for one in describe(more).to_json()["not_reported"] if (one["kind"], one["field"]) == ("rating", "gaze")
    ]
    assert field["what"] == UNKNOWN
    assert field["records"] == sum(trial.kind == "rating" for log in more for trial in log.trials)
    assert "gaze" in render(describe(more))
    assert "gaze" not in render(describe(sessions))
