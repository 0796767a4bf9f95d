"""Reading tables of comparisons, and what is said of wrong ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from analysis.comparison_table import MOST_FINDINGS, parse_table, read_table
from analysis.comparisons import Comparisons
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
            "t.csv:2:5: the line has 3 fields (the header has 2; quote a name that holds a comma)",
        ),
        (
            "winner,loser\na\n",
            "t.csv:2:1: the line has 1 fields (the header has 2; quote a name that holds a comma)",
        ),
        (
            "winner,loser\n",
            "t.csv:1:1: the table holds no comparison (add one line for each comparison, such as 'a,b')",
        ),
        ('winner,loser\n"a,b\n', "t.csv:2:1: this is not valid CSV: unexpected end of data (check the quotes)"),
    ],
)
def test_a_fault_is_named_with_its_place_and_remedy(text: str, finding: str) -> None:
    assert findings(text) == [finding]


def test_all_faults_are_named_at_once_up_to_a_limit() -> None:
    assert len(findings("winner,loser\na,a\n,b\n")) == 2
    assert len(findings("winner,loser\n" + "a,a\n" * 100)) == MOST_FINDINGS


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(ResultsError, match="there is no such file"):
        read_table(tmp_path / "none.csv")
    with pytest.raises(ResultsError, match="cannot be read"):
        read_table(tmp_path)
    (tmp_path / "latin.csv").write_bytes("winner,loser\né,b\n".encode("latin-1"))
    with pytest.raises(ResultsError, match="UTF-8"):
        read_table(tmp_path / "latin.csv")
