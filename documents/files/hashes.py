"""SHA-256 of a file, and of data that JSON can hold."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from documents.files.regular_files import open_regular


def sha256_of_file(path: Path) -> str:
    """Return the SHA-256 of a file's content, in hexadecimal.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    str
        64 hexadecimal digits.

    Raises
    ------
    InputError
        If it is missing or unreadable, or no regular file.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "empty")
    ...     file.touch()
    ...     sha256_of_file(file)[:8]
    'e3b0c442'
    """
    with open_regular(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def sha256_of_json(data: object) -> str:
    """Return the SHA-256 of ``data`` as canonical JSON: sorted keys, no spaces, no NaN.

    Parameters
    ----------
    data
        Plain data that JSON can express, with finite numbers.

    Returns
    -------
    str
        64 hexadecimal digits, in lower case.

    Examples
    --------
    >>> sha256_of_json({"b": 1, "a": 2}) == sha256_of_json({"a": 2, "b": 1})
    True
    >>> sha256_of_json([])[:8]
    '4f53cda1'
    """
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()
