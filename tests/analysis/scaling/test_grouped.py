"""Scores within groups, the pooled scale, and the test whether groups agree."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, replace

import numpy as np
import pytest

from analysis.comparisons import Answer, Comparisons, from_answers
from analysis.errors import ResultsError
from analysis.scaling import (
    GroupedScores,
    Model,
    agreement_lines,
    common_items,
    group_agreement,
    group_problem_lines,
    score,
    score_groups,
)
from documents.arrays import Floats

GROUPS = ("church", "beach", "night")
ITEMS = "abcd"


def drawn(
    seed: int, *, observers: int = 6, ties: bool = False, shift: float = 0.0, own_names: bool = False
) -> list[Answer]:
    """Every pair of four items within three groups; ``shift`` nats more for item a in the last group."""
    random = np.random.default_rng(seed)
    answers = []
    for observer in range(observers):
        for group in GROUPS:
            theta = dict(zip(ITEMS, (shift * (group == GROUPS[-1]), 0.4, 0.0, -0.4), strict=True))
            for i, one in enumerate(ITEMS):
                for other in ITEMS[i + 1 :]:
                    wins = random.random() < 1 / (1 + np.exp(theta[other] - theta[one]))
                    winner, loser = (one, other) if wins else (other, one)
                    first = str(random.choice([winner, loser]))
                    names = {item: f"{group} {item}" if own_names else item for item in ITEMS}
                    tie = ties and bool(random.random() < 0.3)
                    answers.append(Answer(names[winner], names[loser], 1, f"{observer:02}", names[first], tie, group))
    return answers


def test_each_group_is_scored_as_by_itself_and_the_pooled_scale_as_all_answers() -> None:
    answers = drawn(1, shift=1.0)
    grouped = score_groups(from_answers(answers, ITEMS), alpha=0.1, adjust="none")
    assert [name for name, _ in grouped.groups] == list(GROUPS)
    for name, scores in grouped.groups:
        alone = score(
            from_answers([replace(a, group="") for a in answers if a.group == name], ITEMS), alpha=0.1, adjust="none"
        )
        assert scores.to_json() == alone.to_json()
    assert grouped.pooled is not None
    whole = score(from_answers([replace(answer, group="") for answer in answers], ITEMS), alpha=0.1, adjust="none")
    assert grouped.pooled.to_json() == whole.to_json()
    assert grouped.notes == ()


def test_common_names_pool_as_names_that_recur() -> None:
    recurring = score_groups(from_answers(drawn(2)))
    factors = {f"{group} {item}": {"scene": group, "codec": item} for group in GROUPS for item in ITEMS}
    common = score_groups(from_answers(drawn(2, own_names=True)), common=common_items(factors, "scene"))
    apart = score_groups(from_answers(drawn(2, own_names=True)))
    assert common.pooled is not None
    assert recurring.pooled is not None
    assert common.pooled.to_json() == recurring.pooled.to_json()
    assert common.agreement is not None
    assert recurring.agreement is not None
    one, other = asdict(common.agreement), asdict(recurring.agreement)
    assert one.pop("missing") is other.pop("missing") is None
    assert one == pytest.approx(other, rel=1e-12)
    assert apart.pooled is None
    assert apart.agreement is None
    (line,) = agreement_lines(apart)
    assert line.startswith("No pooled scale")


def statistic_by_differences(answers: list[Answer], grouped: GroupedScores, model: Model, ordered: bool) -> float:
    """The score statistic from numerical derivatives of the log likelihood with strengths of every group."""
    pooled = grouped.pooled
    assert pooled is not None
    values = {parameter.name: parameter.estimate for parameter in pooled.fit.parameters}
    strengths = dict(zip(pooled.comparisons.items, pooled.fit.theta.tolist(), strict=True))
    places = {(group, item): k for k, (group, item) in enumerate((g, i) for g in GROUPS for i in ITEMS)}
    point = np.array([strengths[item] for _, item in places])
    point = np.r_[point, [values["nu"]] if model == "davidson" else [], [values["order"]] if ordered else []]

    def log_likelihood(at: Floats, answer: Answer) -> float:
        one, other = (at[places[answer.group, item]] for item in (answer.winner, answer.loser))
        push = (at[-1] if answer.first == answer.winner else -at[-1]) if ordered else 0.0
        d = one - other + push
        nu = np.exp(at[len(places)]) if model == "davidson" else 0.0
        total = np.exp(d / 2) + np.exp(-d / 2) + nu
        return float(np.log((nu if answer.tie else np.exp(d / 2)) / total))

    kept = [answer for answer in answers if model == "davidson" or not answer.tie]
    size, step = len(point), 1e-3
    eye = np.eye(size) * step

    def whole(at: Floats) -> float:
        return sum(log_likelihood(at, answer) for answer in kept)

    slope = np.array([(whole(point + e) - whole(point - e)) / (2 * step) for e in eye])
    information = np.empty((size, size))
    for i in range(size):
        for j in range(size):
            ends = [whole(point + a * eye[i] + b * eye[j]) * a * b for a in (1, -1) for b in (1, -1)]
            information[i, j] = -sum(ends) / (4 * step**2)
    return float(slope @ np.linalg.pinv(information, rcond=1e-4, hermitian=True) @ slope)


@pytest.mark.parametrize(("model", "ordered"), [("bradley-terry", False), ("davidson", True)])
def test_the_statistic_is_that_of_a_direct_computation(model: Model, ordered: bool) -> None:
    answers = drawn(3, observers=4, ties=True, shift=1.0)
    grouped = score_groups(from_answers(answers), model, order_effect=ordered)
    assert grouped.agreement is not None
    assert grouped.agreement.df == 6
    expected = statistic_by_differences(answers, grouped, model, ordered)
    assert grouped.agreement.statistic == pytest.approx(expected, rel=2e-5)


def test_groups_that_differ_are_seen_and_the_same_ones_are_not() -> None:
    same, other = (score_groups(from_answers(drawn(4, observers=20, shift=s))).agreement for s in (0.0, 3.0))
    assert same is not None
    assert other is not None
    assert same.p is not None
    assert other.p is not None
    assert same.p > 0.2
    assert other.p < 0.01


def test_names_and_order_of_answers_change_nothing() -> None:
    answers = drawn(5, shift=1.0)
    forward, backward = (score_groups(from_answers(part)).agreement for part in (answers, answers[::-1]))
    assert forward is not None
    assert backward is not None
    assert backward.p == pytest.approx(forward.p, rel=1e-9)
    assert backward.statistic == pytest.approx(forward.statistic, rel=1e-9)


def test_many_observers_are_taken_together_in_units(monkeypatch: pytest.MonkeyPatch) -> None:
    comparisons = from_answers(drawn(13, observers=40, shift=1.0))
    each = score_groups(comparisons).agreement
    monkeypatch.setattr(group_agreement, "MOST_UNITS", 20)
    units = score_groups(comparisons).agreement
    assert each is not None
    assert units is not None
    assert units.statistic == pytest.approx(each.statistic, rel=1e-9)
    assert (units.df, units.observers) == (each.df, 40)
    assert units.f == pytest.approx(each.f, rel=0.3)
    assert units.f != each.f


def test_groups_that_nothing_links_have_no_test_whatever_the_prior() -> None:
    answers = [
        Answer(pair[0], pair[1], observer=observer, group=group)
        for observer in "12345"
        for group, pairs in {"x": "ab", "y": "ab", "z": "cd"}.items()
        for pair in (pairs, pairs[::-1])
    ]
    grouped = score_groups(from_answers(answers), method="map", prior_sd=1.0)
    assert grouped.pooled is not None
    assert grouped.pooled.fit.held_by_prior is not None
    assert grouped.agreement is None


def test_without_observers_there_is_only_the_test_of_independent_answers() -> None:
    agreement = score_groups(from_answers([replace(answer, observer="") for answer in drawn(6)])).agreement
    assert agreement is not None
    assert agreement.p is None
    assert 0 < agreement.p_model < 1


def test_groups_that_share_one_item_have_nothing_to_disagree_about() -> None:
    answers = [
        Answer(*pair, observer=observer, group=group)
        for observer in "12345"
        for group in "xyz"
        for pair in (("anchor", group), (group, "anchor"), ("anchor", group))
    ]
    grouped = score_groups(from_answers(answers))
    assert grouped.agreement is None
    assert grouped.pooled is not None
    assert grouped.pooled.fit.separation is None


def test_pairs_across_groups_count_on_the_pooled_scale_alone() -> None:
    inside = drawn(7, own_names=True)
    links = [Answer(f"{g} a", f"{h} a", 2) for g in GROUPS for h in GROUPS if g != h]
    grouped = score_groups(from_answers([*inside, *links]))
    assert [scores.to_json() for _, scores in grouped.groups] == [
        scores.to_json() for _, scores in score_groups(from_answers(inside)).groups
    ]
    assert grouped.agreement is None
    assert grouped.pooled is not None
    whole = score(from_answers([replace(answer, group="") for answer in [*inside, *links]]))
    assert grouped.pooled.to_json() == whole.to_json()
    factors = {f"{group} {item}": {"scene": group, "codec": item} for group in GROUPS for item in ITEMS}
    common = score_groups(from_answers([*inside, *links]), common=common_items(factors, "scene"))
    assert common.agreement == score_groups(from_answers(inside), common=common_items(factors, "scene")).agreement
    assert any("across groups" in note for note in common.notes)


def test_a_group_without_finite_scores_is_named() -> None:
    answers = [a for a in drawn(8) if not (a.group == "beach" and a.loser == "a")]
    grouped = score_groups(from_answers(answers))
    lines = group_problem_lines(grouped)
    assert lines[0].startswith("the group 'beach'")
    assert sum("no finite scores" in line for line in lines) == 1
    assert grouped.agreement is not None
    assert json.loads(json.dumps(grouped.to_json(), allow_nan=False))["groups"][1]["items"][0]["theta"] is None


def refused(make: Callable[[], object]) -> list[str]:
    with pytest.raises(ResultsError) as raised:
        make()
    assert all(finding.remedy for finding in raised.value.findings)
    return [finding.message for finding in raised.value.findings]


def test_an_item_in_a_second_group_by_a_slip_is_named_with_its_answers() -> None:
    answers = drawn(9, own_names=True)
    answers[0] = replace(answers[0], group="night")
    first, second = refused(lambda: score_groups(from_answers(answers)))
    assert {first.split("'")[1], second.split("'")[1]} == {answers[0].winner, answers[0].loser}
    for message in (first, second):
        assert "'church' (17 answers) and 'night' (1" in message
        assert "(10 of 12)" in message
    meant = {answers[0].winner: answers[0].winner}
    assert score_groups(from_answers(answers), common=meant).pooled is not None


def test_wrong_common_names_are_refused() -> None:
    comparisons = from_answers(drawn(10, own_names=True), ["church a", "church b"])
    assert refused(lambda: score_groups(comparisons, common={"church a": "x", "church b": "x"})) == [
        "'church a' and 'church b' of the group 'church' have the same common name 'x'"
    ]
    assert refused(lambda: score_groups(comparisons, common={"chruch a": "x"})) == ["there is no item 'chruch a'"]


def test_what_a_group_cannot_do_is_said_with_its_name() -> None:
    comparisons: Comparisons = from_answers([a for a in drawn(11, ties=True) if a.group != "beach" or not a.tie])
    assert refused(lambda: score_groups(comparisons, "davidson")) == [
        "the group 'beach': no answer is a tie, and the model 'davidson' is about ties"
    ]
    assert refused(lambda: score_groups(from_answers([Answer("a", "b")]))) == ["the comparisons have no groups"]


def test_observers_of_one_group_are_noted() -> None:
    answers = drawn(12)
    some = score_groups(from_answers([a for a in answers if a.observer != "03" or a.group == "beach"]))
    assert len(some.notes) == 1
    assert some.notes[0].startswith("1 observer of 6")
    apart = [a for a in answers if GROUPS[int(a.observer) % 3] == a.group]
    assert score_groups(from_answers(apart)).notes[0].startswith("No observer judged")
