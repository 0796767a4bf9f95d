"""Records of trials for tests: of what a kind needs, a test says what it is about."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pytest

from analysis.errors import ResultsError
from analysis.kinds import KINDS, Trial, new_trial
from analysis.records import Header, SessionLog, new_header, read_session

PAIRS = ("all_pairs", "active_pairs", "preference")
_QUESTION = {"name": "q", "question": "?", "answer": "fine", "answered_by": "text"}
_SERIES = {"near": {"passed": True, "presentations": 8, "right": 8}}


def new_answer(
    block: int,
    trial: int,
    kind: str,
    events: Sequence[tuple[str, float]],
    response_time_s: float,
    utc: str = "2026-01-02T03:04:05Z",
    data: Mapping[str, Any] = MappingProxyType({}),
    attempt: int = 0,
) -> Trial:
    """Return an answer with ``data``, and what else a record of its kind must have."""
    needs = _pair(data, kind) if kind in PAIRS else {}
    if kind == "rating":
        needs = {"stimulus": "a", "rating_times_s": dict.fromkeys(data.get("ratings", {"depth": 1}), 1.0)}
        needs |= {} if "ratings" in data else {"ratings": {"depth": 1}}
    elif kind == "questionnaire":
        needs = _QUESTION
    elif kind == "screening" and "outcome" in data:
        needs = {"by_series": _SERIES}
        data = {**data, "outcome": {"controls_seen": True, **data["outcome"]}}
    return _read(block, trial, kind, events, response_time_s, utc, {**needs, **data}, attempt)


def changed(record: Trial, *, data: Mapping[str, Any] | None = None, **placed: Any) -> Trial:
    """Return ``record`` with other fields, of which ``data`` are those of its kind."""
    line = record.to_json()
    names = ("block", "trial", "kind", "events", "response_time_s", "utc", "attempt")
    kept = {name: line[name] for name in names} | placed
    needs = {"batch": 0} if kept["kind"] == "active_pairs" else {}
    return _read(data={**needs, **(record.details() if data is None else data)}, **kept)


def altered(header: Header, **fields: Any) -> Header:
    """Return ``header`` with other fields, as JSON has them."""
    return new_header(**{**header.to_json(), **fields})


def refusal(session: SessionLog, folder: Path, **damage: Any) -> ResultsError:
    """Return how the log of ``session`` is refused whose first answer has other fields."""
    line = {**session.answers[0].to_json(), "block": 0, "trial": 0, **damage}
    file = folder / "session.jsonl"
    file.write_text("".join(f"{json.dumps(one)}\n" for one in (session.header.to_json(), line)), encoding="utf-8")
    with pytest.raises(ResultsError) as caught:
        read_session(file)
    assert caught.value.findings[0].line == 2
    return caught.value


def _read(*line: Any, **fields: Any) -> Trial:
    trial = new_trial(*line, **fields)
    if (kind := fields.get("practice_of", trial.kind)) in KINDS:
        assert type(trial) is not Trial, f"no record of the kind {kind}: {line} {fields}"
    return trial


def _pair(data: Mapping[str, Any], kind: str) -> dict[str, Any]:
    first, second = data.get("first", data.get("chosen", "a")), data.get("second", data.get("rejected", "b"))
    decided = {"first": (first, second), "second": (second, first)}
    found = next((answer for answer, pair in decided.items() if pair[0] == data.get("chosen")), None)
    answer = data.get("answer", found or ("first" if kind == "preference" else "not_sure"))
    needs = {"first": first, "second": second, "answer": answer}
    if answer in decided and data.get("catch") != "identical":
        needs |= dict(zip(("chosen", "rejected"), decided[answer], strict=True))
    if kind == "active_pairs":
        needs["batch"] = 0
    return needs | ({"chosen_view": "stereo", "first_view": "stereo"} if kind == "preference" else {})
