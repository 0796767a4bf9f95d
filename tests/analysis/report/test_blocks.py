"""Tables as CSV: read back as they were, and inert in a spreadsheet."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.records import SessionLog
from analysis.report import write_report
from documents.pages import Column, Table, csv_text, write_csv_files
from documents.pages.blocks import inert

Maker = Callable[..., SessionLog]
DANGEROUS = ("=", "+", "-", "@", "\t", "\r", "\n")


def read(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text, newline="")))


@given(st.text(st.characters(codec="utf-8", exclude_characters="\0")))
def test_any_text_comes_back_and_none_begins_a_formula(text: str) -> None:
    table = Table("notes", "Notes", (Column("Note", "note"), Column("Left", "left")), ((text, "end"),))
    head, row = read(csv_text(table))
    assert head == ["note", "left"]
    assert row[0] in (text, f"'{text}")
    assert not row[0].lstrip(" ").startswith(DANGEROUS)
    assert row[1] == "end"


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "  =1", "=cmd|' /C calc'!A0", "\uff1d1"])
def test_formulas_are_made_text(text: str) -> None:
    assert inert(text) == f"'{text}"


def test_numbers_stand_in_full_and_intervals_make_two_columns() -> None:
    columns = (Column("Item", "item"), Column("Score", "score", "number", 2), Column("95 %", "score", "interval", 1))
    rows = (("a", -0.1234567890123, (float("-inf"), 1 / 3)), ("b", None, (None, None)))
    assert read(csv_text(Table("t", "T", columns, rows))) == [
        ["item", "score", "score_low", "score_high"],
        ["a", "-0.1234567890123", "-inf", repr(1 / 3)],
        ["b", "", "", ""],
    ]


@pytest.mark.usefixtures("undrawn", "unreviewed")
def test_every_table_is_a_file_and_nothing_is_left_half_written(sessions: list[SessionLog], tmp_path: Path) -> None:
    report = write_report(sessions[:3], tmp_path / "report.html", csv_folder=tmp_path / "tables")
    names = {file.name for file in (tmp_path / "tables").iterdir()}
    assert {"scores.csv", "comparisons.csv", "classes.csv", "observers.csv", "clipping.csv", "sessions.csv"} <= names
    assert all(name.endswith(".csv") for name in names)
    assert report.pairs is not None
    with (tmp_path / "tables" / "scores.csv").open(encoding="utf-8", newline="") as file:
        scores = list(csv.DictReader(file))
    assert [(row["stimulus"], float(row["score"])) for row in scores] == [
        (item.name, item.score) for item in report.pairs.scores.items
    ]


def test_a_tables_name_stays_in_the_folder(tmp_path: Path) -> None:
    (file,) = write_csv_files([Table("ratings_../../x", "", (Column("A", "a"),), ())], tmp_path / "in")
    assert file.parent == tmp_path / "in"
    assert file.is_file()


@pytest.mark.usefixtures("undrawn")
def test_names_of_observers_and_stimuli_are_inert_in_every_file(make_session: Maker, tmp_path: Path) -> None:
    names = ("=HYPERLINK(1)", "@b", "+c")
    answers = [(one, other) for one in names for other in names if one != other] * 2
    sessions = [make_session(f"-{number}", names=names, answers=answers) for number in range(3)]
    write_report(sessions, tmp_path / "report.html", csv_folder=tmp_path / "tables")
    for file in (tmp_path / "tables").iterdir():
        for row in read(file.read_text(encoding="utf-8")):
            for field in row:
                if field.startswith(DANGEROUS):
                    float(field)  # nothing but a number may begin with a sign


def test_heads_made_of_what_people_called_things_are_inert_too() -> None:
    columns = (Column("=a", "=a", "number"), Column("95 %", "=a", "interval"))
    assert read(csv_text(Table("t", "T", columns, ()))) == [["'=a", "'=a_low", "'=a_high"]]
