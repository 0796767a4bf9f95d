"""The fields of results as plain values."""

from __future__ import annotations

from dataclasses import dataclass

from documents.text import json_fields


@dataclass(frozen=True, slots=True)
class Inner:
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Renamed:
    value: float

    def to_json(self) -> dict[str, float]:
        return {"another_name": self.value}


@dataclass(frozen=True, slots=True)
class Outer:
    name: str
    missing: float | None
    inner: Inner
    by_name: dict[str, tuple[Renamed, ...]]


def test_fields_are_plain_values_by_name() -> None:
    assert json_fields(Outer("a", None, Inner((1.0, 2.0)), {"x": (Renamed(3.0),)})) == {
        "name": "a",
        "missing": None,
        "inner": {"values": [1.0, 2.0]},
        "by_name": {"x": [{"another_name": 3.0}]},
    }
