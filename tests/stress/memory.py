"""The most memory that this process has held, on Linux.

`resource` tells too much of it: a program begins with the peak of the one that started it, and what came before in the
same process cannot be forgotten.
"""

from __future__ import annotations

import re
from pathlib import Path


def peak_kb() -> int:
    """Return the peak of resident memory in kilobytes."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="ascii"))
    assert found is not None
    return int(found.group(1))


def forget_peak() -> int:
    """Begin anew from what is held now, and return that in kilobytes."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    return peak_kb()
