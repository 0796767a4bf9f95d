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

from analysis.kinds.kinds import KINDS
from analysis.kinds.trial import PRACTICE, Trial
from analysis.records.session_record import SessionLog
from documents.text import JsonResult

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


@dataclass(frozen=True, slots=True)
class UnreportedField(JsonResult):
    """A ``field`` of a ``kind``'s records (empty: all of them, or of every kind), what it is, and how many have it."""

    kind: str
    field: str
    what: str
    records: int


def unreported(sessions: Sequence[SessionLog]) -> tuple[UnreportedField, ...]:
    """Return what the trials of sessions hold that the report does not show, by kind."""
    counts: Counter[tuple[str, str, str]] = Counter()
    for session in sessions:
        for trial in session.trials:
            counts.update(_left_out(trial))
    order = ["", *KINDS, PRACTICE]
    found = sorted(counts.items(), key=lambda item: order.index(item[0][0]) if item[0][0] in order else len(order))
    return tuple(UnreportedField(*left_out, records) for left_out, records in found)


def _left_out(trial: Trial) -> Iterator[tuple[str, str, str]]:
    """Yield the kind and the name of each field of a record that is not in the report, and what it is."""
    held = trial.to_json()
    yield from (("", name, what) for name, what in COMMON.items() if name in held)
    if trial.is_practice:
        yield PRACTICE, "", "practice is not analysed"
        return
    yield from ((trial.kind, path, what) for path, what in trial.not_reported.items() if _has(held, path))
    yield from ((trial.kind, name, "not known to this version") for name in trial.unknown)


def _has(held: Mapping[str, Any], path: str) -> bool:
    name, _, within = path.partition(".")
    return name in held and (not within or _has(held[name], within))
