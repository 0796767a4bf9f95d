"""A line is read as `json.loads` reads it, and a checksum is looked at as closely as need be."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from documents.files import ChainReader
from documents.files.chain import EMPTY, sealed
from documents.files.json_lines import parsed

NUMBERS = st.floats() | st.integers() | st.integers(min_value=-(10**30), max_value=10**30)
VALUES = st.recursive(
    st.none() | st.booleans() | NUMBERS | st.text(st.characters(codec=None)),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=12,
)
ODD = [
    *(b"", b" ", b"\xef\xbb\xbf{}", b"\xff", b'"\xed\xa0\x80"', b'"\\ud800"', b'"\\ud83d\\ude00"', b'{"a":1}\0'),
    *(
        b'{"a":1,"a":2}',
        b'{"a":1,}',
        b'{"a":01}',
        b'"\t"',
        b"1.",
        b".5",
        b"+1",
        b"-0",
        b"-0.0",
        b"1e400",
        b"nan",
        b"NaN",
    ),
    *(b"-Infinity", b"1_0", b"1" * 5000, b"[" * 250 + b"]" * 250, b"5e-324", b"9007199254740993.0"),
    *("{}".encode("utf-16"), b'{"a":1} x', b'{"a":1', b"[" * 100_000),
]


def read(reader: Any, raw: bytes) -> object:
    """Return the value by its form (which tells -0.0, 1 and 1.0 apart), or the kind of error and its words."""
    try:
        return repr(reader(raw))
    except (ValueError, RecursionError) as error:
        return type(error), str(error)


@given(VALUES, st.booleans())
def test_a_value_is_read_as_by_json_loads(value: object, ascii_only: bool) -> None:
    raw = json.dumps(value, ensure_ascii=ascii_only).encode("utf-8", "surrogatepass")
    assert read(parsed, raw) == read(json.loads, raw)


@given(st.floats(allow_nan=False, allow_infinity=False), st.integers(min_value=1, max_value=40))
def test_a_number_of_any_length_is_the_same_float(number: float, digits: int) -> None:
    raw = f"{number:.{digits}e}".encode()
    assert math.copysign(1, parsed(raw)) == math.copysign(1, json.loads(raw))
    assert parsed(raw) == json.loads(raw)


@pytest.mark.parametrize("raw", ODD, ids=range(len(ODD)))
def test_what_is_odd_is_read_or_refused_as_by_json_loads(raw: bytes) -> None:
    assert read(parsed, raw) == read(json.loads, raw)


@given(st.lists(st.integers(0, 3), min_size=1, max_size=8), st.integers(0, 2**32))
def test_the_line_that_is_due_is_seen_as_by_a_closer_look(changes: list[int], place: int) -> None:
    chain, before = ChainReader(), EMPTY
    for number, change in enumerate(changes, start=1):
        line, before = sealed({"record": "trial", "trial": number} if number > 1 else {}, number, before)
        at = place % len(line)
        changed = {1: bytes([*line[:at], line[at] ^ 1, *line[at + 1 :]]), 2: line[:at], 3: b'{"a":1}'}
        raw = changed.get(change, line)
        link = chain.look(raw)
        assert link == chain._look_closely(raw)
        chain.take(link)
