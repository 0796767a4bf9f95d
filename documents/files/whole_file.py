"""Files that appear with all their text or not at all."""

from __future__ import annotations

import secrets
from pathlib import Path


def write_whole(path: Path, text: str) -> None:
    """Write ``text`` to ``path`` in UTF-8, its line ends as they are; the folder is made if need be.

    The text is first written beside it under a name of its own: who reads ``path`` meanwhile finds what was there
    before, and two who write at once do not mix.

    Raises
    ------
    OSError
        If it cannot be written; what was at ``path`` is then still there.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(f".{path.name[:80]}.{secrets.token_hex(4)}.part")
    try:
        draft.write_bytes(text.encode("utf-8"))
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)
