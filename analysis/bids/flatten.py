"""What a trial recorded, as a flat list of places and values."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

Place = tuple[str, ...]

_DEEPEST = 6
OTHERS = "others"


def roles(data: Mapping[str, Any], stimuli: Collection[str]) -> dict[str, str]:
    """Return, for each stimulus that the trial names, the first key that does so (``first``, ``chosen``, ...)."""
    found: dict[str, str] = {}
    for key, value in data.items():
        if isinstance(value, str) and value in stimuli:
            found.setdefault(value, key)
    return found


def flatten(
    data: Mapping[str, Any], stimuli: Collection[str] = (), whole: Collection[str] = ()
) -> list[tuple[Place, Any]]:
    """Return each value of ``data`` with the keys that lead to it; sequences and empty mappings are values.

    In a mapping whose keys are all stimuli (``stimuli`` are the session's), the role that a stimulus has in the trial
    stands for its name, so that columns do not multiply with the stimuli; those without a role stay together as one
    value. Keys in ``whole`` are not descended into.
    """
    by_role = roles(data, stimuli)
    found: list[tuple[Place, Any]] = []

    def descend(place: Place, value: Any) -> None:
        if not isinstance(value, dict) or not value or len(place) >= _DEEPEST:
            found.append((place, value))
        elif value.keys() <= shown:
            others = {}
            for key, inner in value.items():
                if key in by_role:
                    descend((*place, by_role[key]), inner)
                else:
                    others[key] = inner
            if others:
                found.append(((*place, OTHERS), others))
        else:
            for key, inner in value.items():
                descend((*place, key), inner)

    shown = frozenset(stimuli)
    for key, value in data.items():
        if key in whole:
            found.append(((key,), value))
        else:
            descend((key,), value)
    return found
