"""Results as plain values for JSON, by the names of their fields."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import fields, is_dataclass
from typing import Any


def json_fields(result: Any, *properties: str, omit: Collection[str] = ()) -> dict[str, Any]:
    """Return the fields of a dataclass by name, as plain values for JSON.

    Parameters
    ----------
    result
        An instance of a dataclass. A field that is another one becomes what its ``to_json`` returns, or its fields;
        tuples become lists.
    *properties
        Names of properties that follow the fields.
    omit
        Names of fields to leave out.

    Returns
    -------
    dict
        The values by the names of the fields.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Mean:
    ...     value: float
    ...     interval: tuple[float, float]
    >>> json_fields(Mean(0.5, (0.4, 0.6)))
    {'value': 0.5, 'interval': [0.4, 0.6]}
    >>> json_fields(Mean(0.5, (0.4, 0.6)), omit=["interval"])
    {'value': 0.5}
    """
    names = [field.name for field in fields(result) if field.name not in omit]
    return {name: _plain(getattr(result, name)) for name in (*names, *properties)}


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        own = getattr(value, "to_json", None)
        return own() if own is not None else json_fields(value)
    if isinstance(value, Mapping):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return value
