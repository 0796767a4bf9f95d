"""Tables of comparisons, our own and other people's: what is read, left out and said."""

from __future__ import annotations

import io
import json
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

import cyclopean as notebook
from analysis.comparisons import (
    Answer,
    Comparisons,
    TableRead,
    from_answers,
    parse_table,
    read_any,
    read_table,
    sources,
)
from analysis.comparisons.layouts import LAYOUTS
from analysis.comparisons.mat_table import MOST_BYTES
from analysis.comparisons.missing import MOST_SAID, WORDS
from analysis.comparisons.sources import MOST_LETTERS
from analysis.comparisons.table import MOST_FINDINGS
from analysis.errors import ResultsError
from cyclopean import scores
from cyclopean.scaling import comparisons
from documents import InputError


# Reading tables of comparisons, and what is said of wrong ones.
def parse(text: str) -> Comparisons:
    return parse_table(text.splitlines(keepends=True), "t.csv")


def findings(text: str) -> list[str]:
    with pytest.raises(ResultsError) as raised:
        parse(text)
    return [str(finding) for finding in raised.value.findings]


def test_two_columns_are_enough() -> None:
    table = parse("winner,loser\na,b\na,b\nb,c\n")
    assert table.items == ("a", "b", "c")
    assert table.wins.tolist() == [[0, 2, 0], [0, 0, 1], [0, 0, 0]]
    assert table.observers == ("",)
    assert table.first_share() is None


def test_all_columns_in_any_order() -> None:
    table = parse('observer,first,count,loser,winner\n01,a,2,b,a\n02,"a, too",0.5,"a, too",b\n\n')
    assert table.items == ("a", "b", "a, too")
    assert table.observers == ("01", "02")
    assert table.wins[0, 1] == 2
    assert table.wins[1, 2] == 0.5
    assert table.first_share() == pytest.approx(2 / 2.5)
    by_observer = table.wins_by_observer()
    assert by_observer[0, 0, 1] == 2
    assert by_observer[1, 1, 2] == 0.5
    assert by_observer.sum(axis=0).tolist() == table.wins.tolist()


def test_a_count_of_zero_names_its_items() -> None:
    table = parse("winner,loser,count\na,b,1\nb,a,1\nc,a,0\n")
    assert table.items == ("a", "b", "c")
    assert table.wins[2].tolist() == [0, 0, 0]


def test_ties_stand_in_lines_or_in_a_column_of_their_own() -> None:
    lines = parse("winner,loser,outcome,first,observer\na,b,win,a,01\nb,a,tie,b,02\na,b, tie ,,02\nb,a,,,02\n")
    counts = parse("winner,loser,count,ties\na,b,1,2\nb,a,1,0\n")
    for table in (lines, counts):
        assert table.wins.tolist() == [[0, 1], [1, 0]]
        assert table.ties == 2
        assert table.tie_counts.tolist() == [[0, 2], [2, 0]]
    assert sorted(zip(lines.tied.item_a.tolist(), lines.tied.a_was_first.tolist(), strict=True)) == [(0, -1), (1, 1)]
    assert [lines.observers[person] for person in lines.tied.observer] == ["02", "02"]


def test_a_pair_that_was_only_tied_is_told_in_ties() -> None:
    table = parse("winner,loser,count,ties\na,b,0,3\nb,c,1,0\n")
    assert table.items == ("a", "b", "c")
    assert table.tie_counts[0, 1] == 3
    assert table.wins.sum() == 1


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(["a", " b", "c ", '"d, e"']),
            st.sampled_from(["f", "g"]),
            st.sampled_from(["0", "1", "2.5", " 1e-3"]),
            st.sampled_from(["01", "02 ", ""]),
            st.sampled_from(["winner", "loser", ""]),
            st.sampled_from(["win", "tie", ""]),
        ),
        max_size=40,
    ),
    st.integers(1, 7),
)
def test_a_table_read_in_blocks_is_what_its_lines_say(rows: list[tuple[str, ...]], block: int) -> None:
    answers = []
    text = "winner,loser,count,observer,first,outcome\n\n"
    for winner, loser, count, observer, place, outcome in rows:
        first = {"winner": winner, "loser": loser, "": ""}[place]
        text += f"{winner},{loser},{count},{observer},{first},{outcome}\n , , , , , \n"
        names = winner.strip(' "'), loser
        shown = None if not place else names[place == "loser"]
        answers.append(Answer(*names, float(count), observer.strip(), shown, outcome == "tie"))
    answers = [*answers, Answer("a", "f", 1.0, "99")]
    slow = from_answers(answers)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sources, "BLOCK_ROWS", block)
        fast = parse(text + "a,f,1,99,,\n")
    assert (fast.items, fast.observers) == (slow.items, slow.observers)
    assert fast.wins == pytest.approx(slow.wins)
    assert fast.tie_counts == pytest.approx(slow.tie_counts)
    assert fast.wins_by_observer() == pytest.approx(slow.wins_by_observer())
    assert fast.first_share() == pytest.approx(slow.first_share())
    assert len(fast.count) <= len(slow.count)


def test_a_byte_order_mark_and_windows_line_ends_do_not_matter(tmp_path: Path) -> None:
    file = tmp_path / "t.csv"
    file.write_bytes("\ufeffwinner,loser\r\né,b\r\n".encode())
    assert read_table(file).items == ("é", "b")


@pytest.mark.parametrize(
    ("text", "finding"),
    [
        ("", "t.csv:1:1: the table is empty (start it with 'winner,loser')"),
        ("winner,looser\na,b\n", "t.csv:1:8: unknown column 'looser' (did you mean 'loser'?)"),
        ("winner,loser,loser\na,b,c\n", "t.csv:1:14: the column 'loser' stands twice (keep one)"),
        ("winner,count\na,1\n", "t.csv:1:1: the column 'loser' is missing (name one of the columns 'loser')"),
        (
            "winner,loser\na,b\na,a\n",
            "t.csv:3:3: 'a' is compared with itself (compare two different items)",
        ),
        ("winner,loser\na,\n", "t.csv:2:3: the loser is empty (name the item)"),
        (
            'winner,loser,count\n"a,1",b,-2\n',
            "t.csv:2:9: the count is '-2' (write a finite number, zero or above)",
        ),
        ("winner,loser,count\na,b,nan\n", "t.csv:2:5: the count is 'nan' (write a finite number, zero or above)"),
        ("winner,loser,count\na,b,inf\n", "t.csv:2:5: the count is 'inf' (write a finite number, zero or above)"),
        ("winner,loser,count\na,b,1_0\n", "t.csv:2:5: the count is '1_0' (write a finite number, zero or above)"),
        ("winner,loser,count\na,b,\n", "t.csv:2:5: the count is '' (write a finite number, zero or above)"),
        ("winner,loser,first\na,b,c\n", "t.csv:2:5: 'c' was first but is not in the pair (write 'a' or 'b')"),
        (
            "winner,loser\na,b,c\n",
            "t.csv:2:5: the line has 3 fields (the header has 2; quote a name with a comma)",
        ),
        (
            "winner,loser\na\n",
            "t.csv:2:1: the line has 1 fields (the header has 2; quote a name with a comma)",
        ),
        (
            "winner,loser\n",
            "t.csv:1:1: the table has no comparison (add one line for each comparison, such as 'a,b')",
        ),
        (
            "winner,loser,outcome\na,b,draw\n",
            "t.csv:2:5: the outcome is 'draw' (write one of: win, tie)",
        ),
        (
            "winner,loser,ties\na,b,-1\n",
            "t.csv:2:5: the number of ties is '-1' (write a finite number, zero or above)",
        ),
        (
            "winner,loser,ties,outcome\na,b,1,tie\n",
            "t.csv:1:14: both 'outcome' and 'ties' give ties (keep one of the two)",
        ),
        (
            'winner,loser\n"a\nb",c\n\nd,d\n',
            "t.csv:5:3: 'd' is compared with itself (compare two different items)",
        ),
        ('winner,loser\n"a,b\n', "t.csv:2:1: this is not valid CSV: unexpected end of data (check the quotes)"),
    ],
)
def test_a_fault_is_named_with_its_place_and_remedy(text: str, finding: str) -> None:
    assert findings(text) == [finding]


def test_all_faults_are_named_at_once_up_to_a_limit() -> None:
    assert len(findings("winner,loser\na,a\n,b\n")) == 2
    assert len(findings("winner,loser\n" + "a,a\n" * 100)) == MOST_FINDINGS


def test_faults_of_later_blocks_carry_their_places(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sources, "BLOCK_ROWS", 3)
    lines = ["winner,loser,count", *["a,b,1"] * 7, "a,b,x", "", "b,b,1", *["a,b,1"] * 5, "a,,1"]
    told = findings("\n".join(lines) + "\n")
    assert [finding.split(": ")[0] for finding in told] == ["t.csv:9:5", "t.csv:11:3", "t.csv:17:3"]


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(ResultsError, match="there is no such file"):
        read_table(tmp_path / "none.csv")
    with pytest.raises(ResultsError, match=r"it is a folder \(for a folder of sessions: cyclopean report"):
        read_table(tmp_path)
    (tmp_path / "latin.csv").write_bytes("winner,loser\né,b\n".encode("latin-1"))
    with pytest.raises(ResultsError, match="UTF-8"):
        read_table(tmp_path / "latin.csv")


def test_counts_of_some_observers_are_those_of_all_in_blocks() -> None:
    table = from_answers([Answer("ab"[k % 2], "bc"[k % 2], 1 + k, f"{k % 5}") for k in range(12)])
    whole = table.wins_by_observer()
    blocks = [table.wins_by_observer(slice(start, start + 2)) for start in range(0, 5, 2)]
    assert np.concatenate(blocks).tolist() == whole.tolist()
    assert whole.sum(axis=0).tolist() == table.wins.tolist()


# Other people's tables: what is read of each layout, and what is said of wrong ones.

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
    words = PWCMP.replace(",0\n", ",False\n").replace(",1\n", ",TRUE\n")
    assert read(words).comparisons.wins.tolist() == told.wins.tolist()


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


# Missing values in tables: their lines are left out and named, and no item or observer is called "NA".

PLAIN = "winner,loser,observer,scene,first\n"
WHOLE = "a,b,01,day,a\nb,a,02,day,b\n"


def missing_read(text: str, *, keep_na: bool = False, codes: tuple[str, ...] = ()) -> TableRead:
    return read_any(text.splitlines(keepends=True), "t.csv", choice_codes=codes, keep_na=keep_na)


@pytest.mark.parametrize("word", ["NA", "NaN", "None", "null", "#N/A", "#NULL!", ".", "<missing>", " NA "])
@pytest.mark.parametrize(
    ("line", "column"),
    [("{},b,01,day,", 1), ("a,{},01,day,", 3), ("a,b,{},day,", 5), ("a,b,01,{},", 8)],
)
def test_a_line_with_a_word_for_a_missing_value_is_left_out_and_named(word: str, line: str, column: int) -> None:
    table = missing_read(PLAIN + WHOLE + line.format(word) + "\n")
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
    table = missing_read(PLAIN + WHOLE + "na,none,nobody,Nan,na\nNA 2,N,Nil,nights,N\n")
    assert table.comparisons.items == ("a", "b", "na", "none", "NA 2", "N")
    assert (table.warnings, table.left_out) == ((), {})


def test_words_for_missing_values_are_names_when_they_are_to_be() -> None:
    text = PLAIN + WHOLE + "None,a,NA,null,None\n"
    table = missing_read(text, keep_na=True)
    assert table.comparisons.items == ("a", "b", "None")
    assert (table.comparisons.observers, table.comparisons.groups) == (("01", "02", "NA"), ("day", "null"))
    assert table.warnings == ()
    assert missing_read("item_a,item_b,choice\nx,y,x\nx,y,y\nx,y,NA\n", codes=("x", "y", "na")).comparisons.ties == 1


def test_an_unknown_first_is_unknown() -> None:
    told = missing_read("winner,loser,first\na,b,NA\nb,a,b\n")
    assert told.comparisons.winner_was_first.tolist() == [-1, 1]
    assert told.warnings == ()


def test_a_missing_outcome_is_no_win() -> None:
    table = missing_read("winner,loser,outcome\na,b,NA\nb,a,win\na,b,tie\n")
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
    table = missing_read(text)
    assert set(table.comparisons.items) == {"x", "y"}
    assert table.comparisons.wins.tolist() == [[0, 1], [1, 0]]
    assert table.left_out["missing"] == (missing or {"choice": 1, "observer": 1})


def test_a_matrix_may_miss_its_diagonal_and_no_name() -> None:
    assert missing_read(",a,b\na,NA,3\nb,2,NA\n").comparisons.wins.tolist() == [[0, 3], [2, 0]]
    for text in (",a,NA\na,0,3\nNA,2,0\n", ",a,b\na,0,NA\nb,2,0\n"):
        with pytest.raises(ResultsError, match="'NA'"):
            missing_read(text)
    assert missing_read(",a,NA\na,0,3\nNA,2,0\n", keep_na=True).comparisons.items == ("a", "NA")


def test_trials_that_another_program_saved_keep_their_pairs() -> None:
    header = "experiment,observer,kind,first,second,answer,chosen,rejected,catch,group\n"
    text = header + "e,01,all_pairs,None,b,first,None,b,NA,day\ne,01,all_pairs,b,None,first,b,None,NA,day\n"
    assert missing_read(text).comparisons.items == ("None", "b")  # names of a log
    with pytest.raises(ResultsError, match="the group is empty"):
        missing_read(text.replace("NA,day", "NA,NA", 1))


def test_a_column_without_any_value_is_named() -> None:
    with pytest.raises(ResultsError, match=r"t\.csv:2:5: the observer is missing in every line") as raised:
        missing_read("winner,loser,observer\na,b,NA\nb,a,NaN\n")
    assert "--keep-na" in str(raised.value)


def test_many_lines_are_counted_and_the_first_named() -> None:
    table = missing_read("winner,loser\na,b\nb,a\n" + "NA,b\n" * 40_000)
    assert table.left_out["lines"] == 40_000
    assert len(table.left_out["first"]) == MOST_SAID
    assert any("39,980 more" in said for said in table.lines)


def test_faults_beside_missing_values_keep_their_places() -> None:
    with pytest.raises(ResultsError) as raised:
        missing_read('winner,loser\n"N\nA",b\nNA,b\n\na,a\nb,NA\nb,\n')
    assert [(each.line, each.column) for each in raised.value.findings] == [(6, 3), (8, 3)]


def test_lines_without_an_observer_beside_named_ones_are_said() -> None:
    assert "no observer" in missing_read("winner,loser,observer\na,b,01\nb,a,\n").lines[0]
    assert missing_read("winner,loser,observer\na,b,\nb,a,\n").lines == ()


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
    from extensions.power.assumed import earlier_answers

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
