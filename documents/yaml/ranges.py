"""Numbers of a file with their range, and what refuses a model in which a number has none.

A number without a range ends far from its file: as infinity, as more memory than there is, as a text that cannot be
written. The limits here are beyond whatever is measured; where a quantity has nearer ones, ``Field`` states them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field

MOST = 1e12
"""What no number of a file exceeds that has no nearer limit."""
LEAST = 1e-12
"""What numbers above 0 are not less than: what is divided by them stays a number."""
_MOST_WHOLE = 10**9

Number = Annotated[float, Field(ge=-MOST, le=MOST)]
NotNegative = Annotated[float, Field(ge=0, le=MOST)]
Positive = Annotated[float, Field(ge=LEAST, le=MOST)]
Count = Annotated[int, Field(ge=0, le=_MOST_WHOLE)]
Natural = Annotated[int, Field(gt=0, le=_MOST_WHOLE)]
# What random numbers begin with: 128 bits, as generators propose them, have 39 digits.
Seed = Annotated[int, Field(ge=-(10**40), le=10**40)]
_LOW, _HIGH = ("ge", "gt"), ("le", "lt")


def refuse_unranged(name: str, schema: Mapping[str, Any]) -> None:
    """Raise TypeError if a number in the core ``schema`` of the model ``name`` lacks a lower or an upper limit."""
    if bare := list(dict.fromkeys(_unranged(schema, ""))):
        raise TypeError(f"{name}: give each number a range, such as documents.yaml.Positive: {', '.join(bare)}")


def _unranged(node: Any, place: str) -> Iterator[str]:
    if isinstance(node, list | tuple):
        for inner in node:
            yield from _unranged(inner, place)
    elif isinstance(node, Mapping):
        if node.get("type") in ("int", "float") and not all(any(key in node for key in end) for end in (_LOW, _HIGH)):
            yield place or "itself"
        if node.get("type") == "model" and place:
            return  # it has been looked at as its own
        for key, inner in node.items():
            if key == "fields" and isinstance(inner, Mapping):
                for field, of_field in inner.items():
                    yield from _unranged(of_field, place or field)
            elif key not in ("metadata", "serialization", "default", "cls", "config", "expected"):
                yield from _unranged(inner, place)
