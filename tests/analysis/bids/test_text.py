"""Text in tables: inert, and given back exactly."""

from __future__ import annotations

import csv
import io
import json
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.bids import unescape
from analysis.bids.export import time_cell
from analysis.bids.text import cell, escape, inert_json

ANY_TEXT = st.text(st.characters(exclude_categories=())) | st.text(
    "\\\"'=+-@nu/a \t\r\n\u202e\u2028\x85\x00", max_size=8
)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=12,
)
ACTIVE = ["\t", "\n", "\r", "\x00", "\x1b", "\x7f", "\x85", "\u202e", "\u2066", "\u200f", "\u2028", "\u2029", "\ufeff"]


@given(ANY_TEXT)
def test_escaped_text_comes_back(text: str) -> None:
    assert unescape(escape(text)) == text


@given(ANY_TEXT)
def test_a_cell_is_one_visible_line_and_no_formula(text: str) -> None:
    line = escape(text)
    assert line not in ("", "n/a")
    assert len(line.splitlines()) == 1
    assert not any(character in line for character in ACTIVE)
    assert line == '""' or line.lstrip()[:1] not in tuple('"=+-@')
    line.encode("utf-8")


@given(st.lists(ANY_TEXT, min_size=1, max_size=4))
def test_readers_that_know_quotes_see_the_same_cells(texts: list[str]) -> None:
    line = "\t".join(map(escape, texts))
    (read,) = csv.reader(io.StringIO(line + "\n", newline=""), delimiter="\t")
    assert [unescape(cell or '""') for cell in read] == texts


@settings(max_examples=15)
@given(JSON)
def test_json_comes_back_and_is_inert(value: Any) -> None:
    for indent in (None, 2):
        text = inert_json(value, indent)
        assert json.loads(text) == value
        assert not any(character in text.replace("\n", "") for character in ACTIVE)
        assert indent or "\n" not in text
        text.encode("utf-8")


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (None, "n/a"),
        (True, "true"),
        (False, "false"),
        (3, "3"),
        (-0.25, "-0.25"),
        (1e-7, "1e-07"),
        (float("nan"), "NaN"),
        (float("-inf"), "\\u002dInfinity"),
        ("n/a", "n\\u002fa"),
        ("", '""'),
        ("a\tb\nc", "a\\tb\\nc"),
        ("\u202egnp", "\\u202egnp"),
        ("=1+1", "\\u003d1+1"),
        (" -x", " \\u002dx"),
        ("\U000e0041", "\\U000e0041"),
        ("ΔE – gut", "ΔE – gut"),
        ([["up", 1.5]], '[["up",1.5]]'),
        ({"a": "x\ty\u202e\x7f"}, '{"a":"x\\ty\\u202e\\u007f"}'),
        ({"a": float("nan")}, '{"a":"NaN"}'),
    ],
)
def test_cells_are_written_as_documented(value: Any, expected: str) -> None:
    assert cell(value) == expected


START = "2026-01-02T03:04:05+00:00"


def test_only_a_time_of_day_is_written_as_one() -> None:
    assert time_cell(START) == START
    assert time_cell("2026-01-02T03:04:05.123456Z") == "2026-01-02T03:04:05.123456Z"
    assert time_cell("2026") == time_cell(None) == time_cell("2026-01-02T03:04:05Z\n") == "n/a"
