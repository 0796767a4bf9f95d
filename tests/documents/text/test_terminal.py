"""Text is clean wherever it is printed, and what the program itself writes still moves the terminal."""

from __future__ import annotations

import io
import re
import sys

import click
import pytest
from rich.table import Table
from rich.text import Text

from documents.text import clean_console, clean_streams, say

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
