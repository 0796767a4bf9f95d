"""The observers that readings are for, as files of measurements write them, and readings turned to another observer.

ArgyllCMS writes ``1931_2``, ``1964_10``, ``2012_2`` and ``2012_10`` (the keyword ``OBSERVER`` of a ``.ti3``, the option
``-Q`` of dispread); its 2012 functions are those that the CIE published in 2015 (CIE 170-2:2015).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.colour_matching.observers import DEFAULT_OBSERVER, STANDARD_OBSERVERS, canonical_name
from devices.errors import DeviceError

if TYPE_CHECKING:
    pass

CIE_1931_2 = DEFAULT_OBSERVER
OBSERVERS = STANDARD_OBSERVERS
_ARGYLL = {"CIE 1931 2": "1931_2", "CIE 1964 10": "1964_10", "CIE 2015 2": "2012_2", "CIE 2015 10": "2012_10"}


def observer_name(text: str) -> str | None:
    """Return which of the observers' names ``text`` means, such as ``1964_10``; None if it means none of them."""
    try:
        return canonical_name(text)
    except DeviceError:
        return None


def argyll_observer(observer: str) -> str:
    """Return how ArgyllCMS writes ``observer``; the name itself where it has none."""
    return _ARGYLL.get(observer, observer)
