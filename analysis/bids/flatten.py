"""What a trial recorded, as a flat list of places and values."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
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
) -> Iterator[tuple[Place, Any]]:
    """Yield each value of ``data`` with the keys that lead to it; sequences and empty mappings are values.

    In a mapping whose keys are all stimuli (``stimuli`` are the session's), the role that a stimulus has in the trial
    stands for its name, so that columns do not multiply with the stimuli; those without a role stay together as one
    value. Keys in ``whole`` are not descended into.
    """
    by_role = roles(data, stimuli)
    for key, value in data.items():
        if key in whole:
            yield (key,), value
        else:
            yield from _descend((key,), value, by_role, stimuli)


def _descend(
    place: Place, value: Any, by_role: Mapping[str, str], stimuli: Collection[str]
) -> Iterator[tuple[Place, Any]]:
    if not isinstance(value, Mapping) or not value or len(place) >= _DEEPEST:
        yield place, value
        return
    if all(key in stimuli for key in value):
        others = {key: inner for key, inner in value.items() if key not in by_role}
        for key, inner in value.items():
            if key in by_role:
                yield from _descend((*place, by_role[key]), inner, by_role, stimuli)
        if others:
            yield (*place, OTHERS), others
        return
    for key, inner in value.items():
        yield from _descend((*place, key), inner, by_role, stimuli)
