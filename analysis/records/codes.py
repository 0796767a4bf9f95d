"""Observers' codes: by the folder of a session, and whether two people seem to share one."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from itertools import combinations

from analysis.records.session_record import SessionLog
from analysis.records.times import read_utc

# Clocks of stations differ; one who changes stations needs longer.
_MORE_THAN = timedelta(seconds=30)
_CODE = re.compile("[0-9A-Za-z]{1,64}")
_NAMED = 4


def by_folder(log: SessionLog) -> SessionLog:
    """Return the session with the observer's code that its folder states.

    A session lies in ``sub-CODE/ses-LABEL``. Where two people had one code, renaming a folder, or moving sessions to
    another, parts them: the log is not changed. A log that lies elsewhere keeps its code.
    """
    folder, recorded = log.file.absolute().parent, str(log.header.observer)
    stated = folder.parent.name.removeprefix("sub-")
    at_home = folder.name == f"ses-{log.header.session}" and folder.parent.name.startswith("sub-")
    if not at_home or stated == recorded or not (_CODE.fullmatch(stated) and _CODE.fullmatch(recorded)):
        return log
    return replace(log, header=log.header.model_copy(update={"observer": stated}), recorded_as=recorded)


def plain_code(code: str) -> str:
    """Return ``code`` without what people write one way or another: leading zeros of numbers, and capitals."""
    return re.sub("(?<![0-9])0+(?=[0-9])", "", code).casefold()


def notes_on_sittings(sessions: Iterable[SessionLog]) -> Iterator[str]:
    """Yield who has several sessions and what is done with them, and which codes are so near that one may be meant."""
    sittings: dict[str, list[str]] = {}
    for session in sessions:
        if session.answers:
            sittings.setdefault(str(session.header.observer), []).append(str(session.header.session))
    for observer, labels in sorted(sittings.items()):
        if len(labels) > 1:
            listed = ", ".join(labels[:_NAMED]) + (", ..." if len(labels) > _NAMED else "")
            yield (
                f"Observer {observer} has {len(labels)} sittings ({listed}): the answers of all are counted, as one "
                "observer's."
            )
    near: dict[str, list[str]] = {}
    for observer in sorted(sittings):
        near.setdefault(plain_code(observer), []).append(observer)
    for codes in near.values():
        if len(codes) > 1:
            yield (
                f"The codes {' and '.join(codes)} differ in leading zeros or capitals only, and are counted as "
                f"{len(codes)} observers: if they are one, rename the folder sub-{codes[-1]} to sub-{codes[0]}."
            )


Span = tuple[datetime, datetime]


@dataclass(frozen=True, slots=True)
class Sitting:
    """When, where and under which code a session was recorded.

    ``spans`` are the times in which it ran: from its start, and each time it was resumed, to the last record. ``root``
    is the folder of results that it lies in, empty if it does not lie where sessions are recorded.
    """

    observer: str
    recorded_as: str
    session: str
    station: str
    root: str
    simulated: bool
    spans: tuple[Span, ...]

    @classmethod
    def of(cls, log: SessionLog) -> Sitting:
        """Return what counts of a session."""
        header, folders = log.header, log.file.parents
        at_home = len(folders) > 3 and folders[0].name == f"ses-{header.session}"
        root = str(folders[3]) if at_home else ""
        who = header.observer, log.recorded_as, header.session, header.station
        return cls(*who, root, header.simulated, _spans(log))


def notes_on_codes(sittings: Iterable[Sitting]) -> Iterator[str]:
    """Yield a note on each observer whose code seems to be of two people, and on each who was given another code.

    Two people seem to share a code if sessions overlap in time, or were recorded on different stations or, where logs
    do not name their station, lie in different folders of results. Simulated observers are left out.
    """
    by_code: dict[str, list[Sitting]] = {}
    for sitting in sittings:
        if not sitting.simulated:
            by_code.setdefault(sitting.observer, []).append(sitting)
    for code, own in sorted(by_code.items()):
        for before in sorted({sitting.recorded_as for sitting in own} - {""}):
            yield f"Sessions that were recorded as observer {before} are counted as {code}, as their folder is named."
    for code, own in sorted(by_code.items()):
        if why := "; ".join(_signs(own)):
            yield (
                f"Observer {code} may be two people with one code: {why}. They are counted as one. If they are two, "
                f"rename the folder of one, sub-{code}, to a code that nobody has: the logs need no change."
            )


def _signs(sittings: Sequence[Sitting]) -> Iterator[str]:
    """Yield what speaks for two people in sessions under one code."""
    overlapping = [
        f"{one.session} and {other.session}"
        for one, other in combinations(sittings, 2)
        if any(_overlap(a, b) for a in one.spans for b in other.spans)
    ]
    if overlapping:
        more = f"; and {len(overlapping) - _NAMED} more" if len(overlapping) > _NAMED else ""
        yield f"sessions overlap in time ({'; '.join(overlapping[:_NAMED])}{more})"
    stations = dict.fromkeys(sitting.station for sitting in sittings if sitting.station)
    if len(stations) > 1:
        yield f"sessions were recorded on {len(stations)} stations ({', '.join(stations)})"
    roots = dict.fromkeys(sitting.root for sitting in sittings if sitting.root)
    if len(roots) > 1 and not all(sitting.station for sitting in sittings):
        yield f"sessions lie in {len(roots)} folders of results, and not all name their station ({', '.join(roots)})"


def _spans(log: SessionLog) -> tuple[Span, ...]:
    starts = sorted(
        time
        for text in (log.header.started_utc, *(resumption.utc for resumption in log.resumptions))
        if (time := read_utc(text))
    )
    kinds = (log.answers, log.notes, log.marks)
    # Records of a kind stand in the order of time: without a resumption the last counts.
    records = [record for kind in kinds for record in (kind if log.resumptions else kind[-1:])]
    times = [time for record in records if (time := read_utc(record.utc))]
    ends = [*starts[1:], datetime.max.replace(tzinfo=UTC)][: len(starts)]
    return tuple(
        (start, max((time for time in times if start <= time < end), default=start))
        for start, end in zip(starts, ends, strict=True)
    )


def _overlap(one: Span, other: Span) -> bool:
    return min(one[1], other[1]) - max(one[0], other[0]) > _MORE_THAN
