"""Other people's tables: what is read of each layout, and what is said of wrong ones."""

from __future__ import annotations

import io
import json
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from analysis.comparisons import TableRead, read_any
from analysis.comparisons.layouts import LAYOUTS
from analysis.comparisons.mat_table import MOST_BYTES
from analysis.comparisons.sources import MOST_LETTERS
from analysis.errors import ResultsError
from cyclopean import scores
from cyclopean.scaling import comparisons

Call = Callable[..., subprocess.CompletedProcess[str]]

PWCMP = (
    "observer,session_id,scene,condition_B,condition_A,is_A_selected\n"
    "M01,1,window,b,a,0\nM01,1,beach,b,a,1\nM02,3,window,b,a,1\n"
)


def read(text: str, layout: str | None = None, codes: Sequence[str] = ()) -> TableRead:
    return read_any(text.splitlines(keepends=True), "t.csv", layout=layout, choice_codes=codes)


def finding(text: str, layout: str | None = None, codes: Sequence[str] = ()) -> str:
    with pytest.raises(ResultsError) as raised:
        read(text, layout, codes)
    return str(raised.value.findings[0])


def test_a_table_of_pwcmp() -> None:
    table = read(PWCMP)
    told = table.comparisons
    assert (table.layout, table.notes) == ("pwcmp", ("columns that were not read: session_id",))
    assert (told.items, told.observers, told.groups) == (("b", "a"), ("M01", "M02"), ("window", "beach"))
    assert told.wins.tolist() == [[0, 1], [2, 0]]
    assert told.wins_by_observer()[1].tolist() == [[0, 0], [1, 0]]
    assert told.group.tolist() == [0, 1, 0]


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        ("item_a,item_b,choice\nx,y,x\nx,y,y\ny,x,x\nx,y,tie\n", ()),
        ("item_a,item_b,choice\nx,y,a\nx,y,b\ny,x,B\nx,y,tie\n", ()),
        ("Condition_1,Condition_2,Selection\nx,y,1\nx,y,2\ny,x,2\nx,y,neither\n", ()),
        ("left,right,response\nx,y,left\nx,y,right\ny,x,right\nx,y,equal\n", ()),
        ("item_a,item_b,choice\nx,y,0\nx,y,1\ny,x,1\nx,y,2\n", ("0", "1", "2")),
        ("choice,item_b,item_a\n0,y,x\n1,y,x\n1,x,y\n2,y,x\n", ("0", "1", "2")),
    ],
)
def test_tables_of_choices_between_two_items(text: str, codes: tuple[str, ...]) -> None:
    table = read(text, codes=codes)
    assert table.layout == "items"
    place = {item: number for number, item in enumerate(table.comparisons.items)}
    assert table.comparisons.wins[place["x"], place["y"]] == 2
    assert table.comparisons.wins[place["y"], place["x"]] == 1
    assert table.comparisons.ties == 1


def test_what_was_chosen_of_three_won_twice() -> None:
    table = read("participant,option_1,option_2,option_3,choice\n01,a,b,c,b\n01,a,b,,1\n02,c,a,b,option_3\n")
    assert table.layout == "options"
    assert table.comparisons.items == ("b", "a", "c")
    assert table.comparisons.wins.tolist() == [[0, 2, 2], [1, 0, 0], [0, 0, 0]]
    assert table.notes == ("what was chosen counts as preferred over each other option of its line",)


def test_a_matrix_is_in_the_order_of_its_header() -> None:
    table = read(",a,b,c\nc,1,2,0\na,0,5,6\nb,7,,8.5\n")
    assert (table.layout, table.comparisons.items) == ("matrix", ("a", "b", "c"))
    assert table.comparisons.wins.tolist() == [[0, 5, 6], [7, 0, 8.5], [1, 2, 0]]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (PWCMP + "M02,3,window,b,a\n", "t.csv:5:16: the line has 5 fields (the header has 6; quote"),
        (PWCMP + "M02,3,window,b,a,2\n", "t.csv:5:18: the choice is '2' (write one of: 1, true, 0, false)"),
        (PWCMP + 'M02,3,"a\nroom",b,a,1\nM02,3,window,b,b,1\n', "t.csv:7:14: 'b' is compared with itself"),
        (PWCMP + "M02,3,window,b,b,1\n", "t.csv:5:14: 'b' is compared with itself"),
        (PWCMP + "M02,3,,b,a,1\n", "t.csv:5:7: the group is empty"),
        ("item_a,item_b,choice\nx,y,1\n", "t.csv:2:5: the choice is '1' (write 'x' or 'y', or say what it stands for"),
        ("item_a,item_b,choice\nb,a,a\n", "t.csv:2:5: the choice 'a' is the name of one item and the column of"),
        ("item_a,item_b,choice\nx,,x\n", "t.csv:2:1: fewer than two items are named (name what was shown)"),
        ("item_a,item_b,choice\nx,y,\n", "t.csv:2:5: the choice is '' (write 'x' or 'y'"),
        ("item_a,item_b,choice,answer\nx,y,x,x\n", "t.csv:1:22: 'choice' and 'answer' both name the choice"),
        ("item_a,item_b,choice,choice\nx,y,x,x\n", "t.csv:1:22: the column 'choice' stands twice (keep one)"),
        ("option_1,option_2,option_3,choice\na,b,c,tie\n", "t.csv:2:7: the choice among 3 is a tie (leave"),
        (
            "condition_a,condition_b,is_a_selected,choice\na,b,1,a\n",
            "t.csv:1:1: the header is one of 'pwcmp' and 'items'",
        ),
        ("winner,loser,item_a,item_b,choice\n", "t.csv:1:1: the header is one of 'winner-loser' and 'items'"),
        (",a,b\na,0,1\nb,2\n", "t.csv:3:3: the line has 2 fields (the header has 3; the matrix must be square)"),
        (",a,b\na,0,1\n", "t.csv:2:1: 'b' has no line (give each item of the header a line"),
        (",a,b\na,0,1\na,0,1\n", "t.csv:3:1: 'a' has two lines (keep one line for each item)"),
        (",a,a\na,0,1\n", "t.csv:1:4: the column 'a' stands twice"),
        (",a,b\na,0,1\nc,2,0\n", "t.csv:3:1: 'c' is not in the header"),
        (",a,b\na,0,-1\nb,2,0\n", "t.csv:2:5: the count is '-1' (write a finite number, zero or above"),
        (",a,b\na,0,nan\nb,2,0\n", "t.csv:2:5: the count is 'nan'"),
        (",a,b\na,0,\nb,2,0\n", "t.csv:2:5: the count is ''"),
        (",a,b\na,4,1\nb,2,0\n", "t.csv:2:3: 'a' was preferred over itself '4' times (write 0)"),
        (",a,b\na,0,0\nb,0,0\n", "t.csv:3:1: the table has no comparison"),
        (",a,\na,0,0\nb,0,0\n", "t.csv:1:4: an item has no name (name the item)"),
    ],
)
def test_what_is_wrong_is_named_with_its_place(text: str, expected: str) -> None:
    assert finding(text).startswith(expected)


def test_a_layout_that_was_asked_for() -> None:
    assert finding(PWCMP, "matrix") == (
        "t.csv:1:1: the header is not one of the layout 'matrix' (its columns are names in the header and in the first "
        "column)"
    )
    assert "there is no layout 'pwcm' (did you mean 'pwcmp'?)" in finding(PWCMP, "pwcm")
    both = "condition_a,condition_b,is_a_selected,choice\na,b,0,a\n"
    assert read(both, "pwcmp").comparisons.items == ("b", "a")
    assert read(both, "items").comparisons.items == ("a", "b")
    assert "unknown column 'scene'" not in finding("winner,looser,scene\na,b,c\n")
    assert finding("item_a,item_b,choice\nx,y,1\n", codes=("1",)).startswith(
        "t.csv:1:1: 1 texts for the choice among 2"
    )
    assert list(LAYOUTS) == ["winner-loser", "pwcmp", "items", "options", "matrix", "trials"]


def test_a_line_without_end_is_refused() -> None:
    endless = io.BytesIO(b"winner,loser\n" + b"a," * MOST_LETTERS)
    with pytest.raises(ResultsError, match=r"a line has more than 4 million letters"):
        read_any(endless, "t.csv")


def test_matrices_of_mat_files(tmp_path: Path) -> None:
    counts = np.array([[0.0, 3, 1], [2, 0, 4], [0, 5, 0]])
    file = tmp_path / "t.mat"
    savemat(file, {"D": counts, "names": np.array(["a", "b", "c"], dtype=object)}, do_compression=True)
    table = read_any(file)
    assert (table.layout, table.comparisons.items) == ("matrix", ("a", "b", "c"))
    assert table.comparisons.wins.tolist() == counts.tolist()
    by_observer = np.stack([counts, 2 * counts.T])
    savemat(file, {"MM": np.stack([one.ravel(order="F") for one in by_observer])})
    told = read_any(file).comparisons
    assert told.items == ("1", "2", "3")
    assert told.wins_by_observer().tolist() == by_observer.tolist()


@pytest.mark.parametrize(
    ("variables", "message"),
    [
        ({"D": np.ones((2, 3))}, r"D is 2 by 3 \(give a square matrix of 2 to 5000 items\)"),
        ({"MM": np.ones((2, 3))}, r"MM is 2 by 3 \(give n² columns for n items"),
        ({"D": np.array([[0, -1.0], [1, 0]])}, r"D, row 1, column 2: the count is -1 \(write a finite number"),
        ({"D": np.array([[0, np.nan], [1, 0]])}, "D, row 1, column 2: the count is nan"),
        ({"D": np.eye(2)}, r"D, row 1, column 1: the count is 1 \(write 0\)"),
        ({"D": np.zeros((2, 2))}, "the matrix D has no comparison"),
        ({"D": "text"}, "D is no matrix of numbers"),
        ({"D": np.zeros((2, 2)), "wins": np.zeros((2, 2))}, "there are two matrices: D and wins"),
        ({"X": np.zeros((2, 2))}, "there is no matrix of counts"),
        ({"D": 1 - np.eye(2), "C": np.array(["a", "a"], dtype=object)}, "there are 1 different names of 2 items"),
    ],
)
def test_mat_files_that_are_wrong(variables: dict[str, object], message: str, tmp_path: Path) -> None:
    savemat(tmp_path / "t.mat", variables)
    with pytest.raises(ResultsError, match=message):
        read_any(tmp_path / "t.mat")


def test_a_mat_file_of_more_than_100_mb_is_refused(tmp_path: Path) -> None:
    with (tmp_path / "t.mat").open("wb") as file:
        file.truncate(MOST_BYTES + 1)
    with pytest.raises(ResultsError, match="100 MB"):
        read_any(tmp_path / "t.mat")


def test_data_frames_of_any_layout() -> None:
    pairs = pd.DataFrame({"item_a": list("abab"), "item_b": list("baba"), "choice": [1, 1, 1, 2]})
    told = scores(pairs, choice_codes=("1", "2")).to_frame().set_index("name")
    assert told["wins"].to_dict() == {"a": 3, "b": 1}
    rows = pd.DataFrame({"item_a": list("aa"), "item_b": list("ba"), "choice": list("aa"), "scene": ["a\nroom", "x"]})
    with pytest.raises(ResultsError) as raised:
        scores(rows)
    assert raised.value.findings[0].line == 4  # as in the CSV that it would be
    matrix = pd.DataFrame([[0, 3], [1, 0]], index=["a", "b"], columns=["a", "b"])
    assert scores(matrix).to_frame().set_index("name")["wins"].to_dict() == {"a": 3, "b": 1}


IN_COLUMNS = (
    "observer,item_a,item_b,choice\n01,x,y,x\n02,x,z,b\n,y,z,tie\n01,z,x,A\n01, y ,x, y\n",
    "group,left,right,response\nday,y,x,left\nday,x,z,right\nnight,z,y,equal\n",
    "option_1,option_2,option_3,choice\nx,y,z,y\nz,,y,1\nx,NA,z,option_3\nx,z,,z\n",
    "experiment,observer,kind,first,second,answer,chosen,rejected,catch,group,simulated\ne,01,instructions,,,,,,,,\n"
    "e,01,all_pairs,a,b,first,a,b,,day,False\ne,01,all_pairs,b,a,first,b,a,repeat,day,False\n"
    ",,,,,,,,,,\ne,02,all_pairs,c,a,not_sure,,,,day,False\n",
)


@pytest.mark.parametrize("text", IN_COLUMNS)
@pytest.mark.filterwarnings("ignore:.*left out")
def test_frames_of_choices_and_of_trials_are_read_by_column_as_their_lines_are(
    monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    frame = pd.read_csv(io.StringIO(text), dtype=str, keep_default_na=False)
    lines = read(text)
    if not text.startswith("experiment"):  # which has a row without texts: it is looked at by itself
        monkeypatch.setattr(
            "analysis.comparisons.sources.ColumnBlock.rows", property(lambda block: pytest.fail("a row"))
        )
    columns = comparisons(frame)
    told = lines.comparisons
    assert (columns.items, columns.observers, columns.groups) == (told.items, told.observers, told.groups)
    for name in ("winner", "loser", "observer", "group", "count", "winner_was_first"):
        assert getattr(columns, name).tolist() == getattr(told, name).tolist()
    assert columns.tied.count.tolist() == told.tied.count.tolist()


def test_the_command_says_how_a_table_was_read(cyclopean: Call) -> None:
    text = PWCMP + "M02,3,beach,b,a,0\n"
    told = json.loads(cyclopean("scores", "-", "--json", text=text).stdout)
    assert told["table"] == {"layout": "pwcmp", "notes": ["columns that were not read: session_id"]}
    assert "the table's layout: pwcmp" in cyclopean("scores", "-", text=text).stdout
    plain = json.loads(cyclopean("scores", "-", "--json", text="winner,loser\na,b\nb,a\n").stdout)
    assert "table" not in plain
    numbers = "item_a,item_b,choice\nx,y,0\nx,y,1\n"
    assert cyclopean("scores", "-", "--choice-codes", "0,1", text=numbers).stdout.splitlines()[0].endswith("items")
    done = cyclopean("scores", "-", "--layout", "matrix", text=numbers, expect=2)
    assert "the header is not one of the layout 'matrix'" in done.stderr


def _trials(*lines: str) -> list[str]:
    return ["experiment,observer,kind,first,second,answer,chosen,rejected,catch,group", *lines]


def test_trials_give_their_paired_choices_ties_and_groups() -> None:
    read = read_any(
        _trials(
            "e,01,instructions,,,,,,,",
            "e,01,all_pairs,a,b,first,a,b,,day",
            "e,01,all_pairs,b,a,first,b,a,repeat,day",
            "e,02,all_pairs,a,b,not_sure,,,,day",
        ),
        "t.csv",
    )
    assert read.layout == "trials"
    assert read.comparisons.wins.tolist() == [[0, 1], [0, 0]]
    assert read.comparisons.ties == 1
    assert read.comparisons.observers == ("01", "02")


@pytest.mark.parametrize(
    ("line", "place"),
    [
        ("e,01,all_pairs,a,b,first,a,,,day", (2, 28)),
        ("e,01,all_pairs,a,b,first,a,b,,", (2, 31)),
        ("e,01", (2, 3)),
    ],
)
def test_faults_of_trials_have_their_place(line: str, place: tuple[int, int]) -> None:
    with pytest.raises(ResultsError) as caught:
        read_any(_trials(line), "t.csv")
    (found,) = caught.value.findings
    assert (found.line, found.column) == place
