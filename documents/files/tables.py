"""Tables that people write, refused where their columns are not separated by commas."""

from __future__ import annotations

from collections.abc import Sequence

from documents.findings import Finding

_OTHER = {";": "semicolons", "\t": "tabs"}
_ERRORS = ("#N/A", "#NA", "#NULL!", "#NUM!", "#VALUE!", "#DIV/0!", "#REF!", "#NAME?")  # as spreadsheets write them


def is_comment(line: str) -> bool:
    """Return whether a line of a table is a comment: it begins with ``#``, and not with a spreadsheet's error.

    Examples
    --------
    >>> is_comment("# codes: 0..255"), is_comment("#N/A,0.5,1")
    (True, False)
    """
    bare = line.lstrip()
    return bare.startswith("#") and bare.split(",", 1)[0].strip() not in _ERRORS


def other_separator(header: Sequence[str], file: str, line: int) -> Finding | None:
    """Return what is wrong with a ``header``, split at commas, that is separated by semicolons or tabs; else None.

    Such tables are refused, not read: where semicolons separate columns, spreadsheets write decimal commas, and ``0,5``
    then is one number in one program and two in another.

    Parameters
    ----------
    header
        The cells of the header, split at commas.
    file
        The file's name for the finding.
    line
        The line of the header, from 1.

    Returns
    -------
    Finding or None
        What is wrong, with a remedy; None if commas separate the columns.

    Examples
    --------
    >>> other_separator(["red", "green", "blue"], "codes.csv", 1) is None
    True
    >>> other_separator(["red;green;blue"], "codes.csv", 1).message
    'the table is separated by semicolons'
    """
    if len(header) != 1:
        return None
    separator = next((word for mark, word in _OTHER.items() if mark in header[0].strip()), None)
    if separator is None:
        return None
    remedy = "save it as CSV with a comma between columns and a point in numbers, such as 0.5"
    return Finding(f"the table is separated by {separator}", file, line, remedy=remedy)
