"""The kinds of trial: which record each block writes.

A kind of block has a record, a `Trial`: ours in a module of this room and named here, those of other packages in their
entry points (`docs/extend.md`).
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from types import MappingProxyType
from typing import Any

from analysis.kinds.fields import RecordError, of_whole_characters, read_fields
from analysis.kinds.trial import PRACTICE, Trial
from documents.extensions import ExtensionError, Registry

NEWER = "if a newer version of cyclopean recorded it, read it with that; otherwise restore the file from a copy"
KINDS: Registry[type[Trial]] = Registry(
    "cyclopean.records",
    {
        "instructions": "analysis.kinds.page:PageRecord",
        "break": "analysis.kinds.page:BreakRecord",
        "all_pairs": "analysis.kinds.all_pairs:AllPairsRecord",
        "best_of_series": "analysis.kinds.best_of_series:BestOfSeriesRecord",
        "rating": "analysis.kinds.rating:RatingRecord",
        "preference": "analysis.kinds.preference:PreferenceRecord",
        "questionnaire": "analysis.kinds.questionnaire:QuestionRecord",
    },
    lambda name, kind: None if isinstance(kind, type) and issubclass(kind, Trial) else "is no Trial",
)


def read_trial(line: dict[str, Any]) -> Trial:
    """Return a line as the record of its kind; of the kind that is practised if it is practice.

    Raises
    ------
    RecordError
        If a field is missing or wrong, or there is no such kind.
    """
    kind = line.get("kind")
    if kind == PRACTICE:
        kind = line.get("practice_of")
    try:
        record = KINDS.get(kind) if isinstance(kind, str) else None
    except ExtensionError as error:
        raise RecordError(error.findings[0].message, error.findings[0].remedy or "") from None
    if record is None:
        if not isinstance(kind, str):
            raise RecordError(f"it has no '{'practice_of' if line.get('kind') == PRACTICE else 'kind'}'")
        known = ", ".join([*KINDS, PRACTICE])
        raise RecordError(f"there is no kind of trial '{kind}' in this version, which has {known}", NEWER)
    return read_fields(record.of_line(line), line)


def new_trial(
    block: int,
    trial: int,
    kind: str,
    events: Sequence[tuple[str, float]],
    response_time_s: float,
    utc: str,
    data: Mapping[str, Any] = MappingProxyType({}),
    attempt: int = 0,
) -> Trial:
    """Return the record of an answer that was just given.

    What does not fit its kind is recorded all the same: an answer is never lost.

    Parameters
    ----------
    block, trial
        Where, both from 0.
    kind
        The kind of block.
    events
        Each press since the record before: its key, and the seconds since the scene's onset.
    response_time_s
        How long the answer took, in s.
    utc
        When it was given.
    data
        The fields of the kind, and how it was shown.
    attempt
        How often it had been answered before.

    Examples
    --------
    >>> data = {"first": "a", "second": "b", "answer": "first", "chosen": "a", "rejected": "b"}
    >>> new_trial(0, 0, "all_pairs", [("up", 1.2)], 1.2, "2026-01-31T09:31:00Z", data).chosen
    'a'
    """
    line: dict[str, Any] = {"record": "trial", "block": block, "trial": trial, "kind": kind, "events": events}
    line |= {"response_time_s": response_time_s, "utc": utc, "attempt": attempt, **data}
    text = json.dumps(line)  # as it will be read: lists for tuples, two halves of a character as one
    read = of_whole_characters(json.loads(text)) if "\\ud" in text else json.loads(text)
    with suppress(RecordError):
        return read_trial(read)
    with suppress(RecordError):
        return read_fields(Trial, read)
    return Trial.model_construct(**read)
