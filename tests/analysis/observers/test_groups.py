"""Observers of pairs within groups are judged over all groups."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, product

import numpy as np
import pytest

from analysis.comparisons import Answer, from_answers, split_groups, without_groups
from analysis.observers import observers_in_comparisons
from analysis.observers.concordance import kendall_u
from analysis.observers.consistency import circular_triads, consistencies, verdicts
from analysis.observers.fit_to_rest import fits_to_rest
from analysis.observers.responses import self_agreements
from tests.kept import known

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
        assert one.fit is not None
        assert other.fit is not None
        assert one.fit.z == pytest.approx(other.fit.z, rel=1e-12)
        assert other.fit.most_moved.endswith(")")
    assert shared.concordance == apart.concordance


def test_one_group_is_no_other_than_none() -> None:
    answers = [answer for answer in drawn(2, ties=0.1) if answer.group == "church"]
    grouped, plain = from_answers(answers), without_groups(from_answers(answers))
    assert observers_in_comparisons(grouped).concordance == observers_in_comparisons(plain).concordance
    assert consistencies(grouped) == consistencies(plain)
    for one, other in zip(fits_to_rest(grouped), fits_to_rest(plain), strict=True):
        assert one is not None
        assert other is not None
        assert replace(one, most_moved="") == replace(other, most_moved="")
        assert one.most_moved == f"{other.most_moved} (church)"


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
        assert found.test is not None
        assert found.test.exact
        assert found.test.p == pytest.approx(float((both <= found.circular).mean()), abs=1e-12)


def test_agreement_is_over_the_pairs_of_all_groups() -> None:
    answers = drawn(5)
    together = kendall_u(from_answers(answers))
    parts = [kendall_u(part) for _, part in split_groups(from_answers(answers))]
    assert together is not None
    assert together.agreements == sum(part.agreements for part in parts if part)
    assert together.shared == sum(part.shared for part in parts if part)
    assert together.observers == 7
    assert together.chi_square is not None
    assert together.strangers_p is not None
    assert together.strangers_p < 0.01
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
    assert apart.strangers_p is not None
    assert apart.strangers_p > 0.1


def test_the_fit_to_the_others_adds_up_over_groups() -> None:
    comparisons = from_answers(drawn(6))
    parts = [fits_to_rest(part) for _, part in split_groups(comparisons)]
    for person, found in enumerate(fits_to_rest(comparisons)):
        assert found is not None
        single = [lines[person] for lines in parts]
        off = [6 * (line.mean_log_likelihood - line.expected) for line in single if line]
        variance = [(value / line.z) ** 2 for value, line in zip(off, single, strict=True) if line]
        assert found.z == pytest.approx(sum(off) / np.sqrt(sum(variance)), rel=1e-9)
        assert abs(found.influence) == pytest.approx(max(abs(line.influence) for line in single if line))


def test_a_pair_in_two_groups_is_not_repeated() -> None:
    once = [Answer("a", "b", observer="01", group=group) for group in GROUPS]
    assert self_agreements(from_answers(once)) == (None,)
    again = known(self_agreements(from_answers([*once, Answer("b", "a", observer="01", group="beach")]))[0])
    assert (again.repeated, again.alike, again.twos) == (1, 0, 1)
