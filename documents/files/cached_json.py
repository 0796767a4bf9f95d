"""JSON files that the program keeps for itself, such as in a cache: what is wrong with one makes it a missing one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from documents.files.regular_files import read_regular
from documents.findings import InputError

_MOST_BYTES = 100_000_000


def read_cached_json(path: Path) -> Any:
    """Return what the JSON file at ``path`` holds; None where it is missing, unreadable, damaged or no regular file.

    Parameters
    ----------
    path
        A file that the program wrote itself, and can do without.

    Returns
    -------
    object
        Its value: whoever asked still checks what it is made of.

    Examples
    --------
    >>> read_cached_json(Path("configs/no_such_file.json")) is None
    True
    """
    try:
        return json.loads(read_regular(path, _MOST_BYTES))
    except (InputError, ValueError, RecursionError):
        return None
