"""The kinds of trial: which record each block writes.

A new kind of block adds its record, a `TrialRecord` in a module of this room, and a line here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from analysis.records.fields import RecordError, read_fields
from analysis.records.other_trials import PageRecord, QuestionRecord, screening_record
from analysis.records.pair_trials import ActivePairsRecord, AllPairsRecord, PreferenceRecord
from analysis.records.picture_trials import BestOfSeriesRecord, RatingRecord
from analysis.records.threshold_trials import ThresholdRecord
from analysis.records.trial_record import TrialRecord

PRACTICE = "practice"
NEWER = "if a newer version of cyclopean recorded it, read it with that; otherwise restore the file from a copy"
# Each kind's record, or what finds it by the line where a kind has several.
KINDS: Mapping[str, type[TrialRecord] | Callable[[dict[str, Any]], type[TrialRecord]]] = MappingProxyType(
    {
        "instructions": PageRecord,
        "break": PageRecord,
        "all_pairs": AllPairsRecord,
        "active_pairs": ActivePairsRecord,
        "best_of_series": BestOfSeriesRecord,
        "rating": RatingRecord,
        "preference": PreferenceRecord,
        "threshold": ThresholdRecord,
        "questionnaire": QuestionRecord,
        "screening": screening_record,
    }
)


def read_trial(line: dict[str, Any]) -> TrialRecord:
    """Return a line as the record of its kind; of the kind that is practised if it is practice.

    Raises
    ------
    RecordError
        If a field is missing or wrong, or there is no such kind.
    """
    kind = line.get("kind")
    if kind == PRACTICE:
        kind = line.get("practice_of")
    record = KINDS.get(kind) if isinstance(kind, str) else None
    if record is None:
        if not isinstance(kind, str):
            raise RecordError(f"it has no '{'practice_of' if line.get('kind') == PRACTICE else 'kind'}'")
        known = ", ".join([*KINDS, PRACTICE])
        raise RecordError(f"there is no kind of trial '{kind}' in this version, which has {known}", NEWER)
    model = record if isinstance(record, type) else record(line)
    return read_fields(model, line)
