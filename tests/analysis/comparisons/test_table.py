"""Reading tables of comparisons, and what is said of wrong ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.comparisons import Answer, Comparisons, from_answers, parse_table, read_table, sources
from analysis.comparisons.table import MOST_FINDINGS
from analysis.errors import ResultsError


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
