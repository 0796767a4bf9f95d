"""What records of trials hold and the report does not show: said on the page, so that nothing is left out in silence.

A field that is neither here nor in `analysis.kinds.kinds` is one that this version does not know, and is listed
as such. `tests/runner/test_every_field.py` changes each field of each kind: what is not here must change the report.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from analysis.kinds.trial import PRACTICE, Trial
from analysis.records.session_record import SessionLog
from documents.text import JsonResult

_TIME, _TIMES = "how long the answer took", "how long each rating took"
_REPEATED = "follows from the other fields"
# Of trials of every kind.
COMMON: Mapping[str, str] = MappingProxyType(
    {
        "events": "each press and its time",
        "utc": "when it was answered",
        "clipping": "what fitting into the display's gamut cost; the report has it of each stimulus",
        "ignored_more": "how many more presses than in ignored were without effect",
        "interruptions": "how often it was interrupted and shown again",
        "uncharacterised": "shown in a mode that was not measured; the header's remark says so",
    }
)
# Of the trials of a kind. A name with dots is a field within a field.
BY_KIND: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "instructions": {"response_time_s": "how long the page stood"},
        "break": {"response_time_s": "how long the page stood"},
        "all_pairs": {"rating_times_s": _TIMES, "group_factor": "the factor that has the groups' names"},
        "active_pairs": {"batch": "which pairs were chosen together", "group_factor": "as of all_pairs"},
        "best_of_series": {"rating_times_s": _TIMES, "start": "the picture that was shown first"},
        "rating": {"rating_times_s": _TIMES, "response_time_s": _TIME},
        "preference": {
            **dict.fromkeys(("answer", "chosen", "rejected"), "as chosen_view says"),
            "first_position": "where the first picture stood",
            "response_time_s": _TIME,
            "interval_s": "how long each interval was looked at",
        },
        "threshold": {
            **dict.fromkeys(("correct", "stimulus"), _REPEATED),
            "first_position": "where the first picture stood",
            "reference": "the picture that it was compared with",
            "track": "which of the interleaved series it belongs to",
            "track_trial": "its number in that series",
            "response_time_s": _TIME,
        },
        "questionnaire": {
            "response_time_s": _TIME,
        },
        "screening": {
            "presentation": "each single presentation and its answer; the test's outcome is reported",
            "by_series": "what came of each series of a test",
            "outcome.controls_seen": "whether what everyone sees was seen",
            "screen": "what the screen can show of the test",
        },
        PRACTICE: {"": "practice is not analysed"},
    }
)


@dataclass(frozen=True, slots=True)
class Unreported(JsonResult):
    """A ``field`` of a ``kind``'s records (empty: all of them, or of every kind), what it is, and how many have it."""

    kind: str
    field: str
    what: str
    records: int


def unreported(sessions: Sequence[SessionLog]) -> tuple[Unreported, ...]:
    """Return what the trials of sessions hold that the report does not show, by kind."""
    counts: Counter[tuple[str, str]] = Counter()
    for session in sessions:
        for trial in session.trials:
            counts.update(_left_out(trial))
    order = ["", *BY_KIND]
    found = sorted(counts.items(), key=lambda item: order.index(item[0][0]) if item[0][0] in order else len(order))
    return tuple(Unreported(kind, field, _what(kind, field), records) for (kind, field), records in found)


def _what(kind: str, field: str) -> str:
    known = BY_KIND.get(kind, {}) if kind else COMMON
    return known.get(field, "not known to this version")


def _left_out(trial: Trial) -> Iterator[tuple[str, str]]:
    """Yield the kind and the name of each field of a record that is not in the report."""
    held = trial.to_json()
    yield from (("", name) for name in COMMON if name in held)
    if trial.is_practice:
        yield PRACTICE, ""
        return
    yield from ((trial.kind, path) for path in BY_KIND.get(trial.kind, {}) if _has(held, path))
    yield from ((trial.kind, name) for name in trial.unknown)


def _has(held: Mapping[str, Any], path: str) -> bool:
    name, _, within = path.partition(".")
    return name in held and (not within or _has(held[name], within))
