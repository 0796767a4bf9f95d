"""Tables whose columns are parted by something else than commas."""

from __future__ import annotations

from collections.abc import Sequence

from documents.findings import Finding

_OTHER = {";": "semicolons", "\t": "tabs"}


def other_separator(header: Sequence[str], file: str, line: int) -> Finding | None:
    """Return what is wrong with a ``header``, split at commas, that is parted by semicolons or tabs; else None.

    Such tables are refused, not read: where semicolons part columns, spreadsheets write decimal commas, and ``0,5``
    then is one number in one program and two in another.
    """
    if len(header) != 1:
        return None
    told = next((word for mark, word in _OTHER.items() if mark in header[0].strip()), None)
    if told is None:
        return None
    remedy = "save it as CSV with a comma between columns and a point in numbers, such as 0.5"
    return Finding(f"the table is separated by {told}", file, line, remedy=remedy)
