"""Files that are read whole, but of no more than so many bytes."""

from __future__ import annotations

import errno
import os
from pathlib import Path


def bounded_bytes(path: str | os.PathLike[str], most_bytes: int) -> bytes:
    """Return what the file at ``path`` holds; what has no end, such as ``/dev/zero``, is read no further.

    Raises
    ------
    OSError
        If it cannot be read or holds more than ``most_bytes``; ``strerror`` then says so.
    """
    with Path(path).open("rb") as file:
        content = file.read(most_bytes + 1)
    if len(content) > most_bytes:
        raise OSError(errno.EFBIG, f"it is larger than {most_bytes / 1e6:g} MB", str(path))
    return content
