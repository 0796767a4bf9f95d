"""Results as plain values for JSON, by the names of their fields."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any, ClassVar

_OWN_KEYS = "*"


class JsonResult:
    """A dataclass whose JSON are its fields by name.

    Attributes
    ----------
    json_keys
        Keys of what is called otherwise in JSON; None leaves a field out, and ``*`` puts its own keys in its place.
    json_also
        Names of properties that follow the fields, such as ``share`` or ``conclusion.verdict``.
    json_names
        Names of fields and properties in the order of the JSON, with spaces between, where these are not the fields in
        theirs.
    json_optional
        Names of those that are left out where they say nothing.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True, slots=True)
    ... class Share(JsonResult):
    ...     right: int
    ...     answers: int
    ...     json_keys: ClassVar = {"answers": "of"}
    ...     json_also: ClassVar = ("percent",)
    ...
    ...     @property
    ...     def percent(self) -> float:
    ...         return 100 * self.right / self.answers
    >>> Share(1, 4).to_json()
    {'right': 1, 'of': 4, 'percent': 25.0}
    """

    __slots__ = ()
    json_keys: ClassVar[Mapping[str, str | None]] = {}
    json_also: ClassVar[tuple[str, ...]] = ()
    json_names: ClassVar[str] = ""
    json_optional: ClassVar[tuple[str, ...]] = ()

    def to_json(self) -> dict[str, Any]:
        """Return plain values for JSON by the names of the fields; null where a number is not finite."""
        found = json_fields(self, *self.json_also)
        return {key: value for key, value in found.items() if value is not None or key not in self.json_optional}


def json_fields(result: Any, *properties: str, omit: Collection[str] = ()) -> dict[str, Any]:
    """Return the fields of a dataclass by name, as plain values for JSON.

    Parameters
    ----------
    result
        An instance of a dataclass. A field that is another one becomes what its ``to_json`` returns, or its fields;
        tuples and arrays become lists, paths text, and numbers that are not finite None.
    *properties
        Names of properties that follow the fields.
    omit
        Names of fields to leave out.

    Returns
    -------
    dict
        The values by the names of the fields, or by what the ``json_keys`` of a `JsonResult` say.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Mean:
    ...     value: float
    ...     interval: tuple[float, float]
    >>> json_fields(Mean(0.5, (0.4, math.inf)))
    {'value': 0.5, 'interval': [0.4, None]}
    >>> json_fields(Mean(0.5, (0.4, 0.6)), omit=["interval"])
    {'value': 0.5}
    """
    names = getattr(result, "json_names", "").split() or [one.name for one in fields(result) if one.name not in omit]
    keys, optional = getattr(result, "json_keys", {}), getattr(result, "json_optional", ())
    values: dict[str, Any] = {}
    for path in (*names, *properties):
        key = keys.get(path, path.rpartition(".")[2])
        if key is None:
            continue
        value = json_value(_at(result, path))
        if key == _OWN_KEYS:
            values |= value or {}
        elif path not in optional or value not in (None, "", [], {}):
            values[key] = value
    return values


def _at(result: Any, path: str) -> Any:
    """Return what stands at a path, such as ``conclusion.verdict``; None where a part of it is None."""
    for name in path.split("."):
        result = None if result is None else getattr(result, name)
    return result


def finite(value: float) -> float | None:
    """Return a number as a plain float, None if it is infinite or NaN."""
    return float(value) if math.isfinite(value) else None


def json_value(value: Any) -> Any:
    """Return plain values for JSON of a result, of models, numbers, paths and arrays, or lists and mappings of them."""
    if isinstance(value, float):
        return finite(value)
    if isinstance(value, Enum):
        return value.value
    if not isinstance(value, type) and hasattr(value, "to_json"):
        return value.to_json()
    if hasattr(value, "model_dump"):
        return json_value(value.model_dump())
    if is_dataclass(value) and not isinstance(value, type):
        return json_fields(value)
    if isinstance(value, Mapping):
        return {key: json_value(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [json_value(inner) for inner in value]
    if isinstance(value, Path):
        return str(value)
    # Arrays and their numbers.
    return json_value(value.tolist()) if hasattr(value, "tolist") else value
