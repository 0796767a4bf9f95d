"""Missing values in tables: their lines are left out and named, and no item or observer is called "NA"."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import cyclopean as notebook
from analysis.comparisons import TableRead, parse_table, read_any
from analysis.comparisons.missing import MOST_SAID, WORDS
from analysis.errors import ResultsError
from documents import InputError

Call = Callable[..., subprocess.CompletedProcess[str]]
PLAIN = "winner,loser,observer,scene,first\n"
WHOLE = "a,b,01,day,a\nb,a,02,day,b\n"


def read(text: str, *, keep_na: bool = False, codes: tuple[str, ...] = ()) -> TableRead:
    return read_any(text.splitlines(keepends=True), "t.csv", choice_codes=codes, keep_na=keep_na)


@pytest.mark.parametrize("word", ["NA", "NaN", "None", "null", "#N/A", "#NULL!", ".", "<missing>", " NA "])
@pytest.mark.parametrize(
    ("line", "column"),
    [("{},b,01,day,", 1), ("a,{},01,day,", 3), ("a,b,{},day,", 5), ("a,b,01,{},", 8)],
)
def test_a_line_with_a_word_for_a_missing_value_is_left_out_and_named(word: str, line: str, column: int) -> None:
    table = read(PLAIN + WHOLE + line.format(word) + "\n")
    assert (table.comparisons.items, table.comparisons.observers) == (("a", "b"), ("01", "02"))
    assert table.comparisons.groups == ("day",)
    assert table.comparisons.wins.tolist() == [[0, 1], [1, 0]]
    assert table.left_out["lines"] == 1
    (first,) = table.left_out["first"]
    assert (first["line"], first["column"]) == (4, column)
    assert f"'{word.strip()}'" in first["message"]
    assert any(said.startswith(f"t.csv:4:{column}: ") for said in table.lines)
    assert any("--keep-na" in said for said in table.lines)


def test_names_that_are_no_words_for_missing_values_are_names() -> None:
    table = read(PLAIN + WHOLE + "na,none,nobody,Nan,na\nNA 2,N,Nil,nights,N\n")
    assert table.comparisons.items == ("a", "b", "na", "none", "NA 2", "N")
    assert (table.warnings, table.left_out) == ((), {})


def test_words_for_missing_values_are_names_when_they_are_to_be() -> None:
    text = PLAIN + WHOLE + "None,a,NA,null,None\n"
    table = read(text, keep_na=True)
    assert table.comparisons.items == ("a", "b", "None")
    assert (table.comparisons.observers, table.comparisons.groups) == (("01", "02", "NA"), ("day", "null"))
    assert table.warnings == ()
    assert read("item_a,item_b,choice\nx,y,x\nx,y,y\nx,y,NA\n", codes=("x", "y", "na")).comparisons.ties == 1


def test_an_unknown_first_is_unknown() -> None:
    told = read("winner,loser,first\na,b,NA\nb,a,b\n")
    assert told.comparisons.winner_was_first.tolist() == [-1, 1]
    assert told.warnings == ()


def test_a_missing_outcome_is_no_win() -> None:
    table = read("winner,loser,outcome\na,b,NA\nb,a,win\na,b,tie\n")
    assert (table.comparisons.wins.sum(), table.comparisons.ties) == (1, 1)
    assert table.left_out["missing"] == {"outcome": 1}


@pytest.mark.parametrize(
    ("text", "missing"),
    [
        ("item_a,item_b,choice\nx,y,x\nx,y,NA\ny,NaN,y\nx,y,y\n", {"choice": 1, "item": 1}),
        ("observer,condition_a,condition_b,is_a_selected\n1,x,y,1\n1,x,y,NA\nNA,x,y,0\n1,y,x,1\n", None),
        ("option_1,option_2,option_3,choice\nx,y,NA,x\nx,NA,y,y\nx,y,,NA\n", {"choice": 1}),
    ],
)
def test_missing_choices_and_items_of_other_layouts(text: str, missing: dict[str, int] | None) -> None:
    table = read(text)
    assert set(table.comparisons.items) == {"x", "y"}
    assert table.comparisons.wins.tolist() == [[0, 1], [1, 0]]
    assert table.left_out["missing"] == (missing or {"choice": 1, "observer": 1})


def test_a_matrix_may_miss_its_diagonal_and_no_name() -> None:
    assert read(",a,b\na,NA,3\nb,2,NA\n").comparisons.wins.tolist() == [[0, 3], [2, 0]]
    for text in (",a,NA\na,0,3\nNA,2,0\n", ",a,b\na,0,NA\nb,2,0\n"):
        with pytest.raises(ResultsError, match="'NA'"):
            read(text)
    assert read(",a,NA\na,0,3\nNA,2,0\n", keep_na=True).comparisons.items == ("a", "NA")


def test_trials_that_another_program_saved_keep_their_pairs() -> None:
    header = "experiment,observer,kind,first,second,answer,chosen,rejected,catch,group\n"
    text = header + "e,01,all_pairs,None,b,first,None,b,NA,day\ne,01,all_pairs,b,None,first,b,None,NA,day\n"
    assert read(text).comparisons.items == ("None", "b")  # names of a log
    with pytest.raises(ResultsError, match="the group is empty"):
        read(text.replace("NA,day", "NA,NA", 1))


def test_a_column_without_any_value_is_named() -> None:
    with pytest.raises(ResultsError, match=r"t\.csv:2:5: the observer is missing in every line") as raised:
        read("winner,loser,observer\na,b,NA\nb,a,NaN\n")
    assert "--keep-na" in str(raised.value)


def test_many_lines_are_counted_and_the_first_named() -> None:
    table = read("winner,loser\na,b\nb,a\n" + "NA,b\n" * 40_000)
    assert table.left_out["lines"] == 40_000
    assert len(table.left_out["first"]) == MOST_SAID
    assert any("39,980 more" in said for said in table.lines)


def test_faults_beside_missing_values_keep_their_places() -> None:
    with pytest.raises(ResultsError) as raised:
        read('winner,loser\n"N\nA",b\nNA,b\n\na,a\nb,NA\nb,\n')
    assert [(each.line, each.column) for each in raised.value.findings] == [(6, 3), (8, 3)]


def test_lines_without_an_observer_beside_named_ones_are_said() -> None:
    assert "no observer" in read("winner,loser,observer\na,b,01\nb,a,\n").lines[0]
    assert read("winner,loser,observer\na,b,\nb,a,\n").lines == ()


def test_readers_that_return_only_comparisons_warn() -> None:
    with pytest.warns(UserWarning, match="1 line was left out"):
        table = parse_table(["winner,loser\n", "a,b\n", "b,a\n", "NA,b\n"], "t.csv")
    assert table.items == ("a", "b")


def test_the_command_names_what_was_left_out(cyclopean: Call) -> None:
    text = PLAIN + WHOLE + "NA,b,01,day,\n"
    assert "standard input:4:1: the winner is 'NA'" in cyclopean("scores", "-", text=text).stdout
    done = cyclopean("scores", "-", "--json", text=text)
    assert "warning: standard input:4:1: the winner is 'NA'" in done.stderr
    assert json.loads(done.stdout)["table"]["left_out"]["lines"] == 1
    kept = cyclopean("scores", "-", "--json", "--keep-na", "--method", "firth", text=text)
    assert {item["name"] for item in json.loads(kept.stdout)["groups"][0]["items"]} == {"a", "b", "NA"}
    assert not kept.stderr


def test_power_names_what_was_left_out(tmp_path: Path) -> None:
    from runner.reports.power_assumed import earlier_answers

    file = tmp_path / "t.csv"
    file.write_text(PLAIN + WHOLE + "NA,b,01,day,\n", "utf-8")
    answers, notes = earlier_answers(file)
    assert answers.items == ("a", "b")
    assert any(f"{file}:4:1: " in note for note in notes)
    assert earlier_answers(file, keep_na=True)[0].items == ("a", "b", "NA")


FRAME = pd.DataFrame({"winner": list("abab"), "loser": list("baba"), "observer": [1, 1, 2, 2]})


@pytest.mark.parametrize("value", [None, np.nan, pd.NA, "NA"])
@pytest.mark.parametrize("column", ["winner", "loser", "observer"])
def test_missing_values_of_frames_are_left_out_with_a_warning(value: object, column: str) -> None:
    last: dict[str, object] = {"winner": "a", "loser": "b", "observer": 1, column: value}
    frame = pd.concat([FRAME.astype(object), pd.DataFrame([last], dtype=object)])
    with pytest.warns(UserWarning, match=rf"6:\d: the {column} is 'NA'"):
        table = notebook.scores(frame)
    assert {item["name"]: item["wins"] for item in table.rows} == {"a": 2, "b": 2}
    with pytest.warns(UserWarning, match="1 line was left out"):
        assert notebook.observers(frame).to_frame()["observer"].tolist() == ["1", "2"]


def test_a_missing_number_does_not_rename_the_others() -> None:
    frame = pd.concat([FRAME, pd.DataFrame({"winner": ["a"], "loser": ["b"], "observer": [np.nan]})])
    with pytest.warns(UserWarning, match="the observer is 'NA'"):
        assert notebook.observers(frame).to_frame()["observer"].tolist() == ["1", "2"]  # not 1.0
    choices = pd.DataFrame({"condition_a": ["x"] * 3, "condition_b": ["y"] * 3, "is_a_selected": [1, 0, np.nan]})
    with pytest.warns(UserWarning, match="the choice is 'NA'"):
        assert len(notebook.scores(choices).rows) == 2


def test_frames_without_missing_values_warn_of_nothing() -> None:
    by_index = notebook.observers(FRAME.set_index("observer"))  # an index with a name is a column too
    assert by_index.to_frame()["observer"].tolist() == ["1", "2"]
    matrix = pd.DataFrame([[np.nan, 3], [2, np.nan]], index=["a", "b"], columns=["a", "b"])
    assert {item["name"]: item["wins"] for item in notebook.scores(matrix).rows} == {"a": 3, "b": 2}
    named = FRAME.replace("a", "None")
    assert {item["name"] for item in notebook.scores(named, keep_na=True).rows} == {"None", "b"}


@pytest.mark.parametrize(
    ("answers", "remedy"),
    [
        (FRAME.set_index(["observer", "winner"]), "reset_index"),
        (FRAME.set_axis(pd.MultiIndex.from_product([["x"], list(FRAME)]), axis=1), "table.columns"),
        (np.ones((3, 3)), "DataFrame"),
        ([("a", "b"), ("b", "a")], "DataFrame"),
        ([{"winner": "a", "loser": "b"}], "DataFrame"),
        ({"winner": ["a"], "loser": ["b"]}, "DataFrame"),
        (FRAME["winner"], "DataFrame"),
        (None, "DataFrame"),
    ],
)
@pytest.mark.parametrize("function", ["scores", "effects", "observers"])
def test_what_is_no_plain_frame_is_refused_in_words(function: str, answers: object, remedy: str) -> None:
    given = {"factors": {"a": {"x": 1.0}, "b": {"x": 2.0}}} if function == "effects" else {}
    with pytest.raises(InputError) as raised:
        getattr(notebook, function)(answers, **given)
    (found,) = raised.value.findings
    assert found.remedy is not None
    assert remedy in found.remedy


def test_every_word_stands_as_a_reader_strips_it() -> None:
    assert all(word == word.strip() and word for word in WORDS)
