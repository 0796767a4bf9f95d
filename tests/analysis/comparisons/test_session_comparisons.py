"""From sessions to comparisons, in the groups that they fall into."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.comparisons import (
    Answer,
    Comparisons,
    SessionGroups,
    from_answers,
    from_sessions,
    grouped_comparisons,
    parse_table,
    split_groups,
    without_groups,
)
from analysis.errors import ResultsError
from analysis.kinds import Trial
from analysis.records import SessionLog
from tests.answers import altered, changed, new_answer, refusal

# From sessions to comparisons, and what must not be mixed.

Maker = Callable[..., SessionLog]


def test_each_observers_answers_are_counted_and_kept_apart(make_session: Maker) -> None:
    sessions = [
        make_session("01", names="abc", answers=[("b", "a"), ("b", "c"), ("a", "c")]),
        make_session("02", names="abc", answers=[("a", "b"), ("b", "c")], complete=False),
    ]
    comparisons = from_sessions(sessions)
    assert comparisons.items == ("a", "b", "c")
    assert comparisons.wins.tolist() == [[0, 1, 1], [1, 0, 2], [0, 0, 0]]
    assert comparisons.observers == ("01", "02")
    assert comparisons.wins_by_observer()[1].tolist() == [[0, 1, 0], [0, 0, 1], [0, 0, 0]]


def test_stimuli_that_no_pair_shows_are_no_items(make_session: Maker) -> None:
    assert from_sessions([make_session(names="abcd", answers=[("d", "b")])]).items == ("b", "d")


def test_a_trial_may_name_the_group_of_its_pair(make_session: Maker) -> None:
    session = make_session(names="abcd", answers=[("a", "b"), ("d", "c")])
    assert from_sessions([session]).groups == ()
    trials = [
        changed(trial, data={**trial.details(), "group": name})
        for trial, name in zip(session.trials, "xy", strict=True)
    ]
    comparisons = from_sessions([replace(session, records=tuple(trials))])
    assert comparisons.groups == ("x", "y")
    assert comparisons.group.tolist() == [0, 1]


@pytest.mark.parametrize(
    ("kind", "data"), [("questionnaire", {"text": "fine"}), ("preference", {"chosen": "a", "rejected": "b"})]
)
def test_other_kinds_of_trials_are_not_mixed_in(make_session: Maker, kind: str, data: dict[str, str]) -> None:
    session = make_session(names="ab", answers=[("a", "b")])
    other = new_answer(2, 0, kind, (), 1.0, data=data)
    assert from_sessions([replace(session, records=(*session.trials, other))]).wins.sum() == 1


def test_the_share_of_the_first_position_counts_answers(make_session: Maker) -> None:
    session = make_session(names="ab", answers=[("a", "b")] * 40)
    firsts = sum(trial.details()["first"] == "a" for trial in session.trials)
    assert 0 < firsts < 40
    assert from_sessions([session]).first_share() == firsts / 40


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"experiment": "gloss"}, "'gloss'"),
        ({"names": ("1.1 mono", "other")}, "same stimuli"),
        ({"observer": "01"}, "would count twice"),
    ],
)
def test_what_does_not_belong_together_is_refused(make_session: Maker, change: dict[str, Any], what: str) -> None:
    with pytest.raises(ResultsError, match=what):
        from_sessions([make_session("01"), make_session(**{"observer": "02", **change})])


def test_the_folder_of_one_of_two_experiments_is_named(make_session: Maker) -> None:
    other = make_session("02", experiment="gloss")
    for file, remedy in (
        (Path("results/gloss/sub-02/ses-x/session.jsonl"), "at a time: name its folder, such as results/gloss"),
        (Path("copied/session.jsonl"), "report one experiment at a time"),
    ):
        with pytest.raises(ResultsError) as error:
            from_sessions([make_session("01"), replace(other, file=file)])
        assert str(error.value.findings[0].remedy).endswith(remedy)


def test_no_session_and_no_answer_are_refused(make_session: Maker) -> None:
    with pytest.raises(ResultsError, match="no session"):
        from_sessions([])
    with pytest.raises(ResultsError, match="no paired comparison"):
        from_sessions([make_session(answers=[])])


@pytest.mark.parametrize(
    ("damage", "what"),
    [
        ({"first": "x", "second": "a", "answer": "first", "chosen": "x", "rejected": "a"}, "'x', which is no stimulus"),
        ({"first": "a", "second": "a"}, "compares 'a' with 'a'"),
        ({"chosen": None}, "is chosen"),
    ],
)
def test_a_damaged_answer_is_refused(make_session: Maker, tmp_path: Path, damage: dict[str, Any], what: str) -> None:
    assert what in str(refusal(make_session(names="ab", answers=[("a", "b")]), tmp_path, **damage))


def _with(session: SessionLog, *more: dict[str, Any]) -> SessionLog:
    first = len(session.answers)
    trials = [
        new_answer(
            1,
            first + number,
            "all_pairs",
            (("up", 1.0),),
            1.0,
            "2026-01-02T03:04:05Z",
            {"first": "a", "second": "b", **data},
        )
        for number, data in enumerate(more)
    ]
    return replace(session, records=(*session.answers, *trials))


def test_ties_are_left_out_of_the_wins_and_counted(make_session: Maker) -> None:
    plain = make_session(names="ab", answers=[("a", "b"), ("b", "a")])
    assert from_sessions([plain]).ties == 0
    comparisons = from_sessions([_with(plain, {"answer": "no_difference"}, {"answer": "not_sure"})])
    assert comparisons.ties == 2
    assert comparisons.wins.tolist() == [[0, 1], [1, 0]]


def test_ties_alone_are_no_comparison(make_session: Maker) -> None:
    with pytest.raises(ResultsError, match="the one answer prefers neither"):
        from_sessions([_with(make_session(names="ab", answers=[]), {"answer": "not_sure"})])


def test_catch_trials_are_left_out(make_session: Maker) -> None:
    plain = make_session(names="ab", answers=[("a", "b")])
    obvious = {"answer": "first", "chosen": "a", "rejected": "b", "catch": "obvious", "correct": True}
    identical = {"second": "a", "answer": "first", "catch": "identical"}
    comparisons = from_sessions([_with(plain, obvious, identical, {**identical, "answer": "not_sure"})])
    assert comparisons.wins.tolist() == [[0, 1], [0, 0]]
    assert comparisons.ties == 0


# The groups that the comparisons of an experiment fall into, and those that are linked after all.

FACTORS: Mapping[str, Mapping[str, Any]] = {
    f"{scene}-{codec}": {"image": f"{scene}-{codec}", "codec": codec, "scene": scene}
    for scene in ("beach", "church", "dune")
    for codec in ("jpeg", "avif")
}
WITHIN = [(f"{scene}-jpeg", f"{scene}-avif") for scene in ("beach", "church", "dune")]


def study(
    make_session: Maker,
    pairs: Sequence[tuple[str, str]],
    *,
    block: Callable[[int], int] = lambda number: 1,
    labels: Sequence[str | None] | None = None,
    factors: Mapping[str, Mapping[str, Any]] = FACTORS,
) -> SessionLog:
    """Return a session with an answer for each pair; ``labels`` are what the trials say of their groups."""
    session = make_session(names=list(factors), answers=pairs)
    stimuli = tuple({**stimulus.given(), "factors": factors[stimulus.name]} for stimulus in session.header.stimuli)
    trials = []
    for number, trial in enumerate(session.trials):
        label = labels[number] if labels else None
        group = {} if label is None else {"group": label, "group_factor": "scene"}
        trials.append(changed(trial, block=block(number), data={**trial.details(), **group}))
    return replace(session, header=altered(session.header, stimuli=stimuli), records=tuple(trials))


def groups_of(session: SessionLog) -> SessionGroups:
    """Return the groups, which there must be."""
    _, groups = grouped_comparisons([session])
    assert groups is not None
    return groups


def test_pairs_within_scenes_make_a_group_of_each(make_session: Maker) -> None:
    session = study(make_session, WITHIN * 2, labels=["beach", "church", "dune"] * 2)
    comparisons, groups = grouped_comparisons([session])
    assert comparisons.groups == ("beach", "church", "dune")
    assert [comparisons.items[number][:3] for number in comparisons.winner] == ["bea", "chu", "dun"] * 2
    assert comparisons.group.tolist() == [0, 1, 2] * 2
    assert groups is not None
    assert groups.factor == "scene"
    assert groups.group_of == {name: name.split("-")[0] for name in FACTORS}
    assert groups.sentence.startswith("Only stimuli with the same scene were compared (3 groups: beach, church, dune).")


def test_pairs_between_scenes_leave_one_scale(make_session: Maker) -> None:
    links = [("beach-jpeg", "church-jpeg"), ("church-jpeg", "dune-jpeg")]
    session = study(make_session, WITHIN + links, labels=["beach", "church", "dune", None, None])
    comparisons, groups = grouped_comparisons([session])
    assert groups is None
    assert comparisons.groups == ()


def test_another_block_links_some_of_the_scenes(make_session: Maker) -> None:
    pairs = [*WITHIN, ("beach-jpeg", "dune-jpeg")]
    session = study(make_session, pairs, labels=["beach", "church", "dune", None], block=lambda n: n // 3)
    groups = groups_of(session)
    assert groups.factor is None
    assert groups.names == ("beach + block 2 + dune", "church")


@pytest.mark.parametrize("first", ["codec", "scene"])
def test_blocks_of_other_stimuli_are_told_apart_by_a_factor(make_session: Maker, first: str) -> None:
    """Results from before trials named their group, or two blocks that the experiment lists stimuli for."""
    pairs = WITHIN[:2] if first == "scene" else [("beach-jpeg", "church-jpeg"), ("beach-avif", "church-avif")]
    groups = groups_of(study(make_session, pairs, block=lambda number: number + 3))
    assert groups.factor == first
    assert groups.names == tuple(pair[0].split("-")[first == "codec"] for pair in pairs)


def test_blocks_that_no_factor_tells_apart_are_named_by_number(make_session: Maker) -> None:
    pairs = [("beach-jpeg", "church-avif"), ("beach-avif", "church-jpeg")]
    groups = groups_of(study(make_session, pairs, block=lambda number: number + 3))
    assert groups.factor is None
    assert groups.names == ("block 4", "block 5")
    assert "they fall into 2 groups, named by block: block 4, block 5." in groups.sentence


def test_answers_that_are_missing_make_no_groups(make_session: Maker) -> None:
    """One block compares all its stimuli: a session that ended early is no study of two groups."""
    session = study(make_session, [("beach-jpeg", "beach-avif"), ("dune-jpeg", "dune-avif")])
    assert grouped_comparisons([session])[1] is None
    assert from_sessions([session]).groups == ()


def test_two_sets_of_one_scene_have_names_of_their_own(make_session: Maker) -> None:
    factors = {name: {"scene": "church"} for name in "abcd"}
    pairs = [("a", "b"), ("c", "d")]
    session = study(make_session, pairs, labels=["church"] * 2, block=lambda number: number, factors=factors)
    assert groups_of(session).names == ("church (a)", "church (c)")


def test_the_factor_that_the_experiment_named_comes_before_others(make_session: Maker) -> None:
    factors = {name: {"light": name[0], "scene": f"{name[0]}!"} for name in ("a1", "a2", "b1", "b2")}
    session = study(make_session, [("a1", "a2"), ("b1", "b2")], labels=["a!", "b!"], factors=factors)
    assert groups_of(session).factor == "scene"


def test_levels_that_are_numbers_are_named_as_words(make_session: Maker) -> None:
    factors = {f"{name}{level}": {"exposure_s": level} for level in (1.5, 2) for name in "ab"}
    session = study(make_session, [("a1.5", "b1.5"), ("a2", "b2")], labels=["1.5", "2"], factors=factors)
    assert groups_of(session).names == ("1.5", "2")


def test_ties_link_the_stimuli_of_a_scene(make_session: Maker) -> None:
    session = study(make_session, WITHIN, labels=["beach", "church", "dune"])
    tie = session.trials[0]
    tied: Trial = changed(tie, data={k: v for k, v in tie.details().items() if k not in ("chosen", "rejected")})
    tied = changed(tied, data={**tied.details(), "answer": "no_difference"})
    comparisons = from_sessions([replace(session, records=(tied, *session.trials[1:]))])
    assert set(comparisons.groups) == {"beach", "church", "dune"}
    assert comparisons.ties == 1


# Answers within groups: the table's column, the answers of each group, and the records of sessions.
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
