"""Observers in one table: catch trials, filters, groups."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations, product
from typing import Any

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers, from_sessions, split_groups, without_groups
from analysis.errors import ResultsError
from analysis.observers import (
    Filter,
    ObserverTable,
    keep,
    observers_in_comparisons,
    observers_in_sessions,
    passed_screening,
)
from analysis.observers.concordance import kendall_u
from analysis.observers.consistency import circular_triads, consistencies, verdicts
from analysis.observers.responses import CatchAnswers, IdenticalPairs, catch_answers, catch_results, self_agreements
from analysis.observers.table import ObserverLine, fits_to_rest
from analysis.records import SessionLog
from analysis.report.summary import summarise
from tests.answers import changed, new_answer
from tests.kept import known

# All observers in one table: nobody is dropped, whatever they did.

Maker = Callable[..., SessionLog]
Study = Callable[..., Comparisons]
NAMES = "abcdef"


def by_name(table: ObserverTable) -> dict[str, ObserverLine]:
    return {line.name: line for line in table.lines}


def test_each_session_gives_a_line_and_json_without_nan(sessions: list[SessionLog]) -> None:
    table = observers_in_sessions(sessions, shuffles=99)
    assert [line.name for line in table.lines] == [session.header.observer for session in sessions]
    text = json.dumps(table.to_json(), allow_nan=False)
    assert len(json.loads(text)["observers"]) == 20
    for line in table.lines:
        assert (line.answers, line.sessions, line.complete) == (15, 1, 1)
        assert line.consistency
        assert line.fit
        assert line.side
        assert line.times
        assert line.repeats is None
        assert line.screening_passed is None
    assert table.concordance
    assert table.concordance.observers == 20


def test_sessions_and_their_comparisons_say_the_same(sessions: list[SessionLog]) -> None:
    from analysis.comparisons import from_sessions

    one = observers_in_sessions(sessions, shuffles=0)
    other = observers_in_comparisons(from_sessions(sessions), shuffles=0)
    assert one.concordance == other.concordance
    for with_times, without in zip(one.lines, other.lines, strict=True):
        assert with_times.consistency == without.consistency
        assert with_times.fit == without.fit
        assert without.times is None


def test_several_sessions_of_one_observer_are_one_line(make_session: Maker) -> None:
    table = observers_in_sessions(
        [
            make_session("01", names=NAMES),
            make_session("02", names=NAMES),
            make_session("01", names=NAMES, session="later", complete=False),
        ],
        shuffles=0,
    )
    lines = by_name(table)
    assert list(lines) == ["01", "02"]
    assert (lines["01"].sessions, lines["01"].complete, lines["01"].answers) == (2, 1, 30)
    assert lines["01"].repeats
    assert lines["01"].repeats.repeated == 15
    assert "not completed" in lines["01"].flags


def test_who_answered_nothing_or_only_ties_or_little_keeps_a_line(make_session: Maker) -> None:
    ties = replace(
        make_session("03", names=NAMES, answers=[]),
        records=(new_answer(1, 0, "all_pairs", (), 1.0, data={"first": "a", "second": "b", "answer": "not_sure"}),),
    )
    table = observers_in_sessions(
        [
            make_session("01", names=NAMES),
            make_session("02", names=NAMES, answers=[], complete=False),
            ties,
            make_session("04", names=NAMES, answers=[("a", "b")], complete=False),
        ],
        shuffles=9,
    )
    lines = by_name(table)
    assert list(lines) == ["01", "02", "03", "04"]
    assert (lines["02"].answers, lines["02"].times, lines["02"].consistency) == (0, None, None)
    assert (lines["03"].answers, lines["03"].ties, lines["03"].fit) == (0, 1, None)
    assert lines["04"].consistency
    assert lines["04"].consistency.test is None
    json.dumps(table.to_json(), allow_nan=False)


def test_sessions_without_comparisons_leave_the_rest(make_session: Maker) -> None:
    outcome = {"passed": False, "threshold": None, "estimate": None, "pass_mark": 140.0, "unit": "arcsec"}
    screening = new_answer(0, 0, "screening", (), 1.0, data={"test": "stereo_acuity", "outcome": outcome})
    empty = make_session("01", names=NAMES, answers=[])
    tie = {"first": "a", "second": "b", "answer": "not_sure"}
    undecided = replace(
        make_session("02", names=NAMES, answers=[]),
        records=(new_answer(1, 0, "all_pairs", (), 2.0, "2026-01-02T03:04:05Z", tie),),
    )
    table = observers_in_sessions([replace(empty, records=(screening,)), undecided])
    assert table.concordance is None
    assert [line.flags for line in table.lines] == [("failed the vision screening",), ()]
    assert table.lines[1].ties == 1
    assert table.lines[1].times
    assert table.lines[1].times.median_s == 2
    json.dumps(table.to_json(), allow_nan=False)
    with pytest.raises(ResultsError, match="would count twice"):
        observers_in_sessions([empty, empty])
    with pytest.raises(ResultsError, match="no session"):
        observers_in_sessions([])


def test_flags_say_what_to_look_at_and_drop_nobody(make_session: Maker) -> None:
    firm = [(a, b) for a, b in combinations(NAMES, 2)]
    circle = [("a", "b"), ("b", "c"), ("c", "a"), ("d", "a"), ("b", "d"), ("d", "c")]
    circle += [
        ("e", "a"),
        ("b", "e"),
        ("c", "e"),
        ("e", "d"),
        ("a", "f"),
        ("f", "b"),
        ("f", "c"),
        ("d", "f"),
        ("f", "e"),
    ]
    many = [make_session(f"{number:02d}", names=NAMES, answers=firm) for number in range(10)]
    odd = make_session("odd", names=NAMES, answers=circle)
    miss = new_answer(
        9,
        99,
        "all_pairs",
        (),
        0.1,
        "2026-01-02T03:04:05Z",
        {"first": "a", "second": "b", "catch": "obvious", "correct": False},
    )
    hasty = tuple(changed(trial, response_time_s=0.1) for trial in odd.answers)
    table = observers_in_sessions([*many, replace(odd, records=(*hasty, miss))], shuffles=0)
    assert len(table.lines) == 11
    line = by_name(table)["odd"]
    assert table.outliers == ("odd",)
    assert line.flags == (
        "answers unlike the others",
        "no more consistent than chance",
        "missed 1 of 1 catch trials",
        "15 answers below 0.2 s",
    )
    assert by_name(table)["03"].flags == ()


def test_some_circular_triads_are_no_reason_to_doubt(make_session: Maker) -> None:
    firm = [("f", "a") if pair == ("a", "f") else pair for pair in combinations(NAMES, 2)]
    (line,) = observers_in_sessions([make_session("01", names=NAMES, answers=firm)]).lines
    assert line.consistency
    assert line.consistency.circular == 4
    assert line.flags == ()


def test_a_level_is_the_users_choice(study: Study) -> None:
    random = np.random.default_rng(1)
    comparisons = study(np.tile(np.linspace(-1, 1, 5), (8, 1)), random)
    assert observers_in_comparisons(comparisons, level=1.0, shuffles=0).outliers == comparisons.observers
    assert observers_in_comparisons(comparisons, level=0.0, shuffles=0).outliers == ()


# Who missed the obvious, and which place was preferred where there was nothing to prefer.

ANSWERS = [("a", "b"), ("b", "a"), ("a", "b")]


def _with(session: SessionLog, *data: dict[str, object]) -> SessionLog:
    pair = {"first": "a", "second": "b"}
    trials = [new_answer(2, n, "all_pairs", (), 1.0, data={**pair, **one}) for n, one in enumerate(data)]
    return replace(session, records=(*session.answers, *trials))


def _sessions(make_session: Maker) -> list[SessionLog]:
    def obvious(*right: bool) -> list[dict[str, object]]:
        return [{"catch": "obvious", "correct": correct, "answer": "first"} for correct in right]

    def identical(*answers: str) -> list[dict[str, object]]:
        return [{"catch": "identical", "answer": answer} for answer in answers]

    return [
        _with(make_session("01", names="ab", answers=ANSWERS), *obvious(True, True), *identical("first", "second")),
        _with(make_session("02", names="ab", answers=ANSWERS), *obvious(False, True), *identical("first", "not_sure")),
        _with(make_session("03", names="ab", answers=ANSWERS), {"answer": "no_difference"}),
    ]


def test_they_are_counted_by_observer(make_session: Maker) -> None:
    results = catch_results(_sessions(make_session))
    assert results.obvious == 4
    assert results.missed == {"02": (1, 2)}
    assert results.identical == IdenticalPairs(4, 2, 1)


def test_the_last_attempt_counts(make_session: Maker) -> None:
    session = _sessions(make_session)[1]
    wrong = next(trial for trial in session.answers if trial.details().get("correct") is False)
    again = changed(wrong, attempt=1, data={**wrong.details(), "correct": True})
    assert catch_results([replace(session, records=(*session.answers, again))]).missed == {}


def test_the_report_says_so(make_session: Maker) -> None:
    summary = summarise(_sessions(make_session))
    notes = " ".join(summary.notes)
    assert "1 of 10 answers prefers neither" in notes
    assert "02 (1 of 2)" in notes
    assert "Of 4 pairs of a stimulus with itself" in notes
    told = summary.to_json()
    assert told["ties"] == 1
    assert told["catch"]["missed"] == {"02": [1, 2]}
    assert summary.trials == 9


def test_without_them_nothing_is_said(make_session: Maker) -> None:
    summary = summarise([make_session("01", names="ab", answers=ANSWERS)])
    assert not [note for note in summary.notes if "atch" in note or "neither" in note or "itself" in note]


def test_practice_does_not_count(make_session: Maker) -> None:
    session = _sessions(make_session)[1]
    practised = replace(session, records=tuple(changed(trial, kind="practice") for trial in session.answers))
    results = catch_results([practised])
    assert (results.obvious, results.missed, results.identical.trials) == (0, {}, 0)


# Leaving observers out by a stated rule, with reasons, and never otherwise.


def adding(session: SessionLog, kind: str, *data: dict[str, Any]) -> SessionLog:
    first = len(session.answers)
    trials = [
        new_answer(2, first + n, kind, (), 1.0, data={"first": "a", "second": "b", **one}) for n, one in enumerate(data)
    ]
    return replace(session, records=(*session.answers, *trials))


def caught(session: SessionLog, *right: bool) -> SessionLog:
    return adding(session, "all_pairs", *({"catch": "obvious", "correct": one, "answer": "first"} for one in right))


def screened(session: SessionLog, *, passed: bool, test: str = "stereo_acuity") -> SessionLog:
    outcome = {"passed": passed, "threshold": 80.0, "estimate": None, "pass_mark": 140.0, "unit": "arcsec"}
    return adding(session, "screening", {"test": test, "outcome": outcome})


@pytest.fixture
def four(make_session: Maker) -> list[SessionLog]:
    def session(observer: str) -> SessionLog:
        return make_session(observer, names="ab", answers=ANSWERS)

    return [
        screened(caught(session("01"), True, True), passed=True),
        screened(caught(session("02"), False, True, False), passed=False),
        caught(session("03"), False),
        session("04"),
    ]


def names(sessions: tuple[SessionLog, ...]) -> list[str]:
    return [session.header.observer for session in sessions]


def test_nobody_is_left_out_without_being_asked(four: list[SessionLog]) -> None:
    kept = keep(four, Filter())
    assert kept.sessions == tuple(four)
    assert kept.left_out == {}
    assert kept.rule.sentence == "No observer left out."


@pytest.mark.parametrize(
    ("rule", "left_out"),
    [
        (Filter(without=("04",)), {"04": ("by hand",)}),
        (Filter(most_missed=1), {"02": ("missed 2 of 3 obvious catch trials",)}),
        (
            Filter(most_missed=0),
            {"02": ("missed 2 of 3 obvious catch trials",), "03": ("missed 1 of 1 obvious catch trials",)},
        ),
        (Filter(screening=()), {"02": ("failed the vision screening: stereo acuity",)}),
        (Filter(screening=("stereo_acuity",)), {"02": ("failed the vision screening: stereo acuity",)}),
        (Filter(screening=("near_acuity",)), {}),
        (
            Filter(screening=(), unscreened="leave_out"),
            {
                "02": ("failed the vision screening: stereo acuity",),
                "03": ("was not screened",),
                "04": ("was not screened",),
            },
        ),
        (
            Filter(without=("02",), most_missed=1, screening=()),
            {"02": ("by hand", "missed 2 of 3 obvious catch trials", "failed the vision screening: stereo acuity")},
        ),
    ],
)
def test_who_and_why(four: list[SessionLog], rule: Filter, left_out: dict[str, tuple[str, ...]]) -> None:
    kept = keep(four, rule)
    assert kept.left_out == left_out
    assert names(kept.sessions) == [name for name in ("01", "02", "03", "04") if name not in left_out]
    assert set(from_sessions(kept.sessions).observers) == set(names(kept.sessions))
    assert kept.to_json()["left_out"] == {name: list(why) for name, why in left_out.items()}


def test_the_rule_in_words() -> None:
    rule = Filter(without=("07", "09"), most_missed=1, screening=("stereo_acuity",), unscreened="leave_out")
    for words in ("07, 09 left out by hand", "more than 1 obvious catch trial", "(stereo_acuity)", "unscreened ones"):
        assert words in rule.sentence


def test_who_was_left_out_in_words(four: list[SessionLog]) -> None:
    kept = keep(four, Filter(without=("04",), most_missed=1))
    assert kept.sentence.startswith("Left out: 02 (missed 2 of 3")
    assert kept.to_json()["kept"] == ["01", "03"]
    assert keep(four, Filter()).sentence == "Nobody was left out."


def test_an_observer_is_kept_or_left_out_as_a_whole(make_session: Maker, four: list[SessionLog]) -> None:
    again = caught(make_session("01", names="ab", answers=ANSWERS, session="later"), False)
    assert names(keep([*four, again], Filter(most_missed=0)).sessions) == ["04"]


def test_the_last_screening_counts(make_session: Maker) -> None:
    early = make_session("01", names="ab", answers=ANSWERS, started_utc="2026-01-01T00:00:00Z")
    late = make_session("01", names="ab", answers=ANSWERS, started_utc="2026-02-01T00:00:00Z")
    failed, passed = screened(early, passed=False), screened(late, passed=True)
    assert passed_screening([passed, failed]) is True
    assert passed_screening([screened(late, passed=False), screened(early, passed=True)]) is False
    assert passed_screening([early, late]) is None


@pytest.mark.parametrize(
    ("rule", "what"),
    [
        (Filter(without=("7",)), "no observer '7' to leave out"),
        (Filter(most_missed=-1), "no observer can miss -1"),
        (Filter(without=("01", "02", "03", "04")), "leaves no observer .*01: by hand"),
    ],
)
def test_a_rule_that_cannot_be_meant_is_refused(four: list[SessionLog], rule: Filter, what: str) -> None:
    with pytest.raises(ResultsError, match=what):
        keep(four, rule)


def test_no_sessions_stay_none() -> None:
    assert keep([], Filter()).sessions == ()


def test_catch_trials_of_all_sessions_are_counted_once_each(four: list[SessionLog]) -> None:
    same = adding(
        four[1], "all_pairs", *({"catch": "identical", "answer": to} for to in ("first", "second", "not_sure"))
    )
    practised = caught(four[0], False)
    practised = replace(practised, records=tuple(changed(one, kind="practice") for one in practised.answers))
    assert catch_answers([same, practised]) == CatchAnswers(3, 1, IdenticalPairs(3, 1, 1))
    wrong = next(trial for trial in same.answers if trial.details().get("correct") is False)
    again = changed(wrong, attempt=1, data={**wrong.details(), "correct": True})
    assert catch_answers([replace(same, records=(*same.answers, again))]).missed == 1
    assert catch_answers([]).to_json()["obvious"] == 0


# Observers of pairs within groups are judged over all groups.

GROUPS = ("church", "beach")


def drawn(seed: int, *, items: int = 4, observers: int = 7, turned: str = "", ties: float = 0.0) -> list[Answer]:
    """Every pair within two groups, once by each observer; one observer's answers may be ``turned``."""
    random = np.random.default_rng(seed)
    theta = np.linspace(1.2, -1.2, items)
    answers = []
    for observer, group, (i, j) in product(range(observers), GROUPS, combinations(range(items), 2)):
        wins = bool(random.random() < 1 / (1 + np.exp(theta[j] - theta[i])))
        name = f"{observer:02}"
        winner, loser = (i, j) if wins != (name == turned) else (j, i)
        tie = bool(random.random() < ties)
        answers.append(Answer(f"codec {winner}", f"codec {loser}", observer=name, tie=tie, group=group))
    return answers


def own_names(answers: list[Answer]) -> list[Answer]:
    return [
        replace(answer, winner=f"{answer.group} {answer.winner}", loser=f"{answer.group} {answer.loser}")
        for answer in answers
    ]


@pytest.mark.parametrize("ties", [0.0, 0.2])
def test_names_of_items_in_several_groups_change_nothing(ties: float) -> None:
    answers = drawn(1, ties=ties)
    shared, apart = (observers_in_comparisons(from_answers(part)) for part in (answers, own_names(answers)))
    for one, other in zip(shared.lines, apart.lines, strict=True):
        assert one.consistency == other.consistency
        assert one.repeats is None
        assert known(one.fit).z == pytest.approx(known(other.fit).z, rel=1e-12)
        assert known(other.fit).most_moved.endswith(")")
    assert shared.concordance == apart.concordance


def test_one_group_is_no_other_than_none() -> None:
    answers = [answer for answer in drawn(2, ties=0.1) if answer.group == "church"]
    grouped, plain = from_answers(answers), without_groups(from_answers(answers))
    assert observers_in_comparisons(grouped).concordance == observers_in_comparisons(plain).concordance
    assert consistencies(grouped) == consistencies(plain)
    for one, other in zip(fits_to_rest(grouped), fits_to_rest(plain), strict=True):
        assert other is not None
        assert replace(known(one), most_moved="") == replace(other, most_moved="")
        assert known(one).most_moved == f"{other.most_moved} (church)"


@pytest.mark.parametrize("items", [3, 4])
def test_circular_triads_add_up_over_groups_and_so_do_their_chances(items: int) -> None:
    comparisons = from_answers(drawn(3, items=items, observers=4))
    parts = [part for _, part in split_groups(comparisons)]
    every = np.array(list(product((-1, 1), repeat=items * (items - 1) // 2)), dtype=np.int8)
    tossed = np.zeros((len(every), items, items), dtype=np.int8)
    upper = np.triu_indices(items, 1)
    tossed[:, upper[0], upper[1]], tossed[:, upper[1], upper[0]] = every, -every
    counts = circular_triads(tossed, ~np.eye(items, dtype=np.bool_))
    both = (counts[:, None] + counts).ravel()
    for person, found in enumerate(consistencies(comparisons)):
        single = [
            circular_triads(verdict[None], compared)[0]
            for part in parts
            for _, verdict, compared in [list(verdicts(part))[person]]
        ]
        assert found.circular == sum(single)
        assert found.triads == 2 * (1 if items == 3 else 4)
        assert found.zeta == pytest.approx(1 - sum(single) / (2 * (1 if items == 3 else 2)))
        assert known(found.test).exact
        assert known(found.test).p == pytest.approx(float((both <= found.circular).mean()), abs=1e-12)


def test_agreement_is_over_the_pairs_of_all_groups() -> None:
    answers = drawn(5)
    together = known(kendall_u(from_answers(answers)))
    parts = [kendall_u(part) for _, part in split_groups(from_answers(answers))]
    assert together.agreements == sum(part.agreements for part in parts if part)
    assert together.shared == sum(part.shared for part in parts if part)
    assert together.observers == 7
    assert together.chi_square is not None
    assert known(together.strangers_p) < 0.01
    # The same verdicts, but each observer's items renamed within each group: unrelated preferences.
    random = np.random.default_rng(1)
    names = {key: random.permutation(4) for key in product([f"{o:02}" for o in range(7)], GROUPS)}
    strangers = [
        replace(
            a,
            winner=f"codec {names[a.observer, a.group][int(a.winner[-1])]}",
            loser=f"codec {names[a.observer, a.group][int(a.loser[-1])]}",
        )
        for a in answers
    ]
    apart = known(kendall_u(from_answers(strangers)))
    assert known(apart.strangers_p) > 0.1


def test_the_fit_to_the_others_adds_up_over_groups() -> None:
    comparisons = from_answers(drawn(6))
    parts = [fits_to_rest(part) for _, part in split_groups(comparisons)]
    for person, found in enumerate(fits_to_rest(comparisons)):
        single = [lines[person] for lines in parts]
        off = [6 * (line.mean_log_likelihood - line.expected) for line in single if line]
        variance = [(value / line.z) ** 2 for value, line in zip(off, single, strict=True) if line]
        assert known(found).z == pytest.approx(sum(off) / np.sqrt(sum(variance)), rel=1e-9)
        assert abs(known(found).influence) == pytest.approx(max(abs(line.influence) for line in single if line))


def test_a_pair_in_two_groups_is_not_repeated() -> None:
    once = [Answer("a", "b", observer="01", group=group) for group in GROUPS]
    assert self_agreements(from_answers(once)) == (None,)
    again = known(self_agreements(from_answers([*once, Answer("b", "a", observer="01", group="beach")]))[0])
    assert (again.repeated, again.alike, again.twos) == (1, 0, 1)
