"""The names of the observers whose colour-matching functions give XYZ, and how files write them.

ArgyllCMS writes ``1931_2``, ``1964_10``, ``2012_2`` and ``2012_10`` (the keyword ``OBSERVER`` of a ``.ti3``, the option
``-Q`` of dispread); its 2012 functions are those that the CIE published in 2015 (CIE 170-2:2015).
"""

from __future__ import annotations

import re

from devices.errors import DeviceError
from documents import Finding

CIE_1931_2 = "CIE 1931 2"
OBSERVERS = (CIE_1931_2, "CIE 1964 10", "CIE 2015 2", "CIE 2015 10")
_WRITTEN = re.compile(
    r"(?:CIE[ _]*)?(1931|1964|2006|2012|2015)[ _,]*(2|10)(?:[ _]*(?:°|deg|degrees?))?(?:[ _]*observer)?", re.IGNORECASE
)
_YEARS = {"2006": "2015", "2012": "2015"}
_ARGYLL = {"CIE 1931 2": "1931_2", "CIE 1964 10": "1964_10", "CIE 2015 2": "2012_2", "CIE 2015 10": "2012_10"}


def observer_name(text: str) -> str | None:
    """Return which of the observers' names ``text`` means, such as ``1964_10``; None if it means none of them."""
    match = _WRITTEN.fullmatch(text.strip())
    if match is None:
        return None
    name = f"CIE {_YEARS.get(match[1], match[1])} {match[2]}"
    return name if name in OBSERVERS else None


def argyll_observer(observer: str) -> str:
    """Return how ArgyllCMS writes ``observer``; the name itself where it has none."""
    return _ARGYLL.get(observer, observer)


def require_cie_1931(observer: str, file: str | None = None) -> None:
    """Raise DeviceError unless ``observer`` is CIE 1931 2°, for which colours are computed."""
    if observer != CIE_1931_2:
        raise DeviceError(
            Finding(
                f"the readings are for the observer {observer}°; colours are computed for {CIE_1931_2}°",
                file,
                remedy="measure with the CIE 1931 2° observer (in ArgyllCMS: -Q 1931_2), or give the spectra alone",
            )
        )
