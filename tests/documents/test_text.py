"""Text for people and programs: numbers, words, JSON values, and what a terminal may be sent."""

from __future__ import annotations

import io
import math
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import click
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.table import Table
from rich.text import Text

from documents.text import (
    JsonResult,
    clean_console,
    clean_streams,
    counted,
    did_you_mean,
    json_value,
    nearest,
    say,
    significant,
    with_error,
)


# Results as plain values for JSON.
@dataclass(frozen=True, slots=True)
class Fit(JsonResult):
    theta: Any
    inner: Any
    shared: float
    json_keys: ClassVar = {"theta": "strengths", "shared": None, "inner.name": "name"}
    json_also: ClassVar = ("inner.name",)


def test_fields_come_by_name_and_properties_after_them() -> None:
    fit = Fit(np.array([1.5, np.nan]), Path("x") / "y", 3.0)
    assert list(fit.to_json().items()) == [("strengths", [1.5, None]), ("inner", str(Path("x/y"))), ("name", "y")]
    several = {"x": (fit, None, np.float64(np.inf), np.int64(4), True)}
    assert json_value(several) == {"x": [fit.to_json(), None, None, 4, True]}


# Numbers for people: no exponent where digits do, and a value to the place of its error.

_MATCHED = re.compile(r"\(?(-?\d+(?:\.(\d+))?) ± (\d+(?:\.(\d+))?)\)?(?: × 10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?")


@pytest.mark.parametrize(
    ("value", "figures", "text"),
    [
        (113.7, 2, "110"),
        (11623.0, 4, "11620"),
        (0.3, 3, "0.3"),
        (0.0, 3, "0"),
        (99.96, 3, "100"),
        (-0.0123, 2, "-0.012"),
        (0.00012345, 3, "0.000123"),
        (2.5e9, 3, "2.5 × 10⁹"),
        (1e-12, 2, "1 × 10⁻¹²"),
        (math.nan, 3, "unknown"),
        (math.inf, 3, "infinite"),
        (-math.inf, 3, "minus infinite"),
    ],
)
def test_figures_of_a_number(value: float, figures: int, text: str) -> None:
    assert significant(value, figures) == text


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (132.6, 113.2, "130 ± 110"),
        (7632.4, 258.0, "7630 ± 260"),
        (2.28812, 0.00742, "2.2881 ± 0.0074"),
        (9.042, 8.99, "9.0 ± 9.0"),
        (99.922, 0.0781, "99.922 ± 0.078"),
        (0.5, 0.0996, "0.50 ± 0.10"),
        (-0.003, 0.5, "0.00 ± 0.50"),
        (0.0, 1.9, "0.0 ± 1.9"),
        (20.0, 0.0, "20 ± 0"),
        (7.1, math.inf, "7.1"),
        (7.1, math.nan, "7.1"),
        (7.1, None, "7.1"),
        (math.nan, 1.0, "unknown"),
        (1.234e12, 5.6e10, "(1.234 ± 0.056) × 10¹²"),
        (2.5, 1e-13, "2.5"),
    ],
)
def test_a_value_and_its_error_end_at_one_place(value: float, error: float | None, text: str) -> None:
    assert with_error(value, error) == text


@given(st.floats(), st.floats(min_value=0.0))
def test_no_number_has_an_exponent_or_other_decimals_than_its_error(value: float, error: float) -> None:
    text = with_error(value, error)
    assert not re.search(r"nan|inf\b|\de[+-]?\d", text)
    if " ± " in text and not text.endswith(" ± 0"):
        matched = _MATCHED.fullmatch(text)
        assert matched is not None, text
        assert len(matched[2] or "") == len(matched[4] or "")


# Text is clean wherever it is printed, and what the program itself writes still moves the terminal.

ESCAPE = "\x1b[31m"


class FakeTerminal(io.StringIO):
    """What is written to a terminal."""

    def isatty(self) -> bool:
        return True


def screen_of(monkeypatch: pytest.MonkeyPatch) -> io.StringIO:
    """Let standard output be a terminal that shows colours, through `clean_streams`."""
    own = FakeTerminal()
    monkeypatch.setattr(sys, "stdout", own)
    monkeypatch.setattr(sys, "stderr", own)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.delenv("NO_COLOR", raising=False)
    clean_streams()
    return own


def test_print_is_clean_and_keeps_its_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = screen_of(monkeypatch)
    print(f"a{ESCAPE}b\x9b\u202e\rc\n\td")
    assert screen.getvalue() == "a[31mbc\n\td\n"


def test_a_second_call_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    screen_of(monkeypatch)
    before = sys.stdout
    clean_streams()
    assert sys.stdout is before


def test_colours_of_the_program_pass_and_those_of_names_do_not(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = screen_of(monkeypatch)
    say(("warning:", "yellow"), f" {ESCAPE}name\nFORGED")
    assert screen.getvalue() == "\x1b[33mwarning:\x1b[0m [31mname FORGED\n"


@pytest.mark.parametrize("errors", [False, True])
def test_a_line_says_the_same_without_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], errors: bool
) -> None:
    for name, value in (("FORCE_COLOR", "1"), ("TERM", "xterm"), ("COLUMNS", "40")):
        monkeypatch.setenv(name, value)
    parts = ("warning:", "yellow"), f" [bold] {ESCAPE}name\nFORGED :smile: " + 60 * "long "
    say(*parts, errors=errors)
    coloured = capsys.readouterr()[errors]
    monkeypatch.delenv("FORCE_COLOR")
    say(*parts, errors=errors)
    plain = capsys.readouterr()[errors]
    assert coloured.startswith("\x1b[33mwarning:")
    assert plain == re.sub(r"\x1b\[\d+m", "", coloured)


def test_cells_of_tables_are_clean_and_on_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = screen_of(monkeypatch)
    table = Table("name", "as text", box=None)
    table.add_row(f"one{ESCAPE}\ntwo", Text("three\x07\nfour"))
    clean_console(width=80).print(table)
    plain = screen.getvalue().replace("\x1b[1m", "").replace("\x1b[0m", "")
    assert "\x1b" not in plain
    assert [line.split("  ") for line in map(str.strip, plain.splitlines())][1] == ["one[31m two", "three four"]
    assert len(plain.splitlines()) == 2


def test_surrogates_of_file_names_are_left_to_the_stream(monkeypatch: pytest.MonkeyPatch) -> None:
    own = io.TextIOWrapper(io.BytesIO(), "utf-8", errors="replace")
    monkeypatch.setattr(sys, "stdout", own)
    clean_streams()
    print("\udcff")
    sys.stdout.flush()
    assert own.buffer.getvalue() == b"?\n"


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
def test_click_writes_through_it_in_every_encoding(monkeypatch: pytest.MonkeyPatch, encoding: str) -> None:
    own = io.TextIOWrapper(io.BytesIO(), encoding, errors="xmlcharrefreplace")
    monkeypatch.setattr(sys, "stdout", own)
    clean_streams()
    click.echo("Δ\x07\x1b]0;title")
    click.echo(b"bytes\x1b")
    sys.stdout.flush()
    expected = "Δ" if encoding == "utf-8" else "&#916;"
    assert own.buffer.getvalue().decode("utf-8") == f"{expected}]0;title\nbytes\n"


# Words for people: counts, nearest spellings.
@pytest.mark.parametrize(
    ("count", "told"),
    [(0, "0 answers are"), (1, "1 answer is"), (1.0, "1 answer is"), (2, "2 answers are"), (1.5, "1.5 answers are")],
)
def test_one_is_one(count: float, told: str) -> None:
    assert counted(count, "answer is", "answers are") == told


def test_large_counts_are_whole() -> None:
    assert counted(36_152_320, "pixel", "pixels") == "36152320 pixels"


def test_the_nearest_spelling_is_named_else_what_there_is() -> None:
    known = ("gamma", "gain")
    assert did_you_mean("gama", known) == "did you mean 'gamma'?"
    assert did_you_mean("x", known) == "expected one of: gamma, gain"
    assert did_you_mean("x", known, "see the manual") == "see the manual"
    assert did_you_mean("x", known, "") == ""
    assert nearest("gama", known, cutoff=0.99) is None


def test_a_very_long_word_takes_no_time() -> None:
    assert nearest("g" * 1_000_000, ("gamma",) * 100) is None
