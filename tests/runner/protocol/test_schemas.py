"""The JSON Schemas that editors use: every key of every kind of file says what it means."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from runner.protocol import KINDS, FileKind, json_schema


def _keys(node: Any, where: str) -> Iterator[tuple[str, dict[str, Any]]]:
    if isinstance(node, dict):
        properties = node.get("properties")
        if isinstance(properties, dict):
            for name, value in properties.items():
                yield f"{where}.{name}", value
        for name, value in node.items():
            yield from _keys(value, name if where in ("$defs", "") else where if name != "$defs" else "$defs")
    elif isinstance(node, list):
        for value in node:
            yield from _keys(value, where)


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_has_a_description(kind: FileKind) -> None:
    keys = list(_keys(json_schema(kind), ""))
    assert len(keys) > 5
    assert [name for name, value in keys if len(str(value.get("description", ""))) < 8] == []


def test_a_description_is_a_sentence_with_its_unit() -> None:
    properties = json_schema("rig")["properties"]
    assert properties["distance_mm"]["description"] == "The viewing distance, in mm."
    texts = {value["description"] for kind in KINDS for _, value in _keys(json_schema(kind), "")}
    assert [text for text in texts if not text.startswith("In English: ") and not text.endswith(".")] == []
