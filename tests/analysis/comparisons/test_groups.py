"""Answers within groups: the table's column, the answers of each group, and the records of sessions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.comparisons import Answer, Comparisons, from_answers, parse_table, split_groups, without_groups
from analysis.errors import ResultsError


def parse(text: str) -> Comparisons:
    return parse_table(text.splitlines(keepends=True), "t.csv")


def spoken(comparisons: Comparisons) -> list[tuple[str, str, str, float, int, bool]]:
    """Each kind of answer by name, sorted."""
    tied = comparisons.tied
    kinds = [
        (comparisons.winner, comparisons.loser, comparisons.observer, comparisons.count, comparisons.winner_was_first),
        (tied.item_a, tied.item_b, tied.observer, tied.count, tied.a_was_first),
    ]
    return sorted(
        (comparisons.items[i], comparisons.items[j], comparisons.observers[o], float(c), int(f), bool(tie))
        for tie, columns in enumerate(kinds)
        for i, j, o, c, f in zip(*columns, strict=True)
    )


@pytest.mark.parametrize("name", ["group", "scene", "content"])
def test_the_column_of_groups_has_three_names(name: str) -> None:
    table = parse(f"winner,loser,{name},outcome\na,b, church ,\nb,a,church,\na,b,beach,tie\n")
    assert table.groups == ("church", "beach")
    assert table.group.tolist() == [0, 0]
    assert table.tied.group.tolist() == [1]


def test_without_the_column_there_are_no_groups() -> None:
    table = parse("winner,loser,outcome\na,b,\nb,a,tie\n")
    assert table.groups == ()
    assert table.group.tolist() == table.tied.group.tolist() == [0]
    assert split_groups(table) == ()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("winner,loser,scene,group\na,b,1,1\n", "t.csv:1:20: both 'scene' and 'group' name the group"),
        ("winner,loser,Scenes\na,b,1\n", "t.csv:1:14: unknown column 'Scenes'"),
        ("winner,loser,scene,scene\na,b,1,1\n", "t.csv:1:20: the column 'scene' stands twice"),
        ("winner,loser,scene\na,b,1\na,b, \n", "t.csv:3:5: the group is empty"),
        ("winner,loser,scene,count\na,b,1,1\na,b,,0\n", "t.csv:3:5: the group is empty"),
    ],
)
def test_wrong_groups_have_a_place_and_a_remedy(text: str, said: str) -> None:
    with pytest.raises(ResultsError) as raised:
        parse(text)
    (finding,) = raised.value.findings
    assert str(finding).startswith(said)
    assert finding.remedy


def test_a_group_is_named_by_an_answer_that_counts() -> None:
    assert parse("winner,loser,scene,count\na,b,one,0\na,b,two,1\n").groups == ("two",)


GROUPS = st.sampled_from(["x", "y", "z", ""])
ANSWERS = st.lists(
    st.builds(
        Answer,
        st.sampled_from("ab"),
        st.sampled_from("cd"),
        st.sampled_from([0.0, 1.0, 2.5]),
        st.sampled_from(["01", "02", "03"]),
        st.sampled_from([None, "a", "c"]),
        st.booleans(),
        GROUPS,
    ),
    max_size=12,
)


@settings(max_examples=80, deadline=None)
@given(ANSWERS)
def test_each_group_has_its_answers_and_nothing_else(answers: list[Answer]) -> None:
    whole = from_answers(answers)
    parts = dict(split_groups(whole))
    assert list(parts) == list(whole.groups)
    for name, part in parts.items():
        own = [answer for answer in answers if answer.group == name and answer.count]
        assert spoken(part) == spoken(from_answers(own))
        assert set(part.items) == {item for answer in own for item in (answer.winner, answer.loser)}
        assert list(part.items) == [item for item in whole.items if item in part.items]
        assert set(part.observers) == {answer.observer for answer in own}
        assert part.groups == ()
        assert part.group.shape == part.winner.shape
    assert spoken(without_groups(whole)) == spoken(whole)
    assert without_groups(whole).groups == ()


def test_answers_between_groups_belong_to_none() -> None:
    whole = from_answers([Answer("a", "b", group="x"), Answer("a", "c")])
    assert whole.groups == ("x",)
    assert whole.group.tolist() == [0, -1]
    assert [(name, part.items) for name, part in split_groups(whole)] == [("x", ("a", "b"))]


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(st.sampled_from("ab"), st.sampled_from("cd"), st.sampled_from("xyz")), min_size=1))
def test_a_table_and_its_answers_are_the_same(rows: list[tuple[str, str, str]]) -> None:
    table = parse("winner,loser,group\n" + "".join(f"{','.join(row)}\n" for row in rows))
    answers = from_answers([Answer(winner, loser, group=group) for winner, loser, group in rows])
    assert table.groups == answers.groups
    summed: list[dict[tuple[str, str, str], float]] = [{}, {}]
    for counts, source in zip(summed, (table, answers), strict=True):
        for winner, loser, group, count in zip(source.winner, source.loser, source.group, source.count, strict=True):
            key = (source.items[winner], source.items[loser], source.groups[group])
            counts[key] = counts.get(key, 0) + float(count)
    assert summed[0] == summed[1]
    assert np.array_equal(table.wins, answers.wins)
