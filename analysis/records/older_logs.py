"""Logs of older versions, brought to what is written today: readers know that alone.

What such a log does not say has the default that its field states. Where it said otherwise:

- what a surface says of itself may be null, and so may the bits of a channel, which were 8;
- neighbouring observers took opposite sides by ``order_rule`` 1, which no header named;
- the session's clock followed that of the machine, so that a resumed session may begin before the last record;
- lines had no checksums, as `documents.files.LogState` says of each log.
"""

from __future__ import annotations

from typing import Any, Literal

_SAID = dict.fromkeys(("backend", "display_server", "vendor", "renderer", "gl_version", "arithmetic"), "")
_BITS = 8
ORDER_RULE: Literal[1] = 1
# Notes come from elsewhere in the program, and may be written a moment after a record of a later time.
_OUT_OF_ORDER_S = 1.0


def header_of_today(line: dict[str, Any]) -> dict[str, Any]:
    """Return a header's line as it would be written today."""
    surface = line.get("presentation")
    if not isinstance(surface, dict):
        return line
    said = {name: value for name, value in {**_SAID, "bits": _BITS}.items() if surface.get(name, value) is None}
    return {**line, "presentation": {**surface, **said}} if said else line


def moved_on_s(behind_s: float, *, resumed: bool) -> float:
    """Return by how much the times of a log are moved from a record on that is ``behind_s`` the latest before it."""
    return behind_s if behind_s > (0.0 if resumed else _OUT_OF_ORDER_S) else 0.0
